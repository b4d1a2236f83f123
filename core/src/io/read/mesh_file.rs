//! An open mesh file and its records.

use super::access::Bytes;
use super::finding::Finding;
use super::limits::HEADER_BYTES;
use super::opened::Opened;
use super::parsed::{Besides, Parsed, Part};
use super::rounding::Rounding;
use super::spool::{Context, Items};
use super::vertices::Vertices;
use super::{amf, binary, obj, off, ply, sniff, tail, text, unpacked};
use crate::contract::error::Result;
use crate::contract::progress::Progress;
use crate::contract::report::Format;
use crate::contract::settings::Limits;
use crate::io::record::{self, Record};
use crate::util::parallel;
use memmap2::Mmap;
use rayon::prelude::*;
use std::fs::File;
use std::path::{Path, PathBuf};

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
    opened: Opened,
    /// As errors and reports name it.
    name: PathBuf,
    input: Bytes,
    content: Content,
}

/// What the bytes of a file hold.
#[derive(Debug)]
pub(super) struct Content {
    source: Source,
    format: Format,
    pub(super) findings: Vec<Finding>,
    header: [u8; HEADER_BYTES],
    besides: Besides,
}

impl Content {
    /// Reads `input` as a file of this kind.
    ///
    /// # Errors
    /// Those of [`MeshFile::open`], but for those of opening.
    pub(super) fn of(kind: sniff::Kind, input: &Bytes, context: &Context<'_>) -> Result<Self> {
        // Its text is passed once or twice, from the beginning to the end.
        let passing = context.passing(input.map());
        match kind {
            sniff::Kind::Binary(sniff::Layout { triangles, mut findings }) => {
                findings.extend(tail::of_records(binary::records(input, triangles)));
                let header = binary::safe_header(binary::header(input));
                Ok(Self {
                    source: Source::InPlace(triangles),
                    format: Format::BinaryStl,
                    findings,
                    header,
                    besides: Besides::default(),
                })
            }
            sniff::Kind::Text(sniff::Text { start, mut findings }) => {
                // Advice; without it reading ahead is only less bold.
                let _ = input.advise(memmap2::Advice::Sequential);
                let (content, zeros) = tail::split(input);
                let parsed = parallel::in_pool(context.limits.threads, || text::read(content, start, &passing))?;
                findings.extend(tail::of_text(content, zeros));
                Ok(Self::parsed(parsed, Format::AsciiStl, findings))
            }
            sniff::Kind::Amf => {
                let _ = input.advise(memmap2::Advice::Sequential);
                let (content, zeros) = tail::split(input);
                let parsed = parallel::in_pool(context.limits.threads, || amf::read(content, input.len(), &passing))?;
                Ok(Self::parsed(parsed, Format::Amf, tail::of_text(content, zeros).into_iter().collect()))
            }
            sniff::Kind::Obj(start) => {
                let _ = input.advise(memmap2::Advice::Sequential);
                let (content, zeros) = tail::split(input);
                let parsed = parallel::in_pool(context.limits.threads, || obj::read(content, start, &passing))?;
                Ok(Self::parsed(parsed, Format::Obj, tail::of_lines(content, zeros).into_iter().collect()))
            }
            sniff::Kind::Archive => {
                let (parsed, format) = parallel::in_pool(context.limits.threads, || unpacked::read(input, context))?;
                Ok(Self::parsed(parsed, format, Vec::new()))
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

    /// The triangles, where `input` is the file.
    #[cfg(fuzzing)]
    pub(super) fn records<'s>(&'s self, input: &'s Mmap) -> &'s [Record] {
        match &self.source {
            Source::InPlace(triangles) => binary::records(input, *triangles),
            Source::Spooled(spool) => spool.all(),
            Source::Welded(..) => &[],
        }
    }

    /// `findings`: those of the bytes themselves.
    fn parsed(parsed: Parsed, format: Format, findings: Vec<Finding>) -> Self {
        let Parsed { records, findings: mut found, header, rounding, besides } = parsed;
        found.extend(rounding.map(Rounding::finding));
        Self { source: Source::Spooled(records), format, findings: [findings, found].concat(), header, besides }
    }
}

impl MeshFile {
    /// Opens `path` and makes its records available. A text STL is parsed by the threads of `limits` into a nameless file in
    /// `spool`, which should not be a memory file system; its progress is reported in bytes as stage `read`.
    ///
    /// # Errors
    /// [`crate::Error::Unreadable`] for what is no mesh or holds no triangle, [`crate::Error::Refused`] beyond `MAX_TRIANGLES`,
    /// [`crate::Error::Changed`] if the file is truncated meanwhile, [`crate::Error::NoSpace`] where a copy finds no room,
    /// [`crate::Error::Io`] where opening, mapping or spooling fails, or with [`std::io::ErrorKind::Interrupted`] when `progress`
    /// cancels.
    pub fn open(path: &Path, spool: &Path, limits: &Limits, progress: &dyn Progress) -> Result<Self> {
        let (opened, input) = Opened::bytes(path, spool, limits, progress)?;
        let kind = sniff::sniff(&input).map_err(|rejection| rejection.at(path))?;
        let content = Content::of(kind, &input, &Context { path, spool, limits, progress, passed: None })?;
        Ok(Self { opened, name: path.to_owned(), input, content })
    }

    /// The triangles in input order, those with NaN or infinite coordinates included.
    pub fn records(&self) -> &[Record] {
        self.records_of(&self.content.source)
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
        let source = Source::Welded(Box::new(self.content.source), records);
        Self { content: Content { source, ..self.content }, ..self }
    }

    /// The triangles as they were before a weld.
    pub(crate) fn as_it_came(&self) -> &[Record] {
        match &self.content.source {
            Source::Welded(source, _) => self.records_of(source),
            source => self.records_of(source),
        }
    }

    /// The records stand in the input as they will in an output, after the prefix.
    pub(crate) fn is_in_place(&self) -> bool {
        matches!(self.content.source, Source::InPlace(_))
    }

    /// The format that the file was read as.
    pub fn format(&self) -> Format {
        self.content.format
    }

    /// The name of the unit of all coordinates, where the file says one. Nothing is scaled.
    pub fn unit(&self) -> Option<&'static str> {
        self.content.besides.unit
    }

    /// Oddities of the file; none of a flawless one.
    pub fn findings(&self) -> &[Finding] {
        &self.content.findings
    }

    /// No finding that common readers stumble over: if its mesh is good, too, the file may be passed on as it is.
    pub fn is_flawless(&self) -> bool {
        self.content.findings.iter().all(|finding| finding.harmless)
    }

    /// The 80 bytes an output begins with: the input's own, changed only where they begin with `solid`.
    pub fn output_header(&self) -> [u8; HEADER_BYTES] {
        self.content.header
    }

    /// The whole input as it stands on disk, for hashing and copying.
    pub fn bytes(&self) -> &[u8] {
        &self.input
    }

    /// Gives the pages of the input back until they are read again, where the records are elsewhere.
    pub(crate) fn let_input_go(&self) {
        if !self.is_in_place()
            && let Some(map) = self.input.map()
        {
            map.let_go();
        }
    }

    /// Gives all pages of the input and of the records back until they are read again.
    pub(crate) fn let_go(&self) {
        if let Some(map) = self.input.map() {
            map.let_go();
        }
        if let Source::Spooled(records) = &self.content.source {
            records.let_go();
        }
    }

    /// The positions that its faces name by number, where it has one table of them.
    pub(crate) fn vertices(&self) -> Option<Vertices<'_>> {
        Some(self.content.besides.positions.as_ref()?.vertices(&self.input))
    }

    /// Meshes that are never welded to each other, one behind the other, all triangles in them. Of a file of one mesh that one, if it has a name; else none.
    pub(crate) fn parts(&self) -> &[Part] {
        &self.content.besides.parts
    }

    /// A person should look at a result that is no copy, for this reason.
    pub(crate) fn doubt(&self) -> Option<&'static str> {
        self.content.besides.doubt
    }

    /// What the file builds and another format has no place for, in words.
    pub(crate) fn left_out(&self) -> &[String] {
        &self.content.besides.left_out
    }

    /// Its rows can be written anew: it has no flaw but faces of fewer than three corners, which may be left out.
    pub(crate) fn has_whole_rows(&self) -> bool {
        let flaws = self.content.findings.iter().filter(|finding| !finding.harmless).count();
        flaws == usize::from(self.content.besides.short_faces)
    }

    /// The name of the whole, or nothing.
    pub(crate) fn title(&self) -> &str {
        &self.content.besides.title
    }

    /// Triangles with colours or materials in a form that no result in another format keeps. O(n) for STL.
    pub(crate) fn coloured(&self) -> u64 {
        match self.content.format {
            // Materialise Magics' colour of all triangles that have none of their own.
            Format::BinaryStl if memchr::memmem::find(&self.content.header, b"COLOR=").is_some() => self.records().len() as u64,
            Format::BinaryStl => self.records().par_iter().filter(|record| record::attribute(record) != 0).count() as u64,
            _ => self.content.besides.coloured,
        }
    }

    /// The open file that holds the input, and the place in it where `part` of [`MeshFile::bytes`] or of the records lies, if it does: for copies that
    /// never leave the kernel.
    pub(crate) fn locate(&self, part: &[u8]) -> Option<(&File, u64)> {
        let offset = (part.as_ptr() as usize).checked_sub(self.input.as_ptr() as usize)?;
        let file = self.input.file()?;
        (offset + part.len() <= self.input.len()).then_some((file, offset as u64))
    }

    /// Size of the input in bytes.
    pub fn byte_len(&self) -> u64 {
        self.opened.size()
    }

    /// The path it was opened by, or the name that it was given for errors and reports.
    pub fn path(&self) -> &Path {
        &self.name
    }

    /// The same under another name for errors and reports: of a spool, the file that its triangles are of.
    pub(crate) fn called(self, name: &Path) -> Self {
        Self { name: name.into(), ..self }
    }

    /// Fails if the path no longer leads to the file as it was when it was opened.
    ///
    /// # Errors
    /// [`crate::Error::Changed`] if device, inode, size, mtime or ctime differ or the file is gone; [`crate::Error::Io`] if they cannot be
    /// read.
    pub fn check_unchanged(&self) -> Result<()> {
        self.opened.check_unchanged()
    }
}
