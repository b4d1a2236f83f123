//! The index by state: how many jobs there are of a kind, and which. Who of them is next is [`super::line`]'s to say. Keys begin with the
//! kind's tag; what follows is the job number, and what earlier versions searched by, which can go on with this store:
//!
//! * queued, queued alone: class of the size (its number of binary digits, one byte) · job number · size.
//! * waiting: end of the pause · job number · 1 if it must run alone · size.
//! * parked: end of the pause · job number.
//! * all others: job number.

use std::collections::BTreeMap;

use crate::id::JobId;
use crate::job::{Job, Kind, State};
use crate::record::corrupt;
use crate::store::StoreError;
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
        Kind::Rejected => 15,
        Kind::Carried => 16,
    }
}

/// Class of a size: its number of binary digits.
pub(super) fn class(size: u64) -> u8 {
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

/// The job that an entry is of, and the kind that it says; `None`: it cannot be understood.
pub(super) fn told(key: &[u8]) -> Option<(JobId, Kind)> {
    let kind = Kind::ALL.into_iter().find(|kind| key.first() == Some(&tag(*kind)))?;
    Some((JobId(number(key, id_at(kind)).ok()?), kind))
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

/// Numbers of the latest jobs of `kind` before one, descending, at most `most`. Where the key begins with something else than the number, all
/// keys of the kind are looked at, or those of each size class that are needed.
pub(super) fn latest(tables: &dyn Tables, kind: Kind, before: JobId, most: usize) -> Result<Vec<JobId>, StoreError> {
    let mut ids = Vec::new();
    let mut below = |prefix: &[u8]| {
        let to = [prefix, &before.0.to_be_bytes()].concat();
        let mut left = most;
        tables.scan_back(Table::ByState, prefix, &to, &mut |key, _| {
            if left > 0 {
                ids.push(JobId(number(key, id_at(kind))?));
                left -= 1;
            }
            Ok(left > 0)
        })
    };
    match kind {
        Kind::Waiting | Kind::Parked => ids = self::ids(tables, kind)?.into_iter().filter(|id| *id < before).collect(),
        Kind::Queued | Kind::Alone => (0..=class(u64::MAX)).try_for_each(|class| below(&[tag(kind), class]))?,
        _ => below(&[tag(kind)])?,
    }
    ids.sort_unstable_by(|a, b| b.cmp(a));
    ids.truncate(most);
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
