//! Bodies whose size, area and volume are known.

use std::f64::consts::FRAC_1_SQRT_2;

use crate::curves::Unit;
use crate::curves::curve::{Arc, Shape, Spline};
use crate::curves::export::{Body, Edge, EdgeUse, Face, Surface};
use crate::curves::vector::{Point, add, scale};

pub(super) const UNIT: [f64; 4] = [0.0, 0.0, 1.0, 1.0];
/// Knots of a whole circle in four pieces of degree 2.
const ROUND: [f64; 12] = [0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0, 4.0];

/// A body of faces alone.
pub(super) fn body(faces: Vec<Face>) -> Body {
    let unit = Unit { name: "mm".into(), millimetres: 1.0 };
    Body { vertices: Vec::new(), edges: Vec::new(), faces, unit, tolerance: 1e-7 }
}

pub(super) fn whole(surface: Surface, is_same_sense: bool) -> Face {
    Face { surface, outer: Vec::new(), inner: Vec::new(), is_same_sense }
}

/// A plane patch from corner to corner, of degree 1 × 1.
pub(super) fn plane(origin: Point, u: Point, v: Point) -> Surface {
    let points = vec![vec![origin, add(origin, v)], vec![add(origin, u), add(add(origin, u), v)]];
    Surface { degrees: [1, 1], knots: [UNIT.to_vec(), UNIT.to_vec()], points, weights: None }
}

/// Control points and weights of a circle of radius 1, in its plane.
fn round() -> Vec<([f64; 2], f64)> {
    let corners = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]];
    let weight = |at: usize| if at.is_multiple_of(2) { 1.0 } else { FRAC_1_SQRT_2 };
    corners.iter().enumerate().map(|(at, corner)| (corner.map(f64::from), weight(at))).collect()
}

/// A profile in the plane of `x` and `z` (control points, weights) turned about the `z` axis; `u` is the angle.
fn turned(degree: usize, knots: Vec<f64>, profile: &[([f64; 2], f64)]) -> Surface {
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for ([x, y], weight) in round() {
        points.push(profile.iter().map(|([r, z], _)| [r * x, r * y, *z]).collect());
        weights.push(profile.iter().map(|(_, own)| own * weight).collect());
    }
    Surface { degrees: [2, degree], knots: [ROUND.to_vec(), knots], points, weights: Some(weights) }
}

pub(super) fn cylinder(radius: f64, height: f64) -> Surface {
    turned(1, UNIT.to_vec(), &[([radius, 0.0], 1.0), ([radius, height], 1.0)])
}

/// From the south pole to the north pole: half a circle as two pieces.
pub(super) fn sphere() -> Surface {
    let half = FRAC_1_SQRT_2;
    let profile = [([0.0, -1.0], 1.0), ([1.0, -1.0], half), ([1.0, 0.0], 1.0), ([1.0, 1.0], half), ([0.0, 1.0], 1.0)];
    turned(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0], &profile)
}

/// Radii 3 and 1.
pub(super) fn torus() -> Surface {
    let profile: Vec<_> = round().into_iter().map(|([x, z], weight)| ([3.0 + x, z], weight)).collect();
    turned(2, ROUND.to_vec(), &profile)
}

/// A bicubic hill of 5 × 4 points.
pub(super) fn hill() -> Surface {
    let height = |i: usize, j: usize| if i == 2 && j == 1 { 2.7 } else { 0.1 * (i * j) as f64 };
    let points = (0..5).map(|i| (0..4).map(|j| [i as f64, j as f64 / 3.0, height(i, j)]).collect()).collect();
    let knots = [vec![0.0, 0.0, 0.0, 0.0, 0.3, 1.0, 1.0, 1.0, 1.0], vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]];
    Surface { degrees: [3, 3], knots, points, weights: None }
}

pub(super) fn line(ends: [Point; 2]) -> Spline {
    Shape::Line(ends).to_spline().unwrap()
}

pub(super) fn circle(centre: Point, radius: f64) -> Spline {
    let axes = [[radius, 0.0, 0.0], [0.0, radius, 0.0]];
    Shape::Arc(Arc::new(centre, axes, [0.0, 0.0]).unwrap()).to_spline().unwrap()
}

pub(super) fn used(edge: usize, is_reversed: bool, pcurve: Option<Spline>) -> EdgeUse {
    EdgeUse { edge, is_reversed, pcurve }
}

/// A plate of 10 × 10 with a round hole of radius 2; with or without curves of parameters.
pub(super) fn plate(has_pcurves: bool) -> Body {
    let corners = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 10.0, 0.0], [0.0, 10.0, 0.0]];
    let mut body = body(vec![whole(plane([0.0; 3], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0]), true)]);
    body.vertices = corners.to_vec();
    body.vertices.push([7.0, 5.0, 0.0]);
    for at in 0..4 {
        let ends = [at, (at + 1) % 4];
        body.edges.push(Edge { curve: line(ends.map(|end| corners[end])), ends });
    }
    body.edges.push(Edge { curve: circle([5.0, 5.0, 0.0], 2.0), ends: [4, 4] });
    let tenth = crate::curves::vector::Affine::scaling(0.1);
    let pcurve = |edge: usize| has_pcurves.then(|| body.edges[edge].curve.clone().transformed(&tenth));
    let outer = (0..4).map(|edge| used(edge, false, pcurve(edge))).collect();
    let inner = vec![vec![used(4, true, pcurve(4))]];
    body.faces[0].outer = outer;
    body.faces[0].inner = inner;
    body
}

/// A box of 1 × 2 × 3 with its corner at the origin: six planes, twelve edges.
pub(super) fn cuboid() -> Body {
    let size = [1.0, 2.0, 3.0];
    let mut all = body(Vec::new());
    let corner = |number: usize| [0, 1, 2].map(|axis: usize| if number >> axis & 1 == 1 { size[axis] } else { 0.0 });
    all.vertices = (0..8).map(corner).collect();
    for axis in 0..3 {
        for start in (0..8).filter(|start| start >> axis & 1 == 0) {
            let ends = [start, start | 1 << axis];
            all.edges.push(Edge { curve: line(ends.map(corner)), ends });
        }
    }
    for axis in 0..3 {
        let [u, v] = [1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3)];
        for is_far in [false, true] {
            let origin = usize::from(is_far) << axis;
            let along = |to: usize| scale(corner(to), 1.0);
            let surface = plane(corner(origin), along(u), along(v));
            let mut ring = [origin, origin | u, origin | u | v, origin | v];
            if !is_far {
                ring.reverse();
            }
            let outer = (0..4).map(|at| {
                let (from, to) = (ring[at], ring[(at + 1) % 4]);
                let edge = all.edges.iter().position(|edge| edge.ends == [from.min(to), from.max(to)]).unwrap();
                used(edge, from > to, None)
            });
            let outer = outer.collect();
            all.faces.push(Face { surface, outer, inner: Vec::new(), is_same_sense: is_far });
        }
    }
    all
}

/// A cylinder of radius 2 and height 5: its side with a seam, and two caps.
pub(super) fn can() -> Body {
    let mut all = body(Vec::new());
    all.vertices = vec![[2.0, 0.0, 0.0], [2.0, 0.0, 5.0]];
    let rim = |z: f64| {
        let points = round().into_iter().map(|([x, y], _)| [2.0 * x, 2.0 * y, z]).collect();
        Spline::new(2, ROUND.to_vec(), points, Some(round().into_iter().map(|(_, weight)| weight).collect()), None).unwrap()
    };
    all.edges.push(Edge { curve: rim(0.0), ends: [0, 0] });
    all.edges.push(Edge { curve: rim(5.0), ends: [1, 1] });
    all.edges.push(Edge { curve: line([all.vertices[0], all.vertices[1]]), ends: [0, 1] });
    let level = |v: f64| Spline::new(1, vec![0.0, 0.0, 4.0, 4.0], vec![[0.0, v, 0.0], [4.0, v, 0.0]], None, None).ok();
    let seam = |u: f64| Some(line([[u, 0.0, 0.0], [u, 1.0, 0.0]]));
    let outer = vec![used(0, false, level(0.0)), used(2, false, seam(4.0)), used(1, true, level(1.0)), used(2, true, seam(0.0))];
    all.faces.push(Face { surface: cylinder(2.0, 5.0), outer, inner: Vec::new(), is_same_sense: true });
    let cap = |z: f64| plane([-2.0, -2.0, z], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]);
    let bottom = vec![used(0, true, None)];
    all.faces.push(Face { surface: cap(0.0), outer: bottom, inner: Vec::new(), is_same_sense: false });
    let top = vec![used(1, false, None)];
    all.faces.push(Face { surface: cap(5.0), outer: top, inner: Vec::new(), is_same_sense: true });
    all
}

/// The eighth of a ball of radius 1 where all coordinates are positive: a patch with three sides, and three planes.
pub(super) fn octant(has_pcurves: bool) -> Body {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let quarter = |from: Point, to: Point| {
        let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        Spline::new(2, knots, vec![from, add(from, to), to], Some(vec![1.0, FRAC_1_SQRT_2, 1.0]), None).unwrap()
    };
    let mut all = body(Vec::new());
    all.vertices = axes.to_vec();
    all.vertices.push([0.0; 3]);
    for ends in [[0, 1], [1, 2], [0, 2]] {
        all.edges.push(Edge { curve: quarter(axes[ends[0]], axes[ends[1]]), ends });
    }
    for (end, axis) in axes.into_iter().enumerate() {
        all.edges.push(Edge { curve: line([[0.0; 3], axis]), ends: [3, end] });
    }
    // From the equator to the pole: rows of constant angle.
    let row = |x: f64, y: f64| vec![[x, y, 0.0], [x, y, 1.0], [0.0, 0.0, 1.0]];
    let half = FRAC_1_SQRT_2;
    let weights = [1.0, half, 1.0].map(|weight| vec![weight, weight * half, weight]).to_vec();
    let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    let points = vec![row(1.0, 0.0), row(1.0, 1.0), row(0.0, 1.0)];
    let surface = Surface { degrees: [2, 2], knots: [knots.clone(), knots], points, weights: Some(weights) };
    let pcurve = |from: [f64; 2], to: [f64; 2]| has_pcurves.then(|| line([[from[0], from[1], 0.0], [to[0], to[1], 0.0]]));
    let outer = vec![
        used(0, false, pcurve([0.0, 0.0], [1.0, 0.0])),
        used(1, false, pcurve([1.0, 0.0], [1.0, 1.0])),
        used(2, true, pcurve([0.0, 0.0], [0.0, 1.0])),
    ];
    all.faces.push(Face { surface, outer, inner: Vec::new(), is_same_sense: true });
    // Planes seen from outside: from the origin along the later axis, back along the arc.
    for (edge, [a, b]) in [(0, [0, 1]), (1, [1, 2]), (2, [0, 2])] {
        let is_turned = edge == 2;
        let (first, second) = if is_turned { (a, b) } else { (b, a) };
        let outer = vec![used(3 + first, false, None), used(edge, !is_turned, None), used(3 + second, true, None)];
        let surface = plane([0.0; 3], axes[first], axes[second]);
        all.faces.push(Face { surface, outer, inner: Vec::new(), is_same_sense: true });
    }
    all
}

/// All of them, by name.
pub(super) fn all() -> Vec<(&'static str, Body)> {
    let flat = plane([0.0; 3], [3.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
    let mut inches = body(vec![whole(hill(), true)]);
    inches.unit = Unit { name: "inch".into(), millimetres: 25.4 };
    vec![
        ("plane", body(vec![whole(flat.clone(), true)])),
        ("plane_turned", body(vec![whole(flat, false)])),
        ("cylinder", body(vec![whole(cylinder(2.0, 5.0), true)])),
        ("sphere", body(vec![whole(sphere(), true)])),
        ("torus", body(vec![whole(torus(), true)])),
        ("torus_turned", body(vec![whole(torus().transposed(), false)])),
        ("hill", body(vec![whole(hill(), true)])),
        ("hill_inch", inches),
        ("plate", plate(false)),
        ("plate_pcurves", plate(true)),
        ("cuboid", cuboid()),
        ("can", can()),
        ("octant", octant(false)),
        ("octant_pcurves", octant(true)),
        ("several", body(vec![whole(sphere(), true), whole(hill(), true)])),
    ]
}
