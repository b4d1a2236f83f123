//! Whole files, through [`MeshFile::open`].

use proptest::prelude::*;

use crate::contract::report::Format;
use crate::io::read::MeshFile;
use crate::io::read::tests::{open, reason, texts};
use crate::io::record::{Point, corners};

const CORNERS: [Point; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

fn triangles(file: &MeshFile) -> Vec<[Point; 3]> {
    file.records().iter().map(corners).collect()
}

#[test]
fn every_way_to_write_a_triangle() {
    for text in [
        "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
        "OFF 3 1 3\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n3 0 1 2",
        "# made by hand\n\n OFF # a triangle\n# counts\n3\n1\n3\n0 0 0 # the first\n\n1 0 0\n0 1 0\n3 0 1 2 0.5 0.5 0.5 1 # grey\n",
        "OFF\n3 1\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 17\n",
        "COFF\n3 1 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n0 1 0 1 0 0 1\n3 0 1 2\n",
        "COFF\n3 1 0\n0 0 0 255 0 0\n1 0 0 255 0 0\n0 1 0 255 0 0\n3 0 1 2\n",
        "STCNOFF\n3 1 0\n0 0 0 0 0 1 1 0 0 1 0 0\n1 0 0 0 0 1 1 0 0 1 0 0\n0 1 0 0 0 1 1 0 0 1 0 0\n3 0 1 2\n",
        "OFF\n3 1 0\n0 0 0 1 0 0\n0 1 0\n3\n0 1\n2\n",
        "OFF 3 1 0 0 0 0 1 0 0 0 1 0 3 0 1 2",
    ] {
        let file = open(text.as_bytes()).unwrap();
        assert_eq!((file.format(), triangles(&file), texts(&file)), (Format::Off, vec![CORNERS], vec![]), "{text}");
    }
}

#[test]
fn oddities_are_named() {
    for (text, expected) in [
        ("3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "does not begin with \"OFF\""),
        ("OFF3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "no blank between \"OFF\" and the first count"),
        ("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "cut off: the header announces 2 faces, the file holds 1"),
        ("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1", "1 line with too few numbers"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\nend\n", "4 bytes after the last face, ignored"),
    ] {
        let file = open(text.as_bytes()).unwrap();
        assert_eq!(triangles(&file), [CORNERS], "{text}");
        assert!(texts(&file)[0].ends_with(expected), "{text}: {:?}", texts(&file));
    }
}

#[test]
fn no_mesh_is_refused_by_name() {
    for (text, expected) in [
        ("4OFF\n1 1 0\n0 0 0 0\n", "an OFF model of other than three dimensions"),
        ("nOFF 2\n1 1 0\n0 0\n", "an OFF model of other than three dimensions"),
        ("OFF\n2 0 0\n0 0 0\n1 0 0\n", "a point cloud of 2 points, no faces"),
        ("OFF\nzero\n", "an OFF model without counts of vertices and faces"),
        ("OFF\n3 1 0\n0 0 0\n", "an OFF model that is cut off before its first face"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "1 of 1 face refer to vertices that are not there"),
    ] {
        assert_eq!(reason(text.as_bytes()), expected);
    }
}

#[test]
fn binary_with_colours_of_faces() {
    let mut bytes = b"OFF BINARY\n".to_vec();
    [3_i32, 1, 3].iter().for_each(|count| bytes.extend(count.to_be_bytes()));
    CORNERS.as_flattened().iter().for_each(|value| bytes.extend(value.to_be_bytes()));
    [3_i32, 0, 1, 2, 1].iter().for_each(|word| bytes.extend(word.to_be_bytes()));
    bytes.extend(0.5_f32.to_be_bytes());
    let file = open(&bytes).unwrap();
    assert_eq!((triangles(&file), texts(&file)), (vec![CORNERS], vec![]));
}

proptest! {
    #[test]
    fn f13_any_bytes_behind_an_off_header_are_survived(
        keyword in prop::sample::select(vec!["OFF", "CNOFF", "STOFF", "OFF BINARY"]),
        body in prop::collection::vec(prop_oneof![Just(b' '), Just(b'\n'), Just(b'#'), Just(b'0'), Just(b'1'), Just(b'3'), any::<u8>()], 0..400),
    ) {
        let mut bytes = format!("{keyword}\n").into_bytes();
        bytes.extend(if keyword.ends_with('Y') { vec![0, 0, 0, 3, 0, 0, 0, 2, 0, 0, 0, 0] } else { b"3 2 0\n".to_vec() });
        bytes.extend(body);
        let _ = open(&bytes);
    }
}
