//! Subscribers and what they have not heard of.

use sqlx::postgres::{PgConnection, PgRow};
use sqlx::{Connection, Row};

use super::claim::Life;
use super::database::Failure;
use super::outbox;
use super::row::{int, number};
use crate::id::{JobId, Seq};
use crate::job::Job;
use crate::news::{Notice, Word};
use crate::record;

/// Removes what everyone has heard.
const PRUNE: &str = "DELETE FROM outbox WHERE seq <= (SELECT coalesce(min(heard), 9223372036854775807) FROM subscribers)";

/// What a teller tells: ends of jobs of its folders and news of them, and its own news. Its parameters: $1 teller, $2 folders.
macro_rules! told_by_daemon {
    () => {
        "($2::text[] IS NULL OR coalesce(o.folder = ANY ($2), o.daemon = $1, true))"
    };
}

/// As [`crate::JobStore::subscribe`]. Each teller has subscribers of its own.
pub(super) async fn subscribe(connection: &mut PgConnection, life: &Life, names: &[String]) -> Result<(), Failure> {
    let mut transaction = connection.begin().await?;
    let last = outbox::alone(&mut transaction).await?;
    let gone = "DELETE FROM subscribers WHERE daemon = $1 AND name <> ALL ($2)";
    sqlx::query(gone).bind(&life.teller).bind(names).execute(&mut *transaction).await?;
    let new = "INSERT INTO subscribers (daemon, name, heard)
        SELECT DISTINCT $1, name, $3::bigint FROM unnest($2::text[]) name ON CONFLICT DO NOTHING";
    sqlx::query(new).bind(&life.teller).bind(names).bind(int(last.0)).execute(&mut *transaction).await?;
    sqlx::query(PRUNE).execute(&mut *transaction).await?;
    Ok(transaction.commit().await?)
}

/// As [`crate::JobStore::notices`]. Of daemons that are one teller, one hears of them. Where none of the rest is the teller's, all of it counts as heard, so
/// that it may go.
pub(super) async fn notices(connection: &mut PgConnection, life: &Life, name: &str, most: usize) -> Result<Vec<Notice>, Failure> {
    const SOME: &str = "SELECT heard FROM subscribers
        WHERE daemon = $1 AND name = $2 AND EXISTS (SELECT 1 FROM outbox WHERE seq > heard) AND suture_tells($3, $4)";
    let some = sqlx::query(SOME).bind(&life.teller).bind(name).bind(int(life.epoch.0)).bind(life.lease);
    if most == 0 || some.fetch_optional(&mut *connection).await?.is_none() {
        return Ok(Vec::new());
    }
    let mut transaction = connection.begin().await?;
    let last = outbox::alone(&mut transaction).await?;
    transaction.commit().await?;
    let entries = concat!(
        "SELECT o.seq, o.job, o.record FROM outbox o JOIN subscribers s ON s.daemon = $1 AND s.name = $3 AND o.seq > s.heard
        WHERE o.seq <= $4 AND ",
        told_by_daemon!(),
        " ORDER BY o.seq LIMIT $5"
    );
    let rows = sqlx::query(entries)
        .bind(&life.teller)
        .bind(&life.folders)
        .bind(name)
        .bind(int(last.0))
        .bind(int(u64::try_from(most).unwrap_or(u64::MAX)))
        .fetch_all(&mut *connection)
        .await?;
    if rows.is_empty() {
        acknowledge(connection, life, name, last).await?;
    }
    rows.iter().map(entry).collect()
}

/// Reads a row with the columns `seq, job, record`.
pub(super) fn entry(row: &PgRow) -> Result<Notice, Failure> {
    let (seq, job): (i64, Option<i64>) = (row.try_get("seq")?, row.try_get("job")?);
    let (seq, bytes): (_, Vec<u8>) = (Seq(number(seq)), row.try_get("record")?);
    let key = outbox::key(job.map(|job| JobId(number(job))));
    Ok(match record::decode_notice(&key, &bytes)? {
        Notice::End(job) => Notice::End(Box::new(Job { seq, ..*job })),
        Notice::Word(word) => Notice::Word(Word { seq, ..word }),
    })
}

/// As [`crate::JobStore::acknowledge`].
pub(super) async fn acknowledge(connection: &mut PgConnection, life: &Life, name: &str, seq: Seq) -> Result<(), Failure> {
    let sql = "UPDATE subscribers SET heard = $3 WHERE daemon = $1 AND name = $2 AND heard < $3";
    let heard = sqlx::query(sql).bind(&life.teller).bind(name).bind(int(seq.0));
    if heard.execute(&mut *connection).await?.rows_affected() > 0 {
        sqlx::query(PRUNE).execute(connection).await?;
    }
    Ok(())
}

/// As [`crate::JobStore::backlog`].
pub(super) async fn backlog(connection: &mut PgConnection, life: &Life, name: &str) -> Result<u64, Failure> {
    let count = concat!(
        "SELECT count(*) AS count FROM outbox o JOIN subscribers s ON s.daemon = $1 AND s.name = $3 AND o.seq > s.heard WHERE ",
        told_by_daemon!()
    );
    let count = sqlx::query(count).bind(&life.teller).bind(&life.folders).bind(name);
    Ok(number(count.fetch_one(connection).await?.try_get("count")?))
}
