//! Every triangulation of a small loop, until one is valid: for loops in grids of few distinct coordinates, where nearly
//! everything is coplanar or collinear with something and the best patches lie on themselves.
//!
//! Backtracking: the triangle on an open chord is chosen, shortest sides first, among those that cross nothing chosen before.
//! There are 1430 triangulations of ten vertices, so the search is complete up to about there; beyond, its bound may end it.

use super::Rim;
use super::cross::{Triangle, segment_pierces, triangles_cross};
use super::exact::{at, collinear};

/// Triangles looked at before the search gives up.
const WORK: u32 = 20_000;

struct Search<'a> {
    rim: &'a Rim<'a>,
    /// May a valid patch have the triangle, as far as rim and mesh can tell? Known for those asked before.
    free: Vec<Option<bool>>,
    chosen: Vec<([u32; 3], Triangle)>,
    /// Chords that need a triangle, smaller vertex first.
    open: Vec<(u32, u32)>,
    work: u32,
}

/// A valid triangulation, if there is one and the search comes to it.
pub(super) fn triangulate(rim: &Rim<'_>) -> Option<Vec<[u32; 3]>> {
    let n = rim.len();
    let mut search =
        Search { rim, free: vec![None; n * n * n], chosen: Vec::with_capacity(n - 2), open: vec![(0, n as u32 - 1)], work: WORK };
    search.extend().then(|| search.chosen.iter().map(|(t, _)| *t).collect())
}

impl Search<'_> {
    /// Closes all open chords; where that fails everything is as before. As deep as there are triangles.
    fn extend(&mut self) -> bool {
        let Some((i, k)) = self.open.pop() else { return true };
        let p = |v: u32| at(&self.rim.points[v as usize]);
        let sides = |m: u32| (p(m) - p(i)).length_squared() + (p(k) - p(m)).length_squared();
        let mut apexes: Vec<u32> = (i + 1..k).collect();
        apexes.sort_by(|&a, &b| sides(a).total_cmp(&sides(b)));
        let (chosen, open) = (self.chosen.len(), self.open.len());
        for m in apexes {
            if self.work == 0 {
                break;
            }
            self.work -= 1;
            let triangle = [i, m, k];
            let corners = self.rim.corners(triangle);
            if self.is_free(triangle, &corners) && self.chosen.iter().all(|(_, c)| !triangles_cross(c, &corners).is_crossing()) {
                self.chosen.push((triangle, corners));
                self.open.extend([(i, m), (m, k)].into_iter().filter(|(a, b)| b - a > 1));
                if self.extend() {
                    return true;
                }
                self.chosen.truncate(chosen);
                self.open.truncate(open);
            }
        }
        self.open.push((i, k));
        false
    }

    fn is_free(&mut self, triangle: [u32; 3], corners: &Triangle) -> bool {
        let (rim, n) = (self.rim, self.rim.len());
        let [i, m, k] = triangle.map(|v| v as usize);
        *self.free[(i * n + m) * n + k].get_or_insert_with(|| {
            !collinear(&corners[0], &corners[1], &corners[2])
                && (0..3).all(|e| rim.allows(triangle[e], triangle[(e + 1) % 3]))
                && (0..n).all(|e| !segment_pierces(&rim.points[e], &rim.points[(e + 1) % n], corners))
                && (0..n).all(|e| rim.neighbour(e).is_none_or(|t| !triangles_cross(corners, &t).is_crossing()))
        })
    }
}
