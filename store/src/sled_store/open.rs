//! Opening the database: what may have been left by a crash is cleared away, what is damaged is examined on a copy, and nothing is
//! accepted that lacks an acknowledged transition.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use super::files::{self, Mark, io};
use super::tables::{self, SledTables};
use crate::crash::crash_point;
use crate::id::{Clock, Epoch, Seq};
use crate::job::Job;
use crate::queue::check::check as check_records;
use crate::queue::{Queue, read_head};
use crate::store::StoreError;

/// What opening the store met.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Opening {
    /// The epoch that began.
    pub epoch: Epoch,
    /// Torn snapshots that were removed.
    pub torn_snapshots: u32,
    /// Where a damaged database was put, when the store could go on without it.
    pub set_aside: Option<PathBuf>,
}

/// The queue in `state`, whose lock is held, in a new epoch.
pub(super) fn queue(state: &Path, clock: &Arc<dyn Clock>) -> Result<(Queue<SledTables>, Opening), StoreError> {
    let mut opening = Opening::default();
    let mark = prepare(state)?;
    let dir = state.join("db");
    opening.torn_snapshots = files::remove_torn(&dir)?;
    if opening.torn_snapshots > 0 {
        tracing::warn!(count = opening.torn_snapshots, "removed torn snapshots that a crash had left in the job database");
    }
    crash_point("store.open.cleared");
    let tables = match patiently(state, &dir) {
        Ok(tables) => tables,
        Err(error) if is_damage(&error) => {
            let aside = state.join(format!("corrupt-{}", clock.now()));
            set_aside(state, mark, &error, &aside)?;
            tracing::warn!(%error, aside = %aside.display(), "the job database was damaged and has been restored without its snapshot");
            opening.set_aside = Some(aside);
            patiently(state, &dir)?
        }
        Err(error) => return Err(error),
    };
    check(state, &tables, mark)?;
    if mark == Mark::Damaged {
        tracing::warn!("SEQ was damaged; the job database itself is sound, and SEQ is written anew");
    }
    // sled never syncs its settings, nor the names of its files.
    files::sync_all(&dir)?;
    files::sync_dir(state)?;
    let queue = Queue::open(tables, Arc::clone(clock))?;
    queue.tables().drop_earlier_indexes()?;
    opening.epoch = queue.epoch();
    Ok((queue, opening))
}

/// All jobs in `state`, read from a copy of its database in a temporary folder: for who may or can not write there. The copy is small
/// (some kilobytes a job), and goes at once.
///
/// # Errors
/// [`StoreError::Locked`] when a daemon owns the folder; else as opening.
pub(super) fn peek(state: &Path) -> Result<Vec<Job>, StoreError> {
    let dir = state.join("db");
    if let Some(pid) = files::owner(state)? {
        return Err(StoreError::Locked { path: state.to_owned(), pid });
    }
    if !files::is_there(&dir)? {
        return Ok(Vec::new());
    }
    let temporary = tempfile::tempdir().map_err(io(&std::env::temp_dir(), "making a temporary folder"))?;
    let copy = temporary.path().join("db");
    files::copy_dir(&dir, &copy, |path| path.extension().is_some_and(|ext| ext == "generating"))?;
    let tables = SledTables::open(temporary.path(), &copy)?;
    crate::queue::all_jobs(&tables)
}

/// What a look at every record of a store found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Verified {
    /// Jobs in it.
    pub jobs: u64,
    /// All that was looked at: records and entries of indexes.
    pub records: u64,
    /// What the next opening mends by itself; nothing is lost by it. A line each.
    pub mends: Vec<String>,
    /// What is not as it must be. A line each; where there is any, a new store is to be begun.
    pub wrong: Vec<String>,
    /// What to do then.
    pub advice: String,
}

/// Does with a copy of `state` what a daemon does when it begins, then looks at every record.
pub(super) fn verify(state: &Path, clock: &Arc<dyn Clock>) -> Result<Verified, StoreError> {
    let temporary = tempfile::tempdir().map_err(io(&std::env::temp_dir(), "making a temporary folder"))?;
    let copy = temporary.path();
    let mark = files::read_mark(state)?;
    if let Some(pid) = files::owner(state)? {
        return Err(StoreError::Locked { path: state.to_owned(), pid });
    }
    files::copy_state(state, copy)?;
    // Someone may have had it meanwhile.
    let pid = files::owner(state)?;
    if pid.is_some() || files::read_mark(state)? != mark {
        return Err(StoreError::Locked { path: state.to_owned(), pid: pid.flatten() });
    }
    let mut verified = Verified { advice: advice(state), ..Verified::default() };
    if mark == Mark::Damaged {
        verified.mends.push("SEQ, which says how far the store got, is damaged; it is written anew".into());
    }
    let checked = match queue(copy, clock) {
        Ok((queue, opening)) => {
            let (torn, aside) = (opening.torn_snapshots > 0, opening.set_aside.is_some());
            verified.mends.extend(torn.then(|| "a kill left half of a snapshot; it is removed".to_owned()));
            let whole = "the database is damaged; it is made anew from its own log, which is whole";
            verified.mends.extend(aside.then(|| whole.to_owned()));
            check_records(queue.tables())
        }
        // Told at the first such record: there may be more.
        Err(error @ StoreError::Corrupt { .. }) => SledTables::open(copy, &copy.join("db"))
            .and_then(|tables| check_records(&tables))
            .and_then(|checked| if checked.wrong.is_empty() { Err(error) } else { Ok(checked) }),
        Err(error) => Err(error),
    };
    match checked {
        Ok(checked) => (verified.jobs, verified.records, verified.wrong) = (checked.jobs, checked.records, checked.wrong),
        Err(error) => verified.wrong.push(damage(error)?),
    }
    Ok(verified)
}

/// Damage in words, without the place and without advice; `None`: it is no damage.
fn damage_of(error: &StoreError) -> Option<String> {
    match error {
        StoreError::Unusable { reason, .. } => Some(format!("the database does not open: {reason}")),
        StoreError::RolledBack { found, reached, .. } => {
            let [found, reached] = [found, reached].map(|(epoch, seq)| format!("epoch {epoch}, change {seq}"));
            Some(format!("the database went back in time: it ends at {found}, but {reached} were reached"))
        }
        StoreError::Corrupt { what, reason } => Some(format!("{what}: {reason}")),
        error => is_damage(error).then(|| error.to_string()),
    }
}

/// The same; any other error is passed on.
fn damage(error: StoreError) -> Result<String, StoreError> {
    damage_of(&error).ok_or(error)
}

/// Makes the folder fit for sled: an examination that a crash cut short is ended, and a first `SEQ` says that nothing was
/// acknowledged yet, before there is a database.
fn prepare(state: &Path) -> Result<Mark, StoreError> {
    let (dir, trial) = (state.join("db"), state.join("db.trial"));
    if files::is_there(&trial)? {
        if files::is_there(&dir)? {
            std::fs::remove_dir_all(&trial).map_err(io(&trial, "removing"))?;
        } else {
            // The database is moved away only after the copy was found good.
            std::fs::rename(&trial, &dir).map_err(io(&trial, "renaming"))?;
        }
    }
    let mark = files::read_mark(state)?;
    if mark == Mark::Missing && !files::is_there(&dir)? {
        files::write_mark(state, Epoch(0), Seq(0))?;
        return Ok(Mark::Reached(Epoch(0), Seq(0)));
    }
    Ok(mark)
}

/// Opens; the lock of handles that were just dropped, or that a child of a daemon that died has not let go of yet, may take a
/// moment to go.
fn patiently(state: &Path, dir: &Path) -> Result<SledTables, StoreError> {
    for _ in 0..40 {
        match SledTables::open(state, dir) {
            Err(error) if is_held(&error) => std::thread::sleep(Duration::from_millis(25)),
            other => return other,
        }
    }
    SledTables::open(state, dir)
}

/// Does someone else hold sled's own lock? sled 0.34.7 tells only by its words.
fn is_held(error: &StoreError) -> bool {
    matches!(tables::cause(error), Some(sled::Error::Io(error)) if error.to_string().starts_with("could not acquire lock"))
}

/// Is it the database that is wrong, not the world around it?
fn is_damage(error: &StoreError) -> bool {
    use std::io::ErrorKind;
    match tables::cause(error) {
        _ if is_held(error) => false,
        Some(sled::Error::Io(error)) => {
            matches!(error.kind(), ErrorKind::UnexpectedEof | ErrorKind::InvalidData | ErrorKind::Other)
        }
        other => other.is_some(),
    }
}

/// Refuses a database that is behind `mark`.
fn check(state: &Path, tables: &SledTables, mark: Mark) -> Result<(), StoreError> {
    let head = read_head(tables)?.unwrap_or_default();
    match mark {
        Mark::Reached(epoch, seq) if (head.epoch, head.seq) < (epoch, seq) || head.epoch < epoch || head.seq < seq => {
            Err(StoreError::RolledBack {
                path: state.to_owned(),
                found: (head.epoch, head.seq),
                reached: (epoch, seq),
                advice: advice(state),
            })
        }
        _ => Ok(()),
    }
}

/// Replaces the damaged database by what its log says without the snapshot, if that is not behind `mark`; or by nothing, when
/// nothing was ever acknowledged. The damaged one is kept as `aside`.
fn set_aside(state: &Path, mark: Mark, damage: &StoreError, aside: &Path) -> Result<(), StoreError> {
    let (dir, trial) = (state.join("db"), state.join("db.trial"));
    let unusable = |reason: String| StoreError::Unusable { path: state.to_owned(), reason, advice: advice(state) };
    if mark == Mark::Reached(Epoch(0), Seq(0)) {
        std::fs::rename(&dir, aside).map_err(io(&dir, "setting aside"))?;
        return files::sync_dir(state);
    }
    if !matches!(mark, Mark::Reached(..)) {
        return Err(unusable(format!(
            "{damage}; SEQ, which would tell whether an older state is the latest, is gone or damaged"
        )));
    }
    files::copy_dir(&dir, &trial, files::is_snapshot)?;
    let examined = SledTables::open(state, &trial).and_then(|tables| check(state, &tables, mark));
    if let Err(error) = examined {
        std::fs::remove_dir_all(&trial).map_err(io(&trial, "removing"))?;
        let rest = damage_of(&error).unwrap_or_else(|| error.to_string());
        return Err(unusable(format!("{damage}; without its snapshot: {rest}")));
    }
    files::sync_all(&trial)?;
    std::fs::rename(&dir, aside).map_err(io(&dir, "setting aside"))?;
    crash_point("store.open.aside");
    std::fs::rename(&trial, &dir).map_err(io(&trial, "renaming"))?;
    files::sync_dir(state)
}

/// Moves the database in `state`, whose lock is held, and its mark into a folder of their own, if it is damaged or went back in time. `None`: it
/// is sound.
///
/// # Errors
/// When it cannot be looked at for another reason, or not moved.
pub(super) fn set_untrusted_aside(state: &Path, clock: &Arc<dyn Clock>) -> Result<Option<PathBuf>, StoreError> {
    let looked = queue(state, clock).and_then(|(queue, _)| check_records(queue.tables()));
    match looked {
        Ok(checked) if checked.wrong.is_empty() => return Ok(None),
        Ok(_) => {}
        Err(error) => drop(damage(error)?),
    }
    let aside = state.join(format!("corrupt-{}", clock.now()));
    files::make_folder(&aside)?;
    // The mark last: a database without it would be believed.
    for name in ["db.trial", "db", "SEQ"] {
        let (from, to) = (state.join(name), aside.join(name));
        match std::fs::rename(&from, &to) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            moved => moved.map_err(io(&from, "setting aside"))?,
        }
        files::sync_dir(&aside)?;
        files::sync_dir(state)?;
        crash_point("store.aside.moved");
    }
    Ok(Some(aside))
}

/// How to go on without the database.
fn advice(state: &Path) -> String {
    format!(
        "no mesh is lost: originals are in the hot folders, and each result has its receipt beside it. To begin anew, run `suture jobs \
         rebuild --dir DIR` for the hot folder DIR, which keeps what is in {} aside and takes the jobs from receipts",
        state.display()
    )
}
