//! Boundary loops recognised for what they are, before any is closed (after Yang et al., "Research on
//! repair method of shoe mould for 3D printing", Computer Science and Application 11(4), 2021, section 4.3).
//!
//! All loops are classified first, by a stated order: a loop whose sides touch is a crack, one whose sides lie near each other a gap, or
//! misaligned where they do not run alike; loops that meet in a vertex are nested; two that bound one missing ring are annular; a loop
//! inside another's opening makes both an island's; one that is flat when seen along an axis was lost to machining; the rest is
//! simple. Each rule's measure goes to the report beside the class.

pub(crate) mod loops;
mod nearest;
pub(crate) mod owners;
mod pairs;
mod shape;
mod sides;
#[cfg(test)]
mod tests;
pub(crate) mod unbalanced;

use std::collections::BTreeMap;

use glam::DVec3;

use crate::contract::report::{BoundaryLoop, BoundaryLoops, LoopClass, MOST_LISTED};
use crate::submesh::edges::Edges;
use crate::submesh::near::Tolerance;
use crate::submesh::{Submesh, Vertex};
use crate::util::parallel;
use loops::Loop;
use owners::Owners;
use shape::Shape;

/// Smallest share of a loop's projected area, seen along an axis, in that of a circle of its perimeter: below, it is a slit from there.
const MACHINING_SHARE: f64 = 0.02;
/// And largest share of its area that way, where it is largest: rounder loops are open to some side, and only folded by their symmetry.
const SLENDER_SHARE: f64 = 0.25;
/// How far the surface on both sides runs on across a loop (−1: all the way back over it) for its sides to have run past each other.
const PAST_EACH_OTHER: f64 = -0.5;
/// Then it is a slit below this share of a circle, since hills beside it tilt its sides, if its area where it is largest is below
/// [`PASSES_SHARE`].
const PASSES_MACHINING_SHARE: f64 = 0.16;
const PASSES_SHARE: f64 = 0.5;
/// Loops of fewer vertices are not zipped: there is nothing between their folds.
const FEWEST_FOLDED: usize = 6;
/// A slit is longer than wide by this.
const LENGTH: f64 = 2.0;
/// A loop is flat if it rises so little above its plane, measured by the plane's smaller extent.
const FLAT: f64 = 0.05;

/// The loops of a submesh for the report.
pub(crate) fn report(submesh: &Submesh, edges: &Edges, tolerance: &Tolerance, gap_share: f64) -> BoundaryLoops {
    let loops = loops::find(submesh, edges);
    let mut all = BoundaryLoops::default();
    for found in classify(submesh, edges, &loops, tolerance, gap_share) {
        *all.classes.entry(found.class).or_default() += 1;
        if all.listed.len() < MOST_LISTED {
            all.listed.push(found);
        }
    }
    all
}

/// What kinds of openings these boundary loops are, in their order; partners are places in it. `gap_share`: a gap is narrower than this
/// share of the edges beside it; 0: nothing is a gap. O(n log n) in the boundary.
pub(crate) fn classify(
    submesh: &Submesh,
    edges: &Edges,
    loops: &[Loop],
    tolerance: &Tolerance,
    gap_share: f64,
) -> impl Iterator<Item = BoundaryLoop> {
    // First, since it takes the most memory while it lasts.
    let sides = sides::measure(submesh, loops, tolerance, gap_share);
    let shapes: Vec<Shape> = loops.iter().map(|rim| shape_of(submesh, rim)).collect();
    let several = vertices_of_several(edges);
    let mut classes: Vec<Option<(LoopClass, String)>> = loops
        .iter()
        .zip(&sides)
        .map(|(rim, sides)| {
            if rim.branches {
                return Some((LoopClass::Simple, "it runs along non-manifold edges".into()));
            }
            sides.class().or_else(|| {
                let touching = rim.vertices.iter().filter(|v| several.binary_search(v).is_ok()).count();
                (touching > 0).then(|| (LoopClass::Nested, format!("it meets another loop in {touching} vertices")))
            })
        })
        .collect();
    let mut partners: Vec<Option<u32>> = sides.iter().map(|s| s.partner).collect();
    let free: Vec<u32> = (0..loops.len() as u32).filter(|i| classes[*i as usize].is_none()).collect();
    let mut distances: Vec<Option<f64>> = vec![None; loops.len()];
    for pair in pairs::find(&free, &shapes, &Owners::one(loops.len())) {
        let [outer, inner] = pair.loops.map(|i| i as usize);
        for (i, other) in [(outer, inner), (inner, outer)] {
            // An island's hole keeps what it was found to be first.
            if classes[i].is_none() {
                classes[i] = Some((pair.class, pair.rule.clone()));
                distances[i] = Some(pair.characteristic_distance);
                partners[i] = (pair.class != LoopClass::Island || i == inner).then_some(other as u32);
            }
        }
    }
    (0..loops.len()).map(move |i| {
        let (class, rule) = classes[i]
            .take()
            .or_else(|| machining(&shapes[i]))
            .unwrap_or_else(|| (LoopClass::Simple, "no other rule holds".into()));
        BoundaryLoop {
            class,
            rule,
            at: submesh.positions[loops[i].vertices[0] as usize],
            vertices: loops[i].vertices.len() as u64,
            perimeter: shapes[i].perimeter,
            area: shapes[i].area(),
            off_plane: shapes[i].off_plane,
            width: sides[i].width,
            characteristic_distance: distances[i],
            partner: partners[i],
        }
    })
}

/// Loops that belong together, by place.
#[derive(Debug, Default)]
pub(crate) struct Partners {
    /// The rims of missing rings.
    pub(crate) rings: Vec<[usize; 2]>,
    /// The outer rim of a wall whose end is missing, and the rims of several bores in it.
    pub(crate) bored: Vec<Vec<usize>>,
    /// Holes, each with the rim of an island that lies in it.
    pub(crate) islands: Vec<[usize; 2]>,
}

/// The shapes of some loops, to be asked several things.
pub(crate) struct Shapes(Vec<Shape>);

impl Shapes {
    /// O(vertices).
    pub(crate) fn of(submesh: &Submesh, loops: &[Loop], threads: usize) -> Self {
        Self(parallel::map(threads, loops.len(), |i| shape_of(submesh, &loops[i])))
    }

    /// The partners among the loops of these owners. O(n log n) in their vertices.
    pub(crate) fn partners(&self, owners: &Owners) -> Partners {
        let all: Vec<u32> = (0..self.0.len() as u32).collect();
        let mut partners = Partners::default();
        let mut groups: Vec<Vec<usize>> = Vec::new();
        let mut group_of: BTreeMap<usize, usize> = BTreeMap::new();
        for pair in pairs::find(&all, &self.0, owners) {
            let [outer, inner] = pair.loops.map(|i| i as usize);
            if pair.class == LoopClass::Island {
                partners.islands.push([outer, inner]);
            } else if let Some(group) = group_of.get(&outer) {
                groups[*group].push(inner);
            } else {
                group_of.insert(outer, groups.len());
                groups.push(vec![outer, inner]);
            }
        }
        for group in groups {
            match group[..] {
                [outer, inner] => partners.rings.push([outer, inner]),
                _ => partners.bored.push(group),
            }
        }
        partners
    }

    /// The other loops that a strip may lead to from this one though two caps have less area, the nearest first: of the same surface, alike, and the
    /// other way round. O(vertices).
    pub(crate) fn across(&self, of: usize, owners: &Owners) -> Vec<usize> {
        let others = (0..self.0.len()).filter(|other| *other != of && owners.are_same(of, *other));
        pairs::across(&self.0, of, others)
    }

    /// For each loop: would a flat patch continue the surface (1), stand on it (0), or lie back along it (−1)?
    pub(crate) fn continues(&self) -> impl Iterator<Item = f64> + '_ {
        self.0.iter().map(|shape| shape.continues)
    }
}

fn shape_of(submesh: &Submesh, rim: &Loop) -> Shape {
    let points: Vec<DVec3> = rim.vertices.iter().map(|v| submesh.place(*v)).collect();
    Shape::of(&points, rim.triangles.iter().map(|t| submesh.normal(*t)))
}

/// A slender loop that folds back on itself when seen along Z, X or Y, though it is not flat. The cutter's passes that made it
/// may have run on past each other, each into the other's side.
fn machining(shape: &Shape) -> Option<(LoopClass, String)> {
    let circle = shape.perimeter * shape.perimeter / (4.0 * std::f64::consts::PI);
    let [length, width, _] = shape.extents;
    if length <= LENGTH * width {
        return None;
    }
    let passes = shape.continues < PAST_EACH_OTHER;
    let (most, below) = if passes { (PASSES_SHARE, PASSES_MACHINING_SHARE) } else { (SLENDER_SHARE, MACHINING_SHARE) };
    if shape.off_plane <= FLAT * width || shape.area() >= most * circle {
        return None;
    }
    let seen = |axis: usize| shape.vector_area[axis].abs() / circle;
    // Of equal ones the first.
    let axis = [2, 0, 1].into_iter().min_by(|a, b| seen(*a).total_cmp(&seen(*b)))?;
    (seen(axis) < below).then(|| {
        let name = ["X", "Y", "Z"][axis];
        let past = if passes { "its sides run past each other; " } else { "" };
        (LoopClass::Machining, format!("{past}seen along {name}, its area is {:.4} of a circle's, below {below}", seen(axis)))
    })
}

/// The places where a loop lost to machining turns back: its ends along its length. `None` for any other loop. O(vertices).
pub(crate) fn folds(submesh: &Submesh, rim: &Loop) -> Option<[usize; 2]> {
    if rim.vertices.len() < FEWEST_FOLDED {
        return None;
    }
    let shape = shape_of(submesh, rim);
    machining(&shape)?;
    let farthest = |from: DVec3| {
        let away = |i: &usize| shape.points[*i].distance_squared(from);
        (0..shape.points.len()).min_by(|a, b| away(b).total_cmp(&away(a)))
    };
    let one = farthest(shape.centre)?;
    Some([one, farthest(shape.points[one])?]).filter(|[a, b]| a != b)
}

/// Vertices of more than two boundary edges, ascending.
fn vertices_of_several(edges: &Edges) -> Vec<Vertex> {
    let mut ends: Vec<Vertex> = edges.iter().filter(|e| e.is_boundary()).flat_map(|e| [e.low, e.high]).collect();
    ends.sort_unstable();
    ends.chunk_by(|a, b| a == b).filter(|same| same.len() > 2).map(|same| same[0]).collect()
}
