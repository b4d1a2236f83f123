//! Defects of a mesh, in the report.

use serde::{Deserialize, Serialize};

/// Counts after the exact weld. Definitions: `core/DEFECTS.md`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Defects {
    /// Triangles with finite coordinates.
    pub triangles: u64,
    /// Triangles with a NaN or infinite coordinate; in no other count.
    pub nonfinite: u64,
    /// Distinct positions.
    pub vertices: u64,
    /// Distinct positions used by a triangle with three distinct vertices.
    pub vertices_used: u64,
    /// Distinct edges of triangles with three distinct vertices.
    pub edges: u64,
    /// Triangles with a repeated vertex; left out of the topology.
    pub degenerate_index: u64,
    /// Triangles of three distinct, exactly collinear vertices; kept in the topology.
    pub degenerate_area: u64,
    /// Triangles with the vertex set and the direction of an earlier one.
    pub duplicates_same: u64,
    /// Triangles with the vertex set of an earlier one, none of them in the same direction.
    pub duplicates_opposite: u64,
    /// Edges of one triangle.
    pub boundary_edges: u64,
    /// Connected sets of boundary edges.
    pub boundary_loops: u64,
    /// Edges of more than two triangles.
    pub nonmanifold_edges: u64,
    /// Vertices on a non-manifold edge, or whose triangles form more than one fan.
    pub nonmanifold_vertices: u64,
    /// Two-triangle edges used twice in the same direction.
    pub inconsistent_edges: u64,
    /// Edges not used equally often in each direction.
    pub unbalanced_edges: u64,
    /// Sets of triangles connected through edges.
    pub components: u64,
    /// Closed, coherent components of negative volume that are no cavity.
    pub inverted_components: u64,
    /// Closed components of positive volume inside no other body.
    pub bodies: u64,
    /// Closed components of negative volume inside a body.
    pub cavities: u64,
    /// Closed components of positive volume inside another body (enclosed).
    pub nested_positive: u64,
    /// Boundary vertices inside a boundary edge of another triangle, within the weld tolerance (T-junctions).
    pub noncommon_vertices: u64,
    /// Boundary vertices within the weld tolerance of another boundary vertex.
    pub weldable_vertices: u64,
    /// Triangles that cross or overlap each other; `None` when they were not looked for.
    #[serde(default)]
    pub self_intersections: Option<SelfIntersections>,
    /// Smallest and largest coordinates; `None` without a finite triangle.
    pub bounds: Option<[[f32; 3]; 2]>,
    /// Sum of the areas of all triangles.
    pub area: f64,
    /// Signed volume; means something only where closed and oriented.
    pub volume: f64,
    /// V − E + F, where the surface is closed and manifold.
    pub euler: Option<i64>,
    /// Counts that stopped at a bound are "at least"; their field names.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub at_least: Vec<String>,
}

/// Triangles that meet in more than a point, or edge along edge, beyond the corners they share. Exact.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SelfIntersections {
    /// Triangles in at least one pair.
    pub triangles: u64,
    /// Pairs that cross: they meet along a segment inside at least one of them.
    pub crossing_pairs: u64,
    /// Pairs that overlap: they lie in one plane and share an area.
    pub overlapping_pairs: u64,
    /// The pairs with the smallest record numbers, at most 100.
    pub listed: Vec<[u32; 2]>,
    /// More pairs of triangles come close to each other than are looked at: nothing was counted.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub given_up: bool,
}

impl SelfIntersections {
    /// Everything was looked at, and nothing found.
    pub fn is_free(&self) -> bool {
        self.triangles == 0 && !self.given_up
    }
}
