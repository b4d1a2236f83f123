//! Curves that run where another one does.

use std::collections::HashMap;

use crate::curves::curve::{Curve, Shape};
use crate::curves::vector::distance;

/// Of its length, how far a curve may be from the one that it is a double of.
const SHARE: f64 = 1e-3;
/// Different curves between the same two points that one is compared with, at most.
const MOST: usize = 16;

/// Takes out curves that run where an earlier one does between the same points; gives each with that one. O(n) but for curves between the
/// same points, which cost O(spans) for each pair.
pub(super) fn remove(
    curves: &[Curve],
    taken: &mut Vec<(usize, f64)>,
    nodes: &mut Vec<[u32; 2]>,
    tolerance: f64,
) -> Vec<(usize, usize)> {
    let mut kept: HashMap<[u32; 2], Vec<(usize, f64)>> = HashMap::new();
    let mut doubles = Vec::new();
    let mut is_double = vec![false; taken.len()];
    for ((one, ends), flag) in taken.iter().zip(nodes.iter()).zip(&mut is_double) {
        let [a, b] = *ends;
        let others = kept.entry([a.min(b), a.max(b)]).or_default();
        let same = others.iter().take(MOST).find(|other| is_same(curves, *one, **other, tolerance));
        if let Some((other, _)) = same {
            doubles.push((one.0, *other));
            *flag = true;
        } else {
            others.push(*one);
        }
    }
    let (mut of_taken, mut of_nodes) = (is_double.iter(), is_double.iter());
    taken.retain(|_| of_taken.next() != Some(&true));
    nodes.retain(|_| of_nodes.next() != Some(&true));
    doubles
}

fn is_same(curves: &[Curve], (one, length): (usize, f64), (other, other_length): (usize, f64), tolerance: f64) -> bool {
    let (Some(one), Some(other)) = (curves.get(one), curves.get(other)) else { return false };
    let near = (4.0 * tolerance).max(SHARE * length.min(other_length));
    if (length - other_length).abs() > 0.05 * length.max(other_length) {
        return false;
    }
    if let (Shape::Line(_), Shape::Line(_)) = (&one.shape, &other.shape) {
        return true;
    }
    let [low, high] = one.shape.domain();
    [0.25, 0.5, 0.75].into_iter().all(|share| {
        let point = one.shape.point(low + (high - low) * share);
        distance(point, other.shape.point(other.shape.nearest(point))) <= near
    })
}
