//! A curve between two points, as an edge of a graph.

use crate::curves::curve::Shape;
use crate::curves::network::Use;
use crate::curves::vector::Point;

/// A curve between two points of the graph, or several one behind the other.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Edge {
    pub(super) nodes: [u32; 2],
    pub(super) length: f64,
    pub(super) parts: Vec<Use>,
}

/// Both ends of a curve in the direction of a loop.
pub(super) fn ends(shape: &Shape, is_reversed: bool) -> [Point; 2] {
    let [start, end] = shape.ends();
    if is_reversed { [end, start] } else { [start, end] }
}
