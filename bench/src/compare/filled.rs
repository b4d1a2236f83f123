//! The cost of filling a network of curves, and the quality of its triangles.

use serde::{Deserialize, Serialize};

use super::child::Cost;

/// One process of `suture fill-curves`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Filled {
    /// The name of the network's shape.
    pub(crate) shape: String,
    pub(crate) curves: u64,
    pub(crate) loops: u64,
    /// The program that ran.
    pub(crate) program: String,
    pub(crate) round: usize,
    pub(crate) cost: Cost,
    pub(crate) triangles: u64,
    /// The mean of twice the inradius over the circumradius.
    pub(crate) mean: f64,
    /// Triangles of which that is below 0.4.
    pub(crate) below: u64,
}
