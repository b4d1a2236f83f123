use std::f64::consts::{FRAC_PI_2, PI, TAU};

use proptest::prelude::*;

use super::*;
use crate::curves::vector::{Point, add, distance, norm, scale, sub};

fn close(a: Point, b: Point, tolerance: f64) {
    assert!(distance(a, b) <= tolerance, "{a:?} is not {b:?}");
}

/// Cox and de Boor's recursion as it stands in books, for comparison.
fn basis(knots: &[f64], number: usize, degree: usize, t: f64) -> f64 {
    if degree == 0 {
        return f64::from(u8::from(knots[number] <= t && t < knots[number + 1]));
    }
    let ratio = |above: f64, below: f64| if below == 0.0 { 0.0 } else { above / below };
    ratio(t - knots[number], knots[number + degree] - knots[number]) * basis(knots, number, degree - 1, t)
        + ratio(knots[number + degree + 1] - t, knots[number + degree + 1] - knots[number + 1])
            * basis(knots, number + 1, degree - 1, t)
}

fn naive(spline: &Spline, t: f64) -> Point {
    let (mut sum, mut weight) = ([0.0; 3], 0.0);
    for (number, &point) in spline.points().iter().enumerate() {
        let share = basis(spline.knots(), number, spline.degree(), t) * spline.weights().map_or(1.0, |weights| weights[number]);
        sum = add(sum, scale(point, share));
        weight += share;
    }
    scale(sum, 1.0 / weight)
}

prop_compose! {
    /// B-splines with knots that may be repeated and need not be clamped.
    fn spline()(degree in 1_usize..6, extra in 0_usize..6)
        (steps in prop::collection::vec(prop_oneof![Just(0.0), 0.1..2.0_f64], 2 * degree + extra + 2),
         points in prop::collection::vec(prop::array::uniform3(-10.0..10.0_f64), degree + extra + 1),
         weights in prop::option::of(prop::collection::vec(0.2..3.0_f64, degree + extra + 1)),
         degree in Just(degree)) -> Option<Spline> {
        let knots = steps.iter().scan(0.0, |sum, step| { *sum += step; Some(*sum) }).collect();
        Spline::new(degree, knots, points, weights, None).ok()
    }
}

prop_compose! {
    fn arc()(centre in prop::array::uniform3(-5.0..5.0_f64), x in prop::array::uniform3(-3.0..3.0_f64),
             y in prop::array::uniform3(-3.0..3.0_f64), from in -7.0..7.0_f64, turn in 0.01..TAU) -> Option<Arc> {
        Arc::new(centre, [x, y], [from, from + turn]).ok()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn de_boor_is_the_sum_of_basis_functions(spline in spline(), share in 0.0..1.0_f64) {
        prop_assume!(spline.is_some());
        let spline = spline.unwrap();
        let [low, high] = spline.domain();
        let t = low + (high - low) * share;
        close(spline.point_and_derivative(t).0, naive(&spline, t), 1e-10);
    }

    #[test]
    fn clamping_and_reversing_change_no_point(spline in spline(), a in 0.0..0.45_f64, b in 0.55..1.0_f64, share in 0.0..1.0_f64) {
        prop_assume!(spline.is_some());
        let spline = spline.unwrap();
        let [low, high] = spline.domain();
        let part = spline.clone().on([low + (high - low) * a, low + (high - low) * b]).unwrap();
        let clamped = part.clamped().unwrap();
        let [from, to] = part.domain();
        let t = from + (to - from) * share;
        close(clamped.point_and_derivative(t).0, spline.point_and_derivative(t).0, 1e-9);
        close(part.reversed().point_and_derivative(from + (to - t)).0, spline.point_and_derivative(t).0, 1e-9);
    }

    #[test]
    fn arcs_are_exact_as_splines(arc in arc(), share in 0.0..1.0_f64) {
        prop_assume!(arc.is_some_and(|arc| norm(crate::curves::vector::cross(arc.axes[0], arc.axes[1])) > 0.5));
        let arc = arc.unwrap();
        let spline = Shape::Arc(arc).to_spline().unwrap();
        let [low, high] = spline.domain();
        let point = spline.point_and_derivative(low + (high - low) * share).0;
        // Its own angle says whether the point lies on the ellipse.
        close(arc.point(arc.angle(point)), point, 1e-12 * (1.0 + norm(point) + norm(arc.centre)));
        close(spline.point_and_derivative(low).0, Shape::Arc(arc).ends()[0], 1e-12);
        close(spline.point_and_derivative(high).0, Shape::Arc(arc).ends()[1], 1e-12);
    }

    #[test]
    fn the_derivative_is_the_limit_of_differences(spline in spline(), share in 0.01..0.99_f64) {
        prop_assume!(spline.is_some());
        let spline = spline.unwrap();
        let cuts = spline.cuts();
        let [a, b] = [cuts[0], cuts[1]];
        let t = a + (b - a) * share;
        let step = (b - a) * 1e-6;
        let [p, q] = [t - step, t + step].map(|t| spline.point_and_derivative(t).0);
        let slope = spline.point_and_derivative(t).1;
        close(scale(sub(q, p), 0.5 / step), slope, 1e-3 * (1.0 + norm(slope)));
    }

    #[test]
    fn the_nearest_point_of_a_point_is_itself(arc in arc(), share in 0.0..1.0_f64) {
        prop_assume!(arc.is_some_and(|arc| norm(crate::curves::vector::cross(arc.axes[0], arc.axes[1])) > 0.5));
        let shape = Shape::Arc(arc.unwrap());
        let [low, high] = shape.domain();
        let point = shape.point(low + (high - low) * share);
        close(shape.point(shape.nearest(point)), point, 1e-9);
        let spline = Shape::Spline(shape.to_spline().unwrap());
        close(spline.point(spline.nearest(point)), point, 1e-7);
    }
}

fn quarter() -> Shape {
    Shape::Arc(Arc::new([0.0; 3], [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0]], [0.0, FRAC_PI_2]).unwrap())
}

/// The circumference of an ellipse with the half axes 2 and 1 is 9.688448220547675 (tables of elliptic integrals).
#[test]
fn lengths_are_those_of_tables() {
    let ellipse = Shape::Arc(Arc::new([1.0; 3], [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [0.0, 0.0]).unwrap());
    assert!((ellipse.length(1e-12) - 9.688_448_220_547_675).abs() < 1e-11);
    assert!((Shape::Spline(ellipse.to_spline().unwrap()).length(1e-12) - 9.688_448_220_547_675).abs() < 1e-10);
    assert!((quarter().length(1e-12) - PI).abs() < 1e-14);
    assert_eq!(Shape::polyline(vec![[0.0; 3], [3.0, 4.0, 0.0], [3.0, 4.0, 2.0]]).unwrap().length(1e-9), 7.0);
}

/// A line, a quarter of a circle and a polyline: as one B-spline of degree 2, the same points at the same shares of each part.
#[test]
fn a_composite_becomes_one_spline() {
    let parts = vec![
        Shape::Line([[2.0, -3.0, 0.0], [2.0, 0.0, 0.0]]),
        quarter(),
        Shape::polyline(vec![[0.0, 2.0, 0.0], [-1.0, 2.0, 0.0], [-1.0, 3.0, 5.0]]).unwrap(),
    ];
    let whole = Shape::composite(parts).unwrap();
    let spline = whole.to_spline().unwrap();
    assert_eq!((spline.degree(), spline.domain()), (2, [0.0, 3.0]));
    for number in 0..=30 {
        let t = f64::from(number) / 10.0;
        if !(10..=20).contains(&number) {
            close(spline.point_and_derivative(t).0, whole.point(t), 1e-14);
        }
    }
    let middle = spline.point_and_derivative(1.5).0;
    close(middle, [2.0_f64.sqrt(), 2.0_f64.sqrt(), 0.0], 1e-14);
    assert!((whole.length(1e-10) - Shape::Spline(spline).length(1e-10)).abs() < 1e-9);
    let back = whole.clone().reversed();
    assert_eq!([back.ends()[1], back.ends()[0]], whole.ends());
    let part = whole.part([0.5, 2.75]).unwrap();
    assert_eq!(part.ends(), [[2.0, -1.5, 0.0], [-1.0, 2.5, 2.5]]);
}

/// Of a closed curve, a part may cross the joint.
#[test]
fn a_part_goes_on_across_the_joint() {
    let square = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3]];
    let square = Shape::polyline(square).unwrap();
    let part = square.clone().onward([3.5, 0.5], 0.0).unwrap();
    assert_eq!((part.ends(), part.length(1e-9)), ([[0.0, 0.5, 0.0], [0.5, 0.0, 0.0]], 1.0));
    let circle = Shape::Arc(Arc::new([0.0; 3], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [0.0, 0.0]).unwrap());
    assert!((circle.onward([1.5 * PI, 0.5 * PI], 1e-9).unwrap().length(1e-9) - PI).abs() < 1e-12);
    assert_eq!(square.part([2.0, 2.0]), Err(CurveError::Domain));
}

#[test]
fn conics_are_exact() {
    // x² = 4 y from (−2, 1) to (4, 4), x y = 1 (turned by 45°) from (1/2, 2) to (4, 1/4), x²/4 + y² = 1 from the right to the top.
    let parabola = conic([1.0, 0.0, 0.0, 0.0, -4.0, 0.0], 7.0, [[-2.0, 1.0], [4.0, 4.0]]).unwrap();
    let hyperbola = conic([0.0, 1.0, 0.0, 0.0, 0.0, -1.0], 0.0, [[0.5, 2.0], [4.0, 0.25]]).unwrap();
    let ellipse = conic([0.25, 0.0, 1.0, 0.0, 0.0, -1.0], 0.0, [[2.0, 0.0], [0.0, 1.0]]).unwrap();
    for number in 0..=10 {
        let t = f64::from(number) / 10.0;
        let [x, y, z] = parabola.point(t);
        assert!((x * x - 4.0 * y).abs() < 1e-13 && (z - 7.0).abs() < 1e-14);
        let [x, y, _] = hyperbola.point(t);
        assert!((x * y - 1.0).abs() < 1e-14);
        let [x, y, _] = ellipse.point(t * FRAC_PI_2);
        assert!((0.25 * x * x + y * y - 1.0).abs() < 1e-15);
    }
    assert_eq!((parabola.kind(), ellipse.kind()), ("conic", "ellipse"));
    // The other branch of the hyperbola is another curve.
    assert!(conic([0.0, 1.0, 0.0, 0.0, 0.0, -1.0], 0.0, [[0.5, 2.0], [-4.0, -0.25]]).is_err());
}

#[test]
fn what_is_no_spline_is_refused() {
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0]];
    let new = |degree, knots: &[f64], weights| Spline::new(degree, knots.to_vec(), points.clone(), weights, None);
    assert_eq!(new(0, &[0.0, 1.0, 2.0], None), Err(CurveError::Degree(0)));
    assert_eq!(new(1, &[0.0, 1.0, 2.0], None), Err(CurveError::Count { points: 2, knots: 3, degree: 1 }));
    assert_eq!(new(1, &[0.0, 0.0, 1.0, 0.5], None), Err(CurveError::Knots));
    assert_eq!(new(1, &[0.0, 1.0, 1.0, 2.0], None), Err(CurveError::Knots));
    assert_eq!(new(1, &[0.0, 0.0, f64::NAN, 1.0], None), Err(CurveError::NotFinite));
    assert_eq!(new(1, &[0.0, 0.0, 1.0, 1.0], Some(vec![1.0, 0.0])), Err(CurveError::Weights));
    assert!(Shape::polyline(vec![[0.0; 3]]).is_err());
}
