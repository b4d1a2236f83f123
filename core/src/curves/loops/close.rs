//! Gaps: open ends joined by straight curves, the nearest two first.

use crate::curves::curve::{Curve, Shape};
use crate::curves::vector::{Point, distance};

/// Rounds in which ends look for their nearest, at most.
const ROUNDS: u32 = 64;

#[derive(Clone, Copy, Debug)]
struct Open {
    node: u32,
    /// The node at the other end of its curve, if that is a straight line: closing these two would only go back.
    twin: Option<u32>,
    point: Point,
}

/// The lines that close gaps: the nodes that each joins, and both points. Two ends are joined if each is the nearest of the other, which is
/// what taking the shortest again and again comes to. O(n log n) a round for ends that are spread.
pub(super) fn gaps(
    curves: &[Curve],
    taken: &[(usize, f64)],
    nodes: &[[u32; 2]],
    count: usize,
    longest: f64,
) -> Vec<([u32; 2], [Point; 2])> {
    let mut degrees = vec![0_u32; count];
    for node in nodes.iter().flatten() {
        degrees.iter_mut().skip(*node as usize).take(1).for_each(|degree| *degree += 1);
    }
    let is_open = |node: u32| degrees.get(node as usize) == Some(&1);
    let mut open = Vec::new();
    for ((number, _), nodes) in taken.iter().zip(nodes) {
        let Some(curve) = curves.get(*number) else { continue };
        let is_straight = matches!(curve.shape, Shape::Line(_));
        let [start, end] = *nodes;
        for (node, other, point) in curve.shape.ends().into_iter().zip([(start, end), (end, start)]).map(|(p, (a, b))| (a, b, p))
        {
            if is_open(node) {
                open.push(Open { node, twin: is_straight.then_some(other), point });
            }
        }
    }
    let mut lines = Vec::new();
    for _ in 0..ROUNDS {
        let joined = round(&open, longest);
        if joined.is_empty() {
            break;
        }
        let mut is_done = vec![false; open.len()];
        for (a, b) in joined {
            if let (Some(one), Some(other)) = (open.get(a), open.get(b)) {
                lines.push(([one.node, other.node], [one.point, other.point]));
            }
            for at in [a, b] {
                is_done.iter_mut().skip(at).take(1).for_each(|done| *done = true);
            }
        }
        let mut done = is_done.into_iter();
        open.retain(|_| !done.next().unwrap_or(false));
    }
    lines
}

/// Pairs of which each is the nearest of the other.
fn round(open: &[Open], longest: f64) -> Vec<(usize, usize)> {
    let mut order: Vec<usize> = (0..open.len()).collect();
    split(open, &mut order, 0);
    let nearest: Vec<Option<usize>> = (0..open.len())
        .map(|number| {
            let mut best = (longest, None);
            let one = open.get(number).copied();
            one.into_iter().for_each(|one| search(open, &order, 0, (number, one), &mut best));
            best.1
        })
        .collect();
    let of = |number: usize| nearest.get(number).copied().flatten();
    (0..open.len()).filter_map(|a| of(a).filter(|b| a < *b && of(*b) == Some(a)).map(|b| (a, b))).collect()
}

fn coordinate(open: &[Open], number: usize, axis: usize) -> f64 {
    open.get(number).and_then(|one| one.point.get(axis)).copied().unwrap_or(0.0)
}

/// Makes a tree of dimensions in turn: the middle of each part splits it (J. L. Bentley, 1975). The depth is the logarithm of the count.
fn split(open: &[Open], order: &mut [usize], axis: usize) {
    if order.len() < 2 {
        return;
    }
    let middle = order.len() / 2;
    order.select_nth_unstable_by(middle, |a, b| coordinate(open, *a, axis).total_cmp(&coordinate(open, *b, axis)).then(a.cmp(b)));
    if let Some((low, high)) = order.split_at_mut_checked(middle) {
        split(open, low, (axis + 1) % 3);
        if let Some((_, high)) = high.split_first_mut() {
            split(open, high, (axis + 1) % 3);
        }
    }
}

fn search(open: &[Open], order: &[usize], axis: usize, one: (usize, Open), best: &mut (f64, Option<usize>)) {
    let Some((low, [middle, high @ ..])) = order.split_at_checked(order.len() / 2) else { return };
    let (number, end) = one;
    if let Some(other) =
        open.get(*middle).filter(|other| *middle != number && other.node != end.node && end.twin != Some(other.node))
    {
        let gap = distance(end.point, other.point);
        // Of two that are as near, the lower number.
        if gap < best.0 || (gap == best.0 && best.1.is_none_or(|known| *middle < known)) {
            *best = (gap, Some(*middle));
        }
    }
    let offset = end.point.get(axis).copied().unwrap_or(0.0) - coordinate(open, *middle, axis);
    let (near, far) = if offset < 0.0 { (low, high) } else { (high, low) };
    search(open, near, (axis + 1) % 3, one, best);
    if offset.abs() <= best.0 {
        search(open, far, (axis + 1) % 3, one, best);
    }
}
