//! A strip between two faces.

use super::super::feature::Kind;

/// A strip.
#[derive(Clone, Debug)]
pub(crate) struct Strip {
    pub(crate) segment: u32,
    /// The segments along its long rims.
    pub(crate) supports: [u32; 2],
    /// Half-edges of the long rims, on the strip's side; the strip's boundary runs: first rim, first end, second rim, second end.
    pub(crate) rims: [Vec<u32>; 2],
    /// Half-edges of the ends; none of rings.
    pub(crate) ends: [Vec<u32>; 2],
    pub(crate) kind: Kind,
    pub(crate) size: f64,
}
