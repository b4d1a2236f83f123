//! The four tables as sled trees, and the one place where they become durable.

use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Condvar, Mutex, MutexGuard};

use sled::transaction::{TransactionError, TransactionResult, Transactional};

use super::files::{self, io};
use crate::crash::crash_point;
use crate::id::{Epoch, Seq};
use crate::stall::Call;
use crate::store::StoreError;
use crate::tables::{Put, Table, Tables, Visit};

/// Indexes of earlier versions: of results, and of files.
const EARLIER_INDEXES: [&str; 2] = ["by_recipe", "by_key"];
/// Transitions between two marks in `SEQ`.
const MARK_EVERY: u64 = 64;

pub(super) struct SledTables {
    state: PathBuf,
    dir: PathBuf,
    /// Gone only while this value is dropped.
    handles: Option<Handles>,
    /// Our own handle of the database file: the only way to a real sync.
    file: File,
    progress: Mutex<Progress>,
    synced: Condvar,
}

/// Everything that keeps the database open.
struct Handles {
    db: sled::Db,
    meta: sled::Tree,
    jobs: sled::Tree,
    by_state: sled::Tree,
    outbox: sled::Tree,
}

impl Drop for SledTables {
    fn drop(&mut self) {
        // sled flushes when its last handle goes, and, where the disk fails it, panics or waits for ever: in doubt, the handles stay, and
        // end with the process.
        let sound = self.sound().and_then(|()| self.sync());
        let handles = self.handles.take();
        let closed = match sound {
            Ok(()) => guarded(|| {
                drop(handles);
                Ok(())
            }),
            Err(error) => {
                std::mem::forget(handles);
                Err(error)
            }
        };
        if let Err(error) = closed {
            tracing::error!(%error, "the job database could not be closed; nothing acknowledged is lost");
        }
    }
}

#[derive(Default)]
struct Progress {
    written: Seq,
    durable: Seq,
    marked: Option<Seq>,
    /// A thread is syncing for all who wait.
    syncing: bool,
    poisoned: Option<String>,
}

fn failed(error: sled::Error) -> StoreError {
    StoreError::Backend(Box::new(error))
}

/// The error of sled behind `error`.
pub(super) fn cause(error: &StoreError) -> Option<&sled::Error> {
    match error {
        StoreError::Backend(error) => error.downcast_ref(),
        _ => None,
    }
}

/// Runs `act` of sled, which may panic over damaged files; that is an error like any other. While it runs, it can be seen from outside.
fn guarded<T>(act: impl FnOnce() -> Result<T, StoreError>) -> Result<T, StoreError> {
    let _call = Call::begin();
    catch_unwind(AssertUnwindSafe(act)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
        let what = text.unwrap_or("no message").to_owned();
        Err(failed(sled::Error::ReportableBug(format!("it panicked: {what}"))))
    })
}

impl SledTables {
    /// Opens the database in `dir`; its marks go to `state`.
    pub(super) fn open(state: &Path, dir: &Path) -> Result<Self, StoreError> {
        guarded(|| {
            let db = sled::Config::new()
                .path(dir)
                .cache_capacity(64 << 20)
                .segment_size(64 << 10)
                .flush_every_ms(Some(200))
                .mode(sled::Mode::LowSpace)
                .open()
                .map_err(failed)?;
            crash_point("store.open.sled");
            let tree = |name: &str| db.open_tree(name).map_err(failed);
            let (meta, jobs) = (tree("meta")?, tree("jobs")?);
            let (by_state, outbox) = (tree("by_state")?, tree("outbox")?);
            let path = dir.join("db");
            let file = File::open(&path).map_err(io(&path, "opening the database file"))?;
            Ok(Self {
                state: state.to_owned(),
                dir: dir.to_owned(),
                handles: Some(Handles { db, meta, jobs, by_state, outbox }),
                file,
                progress: Mutex::default(),
                synced: Condvar::new(),
            })
        })
    }

    /// Removes the indexes that earlier versions kept on disk. The head that is durable by now keeps these versions away from here.
    pub(super) fn drop_earlier_indexes(&self) -> Result<(), StoreError> {
        let db = &self.handles()?.db;
        guarded(|| EARLIER_INDEXES.iter().try_for_each(|name| db.drop_tree(name).map(drop).map_err(failed)))
    }

    #[cfg(test)]
    pub(super) fn raw_jobs(&self) -> &sled::Tree {
        &self.handles.as_ref().unwrap().jobs
    }

    #[cfg(test)]
    pub(super) fn names(&self) -> Vec<String> {
        let names = self.handles.as_ref().unwrap().db.tree_names();
        names.iter().map(|name| String::from_utf8_lossy(name).into_owned()).collect()
    }

    fn handles(&self) -> Result<&Handles, StoreError> {
        self.handles.as_ref().ok_or_else(|| StoreError::Poisoned { reason: "it was closed".into() })
    }

    fn tree(&self, table: Table) -> Result<&sled::Tree, StoreError> {
        let handles = self.handles()?;
        Ok(match table {
            Table::Meta => &handles.meta,
            Table::Jobs => &handles.jobs,
            Table::ByState => &handles.by_state,
            Table::Outbox => &handles.outbox,
        })
    }

    fn progress(&self) -> MutexGuard<'_, Progress> {
        // Plain values, set by assignments: whole even if a thread panicked while it held the lock.
        self.progress.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// Remembers that the database is in doubt, and why.
    pub(super) fn poison(&self, error: StoreError) -> StoreError {
        tracing::error!(%error, "the job database must be opened again");
        self.progress().poisoned.get_or_insert_with(|| error.to_string());
        error
    }

    /// Makes everything written durable.
    fn sync(&self) -> Result<(), StoreError> {
        guarded(|| {
            self.handles()?.db.flush().map_err(failed)?;
            crash_point("store.sync.flushed");
            self.file.sync_data().map_err(io(&self.dir.join("db"), "syncing the database file"))?;
            crash_point("store.sync.synced");
            Ok(())
        })
    }

    /// Notes in `SEQ` that everything up to `at` is durable.
    pub(super) fn note(&self, at: (Epoch, Seq)) -> Result<(), StoreError> {
        self.sound()?;
        self.sync()?;
        self.mark(at)
    }

    fn mark(&self, (epoch, seq): (Epoch, Seq)) -> Result<(), StoreError> {
        // sled replaces its snapshots by renaming; now and then these names are made durable, too.
        files::sync_dir(&self.dir)?;
        files::write_mark(&self.state, epoch, seq)?;
        self.progress().marked = Some(seq);
        Ok(())
    }

    /// One thread's turn to sync for all: `target` was written before the sync began.
    fn lead(&self, epoch: Epoch, target: Seq, marked: Option<Seq>) -> Result<(), StoreError> {
        self.sync()?;
        if marked.is_none_or(|marked| target.0 >= marked.0 + MARK_EVERY) {
            self.mark((epoch, target))?;
        }
        Ok(())
    }
}

impl Tables for SledTables {
    fn get(&self, table: Table, key: &[u8]) -> Result<Option<Vec<u8>>, StoreError> {
        let read = guarded(|| self.tree(table)?.get(key).map_err(failed));
        Ok(read.map_err(|error| self.poison(error))?.map(|value| value.to_vec()))
    }

    fn scan(&self, table: Table, from: &[u8], to: &[u8], each: Visit<'_>) -> Result<(), StoreError> {
        let tree = self.tree(table)?;
        let mut entries = if to.is_empty() { tree.range(from..) } else { tree.range(from..to) };
        while let Some(entry) = guarded(|| entries.next().transpose().map_err(failed)).map_err(|error| self.poison(error))? {
            if !each(&entry.0, &entry.1)? {
                break;
            }
        }
        Ok(())
    }

    fn scan_back(&self, table: Table, from: &[u8], to: &[u8], each: Visit<'_>) -> Result<(), StoreError> {
        let tree = self.tree(table)?;
        let mut entries = tree.range(from..to);
        while let Some(entry) = guarded(|| entries.next_back().transpose().map_err(failed)).map_err(|error| self.poison(error))? {
            if !each(&entry.0, &entry.1)? {
                break;
            }
        }
        Ok(())
    }

    fn write(&self, puts: Vec<Put>, seq: Seq) -> Result<(), StoreError> {
        self.sound()?;
        let Handles { meta, jobs, by_state, outbox, .. } = self.handles()?;
        let trees = (meta, jobs, by_state, outbox);
        let written = guarded(|| {
            let result: TransactionResult<(), ()> = trees.transaction(|(meta, jobs, by_state, outbox)| {
                for put in &puts {
                    let tree = match put.table {
                        Table::Meta => meta,
                        Table::Jobs => jobs,
                        Table::ByState => by_state,
                        Table::Outbox => outbox,
                    };
                    match &put.value {
                        Some(value) => tree.insert(put.key.as_slice(), value.as_slice())?,
                        None => tree.remove(put.key.as_slice())?,
                    };
                }
                Ok(())
            });
            result.map_err(|error| match error {
                TransactionError::Storage(error) => failed(error),
                TransactionError::Abort(()) => StoreError::Poisoned { reason: "a transaction was aborted".into() },
            })
        });
        written.map_err(|error| self.poison(error))?;
        self.progress().written = seq;
        Ok(())
    }

    fn settle(&self, (epoch, seq): (Epoch, Seq)) -> Result<(), StoreError> {
        let mut progress = self.progress();
        loop {
            if progress.durable >= seq {
                return Ok(());
            }
            if let Some(reason) = &progress.poisoned {
                return Err(StoreError::Poisoned { reason: reason.clone() });
            }
            if progress.syncing {
                progress = self.synced.wait(progress).unwrap_or_else(std::sync::PoisonError::into_inner);
                continue;
            }
            progress.syncing = true;
            let (target, marked) = (progress.written, progress.marked);
            drop(progress);
            let led = self.lead(epoch, target, marked).map_err(|error| self.poison(error));
            progress = self.progress();
            progress.syncing = false;
            if led.is_ok() {
                progress.durable = target;
            }
            self.synced.notify_all();
            led?;
        }
    }

    fn sound(&self) -> Result<(), StoreError> {
        match &self.progress().poisoned {
            Some(reason) => Err(StoreError::Poisoned { reason: reason.clone() }),
            None => Ok(()),
        }
    }
}
