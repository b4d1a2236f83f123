//! Two loops that belong together: the rims of a missing ring, or a hole and an island in it (METHODS C5, D; source S3).
//!
//! A patch over a missing ring leaves one rim and arrives at the other, so that the loops, each in its patch's direction, run opposite
//! ways round the same axis, while two holes side by side in one surface run the same way round. What remains is told by the surface
//! along the rims. Where the one is a hole in it and the smaller one the rim of a piece, the ring is missing from one surface; a plate's own rim around a
//! hole in the plate is the other way about. Where the one surface faces the axis and the other one away from it, they are the two skins
//! of a wall. Other rims of a ring look at each other; the two ends of a tube look away.

use glam::DVec3;

use super::shape::Shape;
use crate::boxes::BoxTree;
use crate::report::LoopClass;
use crate::sums::Bounds;

/// Cosine between the vector areas of loops that belong together, at most.
const OPPOSITE: f64 = -0.5;
/// Loops of a ring differ by less than this (S3): see [`characteristic_distance`].
const ANNULAR: f64 = 0.15;
/// Rims of a ring are no farther apart than so many radii of the larger one.
const FARTHEST: f64 = 3.0;
/// Rims are in one plane as long as they are no farther apart along its normal than this share of the larger one's radius.
const ONE_PLANE: f64 = 0.5;
/// How much more the larger rim is a hole in its surface than the other one is (2 in a plane, 0 on a tube), if the ring is missing from one
/// surface that slopes by no more than some 65° there.
const ONE_SURFACE: f64 = 0.8;
/// The same for an island, which may lie on the top of a dome.
const ISLAND_SURFACE: f64 = 0.5;
/// And how much less, at most: −2 is a plate's own rim around a hole in it.
const WASHER: f64 = -0.5;
/// How much both rims' surfaces go on across them, together, at most: holes in two bodies that face each other come to 2, the ends of a
/// tube to 0.
const FACING_HOLES: f64 = 1.0;
/// How far the surface along a rim faces the axis, or away from it, to be a skin.
const SKIN: f64 = 0.3;
/// Cosine between the vector areas of a hole and an island in it, at most: an island is small, and may lie on a slope.
const ISLAND_OPPOSITE: f64 = -0.2;
/// An island lies no farther from the plane of its hole than this share of the hole's size.
const OFF_PLANE: f64 = 0.75;
/// Points of a loop that distances are measured from, at most.
const MOST_POINTS: usize = 2048;

/// Two loops by number, the larger first.
pub(super) struct Pair {
    pub(super) loops: [u32; 2],
    pub(super) class: LoopClass,
    pub(super) rule: String,
    pub(super) characteristic_distance: f64,
}

/// The pairs among `free` loops: rings in one plane, islands, rings in two planes, each in the loops' order.
pub(super) fn find(free: &[u32], shapes: &[Shape]) -> Vec<Pair> {
    if free.len() < 2 {
        return Vec::new();
    }
    let shape = |place: usize| &shapes[free[place] as usize];
    let tree = BoxTree::new(&(0..free.len()).map(|i| bounds(shape(i), 0.0)).collect::<Vec<_>>());
    let mut found = Vec::new();
    let nearest: Vec<Option<usize>> = (0..free.len())
        .map(|i| {
            tree.meeting(&bounds(shape(i), FARTHEST * shape(i).radius()), &mut found);
            // Only of those that it can be a ring with: what else lies near is no reason to leave one open.
            let others = found.iter().map(|j| *j as usize).filter(|j| *j != i && ring(shape(i), shape(*j)).is_some());
            others
                .map(|j| (distance(shape(i), shape(j)), j))
                .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
                .map(|(_, j)| j)
        })
        .collect();
    let mut pairs = Vec::new();
    let mut taken = vec![false; free.len()];
    let take_rings = |wanted: LoopClass, taken: &mut [bool], pairs: &mut Vec<Pair>| {
        for (i, j) in
            nearest.iter().enumerate().filter_map(|(i, j)| j.filter(|j| *j > i && nearest[*j] == Some(i)).map(|j| (i, j)))
        {
            if let Some((class, apart)) = ring(shape(i), shape(j)).filter(|(class, _)| *class == wanted && !taken[i] && !taken[j])
            {
                (taken[i], taken[j]) = (true, true);
                let kind = if class == LoopClass::AnnularCoplanar { "one plane" } else { "two planes" };
                let rule = format!(
                    "faces the loop nearest to it, in {kind}; their characteristic distance {apart:.4} is below {ANNULAR}"
                );
                let larger_first = if shape(j).radius() > shape(i).radius() { [j, i] } else { [i, j] };
                pairs.push(Pair { loops: larger_first.map(|i| free[i]), class, rule, characteristic_distance: apart });
            }
        }
    };
    take_rings(LoopClass::AnnularCoplanar, &mut taken, &mut pairs);
    // A domed island stands out of its hole's box.
    let reaches: Vec<Bounds> = (0..free.len()).map(|i| bounds(shape(i), OFF_PLANE * shape(i).area().sqrt())).collect();
    let tree = BoxTree::new(&reaches);
    let mut with_islands = taken.clone();
    for inner in 0..free.len() {
        tree.meeting(&bounds(shape(inner), 0.0), &mut found);
        let holds = |outer: usize| {
            outer != inner
                && !taken[inner]
                && !taken[outer]
                && holds_island(shape(outer), shape(inner))
                && ring(shape(outer), shape(inner)).is_none()
        };
        let around = found.iter().map(|j| *j as usize).filter(|j| holds(*j));
        if let Some(outer) = around.min_by(|a, b| shape(*a).radius().total_cmp(&shape(*b).radius()).then(a.cmp(b))) {
            (with_islands[outer], with_islands[inner]) = (true, true);
            pairs.push(Pair {
                loops: [outer, inner].map(|i| free[i]),
                class: LoopClass::Island,
                rule: "one lies inside the other's opening and runs the other way round".into(),
                characteristic_distance: characteristic_distance(shape(outer), shape(inner)),
            });
        }
    }
    // Two holes may look at each other across a gap between bodies: one with an island in it is no end of a tube.
    take_rings(LoopClass::AnnularParallel, &mut with_islands, &mut pairs);
    pairs
}

/// The class and characteristic distance of two loops that bound a missing ring.
fn ring(a: &Shape, b: &Shape) -> Option<(LoopClass, f64)> {
    let apart = characteristic_distance(a, b);
    if !face(a, b, OPPOSITE) || apart >= ANNULAR || !a.surrounds(b.centre) || !b.surrounds(a.centre) {
        return None;
    }
    let (outer, inner) = if a.radius() < b.radius() { (b, a) } else { (a, b) };
    let way = inner.centre - outer.centre;
    let one_plane = way.dot(outer.normal).abs() <= ONE_PLANE * outer.radius();
    let one_surface = outer.continues - inner.continues;
    let skins = outer.outwards.abs().min(inner.outwards.abs()) >= SKIN && outer.outwards * inner.outwards < 0.0;
    if one_plane && (skins || (one_surface >= ONE_SURFACE && is_hole_around(outer, inner))) {
        return Some((LoopClass::AnnularCoplanar, apart));
    }
    let look_at_each_other = outer.vector_area.dot(way) > 0.0 && inner.vector_area.dot(way) < 0.0;
    let holes = outer.continues + inner.continues > FACING_HOLES;
    (one_surface > WASHER && look_at_each_other && !holes).then_some((LoopClass::AnnularParallel, apart))
}

/// The one is a hole in a surface, the other the rim of a piece.
fn is_hole_around(outer: &Shape, inner: &Shape) -> bool {
    outer.continues > 0.0 && inner.continues < 0.0
}

fn holds_island(outer: &Shape, inner: &Shape) -> bool {
    face(outer, inner, ISLAND_OPPOSITE)
        && is_hole_around(outer, inner)
        && outer.continues - inner.continues >= ISLAND_SURFACE
        && outer.radius() > inner.radius()
        && (inner.centre - outer.centre).dot(outer.normal).abs() <= OFF_PLANE * outer.area().sqrt()
        && outer.surrounds(inner.centre)
}

/// Run opposite ways round.
fn face(a: &Shape, b: &Shape, opposite: f64) -> bool {
    crate::shop::cosine(a.vector_area, b.vector_area) <= opposite
}

/// How much two loops differ: by their extents, as a share of the larger one, and by the directions of their planes. (The formula of S3 is
/// lost. The cube lets the paper's threshold lie where one loop is about half the other: rings are closer in size, islands are not.)
fn characteristic_distance(a: &Shape, b: &Shape) -> f64 {
    let size = a.radius().max(b.radius()).max(f64::MIN_POSITIVE);
    let extents = (DVec3::from_array(a.extents) - DVec3::from_array(b.extents)).length() / size;
    extents * extents * extents + 1.0 - a.normal.dot(b.normal).abs()
}

/// Between the nearest of their vertices, or of every few if there are very many.
fn distance(a: &Shape, b: &Shape) -> f64 {
    let some = |shape: &Shape| -> Vec<DVec3> {
        shape.points.iter().step_by(shape.points.len().div_ceil(MOST_POINTS)).copied().collect()
    };
    let others = some(b);
    let to_others = |p: &DVec3| others.iter().map(|q| p.distance_squared(*q)).fold(f64::INFINITY, f64::min);
    some(a).iter().map(to_others).fold(f64::INFINITY, f64::min).sqrt()
}

fn bounds(shape: &Shape, by: f64) -> Bounds {
    let points: Vec<[f32; 3]> = shape.points.iter().map(|p| p.as_vec3().to_array()).collect();
    crate::shop::near::around(&points, by)
}
