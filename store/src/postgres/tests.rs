//! The shared store on a real database: what it promises as any store does, and what only it must.

use std::sync::Arc;

use super::*;
use crate::id::Clock;
use crate::testkit::{Subject, conformance};

mod server;

use server::{Server, server};

struct OnPostgres {
    shared: Shared,
    clock: Arc<dyn Clock>,
    store: Option<PostgresStore>,
}

impl Subject for OnPostgres {
    fn store(&self) -> &dyn JobStore {
        self.store.as_ref().unwrap()
    }

    fn restart(&mut self) {
        drop(self.store.take());
        self.store = Some(PostgresStore::open_at(&self.shared, Arc::clone(&self.clock)).unwrap());
    }
}

#[test]
fn conforms() {
    let Some(server) = server() else { return };
    conformance(&|clock| {
        let shared = server.schema("daemon");
        let store = Some(PostgresStore::open_at(&shared, Arc::clone(&clock)).unwrap());
        Box::new(OnPostgres { shared, clock, store })
    });
}
