//! The same farm on PostgreSQL: its own leases, fences, shares and order, under the farm's clock.

use std::sync::Arc;

use super::ground::{Flaw, Ground, LEASE, Seat};
use super::stage::Scale;
use super::tests::run;
use crate::id::Clock;
use crate::job::{Job, Step, Testimony};
use crate::store::{Claim, Filter, JobStore, Lease, Recovered, StoreError};
use crate::testkit::ManualClock;
use crate::testkit::server::Server;
use crate::{PostgresStore, Shared};

impl Seat for PostgresStore {
    fn store(&self, call: &mut dyn FnMut(&dyn JobStore)) {
        call(self);
    }

    fn has(&self, want: &Filter) -> Result<bool, StoreError> {
        Ok(JobStore::has_parked(self)? || JobStore::waiting(self, want)?.is_some())
    }

    fn claim(&self, want: &Filter) -> Result<Option<Claim>, StoreError> {
        JobStore::claim(self, want)
    }

    fn heartbeat(&self, claim: &Claim) -> Result<Lease, StoreError> {
        JobStore::heartbeat(self, claim)
    }

    fn advance(&self, claim: &Claim, step: Step) -> Result<Job, StoreError> {
        JobStore::advance(self, claim, step)
    }

    fn recover(&self) -> Result<Vec<Recovered>, StoreError> {
        JobStore::recover(self, &|_| Testimony::Outlived)
    }
}

struct OnPostgres {
    server: Server,
    clock: Arc<ManualClock>,
}

impl Ground for OnPostgres {
    fn begin(&self, daemon: &str) -> Arc<dyn Seat> {
        let lease = std::time::Duration::from_millis(LEASE);
        let folders = ["a", "b", "c"].map(str::to_owned);
        let joint = folders.iter().cloned().collect();
        let shared = Shared { connections: 2, lease, joint, ..Shared::new(&self.server.url(), daemon) };
        let shared = Shared { folders: Some(folders.into()), ..shared };
        Arc::new(PostgresStore::open_at(&shared, Arc::clone(&self.clock) as Arc<dyn Clock>).unwrap())
    }

    fn restart(&self) {
        self.server.kill();
        self.server.run();
    }
}

/// Few jobs, since each call waits for a disk. A daemon's own sign of life comes by the real clock: one that a farm has stopped may give it once.
#[test]
fn a_farm_on_postgresql() {
    let Some(server) = Server::start() else { return };
    let scale = Scale { jobs: 60, hosts: 3, slots: 2, trouble: 60 };
    let told = run(0, scale, Flaw::None, |clock| (Box::new(OnPostgres { server, clock: Arc::clone(clock) }), false));
    assert!(told.claims > scale.jobs, "{told:?}");
}
