use std::f64::consts::{FRAC_PI_2, TAU};

use super::body;
use crate::curves::curve::{Arc, Shape};
use crate::curves::export::{self, Body, Face, Header};
use crate::curves::fill::{Filled, Options, Outline, SplineSurface, fill};
use crate::curves::vector::{Point, distance};
use crate::curves::{self, Unit, Use};

fn millimetres() -> Unit {
    Unit { name: "mm".into(), millimetres: 1.0 }
}

fn ring(uses: &[i32]) -> Vec<Use> {
    // −1 is curve 0 reversed, 1 is curve 0.
    uses.iter().map(|number| Use { curve: number.unsigned_abs() as usize - 1, is_reversed: *number < 0 }).collect()
}

fn outline(uses: &[i32]) -> Outline {
    Outline { outer: ring(uses), inner: Vec::new() }
}

fn line(a: Point, b: Point) -> Shape {
    Shape::Line([a, b])
}

fn arc(centre: Point, x: Point, y: Point, angles: [f64; 2]) -> Shape {
    Shape::Arc(Arc::new(centre, [x, y], angles).unwrap())
}

fn circle(z: f64, from: f64) -> Shape {
    let (sin, cos) = from.sin_cos();
    arc([0.0, 0.0, z], [cos, sin, 0.0], [-sin, cos, 0.0], [0.0, TAU])
}

/// The body, after checks of what any has: all outlines are there, curves of parameters lie on their edges, and files can be
/// written and read again.
fn checked(shapes: &[Shape], outlines: &[Outline]) -> (Filled, Body) {
    let all: Vec<&Shape> = shapes.iter().collect();
    let filled = fill(&all, outlines, &Options::default()).unwrap();
    let (body, left) = body(&all, outlines, &filled, &millimetres());
    assert!(left.is_empty(), "{:?}", filled.reports);
    for face in &body.faces {
        let surface = SplineSurface::new(
            face.surface.degrees,
            face.surface.knots.clone(),
            face.surface.points.clone(),
            face.surface.weights.clone(),
        );
        let surface = surface.unwrap();
        for one in loops(face).flatten() {
            let (curve, pcurve) = (&body.edges[one.edge].curve, one.pcurve.as_ref().unwrap());
            let [low, high] = curve.domain();
            for number in 0..=40 {
                let t = low + (high - low) * f64::from(number) / 40.0;
                let [u, v, _] = pcurve.point_and_derivative(t).0;
                let off = distance(surface.jet([u, v]).point, curve.point_and_derivative(t).0);
                assert!(off <= body.tolerance, "{off:e} {:e}", body.tolerance);
            }
        }
    }
    let mut bytes = Vec::new();
    export::write_step(&body, &Header::default(), &mut bytes).unwrap();
    assert_eq!(curves::read(&bytes).unwrap().faces.len(), body.faces.len());
    export::write_iges(&body, &Header::default(), &mut Vec::new()).unwrap();
    (filled, body)
}

fn loops(face: &Face) -> impl Iterator<Item = &Vec<export::EdgeUse>> {
    std::iter::once(&face.outer).chain(&face.inner)
}

/// Each edge is there twice, once in each direction.
fn is_closed(body: &Body) -> bool {
    let mut counts = vec![[0; 2]; body.edges.len()];
    body.faces.iter().flat_map(loops).flatten().for_each(|one| counts[one.edge][usize::from(one.is_reversed)] += 1);
    counts.iter().all(|count| *count == [1, 1])
}

#[test]
fn a_cube_is_a_solid() {
    let corner = |number: usize| [number & 1, (number >> 1) & 1, number >> 2].map(|bit| bit as f64);
    let pairs = [(0, 1), (1, 3), (3, 2), (2, 0), (4, 5), (5, 7), (7, 6), (6, 4), (0, 4), (1, 5), (3, 7), (2, 6)];
    let cube: Vec<Shape> = pairs.iter().map(|(a, b)| line(corner(*a), corner(*b))).collect();
    let faces = [[1, 2, 3, 4], [5, 6, 7, 8], [1, 10, -5, -9], [2, 11, -6, -10], [3, 12, -7, -11], [4, 9, -8, -12]];
    let outlines: Vec<Outline> = faces.iter().map(|face| outline(face)).collect();
    let (_, body) = checked(&cube, &outlines);
    assert!(is_closed(&body));
    assert_eq!((body.vertices.len(), body.edges.len(), body.faces.len()), (8, 12, 6));
}

/// A cylinder between two discs: with a seam among its curves; without one; and where the circles do not begin at the same angle,
/// so that one is cut.
#[test]
fn a_cylinder_is_a_solid() {
    let rings = Outline { outer: ring(&[1]), inner: vec![ring(&[2])] };
    for (shell, from) in [(outline(&[1, 3, -2, -3]), 0.0), (rings.clone(), 0.0), (rings, 1.0)] {
        let tube = [circle(0.0, 0.0), circle(2.0, from), line([1.0, 0.0, 0.0], [1.0, 0.0, 2.0])];
        let (_, body) = checked(&tube, &[shell, outline(&[1]), outline(&[2])]);
        let used = body.faces.iter().flat_map(loops).flatten().map(|one| one.edge).collect::<std::collections::BTreeSet<_>>();
        assert_eq!((is_closed(&body), used.len()), (true, if from > 0.0 { 4 } else { 3 }));
    }
}

/// An eighth of a ball, a cone with its apex, and a piece of a torus that ends in the middle of its tube.
#[test]
fn other_carriers_are_trimmed() {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut ball: Vec<Shape> = (0..3).map(|at| arc([0.0; 3], axes[at], axes[(at + 1) % 3], [0.0, FRAC_PI_2])).collect();
    ball.extend(axes.map(|axis| line([0.0; 3], axis)));
    let octant = [outline(&[1, 2, 3]), outline(&[4, 1, -5]), outline(&[5, 2, -6]), outline(&[6, 3, -4])];
    assert!(is_closed(&checked(&ball, &octant).1));
    let cone = [circle(1.0, 0.0), line([1.0, 0.0, 1.0], [0.0; 3])];
    assert!(is_closed(&checked(&cone, &[outline(&[1, 2, -2]), outline(&[1])]).1));
    let tube = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        arc([3.0 * cos, 3.0 * sin, 0.0], [cos, sin, 0.0], axes[2], [-0.3, 1.4])
    };
    let around = |angle: f64| {
        let wide = 3.0 + angle.cos();
        arc([0.0, 0.0, angle.sin()], [wide, 0.0, 0.0], [0.0, wide, 0.0], [0.1, 3.3])
    };
    checked(&[around(-0.3), tube(3.3), around(1.4), tube(0.1)], &[outline(&[1, 2, -3, -4])]);
}

/// A tent of three triangles with bent sides over a flat one: no side but that of the sharpest corner is a point.
#[test]
fn blended_surfaces_are_whole() {
    let (feet, apex) = ([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [0.3, 0.3, 1.0]);
    let mut tent: Vec<Shape> = (0..3).map(|at| line(feet[at], feet[(at + 1) % 3])).collect();
    for foot in feet {
        let middle = [0.5 * (foot[0] + apex[0]), 0.5 * (foot[1] + apex[1]), 0.8];
        tent.push(Shape::Spline(
            curves::curve::Spline::new(
                2,
                vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0],
                vec![foot, middle, apex],
                Some(vec![1.0, 0.7, 1.0]),
                None,
            )
            .unwrap(),
        ));
    }
    let (filled, body) = checked(&tent, &[outline(&[1, 5, -4]), outline(&[2, 6, -5]), outline(&[3, 4, -6]), outline(&[1, 2, 3])]);
    assert!(is_closed(&body));
    assert_eq!(filled.curves.iter().flatten().count(), 6);
}

/// The seam of a tennis ball in four curves, of which one runs against the outline: a face for each, and one vertex in the middle.
#[test]
fn fans_are_faces_that_share_spokes() {
    let point = |t: f64| [t.cos() + 0.4 * (3.0 * t).cos(), t.sin() - 0.4 * (3.0 * t).sin(), 1.2 * (2.0 * t).sin()];
    let wire = |from: f64, to: f64| {
        curves::fill::fit(
            &Shape::polyline((0..=40).map(|at| point(from + (to - from) * f64::from(at) / 40.0)).collect()).unwrap(),
            1e-3,
        )
    };
    let quarters =
        [(0.0, 1.0), (2.0, 1.0), (2.0, 3.0), (3.0, 4.0)].map(|(a, b)| wire(a * FRAC_PI_2, b * FRAC_PI_2).unwrap().spline);
    let shapes = quarters.map(Shape::Spline);
    let (filled, body) = checked(&shapes, &[outline(&[1, -2, 3, 4])]);
    assert!(matches!(&filled.surfaces[0], curves::fill::Surface::Fans { curves, .. } if curves.len() == 4));
    assert_eq!((body.vertices.len(), body.edges.len(), body.faces.len()), (5, 8, 4));
    // Spokes are passed twice, once in each direction.
    let mut counts = [[0; 2]; 8];
    body.faces.iter().flat_map(loops).flatten().for_each(|one| counts[one.edge][usize::from(one.is_reversed)] += 1);
    assert_eq!(counts.iter().filter(|count| **count == [1, 1]).count(), 4);
}
