//! A file as it was when it was opened, and whether it still is.

use std::fs::{File, Metadata, OpenOptions};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use super::access::{Bytes, Foreign};
use super::finding::Rejection;
use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;

/// Properties that tell one state of a file from the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Identity {
    device: u64,
    inode: u64,
    size: u64,
    modified: (i64, i64),
    changed: (i64, i64),
}

impl Identity {
    fn of(metadata: &Metadata) -> Self {
        Self {
            device: metadata.dev(),
            inode: metadata.ino(),
            size: metadata.size(),
            modified: (metadata.mtime(), metadata.mtime_nsec()),
            changed: (metadata.ctime(), metadata.ctime_nsec()),
        }
    }
}

/// A path, and the file that it led to.
#[derive(Debug)]
pub(super) struct Opened {
    path: PathBuf,
    identity: Identity,
}

impl Opened {
    /// Opens a file: its bytes.
    ///
    /// # Errors
    /// [`Error::Unreadable`] for an empty file and for what is no file, [`Error::Changed`], [`Error::NoSpace`], [`Error::Io`].
    pub(super) fn bytes(path: &Path, spool: &Path, limits: &Limits, progress: &dyn Progress) -> Result<(Self, Bytes)> {
        let (file, identity) = open_regular(path)?;
        if identity.size == 0 {
            return Err(Rejection::Unreadable("empty file".into()).at(path));
        }
        // As long as the identity says, whatever happened in between.
        let length = usize::try_from(identity.size).map_err(|_| Rejection::TooMany.at(path))?;
        let input = Foreign { path, file, length, spool, limits, progress }.bytes()?;
        Ok((Self { path: path.to_owned(), identity }, input))
    }

    /// Its length in bytes.
    pub(super) fn size(&self) -> u64 {
        self.identity.size
    }

    /// Fails if the path no longer leads to the file as it was when it was opened.
    ///
    /// # Errors
    /// [`Error::Changed`] if device, inode, size, mtime or ctime differ or the file is gone; [`Error::Io`] if they cannot be read.
    pub(super) fn check_unchanged(&self) -> Result<()> {
        match std::fs::metadata(&self.path) {
            Ok(metadata) if Identity::of(&metadata) == self.identity => Ok(()),
            Ok(_) => Err(Error::Changed { path: self.path.clone() }),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Err(Error::Changed { path: self.path.clone() }),
            Err(error) => Err(Error::io(&self.path, "checking")(error)),
        }
    }
}

/// Opens a regular file without ever waiting for one: a named pipe would block an ordinary open until someone writes to it.
fn open_regular(path: &Path) -> Result<(File, Identity)> {
    let no_wait = rustix::fs::OFlags::NONBLOCK.bits() as i32;
    let file = OpenOptions::new().read(true).custom_flags(no_wait).open(path).map_err(Error::io(path, "opening"))?;
    let metadata = file.metadata().map_err(Error::io(path, "opening"))?;
    let reason = match metadata.file_type() {
        kind if kind.is_file() => return Ok((file, Identity::of(&metadata))),
        kind if kind.is_dir() => "a folder",
        _ => "a pipe or device, not a file",
    };
    Err(Rejection::Unreadable(reason.into()).at(path))
}
