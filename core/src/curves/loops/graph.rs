//! The graph of curves: what is in a cycle at all, and chains between points where three or more meet.

use super::edge::Edge;
use crate::curves::network::Use;

/// Edges at each node: an edge and which of its ends.
pub(super) struct Star {
    starts: Vec<usize>,
    ends: Vec<(u32, u8)>,
}

impl Star {
    /// Of edges that are alive. O(nodes + edges).
    pub(super) fn of<'a>(edges: impl Iterator<Item = &'a Edge> + Clone, nodes: usize) -> Self {
        let mut starts = vec![0_usize; nodes + 1];
        for node in edges.clone().flat_map(|edge| edge.nodes) {
            starts.iter_mut().skip(node as usize + 1).take(1).for_each(|count| *count += 1);
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        let mut next = starts.clone();
        let mut ends = vec![(0, 0); sum];
        for (number, edge) in edges.enumerate() {
            for (side, node) in edge.nodes.into_iter().enumerate() {
                if let Some(place) = next.get_mut(node as usize) {
                    ends.iter_mut().skip(*place).take(1).for_each(|end| *end = (number as u32, side as u8));
                    *place += 1;
                }
            }
        }
        Self { starts, ends }
    }

    /// Ends of edges at a node.
    pub(super) fn at(&self, node: u32) -> &[(u32, u8)] {
        let from = self.starts.get(node as usize).copied().unwrap_or(0);
        let to = self.starts.get(node as usize + 1).copied().unwrap_or(from);
        self.ends.get(from..to).unwrap_or_default()
    }
}

/// The node at the other end.
pub(super) fn across(edge: &Edge, side: u8) -> u32 {
    let [start, end] = edge.nodes;
    if side == 0 { end } else { start }
}

/// Whether each edge is in a cycle: not a bridge (R. E. Tarjan, *A note on finding the bridges of a graph*, 1974), which edges that lead nowhere are, too.
/// O(nodes + edges).
pub(super) fn in_cycles(edges: &[Edge], nodes: usize) -> Vec<bool> {
    let star = Star::of(edges.iter(), nodes);
    let mut in_cycles = vec![true; edges.len()];
    // When a node was first seen, from 1, and the earliest that it or what hangs on it leads back to.
    let (mut seen, mut back) = (vec![0_u32; nodes], vec![0_u32; nodes]);
    let mut clock = 0;
    let get = |list: &[u32], node: u32| list.get(node as usize).copied().unwrap_or(0);
    let set =
        |list: &mut [u32], node: u32, value: u32| list.iter_mut().skip(node as usize).take(1).for_each(|place| *place = value);
    for root in 0..nodes as u32 {
        if get(&seen, root) > 0 {
            continue;
        }
        clock += 1;
        set(&mut seen, root, clock);
        set(&mut back, root, clock);
        // A node, the edge that led there, and how many of its edges are done.
        let mut path = vec![(root, u32::MAX, 0_usize)];
        while let Some((node, by, next)) = path.last_mut() {
            let (node, by) = (*node, *by);
            if let Some(&(number, side)) = star.at(node).get(*next) {
                *next += 1;
                let Some(edge) = edges.get(number as usize).filter(|_| number != by) else { continue };
                let other = across(edge, side);
                if get(&seen, other) == 0 {
                    clock += 1;
                    set(&mut seen, other, clock);
                    set(&mut back, other, clock);
                    path.push((other, number, 0));
                } else {
                    let earliest = get(&back, node).min(get(&seen, other));
                    set(&mut back, node, earliest);
                }
                continue;
            }
            path.pop();
            if let Some((before, ..)) = path.last() {
                let earliest = get(&back, *before).min(get(&back, node));
                set(&mut back, *before, earliest);
                if get(&back, node) > get(&seen, *before) {
                    in_cycles.iter_mut().skip(by as usize).take(1).for_each(|place| *place = false);
                }
            }
        }
    }
    in_cycles
}

/// Edges joined to chains wherever just two meet; whole rings become edges from a node to itself. O(nodes + parts).
pub(super) fn contracted(edges: &[&Edge], nodes: usize) -> Vec<Edge> {
    let star = Star::of(edges.iter().copied(), nodes);
    let mut done = vec![false; edges.len()];
    let mut chains = Vec::new();
    let branches = (0..nodes as u32).filter(|node| !matches!(star.at(*node).len(), 0 | 2));
    for node in branches {
        for (number, side) in star.at(node) {
            chains.extend(follow(edges, &star, &mut done, *number, *side));
        }
    }
    for number in 0..edges.len() as u32 {
        chains.extend(follow(edges, &star, &mut done, number, 0));
    }
    chains
}

/// Follows an edge, from one of its ends on, as far as there is one way to go.
fn follow(edges: &[&Edge], star: &Star, done: &mut [bool], number: u32, side: u8) -> Option<Edge> {
    let (mut number, mut side) = (number, side);
    let [start, end] = edges.get(number as usize)?.nodes;
    let first = if side == 0 { start } else { end };
    let mut chain = Edge { nodes: [first, first], length: 0.0, parts: Vec::new() };
    loop {
        let edge = edges.get(number as usize)?;
        let place = done.get_mut(number as usize)?;
        if std::mem::replace(place, true) {
            break;
        }
        chain.length += edge.length;
        append(&mut chain.parts, &edge.parts, side == 1);
        let node = across(edge, side);
        chain.nodes[1] = node;
        let &[one, other] = star.at(node) else { break };
        let next = if one.0 == number { other } else { one };
        // Both ends of a ring of one edge.
        if next.0 == number {
            break;
        }
        (number, side) = next;
    }
    (!chain.parts.is_empty()).then_some(chain)
}

/// Adds parts in their order, or all the other way.
pub(super) fn append(to: &mut Vec<Use>, parts: &[Use], is_reversed: bool) {
    if is_reversed {
        to.extend(parts.iter().rev().map(|part| Use { is_reversed: !part.is_reversed, ..*part }));
    } else {
        to.extend(parts);
    }
}
