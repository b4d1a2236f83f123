//! Whether a shaped patch is valid, exactly.

use super::coarse::{CoarsePatch, Shaped};
use super::sheet::{edges, sorted};
use crate::geometry::exact::collinear;
use crate::geometry::position::Position;
use crate::geometry::self_crossing::{SelfCrossing, crossing_of_first};
use crate::geometry::tri_tri::Triangle;

/// Finite and distinct positions; no triangle without area; with the triangles around, no edge with more than two triangles or two that
/// disagree; no triangle of the patch crosses or overlaps another, or one around. O(n log n).
pub(super) fn is_valid(coarse: &CoarsePatch<'_>, shaped: &Shaped) -> bool {
    let first = coarse.positions.len();
    let position = |v: u32| if (v as usize) < first { coarse.positions[v as usize] } else { shaped.added[v as usize - first] };
    let own = shaped.triangles.iter().map(|t| t.map(position));
    let others = coarse.around.iter().map(|t| t.map(position));
    let all: Vec<Triangle> = own.chain(others).collect();
    let own = &all[..shaped.triangles.len()];
    shaped.added.iter().flatten().all(|x| x.is_finite())
        && new_positions(coarse, shaped)
        && own.iter().all(|[a, b, c]| !collinear(a, b, c))
        && is_manifold(coarse, shaped)
        && crossing_of_first(&all, own.len(), 2_000_000 + 500 * all.len() as u64) == SelfCrossing::None
}

/// Does no new vertex lie where another vertex of patch or surroundings is?
fn new_positions(coarse: &CoarsePatch<'_>, shaped: &Shaped) -> bool {
    let mut all: Vec<(Position, bool)> = coarse.positions.iter().map(|p| (Position::of(*p), false)).collect();
    all.extend(shaped.added.iter().map(|p| (Position::of(*p), true)));
    all.sort_unstable();
    all.windows(2).all(|w| w[0].0 != w[1].0 || !(w[0].1 || w[1].1))
}

/// Are all edges of the patch used once each way, counting those of the triangles around that are edges of the patch, and is the border
/// still the coarse patch's?
fn is_manifold(coarse: &CoarsePatch<'_>, shaped: &Shaped) -> bool {
    // Which triangles: 0 the shaped patch's, 1 the coarse patch's, 2 those around.
    let mut sides: Vec<([u32; 2], u8, bool)> = Vec::new();
    for (which, triangles) in [&shaped.triangles[..], coarse.patch, coarse.around].into_iter().enumerate() {
        sides.extend(triangles.iter().flat_map(|t| edges(*t)).map(|e| (sorted(e), which as u8, e[0] < e[1])));
    }
    sides.sort_unstable();
    sides.chunk_by(|a, b| a.0 == b.0).all(|same| {
        let of = |which: u8| same.iter().filter(move |s| s.1 == which).map(|s| s.2);
        let (own, coarse, around) = (of(0).count(), of(1).count(), of(2).count());
        match own {
            0 => coarse != 1,
            1 => coarse == 1 && of(0).eq(of(1)) && around <= 1 && of(0).ne(of(2)),
            2 => around == 0 && of(0).next() != of(0).nth(1),
            _ => false,
        }
    })
}
