//! Features: small patches of segments whose rims lie on faces that go on beneath.
//!
//! **In:** a mesh and its segments. **Out:** candidates, each with its kind, place and size.
//! Four searches: behind inner loops of faces ([`inner`]), by walls of holes ([`bores`]), along concave edges ([`channels`]), between two
//! faces ([`blends`]).

mod blends;
mod bores;
mod channels;
mod inner;
mod measure;
pub(crate) mod patch;
mod strip;

pub(crate) use patch::{Candidate, Entry};

use super::feature::Limits;
use super::mesh::Mesh;
use super::segments::Segments;

/// Candidates below the limits: what lies within faces before channels, those before fillets and chamfers.
pub(crate) fn find(mesh: &Mesh, segments: &Segments, limits: &Limits) -> Vec<Candidate> {
    let pieces = inner::pieces(mesh, segments, limits.holes_below);
    let mut found: Vec<Candidate> = pieces.into_iter().filter_map(|piece| patch::classify(mesh, segments, piece)).collect();
    // A bore whose head is too wide to go is none by itself.
    found.retain(|candidate| candidate.entry.kind.is_hole() || limits.takes(candidate.entry.kind, candidate.entry.size));
    found.extend(bores::find(mesh, segments, limits, &found));
    found.extend(channels::find(mesh, segments, limits));
    found.extend(blends::find(mesh, segments, limits));
    // What is as small as rounding is none.
    let least = 16.0 * mesh.flatness();
    found.retain(|candidate| candidate.entry.size > least && limits.takes(candidate.entry.kind, candidate.entry.size));
    found
}
