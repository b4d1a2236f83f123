//! What a parser makes of a file, on its way into files without a name.
//!
//! A file is parsed piece by piece, in parallel; what the pieces give is taken in their order, while the next ones are parsed. Memory: the items of
//! a batch of pieces and of the batch before it, whatever the file's length. The dirty pages of a spool are written back step by step, since the
//! kernel would otherwise let a share of all memory fill with them.

use std::fs::File;
use std::io::{Seek, SeekFrom};
use std::path::Path;

use rayon::prelude::*;

use super::finding::Rejection;
use super::limits::MAX_TRIANGLES;
use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::io::disk_space::{self, Need};
use crate::io::file_map::FileMap;
use crate::io::write_behind::{self, WriteBehind};

/// Bytes of a position in a spool: x, y, z as little-endian `f32`.
pub(super) const POSITION_BYTES: usize = 12;

/// Paths, limits and progress of a reading.
#[derive(Clone, Copy)]
pub(crate) struct Context<'a> {
    pub(super) path: &'a Path,
    /// The folder for spools.
    pub(super) spool: &'a Path,
    pub(super) limits: &'a Limits,
    pub(super) progress: &'a dyn Progress,
    /// The map that is read from its beginning to its end, if it is of a file: what lies behind the reader is let go.
    pub(super) passed: Option<&'a FileMap>,
}

impl<'a> Context<'a> {
    /// For reading this map from its beginning to its end.
    pub(super) fn passing(self, map: Option<&'a FileMap>) -> Self {
        Self { passed: map, ..self }
    }

    /// Refuses the file when there is no room for so many bytes in the folder for spools.
    pub(super) fn make_room(&self, bytes: u64, what: &'static str) -> Result<()> {
        disk_space::check(self.path, &[Need { folder: self.spool.into(), bytes, what }])
    }

    /// A spool for records.
    pub(super) fn records(&self) -> Result<Spool<'a, 50>> {
        self.spool(MAX_TRIANGLES)
    }

    /// A spool for positions; faces refer to them by 32 bits.
    pub(super) fn positions(&self) -> Result<Spool<'a, POSITION_BYTES>> {
        self.spool(u64::from(u32::MAX))
    }

    /// A spool for text: what is unpacked of an archive.
    pub(super) fn text(&self) -> Result<Spool<'a, 1>> {
        self.spool(u64::MAX)
    }

    /// A spool for at most so many items of `N` bytes.
    pub(super) fn spool<const N: usize>(&self, most: u64) -> Result<Spool<'a, N>> {
        let (file, behind) = write_behind::nameless(self.spool, self.limits)?;
        Ok(Spool { folder: self.spool, path: self.path, file, behind, count: 0, most })
    }

    /// Parses the pieces of a file in parallel, and takes what they give in their order. `next` gives a batch of pieces and how many of the `total`
    /// bytes lie before its end; an empty batch ends it. Call it within a pool of threads.
    ///
    /// # Errors
    /// Those of `next` and `take`, and [`Error::Io`] when the progress cancels.
    pub(super) fn in_order<P: Sync, R: Send>(
        &self,
        total: u64,
        mut next: impl FnMut() -> Result<(Vec<P>, u64)>,
        parse: impl Fn(&P) -> R + Sync,
        mut take: impl FnMut(R) -> Result<()> + Send,
    ) -> Result<()> {
        let mut parsed: Vec<R> = Vec::new();
        loop {
            let (batch, done) = next()?;
            let waiting = std::mem::take(&mut parsed);
            // The batch before is taken while this one is parsed.
            let (taken, now) =
                rayon::join(|| waiting.into_iter().try_for_each(&mut take), || batch.par_iter().map(&parse).collect::<Vec<_>>());
            taken?;
            if batch.is_empty() {
                return Ok(());
            }
            parsed = now;
            if let Some(map) = self.passed {
                map.let_go();
            }
            self.at(done, total)?;
        }
    }

    /// Says where the reading stands.
    ///
    /// # Errors
    /// [`Error::Io`] when the progress cancels.
    pub(super) fn at(&self, done: u64, total: u64) -> Result<()> {
        self.progress.at("read", done, total);
        if self.progress.cancelled() { Err(Error::cancelled(self.path, "reading")) } else { Ok(()) }
    }
}

/// Items of `N` bytes on their way into a file without a name.
pub(super) struct Spool<'a, const N: usize> {
    folder: &'a Path,
    path: &'a Path,
    file: File,
    behind: WriteBehind,
    count: u64,
    most: u64,
}

impl<const N: usize> Spool<'_, N> {
    /// Appends these items.
    ///
    /// # Errors
    /// [`Error::Refused`] for more than can be counted, [`Error::Io`].
    pub(super) fn append(&mut self, items: &[[u8; N]]) -> Result<()> {
        self.count += items.len() as u64;
        if self.count > self.most {
            return Err(Rejection::TooMany.at(self.path));
        }
        self.behind.append(items.as_flattened()).map_err(Error::io(self.folder, "spooling"))
    }

    /// Forgets all items but the first `count`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(super) fn back_to(&mut self, count: u64) -> Result<()> {
        let length = count * N as u64;
        let cut = self.file.set_len(length).and_then(|()| (&self.file).seek(SeekFrom::Start(length)));
        cut.map_err(Error::io(self.folder, "spooling"))?;
        self.count = count;
        Ok(())
    }

    /// So many items are in it.
    pub(super) fn count(&self) -> u64 {
        self.count
    }

    /// The items, mapped.
    pub(super) fn map(self) -> Result<Items<N>> {
        self.behind.finish().map_err(Error::io(self.folder, "spooling"))?;
        if self.count == 0 {
            return Ok(Items(None));
        }
        let length = usize::try_from(self.count).ok().and_then(|count| count.checked_mul(N));
        let length = length.ok_or_else(|| Rejection::TooMany.at(self.path))?;
        // SAFETY: the file has no name and this was its only handle that writes: nobody changes or truncates it.
        let map = unsafe { FileMap::of(&self.file, length) }.map_err(Error::io(self.folder, "mapping"))?;
        Ok(Items(Some(map)))
    }
}

/// Items of `N` bytes in a file without a name.
#[derive(Debug, Default)]
pub(crate) struct Items<const N: usize>(Option<FileMap>);

impl<const N: usize> Items<N> {
    /// All of them, in the order in which they were appended.
    pub(crate) fn all(&self) -> &[[u8; N]] {
        self.0.as_ref().map_or(&[], |map| map.as_chunks().0)
    }

    /// The file that holds them, mapped.
    pub(super) fn map(&self) -> Option<&FileMap> {
        self.0.as_ref()
    }

    /// Gives their pages back until they are read again.
    pub(crate) fn let_go(&self) {
        if let Some(map) = &self.0 {
            map.let_go();
        }
    }
}
