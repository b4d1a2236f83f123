//! Writes the output once: header, exact count, and the input as the edit leaves it.

use std::fs::{File, OpenOptions};
use std::io::{self, IoSlice, Write};
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use rustix::io::Errno;

use crate::Progress;
use crate::ahead::Guide;
use crate::behind::WriteBehind;
use crate::edit::{Edit, Step};
use crate::error::{Error, Result};
use crate::read::MeshFile;
use crate::record::Record;
use crate::settings::Limits;

/// Untouched runs of at least this many bytes are copied inside the kernel.
const KERNEL_COPY_BYTES: usize = 256 << 10;
/// Copied inside the kernel at a time, between two looks at how far the disk is behind.
const COPY_BYTES: usize = 1 << 20;

/// Writes `mesh` with `edit` to the new file `output` and begins to sync it, unless that is deferred.
pub(crate) fn write(mesh: &MeshFile, edit: &Edit, output: &Path, limits: &Limits, progress: &dyn Progress) -> Result<Written> {
    let records = mesh.records();
    let count = edit.output_records(records.len());
    let count = u32::try_from(count).map_err(|_| Error::Refused {
        path: mesh.path().into(),
        reason: format!("the result has {count} triangles"),
        advice: "an STL can hold 4294967295: split the file".into(),
    })?;
    let mut sink = Sink::create(mesh, output, limits, progress)?;
    sink.put(&mesh.output_header())?;
    sink.put(&count.to_le_bytes())?;
    edit.walk(records, |step| match step {
        Step::Untouched(run) => sink.put_run(run),
        Step::Changed(_, record) => sink.put(&record),
        Step::Deleted(_) => Ok(()),
        Step::Added(record) => sink.put(record),
    })?;
    sink.finish(limits)
}

/// Copies the input byte for byte to the new file `output` and begins to sync it, unless that is deferred.
pub(crate) fn copy(mesh: &MeshFile, output: &Path, limits: &Limits, progress: &dyn Progress) -> Result<Written> {
    let mut sink = Sink::create(mesh, output, limits, progress)?;
    sink.put_bytes(mesh.bytes())?;
    sink.finish(limits)
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
    file: File,
    waiting: Vec<Piece<'a>>,
    waiting_bytes: usize,
    /// What is small or not the input's.
    own: Vec<u8>,
    behind: WriteBehind,
    /// How the input is read where it is not copied inside the kernel, and how far that was asked for.
    guide: Guide<'a>,
    asked: usize,
    /// Bytes so far.
    written: u64,
    progress: &'a dyn Progress,
}

impl<'a> Sink<'a> {
    fn create(mesh: &'a MeshFile, path: &'a Path, limits: &Limits, progress: &'a dyn Progress) -> Result<Self> {
        let file = create(path).map_err(Error::io(path, "creating"))?;
        let behind = WriteBehind::new(&file, limits).map_err(Error::io(path, "creating"))?;
        let guide = Guide::new(mesh.records().as_flattened(), limits);
        let (waiting, own) = (Vec::new(), Vec::new());
        Ok(Self {
            mesh,
            path,
            kernel_copies: true,
            file,
            waiting,
            waiting_bytes: 0,
            own,
            behind,
            guide,
            asked: 0,
            written: 0,
            progress,
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

    fn put_run(&mut self, run: &'a [Record]) -> Result<()> {
        let bytes = run.as_flattened();
        if bytes.len() < KERNEL_COPY_BYTES {
            self.guide.keep_ahead(&mut self.asked, bytes);
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
            self.account(part.len())?;
        }
        Ok(())
    }

    fn wait_for_more(&mut self, bytes: usize) -> Result<()> {
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
        self.file.write_all(bytes)
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
        write_all(&mut self.file, &mut pieces).map_err(|e| self.failed(e))?;
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
        self.written += written as u64;
        let total = self.mesh.records().len() as u64;
        self.progress.at("emit", (self.written / size_of::<Record>() as u64).min(total), total);
        self.behind.wrote(written as u64).map_err(Error::io(self.path, "syncing"))
    }

    fn finish(mut self, limits: &Limits) -> Result<Written> {
        self.flush()?;
        let Self { path, file, behind, .. } = self;
        let deferred = limits.defer_sync;
        let sync = move || {
            behind.finish()?;
            if deferred { Ok(()) } else { file.sync_all() }
        };
        let syncing = if limits.threads > 1 && self.mesh.bytes().len() >= SYNCED_BESIDE {
            let thread = std::thread::Builder::new().name("sync".into()).spawn(sync);
            Some(thread.map_err(Error::io(path, "syncing"))?)
        } else {
            sync().map_err(Error::io(path, "syncing"))?;
            None
        };
        Ok(Written { path: path.into(), syncing })
    }
}

fn write_all(file: &mut File, mut pieces: &mut [IoSlice<'_>]) -> io::Result<()> {
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
    syncing: Option<JoinHandle<io::Result<()>>>,
}

impl Written {
    /// Waits until the disk has all of it, unless that is deferred.
    pub(crate) fn durable(mut self) -> Result<()> {
        self.wait().map_err(Error::io(&self.path, "syncing"))
    }

    fn wait(&mut self) -> io::Result<()> {
        let thread = self.syncing.take();
        thread.map_or(Ok(()), |thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    }
}

impl Drop for Written {
    fn drop(&mut self) {
        // The file is given up because of another error.
        let _ = self.wait();
    }
}

/// A new file; or the empty one without a name that the caller holds open.
fn create(path: &Path) -> io::Result<File> {
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
