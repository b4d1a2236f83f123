//! How the bytes of a file that others may change come into memory.
//!
//! A map of such a file is the fastest way and needs no room, but Rust allows no safe function to make one: whoever changes the file changes
//! memory that the program takes for constant, and whoever truncates it ends the process with SIGBUS. So, as ripgrep's `MmapChoice` does, the
//! caller chooses it by an unsafe function; without that, the engine works on a copy that nobody else can change.

use std::fs::File;
use std::io::{self, Read};
use std::ops::Deref;
use std::path::Path;

use memmap2::{Mmap, MmapMut};

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::io::disk_space::{self, Need};
use crate::io::file_map::FileMap;
use crate::io::write_behind;

/// A file is copied into memory if it takes no more than this part of the budget; a larger one is copied into a file without a name.
const SHARE_OF_MEMORY: u64 = 64;
/// Bytes copied between two looks at whether the work goes on.
const STEP: u64 = 8 << 20;

/// The bytes of a file.
#[derive(Debug)]
pub(super) enum Bytes {
    /// With the file that holds them at the same places.
    Mapped(FileMap, File),
    /// In memory.
    Copied(Mmap),
}

impl Bytes {
    /// The map, if it is of a file.
    pub(super) fn map(&self) -> Option<&FileMap> {
        match self {
            Self::Mapped(map, _) => Some(map),
            Self::Copied(_) => None,
        }
    }

    /// The file that holds them at the same places, if there is one.
    pub(super) fn file(&self) -> Option<&File> {
        match self {
            Self::Mapped(_, file) => Some(file),
            Self::Copied(_) => None,
        }
    }
}

impl Deref for Bytes {
    type Target = Mmap;

    fn deref(&self) -> &Mmap {
        match self {
            Self::Mapped(map, _) => map,
            Self::Copied(map) => map,
        }
    }
}

/// What is known of a file before its bytes are there.
pub(super) struct Foreign<'a> {
    pub(super) path: &'a Path,
    pub(super) file: File,
    /// Its length when it was opened; more than none.
    pub(super) length: usize,
    pub(super) spool: &'a Path,
    pub(super) limits: &'a Limits,
    pub(super) progress: &'a dyn Progress,
}

impl Foreign<'_> {
    /// The bytes.
    pub(super) fn bytes(self) -> Result<Bytes> {
        match self.limits.access.is_mapped() {
            true => {
                // SAFETY: whoever made the `Access` answers for what others do to the file.
                let map = unsafe { FileMap::of(&self.file, self.length) };
                Ok(Bytes::Mapped(map.map_err(Error::io(self.path, "mapping"))?, self.file))
            }
            false if self.length as u64 <= self.limits.memory_bytes / SHARE_OF_MEMORY => self.in_memory().map(Bytes::Copied),
            false => self.in_spool(),
        }
    }

    fn in_memory(&self) -> Result<Mmap> {
        let mut bytes = MmapMut::map_anon(self.length).map_err(Error::io(self.path, "reading"))?;
        (&self.file).read_exact(&mut bytes).map_err(|error| self.failed(error))?;
        bytes.make_read_only().map_err(Error::io(self.path, "reading"))
    }

    fn in_spool(&self) -> Result<Bytes> {
        let length = self.length as u64;
        disk_space::check(self.path, &[Need { folder: self.spool.into(), bytes: length, what: "a copy of the file" }])?;
        let (mut copy, behind) = write_behind::nameless(self.spool, self.limits)?;
        let mut done = 0;
        while done < length {
            let step =
                io::copy(&mut (&self.file).take(STEP.min(length - done)), &mut copy).map_err(Error::io(self.path, "copying"))?;
            if step == 0 {
                return Err(Error::Changed { path: self.path.into() });
            }
            behind.wrote(step).map_err(Error::io(self.spool, "spooling"))?;
            done += step;
            self.progress.at("read", done, length);
            if self.progress.cancelled() {
                return Err(Error::cancelled(self.path, "reading"));
            }
        }
        behind.finish().map_err(Error::io(self.spool, "spooling"))?;
        // SAFETY: the file has no name and this is its only handle: nobody else changes or truncates it, and we no longer write to it.
        let map = unsafe { FileMap::of(&copy, self.length) }.map_err(Error::io(self.spool, "mapping"))?;
        Ok(Bytes::Mapped(map, copy))
    }

    /// A file that ends before its length was truncated after it was opened.
    fn failed(&self, error: io::Error) -> Error {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => Error::Changed { path: self.path.into() },
            _ => Error::io(self.path, "reading")(error),
        }
    }
}
