//! What there is to count on a triangle mesh. The generators predict these numbers, the judge finds them.

/// Defects of a mesh after its vertices were identified by exact f32 coordinates (−0.0 = 0.0).
///
/// Triangles with a repeated vertex are counted in `degenerate_index` and take part in nothing else.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "compare", derive(serde::Serialize, serde::Deserialize))]
pub struct Counts {
    /// Triangles with finite coordinates.
    pub triangles: u64,
    /// Triangles with a repeated vertex.
    pub degenerate_index: u64,
    /// Triangles of three distinct, exactly collinear vertices.
    pub degenerate_area: u64,
    /// Triangles whose vertex set an earlier triangle has, in whatever direction.
    pub duplicates: u64,
    /// Edges of one triangle.
    pub boundary_edges: u64,
    /// Connected sets of boundary edges.
    pub boundary_loops: u64,
    /// Edges of more than two triangles.
    pub nonmanifold_edges: u64,
    /// Vertices on a non-manifold edge, or whose triangles form more than one fan.
    pub nonmanifold_vertices: u64,
    /// Two-triangle edges that both triangles use in the same direction.
    pub inconsistent_edges: u64,
    /// Edges not used equally often in each direction; every boundary and every inconsistent edge is one.
    pub unbalanced_edges: u64,
    /// Sets of triangles connected through edges.
    pub components: u64,
}

impl Counts {
    /// No boundary edge, and something there.
    pub fn closed(&self) -> bool {
        self.triangles > self.degenerate_index && self.boundary_edges == 0
    }

    /// No non-manifold edge or vertex.
    pub fn manifold(&self) -> bool {
        self.nonmanifold_edges == 0 && self.nonmanifold_vertices == 0
    }

    /// Neighbours agree on what is outside.
    pub fn oriented(&self) -> bool {
        self.inconsistent_edges == 0 && self.unbalanced_edges == 0
    }
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.triangles += other.triangles;
        self.degenerate_index += other.degenerate_index;
        self.degenerate_area += other.degenerate_area;
        self.duplicates += other.duplicates;
        self.boundary_edges += other.boundary_edges;
        self.boundary_loops += other.boundary_loops;
        self.nonmanifold_edges += other.nonmanifold_edges;
        self.nonmanifold_vertices += other.nonmanifold_vertices;
        self.inconsistent_edges += other.inconsistent_edges;
        self.unbalanced_edges += other.unbalanced_edges;
        self.components += other.components;
    }
}
