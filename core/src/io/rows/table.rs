//! Rows of a file, and what can be asked of them.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::values::Mix;
use crate::io::record::Point;

/// Vertices, texture coordinates, normals.
pub(crate) const CHANNELS: usize = 3;
/// The channel of positions.
pub(crate) const VERTICES: usize = 0;
/// The channel of texture coordinates.
pub(crate) const TEXTURE: usize = 1;
/// No row.
pub(crate) const NONE: u32 = u32::MAX;

/// The rows of a corner by channel, counted from 0; [`NONE`] where it names none.
pub(crate) type Corner = [u32; CHANNELS];

/// A face where it stands.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct FaceRow {
    /// Its bytes, of text with the end of its line.
    pub(crate) whole: Range<usize>,
    pub(crate) corners: Vec<Corner>,
    pub(crate) state: State,
}

/// Statements that hold for all faces behind them, by kind: one more than the place where each begins, 0 for none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct State(pub(crate) [usize; 4]);

/// A triangle of a face: the face's bytes, and which of its corners the triangle has.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Source {
    pub(crate) row: Range<usize>,
    /// `None`: only what the face says of itself counts, not what it says of its corners.
    pub(crate) places: Option<[u32; 3]>,
    /// So many corners the face has.
    pub(crate) corners: u32,
    pub(crate) state: State,
}

/// The faces of a file, one after the other.
pub(crate) trait Faces {
    /// Makes `row` the next face; `None` behind the last one.
    fn next_face(&mut self, row: &mut FaceRow) -> Option<()>;
}

/// A triangle to be written.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle<'s> {
    pub(crate) corners: [Corner; 3],
    /// The face whose other values it takes, if there is one.
    pub(crate) source: Option<&'s Source>,
    /// Its corners by their weights in the triangle of the source.
    pub(crate) weights: [[f64; 3]; 3],
    /// It looks to the other side than its source.
    pub(crate) is_turned: bool,
}

/// Weights of the corners of a triangle that is all of its source.
pub(crate) const WHOLE: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A file in rows.
pub(crate) trait Rows {
    /// All of its bytes.
    fn bytes(&self) -> &[u8];

    /// It is text, in which rows end with their line.
    fn is_text(&self) -> bool;

    /// The file says more than positions and faces.
    fn carries(&self) -> bool;

    /// So many rows in each channel.
    fn counts(&self) -> Corner;

    /// The position of a vertex.
    fn position(&self, vertex: u32) -> Option<Point>;

    /// The faces in their order.
    fn faces(&self) -> Box<dyn Faces + '_>;

    /// What a face says of itself: faces that say the same have equal bytes.
    fn says(&self, row: &FaceRow) -> Vec<u8>;

    /// How the numbers of a channel's rows are mixed.
    fn mixes(&self, channel: usize) -> &[Mix];

    /// The numbers of these rows of a channel. `None` if they are not there. O(bytes).
    fn values(&self, channel: usize, rows: &BTreeSet<u32>) -> Option<BTreeMap<u32, Vec<f64>>>;

    /// One position with several rows may have several places in a texture, so that each triangle keeps its own.
    fn is_split(&self) -> bool {
        false
    }

    /// New rows of a channel get numbers that no face names yet. To be asked when all faces were passed.
    fn may_grow(&self, _channel: usize) -> bool {
        true
    }

    /// Makes sure that indices of so many vertices, and so many faces, can be written: it may take wider indices, once. `false`: they cannot.
    fn make_room(&self, vertices: u64, faces: u64) -> bool;

    /// Gives bytes of the file on, as they are in the output. The range begins and ends between two rows.
    fn copy(&self, range: Range<usize>, put: &mut dyn FnMut(&[u8])) {
        put(self.bytes().get(range).unwrap_or_default());
    }

    /// What stands before the rows, with these counts of vertices and faces, and where in the file it ends.
    fn head(&self, vertices: u64, faces: u64) -> (Vec<u8>, usize);

    /// Where new rows of vertices stand: before this byte of the file.
    fn end_of_vertices(&self) -> usize;

    /// Where new faces stand: before this byte of the file.
    fn end_of_faces(&self) -> usize;

    /// Writes a row of a channel.
    fn put_row(&self, channel: usize, values: &[f64], out: &mut Vec<u8>);

    /// Writes a triangle.
    fn put_face(&self, triangle: &Triangle<'_>, out: &mut Vec<u8>);

    /// The statements that hold at the end of the file. O(bytes).
    fn end_state(&self) -> State {
        State::default()
    }

    /// Writes the statements by which `to` holds where `from` does; `false` where there is no statement for it.
    fn put_state(&self, _from: State, _to: State, _out: &mut Vec<u8>) -> bool {
        true
    }
}
