//! What stands for itself: the pieces of surface that are turned, removed or kept as a whole.

use super::work::Work;
use crate::submesh::components::{Components, Reversed, Through};
use crate::topology::survey::Survey;

/// The pieces of surface that stand for themselves: bodies that touch along an edge each for itself, what is closed only together, together.
/// O(patches + workshop).
pub(super) fn pieces(survey: &Survey<'_>, work: &mut Work<'_>, reversed: &Reversed) -> Components {
    let (shop, edges) = work.edges();
    let components = Components::of(survey, shop, edges, reversed, Through::ManifoldEdges);
    if !edges.any_nonmanifold() {
        return components;
    }
    Components::of(survey, shop, edges, reversed, Through::OpenSheets(&components))
}
