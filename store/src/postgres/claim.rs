//! Claims: one statement for all that are asked for at a time, work outside of any transaction. Their leases are counted by the database's clock; what is
//! left of a daemon that let them run out is taken back by whoever claims next.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use sqlx::postgres::{PgConnection, PgRow};
use sqlx::{Connection, Row};

use super::database::Failure;
use super::row::{Stored, int, number};
use super::step::Seen;
use super::together::Together;
use super::turns::{Folders, alone};
use super::write::{By, Write, one};
use crate::host::Station;
use crate::id::{Clock, Epoch, Time, Token};
use crate::job::{Event, Job, Priority, State, Testimony};
use crate::store::{Claim, Filter, Lease, StoreError, Waiting};

const CLAIM: &str = include_str!("sql/claim.sql");
const WAITING: &str = include_str!("sql/waiting.sql");
const HAS_PARKED: &str = include_str!("sql/has_parked.sql");
const EXPIRED: &str = include_str!("sql/expired.sql");
/// Others may take all that a statement saw, before it has one: then it is tried again, so often.
const ROUNDS: u32 = 20;
/// And after so long, by which they are done.
const ROUND: Duration = Duration::from_millis(2);
/// Jobs taken back by one claim.
const MOST_TAKEN_BACK: usize = 64;

/// Whose claims these are.
#[derive(Clone)]
pub(super) struct Life {
    pub(super) epoch: Epoch,
    pub(super) daemon: String,
    /// Under this name it tells of ends and news; daemons that serve the same folders together have one, and one of them tells.
    pub(super) teller: String,
    /// What it tells of itself.
    pub(super) station: Arc<Mutex<Station>>,
    /// Only jobs of these hot folders are its business; `None`: all are.
    pub(super) folders: Option<Vec<String>>,
    /// Says which start of the machine this is, and counts milliseconds on from a time of the database's, and nothing else.
    pub(super) machine: Arc<dyn Clock>,
    /// In ms.
    pub(super) lease: i64,
}

impl Life {
    fn over(&self) -> StoreError {
        StoreError::Unusable {
            path: PathBuf::from("the shared store"),
            reason: format!("another daemon has begun under the name {}", self.daemon),
            advice: "give each daemon a name of its own".into(),
        }
    }
}

/// As [`crate::JobStore::check`].
pub(super) async fn check(connection: &mut PgConnection, life: &Life) -> Result<(), Failure> {
    let sql = "SELECT 1 FROM lives WHERE epoch = $1 AND NOT is_over";
    let row = sqlx::query(sql).bind(int(life.epoch.0)).fetch_optional(connection).await?;
    row.map(|_| ()).ok_or_else(|| life.over().into())
}

/// A claim that is wanted. `call` names it among all of this life, so that a try whose answer was lost is found again.
#[derive(Clone, Copy)]
pub(super) struct Ask {
    pub(super) want: Filter,
    pub(super) call: i64,
}

/// What became of it.
pub(super) enum Found {
    /// The row as it is then.
    Claimed(Box<Seen>),
    Nothing,
    /// There is something, but others are about to take it.
    Contended,
    /// The life is over.
    Over,
}

/// Claims that are asked for at the same time. A row that cannot be read is the matter of whoever claimed it.
pub(super) type Claiming = Together<Ask, Result<Found, Failure>>;

/// As [`crate::JobStore::claim`], with the row as it is then. `folders` says how folders share the work, whenever it is asked; `again`: an earlier try may
/// have been answered.
pub(super) async fn claim(
    connection: &mut PgConnection,
    life: &Life,
    claiming: &Claiming,
    ask: Ask,
    folders: impl Fn() -> Folders,
    mut again: bool,
) -> Result<Option<(Claim, Option<Seen>)>, Failure> {
    for round in 0..ROUNDS {
        if std::mem::take(&mut again)
            && let Some(claim) = made(connection, life, ask.call).await?
        {
            return Ok(Some((claim, None)));
        }
        let all = async |connection: &mut PgConnection, asks: &[Ask]| claims(connection, life, asks, &folders()).await;
        match claiming.ask(connection, ask, all).await?.transpose()? {
            Some(Found::Claimed(seen)) => return Ok(Some((claim_of(&seen.stored)?, Some(*seen)))),
            Some(Found::Nothing) => return Ok(None),
            Some(Found::Over) => return Err(life.over().into()),
            Some(Found::Contended) => tokio::time::sleep(ROUND * round).await,
            None => again = true,
        }
    }
    Ok(None)
}

/// Claims, as many as are asked for; those that want the same in one statement.
pub(super) async fn claims(
    connection: &mut PgConnection,
    life: &Life,
    asks: &[Ask],
    folders: &Folders,
) -> Result<Vec<Result<Found, Failure>>, Failure> {
    let mut found = BTreeMap::new();
    let mut left: Vec<Ask> = asks.to_vec();
    while let Some(first) = left.first().copied() {
        let (now, later): (Vec<Ask>, Vec<Ask>) = left.into_iter().partition(|ask| ask.want == first.want);
        let calls: Vec<i64> = now.iter().map(|ask| ask.call).collect();
        alike(connection, life, first.want, &calls, folders, &mut found).await?;
        left = later;
    }
    Ok(asks.iter().map(|ask| found.remove(&ask.call).unwrap_or(Ok(Found::Contended))).collect())
}

/// Claims of one want, for calls of these numbers.
async fn alike(
    connection: &mut PgConnection,
    life: &Life,
    want: Filter,
    calls: &[i64],
    folders: &Folders,
    found: &mut BTreeMap<i64, Result<Found, Failure>>,
) -> Result<(), Failure> {
    let query = sqlx::query(CLAIM)
        .bind(int(life.epoch.0))
        .bind(life.machine.boot().0.cast_signed())
        .bind(calls)
        .bind(life.lease)
        .bind(int(want.size.0))
        .bind(int(want.size.1))
        .bind(want.alone)
        .bind(&folders.shut)
        .bind(&life.folders);
    let query = folders.bind(query);
    let rows = if folders.has_limits() {
        let mut transaction = connection.begin().await?;
        alone(&mut transaction).await?;
        let rows = query.fetch_all(&mut *transaction).await?;
        transaction.commit().await?;
        rows
    } else {
        query.fetch_all(&mut *connection).await?
    };
    for row in rows {
        if let Some(call) = row.try_get::<Option<i64>, _>("call")? {
            found.insert(call, seen(&row, life).map(|seen| Found::Claimed(Box::new(seen))));
            continue;
        }
        // The last: what is to be said to all others.
        for call in calls {
            let (is_alive, is_draining, is_contended) =
                (row.try_get("is_alive")?, row.try_get("is_draining")?, row.try_get("is_contended")?);
            found.entry(*call).or_insert_with(|| Ok(Found::of_none(is_alive, is_draining, is_contended)));
        }
    }
    Ok(())
}

impl Found {
    fn of_none(is_alive: bool, is_draining: bool, is_contended: bool) -> Self {
        match (is_alive, is_draining, is_contended) {
            (false, ..) => Self::Over,
            (true, false, true) => Self::Contended,
            _ => Self::Nothing,
        }
    }
}

fn seen(row: &PgRow, life: &Life) -> Result<Seen, Failure> {
    Ok(Seen::new(Stored::read(row)?, Time(number(row.try_get("now")?)), &*life.machine))
}

/// The claim that an earlier try of the same call made.
async fn made(connection: &mut PgConnection, life: &Life, call: i64) -> Result<Option<Claim>, Failure> {
    let sql =
        "SELECT id, seq, record, epoch, token, claim_token, claim_boot, claim_at FROM jobs WHERE epoch = $1 AND claim_call = $2";
    let row = sqlx::query(sql).bind(int(life.epoch.0)).bind(call).fetch_optional(connection).await?;
    row.map(|row| claim_of(&Stored::read(&row)?)).transpose()
}

fn claim_of(stored: &Stored) -> Result<Claim, Failure> {
    let id = stored.job.id;
    let token = stored.token.ok_or(StoreError::Illegal { id, source: crate::job::Illegal::Fenced })?;
    Ok(Claim { id, token, job: stored.job.clone() })
}

/// Takes back jobs whose leases have run out. One whose result was on its way comes with a new claim: nothing else is to be done for it.
pub(super) async fn take_back(connection: &mut PgConnection, life: &Life, shut: &[String]) -> Result<Option<Claim>, Failure> {
    for _ in 0..MOST_TAKEN_BACK {
        // Under a lock: a holder that gives a sign just now is either in time, or finds that it was too late.
        let mut transaction = connection.begin().await?;
        let row = sqlx::query(EXPIRED).bind(life.lease).bind(shut).bind(&life.folders).bind(int(life.epoch.0));
        let row = row.fetch_optional(&mut *transaction).await?;
        let Some(row) = row else { return Ok(None) };
        let stored = Stored::read(&row)?;
        let now = Time(number(row.try_get("now")?));
        let token = Token(number(row.try_get("number")?));
        // Whoever is away says nothing, and no one can look there for a witness.
        let after = inherit(&stored.job, life, token, false, Testimony::None, now)?;
        let by = By::Heir { lease: life.lease };
        let Some((seq, _)) = one(&mut transaction, &Write::new(&stored, &after, by, None)?).await? else { continue };
        transaction.commit().await?;
        tracing::warn!(job = after.id.0, "The lease of a job ran out: its daemon is gone, stopped or cut off. It is taken back.");
        if after.hold().is_some() {
            return Ok(Some(Claim { id: after.id, token, job: Job { seq, ..after } }));
        }
    }
    Ok(None)
}

/// A job after the end of the life that held it. Where something is left to be done, it is held under the token.
pub(super) fn inherit(
    job: &Job,
    life: &Life,
    token: Token,
    alone: bool,
    testimony: Testimony,
    now: Time,
) -> Result<Job, StoreError> {
    let illegal = |source| StoreError::Illegal { id: job.id, source };
    let after = match job.state {
        State::Running { .. } => job.after(&Event::Interrupted { alone, testimony }, now).map_err(illegal)?,
        _ => job.clone(),
    };
    if after.hold().is_none() {
        return Ok(after);
    }
    after.after(&Event::Reclaim { epoch: life.epoch, token }, now).map_err(illegal)
}

/// As [`crate::JobStore::has_parked`].
pub(super) async fn has_parked(connection: &mut PgConnection, life: &Life, shut: &[String]) -> Result<bool, Failure> {
    let query = sqlx::query(HAS_PARKED).bind(shut).bind(&life.folders).bind(life.lease).bind(int(life.epoch.0));
    Ok(query.fetch_one(connection).await?.try_get("has")?)
}

/// As [`crate::JobStore::waiting`].
pub(super) async fn waiting(
    connection: &mut PgConnection,
    life: &Life,
    want: &Filter,
    folders: &Folders,
) -> Result<Option<Waiting>, Failure> {
    let query = sqlx::query(WAITING)
        .bind(int(want.size.0))
        .bind(int(want.size.1))
        .bind(want.alone)
        .bind(&folders.shut)
        .bind(&life.folders);
    let row = folders.bind(query).fetch_one(connection).await?;
    let priority = |name| {
        let number: Option<i64> = row.try_get(name)?;
        Ok::<_, Failure>(number.and_then(|number| Priority::try_from(number).ok()))
    };
    Ok(priority("highest")?.zip(priority("aged")?).map(|(highest, aged)| Waiting { highest, aged }))
}

/// As [`crate::JobStore::heartbeat`]. The lease is written anew when a quarter of it is gone.
pub(super) async fn heartbeat(connection: &mut PgConnection, life: &Life, claim: &Claim) -> Result<Lease, Failure> {
    let sql = "SELECT cancel, lease_until < suture_now() + $4 AS is_old FROM jobs WHERE id = $1 AND token = $2 AND epoch = $3";
    let row = sqlx::query(sql)
        .bind(int(claim.id.0))
        .bind(int(claim.token.0))
        .bind(int(life.epoch.0))
        .bind(life.lease - life.lease / 4)
        .fetch_optional(&mut *connection)
        .await?;
    let Some(row) = row else { return Ok(Lease::Lost) };
    if row.try_get::<Option<bool>, _>("is_old")?.unwrap_or(true) && extend(connection, life, &[claim.token]).await? == 0 {
        return Ok(Lease::Lost);
    }
    Ok(if row.try_get("cancel")? { Lease::Cancel } else { Lease::Held })
}

/// Begins the leases of these claims anew; how many still hold.
pub(super) async fn extend(connection: &mut PgConnection, life: &Life, tokens: &[Token]) -> Result<u64, Failure> {
    let sql = "UPDATE jobs SET lease_until = suture_now() + $3 WHERE epoch = $1 AND token = ANY ($2)";
    let tokens: Vec<i64> = tokens.iter().map(|token| int(token.0)).collect();
    let extended = sqlx::query(sql).bind(int(life.epoch.0)).bind(tokens).bind(life.lease).execute(connection).await?;
    Ok(extended.rows_affected())
}
