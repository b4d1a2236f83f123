//! Triangles that close a loop, how they were made, or why there are none.

/// How a patch was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Method {
    /// The loop has three vertices.
    Triangle,
    /// Constrained Delaunay triangulation in the loop's plane.
    Planar,
    /// Dynamic programming for the least bend, then the least area.
    MinimumWeight,
    /// Dynamic programming for the least area.
    LeastArea,
    /// Ear clipping, with the last vertices by minimum weight.
    Front,
    /// As planar, for a loop far from planar that is a simple polygon in projection.
    Projected,
    /// Any valid triangulation of a small loop.
    Search,
    /// A strip between the two sides of a narrow loop.
    Zipped,
}

impl Method {
    /// Name for reports.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Triangle => "triangle",
            Self::Planar => "planar",
            Self::MinimumWeight => "minimum_weight",
            Self::LeastArea => "least_area",
            Self::Front => "front",
            Self::Projected => "projected",
            Self::Search => "search",
            Self::Zipped => "zipped",
        }
    }
}

/// Triangles that close a loop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Patch {
    /// Vertex indices; each triangle begins with its smallest, and they are sorted.
    pub triangles: Vec<[u32; 3]>,
    pub method: Method,
}

/// Why a loop was not closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Unfillable {
    /// Fewer than three vertices, a position that occurs twice, or a coordinate that is not finite.
    #[error("not a loop of distinct finite vertices")]
    NotALoop,
    /// All vertices lie exactly on one line: any triangle would have zero area. Split the neighbours instead.
    #[error("all vertices lie on one line")]
    Collinear,
    /// More vertices than the settings allow, or too many for the methods that were left to try.
    #[error("too many vertices")]
    TooLarge,
    /// Every patch tried crosses itself.
    #[error("every patch tried crosses itself")]
    CrossesItself,
    /// Chords that are edges of the mesh already, or the triangles around the loop, leave no patch that was tried.
    #[error("edges or triangles of the mesh around are in the way of every patch tried")]
    Blocked,
}

pub(super) fn patch(triangles: Vec<[u32; 3]>, method: Method) -> Patch {
    Patch { triangles: in_order(triangles), method }
}

/// Each from its smallest vertex, and sorted.
pub(super) fn in_order(mut triangles: Vec<[u32; 3]>) -> Vec<[u32; 3]> {
    for t in &mut triangles {
        let first = (0..3).min_by_key(|&k| t[k]).unwrap_or(0);
        t.rotate_left(first);
    }
    triangles.sort_unstable();
    triangles
}
