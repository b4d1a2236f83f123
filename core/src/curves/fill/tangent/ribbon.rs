//! Vectors along a side of a surface as cubic B-splines: pieces of Hermite's cubics, halved until they are near enough.

use crate::curves::curve::{CurveError, Spline};
use crate::curves::vector::{Point, add, norm, scale, sub};

/// Halvings of a span, at most.
const DEPTH: u32 = 14;
/// The step of differences, in spans.
const STEP: f64 = 1e-4;
/// Slopes that differ by less than this share of their size are one.
const ALIKE: f64 = 1e-6;

/// A place of a ribbon: its parameter, its vector there, and its slopes before and behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Node {
    pub(super) at: f64,
    pub(super) vector: Point,
    pub(super) slopes: [Point; 2],
}

impl Node {
    /// One with the same slope before and behind.
    pub(super) fn smooth(at: f64, vector: Point, slope: Point) -> Self {
        Self { at, vector, slopes: [slope; 2] }
    }
}

/// Slopes of a function at both ends of a span, by differences of second order within it.
pub(super) fn slopes(vector: &dyn Fn(f64) -> Option<Point>, [a, b]: [f64; 2]) -> Option<[Point; 2]> {
    let step = STEP * (b - a);
    let slope = |at: f64, step: f64| {
        let [p, q, r] = [at, at + step, at + 2.0 * step].map(vector);
        Some(scale(sub(scale(sub(q?, p?), 4.0), sub(r?, p?)), 0.5 / step))
    };
    Some([slope(a, step)?, slope(b, -step)?])
}

/// The vector between two nodes.
fn between(a: &Node, b: &Node, t: f64) -> Point {
    let width = b.at - a.at;
    let x = (t - a.at) / width;
    let y = 1.0 - x;
    let ends = add(scale(a.vector, y * y * (1.0 + 2.0 * x)), scale(b.vector, x * x * (1.0 + 2.0 * y)));
    add(ends, sub(scale(a.slopes[1], x * y * y * width), scale(b.slopes[0], x * x * y * width)))
}

/// Appends the nodes from `from` on to `to`, which is left out, so that the cubics between them are near a function by the judge
/// `is_near`; places where the function may have corners are `cuts`. A span that is not near after 14 halvings stays. O(nodes).
pub(super) fn extend(
    nodes: &mut Vec<Node>,
    [from, to]: [Node; 2],
    cuts: &[f64],
    vector: &dyn Fn(f64) -> Option<Point>,
    is_near: &dyn Fn(f64, Point) -> bool,
) -> Option<()> {
    let inner = cuts.iter().copied().filter(|cut| *cut > from.at && *cut < to.at);
    let places: Vec<f64> = std::iter::once(from.at).chain(inner).chain([to.at]).collect();
    let mut ends = vec![from];
    for pair in places.windows(2) {
        let &[a, b] = pair else { continue };
        let [first, last] = slopes(vector, [a, b])?;
        if let Some(end) = ends.last_mut().filter(|_| a > from.at) {
            end.slopes[1] = first;
        }
        ends.push(Node::smooth(b, vector(b)?, last));
    }
    if let Some(end) = ends.last_mut() {
        *end = to;
    }
    for pair in ends.windows(2) {
        if let &[a, b] = pair {
            halve(nodes, [a, b], DEPTH, vector, is_near)?;
        }
    }
    Some(())
}

fn halve(
    nodes: &mut Vec<Node>,
    [a, b]: [Node; 2],
    depth: u32,
    vector: &dyn Fn(f64) -> Option<Point>,
    is_near: &dyn Fn(f64, Point) -> bool,
) -> Option<()> {
    let place = |share: f64| a.at + (b.at - a.at) * share;
    if depth == 0 || [0.2, 0.5, 0.8].into_iter().all(|share| is_near(place(share), between(&a, &b, place(share)))) {
        nodes.push(a);
        return Some(());
    }
    let middle = place(0.5);
    let step = STEP * (b.at - a.at);
    let slope = scale(sub(vector(middle + step)?, vector(middle - step)?), 0.5 / step);
    let middle = Node::smooth(middle, vector(middle)?, slope);
    halve(nodes, [a, middle], depth - 1, vector, is_near)?;
    halve(nodes, [middle, b], depth - 1, vector, is_near)
}

/// The B-spline through nodes from 0 to 1: knots are double, triple where slopes differ.
///
/// # Errors
/// [`CurveError`] of less than two nodes, and of numbers that overflow.
pub(super) fn spline(nodes: &[Node]) -> Result<Spline, CurveError> {
    let mut knots = vec![0.0; 4];
    let mut points = Vec::with_capacity(3 * nodes.len());
    for (number, node) in nodes.iter().enumerate() {
        let before = number.checked_sub(1).and_then(|before| nodes.get(before)).map(|before| node.at - before.at);
        let behind = nodes.get(number + 1).map(|next| next.at - node.at);
        let [own, other] = node.slopes;
        let is_smooth = norm(sub(own, other)) <= ALIKE * norm(own).max(norm(other));
        if let Some(width) = before {
            points.push(sub(node.vector, scale(own, width / 3.0)));
        }
        if before.is_none() || behind.is_none() || !is_smooth {
            points.push(node.vector);
        }
        if let Some(width) = behind {
            points.push(add(node.vector, scale(if is_smooth && before.is_some() { own } else { other }, width / 3.0)));
        }
        if before.is_some() && behind.is_some() {
            knots.extend(std::iter::repeat_n(node.at, if is_smooth { 2 } else { 3 }));
        }
    }
    knots.extend([1.0; 4]);
    Spline::new(3, knots, points, None, None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::vector::distance;

    /// A sine with a corner at 0.3: nodes grow dense enough, the corner stays, and ends have the slopes that they were given.
    #[test]
    fn a_function_is_followed_as_near_as_asked_for() {
        let vector = |t: f64| Some([(7.0 * t).sin(), (t - 0.3).abs(), 1.0]);
        let near = |t: f64, own: Point| distance(own, vector(t).unwrap()) <= 1e-7;
        let ends = [0.0, 1.0]
            .map(|t: f64| Node::smooth(t, vector(t).unwrap(), [7.0 * (7.0 * t).cos(), if t < 0.3 { -1.0 } else { 1.0 }, 0.0]));
        let mut nodes = Vec::new();
        extend(&mut nodes, ends, &[0.3], &vector, &near).unwrap();
        nodes.push(ends[1]);
        let spline = spline(&nodes).unwrap();
        for at in 0..=200 {
            let t = f64::from(at) / 200.0;
            assert!(distance(spline.point_and_derivative(t).0, vector(t).unwrap()) < 3e-7, "{t}");
        }
        assert!(distance(spline.point_and_derivative(0.0).1, [7.0, -1.0, 0.0]) < 1e-12 && nodes.len() < 100);
    }
}
