//! Faces whose surfaces a file says: which side of their outline they are on, and what has no outline at all.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::*;
use crate::curves::curve::{Arc, Curve, Id, Role, Shape, Source, Spline, fit};
use crate::curves::elementary::{Elementary, Frame, Told};
use crate::curves::vector::{Point, cross, distance, dot};
use crate::curves::{Face, Network, Unit, Use, loops};

const SOURCE: Source = Source { id: Id::Place(0), line: 0 };
const FRAME: Frame = Frame { origin: [1.0, 2.0, 3.0], axes: [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]] };
const BALL: Elementary = Elementary::Sphere { frame: FRAME, radius: 2.0 };
const RING: Elementary = Elementary::Torus { frame: FRAME, major: 3.0, minor: 1.0 };

fn curve(shape: Shape) -> Curve {
    Curve { shape, source: SOURCE, name: None, role: Role::Edge, is_blanked: false, vertices: None }
}

/// The part of a circle about the frame's origin between two of its axes.
fn quarter(from: usize, to: usize) -> Shape {
    let axes = [from, to].map(|axis| FRAME.axes[axis].map(|x| 2.0 * x));
    Shape::Arc(Arc::new(FRAME.origin, axes, [0.0, FRAC_PI_2]).unwrap())
}

/// A circle around the frame's axis.
fn circle(radius: f64) -> Shape {
    let axes = [0, 1].map(|axis| FRAME.axes[axis].map(|x| radius * x));
    Shape::Arc(Arc::new(FRAME.origin, axes, [0.0, 0.0]).unwrap())
}

/// Positive numbers are curves from 1 on, negative ones are reversed.
fn uses(numbers: &[i32]) -> Vec<Use> {
    numbers.iter().map(|number| Use { curve: number.unsigned_abs() as usize - 1, is_reversed: *number < 0 }).collect()
}

fn face(rings: &[&[i32]], told: Option<(Elementary, bool)>) -> Face {
    let mut rings = rings.iter().map(|ring| uses(ring));
    Face {
        source: SOURCE,
        entity: String::new(),
        surface: String::new(),
        told: told.map(|(surface, is_left)| Told { surface, is_left: Some(is_left) }),
        outer: rings.next().unwrap_or_default(),
        inner: rings.collect(),
        is_untrimmed: false,
        is_void: false,
    }
}

fn network(shapes: Vec<Shape>, faces: Vec<Face>) -> Network {
    Network {
        unit: Unit { name: "mm".into(), millimetres: 1.0 },
        resolution: None,
        digits: 17,
        curves: shapes.into_iter().map(curve).collect(),
        faces,
        findings: Vec::new(),
    }
}

fn filled(shapes: Vec<Shape>, faces: Vec<Face>) -> FilledNetwork {
    let options = Options { chord: Some(2e-3), ..Options::default() };
    fill_network(&network(shapes, faces), (true, &loops::Options::default()), &options).unwrap()
}

/// Each edge is passed once in each direction.
fn is_closed(mesh: &Mesh) -> bool {
    let edges: std::collections::BTreeSet<(u32, u32)> =
        mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
    edges.len() == 3 * mesh.triangles.len() && edges.iter().all(|(a, b)| edges.contains(&(*b, *a)))
}

fn volume(mesh: &Mesh) -> f64 {
    let at = |number: u32| mesh.points[number as usize];
    mesh.triangles.iter().map(|&[a, b, c]| dot(at(a), cross(at(b), at(c))) / 6.0).sum()
}

/// Closed, on its surfaces, and with a volume to the part that chords take of it.
fn check(result: &FilledNetwork, wanted: f64, name: &str) {
    let mesh = &result.filled.mesh;
    assert!(is_closed(mesh), "{name}: {:?}", result.filled.reports);
    assert!((volume(mesh) / wanted - 1.0).abs() < 4e-3, "{name}: {} of {wanted}", volume(mesh));
    for (triangle, outline) in mesh.triangles.iter().zip(&mesh.face_of) {
        let Surface::Carrier(carrier) = &result.filled.surfaces[*outline as usize] else { panic!("{name}") };
        assert!(triangle.iter().all(|corner| carrier.distance(mesh.points[*corner as usize]) < 1e-9), "{name}");
    }
}

/// The height over the frame's plane that is the farthest from it.
fn farthest(result: &FilledNetwork) -> f64 {
    let heights = result.filled.mesh.points.iter().map(|point| FRAME.inside(*point)[2]);
    heights.fold(0.0, |most: f64, z| if z.abs() > most.abs() { z } else { most })
}

/// The body of a result has a face for each outline but so many, and all meet: each edge is passed once in each direction, if none is left. Surfaces reach as
/// far as the mesh does: points of it have parameters.
fn check_body(result: &FilledNetwork, curves: &[Shape], left: usize) {
    let shapes: Vec<&Shape> = curves.iter().chain(&result.added).collect();
    let (body, missing) = body(&shapes, &result.outlines, &result.filled, &Unit { name: "mm".into(), millimetres: 1.0 });
    assert_eq!((missing.len(), body.faces.len() + left), (left, result.outlines.len()));
    let mut counts = vec![0_i32; body.edges.len()];
    for one in body.faces.iter().flat_map(|face| std::iter::once(&face.outer).chain(&face.inner)).flatten() {
        counts[one.edge] += if one.is_reversed { -1 } else { 1 };
    }
    assert!(left > 0 || counts.iter().all(|count| *count == 0), "{counts:?}");
    let points = |number: usize| {
        let corners =
            result.filled.mesh.triangles.iter().zip(&result.filled.mesh.face_of).filter(move |(_, own)| **own as usize == number);
        corners.flat_map(|(triangle, _)| triangle.map(|corner| result.filled.mesh.points[corner as usize]))
    };
    let faces = (0..result.outlines.len()).filter(|number| !missing.contains(number)).zip(&body.faces);
    for (number, face) in faces {
        let surface = &face.surface;
        let surface =
            SplineSurface::new(surface.degrees, surface.knots.clone(), surface.points.clone(), surface.weights.clone()).unwrap();
        let [[a, b], [c, d]] = surface.domain();
        let grid: Vec<Point> = (0..=100)
            .flat_map(|u| (0..=100).map(move |v| (f64::from(u) / 100.0, f64::from(v) / 100.0)))
            .map(|(u, v)| surface.jet([a + (b - a) * u, c + (d - c) * v]).point)
            .collect();
        // Points of the grid are nowhere farther apart than this, on surfaces of this size.
        assert!(points(number).step_by(11).all(|point| grid.iter().any(|other| distance(*other, point) < 0.3)), "{number}");
    }
}

/// An eighth of a ball, and a ball without it: the same curves, but the sphere is on the other side of them.
#[test]
fn a_sphere_is_on_the_side_that_is_told() {
    for (is_left, share) in [(true, 0.125), (false, 0.875)] {
        let arcs = vec![quarter(0, 1), quarter(1, 2), quarter(2, 0)];
        let spokes =
            (0..3).map(|axis| Shape::Line([FRAME.origin, FRAME.outside([0, 1, 2].map(|k| if k == axis { 2.0 } else { 0.0 }))]));
        let shapes: Vec<Shape> = arcs.into_iter().chain(spokes).collect();
        let curves = shapes.clone();
        let flat = [[4, 1, -5], [5, 2, -6], [6, 3, -4]];
        let mut faces: Vec<Face> = flat.iter().map(|ring| face(&[ring], None)).collect();
        faces.push(face(&[&[1, 2, 3]], Some((BALL, is_left))));
        let result = filled(shapes, faces);
        check(&result, share * 4.0 / 3.0 * PI * 8.0, "ball");
        check_body(&result, &curves, 0);
        assert!(result.filled.reports[3].is_told);
    }
}

/// A ball with two bores across it, whose outline a seam makes one: it is seen from within one of them.
#[test]
fn a_sphere_with_holes_on_both_sides_is_seen_from_one_of_them() {
    let ring = |z: f64| {
        let axes = [0, 1].map(|axis| FRAME.axes[axis].map(|x| 0.3 * x));
        Shape::Arc(Arc::new(FRAME.outside([0.0, 0.0, z]), axes, [0.0, 0.0]).unwrap())
    };
    let high = (4.0_f64 - 0.09).sqrt();
    let angle = (0.3 / 2.0_f64).asin();
    let axes = [2, 0].map(|axis| FRAME.axes[axis].map(|x| 2.0 * x));
    let seam = Shape::Arc(Arc::new(FRAME.origin, axes, [angle, PI - angle]).unwrap());
    // Upper ring the one way, down the seam, lower ring the other way, and up: the bores are to the right of their rings, seen from outside.
    let shapes = vec![ring(high), ring(-high), seam];
    let faces = vec![face(&[&[-1, 3, 2, -3]], Some((BALL, true))), face(&[&[1]], None), face(&[&[2]], None)];
    let result = filled(shapes, faces);
    assert!(result.filled.reports[0].is_told, "{:?}", result.filled.reports);
    let cap = PI * (2.0 - high).powi(2) * (6.0 - (2.0 - high)) / 3.0;
    check(&result, 4.0 / 3.0 * PI * 8.0 - 2.0 * cap, "ball without its poles");
}

/// A circle bounds a disc, and half of a sphere: the file says which.
#[test]
fn a_circle_bounds_what_is_told() {
    for is_left in [true, false] {
        let result = filled(vec![circle(2.0)], vec![face(&[&[1]], None), face(&[&[1]], Some((BALL, is_left)))]);
        check(&result, 2.0 / 3.0 * PI * 8.0, "half of a ball");
        assert_eq!(farthest(&result) > 0.0, is_left);
    }
}

/// Upper and lower half of a torus, between the same two circles.
#[test]
fn a_torus_is_on_the_side_that_is_told() {
    for is_left in [true, false] {
        let ring: &[&[i32]] = &[&[1], &[-2]];
        let curves = [circle(4.0), circle(2.0)];
        let result = filled(curves.to_vec(), vec![face(ring, None), face(ring, Some((RING, is_left)))]);
        check(&result, PI * PI * 3.0, "half of a torus");
        check_body(&result, &curves, 0);
        assert_eq!(farthest(&result) > 0.0, is_left);
    }
}

/// A cone with its apex within a circle, or within four arcs: the circle bounds a disc, too. Files say that a cone has an apex in many ways; some tell of its
/// circle as of a hole.
#[test]
fn a_cone_ends_in_its_apex() {
    let (frame, parts) = (Frame { origin: FRAME.outside([0.0, 0.0, -3.0]), ..FRAME }, 4);
    let cone = Elementary::Cone { frame, slope: 2.0 / 3.0 };
    let arc = |k: i32| {
        let axes = [0, 1].map(|axis| FRAME.axes[axis].map(|x| 2.0 * x));
        Shape::Arc(Arc::new(FRAME.origin, axes, [f64::from(k), f64::from(k + 1)].map(|k| k * FRAC_PI_2)).unwrap())
    };
    let mut hole = face(&[&[], &[-1]], Some((cone, true)));
    hole.is_untrimmed = false;
    let one = (vec![circle(2.0)], vec![face(&[&[1]], None), hole]);
    let ring: &[i32] = &[1, 2, 3, 4];
    let four = ((0..parts).map(arc).collect(), vec![face(&[ring], None), face(&[ring], Some((cone, false)))]);
    for (shapes, faces) in [one, four] {
        let result = filled(shapes, faces);
        assert!(is_closed(&result.filled.mesh), "{:?}", result.filled.reports);
        assert!((volume(&result.filled.mesh) / (4.0 * PI) - 1.0).abs() < 4e-3, "{}", volume(&result.filled.mesh));
        assert!(result.filled.mesh.points.iter().any(|point| distance(*point, frame.origin) < 1e-12));
        assert_eq!(result.filled.reports[1].method, Method::Fans);
    }
}

/// A void of a solid faces inwards: its volume counts less.
#[test]
fn voids_face_inwards() {
    let large = Elementary::Sphere { frame: FRAME, radius: 3.0 };
    let void = Face { is_void: true, ..face(&[], Some((BALL, true))) };
    let result = filled(Vec::new(), vec![face(&[], Some((large, true))), void]);
    check(&result, 4.0 / 3.0 * PI * 19.0, "hollow ball");
}

/// Nothing bounds a whole sphere or a whole torus; seams that are passed there and back do not either.
#[test]
fn whole_surfaces_need_no_curves() {
    check(&filled(Vec::new(), vec![face(&[], Some((BALL, true)))]), 4.0 / 3.0 * PI * 8.0, "ball");
    let torus = filled(Vec::new(), vec![face(&[], Some((RING, true)))]);
    check(&torus, 2.0 * PI * PI * 3.0, "torus");
    check_body(&torus, &[], 0);
    let meridian = quarter(0, 2);
    check(&filled(vec![meridian], vec![face(&[&[1, -1]], Some((BALL, true)))]), 4.0 / 3.0 * PI * 8.0, "ball with a seam");
    let result = filled(vec![circle(2.0)], vec![face(&[&[1]], None), face(&[], None)]);
    assert_eq!((result.outlines.len(), result.bare), (1, vec![1]));
}

/// A loop on a torus, and both parts that it divides it into: the larger one is cut open elsewhere.
#[test]
fn a_loop_bounds_what_is_around_it() {
    for (u, v) in [(0.0, 0.0), (2.0, 3.0), (3.1, -1.5)] {
        let at = |t: f64| {
            let (a, b) = (u + 0.2 * (TAU * t).cos(), v + 0.6 * (TAU * t).sin());
            FRAME.outside([(3.0 + b.cos()) * a.cos(), (3.0 + b.cos()) * a.sin(), b.sin()])
        };
        let loops: Spline = fit(at, &[0.0, 0.5, 1.0], 1e-10).unwrap().0;
        let both = [true, false].map(|is_left| face(&[&[1]], Some((RING, is_left))));
        let curves = [Shape::Spline(loops)];
        let result = filled(curves.to_vec(), both.to_vec());
        check(&result, 2.0 * PI * PI * 3.0, "torus");
        // With seams both ways, the larger part is none of the surfaces that files get.
        check_body(&result, &curves, 1);
        let of = |outline: u32| result.filled.mesh.face_of.iter().filter(|own| **own == outline).count();
        assert!(of(0) * 5 < of(1), "{} {}", of(0), of(1));
    }
}

/// Without the word of the file, curves alone count.
#[test]
fn curves_alone_count_if_that_is_wanted() {
    let disc = network(vec![circle(2.0)], vec![face(&[&[1]], Some((BALL, true)))]);
    for (told, method) in [(true, Method::Recognised), (false, Method::Plane)] {
        let options = Options { told, ..Options::default() };
        let result = fill_network(&disc, (true, &loops::Options::default()), &options).unwrap();
        assert_eq!(result.filled.reports[0].method, method);
    }
}

/// A vector is not used where the curves are far from it: files that are damaged say surfaces that are not theirs.
#[test]
fn a_surface_far_from_its_curves_is_not_used() {
    let result = filled(vec![circle(2.1)], vec![face(&[&[1]], Some((BALL, true)))]);
    assert_eq!(result.filled.reports[0].method, Method::Plane);
}
