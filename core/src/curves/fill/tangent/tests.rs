use std::f64::consts::{FRAC_PI_2, PI};

use super::super::report::Surface;
use super::Beside;
use super::flank::Known;
use super::ribbon::{self, Node};
use crate::curves::Use;
use crate::curves::curve::{Arc, Shape, Spline};
use crate::curves::fill::{Continuity, Coons, Filled, Method, Options, Outline, fill_beside};
use crate::curves::vector::{Point, add, cross, distance, norm, scale, unit};
use proptest::prelude::*;

type Place = [f64; 2];

/// A surface with its normal.
struct Truth {
    point: fn(Place) -> Point,
    normal: fn(Point) -> Option<Point>,
    off: fn(Point) -> f64,
}

const CYLINDER: Truth = Truth {
    point: |[u, v]| [u.cos(), u.sin(), v],
    normal: |[x, y, _]| Some([x, y, 0.0]),
    off: |[x, y, _]| (x.hypot(y) - 1.0).abs(),
};
const SPHERE: Truth = Truth {
    point: |[u, v]| [u.cos() * v.cos(), u.sin() * v.cos(), v.sin()],
    normal: Some,
    off: |point| (norm(point) - 1.0).abs(),
};
const TORUS: Truth = Truth {
    point: |[u, v]| [(2.0 + v.cos()) * u.cos(), (2.0 + v.cos()) * u.sin(), v.sin()],
    normal: |[x, y, z]| {
        let wide = x.hypot(y);
        Some([x * (1.0 - 2.0 / wide), y * (1.0 - 2.0 / wide), z])
    },
    off: |[x, y, z]| ((x.hypot(y) - 2.0).hypot(z) - 1.0).abs(),
};
/// A bicubic surface, as a B-spline of one span each way would have it: z is a polynomial of x and y.
const FREE: Truth = Truth {
    point: |[u, v]| [u, v, height(u, v)],
    normal: |[x, y, _]| Some([-(0.6 * x * x - 0.8 * x * y + 0.2), -(-0.4 * x * x + 0.9 * y * y), 1.0]),
    off: |[x, y, z]| (z - height(x, y)).abs(),
};

fn height(x: f64, y: f64) -> f64 {
    0.2 * x * x * x - 0.4 * x * x * y + 0.3 * y * y * y + 0.2 * x
}

/// A curve from a function on 0 to 1, cubic, as near as 10⁻⁹.
fn curve(point: &dyn Fn(f64) -> Point) -> Shape {
    let [start, end] = ribbon::slopes(&|t| Some(point(t)), [0.0, 1.0]).unwrap();
    let ends = [Node::smooth(0.0, point(0.0), start), Node::smooth(1.0, point(1.0), end)];
    let mut nodes = Vec::new();
    ribbon::extend(&mut nodes, ends, &[], &|t| Some(point(t)), &|t, own| distance(own, point(t)) < 1e-9).unwrap();
    nodes.push(ends[1]);
    Shape::Spline(ribbon::spline(&nodes).unwrap())
}

/// Curves whose places are straight between those given.
fn cut(truth: &Truth, places: &[Place]) -> Vec<Shape> {
    let next = places.iter().cycle().skip(1);
    let pairs = places.iter().zip(next);
    pairs.map(|(a, b)| curve(&|t| (truth.point)([a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]))).collect()
}

fn outline(uses: &[i32]) -> Outline {
    // −1 is curve 0 reversed, 1 is curve 0.
    let one = |number: &i32| Use { curve: number.unsigned_abs() as usize - 1, is_reversed: *number < 0 };
    Outline { outer: uses.iter().map(one).collect(), inner: Vec::new() }
}

fn run(shapes: &[Shape], outlines: &[Outline], beside: &[Beside<'_>], continuity: Continuity) -> Filled {
    // Where all is beside faces that are given, no surface is to be recognised.
    let options = Options { continuity, recognises: beside.is_empty(), ..Options::default() };
    fill_beside(&shapes.iter().collect::<Vec<_>>(), outlines, beside, &options).unwrap()
}

/// Filled by position alone, and with tangent planes of a surface along all curves.
fn both(shapes: &[Shape], normal: &(dyn Fn(Point) -> Option<Point> + Sync)) -> [Filled; 2] {
    let beside: Vec<Beside<'_>> = (0..shapes.len()).map(|curve| Beside { curve, normal }).collect();
    let all: Vec<i32> = (1..=shapes.len() as i32).collect();
    [Continuity::Position, Continuity::Tangent].map(|continuity| run(shapes, &[outline(&all)], &beside, continuity))
}

fn coons(filled: &Filled, number: usize) -> &Coons {
    let Surface::Coons(coons) = &filled.surfaces[number] else { panic!("{:?}", filled.reports) };
    coons
}

/// The largest distance of a Coons surface from a true one.
fn off(filled: &Filled, truth: &Truth) -> f64 {
    let at = |number: usize| [(number % 33) as f64 / 32.0, (number / 33) as f64 / 32.0];
    (0..33 * 33).map(|number| (truth.off)(coons(filled, 0).point_and_derivatives(at(number)).0)).fold(0.0, f64::max)
}

/// The largest angle between normals of a Coons surface and those of a true one along its sides, looked at between the samples of
/// the report.
fn angle(filled: &Filled, normal: &dyn Fn(Point) -> Option<Point>) -> f64 {
    let coons = coons(filled, 0);
    let mut largest = 0.0_f64;
    for t in (1..100).map(|at| f64::from(at) / 100.0) {
        for place in [[t, 0.0], [1.0, t], [t, 1.0], [0.0, t]] {
            let (point, [du, dv]) = coons.point_and_derivatives(place);
            let Some(own) = unit(cross(du, dv)) else { continue };
            let other = unit(normal(point).unwrap()).unwrap();
            largest = largest.max(norm(cross(own, other)));
        }
    }
    largest
}

/// Outlines of four, three and two sides cut out of surfaces: normals along them are the surface's, and the surface within is
/// nearer to it than by position alone.
#[test]
fn a_hole_in_a_surface_continues_it() {
    let bow = |truth: &Truth| {
        let low = curve(&|t| (truth.point)([1.2 * t, -0.4 * t * (1.0 - t)]));
        let high = curve(&|t| (truth.point)([1.2 * (1.0 - t), 1.3 * t * (1.0 - t)]));
        vec![low, high]
    };
    for (truth, has_bow) in [(CYLINDER, false), (SPHERE, true), (TORUS, true), (FREE, true)] {
        let square = cut(&truth, &[[0.1, 0.0], [1.2, 0.0], [1.2, 0.9], [0.1, 0.9]]);
        let askew = cut(&truth, &[[0.0, 0.1], [1.1, -0.1], [1.3, 0.8], [-0.2, 1.0]]);
        let three = cut(&truth, &[[0.0, 0.1], [1.1, -0.1], [0.6, 0.9]]);
        for shapes in [square, askew, three].into_iter().chain(has_bow.then(|| bow(&truth))) {
            let [plain, bent] = both(&shapes, &truth.normal);
            let (before, after) = (off(&plain, &truth), off(&bent, &truth));
            // The square of the cylinder is one by position alone.
            if before < 1e-9 {
                assert!(after < 1e-9);
                continue;
            }
            assert_eq!(bent.reports[0].tangent, shapes.len());
            assert!(after < before && angle(&bent, &truth.normal) < 1e-6 && bent.reports[0].kink < 1e-6);
            assert!(bent.mesh.points.iter().all(|point| (truth.off)(*point) <= after + 1e-9));
        }
    }
}

/// Circles of a sphere, which are fitted: as near as 10⁻⁸ of their length, their tangents are as near as the square root of the
/// square root of the cube of that, 10⁻⁶.
#[test]
fn fitted_curves_have_their_planes_nearly() {
    let arc = |centre: Point, x: Point, y: Point, angles: [f64; 2]| Shape::Arc(Arc::new(centre, [x, y], angles).unwrap());
    let parallel = |v: f64| arc([0.0, 0.0, v.sin()], [v.cos(), 0.0, 0.0], [0.0, v.cos(), 0.0], [0.0, 1.2]);
    let meridian = |u: f64| arc([0.0; 3], [u.cos(), u.sin(), 0.0], [0.0, 0.0, 1.0], [0.1, 0.9]);
    let shapes = [parallel(0.1), meridian(1.2), parallel(0.9), meridian(0.0)];
    let beside: Vec<Beside<'_>> = (0..4).map(|curve| Beside { curve, normal: &SPHERE.normal }).collect();
    let filled = run(&shapes, &[outline(&[1, 2, -3, -4])], &beside, Continuity::Tangent);
    assert_eq!(filled.reports[0].tangent, 4);
    assert!(angle(&filled, &SPHERE.normal) < 1e-6 && filled.reports[0].error <= 1.2e-8);
}

/// A piece of a cylinder gives its planes to a sheet that goes on from it; the sheet's other curves have nothing beside them.
#[test]
fn a_cylinder_gives_and_a_sheet_takes() {
    let ring = |z: f64| Shape::Arc(Arc::new([0.0, 0.0, z], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [0.0, FRAC_PI_2]).unwrap());
    let bezier = |points: [Point; 4]| {
        Shape::Spline(Spline::new(3, vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], points.to_vec(), None, None).unwrap())
    };
    let shapes = [
        ring(0.0),
        Shape::Line([[0.0, 1.0, 0.0], [0.0, 1.0, 2.0]]),
        ring(2.0),
        Shape::Line([[1.0, 0.0, 0.0], [1.0, 0.0, 2.0]]),
        bezier([[0.0, 1.0, 2.0], [0.0, 1.0, 2.6], [0.0, 1.2, 3.0], [0.3, 1.9, 3.1]]),
        bezier([[1.0, 0.0, 2.0], [1.0, 0.0, 2.5], [1.1, 0.1, 3.0], [1.8, 0.2, 3.4]]),
        bezier([[1.8, 0.2, 3.4], [1.6, 0.9, 3.2], [1.0, 1.7, 3.6], [0.3, 1.9, 3.1]]),
    ];
    let outlines = [outline(&[1, 2, -3, -4]), outline(&[3, 5, -7, -6])];
    let [plain, bent] = [Continuity::Position, Continuity::Tangent].map(|continuity| run(&shapes, &outlines, &[], continuity));
    assert_eq!(
        bent.reports.iter().map(|report| (report.method, report.tangent)).collect::<Vec<_>>(),
        [(Method::Recognised, 0), (Method::Coons, 1)]
    );
    let along = |filled: &Filled| {
        let coons = coons(filled, 1);
        let normal =
            |t: f64| unit(cross(coons.point_and_derivatives([t, 0.0]).1[0], coons.point_and_derivatives([t, 0.0]).1[1])).unwrap();
        (0..=40).map(|at| f64::from(at) / 40.0).fold(0.0_f64, |most, t| most.max(normal(t)[2].abs()))
    };
    assert!(along(&bent) < 1e-6 && along(&plain) > 1e-2, "{} {}", along(&plain), along(&bent));
    assert_eq!(bent.surfaces[0], plain.surfaces[0]);
    let again = crate::util::parallel::in_pool(3, || run(&shapes, &outlines, &[], Continuity::Tangent));
    assert_eq!(crate::util::parallel::in_pool(1, || run(&shapes, &outlines, &[], Continuity::Tangent)), again);
}

/// Two sheets beside each other, cut out of one surface: they meet in the planes halfway, and run in either direction.
#[test]
fn two_sheets_meet_halfway() {
    let [a, b, c, d, e, f] = [[0.0, 0.1], [1.1, -0.1], [1.3, 0.8], [-0.2, 1.0], [2.1, 0.0], [2.2, 0.9]];
    let mut shapes = cut(&FREE, &[a, b, c, d]);
    shapes.extend(cut(&FREE, &[b, e, f, c]).into_iter().take(3));
    for other in [[5, 6, 7, -2], [2, -7, -6, -5]] {
        let outlines = [outline(&[1, 2, 3, 4]), outline(&other)];
        let between = |continuity| {
            let filled = run(&shapes, &outlines, &[], continuity);
            let normals = |number: usize| -> Vec<Point> {
                let coons = coons(&filled, number);
                let at = |t: f64| {
                    if number == 0 {
                        [1.0, t]
                    } else if other[0] == 2 {
                        [t, 0.0]
                    } else {
                        [0.0, t]
                    }
                };
                (0..=40)
                    .map(|step| coons.point_and_derivatives(at(f64::from(step) / 40.0)).1)
                    .map(|[u, v]| unit(cross(u, v)).unwrap())
                    .collect()
            };
            let pairs = normals(0).into_iter().zip(normals(1));
            (pairs.fold(0.0_f64, |most, (a, b)| most.max(norm(cross(a, b)))), filled)
        };
        let ((before, _), (after, filled)) = (between(Continuity::Position), between(Continuity::Tangent));
        assert!(filled.reports.iter().all(|report| report.tangent == 1 && report.kink < 1e-6), "{:?}", filled.reports);
        assert!(before > 1e-2 && after < 1e-6, "{before} {after}");
    }
}

/// A side of two curves: both beside the surface, and the second one alone.
#[test]
fn parts_of_a_side_have_their_own_neighbours() {
    let shapes = cut(&TORUS, &[[0.0, 0.1], [0.6, 0.0], [1.1, -0.1], [1.3, 0.8], [-0.2, 1.0]]);
    let [plain, bent] = both(&shapes, &TORUS.normal);
    assert_eq!((bent.reports[0].method, bent.reports[0].tangent), (Method::Coons, 5));
    assert!(bent.reports[0].kink < 1e-6 && off(&bent, &TORUS) < off(&plain, &TORUS), "{:?}", bent.reports);
    let beside = [Beside { curve: 1, normal: &TORUS.normal }];
    let one = run(&shapes, &[outline(&[1, 2, 3, 4, 5])], &beside, Continuity::Tangent);
    assert!(one.reports[0].tangent == 1 && one.reports[0].kink < 1e-6, "{:?}", one.reports);
}

/// Planes beside one line that turn about it, beside others that do not: at two corners no twist suits both, and normals are off
/// by little, near these corners alone.
#[test]
fn twists_that_disagree_cost_little() {
    let turned = |[x, ..]: Point| {
        let (sin, cos) = (0.5 * (PI * x).sin()).sin_cos();
        Some([0.0, -sin, cos])
    };
    let flat = |_: Point| Some([0.0, 0.0, 1.0]);
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let shapes: Vec<Shape> = (0..4).map(|at| Shape::Line([corners[at], corners[(at + 1) % 4]])).collect();
    let splines: Vec<Spline> = shapes.iter().map(|shape| super::super::fit(shape, 0.0).unwrap().spline).collect();
    let spans = (0..4).map(|at| (at, 0.0, 1.0)).collect();
    let spline = Coons::new(&splines, spans).unwrap().to_spline().unwrap();
    let known: Vec<Known<'_>> = (0..4)
        .map(|side| Known {
            side,
            span: [0.0, 1.0],
            normal: if side == 0 { Box::new(move |_, point| turned(point)) } else { Box::new(move |_, point| flat(point)) },
        })
        .collect();
    let (lacking, held) = super::lacking::lacking(&spline, &known, 0.9).unwrap();
    let whole = super::super::sum::sum(&spline, &lacking).unwrap();
    assert_eq!(held, [0, 1, 2, 3]);
    let mut largest = [0.0_f64; 2];
    for t in (1..2000).map(|at| f64::from(at) / 2000.0) {
        let jet = whole.jet([t, 0.0]);
        let angle = norm(cross(jet.normal().unwrap(), turned(jet.point).unwrap()));
        let near = usize::from(t.min(1.0 - t) < 1e-3);
        largest[near] = largest[near].max(angle);
    }
    assert!(largest[0] < 1e-6 && largest[1] < 1e-3, "{largest:?}");
    for s in (1..20).flat_map(|u| (1..20).map(move |v| [f64::from(u) / 20.0, f64::from(v) / 20.0])) {
        assert!(whole.jet(s).normal().unwrap()[2] > 0.0);
    }
}

/// Planes that lean by 17° beside all lines of a square that is a little bent fade at the corners, where the lines cannot leave
/// them; walls beside them are no neighbours to go on from.
#[test]
fn planes_that_corners_do_not_allow() {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.05], [0.0, 1.0, 0.0]];
    let shapes: Vec<Shape> = (0..4).map(|at| Shape::Line([corners[at], corners[(at + 1) % 4]])).collect();
    let filled = |angle: f64| {
        let fields: Vec<_> = [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]
            .map(|[x, y]| move |_: Point| Some([x * angle.sin(), y * angle.sin(), angle.cos()]))
            .to_vec();
        let beside: Vec<Beside<'_>> = fields.iter().enumerate().map(|(curve, normal)| Beside { curve, normal }).collect();
        [Continuity::Position, Continuity::Tangent].map(|continuity| run(&shapes, &[outline(&[1, 2, 3, 4])], &beside, continuity))
    };
    let [plain, bent] = filled(0.3);
    let report = &bent.reports[0];
    assert!(report.tangent == 4 && (0.3..0.4).contains(&report.kink) && !coons(&bent, 0).is_folded(32), "{report:?}");
    let middle = |filled: &Filled| coons(filled, 0).point_and_derivatives([0.5; 2]).0[2];
    assert!(middle(&bent) > middle(&plain) + 0.02, "planes rise towards the middle");
    let [plain, bent] = filled(1.5);
    assert_eq!((plain.surfaces, bent.reports[0].tangent), (bent.surfaces, 0));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// A surface keeps its sides, does not fold, and is one B-spline, whatever is beside it.
    #[test]
    fn sides_stay(normals in prop::array::uniform4(prop::array::uniform3(-1.0..1.0_f64)), turn in -3.0..3.0_f64,
        bumps in prop::array::uniform4(-0.3..0.3_f64), count in 2_usize..5) {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.2], [0.9, 1.0, -0.1], [0.0, 1.1, 0.0]];
        let shapes: Vec<Shape> = (0..count).map(|at| {
            let (a, b) = (corners[at], corners[(at + 1) % count]);
            let up = [0.2 * bumps[at] + if count == 2 { 0.4 - 0.8 * at as f64 } else { 0.0 }, bumps[at], bumps[(at + 1) % 4]];
            let points = vec![a, add(add(scale(a, 0.7), scale(b, 0.3)), up), add(add(scale(a, 0.3), scale(b, 0.7)), up), b];
            Shape::Spline(Spline::new(3, vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], points, None, None).unwrap())
        }).collect();
        let fields: Vec<_> = normals.iter().map(|[x, y, z]| move |point: Point| {
            let [p, q, _] = point;
            Some([0.4 * x + 0.3 * turn * q, 0.4 * y + 0.3 * turn * p * p, 1.0 + 0.5 * z])
        }).collect();
        let beside: Vec<Beside<'_>> = (0..count).map(|curve| Beside { curve, normal: &fields[curve] }).collect();
        let all: Vec<i32> = (1..=count as i32).collect();
        let [plain, bent] = [Continuity::Position, Continuity::Tangent].map(|c| run(&shapes, &[outline(&all)], &beside, c));
        if let (Surface::Coons(a), Surface::Coons(b)) = (&plain.surfaces[0], &bent.surfaces[0]) {
            let spline = b.to_spline().unwrap();
            for t in (0..=20).map(|at| f64::from(at) / 20.0) {
                for place in [[t, 0.0], [1.0, t], [t, 1.0], [0.0, t]] {
                    prop_assert!(distance(a.point_and_derivatives(place).0, b.point_and_derivatives(place).0) < 1e-12);
                }
                let place = [t, 0.3 + 0.4 * t];
                let (point, [du, dv]) = b.point_and_derivatives(place);
                let jet = spline.jet(place);
                let size = 1.0 + norm(du) + norm(dv);
                prop_assert!(distance(jet.point, point) < 1e-11 && distance(jet.first[0], du) < 1e-8 * size);
                prop_assert!(distance(jet.first[1], dv) < 1e-8 * size);
            }
            prop_assert!(bent.reports[0].tangent == 0 || !b.is_folded(16));
        } else {
            prop_assert_eq!(plain, bent);
        }
    }
}
