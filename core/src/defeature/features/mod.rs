//! Features: small patches of segments whose rims lie on faces that go on beneath.
//!
//! **In:** a mesh and its segments. **Out:** candidates, each with its kind, place and size.
//! Three searches: behind inner loops of faces ([`inner`]), along concave edges ([`channels`]), between two faces ([`blends`]).

mod blends;
mod channels;
mod inner;
mod measure;
pub(crate) mod patch;
mod strip;

pub(crate) use patch::Candidate;

use super::feature::Limits;
use super::mesh::Mesh;
use super::segments::Segments;

/// Candidates below the limits: what lies within faces before channels, those before fillets and chamfers.
pub(crate) fn find(mesh: &Mesh, segments: &Segments, limits: &Limits) -> Vec<Candidate> {
    let pieces = inner::pieces(mesh, segments, limits.holes_below);
    let mut found: Vec<Candidate> = pieces.into_iter().filter_map(|piece| patch::classify(mesh, segments, piece)).collect();
    found.extend(channels::find(mesh, segments, limits));
    found.extend(blends::find(mesh, segments, limits));
    // What is as small as rounding is none.
    let least = 16.0 * mesh.flatness();
    found.retain(|candidate| candidate.size > least && limits.takes(candidate.kind, candidate.size));
    found
}
