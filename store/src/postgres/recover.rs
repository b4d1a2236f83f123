//! The death of a daemon: what an earlier life of the same daemon held is taken back by the life after it.

use std::collections::BTreeMap;

use sqlx::postgres::{PgConnection, PgRow, PgTransaction};
use sqlx::{Connection, Row};

use super::claim::{Life, inherit};
use super::database::Failure;
use super::row::{Stored, int, number};
use super::submit::head;
use super::write::{By, Write, one};
use crate::id::{JobId, Time, Token};
use crate::job::{Event, Job, State, Testimony};
use crate::store::{Claim, Recovered, StoreError};

const ORPHANS: &str = "SELECT j.id, seq, record, j.epoch, token, claim_token, claim_boot, claim_at
    FROM jobs j JOIN lives l ON l.epoch = j.epoch WHERE l.daemon = $1 AND l.epoch < $2 AND ($3::text[] IS NULL OR j.folder = ANY ($3))
    ORDER BY j.id";
const ORPHANS_ALONE: &str = "SELECT j.id, seq, record, j.epoch, token, claim_token, claim_boot, claim_at
    FROM jobs j JOIN lives l ON l.epoch = j.epoch WHERE l.daemon = $1 AND l.epoch < $2 AND ($3::text[] IS NULL OR j.folder = ANY ($3))
    ORDER BY j.id FOR UPDATE OF j";
const PARKED: &str = "SELECT id, seq, record, epoch, token, claim_token, claim_boot, claim_at
    FROM jobs WHERE kind = 'parked' AND ($1::text[] IS NULL OR folder = ANY ($1)) ORDER BY id FOR UPDATE";

/// What is held against each orphan.
#[derive(Default)]
pub(super) struct Verdicts(BTreeMap<JobId, (bool, Testimony)>);

fn read(rows: &[PgRow]) -> Result<Vec<Stored>, Failure> {
    rows.iter().map(Stored::read).collect()
}

/// Jobs that earlier lives of this daemon hold.
pub(super) async fn orphans(connection: &mut PgConnection, life: &Life) -> Result<Vec<Job>, Failure> {
    let rows = sqlx::query(ORPHANS).bind(&life.daemon).bind(int(life.epoch.0)).bind(&life.folders).fetch_all(connection).await?;
    Ok(read(&rows)?.into_iter().map(|stored| stored.job).collect())
}

/// Asks the witness, who may take his time: nothing is locked.
pub(super) fn ask(orphans: &[Job], life: &Life, testimony: &dyn Fn(&Job) -> Testimony) -> Verdicts {
    let running = |job: &&Job| matches!(job.state, State::Running { .. });
    let one_ran = orphans.iter().filter(running).count() == 1;
    let verdict = |job: &Job| {
        let hold = job.hold();
        // What was being published is company, too, unless the job was claimed to run alone.
        let alone = one_ran && (orphans.len() == 1 || hold.is_some_and(|hold| hold.alone));
        let fell = hold.is_some_and(|hold| hold.boot.differs(life.machine.boot()));
        (job.id, (alone, if fell { Testimony::Machine } else { testimony(job) }))
    };
    Verdicts(orphans.iter().filter(running).map(verdict).collect())
}

/// Takes them back, and lets parked jobs be tried at once: with a new daemon there may be a new world.
pub(super) async fn take_back(
    connection: &mut PgConnection,
    life: &Life,
    verdicts: &Verdicts,
) -> Result<Vec<Recovered>, Failure> {
    let mut transaction = connection.begin().await?;
    let (_, now) = head(&mut transaction).await?;
    let rows = sqlx::query(ORPHANS_ALONE)
        .bind(&life.daemon)
        .bind(int(life.epoch.0))
        .bind(&life.folders)
        .fetch_all(&mut *transaction)
        .await?;
    let orphans = read(&rows)?;
    let tokens = numbers(&mut transaction, orphans.len()).await?;
    let mut recovered = Vec::with_capacity(orphans.len());
    for (stored, token) in orphans.iter().zip(tokens) {
        let (alone, testimony) = verdicts.0.get(&stored.job.id).copied().unwrap_or((false, Testimony::None));
        let after = inherit(&stored.job, life, token, alone, testimony, now)?;
        let job = write(&mut transaction, stored, after, life).await?;
        let void = stored.job.hold().map(|hold| hold.token).unwrap_or_default();
        let claim = job.hold().is_some().then(|| Claim { id: job.id, token, job: job.clone() });
        recovered.push(Recovered { job, void, claim });
    }
    wake_parked(&mut transaction, life, now).await?;
    transaction.commit().await?;
    Ok(recovered)
}

async fn wake_parked(transaction: &mut PgTransaction<'_>, life: &Life, now: Time) -> Result<(), Failure> {
    let rows = sqlx::query(PARKED).bind(&life.folders).fetch_all(&mut **transaction).await?;
    for stored in read(&rows)? {
        let id = stored.job.id;
        let after = stored.job.after(&Event::Retry, now).map_err(|source| StoreError::Illegal { id, source })?;
        write(transaction, &stored, after, life).await?;
    }
    Ok(())
}

/// Writes a row that this transaction has locked.
async fn write(transaction: &mut PgTransaction<'_>, stored: &Stored, after: Job, life: &Life) -> Result<Job, Failure> {
    let by = By::Heir { lease: life.lease };
    let seq = one(transaction, &Write::new(stored, &after, by, None)?).await?;
    let (seq, _) = seq.ok_or_else(|| StoreError::Poisoned { reason: format!("job {} changed under its lock", after.id) })?;
    Ok(Job { seq, ..after })
}

/// So many new tokens.
async fn numbers(transaction: &mut PgTransaction<'_>, count: usize) -> Result<Vec<Token>, Failure> {
    let count = i64::try_from(count).unwrap_or(i64::MAX);
    let sql = "SELECT nextval('transitions') AS number FROM generate_series(1, $1)";
    let rows = sqlx::query(sql).bind(count).fetch_all(&mut **transaction).await?;
    rows.iter().map(|row| Ok(Token(number(row.try_get("number")?)))).collect()
}
