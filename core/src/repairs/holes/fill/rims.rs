//! Rims of holes, as those see them that judge patches.

use glam::DVec3;

use crate::algorithms::triangulate;
use crate::detect::holes::loops::Loop;
use crate::geometry::distance::nearest_of_segment;
use crate::geometry::flatness;
use crate::submesh::{Submesh, Vertex};

/// How much the surface goes on across a hole's rim, at least, for the hole to be one in flat surface.
pub(super) const HOLE: f64 = 0.7;
/// Outlines of what is drilled agree, seen along the axis, as well as circles of ten facets do: as a share of the radius.
pub(super) const DRILLED: f64 = 0.05;
/// Points of a rim that are held against the other one, at most.
const MOST_POINTS: usize = 2048;
/// How much the surface goes on across a rim, at most, where the whole of it ends: at the end of a tube, a beam or a rib.
pub(super) const END: f64 = 0.5;
/// Sine of the turn at a corner: a circle of ten facets has none.
const CORNER: f64 = 0.6;
/// Edges that go on across a hole, or walls from a mouth to one that faces it, are told if they would change a body by more than this share.
pub(super) const GOES_ON: f64 = 0.003;

/// Does each of two loops lie on the other one, seen along the axis of the first?
pub(super) fn lies_on(submesh: &Submesh, rims: [&Loop; 2]) -> bool {
    let across = axis(submesh, rims[0]);
    let along = across.normalize_or_zero();
    let reach = DRILLED * (across.length() / std::f64::consts::PI).sqrt();
    let seen = |v: Vertex| submesh.place(v) - along * submesh.place(v).dot(along);
    let is_near = |p: DVec3, other: &Loop| {
        let n = other.vertices.len();
        let ends = |i: usize| [i, (i + 1) % n].map(|i| seen(other.vertices[i]));
        (0..n).map(ends).any(|[a, b]| nearest_of_segment(a, b, p).distance(p) <= reach)
    };
    [[0, 1], [1, 0]].map(|pair| pair.map(|k| rims[k])).iter().all(|[a, b]| {
        let every = a.vertices.len().div_ceil(MOST_POINTS);
        a.vertices.iter().step_by(every).all(|v| is_near(seen(*v), b))
    })
}

/// How much the surface goes on across a rim: 1 where it is a hole in a plane, 0 where walls stand on it.
pub(super) fn goes_on(submesh: &Submesh, rim: &Loop) -> f64 {
    let n = rim.vertices.len();
    let normal = axis(submesh, rim).normalize_or_zero();
    let along = |i: usize| submesh.distance(rim.vertices[i], rim.vertices[(i + 1) % n]);
    let sum: f64 = (0..n).map(|i| submesh.normal(rim.triangles[i]).normalize_or_zero().dot(normal) * along(i)).sum();
    sum / rim.perimeter(submesh).max(f64::MIN_POSITIVE)
}

/// The middle of a loop's vertices.
pub(super) fn middle(submesh: &Submesh, rim: &Loop) -> DVec3 {
    rim.vertices.iter().map(|v| submesh.place(*v)).sum::<DVec3>() / rim.vertices.len() as f64
}

/// The middle of a loop's length.
pub(super) fn middle_of_length(submesh: &Submesh, rim: &Loop) -> DVec3 {
    let n = rim.vertices.len();
    let ends = |i: usize| [i, (i + 1) % n].map(|i| submesh.place(rim.vertices[i]));
    let sum: DVec3 = (0..n).map(ends).map(|[a, b]| 0.5 * (a + b) * a.distance(b)).sum();
    sum / rim.perimeter(submesh).max(f64::MIN_POSITIVE)
}

/// The directed area of a cap on a loop.
pub(super) fn axis(submesh: &Submesh, rim: &Loop) -> DVec3 {
    triangulate::directed_area(&rim.points(submesh))
}

/// How far a loop rises and falls.
pub(super) fn height(submesh: &Submesh, rim: &Loop, across: DVec3) -> f64 {
    flatness::height(rim.vertices.iter().map(|v| submesh.place(*v)), across)
}

/// Has a loop no corner, as what is drilled has none?
pub(super) fn is_round(submesh: &Submesh, rim: &Loop) -> bool {
    let n = rim.vertices.len();
    let way = |i: usize| submesh.vector(rim.vertices[i % n], rim.vertices[(i + 1) % n]).normalize_or_zero();
    (0..n).all(|i| way(i).dot(way(i + 1)) > 0.0 && way(i).cross(way(i + 1)).length() < CORNER)
}
