//! Exact proof that a collapse makes no triangle cross another one, or touch its new vertex: a tree of boxes over the triangles of a cell and all
//! that reach into it, whose boxes grow with the triangles.

use crate::geometry::exact::Point;
use crate::geometry::sums::Bounds;
use crate::geometry::tri_tri::{Triangle, do_cross};
use crate::simplify::patch::{MOST, Patch, Star};
use crate::util::ids::NONE;

/// Triangles of a leaf.
const LEAF: usize = 4;

struct Node {
    bounds: Bounds,
    above: u32,
    /// Of a leaf, its items; of another node, its children.
    first: u32,
    second: u32,
    is_leaf: bool,
}

/// The tree. Items are the faces of the patch, then the obstacles.
pub(super) struct Guard {
    nodes: Vec<Node>,
    order: Vec<u32>,
    leaf_of: Vec<u32>,
    obstacles: Vec<Triangle>,
    faces: usize,
    /// Lent to a question.
    waiting: Vec<u32>,
}

impl Guard {
    /// O(n log n).
    pub(super) fn new(patch: &Patch, obstacles: Vec<Triangle>) -> Self {
        let faces = patch.corners.len() / 3;
        let boxes: Vec<Bounds> = (0..faces)
            .map(|f| {
                let face = patch.face(f);
                if face[0] == NONE { Bounds::EMPTY } else { Bounds::of(&patch.triangle(face)) }
            })
            .chain(obstacles.iter().map(|t| Bounds::of(t)))
            .collect();
        let mut order: Vec<u32> = (0..boxes.len() as u32).filter(|i| !boxes[*i as usize].is_empty()).collect();
        let mut guard = Self {
            nodes: Vec::new(),
            order: Vec::new(),
            leaf_of: vec![NONE; boxes.len()],
            obstacles,
            faces,
            waiting: Vec::new(),
        };
        let count = order.len();
        guard.build(&boxes, &mut order, (0, count), NONE);
        guard.order = order;
        guard
    }

    fn build(&mut self, boxes: &[Bounds], order: &mut [u32], (start, end): (usize, usize), above: u32) -> u32 {
        let number = self.nodes.len() as u32;
        let mut bounds = Bounds::EMPTY;
        order[start..end].iter().for_each(|i| bounds.add(&boxes[*i as usize]));
        let is_leaf = end - start <= LEAF;
        self.nodes.push(Node { bounds, above, first: start as u32, second: end as u32, is_leaf });
        if is_leaf {
            order[start..end].iter().for_each(|i| self.leaf_of[*i as usize] = number);
            return number;
        }
        let width = |k: usize| f64::from(bounds.hi[k]) - f64::from(bounds.lo[k]);
        let axis = (1..3).fold(0, |longest, k| if width(k) > width(longest) { k } else { longest });
        let middle = |i: &u32| f64::from(boxes[*i as usize].lo[axis]) + f64::from(boxes[*i as usize].hi[axis]);
        let half = (end - start) / 2;
        order[start..end].select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)).then(a.cmp(b)));
        let first = self.build(boxes, order, (start, start + half), number);
        let second = self.build(boxes, order, (start + half, end), number);
        let node = &mut self.nodes[number as usize];
        (node.first, node.second) = (first, second);
        number
    }

    /// May `u` and `v`, whose stars these are, become one at `to`?
    pub(super) fn allows(&mut self, patch: &Patch, [u, v]: [u32; 2], to: &Point, of_u: &Star, of_v: &Star) -> bool {
        let stays = *to == patch.points[v as usize];
        let mut new: [Triangle; 2 * MOST] = [[[0.0; 3]; 3]; 2 * MOST];
        let mut count = 0;
        let mut changed = 0;
        for (star, gone) in [(of_u, v), (of_v, u)] {
            for (_, ring) in star.iter().filter(|(_, ring)| !ring.contains(&gone)) {
                new[count] = [*to, patch.points[ring[0] as usize], patch.points[ring[1] as usize]];
                count += 1;
            }
            if gone == v || !stays {
                changed = count;
            }
        }
        let new = &new[..count];
        let folds = (0..changed).any(|i| (i + 1..count).any(|j| do_cross(&new[i], &new[j])));
        !folds && new[..changed].iter().all(|t| !self.meets(patch, t, to, [u, v]))
    }

    /// Does a triangle cross one that has neither of two vertices, or has this one a corner at `to`?
    fn meets(&mut self, patch: &Patch, triangle: &Triangle, to: &Point, ends: [u32; 2]) -> bool {
        let wanted = Bounds::of(triangle);
        let mut waiting = std::mem::take(&mut self.waiting);
        waiting.clear();
        waiting.push(0);
        let mut found = false;
        while let Some(node) = waiting.pop().and_then(|i| self.nodes.get(i as usize)) {
            if (0..3).any(|k| node.bounds.hi[k] < wanted.lo[k] || wanted.hi[k] < node.bounds.lo[k]) {
                continue;
            }
            if !node.is_leaf {
                waiting.extend([node.first, node.second]);
                continue;
            }
            found = self.order[node.first as usize..node.second as usize].iter().any(|item| {
                let item = *item as usize;
                let other = if item >= self.faces {
                    self.obstacles[item - self.faces]
                } else {
                    let face = patch.face(item);
                    if face[0] == NONE || face.iter().any(|w| ends.contains(w)) {
                        return false;
                    }
                    patch.triangle(face)
                };
                other.contains(to) || do_cross(triangle, &other)
            });
            if found {
                break;
            }
        }
        self.waiting = waiting;
        found
    }

    /// The face of a corner has become larger.
    pub(super) fn grow(&mut self, patch: &Patch, corner: u32) {
        let bounds = Bounds::of(&patch.triangle(patch.face(corner as usize / 3)));
        let mut at = self.leaf_of[corner as usize / 3];
        while let Some(node) = self.nodes.get_mut(at as usize).filter(|node| !node.bounds.contains(&bounds)) {
            node.bounds.add(&bounds);
            at = node.above;
        }
    }
}
