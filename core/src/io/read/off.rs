//! OFF: counts, vertices and faces, as text or in binary.
//!
//! **In:** the bytes of a file that begins with the keyword, or with three counts.
//! **Out:** its faces as records.
//! **Promise:** colours, normals and coordinates of textures are passed over. Where the file ends too early, what is there is read.
//!
//! Geomview's manual, section "OFF Files". By it, line ends mean nothing before the colour of a face, which ends with its line.

use super::elements::layout::{Layout, Scalar, Step};
use super::elements::lines::Line;
use super::elements::packed;
use super::elements::text::{Behind, Read, Section};
use super::elements::{points, polygons};
use super::finding::{Finding, Rejection};
use super::parsed::{Besides, Parsed};
use super::spool::Context;
use super::vertices::{Positions, Vertices};
use super::{binary, tail};
use crate::contract::error::Result;
use crate::util::words::{Count, Counted};

/// Reads an OFF. Call it within a pool of threads.
///
/// # Errors
/// [`crate::contract::error::Error::Unreadable`] for a point cloud, other than three dimensions, a damaged header, or damage that leaves no mesh to
/// rely on; those of the spools.
pub(super) fn read(bytes: &[u8], context: &Context<'_>) -> Result<Parsed> {
    let reject = |rejection: Rejection| rejection.at(context.path);
    let (text, zeros) = tail::split(bytes);
    let header = Header::read(bytes).map_err(reject)?;
    let content = if header.binary { bytes } else { text };
    let file = File { bytes: content, header: &header };
    let mut findings = header.findings.clone();

    let mut positions = points::Gathered::new(context, file.most(header.vertices))?;
    let vertices = file.vertices(context, &mut positions)?;
    let gathered = (positions.findings(), positions.rounding());
    positions.judge().map_err(reject)?;
    let positions = positions.map()?;
    let mut faces = polygons::Gathered::new(context, file.most(header.faces))?;
    let read = file.faces(context, vertices.end, Vertices::spooled(positions.all()), &mut faces)?;

    file.judge((vertices, read), &faces).map_err(reject)?;
    findings.extend(gathered.0);
    findings.extend(file.findings(vertices, read));
    findings.extend(faces.tally().findings());
    let whole = read.rows == header.faces;
    findings.extend(if header.binary {
        tail::of_rows(tail::split(content.get(vertices.end..read.end).unwrap_or_default()).1, file.face().least_bytes())
    } else {
        tail::behind_text(whole, zeros)
    });
    let short_faces = faces.tally().has_short();
    let (records, positions) = (faces.map()?, Some(Positions::Spooled(positions)));
    Ok(Parsed {
        records,
        findings,
        header: binary::header_of(b""),
        rounding: gathered.1,
        besides: Besides { positions, short_faces, ..Besides::default() },
    })
}

/// Whether `bytes` begin with a keyword of OFF, after blanks and comments.
pub(super) fn begins(bytes: &[u8]) -> bool {
    let head = bytes.get(..4096).unwrap_or(bytes);
    let mut line = Line { text: unmarked(head), at: 0, within: false, comments: true };
    line.token().is_some_and(|rest| Keyword::of(rest).is_some())
}

/// Whether `bytes` begin as an OFF whose keyword was left out: a line of three counts, and one of three coordinates.
pub(super) fn begins_with_counts(bytes: &[u8]) -> bool {
    let head = bytes.get(..4096).unwrap_or(bytes);
    let mut line = Line { text: unmarked(head), at: 0, within: false, comments: true };
    if !super::foreign::is_text(head) || line.token().is_none() {
        return false;
    }
    line.within = true;
    let counts = [(); 3].map(|()| line.whole());
    let alone = line.token().is_none();
    line.within = false;
    let _ = line.token();
    line.within = true;
    let coordinates = [(); 3].map(|()| {
        let number = line.token().and_then(super::number::number);
        line.at += number.map_or(0, |number| number.length);
        number.is_some()
    });
    matches!(counts, [Some(3..), Some(1..), Some(0..)]) && alone && coordinates == [true; 3]
}

/// Behind a byte order mark.
fn unmarked(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// The keyword: the properties that are announced by letters before `OFF`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Keyword {
    /// Numbers of a vertex besides its coordinates.
    extra: usize,
    /// A fourth coordinate, or any number of them.
    dimensions: bool,
    length: usize,
}

impl Keyword {
    fn of(text: &[u8]) -> Option<Self> {
        let (mut keyword, mut rest) = (Self::default(), text);
        for (letters, numbers, dimensions) in
            [(b"ST".as_slice(), 2, false), (b"C", 4, false), (b"N", 3, false), (b"4", 0, true), (b"n", 0, true)]
        {
            if let Some(behind) = rest.strip_prefix(letters) {
                rest = behind;
                keyword.extra += numbers;
                keyword.dimensions |= dimensions;
            }
        }
        rest = rest.strip_prefix(b"OFF")?;
        keyword.length = text.len() - rest.len();
        rest.first().is_none_or(|byte| byte.is_ascii_whitespace() || byte.is_ascii_digit() || *byte == b'#').then_some(keyword)
    }
}

/// What stands before the vertices.
#[derive(Debug)]
struct Header {
    /// Numbers of a vertex besides its coordinates.
    extra: usize,
    binary: bool,
    vertices: u64,
    faces: u64,
    /// Where the vertices begin.
    end: usize,
    findings: Vec<Finding>,
}

impl Header {
    fn read(bytes: &[u8]) -> std::result::Result<Self, Rejection> {
        let refuse = |reason: &str| Err(Rejection::Unreadable(format!("an OFF model {reason}")));
        let at = bytes.len() - unmarked(bytes).len();
        let mut line = Line { text: bytes, at, within: false, comments: true };
        let mut findings = Vec::new();
        let keyword = line.token().and_then(Keyword::of);
        let apart = |line: &Line<'_>| bytes.get(line.at).is_none_or(|byte| !byte.is_ascii_digit());
        line.at += keyword.map_or(0, |keyword| keyword.length);
        match keyword {
            None => findings.push(Finding::flaw("does not begin with \"OFF\"")),
            Some(keyword) if keyword.dimensions => return refuse("of other than three dimensions"),
            Some(_) if !apart(&line) => findings.push(Finding::flaw("no blank between \"OFF\" and the first count")),
            Some(_) => {}
        }
        line.within = true;
        let binary = line.token().is_some_and(|rest| rest.starts_with(b"BINARY"));
        line.within = false;
        let extra = keyword.unwrap_or_default().extra;
        let (counts, end) = if binary {
            line.skip_line();
            // LF, CR LF or CR: the counts behind it are below 2^24 or so, and begin with a zero.
            let behind = bytes.get(line.at..).unwrap_or_default();
            let end = line.at + behind.iter().take(2).take_while(|byte| matches!(byte, b'\r' | b'\n')).count();
            (big_endian_counts(bytes, end), end + 12)
        } else {
            (counts(&mut line), line.at)
        };
        match counts {
            Some([0, _]) => refuse("without vertices"),
            Some([vertices, 0]) => {
                Err(Rejection::Unreadable(format!("a point cloud of {}, no faces", Counted(vertices, "point", "points"))))
            }
            Some([vertices, faces]) => Ok(Self { extra, binary, vertices, faces, end, findings }),
            None => refuse("without counts of vertices and faces"),
        }
    }
}

/// Counts of vertices and faces. That of edges is passed over: on their line, or behind them if they share none.
fn counts(line: &mut Line<'_>) -> Option<[u64; 2]> {
    let vertices = line.whole()?;
    line.within = true;
    let share = line.token().is_some();
    line.within = false;
    let faces = line.whole()?;
    line.within = share;
    if line.token().is_some() {
        line.whole()?;
    }
    Some([u64::try_from(vertices).ok()?, u64::try_from(faces).ok()?])
}

fn big_endian_counts(bytes: &[u8], from: usize) -> Option<[u64; 2]> {
    let (words, _) = bytes.get(from..from + 12)?.as_chunks::<4>();
    let [vertices, faces, _] = words else { return None };
    let count = |word: &[u8; 4]| u64::try_from(i32::from_be_bytes(*word)).ok();
    Some([count(vertices)?, count(faces)?])
}

/// A file and its header.
#[derive(Clone, Copy)]
struct File<'a> {
    bytes: &'a [u8],
    header: &'a Header,
}

impl<'a> File<'a> {
    fn vertex(self, extra: usize) -> Layout {
        let mut layout = Layout::default();
        (0..3).for_each(|axis| layout.push(Step::Coordinate(axis, Scalar::F32)));
        if extra > 0 {
            layout.push(Step::Skip { values: extra, bytes: extra * Scalar::F32.bytes() });
        }
        layout
    }

    /// In binary, the parts of a colour follow.
    fn face(self) -> Layout {
        let mut layout = Layout::default();
        layout.push(Step::List { length: Scalar::I32, item: Scalar::I32, indices: true });
        if self.header.binary {
            layout.push(Step::List { length: Scalar::I32, item: Scalar::F32, indices: false });
        }
        layout
    }

    /// So many rows there may be, at most.
    fn most(self, announced: u64) -> u64 {
        let least = if self.header.binary { 8 } else { 4 };
        announced.min((self.bytes.len() / least) as u64)
    }

    fn section(self, from: usize, rows: u64, behind: Behind) -> Section<'a> {
        Section { text: self.bytes, from, rows, comments: true, behind }
    }

    fn vertices(self, context: &Context<'_>, positions: &mut points::Gathered<'_>) -> Result<Read> {
        let (rows, from) = (self.header.vertices, self.header.end);
        let whole = self.vertex(self.header.extra);
        if self.header.binary {
            let section = packed::Section::<true> { bytes: self.bytes, from, rows, layout: &whole };
            return section.read(context, &points::Points(&whole), positions).map(Read::from);
        }
        // Writers do not agree on how many numbers a colour has.
        let bare = self.vertex(0);
        let tokens = (&points::Points(&whole), &whole);
        self.section(from, rows, Behind::IfLines).read(context, &points::Points(&bare), tokens, positions)
    }

    fn faces(self, context: &Context<'_>, from: usize, of: Vertices<'_>, faces: &mut polygons::Gathered<'_>) -> Result<Read> {
        let (rows, layout) = (self.header.faces, self.face());
        let sink = polygons::Polygons { layout: &layout, vertices: of };
        if self.header.binary {
            let section = packed::Section::<true> { bytes: self.bytes, from, rows, layout: &layout };
            return section.read(context, &sink, faces).map(Read::from);
        }
        self.section(from, rows, Behind::Always).read(context, &sink, (&sink, &layout), faces)
    }

    fn judge(self, (vertices, read): (Read, Read), faces: &polygons::Gathered<'_>) -> std::result::Result<(), Rejection> {
        if vertices.rows < self.header.vertices || read.rows == 0 {
            return Err(Rejection::Unreadable("an OFF model that is cut off before its first face".into()));
        }
        for section in [vertices, read] {
            if section.bent > section.rows / 2 {
                let (bent, rows) = (Count(section.bent), Count(section.rows));
                return Err(Rejection::Unreadable(format!("an OFF model; {bent} of {rows} lines have too few numbers")));
            }
        }
        faces.tally().judge()?;
        if faces.triangles() == 0 { Err(binary::no_triangles()) } else { Ok(()) }
    }

    fn findings(self, vertices: Read, read: Read) -> Vec<Finding> {
        let mut found = Vec::new();
        if read.rows < self.header.faces {
            let (announced, there) = (Count(self.header.faces), Count(read.rows));
            found.push(Finding::loss(format!("cut off: the header announces {announced} faces, the file holds {there}")));
        }
        if vertices.bent + read.bent > 0 {
            found.push(Finding::loss(format!("{} with too few numbers", Counted(vertices.bent + read.bent, "line", "lines"))));
        }
        let mut line = Line { text: self.bytes, at: read.end, within: false, comments: true };
        let behind = self.bytes.get(read.end..).unwrap_or_default();
        let behind = if self.header.binary { behind } else { line.token().unwrap_or_default() };
        let bytes = behind.len() as u64;
        if read.rows == self.header.faces && bytes > 0 {
            let text = format!("{} after the last face, ignored", Counted(bytes, "byte", "bytes"));
            found.push(Finding { harmless: true, ..Finding::flaw(text) });
        }
        found
    }
}

#[cfg(test)]
mod tests;
