//! Objects of attempts that came to nothing. Before an attempt puts its first object, it writes down which keys it will have, in
//! `.suture/attempts/<job>-<token>-<drop>/`; each object says who put it. So whoever goes on, or the intake of a later day, removes what no row names:
//!
//! ```text
//! note ─► objects put ─► `Placed` (the row names them) ─► note removed        or: note ─► objects put ─► work lost ─► objects removed
//! ```
//! A note outlives what it led to: a worker that slept through the loss of its claim may still put an object, late.

use serde::{Deserialize, Serialize};
use suture_store::{Job, JobId, JobStore, State, StoreError, Time, Token};

use super::{Piece, pieces};
use crate::bucket::calls::Gate;
use crate::bucket::prove::PROBES;
use crate::bucket::{Bucket, Put, Trouble};
use crate::folder::Folder;
use crate::shelf::Shelf;

/// Where notes are, below the prefix.
const NOTES: &str = ".suture/attempts";
/// A note stays as long, in case that an object comes late.
const STAYS_MS: u64 = 24 * 3600 * 1000;

/// Who puts a job's objects.
pub(super) fn owner(job: &Job) -> String {
    owner_of(job, job.work_token())
}

/// Of another attempt. What tells the drop is in it: a store that was begun anew counts its jobs from 1 again.
fn owner_of(job: &Job, token: Token) -> String {
    format!("{}-{token}-{:x}", job.id, job.source.ino)
}

#[derive(Debug, Serialize, Deserialize)]
struct Note {
    /// Of objects, below the prefix.
    keys: Vec<String>,
}

impl Note {
    fn bytes(keys: &[String]) -> Result<Vec<u8>, Trouble> {
        serde_json::to_vec(&Self { keys: keys.to_vec() }).map_err(|error| std::io::Error::from(error).into())
    }

    /// Its own key.
    fn key(owner: &str, bytes: &[u8]) -> String {
        let name = blake3::hash(bytes).to_hex();
        format!("{NOTES}/{owner}/{}", name.get(..16).unwrap_or_default())
    }
}

/// The keys of an attempt's files.
pub(super) fn keys(folder: &Folder, pieces: &[Piece]) -> Result<Vec<String>, Trouble> {
    pieces.iter().map(|piece| Ok(Shelf::key(&folder.root, &piece.to)?)).collect()
}

/// Writes down what will be put. [`Put::There`]: perhaps some of it has been.
///
/// # Errors
/// When the store does not answer.
pub(super) fn note(shelf: &Shelf, job: &Job, keys: &[String], gate: Gate) -> Result<Put, Trouble> {
    let (bytes, owner) = (Note::bytes(keys)?, owner(job));
    let key = Note::key(&owner, &bytes);
    shelf.bucket.put_bytes_new(bytes, &key, &owner, gate)
}

/// The row names them.
///
/// # Errors
/// When the store does not answer.
pub(super) fn forget(shelf: &Shelf, job: &Job, keys: &[String]) -> Result<(), Trouble> {
    shelf.bucket.remove(&Note::key(&owner(job), &Note::bytes(keys)?))
}

/// Removes what this attempt has put under these keys; nobody else's.
///
/// # Errors
/// When the store does not answer.
pub(super) fn undo(shelf: &Shelf, job: &Job, keys: &[String], gate: Gate) -> Result<(), Trouble> {
    remove(&shelf.bucket, &owner(job), keys, gate)
}

fn remove(bucket: &Bucket, owner: &str, keys: &[String], gate: Gate) -> Result<(), Trouble> {
    for key in keys {
        if let Some(found) = bucket.stat(key)?.filter(|found| found.owner.as_deref() == Some(owner)) {
            bucket.remove_if(key, &found.version, gate)?;
            tracing::info!(key, "An object of an attempt that came to nothing was removed.");
        }
    }
    Ok(())
}

/// A parked job was given up: what it had put goes, now if the bucket answers, else when [`clear`] finds it.
pub(crate) fn discard(shelf: &Shelf, folder: &Folder, job: &Job) {
    let (State::Publishing { publication, .. }, true) = (&job.state, shelf.bucket.trouble().is_none()) else { return };
    let undone = keys(folder, &pieces(folder, job, publication)).and_then(|keys| undo(shelf, job, &keys, &|| Ok(())));
    if let Err(error) = undone {
        tracing::warn!(%error, "An object could not be removed; that is tried again.");
    }
}

/// Who did not answer.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NoAnswer {
    #[error(transparent)]
    Bucket(#[from] Trouble),
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Removes what attempts of all jobs have put that came to nothing.
///
/// # Errors
/// When the bucket or the store does not answer.
pub(crate) fn clear(shelf: &Shelf, store: &dyn JobStore, now: Time) -> Result<(), NoAnswer> {
    for listed in shelf.bucket.list(".suture")? {
        let key = format!(".suture/{}", listed.key);
        let of_attempt = attempt_of(&key);
        if of_attempt.is_none() && !key.starts_with(PROBES) {
            continue;
        }
        // Looked at first: who is fenced by then stays so.
        let Some(found) = shelf.bucket.stat(&key)? else { continue };
        let age = now.0.saturating_sub(u64::try_from(found.version.mtime_ns / 1_000_000).unwrap_or_default());
        let Some((owner, id, token)) = of_attempt else {
            if age > STAYS_MS {
                shelf.bucket.remove(&key)?;
            }
            continue;
        };
        // Of a job that is forgotten, or of another store, what it left stays.
        let Some(job) = store.get(id)?.filter(|job| owner_of(job, token) == owner) else { continue };
        let fate = Fate::of(&job, token);
        if fate == Fate::Undone {
            // A note that is no note leads nowhere.
            let note = shelf.bucket.bytes(&key, &found.version)?.and_then(|bytes| serde_json::from_slice::<Note>(&bytes).ok());
            remove(&shelf.bucket, owner, &note.map(|note| note.keys).unwrap_or_default(), &|| Ok(()))?;
        }
        if fate != Fate::Open && (fate == Fate::Named || age > STAYS_MS) {
            shelf.bucket.remove(&key)?;
        }
    }
    Ok(())
}

/// The attempt that a note is of, by its key: `…/<job>-<token>-<drop>/<name>`.
fn attempt_of(key: &str) -> Option<(&str, JobId, Token)> {
    let (owner, _) = key.strip_prefix(NOTES)?.strip_prefix('/')?.split_once('/')?;
    let mut numbers = owner.split('-').map(str::parse);
    match [numbers.next(), numbers.next()] {
        [Some(Ok(job)), Some(Ok(token))] => Some((owner, JobId(job), Token(token))),
        _ => None,
    }
}

/// The fate of an attempt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    /// It may still put objects.
    Open,
    /// The row names what it put.
    Named,
    /// It came to nothing.
    Undone,
}

impl Fate {
    fn of(job: &Job, token: Token) -> Self {
        if job.work != Some(token) {
            return Self::Undone;
        }
        match job.state {
            State::Ended { .. } => Self::Named,
            State::Queued { .. } | State::Cancelled { .. } => Self::Undone,
            _ => Self::Open,
        }
    }
}
