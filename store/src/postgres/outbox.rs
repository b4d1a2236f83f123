//! What subscribers have not heard yet, in the order of its numbers.
//!
//! Numbers are given before their transactions are durable, so that a lower one may appear after a higher one was heard and acknowledged. Hence
//! a lock of the database: whoever writes an entry shares it from before its number is taken until it is durable; whoever reads takes it alone for a
//! moment, and reads up to the last number that was given then. All entries up to there are visible.

use sqlx::postgres::PgConnection;
use sqlx::{Executor, Row};

use super::database::Failure;
use super::row::{int, number};
use crate::id::{JobId, Seq};
use crate::news::{News, Word};
use crate::record;

/// First half of the key of every lock that the store takes in the database, also in `suture_write`; the other is the schema's.
pub(super) const LOCKS: i32 = 0x5375_7475;

/// For the rest of the transaction, before the number is taken.
pub(super) async fn share(connection: &mut PgConnection) -> Result<(), Failure> {
    let lock = sqlx::query("SELECT pg_advisory_xact_lock_shared($1, hashtext(current_schema() || '/outbox'))").bind(LOCKS);
    connection.execute(lock).await?;
    Ok(())
}

/// For the rest of the transaction; the last number that was given.
pub(super) async fn alone(connection: &mut PgConnection) -> Result<Seq, Failure> {
    let lock = sqlx::query("SELECT pg_advisory_xact_lock($1, hashtext(current_schema() || '/outbox'))").bind(LOCKS);
    connection.execute(lock).await?;
    let last = sqlx::query("SELECT CASE WHEN is_called THEN last_value ELSE 0 END AS last FROM transitions");
    Ok(Seq(number(last.fetch_one(connection).await?.try_get("last")?)))
}

/// What the checksum of an entry is made with, beside its content: the number is given after it.
pub(super) fn key(job: Option<JobId>) -> [u8; 8] {
    job.unwrap_or_default().0.to_be_bytes()
}

/// Puts news in that `daemon` tells, if anyone is to hear of them.
pub(super) async fn put(connection: &mut PgConnection, daemon: &str, word: &Word) -> Result<(), Failure> {
    let folder = match &word.news {
        News::FolderAway { folder, .. } | News::FolderBack { folder } => Some(folder),
        News::Night { .. } => None,
    };
    let sql = "INSERT INTO outbox (seq, folder, daemon, record) SELECT $1, $2, $3, $4 WHERE EXISTS (SELECT 1 FROM subscribers)";
    let record = record::encode_word(&key(None), word)?;
    sqlx::query(sql).bind(int(word.seq.0)).bind(folder).bind(daemon).bind(record).execute(connection).await?;
    Ok(())
}
