//! Outlines of one to eight sides cut out of surfaces that are known, at three scales, polynomial and rational: how far fillings are off.

use std::f64::consts::TAU;

use super::*;
use crate::curves::Use;
use crate::curves::curve::{Arc, Shape, Spline};
use crate::curves::elementary::Elementary;
use crate::curves::vector::{Point, add, cross, distance, dot, scale, sub, unit};

const SCALES: [f64; 3] = [1e-3, 1.0, 1e4];

/// A cubic through four points of a curve of degree three at most, that is this curve.
fn cubic(at: impl Fn(f64) -> Point) -> Shape {
    let [a, b, c, d] = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(at);
    let inner = |near: Point, next: Point, from: Point, to: Point| {
        [0, 1, 2].map(|k| (18.0 * near[k] - 9.0 * next[k] - 5.0 * from[k] + 2.0 * to[k]) / 6.0)
    };
    let points = vec![a, inner(b, c, a, d), inner(c, b, d, a), d];
    Shape::Spline(Spline::new(3, vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], points, None, None).unwrap())
}

fn run(shapes: &[Shape], options: &Options) -> Filled {
    let outer = (0..shapes.len()).map(|curve| Use { curve, is_reversed: false }).collect();
    fill(&shapes.iter().collect::<Vec<_>>(), &[Outline { outer, inner: Vec::new() }], options).unwrap()
}

/// The corners of a regular polygon with so many sides, in a plane of parameters.
fn polygon(sides: usize) -> Vec<[f64; 2]> {
    let corner = |k: usize| (TAU * (k as f64 + 0.1) / sides as f64).sin_cos();
    (0..sides).map(corner).map(|(sin, cos)| [cos, sin]).collect()
}

/// Sides between the corners over a plane, lifted by a height that is a polynomial of degree three along each.
fn lifted(corners: &[[f64; 2]], height: impl Fn(f64, f64) -> f64) -> Vec<Shape> {
    let side = |k: usize| {
        let ([ax, ay], [bx, by]) = (corners[k], corners[(k + 1) % corners.len()]);
        cubic(|t| {
            let (x, y) = (ax + t * (bx - ax), ay + t * (by - ay));
            [x, y, height(x, y)]
        })
    };
    (0..corners.len()).map(side).collect()
}

fn scaled(shapes: &[Shape], size: f64) -> Vec<Shape> {
    let of = |shape: &Shape| {
        let spline = shape.to_spline().unwrap();
        let points = spline.points().iter().map(|point| scale(*point, size)).collect();
        Shape::Spline(
            Spline::new(spline.degree(), spline.knots().to_vec(), points, spline.weights().map(<[f64]>::to_vec), None).unwrap(),
        )
    };
    shapes.iter().map(of).collect()
}

/// All triangles run the same way around, and no edge is shared by more than two.
fn is_coherent(mesh: &Mesh) -> bool {
    let mut edges = std::collections::BTreeSet::new();
    mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).all(|edge| edges.insert(edge))
}

/// Over a free-form surface, whose control points are known since it is z = x² − x y² / 2 + y³ / 3: the curves lie on the filling within what is said, the filling
/// turns as its outline does, and it is nowhere farther from the surface than the surface is from a plane.
#[test]
fn free_form_outlines_of_three_to_eight_sides_keep_their_curves() {
    let height = |x: f64, y: f64| x * x - 0.5 * x * y * y + y * y * y / 3.0;
    for sides in 3..=8 {
        for size in SCALES {
            let shapes = scaled(&lifted(&polygon(sides), height), size);
            let result = run(&shapes, &Options::default());
            let report = &result.reports[0];
            assert!(report.problem.is_none(), "{sides} sides: {report:?}");
            assert!(report.error <= 1e-5 * size, "{sides} sides: {}", report.error);
            assert!(is_coherent(&result.mesh) && !result.mesh.triangles.is_empty());
            let at = |number: u32| result.mesh.points[number as usize];
            let up = result.mesh.triangles.iter().all(|t| cross(sub(at(t[1]), at(t[0])), sub(at(t[2]), at(t[0])))[2] > 0.0);
            assert!(up, "{sides} sides turn as their outline");
            let off = |p: &Point| (p[2] / size - height(p[0] / size, p[1] / size)).abs();
            let most = result.mesh.points.iter().map(off).fold(0.0, f64::max);
            // Over the unit disc the surface is between −0.7 and 1.4.
            assert!(most < 0.35, "{sides} sides at {size}: {most}");
        }
    }
}

/// Four sides: bilinear blending is off by no more than |∂⁴z / ∂x² ∂y²| / 64 of a unit square (the error of the Boolean sum of two linear
/// interpolations, Gordon 1971), which is c / 16 for z = c x² y², and is exact where that derivative is none.
#[test]
fn a_blended_square_is_off_by_its_bound_at_most() {
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    for (c, size) in [0.0, 0.4, 1.0].into_iter().flat_map(|c| SCALES.map(|size| (c, size))) {
        let height = |x: f64, y: f64| 0.3 * x * x * x - 0.2 * y * y + 0.5 * x * y + c * x * x * y * y;
        let shapes = scaled(&lifted(&square, height), size);
        let options = Options { size: Some(0.1 * size), ..Options::default() };
        let result = run(&shapes, &options);
        assert_eq!(result.reports[0].method, Method::Coons);
        let off = |p: &Point| (p[2] / size - height(p[0] / size, p[1] / size)).abs();
        let most = result.mesh.points.iter().map(off).fold(0.0, f64::max);
        assert!(most <= c / 16.0 + 1e-9, "{c} at {size}: {most}");
        assert!(c == 0.0 || most > 0.5 * c / 16.0, "the bound is near: {most}");
    }
}

/// Great circles between points around a pole, as arcs and as rational splines: a sphere, whatever their number.
#[test]
fn outlines_of_arcs_on_a_sphere_are_exact() {
    for (sides, size, is_spline) in
        (3..=8).flat_map(|sides| SCALES.into_iter().flat_map(move |size| [(sides, size, false), (sides, size, true)]))
    {
        let centre = [0.3 * size, -0.2 * size, 0.1 * size];
        let corners: Vec<Point> = polygon(sides).into_iter().map(|[x, y]| unit([x, y, 1.2]).unwrap()).collect();
        let side = |k: usize| {
            let (a, b) = (corners[k], corners[(k + 1) % sides]);
            let across = unit(sub(b, scale(a, dot(a, b)))).unwrap();
            let arc = Shape::Arc(Arc::new(centre, [scale(a, size), scale(across, size)], [0.0, dot(a, b).acos()]).unwrap());
            if is_spline { Shape::Spline(arc.to_spline().unwrap()) } else { arc }
        };
        let result = run(&(0..sides).map(side).collect::<Vec<_>>(), &Options::default());
        assert!(
            matches!(result.surfaces[0], Surface::Carrier(Elementary::Sphere { .. })),
            "{sides} sides: {:?}",
            result.reports[0]
        );
        assert!(result.mesh.points.iter().all(|p| (distance(*p, centre) - size).abs() <= 1e-6 * size));
        assert!(is_coherent(&result.mesh));
    }
}

/// Stairs of arcs and lines: four, six and eight sides on a cylinder, and on a cone, where the lines lead to the apex.
#[test]
fn stairs_on_cylinders_and_cones_are_exact() {
    for (slope, size) in [0.0, 0.5].into_iter().flat_map(|slope| SCALES.map(|size| (slope, size))) {
        let at =
            |angle: f64, high: f64| scale([(1.0 + slope * high) * angle.cos(), (1.0 + slope * high) * angle.sin(), high], size);
        for steps in 1..=3_u32 {
            // Up the stairs, back at the top, and down.
            let mut corners = vec![(0.0, 0.0)];
            for k in 1..=steps {
                let (turn, high) = (0.4 * f64::from(k), 0.5 * f64::from(k - 1));
                corners.extend([(turn, high), (turn, high + 0.5)]);
            }
            corners.push((0.0, 0.5 * f64::from(steps)));
            let side = |((a, low), (b, high)): ((f64, f64), (f64, f64))| {
                if low == high {
                    let wide = scale([0.0, 0.0, low], size);
                    let (x, y) = (sub(at(0.0, low), wide), sub(at(TAU / 4.0, low), wide));
                    // A turn to the left only: the way back is the same arc reversed.
                    Shape::Arc(
                        Arc::new(wide, if a < b { [x, y] } else { [x, scale(y, -1.0)] }, if a < b { [a, b] } else { [-a, -b] })
                            .unwrap(),
                    )
                } else {
                    Shape::Line([at(a, low), at(b, high)])
                }
            };
            let n = corners.len();
            let result = run(&(0..n).map(|k| side((corners[k], corners[(k + 1) % n]))).collect::<Vec<_>>(), &Options::default());
            let Surface::Carrier(carrier) = &result.surfaces[0] else { panic!("{n} sides: {:?}", result.reports[0]) };
            assert_eq!((carrier.name(), n), (if slope == 0.0 { "cylinder" } else { "cone" }, 2 * steps as usize + 2));
            let off = |p: &Point| (p[0].hypot(p[1]) - size - slope * p[2]).abs();
            assert!(result.mesh.points.iter().all(|p| off(p) <= 1e-6 * size), "{n} sides");
            assert!(is_coherent(&result.mesh));
        }
    }
}

/// One side and two: a closed curve that is bent, and two curves with corners where they meet.
#[test]
fn one_side_and_two_are_filled_within_their_curves() {
    for size in SCALES {
        let bow = |sign: f64| {
            cubic(move |t| {
                let x = 2.0 * t - 1.0;
                [sign * x, sign * (1.0 - x * x) * 0.5, 0.2 * x * x]
            })
        };
        let two = run(&scaled(&[bow(-1.0), bow(1.0)], size), &Options::default());
        assert_eq!(two.reports[0].method, Method::Ruled);
        assert!(two.reports[0].error <= 1e-5 * size && is_coherent(&two.mesh));
        // Between two curves that are each other's mirror image, the ruled surface is z = x² / 5.
        let off = |p: &Point| (p[2] / size - 0.2 * (p[0] / size).powi(2)).abs();
        assert!(two.mesh.points.iter().all(|p| off(p) <= 1e-6), "{size}");
        // A closed spline of degree 3 through a saddle's rim, its ends smooth.
        let control = |k: usize| {
            let (sin, cos) = (TAU * k as f64 / 8.0).sin_cos();
            scale([cos, sin, 0.3 * (cos * cos - sin * sin)], size)
        };
        let points: Vec<Point> = (0..11).map(|k| control(k % 8)).collect();
        let knots: Vec<f64> = (0..15).map(|k| f64::from(k) - 3.0).collect();
        let closed = Shape::Spline(Spline::new(3, knots, points, None, Some([0.0, 8.0])).unwrap());
        let one = run(&[closed], &Options::default());
        assert!(one.reports[0].problem.is_none(), "{:?}", one.reports[0]);
        assert!(one.reports[0].error <= 1e-5 * size && is_coherent(&one.mesh));
        let middle =
            one.mesh.points.iter().fold([0.0; 3], |sum, point| add(sum, scale(*point, 1.0 / one.mesh.points.len() as f64)));
        assert!(distance(middle, [0.0; 3]) < 0.1 * size);
    }
}

/// A whole cone of two halves with its apex, and a frustum: chords across are as near to the surface as is asked for, three times that around the apex, where all is narrow.
#[test]
fn cones_are_as_near_as_is_asked_for() {
    let chord = 0.02;
    for top in [0.0, 0.3] {
        let half = |side: f64| {
            let turn = |wide: f64, high: f64, angles: [f64; 2]| {
                Shape::Arc(Arc::new([0.0, 0.0, high], [[wide, 0.0, 0.0], [0.0, side * wide, 0.0]], angles).unwrap())
            };
            // The way back is the same arc, mirrored.
            let back = |wide: f64, high: f64| {
                Shape::Arc(Arc::new([0.0, 0.0, high], [[wide, 0.0, 0.0], [0.0, -side * wide, 0.0]], [-0.5 * TAU, 0.0]).unwrap())
            };
            let high = 2.0 * (1.0 - top);
            let (down, up) =
                (Shape::Line([[-1.0, 0.0, 0.0], [-top, 0.0, high]]), Shape::Line([[top, 0.0, high], [1.0, 0.0, 0.0]]));
            let half = [0.0, 0.5 * TAU];
            if top == 0.0 { vec![turn(1.0, 0.0, half), down, up] } else { vec![turn(1.0, 0.0, half), down, back(top, high), up] }
        };
        for side in [1.0, -1.0] {
            let result = run(&half(side), &Options { chord: Some(chord), ..Options::default() });
            assert!(matches!(result.surfaces[0], Surface::Carrier(Elementary::Cone { .. })), "{:?}", result.reports[0]);
            let at = |number: u32| result.mesh.points[number as usize];
            let middles = result.mesh.triangles.iter().flat_map(|&[a, b, c]| {
                let [p, q, r] = [a, b, c].map(at);
                [scale(add(p, q), 0.5), scale(add(q, r), 0.5), scale(add(r, p), 0.5)]
            });
            let off = middles.map(|p| (p[0].hypot(p[1]) - (1.0 - 0.5 * p[2])).abs()).fold(0.0, f64::max);
            assert!(off <= if top == 0.0 { 3.5 } else { 1.3 } * chord, "{top} {side}: {off}");
        }
    }
}
