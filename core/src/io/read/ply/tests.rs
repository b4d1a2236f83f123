//! Whole files, through [`MeshFile::open`].

use proptest::prelude::*;

use crate::contract::progress::Quiet;
use crate::contract::report::Format;
use crate::contract::settings::Limits;
use crate::io::read::MeshFile;
use crate::io::read::tests::{open, reason, texts};
use crate::io::record::{Point, corners};

const TRIANGLE: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
const CORNERS: [Point; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

fn triangles(file: &MeshFile) -> Vec<[Point; 3]> {
    file.records().iter().map(corners).collect()
}

/// The triangles of a text, and what is odd about it.
fn read(text: &str) -> (Vec<[Point; 3]>, Vec<String>) {
    let file = open(text.as_bytes()).unwrap();
    (triangles(&file), texts(&file).into_iter().map(String::from).collect())
}

#[test]
fn a_triangle() {
    let file = open(TRIANGLE.as_bytes()).unwrap();
    assert_eq!((file.format(), triangles(&file), texts(&file)), (Format::Ply, vec![CORNERS], vec![]));
}

#[test]
fn lines_may_be_broken_elsewhere_if_the_numbers_fit() {
    let (head, _) = TRIANGLE.split_once("0 0 0\n").unwrap();
    for body in [
        "0\n0 0 1 0\n0 0 1 0\n3\n0 1 2\n",
        "0 0 0 1 0 0 0 1 0\n3 0 1 2\n",
        "0 0 0 1 0 0 0 1 0 3 0 1 2",
        "\r\n0 0 0\r\n\r\n1 0 0 \r0 1 0\r\n3 0 1 2",
    ] {
        assert_eq!(read(&format!("{head}{body}")), (vec![CORNERS], vec![]), "{body}");
    }
}

#[test]
fn a_number_too_few_shifts_nothing() {
    // Four vertices, of which the second lacks z; no face refers to it.
    let text = TRIANGLE.replace("vertex 3", "vertex 4").replace("1 0 0\n", "5 5\n1 0 0\n").replace("3 0 1 2", "3 0 2 3");
    let (triangles, findings) = read(&text);
    assert_eq!(triangles, [CORNERS]);
    assert!(
        findings[0].contains("1 vertex with a coordinate that is no number") && findings[0].contains("vertex 2"),
        "{findings:?}"
    );
    assert!(findings[1].contains("1 lines with more or fewer numbers"), "{findings:?}");
}

#[test]
fn faces_before_vertices_and_strangers_around_them() {
    let text = "ply\nformat ascii 1.0\nelement face 1\nproperty uchar red\nproperty list uchar int vertex_index\nelement camera 1\n\
        property list int float views\nelement vertex 3\nproperty float y\nproperty double z\nproperty list uchar float w\n\
        property short x\nelement edge 1\nproperty int vertex1\nend_header\n9 3 0 1 2\n2 1.5 2.5\n0 0 0 0\n0 0 1 7 1\n1 0 0 0\n5\n";
    assert_eq!(read(text), (vec![CORNERS], vec![]));
}

#[test]
fn strips_turn_and_begin_anew() {
    let text = TRIANGLE
        .replace("face 1", "tristrips 1")
        .replace("uchar int", "int int")
        .replace("vertex 3", "vertex 4")
        .replace("3 0 1 2\n", "1 1 0\n8 0 1 2 3 -1 1 2 3\n");
    let [a, b, c, d] = [CORNERS[0], CORNERS[1], CORNERS[2], [1.0, 1.0, 0.0]];
    assert_eq!(read(&text).0, [[a, b, c], [c, b, d], [b, c, d]]);
}

#[test]
fn no_mesh_is_refused_by_name() {
    for (old, new, expected) in [
        ("element face 1\nproperty list uchar int vertex_indices\n", "", "a point cloud of 3 points, no faces"),
        ("face 1", "face 0", "a point cloud of 3 points, no faces"),
        ("uchar int", "uchar float", "a PLY model whose indices of vertices have fractions"),
        ("property float z\n", "", "a PLY model whose vertices do not have x, y and z once each"),
        ("3 0 1 2\n", "", "a PLY model that is cut off before its first face"),
        ("3 0 1 2\n", "3 0 1 7\n", "1 of 1 face refer to vertices that are not there"),
        ("3 0 1 2\n", "3 0 -1 2\n", "1 of 1 face refer to vertices that are not there"),
        ("0 0 0\n1 0 0\n", "a b c\nd e f\n", "2 of 3 vertices have coordinates that are no numbers"),
    ] {
        assert_eq!(reason(TRIANGLE.replace(old, new).as_bytes()), expected);
    }
}

/// Found by fuzzing.
#[test]
fn elements_of_faces_that_are_cut_off_in_the_same_way_are_told_once() {
    let faces = "element face 9\nproperty list uchar int vertex_indices\n";
    let text = TRIANGLE.replace("element face 1\nproperty list uchar int vertex_indices\n", &faces.repeat(3));
    assert_ne!(text, TRIANGLE);
    let (_, findings) = read(&text);
    assert_eq!(findings.iter().filter(|finding| finding.starts_with("cut off")).count(), 2, "{findings:?}");
    let (first, second) = (&findings[0], &findings[1]);
    assert_ne!(first, second);
}

#[test]
fn f14_counts_that_lie_take_no_memory() {
    let most = u64::MAX.to_string();
    let (triangles, findings) = read(&TRIANGLE.replace("face 1", &format!("face {most}")));
    assert_eq!(triangles, [CORNERS]);
    assert!(findings[0].starts_with("cut off: the header announces"), "{findings:?}");
    assert!(reason(TRIANGLE.replace("vertex 3", &format!("vertex {most}")).as_bytes()).contains("cut off"));
    let binary = TRIANGLE.replace("ascii", "binary_little_endian").replace("vertex 3", &format!("vertex {most}"));
    assert!(reason(binary.as_bytes()).contains("cut off"));
}

/// A mesh of triangles and quadrangles.
#[derive(Clone, Debug)]
struct Model {
    points: Vec<Point>,
    faces: Vec<Vec<u32>>,
}

impl Model {
    fn any() -> impl Strategy<Value = Self> {
        let points = prop::collection::vec([-1e6_f32..1e6, -1.0_f32..1.0, -1e-6_f32..1e-6], 3..40);
        points.prop_flat_map(|points| {
            let index = 0..points.len() as u32;
            let faces = prop::collection::vec(prop::collection::vec(index, 3..5), 1..60);
            (Just(points), faces).prop_map(|(points, faces)| Self { points, faces })
        })
    }

    /// With a property before the coordinates and behind the list, as `format` has it.
    fn write(&self, format: &str, real: &str, index: &str) -> Vec<u8> {
        let (points, faces) = (self.points.len(), self.faces.len());
        let mut bytes = format!(
            "ply\nformat {format} 1.0\nelement vertex {points}\nproperty uchar q\nproperty {real} x\nproperty {real} y\nproperty {real} z\n\
             element face {faces}\nproperty list uchar {index} vertex_indices\nproperty float f\nend_header\n"
        )
        .into_bytes();
        let mut number = |value: f64, kind: &str, last: bool| {
            let mut raw = match kind {
                _ if format == "ascii" => {
                    bytes.extend(format!("{value}{}", if last { '\n' } else { ' ' }).bytes());
                    return;
                }
                "float" => (value as f32).to_le_bytes().to_vec(),
                "double" => value.to_le_bytes().to_vec(),
                "ushort" => (value as u16).to_le_bytes().to_vec(),
                "uint" | "int" => (value as u32).to_le_bytes().to_vec(),
                _ => vec![value as u8],
            };
            if format == "binary_big_endian" {
                raw.reverse();
            }
            bytes.extend(raw);
        };
        for point in &self.points {
            number(7.0, "uchar", false);
            for (axis, value) in point.iter().enumerate() {
                number(f64::from(*value), real, axis == 2);
            }
        }
        for face in &self.faces {
            number(face.len() as f64, "uchar", false);
            face.iter().for_each(|vertex| number((*vertex).into(), index, false));
            number(0.5, "float", true);
        }
        bytes
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn every_form_of_a_mesh_reads_to_the_same_triangles(model in Model::any()) {
        let first = open(&model.write("ascii", "double", "int")).unwrap();
        let corners: usize = model.faces.iter().map(|face| face.len() - 2).sum();
        prop_assert_eq!(first.records().len(), corners);
        for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
            for (real, index) in [("float", "uint"), ("double", "uchar"), ("float", "ushort")] {
                let file = open(&model.write(format, real, index)).unwrap();
                prop_assert_eq!(file.records(), first.records(), "{} {} {}", format, real, index);
            }
        }
    }

    #[test]
    fn f13_any_bytes_behind_a_ply_header_are_survived(
        format in prop::sample::select(vec!["ascii", "binary_little_endian", "binary_big_endian"]),
        kind in prop::sample::select(vec!["face", "tristrips", "edge"]),
        length in prop::sample::select(vec!["char", "uchar", "int", "double"]),
        body in prop::collection::vec(prop_oneof![Just(b' '), Just(b'\n'), Just(b'0'), Just(b'1'), Just(b'3'), any::<u8>()], 0..400),
        counts in [0_u64..9, 0_u64..9],
    ) {
        let [vertices, faces] = counts;
        let mut bytes = format!(
            "ply\nformat {format} 1.0\nelement {kind} {faces}\nproperty list {length} short vertex_indices\nelement vertex {vertices}\n\
             property float x\nproperty float y\nproperty float z\nelement face 5\nproperty list uchar uchar vertex_indices\nend_header\n"
        ).into_bytes();
        bytes.extend(body);
        let _ = open(&bytes);
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    // Beyond a few pieces, with a line that is broken, one that lacks a number, and a face astray.
    let rows = 60_000_u32;
    let vertices: String = (0..rows).map(|row| format!("{row} {} 0.1234567890123\n", row % 7)).collect();
    let faces: String = (2..rows).map(|row| format!("3 {} {} {row}\n", row - 2, row - 1)).collect();
    let faces = faces.replace("3 29998 29999 30000\n", "3 29998 29999\n").replace("3 5 6 7\n", "3 5 6 99999\n");
    let head = TRIANGLE.split_once("0 0 0\n").unwrap().0.replace("vertex 3", &format!("vertex {rows}"));
    let text = format!("{}{vertices}{faces}", head.replace("face 1", &format!("face {}", rows - 2)));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.ply");
    std::fs::write(&path, text).unwrap();
    let [one, four] =
        [1, 4].map(|threads| MeshFile::open(&path, folder.path(), &Limits { threads, ..Limits::default() }, &Quiet).unwrap());
    assert_eq!(one.records().len(), rows as usize - 4);
    assert!(one.records() == four.records() && one.findings() == four.findings());
}
