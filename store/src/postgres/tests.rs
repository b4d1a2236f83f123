//! The shared store on a real database: what it promises as any store does, and what only it must.

use std::collections::BTreeMap;
use std::sync::Arc;

use sqlx::{AssertSqlSafe, Connection};

use super::*;
use crate::id::Clock;
use crate::testkit::{Subject, conformance};

mod claims;
mod farm;
mod figures;
mod hosts;
mod lost;
mod order;
mod outage;
mod schema;
mod served;
mod server;
mod steps;
mod transfer;
mod version_2;

use server::{Schemas, Server, server};

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

/// Statements by whoever the address names, in the store's schema.
fn sql(shared: &Shared, statements: &str) -> Result<(), sqlx::Error> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let mut connection = PgConnection::connect(&shared.url).await?;
        let statements = format!("SET search_path = {}; {statements}", shared.schema);
        sqlx::raw_sql(AssertSqlSafe(statements)).execute(&mut connection).await?;
        connection.close().await
    })
}

/// The same store, seen by another daemon.
fn other(shared: &Shared, daemon: &str) -> Shared {
    Shared { daemon: daemon.to_owned(), ..shared.clone() }
}
