//! Every triangulation of a small loop, until one is valid: for loops in grids of few distinct coordinates, where nearly
//! everything is coplanar or collinear with something and the best patches lie on themselves.
//!
//! Backtracking: the triangle on an open chord is chosen, shortest sides first, among those that cross nothing chosen before.
//! There are 1430 triangulations of ten vertices, so the search is complete up to about there; beyond, its bound may end it.

use super::clear::Clearance;
use super::rim::Rim;
use crate::geometry::exact::at;
use crate::geometry::tri_tri::{Triangle, triangles_cross};

/// Triangles looked at before the search gives up.
const WORK: u32 = 20_000;

struct Search<'a, 'b> {
    rim: &'a Rim<'a>,
    clearance: &'a mut Clearance<'b>,
    chosen: Vec<([u32; 3], Triangle)>,
    /// Chords that need a triangle, smaller vertex first.
    open: Vec<(u32, u32)>,
    work: u32,
}

/// A valid triangulation, if there is one and the search comes to it.
pub(super) fn triangulate(rim: &Rim<'_>, clearance: &mut Clearance<'_>) -> Option<Vec<[u32; 3]>> {
    let n = rim.len();
    let mut search = Search { rim, clearance, chosen: Vec::with_capacity(n - 2), open: vec![(0, n as u32 - 1)], work: WORK };
    search.extend().then(|| search.chosen.iter().map(|(t, _)| *t).collect())
}

impl Search<'_, '_> {
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
            let allowed = self.rim.allows(i, m) && self.rim.allows(m, k);
            let crosses = |c: &Triangle| triangles_cross(c, &corners).is_crossing();
            if allowed && self.clearance.is_clear(triangle) && !self.chosen.iter().any(|(_, c)| crosses(c)) {
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
}
