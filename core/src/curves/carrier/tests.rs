use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI, TAU};

use super::{Carrier, Tensor};
use crate::curves::curve::{Arc, Shape};
use crate::curves::vector::{Affine, Point, distance, norm};

fn line(from: [f64; 2], to: [f64; 2]) -> Shape {
    Shape::Line([[from[0], from[1], 0.0], [to[0], to[1], 0.0]])
}

/// A quarter of a cylinder of radius 1 and height 2 as a rational surface: `u` around, `v` upwards.
fn quarter() -> Tensor {
    let row = |x: f64, y: f64, weight: f64| vec![([x, y, 0.0], weight), ([x, y, 2.0], weight)];
    let rows = vec![row(1.0, 0.0, 1.0), row(1.0, 1.0, FRAC_1_SQRT_2), row(0.0, 1.0, 1.0)];
    Tensor::new([2, 1], [vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]], rows).unwrap()
}

#[test]
fn surfaces_are_where_their_parameters_say() {
    let here = Affine::IDENTITY;
    let near = |carrier: Carrier, [u, v]: [f64; 2], expected: Point| {
        assert!(distance(carrier.point(u, v), expected) < 1e-14, "{:?}", carrier.point(u, v));
    };
    near(Carrier::Cylinder(here, 2.0), [FRAC_PI_2, 3.0], [0.0, 2.0, 3.0]);
    near(Carrier::Cone(here, [2.0, 0.5]), [PI, 2.0], [-3.0, 0.0, 2.0]);
    near(Carrier::Sphere(here, 2.0), [FRAC_PI_2, FRAC_PI_2], [0.0, 0.0, 2.0]);
    near(Carrier::Torus(here, [3.0, 1.0]), [0.0, FRAC_PI_2], [3.0, 0.0, 1.0]);
    near(Carrier::Tensor(quarter()), [0.5, 0.25], [FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.5]);
    // Knots in the middle, both ends: a bicubic whose points are those of x = u, y = v, z = u v.
    let greville = [0.0, 1.0 / 3.0, 1.0, 5.0 / 3.0, 2.0];
    let rows = greville.map(|x| greville.map(|y| ([x, y, x * y], 1.0)).to_vec()).to_vec();
    let knots = vec![0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 2.0];
    let saddle = Tensor::new([3, 3], [knots.clone(), knots], rows).unwrap();
    for (u, v) in [(0.0, 0.0), (0.3, 1.0), (1.0, 1.7), (2.0, 0.5), (2.0, 2.0)] {
        near(Carrier::Tensor(saddle.clone()), [u, v], [u, v, u * v]);
    }
}

#[test]
fn curves_along_a_parameter_are_exact() {
    let here = Affine::IDENTITY;
    let exact = |carrier: &Carrier, from: [f64; 2], to: [f64; 2]| {
        let lifted = carrier.lift(&line(from, to), 1e-9).unwrap();
        assert!(lifted.off.is_none() && lifted.shapes.len() == 1);
        let shape = lifted.shapes[0].clone();
        let ends = [from, to].map(|[u, v]| carrier.point(u, v));
        assert!(shape.ends().into_iter().zip(ends).all(|(a, b)| distance(a, b) < 1e-12), "{carrier:?} {:?}", shape.ends());
        shape
    };
    let round = [
        Carrier::Cylinder(here, 2.0),
        Carrier::Cone(here, [2.0, 0.5]),
        Carrier::Sphere(here, 2.0),
        Carrier::Torus(here, [3.0, 1.0]),
        Carrier::Turned(here, line([1.0, 0.0], [2.0, 1.0])),
    ];
    for carrier in round {
        assert_eq!(exact(&carrier, [0.2, 0.3], [4.0, 0.3]).kind(), "circle");
        let upwards = exact(&carrier, [1.0, 0.9], [1.0, 0.1]);
        assert!(matches!(upwards.kind(), "circle" | "line"));
    }
    let wall =
        Carrier::Drawn(Shape::Arc(Arc::new([0.0; 3], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [0.0, 2.0]).unwrap()), [0.0, 0.0, 5.0]);
    assert_eq!(exact(&wall, [0.5, 0.5], [1.5, 0.5]).kind(), "circle");
    assert_eq!(exact(&wall, [0.5, 0.0], [0.5, 1.0]).kind(), "line");
    let tensor = Carrier::Tensor(quarter());
    let shape = exact(&tensor, [1.0, 0.5], [0.0, 0.5]);
    assert!((shape.length(1e-12) - FRAC_PI_2).abs() < 1e-11);
    assert!((exact(&tensor, [0.5, 0.25], [0.5, 0.75]).length(1e-12) - 1.0).abs() < 1e-12);
}

/// A helix on a cylinder, and a circle on a quarter of it: fitted, all their points on the cylinder.
#[test]
fn other_curves_are_fitted() {
    let cylinder = Carrier::Cylinder(Affine::IDENTITY, 1.0);
    let lifted = cylinder.lift(&line([0.0, 0.0], [TAU, 3.0]), 1e-8).unwrap();
    assert!(lifted.off.unwrap() <= 1e-8);
    assert!((lifted.shapes[0].length(1e-9) - TAU.hypot(3.0)).abs() < 1e-6);
    let hole = Arc::new([0.5, 0.5, 0.0], [[0.3, 0.0, 0.0], [0.0, 0.3, 0.0]], [0.0, 0.0]).unwrap();
    let lifted = Carrier::Tensor(quarter()).lift(&Shape::Arc(hole), 1e-8).unwrap();
    let [low, high] = lifted.shapes[0].domain();
    for number in 0..=100 {
        let [x, y, _] = lifted.shapes[0].point(low + (high - low) * f64::from(number) / 100.0);
        assert!((norm([x, y, 0.0]) - 1.0).abs() < 2e-8);
    }
}

/// A parallelogram of degree 1 × 1 is a plane, on which a circle is an ellipse; the side of a sphere that is its pole is nothing.
#[test]
fn planes_are_exact_and_poles_are_nothing() {
    let rows = vec![vec![([1.0, 0.0, 0.0], 1.0), ([1.0, 2.0, 0.0], 1.0)], vec![([4.0, 0.0, 1.0], 1.0), ([4.0, 2.0, 1.0], 1.0)]];
    let knots = [vec![0.0, 0.0, 3.0, 3.0], vec![0.0, 0.0, 1.0, 1.0]];
    let plane = Carrier::from(Tensor::new([1, 1], knots, rows).unwrap());
    assert!(matches!(plane, Carrier::Plane(_)) && distance(plane.point(1.5, 0.5), [2.5, 1.0, 0.5]) < 1e-15);
    let circle = Arc::new([1.0, 0.5, 0.0], [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]], [0.0, 0.0]).unwrap();
    let lifted = plane.lift(&Shape::Arc(circle), 1e-9).unwrap();
    assert_eq!((lifted.shapes[0].kind(), lifted.off), ("ellipse", None));
    let pole = Carrier::Sphere(Affine::IDENTITY, 1.0).lift(&line([0.0, FRAC_PI_2], [TAU, FRAC_PI_2]), 1e-9).unwrap();
    assert!(pole.shapes.is_empty());
    assert!(Tensor::new([2, 1], [vec![0.0; 4], vec![0.0; 4]], vec![]).is_err());
}

/// Parameters of a closed surface go on behind its seam; of others they do not.
#[test]
fn seams_are_crossed() {
    let corners =
        [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [-1.0, 1.0], [-1.0, 0.0], [-1.0, -1.0], [0.0, -1.0], [1.0, -1.0], [1.0, 0.0]];
    let weight = |at: usize| if at.is_multiple_of(2) { 1.0 } else { FRAC_1_SQRT_2 };
    let row = |(at, [x, y]): (usize, [f64; 2])| vec![([x, y, 0.0], weight(at)), ([x, y, 2.0], weight(at))];
    let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0, 4.0];
    let rows = corners.into_iter().enumerate().map(row).collect();
    let tube = Carrier::Tensor(Tensor::new([2, 1], [knots, vec![0.0, 0.0, 1.0, 1.0]], rows).unwrap());
    let lifted = tube.lift(&line([3.0, 0.5], [5.0, 0.5]), 1e-8).unwrap();
    assert!((lifted.shapes[0].length(1e-9) - PI).abs() < 1e-6);
    assert!(distance(lifted.shapes[0].ends()[0], [0.0, -1.0, 1.0]) < 1e-12);
    let upwards = tube.lift(&line([5.0, 0.0], [5.0, 1.0]), 1e-8).unwrap();
    assert_eq!((upwards.shapes[0].ends(), upwards.off), ([[0.0, 1.0, 0.0], [0.0, 1.0, 2.0]], None));
    assert!(Carrier::Tensor(quarter()).lift(&line([0.5, 0.5], [1.5, 0.5]), 1e-8).is_err());
}
