//! Whether a surface winds around points more than half a time, where how often it does need not be known.
//!
//! Rays tell a whole number. What the caps wind is taken off it, and matters only near them: a surface of area A no part of which is nearer than d
//! has a solid angle of no more than A ∕ d². Rays from points that stand above each other are taken together.

use super::super::angle::FAR;
use super::{Corners, Tree, square_to_box};
use crate::detect::bodies;
use crate::geometry::distance::place;
use crate::util::steps;
use glam::DVec3;

/// Caps of which so much of the sphere is covered, at most, wind less than half a time as [`Tree::solid_angle`] tells it, which takes a node from afar for
/// no more than 1 + 4 ∕ FAR = 3 times A ∕ D², D the distance of its centre: its triangles are not farther than (1 + 1 ∕ FAR) D, so that is no more
/// than 3 · 1.5² = 6.75 times what is counted of them here.
const SLIGHT: f64 = 0.07;

impl Tree {
    /// The winding number of each point, as [`Tree::winding_number`] says it; or, where it is known to be more than ½ without that, ∞, and −∞ where it is known not to
    /// be. Points that stand above each other are best in a row, the lowest first.
    pub(crate) fn windings_or_sides(&self, points: &[DVec3]) -> Vec<f64> {
        let Some(caps) = &self.caps else { return self.winding_numbers(points) };
        let mut told = Vec::with_capacity(points.len());
        let mut near = Vec::new();
        for column in points.chunk_by(|a, b| (a.x, a.y) == (b.x, b.y) && a.z <= b.z) {
            let mut sums = vec![0; column.len()];
            [self, caps].into_iter().for_each(|tree| tree.add_passages(column, &mut sums));
            for (p, passages) in column.iter().zip(sums) {
                if caps.is_slight(*p) {
                    told.push(if passages > 0 { f64::INFINITY } else { f64::NEG_INFINITY });
                } else {
                    near.push(told.len());
                    told.push(f64::from(passages));
                }
            }
        }
        let asked: Vec<DVec3> = near.iter().map(|n| points[*n]).collect();
        near.into_iter().zip(caps.winding_numbers(&asked)).for_each(|(n, angle)| told[n] -= angle);
        told
    }

    /// Adds how often rays upwards from some points above each other, ascending, leave the surface's inside, less how often they enter.
    fn add_passages(&self, column: &[DVec3], sums: &mut [i32]) {
        let Some(lowest) = column.first() else { return };
        let mut n = 0;
        while n < self.nodes.len() {
            steps::count(1);
            let node = &self.nodes[n];
            let [lo, hi] = [node.bounds.lo, node.bounds.hi].map(place);
            if lowest.x < lo.x || lowest.x > hi.x || lowest.y < lo.y || lowest.y > hi.y || lowest.z > hi.z {
                n = node.next as usize;
                continue;
            }
            for t in self.leaf(node).iter().filter(|t| may_be_above(lowest, t)) {
                for (p, sum) in column.iter().zip(sums.iter_mut()) {
                    *sum += bodies::crossing(t, p.to_array());
                }
            }
            n += 1;
        }
    }

    /// Is the surface's solid angle less than half of the sphere for certain, as [`Tree::solid_angle`] tells it? What is in doubt is not.
    fn is_slight(&self, point: DVec3) -> bool {
        let mut left = SLIGHT * 4.0 * std::f64::consts::PI;
        let mut n = 0;
        while n < self.nodes.len() {
            steps::count(1);
            let (node, moments) = (&self.nodes[n], &self.moments[n]);
            let square = square_to_box(point, &node.bounds);
            // Nearer than it is large: its parts tell more.
            if node.count == 0 && square * FAR * FAR < moments.far {
                n += 1;
                continue;
            }
            left -= moments.area / square;
            if left.is_nan() || left <= 0.0 {
                return false;
            }
            n = node.next as usize;
        }
        true
    }
}

/// May a ray upwards from a point meet a triangle, seen from above?
fn may_be_above(p: &DVec3, [a, b, c]: &Corners) -> bool {
    let meets = |k: usize, x: f64| f64::from(a[k].min(b[k]).min(c[k])) <= x && x <= f64::from(a[k].max(b[k]).max(c[k]));
    meets(0, p.x) && meets(1, p.y)
}
