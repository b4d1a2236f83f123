//! A mesh, and the residue that is found on it.

/// A mesh that is looked at: places of vertices in millimetres, and triangles by numbers of vertices.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    /// Places of vertices.
    pub points: &'a [[f32; 3]],
    /// Triangles, counter-clockwise seen from outside.
    pub faces: &'a [[u32; 3]],
}

impl Mesh<'_> {
    pub(super) fn corners(&self, face: &[u32; 3]) -> [[f64; 3]; 3] {
        face.map(|vertex| self.points.get(vertex as usize).map_or([0.0; 3], |point| point.map(f64::from)))
    }

    /// The centre of a triangle.
    pub(super) fn middle(&self, face: &[u32; 3]) -> [f64; 3] {
        let [a, b, c] = self.corners(face);
        [0, 1, 2].map(|axis: usize| (a[axis] + b[axis] + c[axis]) / 3.0)
    }
}

/// The form of residue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Passes follow each other along the tool's axis: steps of a wall.
    Stairs,
    /// Passes lie beside each other: waves of a floor.
    Ripples,
}

/// A region of residue.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionReport {
    /// Its form.
    pub kind: Kind,
    /// The part of its area that speaks for that form, between 0 and 1.
    pub confidence: f64,
    /// Height above the intended surface that 98 % of its vertices do not exceed, in millimetres.
    pub height: f64,
    /// Median of the distance of neighbouring passes, in millimetres.
    pub pitch: f64,
    /// In square millimetres.
    pub area: f64,
    /// How many triangles it has.
    pub triangles: usize,
}

/// How well the tool path fits the mesh: a mesh that was cut along the path has no vertex within what the tool swept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Fit {
    /// Vertices on the boundary of the swept volume, within the tolerance.
    pub touched: usize,
    /// Vertices within the swept volume: the tool should have cut them away.
    pub uncut: usize,
}

impl Fit {
    pub(super) fn and(self, other: Self) -> Self {
        Self { touched: self.touched + other.touched, uncut: self.uncut + other.uncut }
    }

    /// How many vertices the tool reaches.
    #[must_use]
    pub fn reached(self) -> usize {
        self.touched + self.uncut
    }

    /// Of the vertices that the tool reaches, the share that lies where it left the material; 0 if it reaches none.
    #[must_use]
    pub fn share(self) -> f64 {
        self.touched as f64 / self.reached().max(1) as f64
    }
}

/// Residue that was found.
#[derive(Clone, Debug)]
pub struct Found {
    /// For each triangle the number of its region; `u32::MAX` of one that is no residue's.
    pub labels: Vec<u32>,
    /// For each vertex its place on the intended surface; not a number where none is known.
    pub targets: Vec<[f32; 3]>,
    /// Regions, in the order of their first triangles.
    pub regions: Vec<RegionReport>,
    /// How well the path fits the mesh.
    pub fit: Fit,
}
