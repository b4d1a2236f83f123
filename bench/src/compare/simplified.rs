//! A mesh whose triangles were made fewer, and what that cost.

use serde::{Deserialize, Serialize};

use super::child::Cost;

/// Who makes triangles fewer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Simplifier {
    Suture,
    Pymeshlab,
    Meshlib,
    Meshoptimizer,
}

impl Simplifier {
    pub(super) const ALL: [Self; 4] = [Self::Suture, Self::Pymeshlab, Self::Meshlib, Self::Meshoptimizer];

    /// The Python package and the script of a peer.
    pub(super) fn peer(self) -> Option<(&'static str, &'static str)> {
        match self {
            Self::Suture => None,
            Self::Pymeshlab => Some(("pymeshlab", "simplify_pymeshlab.py")),
            Self::Meshlib => Some(("meshlib", "simplify_meshlib.py")),
            Self::Meshoptimizer => Some(("meshoptimizer", "simplify_meshoptimizer.py")),
        }
    }

    pub(super) fn name(self) -> &'static str {
        self.peer().map_or("suture", |(package, _)| package)
    }
}

/// One process over one mesh.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Simplified {
    /// The generated case.
    pub(crate) case: String,
    /// Triangles of the input.
    pub(crate) before: u64,
    /// Triangles that were asked for: of a peer, as many as suture left.
    pub(crate) asked: u64,
    pub(crate) tool: Simplifier,
    /// The memory that suture was told to use, if it was told any.
    #[serde(default)]
    pub(crate) memory: Option<String>,
    /// The program that ran.
    pub(crate) program: String,
    pub(crate) round: usize,
    pub(crate) cost: Cost,
    /// Triangles that were left.
    pub(crate) after: u64,
    /// Of the first round: how the result is.
    pub(crate) nearness: Option<Nearness>,
    /// Why there is no result.
    #[serde(default)]
    pub(crate) failure: String,
}

/// How near a result is to its input, in lengths of the input's diagonal, and whether it crosses itself.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Nearness {
    /// The greatest distance of a sample on either surface from the other.
    pub(crate) hausdorff: f64,
    /// The mean of these distances, root of squares.
    pub(crate) mean: f64,
    /// Samples on each surface.
    pub(crate) samples: u64,
    /// Pairs of triangles that cross or overlap.
    pub(crate) pairs: Option<u64>,
    /// Edges of only one triangle.
    pub(crate) boundary_edges: u64,
}

impl Simplified {
    /// Seconds of the work alone, without reading, judging and writing: by the program's own word.
    pub(super) fn core_seconds(&self) -> Option<f64> {
        self.cost.stage_seconds("simplify")
    }
}
