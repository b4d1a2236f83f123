//! Subscribers and what they have not heard of.

use sqlx::postgres::{PgConnection, PgRow};
use sqlx::{Connection, Row};

use super::database::Failure;
use super::outbox;
use super::row::{int, number};
use crate::id::{JobId, Seq};
use crate::job::Job;
use crate::news::{Notice, Word};
use crate::record;

/// Removes what everyone has heard.
const PRUNE: &str = "DELETE FROM outbox WHERE seq <= (SELECT coalesce(min(heard), 9223372036854775807) FROM subscribers)";

/// As [`crate::JobStore::subscribe`].
pub(super) async fn subscribe(connection: &mut PgConnection, names: &[String]) -> Result<(), Failure> {
    let mut transaction = connection.begin().await?;
    let last = outbox::alone(&mut transaction).await?;
    sqlx::query("DELETE FROM subscribers WHERE name <> ALL ($1)").bind(names).execute(&mut *transaction).await?;
    sqlx::query("INSERT INTO subscribers (name, heard) SELECT DISTINCT name, $2::bigint FROM unnest($1::text[]) name ON CONFLICT DO NOTHING")
        .bind(names)
        .bind(int(last.0))
        .execute(&mut *transaction)
        .await?;
    sqlx::query(PRUNE).execute(&mut *transaction).await?;
    Ok(transaction.commit().await?)
}

/// As [`crate::JobStore::notices`].
pub(super) async fn notices(connection: &mut PgConnection, name: &str, most: usize) -> Result<Vec<Notice>, Failure> {
    const SOME: &str = "SELECT heard FROM subscribers WHERE name = $1 AND EXISTS (SELECT 1 FROM outbox WHERE seq > heard)";
    if most == 0 || sqlx::query(SOME).bind(name).fetch_optional(&mut *connection).await?.is_none() {
        return Ok(Vec::new());
    }
    let mut transaction = connection.begin().await?;
    let last = outbox::alone(&mut transaction).await?;
    transaction.commit().await?;
    let entries = "SELECT o.seq, o.job, o.record FROM outbox o JOIN subscribers s ON s.name = $1 AND o.seq > s.heard
        WHERE o.seq <= $2 ORDER BY o.seq LIMIT $3";
    let most = int(u64::try_from(most).unwrap_or(u64::MAX));
    let rows = sqlx::query(entries).bind(name).bind(int(last.0)).bind(most).fetch_all(connection).await?;
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
pub(super) async fn acknowledge(connection: &mut PgConnection, name: &str, seq: Seq) -> Result<(), Failure> {
    let heard = sqlx::query("UPDATE subscribers SET heard = $2 WHERE name = $1 AND heard < $2").bind(name).bind(int(seq.0));
    if heard.execute(&mut *connection).await?.rows_affected() > 0 {
        sqlx::query(PRUNE).execute(connection).await?;
    }
    Ok(())
}

/// As [`crate::JobStore::backlog`].
pub(super) async fn backlog(connection: &mut PgConnection, name: &str) -> Result<u64, Failure> {
    let count = "SELECT count(*) AS count FROM outbox o JOIN subscribers s ON s.name = $1 AND o.seq > s.heard";
    Ok(number(sqlx::query(count).bind(name).fetch_one(connection).await?.try_get("count")?))
}
