//! Hubs whose triangles cannot meet beyond what they share, recognised in O(n log n), whether their fan is closed or not.
//!
//! Let v be a vertex, and d any vector. Look at the triangles around v along d.
//!
//! 1. A triangle whose normal is not upright on d is seen as a sector at v of less than half a turn, from one of its two other corners to
//!    the other, counter-clockwise; which of them is first does not depend on how the triangle is oriented, but on how it is seen.
//! 2. Take the half line h from v that is upright on d and on some e that is upright on d, too: counter-clockwise behind it
//!    is e·x > 0, before it e·x < 0. If no corner has e·x = 0, each has an angle from h between none and a whole turn, and that of p is less than
//!    that of q when e·p > 0 > e·q, or when both have the same sign and p comes before q by less than half a turn. A sector holds h
//!    exactly when it begins with e·x < 0 and ends with e·x > 0.
//! 3. Put the sectors in the order of the angles of their beginnings. If none but the last holds h, and each ends at the vertex with
//!    which the next begins, or at a smaller angle than it (and the last, if it holds h, at the vertex with which the first begins,
//!    or at a smaller angle), then the sectors are disjoint, and any two of them have a half line in common only where
//!    one begins with the vertex with which the other ends.
//! 4. What lies over a point of a sector belongs to one point of its triangle at most. So triangles of sectors without a common
//!    half line meet in v only, and others meet over that half line, where each has nothing but the edge from v to that vertex, which both have.
//!
//! So **no two triangles around a certified hub meet beyond what they share**. Nothing needs to be known of the hub: there may be gaps in its
//! fan, there may be several fans, and triangles that are turned over. The order is only tried: it is computed with rounding, and 3 is
//! proved with signs that are safe. These are computed in f64 with the bounds of [`super::stars`], where ε = 2⁻⁵³: coordinates differ by f64 with a relative error of ε, too. d is the area of the
//! fan, the sum of its areas as vectors, or else a direction that [`upward()`] finds.

use super::real::{Real, cross, dot, minus};
use super::upward::{unit, upward};
use super::view::CellView;

/// A triangle around a hub.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Spoke {
    /// The hub's place among those that are looked at.
    hub: u32,
    triangle: u32,
}

/// A triangle around a hub as it is seen.
#[derive(Clone, Copy, Debug)]
struct Sector {
    /// It goes counter-clockwise from this vertex to that.
    ends: [u32; 2],
    /// Grows with the angle at which it begins.
    order: f64,
}

/// Bytes that a look takes for each triangle, at most: it may have three hubs, which are looked at one after the other.
pub(super) const BYTES_PER_TRIANGLE: u64 = (3 * size_of::<Spoke>() + size_of::<[f32; 3]>() + size_of::<Sector>()) as u64;

/// Looks at the vertices `hubs`, which ascend; returns which of them are certified. O(triangles + n log n) for n triangles around them.
pub(super) fn look(view: &CellView<'_>, hubs: &[u32]) -> Vec<bool> {
    let of = |(triangle, t): (u32, [u32; 3])| {
        let places = t.map(|v| hubs.binary_search(&v).ok());
        places.into_iter().flatten().map(move |hub| Spoke { hub: hub as u32, triangle })
    };
    let mut spokes = Vec::with_capacity(view.solid_triangles().flat_map(of).count());
    spokes.extend(view.solid_triangles().flat_map(of));
    spokes.sort_unstable();
    let mut certified = vec![true; hubs.len()];
    for spokes in spokes.chunk_by(|a, b| a.hub == b.hub) {
        let hub = spokes[0].hub as usize;
        certified[hub] = is_certified(view, hubs[hub], spokes);
    }
    certified
}

/// Tries the direction of all its area, and then one that is looked for.
fn is_certified(view: &CellView<'_>, hub: u32, spokes: &[Spoke]) -> bool {
    let at = view.positions[hub as usize].map(f64::from);
    let areas = spokes.iter().map(|spoke| {
        let [next, previous] = others(view, hub, *spoke).map(|v| minus(view.positions[v as usize].map(f64::from), at));
        cross(next, previous)
    });
    let area = areas.clone().fold([0.0; 3], |sum, n| [sum[0] + n[0], sum[1] + n[1], sum[2] + n[2]]);
    let Some(along) = unit(area) else { return false };
    let mut sectors = Vec::with_capacity(spokes.len());
    let mut tells_apart = |along| Eye::new(view, hub, along).tells_apart(view, spokes, &mut sectors);
    if tells_apart(along) {
        return true;
    }
    let normals: Option<Vec<[f32; 3]>> = areas.map(|area| Some(unit(area)?.map(|x| x as f32))).collect();
    normals.and_then(|normals| upward(&normals, area)).is_some_and(tells_apart)
}

/// The other corners of a triangle around a hub, in its order.
fn others(view: &CellView<'_>, hub: u32, spoke: Spoke) -> [u32; 2] {
    let [a, b, c] = view.triangles[spoke.triangle as usize];
    if a == hub {
        [b, c]
    } else if b == hub {
        [c, a]
    } else {
        [a, b]
    }
}

/// How a hub is looked at.
struct Eye {
    hub: u32,
    at: [f64; 3],
    /// d, e, and the direction of h.
    along: [f64; 3],
    side: [f64; 3],
    line: [f64; 3],
    /// The bound of an error, for vectors of length 1: infinite where e could have underflowed.
    error: f64,
}

impl Eye {
    fn new(view: &CellView<'_>, hub: u32, along: [f64; 3]) -> Self {
        let at = view.positions[hub as usize].map(f64::from);
        let size = along[0].size().max(along[1].size()).max(along[2].size());
        let error = if size > f64::SHORTEST { size * f64::ERROR } else { f64::INFINITY };
        let side = cross(along, f64::LINE);
        Self { hub, at, along, side, line: cross(side, along), error }
    }

    /// Are the triangles seen as disjoint sectors? `false` if that is not sure.
    fn tells_apart(&self, view: &CellView<'_>, spokes: &[Spoke], sectors: &mut Vec<Sector>) -> bool {
        sectors.clear();
        for spoke in spokes {
            let Some(sector) = self.sector(view, others(view, self.hub, *spoke)) else { return false };
            sectors.push(sector);
        }
        // Two that begin at the same place are not disjoint, whichever is first.
        sectors.sort_unstable_by(|a, b| a.order.total_cmp(&b.order).then(a.ends.cmp(&b.ends)));
        self.are_disjoint(view, sectors)
    }

    fn way(&self, view: &CellView<'_>, to: u32) -> [f64; 3] {
        minus(view.positions[to as usize].map(f64::from), self.at)
    }

    /// Is it counter-clockwise from one way to the other, by less than half a turn?
    fn is_before(&self, from: [f64; 3], to: [f64; 3]) -> Option<bool> {
        let area = length(from) * length(to);
        (area * f64::ERROR > f64::SMALLEST).then(|| safe(dot(cross(from, to), self.along), area * self.error)).flatten()
    }

    /// Is e·x positive?
    fn is_behind_line(&self, way: [f64; 3]) -> Option<bool> {
        safe(dot(way, self.side), length(way) * self.error)
    }

    /// How a triangle of the hub and two others is seen.
    fn sector(&self, view: &CellView<'_>, mut ends: [u32; 2]) -> Option<Sector> {
        let mut ways = ends.map(|v| self.way(view, v));
        if !self.is_before(ways[0], ways[1])? {
            ends.reverse();
            ways.reverse();
        }
        let begin = self.is_behind_line(ways[0])?;
        self.is_behind_line(ways[1])?;
        // The cotangent falls over each half turn; what it is then put into grows.
        let cotangent = dot(ways[0], self.line) / dot(ways[0], self.side);
        let within = -cotangent / (1.0 + cotangent.size());
        Some(Sector { ends, order: if begin { within } else { within + 2.0 } })
    }

    /// Is the angle from h to one way smaller than that to the other?
    fn is_smaller(&self, way: [f64; 3], other: [f64; 3]) -> Option<bool> {
        match [self.is_behind_line(way)?, self.is_behind_line(other)?] {
            [true, false] => Some(true),
            [false, true] => Some(false),
            _ => self.is_before(way, other),
        }
    }

    /// Are the sectors disjoint, in the order of their beginnings, at least one? `false` if that is not sure.
    fn are_disjoint(&self, view: &CellView<'_>, sectors: &[Sector]) -> bool {
        let follows = |of: &Sector, next: &Sector| {
            let (end, begin) = (of.ends[1], next.ends[0]);
            end == begin || self.is_smaller(self.way(view, end), self.way(view, begin)) == Some(true)
        };
        let holds_line =
            |sector: &Sector| sector.ends.map(|v| self.is_behind_line(self.way(view, v))) == [Some(false), Some(true)];
        let Some((last, others)) = sectors.split_last() else { return true };
        !others.iter().any(holds_line)
            && sectors.array_windows().all(|[a, b]| follows(a, b))
            && (!holds_line(last) || follows(last, &sectors[0]))
    }
}

fn length(way: [f64; 3]) -> f64 {
    way[0].size() + way[1].size() + way[2].size()
}

/// Whether a number is positive, if that is sure. What may have underflowed is too small for the bound to be a normal number.
fn safe(number: f64, bound: f64) -> Option<bool> {
    (number.size() > bound && number.size() <= f64::LARGEST && bound > f64::SMALLEST).then_some(number > 0.0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::collinear::is_collinear;
    use crate::geometry::tri_tri::triangles_cross;
    use crate::stream::plan::HomeBox;
    use crate::topology::intersect::Standing;

    fn with_view<T>(positions: &[[f32; 3]], triangles: &[[u32; 3]], then: impl FnOnce(&CellView<'_>) -> T) -> T {
        let standing = vec![Standing::Irregular; positions.len()];
        then(&CellView { positions, triangles, left_out: &[], standing: &standing, cell: HomeBox::ALL })
    }

    /// Whether vertex 0 is certified; the first corner of all triangles.
    fn is_certified(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> bool {
        with_view(positions, triangles, |view| look(view, &[0])[0])
    }

    /// Whether it is along this direction.
    fn is_certified_along(positions: &[[f32; 3]], triangles: &[[u32; 3]], d: [f32; 3]) -> bool {
        let spokes: Vec<Spoke> = (0..triangles.len() as u32).map(|triangle| Spoke { hub: 0, triangle }).collect();
        with_view(positions, triangles, |view| Eye::new(view, 0, d.map(f64::from)).tells_apart(view, &spokes, &mut Vec::new()))
    }

    /// Triangles around a tip from each vertex of a helix to the next, `steps` to a turn, and the helix.
    fn helix(count: usize, steps: usize, rise: f32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let at = |i: usize| {
            let angle = i as f64 / steps as f64 * std::f64::consts::TAU;
            [9.0 * angle.cos() as f32, 9.0 * angle.sin() as f32, rise * i as f32]
        };
        let positions = std::iter::once([0.25, 0.5, 20.0]).chain((0..=count).map(at)).collect();
        (positions, (1..=count as u32).map(|i| [0, i, i + 1]).collect())
    }

    const UP: [f32; 3] = [0.125, 0.25, 1.0];

    #[test]
    fn fans_with_gaps_are_certified() {
        for steps in [5, 300, 20_000] {
            // Up to a whole turn but for one step, and more.
            for (count, wanted) in
                [(steps / 4, true), (steps / 2, true), (steps - 1, true), (3 * steps / 2, false), (2 * steps - 1, false)]
            {
                let (positions, triangles) = helix(count, steps, 1.0 / 4096.0);
                assert_eq!(is_certified(&positions, &triangles), wanted, "{count} of {steps}");
            }
            // A closed fan, of which some triangles are missing and others are turned over.
            let (positions, mut triangles) = helix(steps, steps, 0.0);
            triangles[steps - 1][2] = 1;
            assert!(is_certified_along(&positions, &triangles, UP));
            let mut some: Vec<[u32; 3]> = triangles.iter().copied().filter(|t| t[1] % 3 != 0).collect();
            some.iter_mut().step_by(5).for_each(|t| t.swap(1, 2));
            some.rotate_left(steps / 3);
            assert!(is_certified_along(&positions, &some, UP));
            // One of them twice.
            some.push(some[0]);
            assert!(!is_certified_along(&positions, &some, UP));
        }
    }

    /// A rim that runs to and fro, so that few directions see all triangles from one side: neither the area nor the sum of the normals
    /// is one.
    #[test]
    fn jagged_fans_are_certified() {
        let steps = 40_000;
        let (mut positions, mut triangles) = helix(steps - 1, steps, 0.0);
        positions[0] = [0.0, 0.0, 20.0];
        for (i, p) in positions.iter_mut().enumerate().skip(1) {
            let (wave, noise) = ((i % 64) as f32, (i * 7919 % 1009) as f32 / 1009.0);
            let radius = 3.0 + wave.min(64.0 - wave) / 40.0;
            *p = [p[0] * radius, p[1] * radius, noise];
        }
        assert!(is_certified(&positions, &triangles), "open");
        triangles.push([0, steps as u32, 1]);
        assert!(is_certified(&positions, &triangles), "closed");
        assert!(!is_certified_along(&positions, &triangles, UP));
    }

    #[test]
    fn what_is_seen_edge_on_is_not() {
        let (positions, triangles) = helix(7, 8, 0.0);
        assert!(!is_certified_along(&positions, &triangles, [1.0, 0.0, 0.0]), "seen from both sides");
        assert!(!is_certified_along(&positions, &triangles, [0.0; 3]));
        let flat: Vec<[f32; 3]> = positions.iter().map(|p| [p[0], 0.0, p[2]]).collect();
        assert!(!is_certified_along(&flat, &triangles, [0.0, 0.0, 1.0]));
    }

    proptest! {
        /// Any triangles around a vertex, along any direction: no two that are certified meet beyond what they share.
        #[test]
        fn certified_triangles_do_not_meet(
            corners in prop::collection::vec(prop::array::uniform3(-5..6_i8), 2..9),
            pairs in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 1..9),
            d in prop::array::uniform3(-4..5_i8),
            scale in prop::sample::select(vec![1.0_f32, 1e-40, 3e37, 1e-20]),
        ) {
            let mut positions = vec![[0.0_f32; 3]];
            for p in corners.iter().map(|p| p.map(|c| f32::from(c) * scale)) {
                if !positions.contains(&p) {
                    positions.push(p);
                }
            }
            let corner = |i: &prop::sample::Index| i.index(positions.len()) as u32;
            let triangles: Vec<[u32; 3]> = pairs.iter().map(|(a, b)| [0, corner(a), corner(b)]).filter(|[o, a, b]| {
                let [o, a, b] = [o, a, b].map(|v| positions[*v as usize]);
                o != a && o != b && a != b && !is_collinear(&o, &a, &b)
            }).collect();
            if is_certified(&positions, &triangles) || is_certified_along(&positions, &triangles, d.map(f32::from)) {
                let at = |t: [u32; 3]| t.map(|v| positions[v as usize]);
                for (i, s) in triangles.iter().enumerate() {
                    for t in &triangles[i + 1..] {
                        prop_assert!(!triangles_cross(&at(*s), &at(*t)).is_crossing(), "{:?} {:?}", at(*s), at(*t));
                    }
                }
            }
        }
    }
}
