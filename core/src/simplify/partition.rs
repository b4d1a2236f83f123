//! Cells of space: a kd tree over the vertices, whose leaves hold about so many each.
//!
//! A cell is a half-open box, so that the hull of vertices of one cell lies within it, and triangles of different cells have nothing in common: not even a
//! point. What is done to the triangles of one cell, within its box, can make them cross no triangle of another cell.

use crate::geometry::exact::Point;
use crate::geometry::sums::Bounds;

/// So many vertices tell where a plane is to be, about.
const SAMPLE: usize = 1 << 10;

/// A half-open box: from `lo`, and before `hi`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    pub(super) lo: Point,
    pub(super) hi: Point,
    /// Its vertices, in the order of [`Partition::order`].
    pub(super) start: usize,
    pub(super) end: usize,
}

impl Cell {
    #[inline]
    pub(super) fn holds(&self, p: &Point) -> bool {
        (0..3).all(|k| self.lo[k] <= p[k] && p[k] < self.hi[k])
    }
}

/// All cells, and what is in them.
pub(super) struct Partition {
    pub(super) cells: Vec<Cell>,
    /// Vertices by cells; by number within a cell.
    pub(super) order: Vec<u32>,
    /// Planes, each with the two it parts; a leaf is the number of a cell.
    nodes: Vec<Node>,
}

enum Node {
    Leaf(u32),
    Plane { axis: usize, at: f32, below: usize, above: usize },
}

/// One node of the tree before it has a number.
enum Branch {
    Leaf(Cell),
    Plane { axis: usize, at: f32, below: Box<Branch>, above: Box<Branch> },
}

/// How to part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Planes {
    /// Vertices of a cell, at most, unless no plane parts them.
    pub(super) most: usize,
    /// The share of vertices below each plane.
    pub(super) below: f64,
    /// The box that is parted: from the first corner, and before the second one. Vertices may lie outside, and stay then.
    pub(super) within: [Point; 2],
}

/// The box around all of space.
pub(super) const EVERYWHERE: [Point; 2] = [[f32::NEG_INFINITY; 3], [f32::INFINITY; 3]];

impl Partition {
    /// O(n log n).
    pub(super) fn new(points: &[Point], planes: Planes) -> Self {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        let [lo, hi] = planes.within;
        let whole = Cell { lo, hi, start: 0, end: points.len() };
        let branch = part(points, &mut order, whole, planes);
        let (mut cells, mut nodes) = (Vec::new(), Vec::new());
        number(branch, &mut cells, &mut nodes);
        Self { cells, order, nodes }
    }

    /// Visits the cells that a box meets.
    pub(super) fn each_meeting(&self, bounds: &Bounds, visit: &mut impl FnMut(usize)) {
        let mut waiting = vec![self.nodes.len().wrapping_sub(1)];
        while let Some(node) = waiting.pop().and_then(|i| self.nodes.get(i)) {
            match node {
                Node::Leaf(cell) => visit(*cell as usize),
                Node::Plane { axis, at, below, above } => {
                    if bounds.lo[*axis] < *at {
                        waiting.push(*below);
                    }
                    if bounds.hi[*axis] >= *at {
                        waiting.push(*above);
                    }
                }
            }
        }
    }
}

fn part(points: &[Point], order: &mut [u32], cell: Cell, planes: Planes) -> Branch {
    if order.len() <= planes.most {
        order.sort_unstable();
        return Branch::Leaf(cell);
    }
    let Some((axis, at, count)) = plane(points, order, planes) else {
        order.sort_unstable();
        return Branch::Leaf(cell);
    };
    let (low, high) = order.split_at_mut(count);
    let (mut below, mut above) = (cell, cell);
    (below.hi[axis], above.lo[axis]) = (at, at);
    (below.end, above.start) = (cell.start + count, cell.start + count);
    let (below, above) = rayon::join(|| part(points, low, below, planes), || part(points, high, above, planes));
    Branch::Plane { axis, at, below: Box::new(below), above: Box::new(above) }
}

/// A plane with vertices on both sides, across the longest side if there is one, and how many are below; these are put first.
fn plane(points: &[Point], order: &mut [u32], planes: Planes) -> Option<(usize, f32, usize)> {
    let mut bounds = Bounds::EMPTY;
    order.iter().for_each(|v| bounds.include(&[points[*v as usize]]));
    let width = |k: &usize| f64::from(bounds.hi[*k]) - f64::from(bounds.lo[*k]);
    let mut axes = [0, 1, 2];
    axes.sort_by(|a, b| width(b).total_cmp(&width(a)));
    for axis in axes.into_iter().filter(|k| width(k) > 0.0) {
        let along = |v: &u32| points[*v as usize][axis];
        let mut some: Vec<f32> = order.iter().step_by(order.len().div_ceil(SAMPLE)).map(along).collect();
        some.sort_unstable_by(f32::total_cmp);
        let rank = (some.len() as f64 * planes.below) as usize;
        let middle = some.get(rank).copied().unwrap_or(bounds.lo[axis]);
        let part_at = |order: &mut [u32], at: f32| {
            let count = partition_in_place(order, |v| along(v) < at);
            (count > 0 && count < order.len()).then_some((axis, at, count))
        };
        if let Some(plane) = part_at(order, middle) {
            return Some(plane);
        }
        // Where many are at the plane, the next one above it parts as well.
        let next = order.iter().map(along).filter(|x| *x > middle).fold(f32::INFINITY, f32::min);
        if let Some(plane) = part_at(order, next) {
            return Some(plane);
        }
    }
    None
}

/// Puts those that are `below` first, and counts them.
fn partition_in_place(order: &mut [u32], below: impl Fn(&u32) -> bool) -> usize {
    let mut count = 0;
    for i in 0..order.len() {
        if below(&order[i]) {
            order.swap(i, count);
            count += 1;
        }
    }
    count
}

fn number(branch: Branch, cells: &mut Vec<Cell>, nodes: &mut Vec<Node>) -> usize {
    let node = match branch {
        Branch::Leaf(cell) => {
            cells.push(cell);
            Node::Leaf(cells.len() as u32 - 1)
        }
        Branch::Plane { axis, at, below, above } => {
            let below = number(*below, cells, nodes);
            let above = number(*above, cells, nodes);
            Node::Plane { axis, at, below, above }
        }
    };
    nodes.push(node);
    nodes.len() - 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn each_vertex_is_in_one_cell_and_boxes_find_theirs(p in prop::collection::vec(prop::array::uniform3(-5i8..6), 0..200), below in 0.2..0.8) {
            let points: Vec<Point> = p.iter().map(|v| v.map(f32::from)).collect();
            let partition = Partition::new(&points, Planes { most: 7, below, within: EVERYWHERE });
            let mut seen = vec![0; points.len()];
            for (i, cell) in partition.cells.iter().enumerate() {
                for v in &partition.order[cell.start..cell.end] {
                    seen[*v as usize] += 1;
                    let p = points[*v as usize];
                    prop_assert!(cell.holds(&p));
                    let mut found = Vec::new();
                    partition.each_meeting(&Bounds::of(&[p]), &mut |c| found.push(c));
                    prop_assert_eq!(found, vec![i]);
                }
                let own = &partition.order[cell.start..cell.end];
                let first = own.first().map(|v| points[*v as usize]);
                prop_assert!(own.len() <= 7 || own.iter().all(|v| Some(points[*v as usize]) == first), "only copies cannot be parted");
            }
            prop_assert!(seen.iter().all(|n| *n == 1));
        }
    }
}
