//! Patches that make one body of two, for a person to look at.

use super::closing::Closing;
use crate::detect::holes::loops::Loop;
use crate::repairs::shared::unsaid;
use crate::submesh::Submesh;
use crate::util::words::{At, Short};

/// What is said of two bodies that a strip was put in between.
pub(crate) fn bridged(submesh: &Submesh, rims: [&Loop; 2]) -> String {
    let first = |rim: &Loop| submesh.place(rim.vertices[0]);
    let (from, others) = (first(rims[0]), &rims[1].vertices);
    let apart = others.iter().map(|v| submesh.place(*v).distance(from)).fold(f64::INFINITY, f64::min);
    let (at, apart) = (At(submesh.positions[rims[0].vertices[0] as usize]), Short(apart));
    format!(
        "two bodies were joined by a strip at {at}, over {apart}: each could also be closed by itself; see whether they were one"
    )
}

/// Places that are named, at most.
const MOST_NAMED: usize = 5;

/// The doubts, the last of very many as their number.
pub(crate) fn summed_up(doubts: Vec<String>) -> Vec<String> {
    unsaid::first(doubts, MOST_NAMED, |more| format!("and at {more} places more, two bodies were made one"))
}

impl Closing<'_> {
    /// Says of a patch that is to be cut along another body, which its own one did not meet before, that it makes one of both, unless one is a detail: as its patches
    /// were found to when others were tried.
    pub(crate) fn doubt_across(&mut self, submesh: &Submesh, rim: u32) {
        let tried = self.placed.iter().filter(|patch| patch.rims.contains(&rim));
        if tried.flat_map(|patch| &patch.obstacles).any(|obstacle| obstacle.joins_large) {
            let rim = self.rim(rim);
            let (at, length) = (At(submesh.positions[rim.vertices[0] as usize]), Short(rim.perimeter(submesh)));
            self.doubts.push(format!(
                "the patch over a hole at {at}, {length} around, runs into another body, which becomes one with its own: see whether it should"
            ));
        }
    }
}
