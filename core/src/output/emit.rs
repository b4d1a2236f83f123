//! Writes the output: header, exact count, and the input as the edit leaves it.
//!
//! Nearly all of it is the input's bytes where they stood. So the input is copied, and hashed, while it is still being found out what is
//! wrong with it and the disk has nothing else to do. Then only what differs is written over it; where more triangles go than come,
//! everything behind the first gap is written once more.

use std::fs::{File, OpenOptions};
use std::io::{self, IoSlice, Seek, SeekFrom, Write};
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::ScopedJoinHandle;

use rustix::io::Errno;

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::io::digest;
use crate::io::digest::Digest;
use crate::io::read::{MeshFile, PREFIX_BYTES};
use crate::io::read_ahead::Guide;
use crate::io::record::Record;
use crate::io::write_behind::WriteBehind;
use crate::output::edit::{Edit, Step};
use crate::util::parallel::{self, Aside};
use crate::util::words::Count;

/// Smaller files are not copied ahead: it takes longer to start a thread.
const COPIED_AHEAD: usize = 1 << 20;
/// Untouched runs of at least this many bytes are copied inside the kernel.
const KERNEL_COPY_BYTES: usize = 256 << 10;
/// Copied inside the kernel at a time, between two looks at how far the disk is behind; whole blocks of a digest.
const COPY_BYTES: usize = 16 * digest::BLOCK;

/// The bytes that a file is to hold.
pub(crate) enum Content<'a> {
    /// The input, byte for byte.
    Input,
    /// The input's triangles as the edit leaves them.
    Edited(&'a Edit),
    /// None: the input itself is the result.
    Nothing,
}

impl Content<'_> {
    /// How many of its first bytes can be the input's, but for single records.
    fn in_place(&self, mesh: &MeshFile) -> u64 {
        match self {
            Self::Input => u64::MAX,
            Self::Edited(edit) => end_of(edit.first_gap().map_or(mesh.records().len(), |gap| gap as usize)),
            Self::Nothing => 0,
        }
    }
}

/// Where so many records end in a file.
fn end_of(records: usize) -> u64 {
    (PREFIX_BYTES + records * size_of::<Record>()) as u64
}

/// The output, as far as it is known while the input is copied to it.
struct Wanted {
    /// So many bytes of the input, at most.
    bytes: AtomicU64,
    /// Someone waits for them.
    awaited: AtomicBool,
    /// Nothing, after all.
    given_up: AtomicBool,
}

/// Makes the new file `output`, of a mesh of which it is known already what it is to hold.
///
/// # Errors
/// [`Error`], any of them.
pub(crate) fn write(
    mesh: &MeshFile,
    output: &Path,
    content: &Content<'_>,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<Written> {
    let mut sink = Sink::create(mesh, output, limits, progress)?;
    sink.hold(content, limits)?;
    sink.finish(limits)
}

/// Makes a file that was written already the copy of a mesh's file instead.
///
/// # Errors
/// [`Error`], any of them.
pub(crate) fn rewrite(mesh: &MeshFile, written: Written, limits: &Limits, progress: &dyn Progress) -> Result<Written> {
    let (path, file) = (written.path.clone(), Arc::clone(&written.file));
    written.durable()?;
    let failed = || Error::io(&path, "writing");
    file.set_len(0).map_err(failed())?;
    (&*file).rewind().map_err(failed())?;
    let mut sink = Sink::of(file, mesh, &path, limits, progress)?;
    sink.hold(&Content::Input, limits)?;
    sink.finish(limits)
}

/// How much of a mesh is copied while it is not known yet what the output is to hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ahead {
    /// As much as may be in the output.
    All,
    /// Nothing: it is hashed, and no more.
    Nothing,
}

/// Lets `work` make the new file `output` of `mesh`, which is hashed, and copied to it, meanwhile, where there is a thread to spare.
pub(crate) fn draft<R>(
    mesh: &MeshFile,
    (output, ahead): (&Path, Ahead),
    limits: &Limits,
    progress: &dyn Progress,
    work: impl FnOnce(Draft<'_, '_>) -> Result<R>,
) -> Result<R> {
    let bytes = match ahead {
        Ahead::Nothing => 0,
        Ahead::All if mesh.is_flawless() => u64::MAX,
        // Bytes behind the records are copied only with a file that may turn out to be good as it is.
        Ahead::All => end_of(mesh.records().len()),
    };
    let wanted = Wanted { bytes: AtomicU64::new(bytes), awaited: AtomicBool::new(false), given_up: AtomicBool::new(false) };
    let is_ahead = mesh.is_in_place() && limits.threads > 1 && mesh.bytes().len() >= COPIED_AHEAD;
    std::thread::scope(|scope| {
        let copy = || Sink::create(mesh, output, limits, progress)?.copy(limits, &wanted);
        let copying = if is_ahead { parallel::scoped_servant(scope, "copy", copy) } else { None };
        work(Draft { mesh, output, limits, progress, wanted: &wanted, copying })
    })
}

/// An output of which it is not known yet what it is to hold. One that is dropped is given up.
pub(crate) struct Draft<'scope, 'a> {
    mesh: &'a MeshFile,
    output: &'a Path,
    limits: &'a Limits,
    progress: &'a dyn Progress,
    wanted: &'a Wanted,
    /// The copy so far, and the digest of the input.
    copying: Option<ScopedJoinHandle<'scope, Result<(Sink<'a>, Digest)>>>,
}

impl Drop for Draft<'_, '_> {
    fn drop(&mut self) {
        self.wanted.given_up.store(true, Ordering::Relaxed);
    }
}

impl Draft<'_, '_> {
    /// Makes it hold `content` and begins to sync it, unless that is deferred. Returns the digest of the input, block by block, as well.
    pub(crate) fn finish(mut self, content: &Content<'_>) -> Result<(Written, Digest)> {
        let Self { mesh, output, limits, progress, wanted, .. } = self;
        self.wanted.awaited.store(true, Ordering::Relaxed);
        let (mut sink, digest) = match self.copying.take() {
            Some(copying) => {
                wanted.bytes.fetch_min(content.in_place(mesh), Ordering::Relaxed);
                copying.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?
            }
            None => {
                wanted.bytes.store(0, Ordering::Relaxed);
                Sink::create(mesh, output, limits, progress)?.copy(limits, wanted)?
            }
        };
        sink.hold(content, limits)?;
        Ok((sink.finish(limits)?, digest))
    }
}

/// Runs shorter than this are copied to the others that wait: it takes longer to hand over one more piece.
const COPIED_BYTES: usize = 1 << 10;
/// So much waits to be written together, in so many pieces (the system takes 1024).
const WAITING_BYTES: usize = 1 << 20;
const WAITING_PIECES: usize = 512;

/// A piece of the output that waits to be written.
enum Piece<'a> {
    /// Of the input, where it lies.
    Run(&'a [u8]),
    /// The next so many bytes of the sink's own.
    Own(usize),
}

/// The output file, and what waits to be written to it.
struct Sink<'a> {
    mesh: &'a MeshFile,
    path: &'a Path,
    /// Copies inside the kernel are not to be had between all file systems.
    kernel_copies: bool,
    file: Arc<File>,
    waiting: Vec<Piece<'a>>,
    waiting_bytes: usize,
    /// Bytes that are few, or not the input's.
    own: Vec<u8>,
    /// Where in the output that goes which is put next.
    at: u64,
    /// So many bytes at the beginning are the input's already.
    copied: u64,
    behind: WriteBehind,
    progress: &'a dyn Progress,
}

impl<'a> Sink<'a> {
    fn create(mesh: &'a MeshFile, path: &'a Path, limits: &Limits, progress: &'a dyn Progress) -> Result<Self> {
        let file = create(path).map_err(Error::io(path, "creating"))?;
        Self::of(Arc::new(file), mesh, path, limits, progress)
    }

    /// The empty file at the path.
    fn of(file: Arc<File>, mesh: &'a MeshFile, path: &'a Path, limits: &Limits, progress: &'a dyn Progress) -> Result<Self> {
        let behind = WriteBehind::new(&file, limits).map_err(Error::io(path, "creating"))?;
        Ok(Self {
            mesh,
            path,
            kernel_copies: true,
            file,
            waiting: Vec::new(),
            waiting_bytes: 0,
            own: Vec::new(),
            at: 0,
            copied: 0,
            behind,
            progress,
        })
    }

    /// Copies as many bytes of the input as are wanted, and digests all of it.
    fn copy(mut self, limits: &Limits, wanted: &Wanted) -> Result<(Self, Digest)> {
        let bytes = self.mesh.bytes();
        let mut digest = Vec::with_capacity(bytes.len().div_ceil(digest::BLOCK));
        let mut hashed = 0;
        for block in Guide::new(bytes, limits).blocks(bytes).flat_map(|block| block.chunks(COPY_BYTES)) {
            if wanted.given_up.load(Ordering::Relaxed) {
                break;
            }
            let left = wanted.bytes.load(Ordering::Relaxed).saturating_sub(hashed);
            if left > 0 {
                self.put_bytes(&block[..block.len().min(usize::try_from(left).unwrap_or(usize::MAX))])?;
            }
            digest.extend(block.chunks(digest::BLOCK).zip(digest.len()..).map(|(block, number)| digest::value(number, block)));
            hashed += block.len() as u64;
            if wanted.awaited.load(Ordering::Relaxed) {
                self.tell(hashed);
            }
        }
        self.flush()?;
        self.copied = std::mem::take(&mut self.at);
        (&*self.file).rewind().map_err(|e| self.failed(e))?;
        Ok((self, digest))
    }

    /// Writes what is not there yet.
    fn hold(&mut self, content: &Content<'_>, limits: &Limits) -> Result<()> {
        let records = self.mesh.records();
        let _put = Guide::new(records.as_flattened(), limits).in_order(records);
        let edit = match content {
            Content::Nothing => return Ok(()),
            Content::Input => return self.put_input(self.mesh.bytes()),
            Content::Edited(edit) => edit,
        };
        let count = edit.output_records(records.len());
        let count = u32::try_from(count).map_err(|_| Error::Refused {
            path: self.mesh.path().into(),
            reason: format!("the result has {} triangles", Count(count)),
            advice: "an STL can hold 4 294 967 295: split the file".into(),
        })?;
        self.put(&self.mesh.output_header())?;
        self.put(&count.to_le_bytes())?;
        edit.walk(records, |step| match step {
            Step::Untouched(run) => self.put_input(run.as_flattened()),
            Step::Changed(_, record, _) => self.put(&record),
            Step::Deleted(_) => Ok(()),
            Step::Added(record, _) => self.put(record),
        })
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.own.extend_from_slice(bytes);
        match self.waiting.last_mut() {
            Some(Piece::Own(count)) => *count += bytes.len(),
            _ => self.waiting.push(Piece::Own(bytes.len())),
        }
        self.wait_for_more(bytes.len())
    }

    /// Puts what may be there already.
    fn put_input(&mut self, mut bytes: &'a [u8]) -> Result<()> {
        if bytes.len() >= COPIED_BYTES && self.mesh.locate(bytes).is_some_and(|(_, offset)| offset == self.at) {
            let there = bytes.len().min(usize::try_from(self.copied.saturating_sub(self.at)).unwrap_or(usize::MAX));
            if there > 0 {
                self.flush()?;
                self.at += there as u64;
                bytes = &bytes[there..];
                (&*self.file).seek(SeekFrom::Start(self.at)).map_err(|e| self.failed(e))?;
                self.tell(self.at);
            }
        }
        self.put_bytes(bytes)
    }

    fn put_bytes(&mut self, bytes: &'a [u8]) -> Result<()> {
        if bytes.len() < COPIED_BYTES {
            return self.put(bytes);
        }
        if bytes.len() < KERNEL_COPY_BYTES {
            self.waiting.push(Piece::Run(bytes));
            return self.wait_for_more(bytes.len());
        }
        self.flush()?;
        for part in bytes.chunks(COPY_BYTES) {
            self.copy_large(part).map_err(|e| self.failed(e))?;
            self.at += part.len() as u64;
            self.account(part.len())?;
        }
        Ok(())
    }

    fn wait_for_more(&mut self, bytes: usize) -> Result<()> {
        self.at += bytes as u64;
        self.waiting_bytes += bytes;
        if self.waiting_bytes >= WAITING_BYTES || self.waiting.len() >= WAITING_PIECES { self.flush() } else { Ok(()) }
    }

    /// Copies inside the kernel where the bytes lie in the input file, and writes them otherwise.
    fn copy_large(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        while self.kernel_copies && !bytes.is_empty() {
            let Some((input, mut offset)) = self.mesh.locate(bytes) else { break };
            match rustix::fs::copy_file_range(input.as_fd(), Some(&mut offset), self.file.as_fd(), None, bytes.len()) {
                Ok(copied) if copied > 0 => bytes = &bytes[copied..],
                // Refused; this call has copied nothing.
                _ => self.kernel_copies = false,
            }
        }
        (&*self.file).write_all(bytes)
    }

    /// Writes what waits, from where it lies.
    fn flush(&mut self) -> Result<()> {
        let mut own = self.own.as_slice();
        let mut pieces: Vec<IoSlice<'_>> = Vec::with_capacity(self.waiting.len());
        pieces.extend(self.waiting.iter().map(|piece| match piece {
            Piece::Run(bytes) => IoSlice::new(bytes),
            Piece::Own(count) => {
                let (bytes, rest) = own.split_at(*count);
                own = rest;
                IoSlice::new(bytes)
            }
        }));
        write_all(&self.file, &mut pieces).map_err(|e| self.failed(e))?;
        let written = std::mem::take(&mut self.waiting_bytes);
        self.waiting.clear();
        self.own.clear();
        self.account(written)
    }

    /// Memory that cannot be read is a part of the input that is not there any more.
    fn failed(&self, error: io::Error) -> Error {
        if error.raw_os_error() == Some(Errno::FAULT.raw_os_error()) {
            return Error::Changed { path: self.mesh.path().into() };
        }
        Error::io(self.path, "writing")(error)
    }

    fn account(&mut self, written: usize) -> Result<()> {
        self.behind.wrote(written as u64).map_err(Error::io(self.path, "syncing"))
    }

    fn tell(&self, bytes: u64) {
        let total = self.mesh.records().len() as u64;
        self.progress.at("emit", (bytes / size_of::<Record>() as u64).min(total), total);
    }

    fn finish(mut self, limits: &Limits) -> Result<Written> {
        self.flush()?;
        if self.copied > self.at {
            self.file.set_len(self.at).map_err(|e| self.failed(e))?;
        }
        let Self { path, file, behind, .. } = self;
        let deferred = limits.defer_sync;
        let synced = Arc::clone(&file);
        let sync = move || {
            behind.finish()?;
            if deferred { Ok(()) } else { synced.sync_all() }
        };
        let syncing = if limits.threads > 1 && self.mesh.bytes().len() >= SYNCED_BESIDE {
            Some(Aside::start("sync", sync))
        } else {
            sync().map_err(Error::io(path, "syncing"))?;
            None
        };
        Ok(Written { path: path.into(), file, syncing })
    }
}

fn write_all(mut file: &File, mut pieces: &mut [IoSlice<'_>]) -> io::Result<()> {
    // There may be nothing, and pieces of no bytes.
    IoSlice::advance_slices(&mut pieces, 0);
    while !pieces.is_empty() {
        match file.write_vectored(pieces) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(count) => IoSlice::advance_slices(&mut pieces, count),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

/// Larger files are read again while the last of them goes to the disk.
const SYNCED_BESIDE: usize = 8 << 20;

/// A file that is written, but perhaps not yet on the disk.
#[must_use]
pub(crate) struct Written {
    path: PathBuf,
    file: Arc<File>,
    syncing: Option<Aside<io::Result<()>>>,
}

impl Written {
    /// Waits until the disk has all of it, unless that is deferred.
    pub(crate) fn durable(mut self) -> Result<()> {
        self.wait().map_err(Error::io(&self.path, "syncing"))
    }

    fn wait(&mut self) -> io::Result<()> {
        self.syncing.take().map_or(Ok(()), Aside::join)
    }
}

impl Drop for Written {
    fn drop(&mut self) {
        // The file is given up because of another error.
        let _ = self.wait();
    }
}

/// A new file; or the empty one without a name that the caller holds open.
pub(crate) fn create(path: &Path) -> io::Result<File> {
    let nameless = is_nameless(path);
    let file = OpenOptions::new().write(true).create_new(!nameless).open(path)?;
    if nameless && file.metadata()?.len() > 0 {
        return Err(io::ErrorKind::AlreadyExists.into());
    }
    Ok(file)
}

/// Does the path lead to a file that a process holds open, rather than to a name in a folder?
pub(crate) fn is_nameless(path: &Path) -> bool {
    path.starts_with("/proc")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::progress::Quiet;
    use crate::testing::{plate, records};

    #[test]
    fn what_stands_behind_the_records_is_not_copied_ahead() {
        let folder = tempfile::tempdir().unwrap();
        let (input, output) = (folder.path().join("part.stl"), folder.path().join("out.stl"));
        let records = records(&plate(110, |_, _| true));
        let mesh = [&[0; 80][..], &(records.len() as u32).to_le_bytes(), records.as_flattened()].concat();
        let limits = Limits { threads: 2, ..Limits::default() };
        for (behind, whole) in [(vec![], mesh.len()), (vec![7; 3 << 20], mesh.len())] {
            std::fs::write(&input, [&mesh[..], &behind].concat()).unwrap();
            let file = MeshFile::open(&input, folder.path(), &limits, &Quiet).unwrap();
            let written = draft(&file, (&output, Ahead::All), &limits, &Quiet, |draft| {
                while !draft.copying.as_ref().unwrap().is_finished() {
                    std::thread::yield_now();
                }
                Ok(std::fs::metadata(&output).unwrap().len())
            });
            assert_eq!(written.unwrap(), whole as u64);
            std::fs::remove_file(&output).unwrap();
        }
    }
}
