//! How near vertices are that become one.

/// How near is near.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// Never more than this.
    pub(crate) weld: f64,
    /// Nor than this share of the shortest edge at a vertex.
    pub(crate) edge_share: f64,
}

/// What hangs together is no wider than so many tolerances.
pub(super) const WIDEST: f64 = 4.0;
/// Cells in which vertices are looked for, in tolerances.
pub(super) const CELL: f64 = 2.0;
