//! Files of vertices and faces as the rows that stand in them, so that a result can keep all that a file says of its mesh.
//!
//! **In:** the bytes of a PLY, an OFF or an OBJ that was read without a flaw, and the positions of its vertices.
//! **Out:** each face where it stands, with the rows that its corners name; the numbers of any row; new rows in the file's own form.
//! **Promise:** faces in the file's order, in memory for one of them. A file that does not fit these rows has none.
//!
//! Rows lie in channels: vertices, texture coordinates, normals. PLY and OFF have the first alone, where colours, normals and texture
//! coordinates stand behind a position.

mod cells;
#[cfg(fuzzing)]
pub mod fuzzing;
mod obj;
mod off;
mod ply;
mod table;
mod values;

use super::read::MeshFile;
use crate::contract::report::Format;
use obj::Obj;
use off::Off;
use ply::Ply;
pub(crate) use table::{CHANNELS, Corner, FaceRow, Faces, NONE, Rows, Source, State, TEXTURE, Triangle, VERTICES, WHOLE};
pub(crate) use values::{Mix, facing, mixed, set_position};

/// What a file says besides the positions and faces of its mesh.
pub(crate) enum Said<'a> {
    Nothing,
    /// It stands in these rows.
    Rows(Box<dyn Rows + 'a>),
    /// It stands in a form that cannot be written anew: of so many triangles.
    Elsewhere(u64),
}

impl<'a> Said<'a> {
    /// By a file that was read. O(bytes).
    pub(crate) fn by(mesh: &'a MeshFile) -> Self {
        let (bytes, vertices) = (mesh.bytes(), mesh.vertices().filter(|_| mesh.has_whole_rows()));
        let (rows, says_more): (Option<Box<dyn Rows + 'a>>, bool) = match mesh.format() {
            Format::Ply => (vertices.and_then(|vertices| boxed(Ply::of(bytes, vertices)?)), ply::says_more(bytes)),
            Format::Off => (vertices.and_then(|vertices| boxed(Off::of(bytes, vertices)?)), off::says_more(bytes)),
            Format::Obj => (vertices.and_then(|vertices| boxed(Obj::of(bytes, vertices)?)), obj::says_more(bytes)),
            _ => (None, mesh.coloured() > 0),
        };
        match rows {
            Some(rows) if rows.carries() => Self::Rows(rows),
            Some(_) => Self::Nothing,
            None if says_more && mesh.coloured() > 0 => Self::Elsewhere(mesh.coloured()),
            None if says_more => Self::Elsewhere(mesh.records().len() as u64),
            None => Self::Nothing,
        }
    }

    /// Of how many triangles it is, in a file of so many.
    pub(crate) fn triangles(&self, all: usize) -> u64 {
        match self {
            Self::Nothing => 0,
            Self::Rows(_) => all as u64,
            Self::Elsewhere(triangles) => *triangles,
        }
    }
}

fn boxed<'a>(rows: impl Rows + 'a) -> Option<Box<dyn Rows + 'a>> {
    Some(Box::new(rows))
}
