//! Written pages are pushed to the disk while more are being written.
//!
//! The kernel would let a good share of all memory fill with dirty pages, which a memory cgroup holds against the process and can
//! only get rid of at the disk's speed. Here at most about three steps' worth is dirty at any time: what is being written, what waits
//! for its turn, and what is on its way to the disk.

use std::fs::File;
use std::io::{self, Write};
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;

use crossbeam::channel::{Sender, bounded};

use crate::contract::error::{DESCRIPTORS, Error, Result};
use crate::contract::settings::Limits;
use crate::io::disk_space::{self, Need};
use crate::util::parallel;

/// What is written between two pushes, a share of the budget between these.
const SMALLEST_STEP: u64 = 64 << 10;
const LARGEST_STEP: u64 = 32 << 20;

/// Bytes that are appended between two looks at what is dirty.
const APPENDED_AT_ONCE: usize = 1 << 20;

/// Pushes what is written to one file. Several threads may write.
pub(crate) struct WriteBehind {
    file: File,
    step: u64,
    unsynced: AtomicU64,
    /// Started when there is something to push, so that small files need no thread.
    syncer: Mutex<Option<Syncer>>,
}

impl WriteBehind {
    /// For writes to `file`.
    pub(crate) fn new(file: &File, limits: &Limits) -> io::Result<Self> {
        Ok(Self { file: file.try_clone()?, step: step(limits), unsynced: AtomicU64::new(0), syncer: Mutex::new(None) })
    }

    /// Writes at the end of the file, in parts that are no more than may be dirty.
    pub(crate) fn append(&self, bytes: &[u8]) -> io::Result<()> {
        for part in bytes.chunks(APPENDED_AT_ONCE) {
            (&self.file).write_all(part)?;
            self.wrote(part.len() as u64)?;
        }
        Ok(())
    }

    /// To be called after every write of so many `bytes`, best of much less than a step. Waits while the disk is two steps behind.
    pub(crate) fn wrote(&self, bytes: u64) -> io::Result<()> {
        if self.unsynced.fetch_add(bytes, Ordering::Relaxed) + bytes < self.step {
            return Ok(());
        }
        // Held while waiting: other writers have to wait as well.
        let mut syncer = self.syncer.lock().unwrap_or_else(PoisonError::into_inner);
        if self.unsynced.load(Ordering::Relaxed) < self.step {
            return Ok(());
        }
        self.unsynced.store(0, Ordering::Relaxed);
        if syncer.is_none() {
            *syncer = Syncer::start(&self.file)?;
        }
        match &*syncer {
            // No thread to be had.
            None => self.file.sync_data(),
            // The thread ends early only on an error, which `finish` returns.
            Some(running) if running.requests.send(()).is_err() => syncer.take().map_or(Ok(()), Syncer::finish),
            _ => Ok(()),
        }
    }

    /// Waits for what is on its way; what was written after the last push is not pushed.
    pub(crate) fn finish(self) -> io::Result<()> {
        self.syncer.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), Syncer::finish)
    }
}

/// A file without a name in a folder for spools.
pub(crate) fn nameless(folder: &Path, limits: &Limits) -> Result<(File, WriteBehind)> {
    let making = || Error::io(folder, "making a spool file");
    let file = tempfile::tempfile_in(folder).map_err(making())?;
    let behind = WriteBehind::new(&file, limits).map_err(making())?;
    Ok((file, behind))
}

/// A file without a name, and the path that leads to it as long as this value lives.
pub(crate) struct Nameless {
    file: File,
}

impl Nameless {
    /// An empty one where spools go.
    pub(crate) fn new(limits: &Limits) -> Result<Self> {
        nameless(&limits.spool_folder(), limits).map(|(file, _)| Self::of(file))
    }

    pub(crate) fn of(file: File) -> Self {
        Self { file }
    }

    pub(crate) fn path(&self) -> PathBuf {
        Path::new(DESCRIPTORS).join(self.file.as_raw_fd().to_string())
    }
}

/// A file without a name where spools go, with what `fill` appends. Without room for so many bytes it is refused, in the name of `path`, before it begins.
pub(crate) fn spooled(
    path: &Path,
    limits: &Limits,
    (bytes, what): (u64, &'static str),
    fill: impl FnOnce(&mut dyn FnMut(&[u8]) -> Result<()>) -> Result<()>,
) -> Result<File> {
    let folder = limits.spool_folder();
    disk_space::check(path, &[Need { folder: folder.clone(), bytes, what }])?;
    let (file, behind) = nameless(&folder, limits)?;
    let spooling = || Error::io(&folder, "spooling");
    fill(&mut |bytes| behind.append(bytes).map_err(spooling()))?;
    behind.finish().map_err(spooling())?;
    Ok(file)
}

/// Bytes written between two pushes.
fn step(limits: &Limits) -> u64 {
    (limits.memory_bytes / 64).clamp(SMALLEST_STEP, LARGEST_STEP)
}

/// Most dirty pages that one [`WriteBehind`] leaves, in bytes.
pub(crate) fn most_dirty(limits: &Limits) -> u64 {
    3 * step(limits)
}

/// The thread that waits for the disk; at most one request waits for it.
struct Syncer {
    requests: Sender<()>,
    thread: JoinHandle<io::Result<()>>,
}

impl Syncer {
    fn start(file: &File) -> io::Result<Option<Self>> {
        let file = file.try_clone()?;
        let (requests, todo) = bounded(1);
        Ok(parallel::servant("write-behind", move || todo.iter().try_for_each(|()| file.sync_data()))
            .map(|thread| Self { requests, thread }))
    }

    fn finish(self) -> io::Result<()> {
        drop(self.requests);
        self.thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn everything_written_is_there_whoever_wrote_it() {
        let limits = Limits { memory_bytes: 0, ..Limits::default() };
        let mut file = tempfile::tempfile().unwrap();
        let behind = WriteBehind::new(&file, &limits).unwrap();
        let part = vec![7u8; 300 << 10];
        for _ in 0..20 {
            file.write_all(&part).unwrap();
            behind.wrote(part.len() as u64).unwrap();
        }
        assert!(behind.syncer.lock().unwrap().is_some(), "6 MB in small steps");
        behind.finish().unwrap();
        assert_eq!(file.metadata().unwrap().len(), 20 * part.len() as u64);
    }
}
