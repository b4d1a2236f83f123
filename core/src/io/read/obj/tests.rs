//! OBJ texts through [`MeshFile::open`], and random ones of a known mesh.

use proptest::prelude::*;

use super::super::tests::{open, reason, texts};
use super::super::{HEADER_BYTES, MeshFile};
use super::*;
use crate::contract::progress::Quiet;
use crate::contract::report::Format;
use crate::contract::settings::Limits;
use crate::io::record::{Point, corners, encode};

const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

fn points(file: &MeshFile) -> Vec<[Point; 3]> {
    file.records().iter().map(corners).collect()
}

#[test]
fn a_plain_file_has_no_findings() {
    let file = open(TETRAHEDRON.as_bytes()).unwrap();
    assert_eq!((file.records().len(), file.format()), (4, Format::Obj));
    assert_eq!(file.records()[3], encode([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], 0));
    assert_eq!(texts(&file), [""; 0]);
}

#[test]
fn every_spelling_of_the_same_faces() {
    let plain = points(&open(TETRAHEDRON.as_bytes()).unwrap());
    let long_comment = "# a licence\n".repeat(2000);
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    for text in [
        // Textures and normals, in each form.
        format!(
            "mtllib a.mtl\no part\n{vertices}vt 0 0\nvn 0 0 1\ng side\nusemtl red\ns 1\nf 1/1/1 3/1/1 2/1/1\nf 1//1 2//1 4//1\nf 1/1 4/1 3/1\nf 2/ 3/ 4/\n"
        ),
        // Relative ones, in the middle of the vertices and behind them; a face before its vertices.
        "f 1 3 2\nv 0 0 0\nv 1 0 0\nf 1 2 4\nv 0 1 0\nv 0 0 1\nf -4 -1 -2\nf -3/-1/-1 -2 -1\n".into(),
        // Other line ends, blanks and joined lines.
        TETRAHEDRON.replace('\n', "\r\n"),
        TETRAHEDRON.replace('\n', "\r"),
        TETRAHEDRON.replace('\n', " \n\n").replace(' ', "\t \\\n  "),
        TETRAHEDRON.replace("f 1 3 2", "  f +1 03 \\\r\n2 # the bottom").replace("f 2 3", "fo 2 3"),
        format!("{long_comment}{TETRAHEDRON}"),
        format!("\u{feff}{TETRAHEDRON}"),
        TETRAHEDRON.trim_end().into(),
        TETRAHEDRON.replace("0 1 0", "0 1 0 1.0").replace("0 0 1", "0 0 1 0.5 0.5 0.5"),
    ] {
        let file = open(text.as_bytes()).unwrap();
        assert_eq!((points(&file), file.format()), (plain.clone(), Format::Obj), "{text}");
    }
}

#[test]
fn a_joined_blank_line_ends_a_statement_all_the_same() {
    // The backslash joins with an empty line, which ends there.
    let text = TETRAHEDRON.replace("f 1 3 2\n", "f 1 3 2 \\\n\n");
    assert_eq!(open(text.as_bytes()).unwrap().records().len(), 4);
}

#[test]
fn what_is_no_face_is_told() {
    let text = format!(
        "o a\no b\n{TETRAHEDRON}l 1 2\np 1\np 2\nsurf 0 1 0 1 1 2 3 4\nmystery 5\nf 1 2 9\nf 0 1 2\nf 1 2\nf 1 x 2\nv 1 2 x\nv 5 6 7 0.5\n"
    );
    let file = open(text.as_bytes()).unwrap();
    assert_eq!(file.records().len(), 4);
    assert_eq!(
        texts(&file),
        [
            "1 vertex with a coordinate that is missing or no number, read as NaN; the first at byte 147",
            "weights of 1 vertex, which faces have no use for",
            "1 line and 2 points, which are no part of the mesh",
            "1 curve or surface in free form, left out",
            "1 statement unknown to OBJ, passed over; the first is \"mystery\"",
            "2 objects (a, b), read as one mesh",
            "3 faces refer to vertices that are not there, left out; the first is face 5",
            "1 face of fewer than three corners, left out",
        ]
    );
    assert_eq!(text.as_bytes()[147..].first_chunk(), Some(b"v 1 2 x\n"));
}

#[test]
fn a_header_has_the_name_of_an_object_or_else_of_a_group() {
    let header = |before: &str| open(format!("{before}\n{TETRAHEDRON}").as_bytes()).unwrap().output_header();
    let expected = |name: &str| -> [u8; HEADER_BYTES] { binary::header_of(name.as_bytes()) };
    assert_eq!(header("g lid\no box 1"), expected("box 1"));
    assert_eq!(header("g\ng lid"), expected("lid"));
}

#[test]
fn a_file_that_ends_within_a_line_is_cut_off() {
    for (end, is_cut) in [
        ("f 1 2", true),
        ("v 1 2", true),
        ("f 1/1 2/1 3", true),
        ("f 1/1 2/1 3/", true),
        ("usem", true),
        ("f 1 2 3", false),
        ("# the en", false),
    ] {
        let file = open(format!("{TETRAHEDRON}{end}").as_bytes()).unwrap();
        let lost = texts(&file) == ["cut off within its last line, which was left out"];
        assert_eq!((file.records().len(), lost), (if end == "f 1 2 3" { 5 } else { 4 }, is_cut), "{end}");
    }
    let padded = open(&[TETRAHEDRON.as_bytes(), &[0; 100]].concat()).unwrap();
    assert!(padded.is_flawless() && texts(&padded) == ["padded with 100 zero bytes"]);
}

#[test]
fn a_mesh_without_faces_is_refused_by_name() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (text, expected) in [
        (vertices.to_owned(), "a point cloud of 3 points, no faces"),
        (format!("{vertices}l 1 2\nl 2 3\np 1\n"), "an OBJ of 2 lines and 1 point only, no faces"),
        (format!("{vertices}curv 0 1 1 2\n"), "an OBJ of 1 curve or surface in free form, no faces"),
        (
            "v 1 2\nv 3 4\nv 1 5\nf 1 2 3\n".into(),
            "3 vertices with coordinates that are missing or no numbers, the first at byte 0",
        ),
        (format!("{vertices}f 1 2 4\n"), "1 of 1 face refer to vertices that are not there"),
        (format!("{vertices}f 1 2\n"), "no triangles"),
        (vertices.replace("1 0 0", "1,5 0.5 0") + "f 1 2 3\n", "decimal commas and decimal points are mixed"),
    ] {
        assert_eq!(reason(text.as_bytes()), expected, "{text}");
    }
}

#[test]
fn other_texts_are_no_obj() {
    for text in [
        "solid v\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n",
        "ply\nformat ascii 1.0\nelement vertex 1\n",
        "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
        "Dear customer,\nv is the letter\nthat you asked for\n",
        "G28\nG1 X10 Y10\n",
        "# nothing but a comment\n",
        "f 1 2 3\nf 2 3 4\n",
        "",
    ] {
        assert_eq!(begins(text.as_bytes()), None, "{text}");
    }
}

/// How a writer spells a face.
#[derive(Clone, Copy, Debug)]
struct Spelling {
    form: u8,
    relative: bool,
    joined: bool,
    early: bool,
    end: &'static str,
}

fn spelling() -> impl Strategy<Value = Spelling> {
    let end = prop_oneof![Just("\n"), Just("\r\n"), Just("\r")];
    (0u8..4, any::<bool>(), any::<bool>(), any::<bool>(), end).prop_map(|(form, relative, joined, early, end)| Spelling {
        form,
        relative,
        joined,
        early,
        end,
    })
}

fn written(vertices: &[Point], faces: &[Vec<usize>], spelling: Spelling) -> String {
    let Spelling { form, relative, joined, early, end } = spelling;
    let index = |vertex: usize| {
        let number = if relative { format!("-{}", vertices.len() - vertex) } else { format!("{}", vertex + 1) };
        number.clone() + &["".to_owned(), format!("/{number}"), format!("//{number}"), format!("/{number}/7")][usize::from(form)]
    };
    let blank = if joined { format!(" \\{end} ") } else { " ".into() };
    let line =
        |face: &Vec<usize>| format!("f {}{end}", face.iter().map(|vertex| index(*vertex)).collect::<Vec<_>>().join(&blank));
    let faces: String = faces.iter().map(line).collect();
    let vertices: String = vertices.iter().map(|[x, y, z]| format!("v {x}{blank}{y} {z:e}{end}")).collect();
    if early && !relative { format!("vt 0 0{end}{faces}{vertices}") } else { vertices + &faces }
}

fn opened(bytes: &[u8], threads: usize) -> Result<MeshFile> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.obj");
    std::fs::write(&path, bytes).unwrap();
    MeshFile::open(&path, folder.path(), &Limits { threads, ..Limits::default() }, &Quiet)
}

proptest! {
    #[test]
    fn a_mesh_comes_back_from_each_spelling(
        vertices in prop::collection::vec(prop::array::uniform3(-1.0e3f32..1.0e3), 8),
        faces in prop::collection::vec(prop::collection::vec(0usize..8, 3..6), 1..20),
        spelling in spelling(),
    ) {
        let text = written(&vertices, &faces, spelling);
        let mut expected = Vec::new();
        for face in faces {
            let corners: Vec<Point> = face.into_iter().map(|vertex| vertices[vertex]).collect();
            if let [a, b, c] = *corners.as_slice() {
                expected.push(encode([a, b, c], 0));
            } else {
                super::super::polygon::cut(&corners, |triangle| expected.push(encode(triangle.map(|corner| corners[corner]), 0)));
            }
        }
        let file = open(text.as_bytes()).unwrap();
        prop_assert_eq!(file.records(), expected, "{}", text);
    }

    #[test]
    fn f13_no_obj_is_too_odd(pieces in prop::collection::vec(prop_oneof![
        "[vfplo#\\\\ 0-9./\n\r-]{0,12}", Just("v 1 2 3\n".to_owned()), Just("f 1 2 3\n".to_owned()), Just("f 1 2 3 -1".to_owned()),
    ], 0..40)) {
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", pieces.concat());
        let _ = open(text.as_bytes());
        // Whatever it is, its lines are parted in the same places by both looks.
        let (_, found) = survey::survey(text.as_bytes(), 0);
        let faces = surfaces::surfaces(text.as_bytes(), Vertices::spooled(&[]), 0);
        let left_out = u64::from(faces.cut_off);
        prop_assert_eq!(found.faces, faces.tally.faces + left_out);
    }
}

#[test]
fn threads_and_windows_do_not_show() {
    // Several windows, relative faces among vertices, and lines joined wherever a window may end.
    let mut text = String::new();
    for part in 0..40_000u32 {
        text += &format!("v {part}.25 0 0\nv {part} 1 \\\n 0\nv {part} 0 1\nf -3 \\\r\n -2/5 -1\n");
    }
    assert!(text.len() > 2 * WINDOW);
    let one = opened(text.as_bytes(), 1).unwrap();
    let four = opened(text.as_bytes(), 4).unwrap();
    assert_eq!(one.records(), four.records());
    assert_eq!(one.records().len(), 40_000);
    for (part, record) in one.records().iter().enumerate() {
        let x = part as f32;
        assert_eq!(corners(record), [[x + 0.25, 0.0, 0.0], [x, 1.0, 0.0], [x, 0.0, 1.0]]);
    }
}
