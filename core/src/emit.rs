//! Writes the output once: header, exact count, and the input as the edit leaves it.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::os::fd::AsFd;
use std::path::Path;
use std::thread::JoinHandle;

use crossbeam::channel::{Sender, bounded};

use crate::edit::{Edit, Step};
use crate::error::{Error, Result};
use crate::read::MeshFile;
use crate::record::Record;

/// Untouched runs of at least this many bytes are copied inside the kernel.
const KERNEL_COPY_BYTES: usize = 256 << 10;
/// Written behind so much, the pages are pushed to the disk, so that dirty pages do not pile up against the memory budget.
const WRITE_BEHIND_BYTES: usize = 32 << 20;

/// Writes `mesh` with `edit` to the new file `output` and syncs it.
pub(crate) fn write(mesh: &MeshFile, edit: &Edit, output: &Path) -> Result<()> {
    let records = mesh.records();
    let count = edit.output_records(records.len());
    let count = u32::try_from(count).map_err(|_| Error::Refused {
        path: mesh.path().into(),
        reason: format!("the result has {count} triangles"),
        advice: "an STL can hold 4294967295: split the file".into(),
    })?;
    let mut sink = Sink::create(mesh, output)?;
    sink.put(&mesh.output_header())?;
    sink.put(&count.to_le_bytes())?;
    edit.walk(records, |step| match step {
        Step::Untouched(run) => sink.put_run(run),
        Step::Changed(record) => sink.put(record),
    })?;
    sink.finish()
}

/// Copies the input byte for byte to the new file `output` and syncs it.
pub(crate) fn copy(mesh: &MeshFile, output: &Path) -> Result<()> {
    let mut sink = Sink::create(mesh, output)?;
    sink.put_bytes(mesh.bytes())?;
    sink.finish()
}

/// The output file with a buffer for what is small.
struct Sink<'a> {
    mesh: &'a MeshFile,
    path: &'a Path,
    /// Copies inside the kernel are not to be had between all file systems.
    kernel_copies: bool,
    file: File,
    buffer: Vec<u8>,
    /// Bytes written since the disk was last asked to take them.
    unsynced: usize,
    syncer: Option<Syncer>,
}

impl<'a> Sink<'a> {
    const BUFFER_BYTES: usize = 1 << 20;

    fn create(mesh: &'a MeshFile, path: &'a Path) -> Result<Self> {
        let file = OpenOptions::new().write(true).create_new(true).open(path).map_err(Error::io(path, "creating"))?;
        let buffer = Vec::with_capacity(Self::BUFFER_BYTES);
        Ok(Self { mesh, path, kernel_copies: true, file, buffer, unsynced: 0, syncer: None })
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        if self.buffer.len() + bytes.len() > Self::BUFFER_BYTES {
            self.flush()?;
        }
        self.buffer.extend_from_slice(bytes);
        Ok(())
    }

    fn put_run(&mut self, run: &[Record]) -> Result<()> {
        self.put_bytes(run.as_flattened())
    }

    fn put_bytes(&mut self, bytes: &[u8]) -> Result<()> {
        if bytes.len() < KERNEL_COPY_BYTES {
            return self.put(bytes);
        }
        self.flush()?;
        for part in bytes.chunks(WRITE_BEHIND_BYTES) {
            self.copy_large(part).map_err(Error::io(self.path, "writing"))?;
            self.account(part.len())?;
        }
        Ok(())
    }

    /// Copies inside the kernel where the bytes lie in the input file, and writes them otherwise.
    fn copy_large(&mut self, mut bytes: &[u8]) -> std::io::Result<()> {
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

    fn flush(&mut self) -> Result<()> {
        self.file.write_all(&self.buffer).map_err(Error::io(self.path, "writing"))?;
        let written = self.buffer.len();
        self.buffer.clear();
        self.account(written)
    }

    /// Asks the disk to take what was written, every so often.
    fn account(&mut self, written: usize) -> Result<()> {
        self.unsynced += written;
        if self.unsynced >= WRITE_BEHIND_BYTES {
            self.unsynced = 0;
            if self.syncer.is_none() {
                self.syncer = Some(Syncer::start(&self.file).map_err(Error::io(self.path, "syncing"))?);
            }
            if let Some(syncer) = &self.syncer {
                syncer.request();
            }
        }
        Ok(())
    }

    fn finish(mut self) -> Result<()> {
        self.flush()?;
        if let Some(syncer) = self.syncer.take() {
            syncer.finish().map_err(Error::io(self.path, "syncing"))?;
        }
        self.file.sync_all().map_err(Error::io(self.path, "syncing"))
    }
}

/// Pushes written pages to the disk while more are being written. At most one request waits, so that no more than about three
/// requests' worth of pages is dirty at any time.
struct Syncer {
    requests: Sender<()>,
    thread: JoinHandle<std::io::Result<()>>,
}

impl Syncer {
    fn start(file: &File) -> std::io::Result<Self> {
        let file = file.try_clone()?;
        let (requests, todo) = bounded(1);
        let thread = std::thread::Builder::new()
            .name("write-behind".into())
            .spawn(move || todo.iter().try_for_each(|()| file.sync_data()))?;
        Ok(Self { requests, thread })
    }

    /// Waits while another request is waiting.
    fn request(&self) {
        // The thread ends early only on an error, which `finish` returns.
        let _ = self.requests.send(());
    }

    fn finish(self) -> std::io::Result<()> {
        drop(self.requests);
        self.thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}
