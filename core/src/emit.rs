//! Writes the output once: header, exact count, and the input as the edit leaves it.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::os::fd::AsFd;
use std::path::Path;

use crate::edit::{Edit, Step};
use crate::error::{Error, Result};
use crate::read::MeshFile;
use crate::record::Record;

/// Untouched runs of at least this many bytes are copied inside the kernel.
const KERNEL_COPY_BYTES: usize = 256 << 10;
/// Written behind so much, the pages are pushed to the disk, so that dirty pages do not pile up against the memory budget.
const WRITE_BEHIND_BYTES: u64 = 16 << 20;

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
    /// The input again, for copies inside the kernel; they may not be had on every file system.
    input: Option<File>,
    file: File,
    buffer: Vec<u8>,
    written: u64,
    pushed: u64,
}

impl<'a> Sink<'a> {
    const BUFFER_BYTES: usize = 1 << 20;

    fn create(mesh: &'a MeshFile, path: &'a Path) -> Result<Self> {
        let file = OpenOptions::new().write(true).create_new(true).open(path).map_err(Error::io(path, "creating"))?;
        Ok(Self {
            mesh,
            path,
            input: File::open(mesh.path()).ok(),
            file,
            buffer: Vec::with_capacity(Self::BUFFER_BYTES),
            written: 0,
            pushed: 0,
        })
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
        for part in bytes.chunks(WRITE_BEHIND_BYTES as usize) {
            self.copy_large(part)?;
            self.push_behind()?;
        }
        Ok(())
    }

    /// Copies inside the kernel where the bytes lie in the input file, and writes them otherwise.
    fn copy_large(&mut self, bytes: &[u8]) -> Result<()> {
        let mut rest = bytes;
        while let (Some(input), Some(offset)) = (&self.input, self.mesh.offset_of(rest)) {
            if rest.is_empty() {
                return Ok(());
            }
            let mut from = offset;
            match rustix::fs::copy_file_range(input.as_fd(), Some(&mut from), self.file.as_fd(), None, rest.len()) {
                Ok(copied) if copied > 0 => {
                    rest = &rest[copied..];
                    self.written += copied as u64;
                }
                // Not to be had between these files; nothing was copied by this call.
                _ => self.input = None,
            }
        }
        self.file.write_all(rest).map_err(Error::io(self.path, "writing"))?;
        self.written += rest.len() as u64;
        Ok(())
    }

    fn flush(&mut self) -> Result<()> {
        self.file.write_all(&self.buffer).map_err(Error::io(self.path, "writing"))?;
        self.written += self.buffer.len() as u64;
        self.buffer.clear();
        self.push_behind()
    }

    /// Starts writing back what is new, and waits for what was started the time before.
    fn push_behind(&mut self) -> Result<()> {
        if self.written - self.pushed >= 2 * WRITE_BEHIND_BYTES {
            crate::writeback::push(&self.file, self.pushed, self.written);
            self.pushed = self.written - WRITE_BEHIND_BYTES;
        }
        Ok(())
    }

    fn finish(mut self) -> Result<()> {
        self.flush()?;
        self.file.sync_all().map_err(Error::io(self.path, "syncing"))
    }
}
