//! Conics of a general equation in a plane.

use super::arc::Arc;
use super::error::CurveError;
use super::shape::Shape;
use super::spline::Spline;
use crate::curves::vector::Point;

/// An arc of `A x² + B x y + C y² + D x + E y + F = 0` at the height `z`, from one point of it to another: anticlockwise on an ellipse, along the
/// branch of a parabola or a hyperbola.
///
/// # Errors
/// [`CurveError`] of equations that are no such curve, or ends that are not on one branch.
pub fn conic(equation: [f64; 6], z: f64, [start, end]: [[f64; 2]; 2]) -> Result<Shape, CurveError> {
    let [a, b, c, ..] = equation;
    if !equation.iter().chain(&start).chain(&end).all(|x| x.is_finite()) || !z.is_finite() {
        return Err(CurveError::NotFinite);
    }
    let size = a.abs().max(b.abs()).max(c.abs());
    let discriminant = b * b - 4.0 * a * c;
    if size == 0.0 {
        Err(CurveError::Degenerate("a conic of the first order"))
    } else if discriminant < -1e-12 * size * size {
        ellipse(equation, z, [start, end])
    } else {
        open(equation, z, [start, end])
    }
}

fn ellipse([a, b, c, d, e, f]: [f64; 6], z: f64, [start, end]: [[f64; 2]; 2]) -> Result<Shape, CurveError> {
    let determinant = 4.0 * a * c - b * b;
    let centre = [(b * e - 2.0 * c * d) / determinant, (b * d - 2.0 * a * e) / determinant];
    let level = -(f + 0.5 * (d * centre[0] + e * centre[1]));
    // The main axes: the angle that takes the mixed term away.
    let turn = 0.5 * b.atan2(a - c);
    let (sin, cos) = turn.sin_cos();
    let first = a * cos * cos + b * sin * cos + c * sin * sin;
    let second = a * sin * sin - b * sin * cos + c * cos * cos;
    let (p, q) = ((level / first).sqrt(), (level / second).sqrt());
    if !(p > 0.0 && q > 0.0) {
        return Err(CurveError::Degenerate("an ellipse without points"));
    }
    let axes = [[p * cos, p * sin, 0.0], [-q * sin, q * cos, 0.0]];
    let angle = |point: [f64; 2]| {
        let offset = [point[0] - centre[0], point[1] - centre[1]];
        ((offset[1] * cos - offset[0] * sin) / q).atan2((offset[0] * cos + offset[1] * sin) / p)
    };
    Arc::new([centre[0], centre[1], z], axes, [angle(start), angle(end)]).map(Shape::Arc)
}

/// A rational Bézier curve of degree 2 (TNB section 7.3): its middle point is where the tangents at both ends meet, its weight follows from
/// where the line from there to the middle of the chord crosses the conic.
fn open(equation: [f64; 6], z: f64, [start, end]: [[f64; 2]; 2]) -> Result<Shape, CurveError> {
    let normal = |[x, y]: [f64; 2]| {
        let [a, b, c, d, e, _] = equation;
        [2.0 * a * x + b * y + d, b * x + 2.0 * c * y + e]
    };
    let (n, m) = (normal(start), normal(end));
    let determinant = n[0] * m[1] - n[1] * m[0];
    let (p, q) = (n[0] * start[0] + n[1] * start[1], m[0] * end[0] + m[1] * end[1]);
    let top = [(p * m[1] - n[1] * q) / determinant, (n[0] * q - p * m[0]) / determinant];
    if !top.iter().all(|x| x.is_finite()) {
        return Err(CurveError::Degenerate("a conic whose tangents do not meet"));
    }
    let middle = [0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])];
    let share = crossing(equation, middle, [top[0] - middle[0], top[1] - middle[1]]).filter(|_| is_one_branch(equation, middle));
    let share = share.ok_or(CurveError::Degenerate("a conic whose ends are on different branches"))?;
    let weight = share / (1.0 - share);
    let points: Vec<Point> = [start, top, end].iter().map(|&[x, y]| [x, y, z]).collect();
    let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    Spline::new(2, knots, points, Some(vec![1.0, weight, 1.0]), None).map(Shape::Conic)
}

/// Whether the middle of a chord is on the other side of the curve than the centre, which is so within each branch of a hyperbola alone.
fn is_one_branch([a, b, c, d, e, f]: [f64; 6], [x, y]: [f64; 2]) -> bool {
    let determinant = 4.0 * a * c - b * b;
    let centre = [(b * e - 2.0 * c * d) / determinant, (b * d - 2.0 * a * e) / determinant];
    let at_centre = f + 0.5 * (d * centre[0] + e * centre[1]);
    let at_middle = a * x * x + b * x * y + c * y * y + d * x + e * y + f;
    // A parabola has no centre, and one branch.
    !at_centre.is_finite() || at_centre * at_middle < 0.0
}

/// Where, between 0 and 1, the line `from + s · along` crosses the conic.
fn crossing([a, b, c, d, e, f]: [f64; 6], [x, y]: [f64; 2], [u, v]: [f64; 2]) -> Option<f64> {
    let second = a * u * u + b * u * v + c * v * v;
    let first = 2.0 * a * x * u + b * (x * v + y * u) + 2.0 * c * y * v + d * u + e * v;
    let zeroth = a * x * x + b * x * y + c * y * y + d * x + e * y + f;
    let root = (first * first - 4.0 * second * zeroth).max(0.0).sqrt();
    // Without cancellation: the larger root by its formula, the other one by their product.
    let large = -0.5 * (first + root.copysign(first));
    [large / second, zeroth / large].into_iter().find(|s| *s > 0.0 && *s < 1.0)
}
