//! A mesh that is to be simplified, what is wanted of it, and what comes of that.

use crate::geometry::exact::Point;
use crate::proof::Proved;

/// A mesh that is to be simplified.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Input<'a> {
    /// Positions of vertices, finite.
    pub points: &'a [Point],
    /// Vertices of faces.
    pub faces: &'a [[u32; 3]],
    /// Which faces may change; all of them if it is `None`.
    pub region: Option<&'a [bool]>,
    /// Which vertices stay as they are, besides those of faces that may not change.
    pub fixed: Option<&'a [bool]>,
    /// The half-open box, from the first corner and before the second one, in which all that moves stays; all of space if it is `None`.
    pub within: Option<[Point; 2]>,
}

/// Wishes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Options {
    /// Stop at so many triangles.
    pub triangles: Option<usize>,
    /// The largest distance between any point of one surface and the other surface, both ways, in the unit of the points. Where only a count is
    /// given, it is a hundredth of the diagonal of the box around the points; infinity is no bound.
    pub max_deviation: Option<f64>,
    /// Edges are features, and stay, where the normals of their triangles differ by more than this angle, in radians.
    pub feature_angle: Option<f64>,
    /// A collapse turns no triangle by more than this angle, in radians.
    pub max_turn: f64,
    /// New vertices may lie where the quadric is least, besides at the ends and in the middle of an edge.
    pub optimal: bool,
    /// Bounds of the deviation are proved, also where none is wanted.
    pub prove: bool,
    /// No proved bound needs to be lower than this; the deviation that is wanted, if it is `None` and there is one.
    pub enough: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            triangles: None,
            max_deviation: None,
            feature_angle: None,
            max_turn: 1.2,
            optimal: true,
            prove: true,
            enough: None,
        }
    }
}

/// Why no more was simplified.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub(crate) enum Ended {
    /// The count that was wanted is reached.
    Count,
    /// More would deviate too far.
    Deviation,
    /// No more edge may collapse: for what stays, the topology, the shape of triangles, or what they would cross.
    #[default]
    Edges,
    /// Some for the one, some for the other.
    Both,
}

/// Why edges were left alone.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Barred {
    /// Because of what their quadrics would be.
    pub(super) by_distance: bool,
    /// For any other reason.
    pub(super) by_rules: bool,
}

impl Barred {
    /// For the reasons of both.
    pub(super) fn or(self, other: Self) -> Self {
        Self { by_distance: self.by_distance || other.by_distance, by_rules: self.by_rules || other.by_rules }
    }

    /// Why no more was simplified.
    pub(super) fn ended(self) -> Ended {
        match (self.by_distance, self.by_rules) {
            (true, true) => Ended::Both,
            (true, false) => Ended::Deviation,
            (false, _) => Ended::Edges,
        }
    }
}

/// The simplified mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outcome {
    /// Positions of vertices.
    pub points: Vec<Point>,
    /// Vertices of faces.
    pub faces: Vec<[u32; 3]>,
    /// For each face, the input's face that it is, with the same three positions; `u32::MAX` for a new one.
    pub origins: Vec<u32>,
    /// For each vertex of the input, the vertex that it has become.
    #[allow(dead_code, reason = "tests prove by it")]
    pub became: Vec<u32>,
    /// Bounds of the distance between the two surfaces, proved; `None` if they were not asked for.
    pub proved: Option<Proved>,
    /// Why no more was simplified.
    pub ended: Ended,
    /// The volume before and after, signed, as seen from the middle of the input's box; it means something where the surface is closed.
    pub volume: [f64; 2],
    /// Cells that were done again with exact tests of each collapse, since triangles crossed in them.
    #[allow(dead_code, reason = "tests count them")]
    pub redone: usize,
    /// How often something was done, with less and less aimed at where the deviation was missed, until it was kept.
    pub attempts: usize,
}
