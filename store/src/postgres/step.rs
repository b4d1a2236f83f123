//! Transitions: read, let the state machine judge, compare and set. No lock is held meanwhile, and nothing is open between two calls.
//!
//! A write that finds another transition than the one that was read changes nothing, and all begins anew. So it does after a call whose outcome is
//! unknown: where the row holds a very record that was to be written, the step was made, and is not made again.
//!
//! A holder knows the row as he left it, and need not read it: nobody else writes to it, but for an operator and whoever takes it from him, and then the
//! write changes nothing. He counts the time on from the database's last answer about this job; the write is refused where that is not the time there.

use std::sync::Mutex;

use sqlx::Row;
use sqlx::postgres::PgConnection;

use super::database::Failure;
use super::row::{Stored, int, number};
use super::together::Together;
use super::write::{By, Write, Written, all, one};
use crate::id::{Clock, JobId, Time};
use crate::job::{Event, Illegal, Job};
use crate::store::StoreError;

const READ: &str =
    "SELECT id, seq, record, epoch, token, claim_token, claim_boot, claim_at, suture_now() AS now FROM jobs WHERE id = $1";
/// So often others may be quicker before something must be wrong.
const ROUNDS: usize = 1000;

/// A row as it was read, or written, and the database's time then.
#[derive(Clone)]
pub(super) struct Seen {
    pub(super) stored: Stored,
    at: Time,
    /// By which it is counted on from there.
    ticks: u64,
}

impl Seen {
    pub(super) fn new(stored: Stored, at: Time, clock: &dyn Clock) -> Self {
        Self { stored, at, ticks: clock.ticks() }
    }

    fn now(&self, clock: &dyn Clock) -> Time {
        self.at.plus_ms(clock.ticks().saturating_sub(self.ticks))
    }
}

/// All that is known of a call between its tries, and of its job before the first.
#[derive(Default)]
pub(super) struct Tried {
    /// The row as the holder left it: for one look.
    known: Option<Seen>,
    /// The records that were to be written, and may have been.
    records: Vec<Vec<u8>>,
}

impl Tried {
    pub(super) fn knowing(known: Option<Seen>) -> Mutex<Self> {
        Mutex::new(Self { known, records: Vec::new() })
    }
}

/// Steps that are made at the same time.
pub(super) type Stepping = Together<Write, Written>;

/// How transitions are made.
#[derive(Clone, Copy)]
pub(super) struct Way<'a> {
    pub(super) stepping: &'a Stepping,
    /// Only counts milliseconds.
    pub(super) clock: &'a dyn Clock,
    /// From one try of the call to the next.
    pub(super) tried: &'a Mutex<Tried>,
}

/// One job, and the database's time.
async fn read(connection: &mut PgConnection, id: JobId, clock: &dyn Clock) -> Result<Seen, Failure> {
    let row = sqlx::query(READ).bind(int(id.0)).fetch_optional(connection).await?;
    let row = row.ok_or(StoreError::Unknown(id))?;
    Ok(Seen::new(Stored::read(&row)?, Time(number(row.try_get("now")?)), clock))
}

/// A transition of one job; the row after it. `event` says what happens to it.
pub(super) async fn transition(
    connection: &mut PgConnection,
    id: JobId,
    by: By,
    way: Way<'_>,
    event: impl Fn(&Stored) -> Result<Event, Illegal>,
) -> Result<Seen, Failure> {
    let (clock, tried) = (way.clock, || way.tried.lock().unwrap_or_else(std::sync::PoisonError::into_inner));
    for _ in 0..ROUNDS {
        let known = tried().known.take();
        // A row that is only known may be out of date: nothing is refused by it.
        let known = known.and_then(|known| {
            let now = known.now(clock);
            let after = event(&known.stored).and_then(|event| known.stored.job.after(&event, now)).ok()?;
            Some((known.stored, after, Some(now)))
        });
        let (stored, after, counted) = match known {
            Some(known) => known,
            None => {
                let seen = read(connection, id, clock).await?;
                if tried().records.contains(&seen.stored.record) {
                    return Ok(Seen { stored: seen.stored.written()?, ..seen });
                }
                let after = event(&seen.stored).and_then(|event| seen.stored.job.after(&event, seen.at));
                (seen.stored, after.map_err(|source| StoreError::Illegal { id, source })?, None)
            }
        };
        let write = Write::new(&stored, &after, by, counted)?;
        let record = write.columns.record.clone();
        tried().records.push(record.clone());
        // Only holders know a row.
        let written = if counted.is_some() {
            way.stepping
                .ask(connection, write, async |connection: &mut PgConnection, writes: &[Write]| all(connection, writes).await)
                .await?
        } else {
            Some(one(connection, &write).await?)
        };
        match written {
            Some(Some((seq, at))) => {
                let (epoch, token) = (stored.epoch, stored.token);
                return Ok(Seen::new(Stored { job: Job { seq, ..after }, record, epoch, token }, at, clock));
            }
            // Nothing was written, so that a record alike is someone else's.
            Some(None) => drop(tried().records.pop()),
            None => {}
        }
    }
    Err(StoreError::Poisoned { reason: format!("job {id} changes without an end") }.into())
}
