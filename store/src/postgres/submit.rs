//! Jobs that come into the store, and jobs that leave it. Transactions over several jobs begin with the head's row: they never wait for each
//! other in a circle, and job numbers have no gaps.

use std::collections::BTreeMap;

use sqlx::postgres::{PgConnection, PgTransaction};
use sqlx::{Connection, Row};

use super::database::Failure;
use super::row::{Columns, Stored, identity, int, number};
use super::write::{By, Write, one};
use crate::id::{JobId, Time, Token};
use crate::job::{Event, Job, Kind, Past};
use crate::queue::past::HIGHEST;
use crate::queue::submit::found_now;
use crate::store::{StoreError, Submission, Submitted};

const INSERT: &str = include_str!("sql/insert.sql");
/// Far more numbers than are given while one statement runs.
const MARGIN: i64 = 1_000_000;

/// Locks the head; the last job's number, and the time.
pub(super) async fn head(transaction: &mut PgTransaction<'_>) -> Result<(JobId, Time), Failure> {
    let row = sqlx::query("SELECT last_job, suture_now() AS now FROM head FOR UPDATE").fetch_one(&mut **transaction).await?;
    Ok((JobId(number(row.try_get("last_job")?)), Time(number(row.try_get("now")?))))
}

/// As [`crate::JobStore::submit`], for as many as go into one transaction.
pub(super) async fn submit(connection: &mut PgConnection, found: &[Submission]) -> Result<Vec<Submitted>, Failure> {
    loop {
        let mut transaction = connection.begin().await?;
        if let Some(answers) = try_submit(&mut transaction, found).await? {
            transaction.commit().await?;
            return Ok(answers);
        }
        // A file that was only noticed changed meanwhile.
        transaction.rollback().await?;
    }
}

async fn try_submit(transaction: &mut PgTransaction<'_>, found: &[Submission]) -> Result<Option<Vec<Submitted>>, Failure> {
    let (mut last, now) = head(transaction).await?;
    let keys: Vec<[u8; 32]> = found.iter().map(|submission| identity(&submission.source)).collect();
    let known = latest(transaction, &keys).await?;
    let (mut answers, mut new, mut given) = (Vec::with_capacity(found.len()), Vec::new(), BTreeMap::new());
    for (submission, key) in found.iter().zip(keys) {
        if let Some(id) = given.get(&key).copied() {
            answers.push(Submitted { id, new: false, ended: false });
            continue;
        }
        let latest = known.get(&key);
        if let Some(ended) = latest.filter(|stored| submission.may_be_gone(&stored.job)) {
            answers.push(Submitted { id: ended.job.id, new: false, ended: true });
            continue;
        }
        let job = latest.filter(|stored| stored.job.answers_for_source());
        let id = match (job, &submission.foreign) {
            // Only noticed until now, and wanted since.
            (Some(noticed), None) if noticed.job.kind() == Kind::Noticed => {
                let id = noticed.job.id;
                let wanted = noticed.job.after(&Event::Want(submission.priority), now);
                let wanted = wanted.map_err(|source| StoreError::Illegal { id, source })?;
                if one(transaction, &Write::new(noticed, &wanted, By::Operator, None)?).await?.is_none() {
                    return Ok(None);
                }
                id
            }
            (Some(stored), _) => {
                answers.push(Submitted { id: stored.job.id, new: false, ended: false });
                continue;
            }
            (None, _) => {
                last.0 += 1;
                new.push(found_now(last, submission, now));
                last
            }
        };
        given.insert(key, id);
        answers.push(Submitted { id, new: true, ended: false });
    }
    insert(transaction, &new, true, last).await?;
    if new.iter().any(|job| job.kind() != Kind::Noticed) {
        sqlx::query("SELECT suture_news()").execute(&mut **transaction).await?;
    }
    Ok(Some(answers))
}

/// The latest job of each file.
async fn latest(transaction: &mut PgTransaction<'_>, keys: &[[u8; 32]]) -> Result<BTreeMap<[u8; 32], Stored>, Failure> {
    let sql = "SELECT DISTINCT ON (file_key) file_key, id, seq, record, epoch, token, claim_token, claim_boot, claim_at
        FROM jobs WHERE file_key = ANY ($1) ORDER BY file_key, id DESC";
    let keys: Vec<&[u8]> = keys.iter().map(<[u8; 32]>::as_slice).collect();
    let rows = sqlx::query(sql).bind(keys).fetch_all(&mut **transaction).await?;
    let mut latest = BTreeMap::new();
    for row in rows {
        let key: Vec<u8> = row.try_get("file_key")?;
        if let Ok(key) = <[u8; 32]>::try_from(key.as_slice()) {
            latest.insert(key, Stored::read(&row)?);
        }
    }
    Ok(latest)
}

/// Puts new jobs in, and notes the last number; `fresh`: they were found just now.
pub(super) async fn insert(transaction: &mut PgTransaction<'_>, jobs: &[Job], fresh: bool, last: JobId) -> Result<(), Failure> {
    if jobs.is_empty() {
        return Ok(());
    }
    let rows = jobs.iter().map(Columns::of).collect::<Result<Vec<_>, _>>()?;
    let fresh_key = |row: &Columns| row.file_key.clone().filter(|_| fresh && row.is_fresh);
    sqlx::query(INSERT)
        .bind(rows.iter().map(|row| row.id).collect::<Vec<_>>())
        .bind(rows.iter().map(|row| row.record.clone()).collect::<Vec<_>>())
        .bind(rows.iter().map(|row| row.kind).collect::<Vec<_>>())
        .bind(rows.iter().map(|row| row.kind_claimed).collect::<Vec<_>>())
        .bind(rows.iter().map(|row| row.folder.clone()).collect::<Vec<_>>())
        .bind(rows.iter().map(|row| row.size).collect::<Vec<_>>())
        .bind(rows.iter().map(|row| row.priority).collect::<Vec<_>>())
        .bind(rows.iter().map(|row| row.since).collect::<Vec<_>>())
        .bind(rows.iter().map(|row| row.not_before).collect::<Vec<_>>())
        .bind(rows.iter().map(|row| row.alone).collect::<Vec<_>>())
        .bind(rows.iter().map(|row| row.file_key.clone()).collect::<Vec<_>>())
        .bind(rows.iter().map(fresh_key).collect::<Vec<_>>())
        .bind(rows.iter().map(|row| row.recipe).collect::<Vec<_>>())
        .execute(&mut **transaction)
        .await?;
    sqlx::query("UPDATE head SET last_job = greatest(last_job, $1)").bind(int(last.0)).execute(&mut **transaction).await?;
    Ok(())
}

/// As [`crate::JobStore::restore`].
pub(super) async fn restore(connection: &mut PgConnection, past: &[Past]) -> Result<Vec<JobId>, Failure> {
    let mut transaction = connection.begin().await?;
    let (mut last, _) = head(&mut transaction).await?;
    let numbers: Vec<i64> = past.iter().map(|one| int(one.id.0)).collect();
    let rows = sqlx::query("SELECT id FROM jobs WHERE id = ANY ($1)").bind(numbers).fetch_all(&mut *transaction).await?;
    let taken = rows.iter().map(|row| row.try_get("id").map(|id: i64| JobId(number(id))));
    let mut taken: std::collections::BTreeSet<JobId> = taken.collect::<Result<_, _>>()?;
    let mut jobs = Vec::with_capacity(past.len());
    for one in past {
        let is_free = (1..=HIGHEST).contains(&one.id.0) && !taken.contains(&one.id);
        let id = if is_free { one.id } else { JobId(last.0 + 1) };
        taken.insert(id);
        last = last.max(id);
        let mut job = one.job(id);
        job.work = job.work.filter(|token| token.0 <= HIGHEST);
        jobs.push(job);
    }
    // No claim to come may have the work folder of one of these.
    if let Some(Token(work)) = jobs.iter().filter_map(|job| job.work).max() {
        sqlx::query("SELECT setval('transitions', last_value + $2) FROM transitions WHERE last_value <= $1")
            .bind(int(work))
            .bind(int(work).saturating_add(MARGIN))
            .execute(&mut *transaction)
            .await?;
    }
    insert(&mut transaction, &jobs, false, last).await?;
    transaction.commit().await?;
    Ok(jobs.iter().map(|job| job.id).collect())
}

/// As [`crate::JobStore::forget`].
pub(super) async fn forget(connection: &mut PgConnection, ids: &[JobId]) -> Result<u64, Failure> {
    let mut transaction = connection.begin().await?;
    head(&mut transaction).await?;
    let rest: Vec<&str> = Kind::ALL.into_iter().filter(|kind| kind.is_at_rest()).map(Kind::name).collect();
    let ids: Vec<i64> = ids.iter().map(|id| int(id.0)).collect();
    let gone = sqlx::query("DELETE FROM jobs WHERE id = ANY ($1) AND kind = ANY ($2)").bind(ids).bind(rest);
    let count = gone.execute(&mut *transaction).await?.rows_affected();
    transaction.commit().await?;
    Ok(count)
}
