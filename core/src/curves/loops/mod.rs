//! Closed loops of curves.
//!
//! **In:** curves. **Out:** loops in which each curve is followed by the next, and a list of those that are in none.
//! Components in which each end meets just one other are loops as they are; in those that branch, the faces between the curves are found (`cells`).
//! **Promise:** the same loops for the same curves; O(n log n) for the first kind, near O(n) for networks whose faces have few sides.

mod cells;
mod close;
mod double;
mod edge;
mod graph;
mod rotation;
#[cfg(test)]
mod tests;
mod weld;

use crate::curves::curve::{Curve, Id, Role, Shape, Source};
use crate::curves::network::{Network, Use};
use crate::curves::vector::distance;
use edge::Edge;

/// What is wanted of loops.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Options {
    /// Ends that are no farther apart are the same point, in the unit of the curves; `None`: derived from the data ([`tolerance`]).
    pub tolerance: Option<f64>,
    /// Whether vertices of the file are trusted: ends of different vertices never meet then, however near.
    pub trusts_vertices: bool,
    /// Whether open ends are closed by straight curves, the nearest two first.
    pub closes_gaps: bool,
    /// The longest gap that is closed, in the unit of the curves.
    pub longest_gap: f64,
    /// Whether curves that run where another one does, nowhere farther from it than a thousandth of their length, count as one.
    pub joins_doubles: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { tolerance: None, trusts_vertices: true, closes_gaps: false, longest_gap: f64::INFINITY, joins_doubles: true }
    }
}

/// A closed loop.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Loop {
    /// Its curves, each followed by the next, the last one by the first. Loops that share a curve follow it in opposite directions where the
    /// surface that they make has two sides.
    pub uses: Vec<Use>,
    /// Whether it shares curves or points with others.
    pub is_cell: bool,
}

/// What curves form.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Loops {
    /// The distance at which ends were taken for one.
    pub tolerance: f64,
    /// Closed loops, by the numbers of their first curves.
    pub loops: Vec<Loop>,
    /// Straight curves that close gaps; their numbers follow those of the curves.
    pub added: Vec<Curve>,
    /// Curves that lead nowhere, or from one loop to another.
    pub loose: Vec<usize>,
    /// Curves of networks whose faces were not found.
    pub unresolved: Vec<usize>,
    /// Curves that run where another one does, and that one, which stands for both: surfaces that are trimmed one by one each have their own.
    pub doubles: Vec<(usize, usize)>,
    /// Curves without length, those of poles, generators, and aids of drawing: looked at no further.
    pub left_out: Vec<usize>,
}

/// Finds the loops of curves.
#[must_use]
pub fn find(network: &Network, options: &Options) -> Loops {
    let tolerance = options.tolerance.unwrap_or_else(|| tolerance(network));
    let mut loops = Loops { tolerance, ..Loops::default() };
    let mut taken = Vec::new();
    for (number, curve) in network.curves.iter().enumerate() {
        let length = rough_length(&curve.shape);
        if matches!(curve.role, Role::Free | Role::Edge) && length > 0.0 {
            taken.push((number, length));
        } else {
            loops.left_out.push(number);
        }
    }
    let (mut nodes, count) = weld::nodes(&network.curves, &taken, tolerance, options.trusts_vertices);
    leave_specks(&mut taken, &mut nodes, &mut loops);
    if options.joins_doubles {
        loops.doubles = double::remove(&network.curves, &mut taken, &mut nodes, tolerance);
    }
    if options.closes_gaps {
        let first = network.curves.len();
        for (ends, points) in close::gaps(&network.curves, &taken, &nodes, count, options.longest_gap) {
            let source = Source { id: Id::Place((first + loops.added.len()) as u64), line: 0 };
            let shape = Shape::Line(points);
            let (name, role, vertices) = (Some("closes a gap".into()), Role::Free, None);
            taken.push((first + loops.added.len(), distance(points[0], points[1])));
            nodes.push(ends);
            loops.added.push(Curve { shape, source, name, role, is_blanked: false, vertices });
        }
    }
    let edge = |((number, length), nodes): (&(usize, f64), &[u32; 2])| Edge {
        nodes: *nodes,
        length: *length,
        parts: vec![Use { curve: *number, is_reversed: false }],
    };
    let edges: Vec<Edge> = taken.iter().zip(&nodes).map(edge).collect();
    sort(network, &edges, count, &mut loops);
    loops
}

/// Leaves out curves that begin and end in one point and are hardly longer than the tolerance: the poles of surfaces.
fn leave_specks(taken: &mut Vec<(usize, f64)>, nodes: &mut Vec<[u32; 2]>, loops: &mut Loops) {
    let is_speck = |(_, length): &(usize, f64), [start, end]: &[u32; 2]| start == end && *length <= 4.0 * loops.tolerance;
    let specks: Vec<bool> = taken.iter().zip(nodes.iter()).map(|(one, ends)| is_speck(one, ends)).collect();
    loops.left_out.extend(taken.iter().zip(&specks).filter(|(_, is_speck)| **is_speck).map(|((number, _), _)| *number));
    let (mut of_taken, mut of_nodes) = (specks.iter(), specks.iter());
    taken.retain(|_| of_taken.next() != Some(&true));
    nodes.retain(|_| of_nodes.next() != Some(&true));
    loops.left_out.sort_unstable();
}

/// Sorts edges into loops and what is in none.
fn sort(network: &Network, edges: &[Edge], nodes: usize, loops: &mut Loops) {
    let in_cycles = graph::in_cycles(edges, nodes);
    let numbers = |edge: &Edge| edge.parts.iter().map(|part| part.curve).collect::<Vec<_>>();
    loops.loose = edges.iter().zip(&in_cycles).filter(|(_, is_in)| !**is_in).flat_map(|(edge, _)| numbers(edge)).collect();
    let live: Vec<&Edge> = edges.iter().zip(&in_cycles).filter(|(_, is_in)| **is_in).map(|(edge, _)| edge).collect();
    let (rings, chains): (Vec<Edge>, Vec<Edge>) =
        graph::contracted(&live, nodes).into_iter().partition(|edge| edge.nodes[0] == edge.nodes[1]);
    let mut met = vec![0_u32; nodes];
    for node in chains.iter().chain(&rings).flat_map(|chain| chain.nodes) {
        met.iter_mut().skip(node as usize).take(1).for_each(|count| *count += 1);
    }
    for ring in rings {
        let is_cell = met.get(ring.nodes[0] as usize).is_some_and(|count| *count > 2);
        loops.loops.push(Loop { uses: ring.parts, is_cell });
    }
    let curve = |number: usize| match number.checked_sub(network.curves.len()) {
        None => network.curves.get(number),
        Some(added) => loops.added.get(added),
    };
    let found = cells::find(&chains, nodes, &|one: &Use| curve(one.curve).map(|curve| &curve.shape));
    loops.unresolved = found.unresolved.iter().filter_map(|chain| chains.get(*chain)).flat_map(numbers).collect();
    loops.loops.extend(found.cells.into_iter().map(|uses| Loop { uses, is_cell: true }));
    loops.loops.iter_mut().for_each(|one| rotate(&mut one.uses));
    loops.loops.sort_by(|a, b| a.uses.cmp(&b.uses));
    loops.loose.sort_unstable();
    loops.unresolved.sort_unstable();
}

/// Lets a loop begin with its lowest number.
fn rotate(uses: &mut [Use]) {
    let lowest = uses.iter().enumerate().min_by_key(|(_, one)| **one).map_or(0, |(at, _)| at);
    uses.rotate_left(lowest);
}

/// A length that is good enough to compare curves: of a polygon of 16 points for each piece.
fn rough_length(shape: &Shape) -> f64 {
    if let Shape::Line([a, b]) = shape {
        return distance(*a, *b);
    }
    let [low, high] = shape.domain();
    let point = |number: u32| shape.point(low + (high - low) * f64::from(number) / 16.0);
    let mut last = point(0);
    let mut sum = 0.0;
    for next in (1..=16).map(point) {
        sum += distance(last, next);
        last = next;
    }
    sum
}

/// The distance below which ends are the same point: the largest of three, but never more than 10⁻⁴ of the diagonal of the box around all curves:
/// the file's own resolution; four times the rounding of its longest numbers, by their digits (six at least) and the largest coordinate; 10⁻⁷ of the
/// diagonal. For each end it is an eighth of its curve's length at most, so that no curve shrinks to a point.
#[must_use]
pub fn tolerance(network: &Network) -> f64 {
    let Some([low, high]) = network.bounds() else { return 0.0 };
    let diagonal = distance(low, high);
    let largest = low.iter().chain(&high).fold(0.0_f64, |most, x| most.max(x.abs()));
    let digits = i32::try_from(network.digits).unwrap_or(0);
    // Numbers of few digits are round ones, not rounded ones.
    let rounding = if digits < 6 { 0.0 } else { 4.0 * largest * 10_f64.powi(-digits) };
    network.resolution.unwrap_or(0.0).max(rounding).max(1e-7 * diagonal).min(1e-4 * diagonal)
}
