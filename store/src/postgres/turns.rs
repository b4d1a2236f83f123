//! Whose jobs may be claimed, and how folders share the work, as statements take it.

use sqlx::Executor;
use sqlx::postgres::{PgConnection, PgTransaction};

use super::database::Failure;
use super::outbox::LOCKS;
use super::row::int;
use crate::share::{Shares, Weight};

/// What is said of folders.
pub(super) struct Folders {
    pub(super) shut: Vec<String>,
    names: Vec<String>,
    /// Of turns of those that have names.
    lengths: Vec<i64>,
    limits: Vec<Option<i64>>,
}

impl Folders {
    pub(super) fn new(shut: Vec<String>, shares: &Shares) -> Self {
        Self {
            shut,
            names: shares.keys().cloned().collect(),
            lengths: shares.values().map(|share| int(share.weight.turn())).collect(),
            limits: shares.values().map(|share| share.most_running.map(|most| i64::from(most.get()))).collect(),
        }
    }

    /// Must claims go one after the other, since each counts what others have?
    pub(super) fn has_limits(&self) -> bool {
        self.limits.iter().any(Option::is_some)
    }

    /// Binds what is said of turns, the last parameters of a statement.
    pub(super) fn bind<'q>(
        &'q self,
        query: sqlx::query::Query<'q, sqlx::Postgres, sqlx::postgres::PgArguments>,
    ) -> sqlx::query::Query<'q, sqlx::Postgres, sqlx::postgres::PgArguments> {
        query.bind(&self.names).bind(&self.lengths).bind(&self.limits).bind(int(Weight::default().turn()))
    }
}

/// For the rest of the transaction no one else claims who has a limit. The statement after this sees all claims before.
pub(super) async fn alone(transaction: &mut PgTransaction<'_>) -> Result<(), Failure> {
    let connection: &mut PgConnection = transaction;
    let lock = sqlx::query("SELECT pg_advisory_xact_lock($1, hashtext(current_schema() || '/limits'))").bind(LOCKS);
    connection.execute(lock).await?;
    Ok(())
}
