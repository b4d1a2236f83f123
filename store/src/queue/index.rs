//! The index by state. Keys begin with the kind's tag; what follows is what that kind is searched by:
//!
//! * queued, queued alone: class of the size (its number of binary digits, one byte) · job number · size. So a claim that wants sizes
//!   in a range looks at one entry for each class, not at every job.
//! * waiting: end of the pause · job number · 1 if it must run alone · size.
//! * parked: end of the pause · job number.
//! * all others: job number.

use std::collections::BTreeMap;

use crate::id::{JobId, Time};
use crate::job::{BACKOFF_CAP_MS, Job, Kind, State};
use crate::record::corrupt;
use crate::store::{Filter, StoreError};
use crate::tables::{Table, Tables};

/// Written to disk: a kind's tag never changes its meaning.
fn tag(kind: Kind) -> u8 {
    match kind {
        Kind::Noticed => 1,
        Kind::Queued => 2,
        Kind::Waiting => 3,
        Kind::Alone => 4,
        Kind::Running => 5,
        Kind::Concluded => 6,
        Kind::Publishing => 7,
        Kind::Published => 8,
        Kind::Done => 9,
        Kind::Failed => 10,
        Kind::NeedsReview => 11,
        Kind::Quarantined => 12,
        Kind::Cancelled => 13,
        Kind::Parked => 14,
    }
}

fn class(size: u64) -> u8 {
    // At most 64.
    (u64::BITS - size.leading_zeros()) as u8
}

/// The entry of `job`.
pub(super) fn key(job: &Job) -> Vec<u8> {
    let kind = job.kind();
    let mut key = vec![tag(kind)];
    match (kind, &job.state) {
        (Kind::Parked, _) => {
            key.extend_from_slice(&job.pause().unwrap_or_default().0.to_be_bytes());
            key.extend_from_slice(&job.id.0.to_be_bytes());
        }
        (_, State::Queued { not_before: Some(then) }) => {
            key.extend_from_slice(&then.0.to_be_bytes());
            key.extend_from_slice(&job.id.0.to_be_bytes());
            key.push(u8::from(job.must_run_alone()));
            key.extend_from_slice(&job.source.size.to_be_bytes());
        }
        (_, State::Queued { not_before: None }) => {
            key.push(class(job.source.size));
            key.extend_from_slice(&job.id.0.to_be_bytes());
            key.extend_from_slice(&job.source.size.to_be_bytes());
        }
        _ => key.extend_from_slice(&job.id.0.to_be_bytes()),
    }
    key
}

fn number(key: &[u8], at: usize) -> Result<u64, StoreError> {
    let bytes = key.get(at..at + 8).and_then(|bytes| bytes.try_into().ok());
    bytes.map(u64::from_be_bytes).ok_or_else(|| corrupt("by_state", "a key is too short"))
}

/// Where the job number stands in a key.
fn id_at(kind: Kind) -> usize {
    match kind {
        Kind::Queued | Kind::Alone => 2,
        Kind::Waiting | Kind::Parked => 9,
        _ => 1,
    }
}

/// Numbers of the jobs of `kind`, in index order.
pub(super) fn ids(tables: &dyn Tables, kind: Kind) -> Result<Vec<JobId>, StoreError> {
    let mut ids = Vec::new();
    tables.scan(Table::ByState, &[tag(kind)], &[tag(kind) + 1], &mut |key, _| {
        ids.push(JobId(number(key, id_at(kind))?));
        Ok(true)
    })?;
    Ok(ids)
}

/// How many jobs there are of each kind.
pub(super) fn count(tables: &dyn Tables) -> Result<BTreeMap<Kind, u64>, StoreError> {
    let mut counts = BTreeMap::new();
    for kind in Kind::ALL {
        let mut count = 0;
        tables.scan(Table::ByState, &[tag(kind)], &[tag(kind) + 1], &mut |_, _| {
            count += 1;
            Ok(true)
        })?;
        counts.insert(kind, count);
    }
    Ok(counts)
}

/// The oldest job that `want` allows and that is due at `now`. Parked jobs come first: there is little to do for them.
pub(super) fn first_due(tables: &dyn Tables, want: &Filter, now: Time) -> Result<Option<JobId>, StoreError> {
    if let Some(id) = first_parked(tables, now)? {
        return Ok(Some(id));
    }
    let ready = first_ready(tables, want)?;
    let rested = first_rested(tables, want, now)?;
    Ok([ready, rested].into_iter().flatten().min())
}

fn first_ready(tables: &dyn Tables, want: &Filter) -> Result<Option<JobId>, StoreError> {
    let tag = tag(if want.alone { Kind::Alone } else { Kind::Queued });
    let (least, most) = want.size;
    let mut best: Option<JobId> = None;
    let mut from = class(least);
    let last = class(most);
    // One scan for each class that has jobs: it ends at the first job that fits, or at the first of a later class.
    while from <= last {
        let mut seen = None;
        tables.scan(Table::ByState, &[tag, from], &[tag, last + 1], &mut |key, _| {
            let here = key.get(1).copied().ok_or_else(|| corrupt("by_state", "a key is too short"))?;
            if *seen.get_or_insert(here) != here {
                return Ok(false);
            }
            let size = number(key, 10)?;
            if size < least || size > most {
                return Ok(true);
            }
            let id = JobId(number(key, 2)?);
            best = Some(best.map_or(id, |best| best.min(id)));
            Ok(false)
        })?;
        match seen {
            Some(here) => from = here + 1,
            None => break,
        }
    }
    Ok(best)
}

/// Keys of `kind` whose pause is over at `now`: it ended, or it ends later than any pause may (the clock has jumped).
fn rested(
    tables: &dyn Tables,
    kind: Kind,
    now: Time,
    each: &mut dyn FnMut(&[u8]) -> Result<bool, StoreError>,
) -> Result<(), StoreError> {
    let tag = tag(kind);
    let at = |time: u64| [&[tag][..], &time.to_be_bytes()].concat();
    let over = (at(0), at(now.0.saturating_add(1)));
    let beyond = (at(now.plus_ms(BACKOFF_CAP_MS).0.saturating_add(1)), vec![tag + 1]);
    for (from, to) in [over, beyond] {
        tables.scan(Table::ByState, &from, &to, &mut |key, _| each(key))?;
    }
    Ok(())
}

fn first_parked(tables: &dyn Tables, now: Time) -> Result<Option<JobId>, StoreError> {
    let mut first = None;
    rested(tables, Kind::Parked, now, &mut |key| {
        first = first.or(Some(JobId(number(key, id_at(Kind::Parked))?)));
        Ok(false)
    })?;
    Ok(first)
}

/// The oldest job whose pause is over.
fn first_rested(tables: &dyn Tables, want: &Filter, now: Time) -> Result<Option<JobId>, StoreError> {
    let mut best: Option<JobId> = None;
    rested(tables, Kind::Waiting, now, &mut |key| {
        let id = JobId(number(key, id_at(Kind::Waiting))?);
        let alone = key.get(17).is_some_and(|flag| *flag == 1);
        let size = number(key, 18)?;
        if alone == want.alone && (want.size.0..=want.size.1).contains(&size) {
            best = Some(best.map_or(id, |best| best.min(id)));
        }
        Ok(true)
    })?;
    Ok(best)
}
