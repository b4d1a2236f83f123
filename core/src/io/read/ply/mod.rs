//! PLY: a header that names elements and their properties, and the elements, as text or in binary.
//!
//! **In:** the bytes of a file that begins with `ply`.
//! **Out:** its faces and strips as records, in the file's order.
//! **Promise:** any elements in any order; what is no vertex and no face is passed over. Where the file ends too early, what is there is read.
//!
//! G. Turk, "The PLY Polygon File Format", Stanford 1994; strips as VTK and Stanford write them.

mod body;
pub(in crate::io) mod header;
pub(in crate::io) mod roles;
#[cfg(test)]
mod tests;

use self::body::Body;
use self::header::Form;
use self::roles::{Part, Role};
use super::elements::{points, polygons};
use super::finding::{Finding, Rejection};
use super::parsed::{Besides, Parsed};
use super::spool::Context;
use super::vertices::{Positions, Vertices};
use super::{binary, tail};
use crate::contract::error::Result;
use crate::util::words::Count;

/// Reads a PLY. Call it within a pool of threads.
///
/// # Errors
/// [`crate::contract::error::Error::Unreadable`] for a point cloud, a damaged header, or damage that leaves no mesh to rely on; those of the spools.
pub(super) fn read(bytes: &[u8], context: &Context<'_>) -> Result<Parsed> {
    let reject = |rejection: Rejection| rejection.at(context.path);
    let header = header::read(bytes).map_err(reject)?;
    let parts = roles::of(&header).map_err(reject)?;
    let (content, zeros) = if header.form == Form::Text { tail::split(bytes) } else { (bytes, tail::split(bytes).1) };
    let body = Body { form: header.form, bytes: content };
    let mut reading = Reading { context, body, at: header.end, cut: false, bent: 0, findings: header.findings };
    let mut parts = parts.as_slice();
    let mut faces_before = Vec::new();
    while let Some((part, rest)) = parts.split_first().filter(|(part, _)| part.role != Role::Vertices) {
        faces_before.push((part, reading.at));
        reading.pass(part)?;
        parts = rest;
    }
    let Some((vertices, behind)) = parts.split_first() else { return Err(reject(binary::no_triangles())) };
    let gathered = reading.vertices(vertices)?;
    let positions = gathered.positions.vertices(bytes);
    let mut faces = polygons::Gathered::new(context, reading.expected(&faces_before, behind))?;
    for (part, from) in faces_before {
        reading.faces_at(from, part, positions, &mut faces)?;
    }
    for part in behind {
        reading.faces(part, positions, &mut faces)?;
    }
    reading.finish(gathered, faces, zeros)
}

/// The vertices of a file.
struct Gathered {
    positions: Positions,
    findings: Vec<Finding>,
    rounding: Option<super::rounding::Rounding>,
}

/// A reading, and where it stands.
struct Reading<'a, 'c> {
    context: &'c Context<'c>,
    body: Body<'a>,
    at: usize,
    /// An element was cut off: nothing follows.
    cut: bool,
    /// Elements on lines with other numbers than theirs.
    bent: u64,
    findings: Vec<Finding>,
}

impl<'a> Reading<'a, '_> {
    fn pass(&mut self, part: &Part) -> Result<()> {
        let read = self.body.pass(self.context, self.at, part)?;
        self.at = read.end;
        if read.rows < part.count {
            self.cut(part, read.rows);
        }
        Ok(())
    }

    /// Notes that an element is cut off, after so many rows.
    fn cut(&mut self, part: &Part, rows: u64) {
        let name = match part.role {
            Role::Vertices => "vertices",
            Role::Faces => "faces",
            Role::Strips => "strips",
            Role::None => "other elements",
        };
        let before = std::mem::replace(&mut self.cut, true);
        let (announced, there) = (Count(part.count), Count(rows));
        let text = format!("cut off: the header announces {announced} {name}, the file holds {there}");
        // Said once, and of the faces at any rate.
        match part.role {
            Role::None if before => {}
            // Of two elements of one role and one count.
            _ if self.findings.iter().any(|finding| finding.text == text) => {}
            Role::None => self.findings.push(Finding { harmless: true, ..Finding::flaw(text) }),
            _ => self.findings.push(Finding::loss(text)),
        }
    }

    fn vertices(&mut self, part: &Part) -> Result<Gathered> {
        if let Some((positions, read)) = self.body.vertices_in_place(self.at, part) {
            self.at = read.end;
            if read.rows < part.count {
                self.cut(part, read.rows);
            }
            return Ok(Gathered { positions, findings: Vec::new(), rounding: None });
        }
        let mut gathered = points::Gathered::new(self.context, self.body.most_rows(self.at, part))?;
        let read = self.body.points(self.context, self.at, part, &mut gathered)?;
        (self.at, self.bent) = (read.end, self.bent + read.bent);
        if read.rows < part.count {
            self.cut(part, read.rows);
        }
        self.lines_fit(read)?;
        gathered.judge().map_err(|rejection| rejection.at(self.context.path))?;
        let (findings, rounding) = (gathered.findings(), gathered.rounding());
        Ok(Gathered { positions: Positions::Spooled(gathered.map()?), findings, rounding })
    }

    /// Refuses an element most of whose lines have other numbers than theirs.
    fn lines_fit(&self, read: body::Read) -> Result<()> {
        if read.bent > read.rows / 2 {
            let reason = format!("a PLY model; {} of {} lines do not fit its header", Count(read.bent), Count(read.rows));
            return Err(Rejection::Unreadable(reason).at(self.context.path));
        }
        Ok(())
    }

    /// Faces that there may be, at most.
    fn expected(&self, before: &[(&Part, usize)], behind: &[Part]) -> u64 {
        let faces = |part: &Part, from| if part.role == Role::Faces { self.body.most_rows(from, part) } else { 0 };
        let before = before.iter().map(|(part, from)| faces(part, *from));
        before.chain(behind.iter().map(|part| faces(part, self.at))).fold(0, u64::saturating_add)
    }

    /// Reads an element behind the vertices, or passes over it.
    fn faces<'v>(&mut self, part: &Part, vertices: Vertices<'v>, faces: &mut polygons::Gathered<'_>) -> Result<()> {
        if part.role == Role::None {
            return self.pass(part);
        }
        let read = self.faces_at(self.at, part, vertices, faces)?;
        self.at = read.end;
        if read.rows < part.count {
            self.cut(part, read.rows);
        }
        Ok(())
    }

    /// Reads the element there, if it has faces.
    fn faces_at<'v>(
        &mut self,
        from: usize,
        part: &Part,
        vertices: Vertices<'v>,
        faces: &mut polygons::Gathered<'_>,
    ) -> Result<body::Read> {
        let read = match part.role {
            Role::Faces => self.body.polygons(self.context, from, part, vertices, faces)?,
            Role::Strips => self.body.strips(from, part, vertices, faces)?,
            _ => return Ok(body::Read { rows: part.count, bent: 0, end: from }),
        };
        self.bent += read.bent;
        self.lines_fit(read)?;
        // Where a copy stopped and zeros follow, they read as faces without corners.
        if self.body.form != Form::Text {
            let end = tail::split(self.body.bytes.get(from..read.end).unwrap_or_default());
            self.findings.extend(tail::of_rows(end.1, part.layout.least_bytes()));
        }
        Ok(read)
    }

    fn finish(mut self, vertices: Gathered, faces: polygons::Gathered<'_>, zeros: usize) -> Result<Parsed> {
        let reject = |rejection: Rejection| rejection.at(self.context.path);
        let tally = *faces.tally();
        if faces.triangles() == 0 && self.cut {
            return Err(reject(Rejection::Unreadable("a PLY model that is cut off before its first face".into())));
        }
        tally.judge().map_err(reject)?;
        if faces.triangles() == 0 {
            return Err(reject(binary::no_triangles()));
        }
        let Gathered { positions, findings, rounding } = vertices;
        self.findings.extend(findings);
        if self.bent > 0 {
            let text = format!("{} lines with more or fewer numbers than the header announces", Count(self.bent));
            self.findings.push(Finding::loss(text));
        }
        self.findings.extend(tally.findings());
        if self.body.form == Form::Text {
            self.findings.extend(tail::behind_text(!self.cut, zeros));
        }
        if let Some(text) = self.body.behind(self.at).filter(|_| !self.cut) {
            self.findings.push(Finding { harmless: true, ..Finding::flaw(text) });
        }
        let header = binary::header_of(b"");
        let records = faces.map()?;
        Ok(Parsed {
            records,
            findings: self.findings,
            header,
            rounding,
            besides: Besides { positions: Some(positions), short_faces: tally.has_short(), ..Besides::default() },
        })
    }
}
