//! Rows as they are to be written: compare and set, any number of them in one statement.

use sqlx::postgres::{PgArguments, PgConnection, PgRow};
use sqlx::query::Query;
use sqlx::{Postgres, Row};

use super::database::Failure;
use super::outbox;
use super::row::{Columns, Stored, int, number};
use crate::id::{Seq, Time, Token};
use crate::job::{Job, State};
use crate::record;
use crate::store::StoreError;

/// One row, whoever writes it.
const WRITE: &str = "SELECT CASE WHEN $17::bigint IS NULL OR abs(suture_now() - $17) <= 1000
    THEN suture_write($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $18) END AS seq, suture_now() AS now";
/// The same of a holder's step that does not end the job, at less cost.
const STEP: &str = include_str!("sql/step.sql");
/// Steps of holders, any number of them.
const STEPS: &str = include_str!("sql/steps.sql");

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

/// A job's row to come.
pub(super) struct Write {
    pub(super) columns: Columns,
    /// The transition in whose place it comes.
    seq: i64,
    /// The token that the row must have.
    needed: Option<i64>,
    epoch: Option<i64>,
    token: Option<i64>,
    lease: Option<i64>,
    /// The entry for subscribers where the job ends by it.
    ended: Option<Vec<u8>>,
    counted: Option<i64>,
}

/// The transition that was made, and the database's time; `None`: nothing was written, since something else is there meanwhile.
pub(super) type Written = Option<(Seq, Time)>;

impl Write {
    /// `after` in the place of what was read. `counted`: the time that it was made with, where the database was not asked for it.
    pub(super) fn new(before: &Stored, after: &Job, by: By, counted: Option<Time>) -> Result<Self, StoreError> {
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
        Ok(Self {
            columns: Columns::of(after)?,
            seq: int(before.job.seq.0),
            needed,
            epoch: hold.map(|hold| int(hold.epoch.0)),
            token: token.map(|token| int(token.0)),
            lease,
            ended: ends.then(|| record::encode_end(&outbox::key(Some(after.id)), after)).transpose()?,
            counted: counted.map(|counted| int(counted.0)),
        })
    }
}

/// Writes one.
pub(super) async fn one(connection: &mut PgConnection, write: &Write) -> Result<Written, Failure> {
    let row = if write.needed.is_some() && write.ended.is_none() {
        bind(sqlx::query(STEP), write).fetch_optional(connection).await?
    } else {
        bind(sqlx::query(WRITE), write).bind(&write.ended).fetch_optional(connection).await?
    };
    row.map_or(Ok(None), |row| written(&row))
}

/// Binds $1 to $17 of a statement about one row.
fn bind<'q>(query: Query<'q, Postgres, PgArguments>, write: &'q Write) -> Query<'q, Postgres, PgArguments> {
    let Write { columns, .. } = write;
    query
        .bind(columns.id)
        .bind(write.seq)
        .bind(write.needed)
        .bind(&columns.record)
        .bind(columns.kind)
        .bind(columns.kind_claimed)
        .bind(columns.priority)
        .bind(columns.since)
        .bind(columns.not_before)
        .bind(columns.alone)
        .bind(columns.cancel)
        .bind(columns.recipe)
        .bind(write.epoch)
        .bind(write.token)
        .bind(write.lease)
        .bind(columns.is_fresh)
        .bind(write.counted)
}

fn written(row: &PgRow) -> Result<Written, Failure> {
    let (seq, now): (Option<i64>, i64) = (row.try_get("seq")?, row.try_get("now")?);
    Ok(seq.map(|seq| (Seq(number(seq)), Time(number(now)))))
}

/// Writes steps of holders, each for itself, in one statement. They go in the order of their jobs, so that two such calls never wait for each other in a circle.
pub(super) async fn all(connection: &mut PgConnection, writes: &[Write]) -> Result<Vec<Written>, Failure> {
    if let [write] = writes {
        return Ok(vec![one(connection, write).await?]);
    }
    let mut order: Vec<usize> = (0..writes.len()).collect();
    order.sort_by_key(|at| writes.get(*at).map(|write| write.columns.id));
    let sorted: Vec<&Write> = order.iter().filter_map(|at| writes.get(*at)).collect();
    let rows = steps(connection, &sorted).await?;
    let mut all = vec![None; writes.len()];
    for row in rows {
        let place = usize::try_from(row.try_get::<i64, _>("place")?).unwrap_or_default();
        let at = place.checked_sub(1).and_then(|place| order.get(place));
        if let Some(one) = at.and_then(|at| all.get_mut(*at)) {
            *one = written(&row)?;
        }
    }
    Ok(all)
}

/// Those that were made, by their places from 1 on.
async fn steps(connection: &mut PgConnection, writes: &[&Write]) -> Result<Vec<PgRow>, Failure> {
    fn each<'a, T>(writes: &[&'a Write], part: impl Fn(&'a Write) -> T) -> Vec<T> {
        writes.iter().map(|write| part(write)).collect()
    }
    let rows = sqlx::query(STEPS)
        .bind(each(writes, |write| write.columns.id))
        .bind(each(writes, |write| write.seq))
        .bind(each(writes, |write| write.needed))
        .bind(each(writes, |write| write.columns.record.as_slice()))
        .bind(each(writes, |write| write.columns.kind))
        .bind(each(writes, |write| write.columns.kind_claimed))
        .bind(each(writes, |write| write.columns.priority))
        .bind(each(writes, |write| write.columns.since))
        .bind(each(writes, |write| write.columns.not_before))
        .bind(each(writes, |write| write.columns.alone))
        .bind(each(writes, |write| write.columns.cancel))
        .bind(each(writes, |write| write.columns.recipe))
        .bind(each(writes, |write| write.epoch))
        .bind(each(writes, |write| write.token))
        .bind(each(writes, |write| write.lease))
        .bind(each(writes, |write| write.columns.is_fresh))
        .bind(each(writes, |write| write.ended.as_deref()))
        .bind(each(writes, |write| write.counted));
    Ok(rows.fetch_all(connection).await?)
}
