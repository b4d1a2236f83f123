//! Drops of a bucket that were fetched, in the scratch of this machine, so that another attempt need not fetch again. What an attempt works on has a second
//! name in its work folder; what has only one may go, the longest unused first, when there is no more room.

use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use rustix::fs::{Timespec, Timestamps, UTIME_NOW, futimens};

use super::{Bucket, Trouble, Version};
use crate::fsx;

/// The files of one bucket.
#[derive(Debug)]
pub(crate) struct Cache {
    folder: PathBuf,
    /// Bytes of all of them, those in use left out of account.
    most: u64,
    /// Who fetches, or makes room.
    turn: Mutex<()>,
}

impl Cache {
    pub(crate) fn new(folder: PathBuf, most: u64) -> Self {
        Self { folder, most, turn: Mutex::default() }
    }

    /// Where that version of an object is, or would be. Each key has its own: a file that two attempts share would seem to change.
    pub(crate) fn path(&self, below: &str, version: &Version) -> PathBuf {
        let name = blake3::hash(format!("{below} {version:?}").as_bytes()).to_hex();
        self.folder.join(name.as_str())
    }

    /// Gives that version a second name, `to`; fetches it if it is not here.
    ///
    /// # Errors
    /// As [`Bucket::fetch`].
    pub(crate) fn give(&self, bucket: &Bucket, below: &str, version: &Version, to: &Path) -> Result<(), Trouble> {
        let here = self.path(below, version);
        if !self.linked(&here, to)? {
            // A name of the attempt's own: two that fetch the same do not meet.
            bucket.fetch(below, version, to)?;
            if version.size > self.most {
                return Ok(());
            }
            let _turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
            self.make_room(version.size)?;
            match std::fs::hard_link(to, &here) {
                Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error.into()),
                _ => {}
            }
        }
        Ok(())
    }

    fn linked(&self, here: &Path, to: &Path) -> io::Result<bool> {
        let _turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
        std::fs::create_dir_all(&self.folder)?;
        if fsx::if_there(std::fs::hard_link(here, to))?.is_none() {
            return Ok(false);
        }
        // It is the one that was used last.
        let now = Timespec { tv_sec: 0, tv_nsec: UTIME_NOW };
        futimens(std::fs::File::open(here)?, &Timestamps { last_access: now, last_modification: now })?;
        Ok(true)
    }

    /// Removes what is not in use, the longest unused first, until so many bytes more have room.
    fn make_room(&self, wanted: u64) -> io::Result<()> {
        let mut unused = Vec::new();
        for entry in std::fs::read_dir(&self.folder)? {
            let path = entry?.path();
            match fsx::if_there(std::fs::symlink_metadata(&path))? {
                Some(meta) if meta.nlink() == 1 => unused.push((meta.modified()?, meta.len(), path)),
                _ => {}
            }
        }
        unused.sort();
        let mut total: u64 = unused.iter().map(|(_, size, _)| size).sum();
        for (_, size, path) in unused {
            if total.saturating_add(wanted) <= self.most {
                break;
            }
            fsx::remove_if_there(&path)?;
            total -= size;
        }
        Ok(())
    }
}
