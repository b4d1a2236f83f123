//! Options of a search and of a repair, and why they fail.

/// A closed box, by its least and its greatest corner, in millimetres.
pub type Region = [[f64; 3]; 2];

/// How residue is found and repaired; lengths in millimetres.
#[derive(Clone)]
#[non_exhaustive]
pub struct Options<'a> {
    /// How far vertices of a cut surface may be from the swept volume, beside the scallop's height; by default 0.0002 times the tool's
    /// radius and the rounding of coordinates.
    pub tolerance: Option<f64>,
    /// Greatest height of a scallop; by default a quarter of the tool's radius.
    pub height_max: Option<f64>,
    /// Least height of a scallop; by default four times the tolerance.
    pub height_min: Option<f64>,
    /// Triangles of a region, at least; smaller ones are dropped, and smaller gaps within a region are filled.
    pub count_min: usize,
    /// Edges whose triangles turn by more degrees are features, and stay, if they still do so on the intended surface.
    pub feature_degrees: f64,
    /// Corrections by hand.
    pub corrections: Corrections<'a>,
    /// Whether to go on; asked at least every second.
    pub go_on: &'a (dyn Fn() -> bool + Sync),
}

/// Corrections of what is found, in the order of the fields: a later one counts more.
#[derive(Clone, Copy, Debug, Default)]
pub struct Corrections<'a> {
    /// Triangles with their centre in one of these boxes are residue's.
    pub include: &'a [Region],
    /// Triangles with their centre in one of these boxes are not.
    pub exclude: &'a [Region],
    /// Numbers of triangles that are residue's.
    pub triangles: &'a [u32],
    /// For each triangle, whether it may be residue's; none if it is empty.
    pub mask: &'a [bool],
}

impl Default for Options<'_> {
    fn default() -> Self {
        Self {
            tolerance: None,
            height_max: None,
            height_min: None,
            count_min: 16,
            feature_degrees: 40.0,
            corrections: Corrections::default(),
            go_on: &|| true,
        }
    }
}

/// Why residue is not found or not repaired.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A tool that cuts is not described, or its measures make no solid.
    #[error("tool {0} cuts, and its form and size are not known")]
    Tool(u32),
    /// Nothing cuts.
    #[error("the tool path has no cutting move")]
    NoCuts,
    /// A triangle names a vertex that is not there, or a coordinate is no number.
    #[error("triangle {0} names a vertex that is not there, or that has no place")]
    Vertex(usize),
    /// A list of corrections does not fit the mesh.
    #[error("the mask has {mask} entries, the mesh has {faces} triangles")]
    Mask {
        /// Entries of the mask.
        mask: usize,
        /// Triangles of the mesh.
        faces: usize,
    },
    /// The caller wants no more.
    #[error("stopped")]
    Stopped,
}
