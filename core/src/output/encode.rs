//! Records as a file of an indexed format.
//!
//! **In:** an [`Indexed`] mesh.
//! **Out:** binary PLY, text in OFF, OBJ or AMF, or a 3MF package; coordinates as the shortest decimal that reads back as the same `f32`.
//! **Promise:** vertices and faces in the order of their numbers, the same bytes for any memory and any threads.
//!
//! Forms: PLY 1.0 (G. Turk, "The PLY Polygon File Format", 1994), OFF (Geomview's manual, section "OFF Files"), OBJ (Wavefront, "Object Files",
//! Advanced Visualizer manual, appendix B1), AMF (ISO/ASTM 52915:2020), 3MF ([`super::package`]).

use std::io::Write;
use std::ops::Range;
use std::path::Path;

use rayon::prelude::*;

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::io::record::Point;
use crate::io::write_behind::WriteBehind;
use crate::output::archive::Sink;
use crate::output::indexed::Indexed;
use crate::output::{emit, package};
use crate::util::parallel;

/// Records whose text one thread makes at a time.
const PIECE: usize = 16 << 10;
/// Most bytes of a vertex of a 3MF: 26, and three numbers of up to 16 (`-1.17549435e-38`).
const MOST_A_VERTEX: u64 = 26 + 3 * 16;
/// Most bytes of a triangle of a 3MF: 30, and three numbers of up to 10.
const MOST_A_TRIANGLE: u64 = 30 + 3 * 10;
/// Most bytes of a 3MF's text before, between and behind them.
const MOST_AROUND: u64 = 4 << 10;

/// A format that vertices and faces are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Layout {
    /// Binary PLY, little-endian.
    Ply,
    /// Text.
    Off,
    /// Text.
    Obj,
    /// XML; coordinates are in units of this name.
    Amf(&'static str),
    /// XML in a package; coordinates are in units of this name.
    ThreeMf(&'static str),
}

/// A mesh of a file.
pub(crate) struct Body<'r> {
    /// Empty for the only one.
    pub(crate) name: &'r str,
    pub(crate) mesh: Indexed<'r>,
    /// So many triangles.
    pub(crate) records: usize,
}

/// What a file says of itself, where its format has a place for it.
#[derive(Clone, Copy)]
pub(crate) struct Heading<'a> {
    pub(crate) maker: &'a str,
    /// The name of the whole, or nothing.
    pub(crate) title: &'a str,
}

/// Text before and behind all meshes, and between and behind the vertices and faces of each.
struct Frame {
    head: String,
    between: &'static str,
    behind: &'static str,
    tail: String,
}

impl Layout {
    /// A file may hold several meshes.
    pub(crate) fn holds_several(self) -> bool {
        matches!(self, Self::Amf(_) | Self::ThreeMf(_))
    }

    /// Around these meshes.
    fn frame(self, bodies: &[Body<'_>], Heading { maker, title }: Heading<'_>) -> Frame {
        let vertices: u64 = bodies.iter().map(|body| u64::from(body.mesh.vertices())).sum();
        let faces: usize = bodies.iter().map(|body| body.records).sum();
        let plain = |head: String| Frame { head, between: "", behind: "", tail: String::new() };
        match self {
            Self::Ply => {
                // Most readers take indices as signed.
                let index = if i32::try_from(vertices).is_ok() { "int" } else { "uint" };
                plain(format!(
                    "ply\nformat binary_little_endian 1.0\ncomment {maker}\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
                     property float z\nelement face {faces}\nproperty list uchar {index} vertex_indices\nend_header\n"
                ))
            }
            // Readers refuse a comment before the counts, MeshLib's among them.
            Self::Off => plain(format!("OFF\n{vertices} {faces} 0\n")),
            Self::Obj => plain(format!("# {maker}\n# {vertices} vertices, {faces} faces\n")),
            Self::Amf(unit) => {
                let title = escaped(title);
                let title = if title.is_empty() { title } else { format!("<metadata type=\"name\">{title}</metadata>\n") };
                let head = format!(
                    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- {maker} -->\n<amf unit=\"{unit}\" version=\"1.2\">\n{title}"
                );
                let behind = "</volume>\n</mesh>\n</object>\n";
                Frame { head, between: "</vertices>\n<volume>\n", behind, tail: "</amf>\n".into() }
            }
            Self::ThreeMf(unit) => Frame {
                head: package::head(unit, &escaped(maker), &escaped(title)),
                between: package::BETWEEN,
                behind: package::OBJECT_END,
                tail: package::tail(bodies.len()),
            },
        }
    }

    /// Before the vertices of the mesh of this number and name.
    fn object(self, number: usize, name: &str) -> String {
        match self {
            Self::Ply | Self::Off | Self::Obj => String::new(),
            Self::Amf(_) => {
                let name = escaped(name);
                let name = if name.is_empty() { name } else { format!("<metadata type=\"name\">{name}</metadata>\n") };
                format!("<object id=\"{number}\">\n{name}<mesh>\n<vertices>\n")
            }
            Self::ThreeMf(_) => package::object(number, &escaped(name)),
        }
    }

    /// Bytes of a file for each triangle of a closed mesh, about.
    pub(crate) fn bytes_a_triangle(self) -> u64 {
        match self {
            Self::Ply => 20,
            Self::Off | Self::Obj => 50,
            Self::Amf(_) => 120,
            Self::ThreeMf(_) => 20,
        }
    }

    /// Bytes for each triangle of a closed mesh, about, that reading such a file unpacks.
    pub(crate) fn unpacked_bytes_a_triangle(self) -> Option<u64> {
        matches!(self, Self::ThreeMf(_)).then_some(80)
    }

    fn vertex(self, point: Point, out: &mut Vec<u8>) {
        let [x, y, z] = point;
        let (a, b, c, end) = match self {
            Self::Ply => return out.extend(point.iter().flat_map(|value| value.to_le_bytes())),
            Self::Off => ("", " ", " ", "\n"),
            Self::Obj => ("v ", " ", " ", "\n"),
            Self::Amf(_) => ("<vertex><coordinates><x>", "</x><y>", "</y><z>", "</z></coordinates></vertex>\n"),
            Self::ThreeMf(_) => ("<vertex x=\"", "\" y=\"", "\" z=\"", "\"/>\n"),
        };
        for (before, value) in [(a, x), (b, y), (c, z)] {
            out.extend_from_slice(before.as_bytes());
            decimal(value, out);
        }
        out.extend_from_slice(end.as_bytes());
    }

    fn face(self, face: [u32; 3], out: &mut Vec<u8>) {
        let ([a, b, c], end, from) = match self {
            Self::Ply => {
                out.push(3);
                return out.extend(face.iter().flat_map(|vertex| vertex.to_le_bytes()));
            }
            Self::Off => (["3 ", " ", " "], "\n", 0),
            Self::Obj => (["f ", " ", " "], "\n", 1),
            Self::Amf(_) => (["<triangle><v1>", "</v1><v2>", "</v2><v3>"], "</v3></triangle>\n", 0),
            Self::ThreeMf(_) => (["<triangle v1=\"", "\" v2=\"", "\" v3=\""], "\"/>\n", 0),
        };
        for (before, vertex) in [a, b, c].into_iter().zip(face) {
            out.extend_from_slice(before.as_bytes());
            integer(u64::from(vertex) + from, out);
        }
        out.extend_from_slice(end.as_bytes());
    }
}

/// As the text of an XML element, or the value of an attribute.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// The shortest decimal that reads back as the same number.
fn decimal(value: f32, out: &mut Vec<u8>) {
    let size = value.abs();
    // Writing to a vector cannot fail.
    let _ = if size == 0.0 || (1e-5..1e9).contains(&size) { write!(out, "{value}") } else { write!(out, "{value:e}") };
}

fn integer(mut value: u64, out: &mut Vec<u8>) {
    let mut digits = [0; 20];
    let mut at = digits.len();
    loop {
        at -= 1;
        digits[at] = b'0' + (value % 10) as u8;
        value /= 10;
        if value == 0 {
            break;
        }
    }
    out.extend_from_slice(&digits[at..]);
}

/// Writes these meshes to the new file `output`, and syncs it unless that is deferred. Formats that hold one mesh
/// are given one.
///
/// # Errors
/// [`Error::Io`], cancellation among them.
pub(crate) fn write(
    bodies: &[Body<'_>],
    (layout, heading): (Layout, Heading<'_>),
    output: &Path,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<()> {
    let Frame { head, between, behind, tail } = layout.frame(bodies, heading);
    let mut steps = Steps { done: 0, all: 2 * bodies.iter().map(|body| body.records as u64).sum::<u64>(), output, progress };
    let fill = |sink: &mut Sink<'_>| {
        sink(head.as_bytes())?;
        for (number, body) in bodies.iter().enumerate() {
            sink(layout.object(number, body.name).as_bytes())?;
            body.put(layout, between, &mut steps, sink)?;
            sink(behind.as_bytes())?;
        }
        sink(tail.as_bytes())
    };
    parallel::in_pool(limits.threads, || match layout {
        Layout::ThreeMf(_) => {
            let most: u64 = bodies.iter().map(Body::most_text).sum();
            package::write(output, (head.len() + tail.len()) as u64 + most, fill, limits, progress)
        }
        _ => to_file(output, fill, limits),
    })
}

impl Body<'_> {
    /// Most bytes of its text in a 3MF.
    fn most_text(&self) -> u64 {
        // A character of its name may be an entity.
        let around = MOST_AROUND + 6 * self.name.len() as u64;
        around + u64::from(self.mesh.vertices()) * MOST_A_VERTEX + self.records as u64 * MOST_A_TRIANGLE
    }

    /// Writes its vertices, and its faces.
    fn put(&self, layout: Layout, between: &str, steps: &mut Steps<'_>, sink: &mut Sink<'_>) -> Result<()> {
        let vertices = |range: Range<usize>| {
            let mut text = Vec::new();
            self.mesh.positions(range).for_each(|point| layout.vertex(point, &mut text));
            text
        };
        steps.each(self.records, |pieces| pieces.into_par_iter().map(vertices).collect(), sink)?;
        sink(between.as_bytes())?;
        let mut cursor = self.mesh.cursor();
        let faces = |pieces: Vec<Range<usize>>| {
            // Numbers are read in order; their text is made side by side.
            let numbers: Vec<_> = pieces.into_iter().map(|range| self.mesh.faces(range, &mut cursor)).collect();
            let text = |faces: Vec<[u32; 3]>| {
                let mut text = Vec::new();
                faces.into_iter().for_each(|face| layout.face(face, &mut text));
                text
            };
            numbers.into_par_iter().map(text).collect()
        };
        steps.each(self.records, faces, sink)
    }
}

/// Writes what `fill` gives to the new file `output`.
fn to_file(output: &Path, fill: impl FnOnce(&mut Sink<'_>) -> Result<()>, limits: &Limits) -> Result<()> {
    let file = emit::create(output).map_err(Error::io(output, "creating"))?;
    let behind = WriteBehind::new(&file, limits).map_err(Error::io(output, "creating"))?;
    fill(&mut |bytes| behind.append(bytes).map_err(Error::io(output, "writing")))?;
    behind.finish().map_err(Error::io(output, "syncing"))?;
    if limits.defer_sync { Ok(()) } else { file.sync_all().map_err(Error::io(output, "syncing")) }
}

/// The way through the records of all meshes, twice through each.
struct Steps<'a> {
    done: u64,
    all: u64,
    output: &'a Path,
    progress: &'a dyn Progress,
}

impl Steps<'_> {
    /// Makes bytes of so many records, some pieces at a time, and takes them in their order.
    fn each(
        &mut self,
        records: usize,
        mut make: impl FnMut(Vec<Range<usize>>) -> Vec<Vec<u8>> + Send,
        take: &mut Sink<'_>,
    ) -> Result<()> {
        let at_once = 2 * PIECE * rayon::current_num_threads();
        let mut waiting: Vec<Vec<u8>> = Vec::new();
        for from in (0..records).step_by(at_once) {
            let to = records.min(from + at_once);
            let pieces = (from..to).step_by(PIECE).map(|first| first..to.min(first + PIECE)).collect();
            // Written while the next ones are made.
            let (taken, made) = rayon::join(|| waiting.iter().try_for_each(|bytes| take(bytes)), || make(pieces));
            taken?;
            waiting = made;
            self.progress.at("encode", self.done, self.all);
            self.done += (to - from) as u64;
            if self.progress.cancelled() {
                return Err(Error::cancelled(self.output, "writing"));
            }
        }
        waiting.iter().try_for_each(|bytes| take(bytes))
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use proptest::prelude::*;

    use super::*;
    use crate::contract::progress::Quiet;
    use crate::io::read::Archive;
    use crate::io::record::{self, Record};

    fn written(records: &[Record], layout: Layout) -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("out");
        let limits = Limits { threads: 2, spool: Some(folder.path().into()), ..Limits::default() };
        let mesh = Indexed::of(Path::new("a"), records, &limits, &Quiet).unwrap();
        let bodies = [Body { name: "", mesh, records: records.len() }];
        write(&bodies, (layout, Heading { maker: "Maker 1", title: "a & b" }), &output, &limits, &Quiet).unwrap();
        std::fs::read(output).unwrap()
    }

    fn two_triangles() -> Vec<Record> {
        let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 1e-7, 0.0], [0.0, 0.0, 2e20]];
        vec![record::encode([a, b, c], 0), record::encode([c, b, d], 0)]
    }

    #[test]
    fn text_holds_each_position_once() {
        let off = written(&two_triangles(), Layout::Off);
        let expected = "OFF\n4 2 0\n0 0 0\n1.5 0 0\n0 1e-7 0\n0 0 2e20\n3 0 1 2\n3 2 1 3\n";
        assert_eq!(String::from_utf8(off).unwrap(), expected);
        let obj = String::from_utf8(written(&two_triangles(), Layout::Obj)).unwrap();
        assert!(obj.ends_with("v 0 0 2e20\nf 1 2 3\nf 3 2 4\n"), "{obj}");
        let amf = String::from_utf8(written(&two_triangles(), Layout::Amf("inch"))).unwrap();
        assert!(amf.contains("<amf unit=\"inch\"") && amf.contains(">a &amp; b<"), "{amf}");
        assert!(amf.contains("<y>1e-7</y>") && amf.contains("<v1>2</v1><v2>1</v2><v3>3</v3>"), "{amf}");
    }

    #[test]
    fn a_package_holds_the_text_of_a_model() {
        let bytes = written(&two_triangles(), Layout::ThreeMf("inch"));
        let archive = Archive::open(&bytes).map_err(|rejection| rejection.at(Path::new("a"))).unwrap();
        let names: Vec<_> = archive.entries.iter().map(|entry| entry.name.as_str()).collect();
        assert_eq!(names, ["[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model"]);
        let mut model = String::new();
        let packed = &bytes[archive.entries[2].data.clone()];
        flate2::read::DeflateDecoder::new(packed).read_to_string(&mut model).unwrap();
        assert!(model.contains("<model unit=\"inch\"") && model.contains("\"Title\">a &amp; b<"), "{model}");
        let mesh = "<mesh>\n<vertices>\n<vertex x=\"0\" y=\"0\" z=\"0\"/>\n<vertex x=\"1.5\" y=\"0\" z=\"0\"/>\n\
            <vertex x=\"0\" y=\"1e-7\" z=\"0\"/>\n<vertex x=\"0\" y=\"0\" z=\"2e20\"/>\n</vertices>\n<triangles>\n\
            <triangle v1=\"0\" v2=\"1\" v3=\"2\"/>\n<triangle v1=\"2\" v2=\"1\" v3=\"3\"/>\n</triangles>\n</mesh>";
        assert!(model.contains(mesh), "{model}");
    }

    /// Where the header before it has too few bytes for its sizes, a package is refused.
    #[test]
    fn no_vertex_and_no_triangle_is_longer_than_foreseen() {
        let (layout, longest) = (Layout::ThreeMf("inch"), -1.175_494_4e-38);
        let (mut vertex, mut triangle) = (Vec::new(), Vec::new());
        layout.vertex([longest; 3], &mut vertex);
        layout.face([u32::MAX; 3], &mut triangle);
        assert!(vertex.len() as u64 <= MOST_A_VERTEX, "{}", vertex.len());
        assert!(triangle.len() as u64 <= MOST_A_TRIANGLE, "{}", triangle.len());
    }

    #[test]
    fn ply_is_binary() {
        let ply = written(&two_triangles(), Layout::Ply);
        let head = b"property list uchar int vertex_indices\nend_header\n";
        let body = ply.windows(head.len()).position(|window| window == head).unwrap() + head.len();
        assert_eq!(ply.len() - body, 4 * 12 + 2 * 13);
        assert_eq!(ply[body + 12..body + 16], 1.5f32.to_le_bytes());
        assert_eq!(ply[ply.len() - 13..], [3, 2, 0, 0, 0, 1, 0, 0, 0, 3, 0, 0, 0]);
    }

    proptest! {
        #[test]
        fn decimals_read_back_as_the_same_number(bits: u32) {
            let value = f32::from_bits(bits);
            prop_assume!(value.is_finite());
            let mut text = Vec::new();
            decimal(value, &mut text);
            let back: f32 = std::str::from_utf8(&text).unwrap().parse().unwrap();
            prop_assert_eq!(back.to_bits(), bits);
            prop_assert!(text.len() <= 16);
        }
    }
}
