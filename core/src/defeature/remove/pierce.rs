//! Whether new triangles would pass through surface that stays.

use super::super::mesh::Mesh;
use super::super::vector::{self, Point, dot, sub, unit};
use super::plan::Edit;
use robust::{Coord3D, orient3d};

/// Triangles of a leaf.
const LEAF: usize = 8;

type Box3 = [Point; 2];

/// A tree of boxes around triangles: median splits along the longest side, children one after the other.
pub(crate) struct Tree {
    order: Vec<u32>,
    /// Box, first and end place in the order, and the number of the second child (0 of leaves; the first one follows its parent).
    nodes: Vec<(Box3, u32, u32, u32)>,
}

impl Tree {
    /// O(n log n).
    pub(crate) fn new(mesh: &Mesh) -> Self {
        let boxes: Vec<Box3> = mesh.triangles.iter().map(|t| around(t.map(|v| mesh.at(v)))).collect();
        let mut tree = Self { order: (0..boxes.len() as u32).collect(), nodes: Vec::new() };
        // Ranges still to be made nodes, with the parent whose second child they are.
        let mut open = vec![(0_usize, boxes.len(), usize::MAX)];
        while let Some((from, to, parent)) = open.pop() {
            let number = tree.nodes.len();
            if let Some(node) = tree.nodes.get_mut(parent) {
                node.3 = number as u32;
            }
            let bounds = tree.order[from..to].iter().map(|t| boxes[*t as usize]).fold(EMPTY, union);
            tree.nodes.push((bounds, from as u32, to as u32, 0));
            if to - from <= LEAF {
                continue;
            }
            let [low, high] = bounds;
            let axis = (0..3).max_by(|a, b| (high[*a] - low[*a]).total_cmp(&(high[*b] - low[*b]))).unwrap_or(0);
            let middle = |t: &u32| boxes[*t as usize][0][axis] + boxes[*t as usize][1][axis];
            let half = (from + to) / 2;
            tree.order[from..to].select_nth_unstable_by(half - from, |a, b| middle(a).total_cmp(&middle(b)).then(a.cmp(b)));
            open.push((half, to, number));
            open.push((from, half, usize::MAX));
        }
        tree
    }

    /// Whether a new triangle of an edit crosses one that stays and shares no corner with it.
    pub(crate) fn is_pierced(&self, mesh: &Mesh, edit: &Edit, removed: impl Fn(u32) -> bool) -> bool {
        let at = |v: u32| edit.at(mesh, v);
        edit.triangles.iter().any(|triangle| {
            let corners = triangle.map(at);
            let hits = |other: u32| {
                let its = mesh.triangles[other as usize];
                !removed(other)
                    && !its.iter().any(|v| triangle.contains(v))
                    && cross(corners, its.map(|v| mesh.at(v)), 0.5 * mesh.flatness())
            };
            self.any(around(corners), hits)
        })
    }

    fn any(&self, bounds: Box3, hits: impl Fn(u32) -> bool) -> bool {
        let mut open = vec![0_u32];
        while let Some(number) = open.pop() {
            let Some((own, from, to, second)) = self.nodes.get(number as usize) else { continue };
            if !overlap(*own, bounds) {
                continue;
            }
            if *second == 0 {
                if self.order[*from as usize..*to as usize].iter().any(|t| hits(*t)) {
                    return true;
                }
            } else {
                open.push(*second);
                open.push(number + 1);
            }
        }
        false
    }
}

const EMPTY: Box3 = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];

fn around(corners: [Point; 3]) -> Box3 {
    corners.into_iter().map(|p| [p, p]).fold(EMPTY, union)
}

fn union([a, b]: Box3, [c, d]: Box3) -> Box3 {
    [[0, 1, 2].map(|k| a[k].min(c[k])), [0, 1, 2].map(|k| b[k].max(d[k]))]
}

fn overlap([a, b]: Box3, [c, d]: Box3) -> bool {
    (0..3).all(|k| a[k] <= d[k] && c[k] <= b[k])
}

/// Whether an edge of one triangle passes through the inside of the other; exact, but for triangles that both lie within a
/// layer: neighbours in one plane, where only rounding crosses.
fn cross(one: [Point; 3], other: [Point; 3], layer: f64) -> bool {
    !is_level(one, other, layer) && (pierces(one, other) || pierces(other, one))
}

/// Whether a triangle lies within a distance of another one's plane.
fn is_level(corners: [Point; 3], [a, b, c]: [Point; 3], layer: f64) -> bool {
    let normal = unit(vector::cross(sub(b, a), sub(c, a)));
    normal.is_some_and(|normal| corners.iter().all(|p| dot(normal, sub(*p, a)).abs() <= layer))
}

fn pierces(edges: [Point; 3], triangle: [Point; 3]) -> bool {
    let side = |[a, b, c]: [Point; 3], d: Point| {
        let coordinate = |[x, y, z]: Point| Coord3D { x, y, z };
        orient3d(coordinate(a), coordinate(b), coordinate(c), coordinate(d))
    };
    let [a, b, c] = triangle;
    let heights = edges.map(|p| side(triangle, p));
    [(0, 1), (1, 2), (2, 0)].into_iter().any(|(i, j)| {
        let (p, q) = (edges[i], edges[j]);
        if heights[i] * heights[j] >= 0.0 {
            return false;
        }
        let turns = [side([p, q, a], b), side([p, q, b], c), side([p, q, c], a)];
        turns.iter().all(|t| *t > 0.0) || turns.iter().all(|t| *t < 0.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_needle_through_a_triangle_crosses_it_and_one_beside_does_not() {
        let flat = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
        let needle = |x: f64| [[x, 1.0, -1.0], [x, 1.0, 1.0], [x + 0.1, 1.0, 1.0]];
        assert!(cross(flat, needle(1.0), 1e-6) && cross(needle(1.0), flat, 1e-6));
        assert!(!cross(flat, needle(5.0), 1e-6));
    }
}
