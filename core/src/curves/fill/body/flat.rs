//! Planes, and spheres seen from a point of them: maps that take rational curves to rational curves of the same degree.

use crate::curves::curve::Spline;
use crate::curves::export::{EdgeUse, Surface};
use crate::curves::vector::Point;

use super::edges::Edges;
use crate::curves::elementary::Frame;

type Found = Option<(Surface, Vec<Vec<EdgeUse>>)>;

/// A plane as large as its loops; parameters are lengths along the axes.
pub(super) fn plane(edges: &Edges, frame: &Frame, rings: Vec<Vec<EdgeUse>>) -> Found {
    let rings = mapped(edges, rings, |point| {
        let [x, y, _] = frame.inside(point);
        Some([x, y, 1.0])
    })?;
    let [[a, b], [c, d]] = bounds(&rings)?;
    let row = |x: f64| [c, d].map(|y| frame.outside([x, y, 0.0])).to_vec();
    let knots = [vec![a, a, b, b], vec![c, c, d, d]];
    Some((Surface { degrees: [1, 1], knots, points: vec![row(a), row(b)], weights: None }, rings))
}

/// A sphere by the map from the point opposite to its z-axis: `(x, y, 1 − x² − y²) / (1 + x² + y²)` with twice x and y, a
/// rational surface of degree 2 both ways. It has neither seam nor poles, and curves of parameters are exact: the map of a point,
/// `(x, y) / (radius + z)`, is linear in homogeneous coordinates.
pub(super) fn sphere(edges: &Edges, frame: &Frame, radius: f64, rings: Vec<Vec<EdgeUse>>) -> Found {
    let rings = mapped(edges, rings, |point| {
        let [x, y, z] = frame.inside(point);
        let share = (radius + z) / radius;
        // Control points behind the point that is seen from; curves themselves are not there.
        (share > 1e-6).then(|| [x / radius / share, y / radius / share, share])
    })?;
    let [u, v] = bounds(&rings)?.map(knots);
    let pair = |knots: &[f64], at: usize| [at + 1, at + 2].map(|at| knots.get(at).copied().unwrap_or_default());
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for i in 0..u.len().saturating_sub(3) {
        let [a, b] = pair(&u, i);
        let (mut row, mut own) = (Vec::new(), Vec::new());
        for j in 0..v.len().saturating_sub(3) {
            let [c, d] = pair(&v, j);
            // The blossom of each polynomial at the knots of the control point.
            let (x, y) = (a * b, c * d);
            let weight = 1.0 + x + y;
            row.push(frame.outside([(a + b) / weight, (c + d) / weight, (1.0 - x - y) / weight].map(|x| x * radius)));
            own.push(weight);
        }
        points.push(row);
        weights.push(own);
    }
    Some((Surface { degrees: [2, 2], knots: [u, v], points, weights: Some(weights) }, rings))
}

/// Knots of degree 2 with one at 0, if that is within, so that no weight is negative.
fn knots([low, high]: [f64; 2]) -> Vec<f64> {
    let middle = (low < 0.0 && high > 0.0).then_some(0.0);
    [low; 3].into_iter().chain(middle).chain([high; 3]).collect()
}

/// Halvings of the pieces of a curve, at most, until its control points have images: they come nearer to the curve, which has one.
const HALVINGS: u32 = 7;

/// Loops with curves of parameters whose control points are the images of those in space, with factors of their weights.
fn mapped(edges: &Edges, rings: Vec<Vec<EdgeUse>>, map: impl Fn(Point) -> Option<[f64; 3]>) -> Option<Vec<Vec<EdgeUse>>> {
    let one = |one: EdgeUse| {
        let mut curve = edges.curve(&one)?.clone();
        let images = |curve: &Spline| curve.points().iter().map(|point| map(*point)).collect::<Option<Vec<[f64; 3]>>>();
        for _ in 0..HALVINGS {
            if images(&curve).is_some() {
                break;
            }
            curve = curve.halved().ok()?;
        }
        let images = images(&curve)?;
        let points = images.iter().map(|[x, y, _]| [*x, *y, 0.0]).collect();
        let is_plain = curve.weights().is_none() && images.iter().all(|[.., weight]| *weight == 1.0);
        let weight = |(at, [.., factor]): (usize, &[f64; 3])| {
            factor * curve.weights().and_then(|weights| weights.get(at)).copied().unwrap_or(1.0)
        };
        let weights = (!is_plain).then(|| images.iter().enumerate().map(weight).collect());
        let pcurve = Spline::new(curve.degree(), curve.knots().to_vec(), points, weights, None).ok()?;
        Some(EdgeUse { pcurve: Some(pcurve), ..one })
    };
    rings.into_iter().map(|ring| ring.into_iter().map(one).collect()).collect()
}

/// The least rectangle around curves of parameters, and a part more.
fn bounds(rings: &[Vec<EdgeUse>]) -> Option<[[f64; 2]; 2]> {
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    let points = rings.iter().flatten().filter_map(|one| one.pcurve.as_ref()).flat_map(Spline::points);
    for [x, y, _] in points {
        for ([low, high], t) in bounds.iter_mut().zip([*x, *y]) {
            (*low, *high) = (low.min(t), high.max(t));
        }
    }
    let wider = bounds.map(|[low, high]| [low - 0.01 * (high - low), high + 0.01 * (high - low)]);
    wider.iter().all(|[low, high]| low < high && (high - low).is_finite()).then_some(wider)
}
