//! Transitions: read, let the state machine judge, compare and set. No lock is held meanwhile, and nothing is open between two calls.
//!
//! A write that finds another transition than the one that was read changes nothing, and all begins anew. So it does after a call whose outcome is
//! unknown: where the row holds the very record that was to be written, the step was made, and is not made again.

use std::sync::Mutex;

use sqlx::Row;
use sqlx::postgres::PgConnection;

use super::database::Failure;
use super::outbox;
use super::row::{Columns, Stored, int, number};
use crate::id::{JobId, Seq, Time, Token};
use crate::job::{Event, Illegal, Job, State};
use crate::record;
use crate::store::StoreError;

const READ: &str =
    "SELECT id, seq, record, epoch, token, claim_token, claim_boot, claim_at, suture_now() AS now FROM jobs WHERE id = $1";
const WRITE: &str = "SELECT suture_write($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17) AS seq";
/// So often others may be quicker before something must be wrong.
const ROUNDS: usize = 1000;

/// Who may write.
#[derive(Clone, Copy)]
pub(super) enum By {
    /// Whoever holds the claim; its lease, in ms, begins anew.
    Holder { token: Token, lease: i64 },
    /// Whoever takes over what another life held; the lease, in ms, begins anew.
    Heir { lease: i64 },
    /// Anyone.
    Operator,
}

/// One job, and the database's time.
pub(super) async fn read(connection: &mut PgConnection, id: JobId) -> Result<(Stored, Time), Failure> {
    let row = sqlx::query(READ).bind(int(id.0)).fetch_optional(connection).await?;
    let row = row.ok_or(StoreError::Unknown(id))?;
    Ok((Stored::read(&row)?, Time(number(row.try_get("now")?))))
}

/// A transition of one job. `event` says what happens to it; `tried` keeps, from one try of the call to the next, what was to be written.
pub(super) async fn transition(
    connection: &mut PgConnection,
    id: JobId,
    by: By,
    tried: &Mutex<Option<Vec<u8>>>,
    event: impl Fn(&Stored) -> Result<Event, Illegal>,
) -> Result<Job, Failure> {
    let tried = || tried.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    for _ in 0..ROUNDS {
        let (stored, now) = read(connection, id).await?;
        let is_done = tried().as_ref() == Some(&stored.record);
        if is_done {
            return Ok(stored.written()?);
        }
        let after = event(&stored).and_then(|event| stored.job.after(&event, now));
        let after = after.map_err(|source| StoreError::Illegal { id, source })?;
        let columns = Columns::of(&after)?;
        *tried() = Some(columns.record.clone());
        if let Some(seq) = set(connection, &stored, &after, &columns, by).await? {
            return Ok(Job { seq, ..after });
        }
        // Nothing was written, so that a record alike is someone else's.
        *tried() = None;
    }
    Err(StoreError::Poisoned { reason: format!("job {id} changes without an end") }.into())
}

/// Writes `after` in the place of what was read, and the entry for subscribers where it ends; `None`: something else is there meanwhile.
pub(super) async fn set(
    connection: &mut PgConnection,
    before: &Stored,
    after: &Job,
    columns: &Columns,
    by: By,
) -> Result<Option<Seq>, Failure> {
    let hold = after.hold();
    // A claim that was void before does not come to life by what an operator says.
    let token = match by {
        By::Holder { .. } | By::Heir { .. } => hold.map(|hold| hold.token),
        By::Operator => hold.map(|hold| hold.token).filter(|token| Some(*token) == before.token),
    };
    let (needed, lease) = match by {
        By::Holder { token, lease } => (Some(int(token.0)), Some(lease)),
        By::Heir { lease } => (None, Some(lease)),
        By::Operator => (None, None),
    };
    let ends = matches!(after.state, State::Ended { .. }) && before.job.state != after.state;
    let ended = ends.then(|| record::encode_end(&outbox::key(Some(after.id)), after)).transpose()?;
    let row = sqlx::query(WRITE)
        .bind(columns.id)
        .bind(int(before.job.seq.0))
        .bind(needed)
        .bind(&columns.record)
        .bind(columns.kind)
        .bind(columns.kind_claimed)
        .bind(columns.priority)
        .bind(columns.since)
        .bind(columns.not_before)
        .bind(columns.alone)
        .bind(columns.cancel)
        .bind(columns.recipe)
        .bind(hold.map(|hold| int(hold.epoch.0)))
        .bind(token.map(|token| int(token.0)))
        .bind(lease)
        .bind(columns.is_fresh)
        .bind(ended)
        .fetch_one(connection)
        .await?;
    let seq: Option<i64> = row.try_get("seq")?;
    Ok(seq.map(|seq| Seq(number(seq))))
}
