//! An open mesh file and its records.

use super::finding::{Finding, Rejection};
use super::limits::HEADER_BYTES;
use super::rounding::Rounding;
use super::spool::{Context, Items, Parsed};
use super::{access, binary, off, ply, sniff, tail, text};
use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::report::Format;
use crate::contract::settings::Limits;
use crate::io::record::Record;
use crate::util::parallel;
use memmap2::Mmap;
use std::fs::{File, Metadata, OpenOptions};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

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

/// Where the records of an open file lie.
#[derive(Debug)]
enum Source {
    /// In the input itself, this many after its prefix.
    InPlace(usize),
    /// All of a spool.
    Spooled(Items<50>),
    /// All of a spool of what these became by a weld.
    Welded(Box<Self>, Mmap),
}

/// An open mesh file.
#[derive(Debug)]
pub struct MeshFile {
    path: PathBuf,
    identity: Identity,
    /// Holds what `input` does, at the same places; `None` for a copy in memory.
    file: Option<File>,
    input: Mmap,
    source: Source,
    format: Format,
    findings: Vec<Finding>,
    header: [u8; HEADER_BYTES],
    rounding: Option<Rounding>,
}

/// What the bytes of a file hold.
struct Content {
    source: Source,
    format: Format,
    findings: Vec<Finding>,
    header: [u8; HEADER_BYTES],
    rounding: Option<Rounding>,
}

impl Content {
    fn of(kind: sniff::Kind, input: &Mmap, context: &Context<'_>) -> Result<Self> {
        match kind {
            sniff::Kind::Binary(sniff::Layout { triangles, mut findings }) => {
                findings.extend(tail::of_records(binary::records(input, triangles)));
                let header = binary::safe_header(binary::header(input));
                Ok(Self { source: Source::InPlace(triangles), format: Format::BinaryStl, findings, header, rounding: None })
            }
            sniff::Kind::Text(sniff::Text { start, mut findings }) => {
                // Advice; without it reading ahead is only less bold.
                let _ = input.advise(memmap2::Advice::Sequential);
                let (content, zeros) = tail::split(input);
                let parsed = parallel::in_pool(context.limits.threads, || text::read(content, start, context))?;
                findings.extend(tail::of_text(content, zeros));
                Ok(Self::parsed(parsed, Format::AsciiStl, findings))
            }
            sniff::Kind::Off => {
                let parsed = parallel::in_pool(context.limits.threads, || off::read(input, context))?;
                Ok(Self::parsed(parsed, Format::Off, Vec::new()))
            }
            sniff::Kind::Ply => {
                let parsed = parallel::in_pool(context.limits.threads, || ply::read(input, context))?;
                Ok(Self::parsed(parsed, Format::Ply, Vec::new()))
            }
        }
    }

    /// `findings`: those of the bytes themselves.
    fn parsed(parsed: Parsed, format: Format, findings: Vec<Finding>) -> Self {
        let Parsed { records, findings: mut found, header, rounding } = parsed;
        found.extend(rounding.map(Rounding::finding));
        Self { source: Source::Spooled(records), format, findings: [findings, found].concat(), header, rounding }
    }
}

impl MeshFile {
    /// Opens `path` and makes its records available. A text STL is parsed by the threads of `limits` into a nameless file in
    /// `spool`, which should not be a memory file system; its progress is reported in bytes as stage `read`.
    ///
    /// # Errors
    /// [`Error::Unreadable`] for what is no mesh or holds no triangle, [`Error::Refused`] beyond `MAX_TRIANGLES`,
    /// [`Error::Changed`] if the file is truncated meanwhile, [`Error::NoSpace`] where a copy finds no room,
    /// [`Error::Io`] where opening, mapping or spooling fails, or with [`std::io::ErrorKind::Interrupted`] when `progress`
    /// cancels.
    pub fn open(path: &Path, spool: &Path, limits: &Limits, progress: &dyn Progress) -> Result<Self> {
        let (file, identity) = open_regular(path)?;
        if identity.size == 0 {
            return Err(Rejection::Unreadable("empty file".into()).at(path));
        }
        // As long as the identity says, whatever happened in between.
        let length = usize::try_from(identity.size).map_err(|_| Rejection::TooMany.at(path))?;
        let (input, file) = access::Foreign { path, file, length, spool, limits, progress }.bytes()?;
        let kind = sniff::sniff(&input).map_err(|rejection| rejection.at(path))?;
        let content = Content::of(kind, &input, &Context { path, spool, limits, progress })?;
        let Content { source, format, findings, header, rounding } = content;
        Ok(Self { path: path.to_owned(), identity, file, input, source, format, findings, header, rounding })
    }

    /// The triangles in input order, those with NaN or infinite coordinates included.
    pub fn records(&self) -> &[Record] {
        self.records_of(&self.source)
    }

    fn records_of<'s>(&'s self, source: &'s Source) -> &'s [Record] {
        match source {
            Source::InPlace(triangles) => binary::records(&self.input, *triangles),
            Source::Spooled(spool) => spool.all(),
            Source::Welded(_, spool) => spool.as_chunks().0,
        }
    }

    /// The same file with other corners of its triangles.
    pub(crate) fn welded(self, records: Mmap) -> Self {
        Self { source: Source::Welded(Box::new(self.source), records), ..self }
    }

    /// The triangles as they were before a weld.
    pub(crate) fn as_it_came(&self) -> &[Record] {
        match &self.source {
            Source::Welded(source, _) => self.records_of(source),
            source => self.records_of(source),
        }
    }

    /// The records stand in the input as they will in an output, after the prefix.
    pub(crate) fn is_in_place(&self) -> bool {
        matches!(self.source, Source::InPlace(_))
    }

    /// The format that the file was read as.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Oddities of the file; none of a flawless one.
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// No finding that common readers stumble over: if its mesh is good, too, the file may be passed on as it is.
    pub fn is_flawless(&self) -> bool {
        self.findings.iter().all(|finding| finding.harmless)
    }

    /// The 80 bytes an output begins with: the input's own, changed only where they begin with `solid`.
    pub fn output_header(&self) -> [u8; HEADER_BYTES] {
        self.header
    }

    /// The whole input as it stands on disk, for hashing and copying.
    pub fn bytes(&self) -> &[u8] {
        &self.input
    }

    /// The open file that holds the input, and the place in it where `part` of [`MeshFile::bytes`] or of the records lies, if it does: for copies that
    /// never leave the kernel.
    pub(crate) fn locate(&self, part: &[u8]) -> Option<(&File, u64)> {
        let offset = (part.as_ptr() as usize).checked_sub(self.input.as_ptr() as usize)?;
        let file = self.file.as_ref()?;
        (offset + part.len() <= self.input.len()).then_some((file, offset as u64))
    }

    /// Size of the input in bytes.
    pub fn byte_len(&self) -> u64 {
        self.identity.size
    }

    /// The path it was opened by.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Fails if the path no longer leads to the file as it was when it was opened.
    ///
    /// # Errors
    /// [`Error::Changed`] if device, inode, size, mtime or ctime differ or the file is gone; [`Error::Io`] if they cannot be
    /// read.
    pub fn check_unchanged(&self) -> Result<()> {
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
