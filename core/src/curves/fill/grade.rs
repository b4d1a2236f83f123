//! Edges of outlines made to change slowly: no edge much longer than its neighbours, none much longer than the gap to another part
//! of its outline, and those of a sharp corner alike.
//!
//! Based on: J. Ruppert, *A Delaunay refinement algorithm for quality 2-dimensional mesh generation*, Journal of Algorithms 18 (1995):
//! the local feature size, and edges of equal lengths around sharp corners, here once for all outlines of a curve.

use rayon::prelude::*;

use super::near::Near;
use super::strand::Strand;
use crate::curves::Use;
use crate::curves::vector::{Point, distance, dot, sub};
use crate::util::each::Each;

/// Rounds, at most: what one outline makes finer another one has to follow.
const ROUNDS: u32 = 4;
/// How much longer an edge may be at a distance, in parts of that.
const GROWTH: f64 = 0.5;
/// An edge is no longer than this many times the gap to other parts of its outline.
const GAP: f64 = 2.0;
/// An edge may be longer than wanted by this share before it is split.
const SLACK: f64 = 0.75;
/// Pieces of an edge in a round, at most.
const PIECES: f64 = 64.0;
/// An edge is split for gaps until it has this part of its curve's length.
const SHARE: f64 = 1.0 / 1024.0;
/// Cosines of angles at corners: below the first, gaps of both sides are no reason to split, for a corner of 15° spoils its triangle
/// anyway; below the second, both first edges are made alike, since they are sides of one triangle.
const SHARP: [f64; 2] = [0.966, 0.64];
/// First edges of a sharp corner may differ by this factor.
const ALIKE: f64 = 1.15;

/// Parameters of the points of each curve, 0 and 1 among them.
pub(super) type Samples = Vec<Vec<f64>>;

/// An edge of a ring: its curve, its number on that, whether the ring runs against the curve, its beginning, its length and its
/// place in the loop.
#[derive(Clone, Copy, Debug)]
struct Edge {
    curve: usize,
    number: usize,
    is_reversed: bool,
    start: Point,
    length: f64,
    part: usize,
}

/// Wishes for an edge: lengths at its beginning and its end in the direction of its curve, and where to split it first (the
/// distance from its beginning, negative from its end), if it has to be for a sharp corner.
#[derive(Clone, Copy, Debug)]
struct Wish {
    curve: usize,
    number: usize,
    lengths: [f64; 2],
    first: Option<f64>,
}

/// Splits edges of curves until they are graded in all outlines, given as rings of curves and directions, or for so many rounds. O(points ·
/// log points) a round.
pub(super) fn graded(strands: &[Option<Strand<'_>>], outlines: &[Vec<&[Use]>], samples: &mut Samples) {
    for _ in 0..ROUNDS {
        let points: Vec<Vec<Point>> = strands
            .par_iter()
            .zip(&*samples)
            .map(|(strand, shares)| strand.iter().flat_map(|strand| shares.iter().map(|share| strand.point(*share))).collect())
            .collect();
        let wishes: Vec<Vec<Wish>> = outlines.par_iter().map(|rings| wishes(rings, &points, strands)).collect();
        let mut all: Vec<Wish> = wishes.into_iter().flatten().collect();
        if all.is_empty() {
            return;
        }
        all.sort_by_key(|wish| (wish.curve, wish.number));
        let groups: Vec<&[Wish]> = all.chunk_by(|a, b| a.curve == b.curve).collect();
        let split: Vec<(usize, Vec<f64>)> = groups
            .par_iter()
            .filter_map(|group| {
                let curve = group.first()?.curve;
                Some((curve, split(group, samples.get(curve)?, points.get(curve)?)))
            })
            .collect();
        for (curve, shares) in split {
            samples.iter_mut().skip(curve).take(1).for_each(|old| old.clone_from(&shares));
        }
    }
}

/// Edges of a ring.
fn edges(uses: &[Use], points: &[Vec<Point>]) -> Vec<Edge> {
    let mut edges = Vec::new();
    for (part, one) in uses.iter().enumerate() {
        let Some(on) = points.get(one.curve) else { continue };
        let edge = |number: usize| {
            let (a, b) = (*on.get(number)?, *on.get(number + 1)?);
            let start = if one.is_reversed { b } else { a };
            Some(Edge { curve: one.curve, number, is_reversed: one.is_reversed, start, length: distance(a, b), part })
        };
        let count = on.len().saturating_sub(1);
        if one.is_reversed {
            edges.extend((0..count).rev().filter_map(edge));
        } else {
            edges.extend((0..count).filter_map(edge));
        }
    }
    edges
}

/// A ring, the cosine of the angle within it where each edge begins, and where each curve of its loop begins.
#[derive(Debug)]
struct Ring {
    edges: Vec<Edge>,
    corners: Vec<f64>,
    begins: Vec<usize>,
}

/// Edges of an outline that are to be split.
fn wishes(rings: &[&[Use]], points: &[Vec<Point>], strands: &[Option<Strand<'_>>]) -> Vec<Wish> {
    let rings: Vec<Ring> = rings.iter().map(|uses| Ring::new(edges(uses, points), uses.len())).collect();
    let starts: Vec<Point> = rings.iter().flat_map(|ring| &ring.edges).map(|edge| edge.start).collect();
    let near = Near::new(&starts);
    let mut wishes = Vec::new();
    let mut first = 0;
    for ring in &rings {
        let count = ring.edges.len();
        let least = |edge: &Edge| SHARE * strands.get(edge.curve).and_then(Option::as_ref).map_or(0.0, |strand| strand.length);
        let wanted = |(at, edge): (usize, &Edge)| ring.wanted(at, least(edge), first, &near);
        let wanted: Vec<f64> = ring.edges.iter().enumerate().map(wanted).collect();
        let sizes = slowly(&ring.edges, &wanted);
        let alike = alike(&ring.edges, &ring.corners);
        for (at, edge) in ring.edges.iter().enumerate() {
            let (low, high) = (get(&sizes, at), get(&sizes, (at + 1) % count));
            let turned = |from: f64| if edge.is_reversed { -from } else { from };
            let lengths = if edge.is_reversed { [high, low] } else { [low, high] };
            let from = alike.partition_point(|(number, _)| *number < at);
            let first = alike.get(from).filter(|(number, _)| *number == at).map(|(_, from)| turned(*from));
            if first.is_some() || pieces(edge.length, lengths) > 1 {
                wishes.push(Wish { curve: edge.curve, number: edge.number, lengths, first });
            }
        }
        first += count;
    }
    wishes
}

impl Ring {
    fn new(edges: Vec<Edge>, parts: usize) -> Self {
        let mut begins = vec![0; parts];
        for (at, edge) in edges.iter().enumerate().rev() {
            begins.iter_mut().skip(edge.part).take(1).for_each(|begin| *begin = at);
        }
        let corners = (0..edges.len()).map(|at| cosine(&edges, at)).collect();
        Self { edges, corners, begins }
    }

    /// Whether the corner between two curves is so sharp that the gap between them is no reason to split.
    fn is_in_wedge(&self, one: usize, other: usize) -> bool {
        let parts = self.begins.len();
        let later = match (other + parts - one) % parts.max(1) {
            1 => other,
            apart if apart + 1 == parts => one,
            _ => return false,
        };
        self.begins.get(later).and_then(|at| self.corners.get(*at)).is_some_and(|cosine| *cosine > SHARP[0])
    }

    /// The length that an edge shall have at most, by itself and by the gap to points of other parts of its outline, but no less than a
    /// length. Numbers of points of this ring begin at `first`.
    fn wanted(&self, at: usize, least: f64, first: usize, near: &Near) -> f64 {
        let count = self.edges.len();
        let (Some(edge), Some(next)) = (self.edges.get(at), self.edges.get((at + 1) % count)) else { return f64::INFINITY };
        if edge.length <= least {
            return edge.length;
        }
        // Points of the edge itself, and of its neighbours, which share its corners.
        let own = [count - 1, 0, 1, 2].each(|step| first + (at + step) % count);
        let is_other = |number: usize| {
            let beside = number.checked_sub(first).and_then(|at| self.edges.get(at));
            !own.contains(&number) && !beside.is_some_and(|other| self.is_in_wedge(edge.part, other.part))
        };
        let gap = near.nearest([edge.start, next.start], edge.length / GAP, &is_other);
        edge.length.min((GAP * gap).max(least))
    }
}

fn get(values: &[f64], at: usize) -> f64 {
    values.get(at).copied().unwrap_or(f64::INFINITY)
}

/// The cosine of the angle within a ring where an edge begins; −1 where it goes straight on.
fn cosine(ring: &[Edge], at: usize) -> f64 {
    let count = ring.len();
    let get = |at: usize| ring.get(at % count);
    let (Some(before), Some(edge), Some(next)) = (get(at + count - 1), get(at), get(at + 1)) else { return -1.0 };
    let product = before.length * edge.length;
    if product > 0.0 { dot(sub(before.start, edge.start), sub(next.start, edge.start)) / product } else { -1.0 }
}

/// Lengths wanted at the beginnings of edges: no more than those of both edges there, growing slowly along the ring. O(edges).
fn slowly(ring: &[Edge], wanted: &[f64]) -> Vec<f64> {
    let count = ring.len();
    let mut sizes: Vec<f64> = (0..count).map(|at| get(wanted, at).min(get(wanted, (at + count - 1) % count))).collect();
    for round in 0..4 * count {
        let at = round % count;
        let (from, to) = if round < 2 * count { (at, (at + 1) % count) } else { ((count - at) % count, count - 1 - at) };
        let step = ring.get(if round < 2 * count { from } else { to }).map_or(0.0, |edge| edge.length);
        let most = get(&sizes, from) + GROWTH * step;
        sizes.iter_mut().skip(to).take(1).for_each(|size| *size = size.min(most));
    }
    sizes
}

/// Edges at sharp corners that have to be split so that both are alike there, and where: the distance from the beginning of an
/// edge, negative from its end.
fn alike(ring: &[Edge], corners: &[f64]) -> Vec<(usize, f64)> {
    let count = ring.len();
    let mut splits = Vec::new();
    for (at, _) in corners.iter().enumerate().filter(|(_, cosine)| **cosine > SHARP[1]) {
        let before = (at + count - 1) % count;
        let (Some(one), Some(other)) = (ring.get(before), ring.get(at)) else { continue };
        let [(short, low, sign), (long, high, turn)] = if one.length <= other.length {
            [(before, one.length, -1.0), (at, other.length, 1.0)]
        } else {
            [(at, other.length, 1.0), (before, one.length, -1.0)]
        };
        if high <= ALIKE * low {
            continue;
        }
        if high >= 1.5 * low {
            splits.push((long, turn * low));
        } else {
            splits.extend([(long, turn * 0.6 * low), (short, sign * 0.6 * low)]);
        }
    }
    splits.sort_by(|a: &(usize, f64), b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    splits
}

/// Pieces of an edge: the integral of 1 over the length wanted, which is linear along it.
fn pieces(length: f64, [low, high]: [f64; 2]) -> usize {
    let wanted = integral(length, [low, high], 1.0);
    (wanted - SLACK).ceil().clamp(1.0, PIECES) as usize
}

/// The integral over the first part of an edge.
fn integral(length: f64, [low, high]: [f64; 2], share: f64) -> f64 {
    let slope = high - low;
    if slope.abs() <= 1e-6 * low { share * length / low } else { length / slope * (1.0 + slope / low * share).ln() }
}

/// The share of an edge up to which the integral has a value.
fn inverse(length: f64, [low, high]: [f64; 2], value: f64) -> f64 {
    let slope = high - low;
    let share =
        if slope.abs() <= 1e-6 * low { value * low / length } else { low / slope * ((value * slope / length).exp() - 1.0) };
    share.clamp(0.0, 1.0)
}

/// Samples of a curve with edges split as wished.
fn split(wishes: &[Wish], shares: &[f64], points: &[Point]) -> Vec<f64> {
    let mut split = Vec::with_capacity(2 * shares.len());
    for (number, pair) in shares.windows(2).enumerate() {
        let &[a, b] = pair else { continue };
        split.push(a);
        let own =
            wishes.iter().skip(wishes.partition_point(|wish| wish.number < number)).take_while(|wish| wish.number == number);
        let length = points.get(number..number + 2).map_or(0.0, |ends| distance(ends[0], ends[1]));
        let mut lengths = [f64::INFINITY; 2];
        let mut first: Option<f64> = None;
        for wish in own {
            lengths = [0, 1].each(|end| lengths[end].min(wish.lengths[end]));
            first = wish.first.or(first);
        }
        let count = if lengths[0].is_finite() { pieces(length, lengths) } else { 1 };
        if count > 1 {
            let whole = integral(length, lengths, 1.0);
            split.extend((1..count).map(|piece| a + (b - a) * inverse(length, lengths, whole * piece as f64 / count as f64)));
        } else if let Some(from) = first {
            let share = if from < 0.0 { 1.0 + from / length } else { from / length };
            split.extend((share > 0.0 && share < 1.0).then_some(a + (b - a) * share));
        }
    }
    split.extend(shares.last());
    split
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::curve::Shape;
    use crate::curves::vector::between;

    /// Lengths of edges around a polygon whose sides are curves of one edge each at first.
    fn around(corners: &[[f64; 2]]) -> Vec<f64> {
        let point = |at: usize| [corners[at % corners.len()][0], corners[at % corners.len()][1], 0.0];
        let shapes: Vec<Shape> = (0..corners.len()).map(|at| Shape::Line([point(at), point(at + 1)])).collect();
        let strands: Vec<Option<Strand<'_>>> = shapes.iter().map(|shape| Some(Strand::new(shape))).collect();
        let uses: Vec<Use> = (0..corners.len()).map(|curve| Use { curve, is_reversed: false }).collect();
        let mut samples = vec![vec![0.0, 1.0]; corners.len()];
        graded(&strands, &[vec![&uses]], &mut samples);
        let on = |at: usize, t: f64| between(point(at), point(at + 1), t);
        let lengths = |(at, shares): (usize, &Vec<f64>)| -> Vec<f64> {
            shares.windows(2).map(|pair| distance(on(at, pair[0]), on(at, pair[1]))).collect()
        };
        samples.iter().enumerate().flat_map(lengths).collect()
    }

    /// Beside a side of 0.01, those of 1 begin with short edges: none is thrice as long as its neighbour.
    #[test]
    fn edges_grow_slowly() {
        let lengths = around(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.01]]);
        let next = lengths.iter().cycle().skip(1);
        assert!(lengths.iter().zip(next).all(|(a, b)| a.max(*b) < 3.0 * a.min(*b)), "{lengths:?}");
    }

    /// In a strip 0.1 wide, edges are no longer than 0.2 and what may be left without a split.
    #[test]
    fn edges_are_no_longer_than_gaps_allow() {
        let lengths = around(&[[0.0, 0.0], [2.0, 0.0], [2.0, 0.1], [0.0, 0.1]]);
        assert!(lengths.iter().all(|length| *length <= GAP * 0.1 * (1.0 + SLACK)), "{lengths:?}");
        assert_eq!(around(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), [1.0; 4]);
    }

    /// A corner of 20° between sides of 2 and 1: their first edges are alike.
    #[test]
    fn edges_of_a_sharp_corner_are_alike() {
        let (sin, cos) = 20.0_f64.to_radians().sin_cos();
        let lengths = around(&[[0.0, 0.0], [2.0, 0.0], [cos, sin]]);
        let (first, last) = (lengths[0], lengths[lengths.len() - 1]);
        assert!(first.max(last) <= ALIKE * first.min(last), "{lengths:?}");
    }
}
