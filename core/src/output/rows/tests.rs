//! Files whose faces and triangles do not fit each other, and faces of which some triangles stay.

use super::*;
use crate::contract::progress::Quiet;
use crate::contract::settings::Limits;
use crate::engine::files;
use crate::io::read::MeshFile;
use crate::io::record::{self, Record};
use crate::io::rows::Said;
use crate::output::edit::Edit;

/// A pyramid over a square, with a material.
const PYRAMID: &str =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1\nusemtl m\nf 4 3 2 1\nf 1 2 5\nf -4 -3 -1\nf 3 4 5\nf 4 1 5\n";

fn open(text: &str) -> MeshFile {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, text).unwrap();
    files::open(&path, &Limits::default(), &Quiet).unwrap()
}

fn written(file: &MeshFile, now: &[Record]) -> Option<String> {
    let Said::Rows(rows) = Said::by(file) else { panic!("no rows") };
    let edit = Edit::default();
    let planned = Planned::of(&*rows, Change { came: file.records(), now, edit: &edit })?;
    let mut out = Vec::new();
    let result = planned.write(&mut |bytes| {
        out.extend_from_slice(bytes);
        Ok(())
    });
    result.unwrap();
    Some(String::from_utf8(out).unwrap())
}

#[test]
fn a_file_without_changes_stays_byte_for_byte() {
    let file = open(PYRAMID);
    assert_eq!(written(&file, file.records()).as_deref(), Some(PYRAMID));
}

/// One triangle of the square is moved: the other one stays where the square was, and the moved one goes behind all others.
#[test]
fn a_face_of_which_one_triangle_stays_becomes_triangles() {
    let file = open(PYRAMID);
    let mut now = file.records().to_vec();
    let corners = record::corners(&now[0]);
    let moved = corners.map(|[x, y, z]| if [x, y, z] == [0.0, 1.0, 0.0] { [-0.25, 1.0, 0.0] } else { [x, y, z] });
    now[0] = record::encode(moved, 0);
    let output = written(&file, &now).unwrap();
    let stays = record::corners(&now[1])
        .map(|corner| 1 + [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].iter().position(|xy| corner[..2] == *xy).unwrap());
    let place = |corner: [f32; 3]| {
        if corner[0] < 0.0 {
            6
        } else {
            1 + [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]].iter().position(|xy| corner[..2] == *xy).unwrap()
        }
    };
    let words = |corners: [usize; 3]| format!("f {} {} {}\n", corners[0], corners[1], corners[2]);
    let expected = PYRAMID.replace("f 4 3 2 1\n", &words(stays)) + "v -0.25 1 0\n" + &words(moved.map(place));
    assert_eq!(output, expected);
}

#[test]
fn triangles_of_another_file_do_not_fit() {
    let (file, other) = (open(PYRAMID), open(&PYRAMID.replace("0.5 0.5 1", "0.5 0.5 2")));
    let Said::Rows(rows) = Said::by(&file) else { panic!("no rows") };
    let edit = Edit::default();
    for came in [other.records(), &file.records()[1..]] {
        assert!(Planned::of(&*rows, Change { came, now: came, edit: &edit }).is_none());
    }
}
