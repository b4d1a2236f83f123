//! Faces of networks: cycles that bound one face each.
//!
//! Candidates are shortest cycles through each edge and one of its neighbours around a node, as in a minimum cycle basis (J. D. Horton, *A
//! polynomial-time algorithm to find the shortest cycle basis of a graph*, 1987), but found by local searches that keep to one side of each edge:
//! they turn only to the next edge there in the order around a node, so that a ring around a tube is none. Which side is which at the
//! other end of an edge follows from the normal there, compared with the one that is moved along the edge; where it does not, both are tried. The shortest are taken first, as long as no edge bounds more than
//! two faces, and no corner more than one. Then the edges that may still bound one are joined to longer chains, and it begins again: so
//! faces of many sides are found, too.
//!
//! The last cycle of a part that it closes is a face only if it does not go around all others: if it is no longer than the longest of them, or
//! its area is less than half of theirs, or less than 9/10 where it has no more sides than they, or is flat. So the outline of a flat network is no face, and the bottom of
//! a box, or of a tetrahedron, is one.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet};

use super::edge::{Edge, ends};
use super::graph::{Star, append, contracted, in_cycles};
use super::rotation;
use crate::curves::curve::Shape;
use crate::curves::network::Use;
use crate::curves::vector::{Point, add, cross, dot, norm, scale, sub, unit};

/// Edges that a search looks at, and cycles that it gives, at most.
const MOST_STEPS: usize = 192;
const MOST_CYCLES: usize = 3;
/// Rounds, at most.
const ROUNDS: u32 = 32;
/// How far points of a flat cycle may be from its plane, in sizes.
const FLAT: f64 = 1e-5;
/// Neighbours of an edge around a node where their order is not heeded.
const MOST_NEIGHBOURS: usize = 16;

/// What was found.
#[derive(Debug, Default)]
pub(super) struct Found {
    /// Curves around each face.
    pub(super) cells: Vec<Vec<Use>>,
    /// Chains that bound none.
    pub(super) unresolved: Vec<usize>,
}

/// A cycle of chains; `curve` in a use is the number of a chain here.
#[derive(Clone, Debug)]
struct Cycle {
    length: f64,
    key: Vec<usize>,
    uses: Vec<Use>,
}

/// A part of the surface: faces that share edges.
#[derive(Clone, Copy, Debug)]
struct Patch {
    parent: usize,
    open: i64,
    area: f64,
    longest: f64,
    sides: usize,
}

struct Cells<'a, 'b> {
    chains: &'a [Edge],
    nodes: usize,
    shape: &'a dyn Fn(&Use) -> Option<&'b Shape>,
    /// Faces that each chain bounds.
    bounds: Vec<Vec<(usize, bool)>>,
    corners: HashSet<(usize, usize)>,
    patches: Vec<Patch>,
    cells: Vec<Vec<Use>>,
}

/// Finds the faces between chains.
pub(super) fn find<'b>(chains: &[Edge], nodes: usize, shape: &dyn Fn(&Use) -> Option<&'b Shape>) -> Found {
    let (bounds, corners, patches, found) = (vec![Vec::new(); chains.len()], HashSet::new(), Vec::new(), Vec::new());
    let mut cells = Cells { chains, nodes, shape, bounds, corners, patches, cells: found };
    let mut heeds_order = true;
    for _ in 0..ROUNDS {
        let candidates = cells.candidates(heeds_order);
        let before = cells.cells.len();
        candidates.into_iter().for_each(|cycle| cells.take(cycle));
        if cells.cells.len() == before {
            if !heeds_order {
                break;
            }
            heeds_order = false;
        }
    }
    cells.orient();
    let unresolved = (0..chains.len()).filter(|chain| cells.bounds.get(*chain).is_some_and(Vec::is_empty)).collect();
    let expand = |cell: &Vec<Use>| {
        let mut uses = Vec::new();
        for one in cell {
            append(&mut uses, chains.get(one.curve).map(|chain| chain.parts.as_slice()).unwrap_or_default(), one.is_reversed);
        }
        uses
    };
    Found { cells: cells.cells.iter().map(expand).collect(), unresolved }
}

impl Cells<'_, '_> {
    fn bounds(&self, chain: usize) -> &[(usize, bool)] {
        self.bounds.get(chain).map(Vec::as_slice).unwrap_or_default()
    }

    /// Cycles of edges that may still bound a face, the shortest first.
    fn candidates(&self, heeds_order: bool) -> Vec<Cycle> {
        let alone =
            |(number, chain): (usize, &Edge)| Edge { parts: vec![Use { curve: number, is_reversed: false }], ..chain.clone() };
        let active: Vec<Edge> = self
            .chains
            .iter()
            .enumerate()
            .map(alone)
            .filter(|edge| edge.parts.iter().all(|part| self.bounds(part.curve).len() < 2))
            .collect();
        let live = in_cycles(&active, self.nodes);
        let live: Vec<&Edge> = active.iter().zip(live).filter(|(_, is_live)| *is_live).map(|(edge, _)| edge).collect();
        let (rings, edges): (Vec<Edge>, Vec<Edge>) =
            contracted(&live, self.nodes).into_iter().partition(|edge| edge.nodes[0] == edge.nodes[1]);
        let mut cycles: Vec<Cycle> = rings.into_iter().map(|ring| cycle(ring.length, ring.parts)).collect();
        let turns = self.turns(&edges, heeds_order);
        let mut search = Search::new(&edges, &turns);
        for half in 0..2 * edges.len() {
            for side in 0..2 {
                search.from(2 * half + side, &mut cycles);
            }
        }
        cycles.sort_by(|a, b| a.length.total_cmp(&b.length).then_with(|| a.key.cmp(&b.key)));
        cycles.dedup_by(|a, b| a.key == b.key);
        cycles
    }

    /// Where faces may turn at each end of each edge.
    fn turns(&self, edges: &[Edge], heeds_order: bool) -> Turns {
        let star = Star::of(edges.iter(), self.nodes);
        let mut turns = Turns { next: vec![Next::Any(Vec::new()); 2 * edges.len()], signs: vec![0; edges.len()] };
        let mut normals: Vec<Option<Point>> = vec![None; self.nodes];
        for (node, place_of_normal) in normals.iter_mut().enumerate() {
            let at = star.at(node as u32);
            let half = |place: usize| at.get(place).map_or(0, |(edge, side)| 2 * *edge as usize + usize::from(*side));
            let tangents =
                || at.iter().map(|(edge, side)| self.tangent(edges.get(*edge as usize)?, *side)).collect::<Option<Vec<_>>>();
            let order =
                if heeds_order && at.len() > 2 { tangents().and_then(|tangents| rotation::order(&tangents)) } else { None };
            for place in 0..at.len() {
                let next = match order.as_ref().and_then(|order| order.next.get(place)) {
                    Some(both) => Next::Ordered(both.map(half)),
                    None => Next::Any((1..at.len().min(MOST_NEIGHBOURS)).map(|step| half((place + step) % at.len())).collect()),
                };
                turns.next.iter_mut().skip(half(place)).take(1).for_each(|to| to.clone_from(&next));
            }
            *place_of_normal = order.map(|order| order.normal);
        }
        for (edge, sign) in edges.iter().zip(&mut turns.signs) {
            let [from, to] = edge.nodes.map(|node| normals.get(node as usize).copied().flatten());
            let moved = from.and_then(|normal| self.moved(edge, normal));
            let cosine = moved.zip(to).map_or(0.0, |((moved, along), normal)| rotation::cosine_about(along, moved, normal));
            *sign = if cosine.abs() < 0.2 { 0 } else { cosine.signum() as i8 };
        }
        turns
    }

    /// A normal at the beginning of an edge, moved along it without a twist, and the direction in which the edge ends.
    fn moved(&self, edge: &Edge, normal: Point) -> Option<(Point, Point)> {
        let mut normal = normal;
        let mut last: Option<Point> = None;
        for part in &edge.parts {
            let mut uses = Vec::new();
            append(&mut uses, &self.chains.get(part.curve)?.parts, part.is_reversed);
            for one in uses {
                let shape = (self.shape)(&one)?;
                let [low, high] = shape.domain();
                let steps = if matches!(shape, Shape::Line(_)) { 0 } else { 12 };
                for step in 0..=steps {
                    let share = f64::from(step) / f64::from(steps.max(1));
                    let share = if one.is_reversed { 1.0 - share } else { share };
                    let tangent = unit(shape.derivative(low + (high - low) * share));
                    // A point where the curve has no direction is passed over.
                    let Some(tangent) = tangent.map(|tangent| scale(tangent, if one.is_reversed { -1.0 } else { 1.0 })) else {
                        continue;
                    };
                    if let Some(last) = last {
                        normal = rotation::transported(normal, last, tangent)?;
                    }
                    last = Some(tangent);
                }
            }
        }
        last.map(|last| (normal, last))
    }

    /// The direction in which an edge leaves its end, and where it is a little later.
    fn tangent(&self, edge: &Edge, side: u8) -> Option<[Point; 2]> {
        let at_end = side == 1;
        let part = if at_end { edge.parts.last() } else { edge.parts.first() }?;
        let chain = self.chains.get(part.curve)?;
        // The end of the edge is an end of a chain, which is one of a curve.
        let at_end = at_end != part.is_reversed;
        let one = if at_end { chain.parts.last() } else { chain.parts.first() }?;
        let shape = (self.shape)(one)?;
        let at_end = at_end != one.is_reversed;
        let [low, high] = shape.domain();
        let (from, later, sign) =
            if at_end { (high, high - 0.1 * (high - low), -1.0) } else { (low, low + 0.1 * (high - low), 1.0) };
        let (point, derivative) = shape.point_and_derivative(from);
        let chord = sub(shape.point(later), point);
        let tangent = scale(derivative, sign);
        Some([if norm(tangent) > 0.0 { tangent } else { chord }, chord])
    }

    /// Takes a cycle for a face, unless it shares too much with others or goes around them all.
    fn take(&mut self, cycle: Cycle) {
        if cycle.key.iter().any(|chain| self.bounds(*chain).len() >= 2) {
            return;
        }
        let corners = corners(&cycle.uses);
        if corners.iter().any(|corner| self.corners.contains(corner)) {
            return;
        }
        let mut joined: Vec<usize> =
            cycle.key.iter().filter_map(|chain| self.bounds(*chain).first()).map(|(cell, _)| *cell).collect();
        joined.iter_mut().for_each(|cell| *cell = self.root(*cell));
        joined.sort_unstable();
        joined.dedup();
        let shared = cycle.key.iter().filter(|chain| !self.bounds(**chain).is_empty()).count() as i64;
        let area = norm(self.area(&cycle.uses));
        let of = |patch: &usize| self.patches.get(*patch).copied();
        let others = joined.iter().filter_map(of);
        let (open, sum, longest, sides) = others.fold((0, 0.0, 0.0_f64, 0), |(open, area, longest, sides), patch| {
            (open + patch.open, area + patch.area, longest.max(patch.longest), sides.max(patch.sides))
        });
        let open = open + cycle.key.len() as i64 - 2 * shared;
        let own = cycle.key.len();
        let share = if own <= sides || self.is_flat(&cycle.uses) { 0.9 } else { 0.5 };
        let is_face = open > 0 || cycle.length <= longest * (1.0 + 1e-9) || area < share * sum;
        if !is_face {
            return;
        }
        let number = self.cells.len();
        self.patches.push(Patch {
            parent: number,
            open,
            area: area + sum,
            longest: longest.max(cycle.length),
            sides: sides.max(own),
        });
        for patch in joined {
            self.patches.iter_mut().skip(patch).take(1).for_each(|patch| patch.parent = number);
        }
        for one in &cycle.uses {
            self.bounds.iter_mut().skip(one.curve).take(1).for_each(|bounds| bounds.push((number, one.is_reversed)));
        }
        self.corners.extend(corners);
        self.cells.push(cycle.uses);
    }

    fn root(&mut self, mut of: usize) -> usize {
        while let Some(next) = self.patches.get(of).map(|patch| patch.parent).filter(|next| *next != of) {
            let after = self.patches.get(next).map_or(next, |patch| patch.parent);
            self.patches.iter_mut().skip(of).take(1).for_each(|patch| patch.parent = after);
            of = after;
        }
        of
    }

    /// The vector area of a cycle.
    fn area(&self, uses: &[Use]) -> Point {
        let points = self.points(uses);
        let first = points.first().copied().unwrap_or_default();
        let triangle = |pair: &[Point]| if let &[a, b] = pair { cross(sub(a, first), sub(b, first)) } else { [0.0; 3] };
        scale(points.windows(2).map(triangle).fold([0.0; 3], add), 0.5)
    }

    /// Whether a cycle is in a plane.
    fn is_flat(&self, uses: &[Use]) -> bool {
        let (points, normal) = (self.points(uses), unit(self.area(uses)).unwrap_or_default());
        let first = points.first().copied().unwrap_or_default();
        let size = points.iter().fold(0.0_f64, |most, point| most.max(norm(sub(*point, first))));
        points.iter().all(|point| dot(sub(*point, first), normal).abs() <= FLAT * size)
    }

    /// Points of a cycle: 8 on each curve, one on a line.
    fn points(&self, uses: &[Use]) -> Vec<Point> {
        let mut points: Vec<Point> = Vec::new();
        for one in uses {
            let Some(chain) = self.chains.get(one.curve) else { continue };
            let mut parts = Vec::new();
            append(&mut parts, &chain.parts, one.is_reversed);
            for part in parts {
                let Some(shape) = (self.shape)(&part) else { continue };
                if matches!(shape, Shape::Line(_)) {
                    points.push(ends(shape, part.is_reversed)[0]);
                    continue;
                }
                let [low, high] = shape.domain();
                points.extend((0..8).map(|step| {
                    let share = f64::from(step) / 8.0;
                    shape.point(low + (high - low) * if part.is_reversed { 1.0 - share } else { share })
                }));
            }
        }
        points
    }

    /// Turns faces round so that two that share an edge follow it in opposite directions, as far as that is possible.
    fn orient(&mut self) {
        // 0 not seen yet, 1 as it is, −1 to be turned round.
        let mut sides = vec![0_i8; self.cells.len()];
        for first in 0..self.cells.len() {
            if sides.get(first) != Some(&0) {
                continue;
            }
            let mut queue = vec![(first, 1_i8)];
            while let Some((cell, side)) = queue.pop() {
                let Some(place) = sides.get_mut(cell).filter(|side| **side == 0) else { continue };
                *place = side;
                for one in self.cells.get(cell).into_iter().flatten() {
                    for (other, is_reversed) in self.bounds(one.curve).iter().filter(|(other, _)| *other != cell) {
                        queue.push((*other, if *is_reversed == one.is_reversed { -side } else { side }));
                    }
                }
            }
        }
        for (cell, side) in self.cells.iter_mut().zip(sides) {
            if side < 0 {
                cell.reverse();
                cell.iter_mut().for_each(|one| one.is_reversed = !one.is_reversed);
            }
        }
    }
}

fn cycle(length: f64, uses: Vec<Use>) -> Cycle {
    let mut key: Vec<usize> = uses.iter().map(|one| one.curve).collect();
    key.sort_unstable();
    Cycle { length, key, uses }
}

/// Corners of a cycle: the end of each chain and the beginning of the next, the lower number first.
fn corners(uses: &[Use]) -> Vec<(usize, usize)> {
    let end = |one: &Use| 2 * one.curve + usize::from(!one.is_reversed);
    let start = |one: &Use| 2 * one.curve + usize::from(one.is_reversed);
    let pairs = uses.iter().zip(uses.iter().cycle().skip(1));
    pairs.map(|(one, next)| (end(one).min(start(next)), end(one).max(start(next)))).collect()
}

/// Where a face may turn from the end of an edge.
#[derive(Clone, Debug)]
enum Next {
    /// To the next end anticlockwise, or clockwise, by its side.
    Ordered([usize; 2]),
    /// To any of these.
    Any(Vec<usize>),
}

/// Turns at each end, and for each edge whether both its ends have the same side up: 1, −1, or 0 if nobody knows.
struct Turns {
    next: Vec<Next>,
    signs: Vec<i8>,
}

/// Searches for shortest cycles. A half is an edge from one of its ends on: twice its number, and 1 if from its end. A state is a half and on
/// which side of it the face lies: twice the half, and 1 if clockwise, as seen along the normal where it begins.
struct Search<'a> {
    edges: &'a [Edge],
    turns: &'a Turns,
    /// Of the search that reached a state last: its number, the length, and the state before.
    reached: Vec<(u32, f64, usize)>,
    number: u32,
}

impl<'a> Search<'a> {
    fn new(edges: &'a [Edge], turns: &'a Turns) -> Self {
        Self { edges, turns, reached: vec![(0, 0.0, 0); 4 * edges.len()], number: 0 }
    }

    /// The node where a half begins.
    fn node(&self, half: usize) -> u32 {
        self.edges.get(half / 2).map_or(0, |edge| if half.is_multiple_of(2) { edge.nodes[0] } else { edge.nodes[1] })
    }

    fn length(&self, half: usize) -> f64 {
        self.edges.get(half / 2).map_or(0.0, |edge| edge.length)
    }

    /// States that may follow one.
    fn next(&self, state: usize, to: &mut Vec<usize>) {
        to.clear();
        let (half, side) = (state / 2, state % 2);
        let sides: &[usize] = match (self.turns.signs.get(half / 2), side) {
            (Some(1), 0) | (Some(-1), 1) => &[0],
            (Some(1 | -1), _) => &[1],
            _ => &[0, 1],
        };
        match self.turns.next.get(half ^ 1) {
            // With the face anticlockwise of the edge that it leaves by, it is clockwise of the one that it came by.
            Some(Next::Ordered(both)) => to.extend(sides.iter().filter_map(|side| Some(2 * both.get(1 - side)? + side))),
            Some(Next::Any(all)) => to.extend(all.iter().flat_map(|next| [2 * next, 2 * next + 1])),
            None => {}
        }
    }

    /// Adds the shortest cycles that begin with a state.
    fn from(&mut self, first: usize, cycles: &mut Vec<Cycle>) {
        self.number += 1;
        let home = self.node(first / 2);
        let mut queue = BinaryHeap::new();
        self.reach(first, self.length(first / 2), first, &mut queue);
        let (mut steps, mut found, mut after) = (0, 0, Vec::new());
        while let Some((Reverse(bits), Reverse(state))) = queue.pop() {
            let length = f64::from_bits(bits);
            steps += 1;
            if steps > MOST_STEPS || found >= MOST_CYCLES {
                break;
            }
            self.next(state, &mut after);
            // The end where it arrives is the other half of the same edge.
            if self.node((state / 2) ^ 1) == home {
                if state / 4 != first / 4 && after.contains(&first) {
                    found += 1;
                    cycles.extend(self.cycle(first, state, length));
                }
                continue;
            }
            for next in after.iter().copied().filter(|next| next / 4 != state / 4) {
                let length = length + self.length(next / 2);
                let is_known =
                    self.reached.get(next).is_some_and(|(number, known, _)| *number == self.number && *known <= length);
                if !is_known {
                    self.reach(next, length, state, &mut queue);
                }
            }
        }
    }

    fn reach(&mut self, state: usize, length: f64, before: usize, queue: &mut BinaryHeap<(Reverse<u64>, Reverse<usize>)>) {
        self.reached.iter_mut().skip(state).take(1).for_each(|place| *place = (self.number, length, before));
        // Lengths are not negative, so their bits are in their order.
        queue.push((Reverse(length.to_bits()), Reverse(state)));
    }

    /// The cycle that ends with a state; nothing of one that touches itself.
    fn cycle(&self, first: usize, last: usize, length: f64) -> Option<Cycle> {
        let mut halves = vec![last / 2];
        let mut state = last;
        while state != first && halves.len() <= MOST_STEPS {
            state = self.reached.get(state)?.2;
            halves.push(state / 2);
        }
        halves.reverse();
        let mut nodes: Vec<u32> = halves.iter().map(|half| self.node(*half)).collect();
        nodes.sort_unstable();
        if nodes.windows(2).any(|pair| pair.first() == pair.last()) {
            return None;
        }
        let mut uses = Vec::new();
        for half in halves {
            append(&mut uses, &self.edges.get(half / 2)?.parts, !half.is_multiple_of(2));
        }
        Some(cycle(length, uses))
    }
}
