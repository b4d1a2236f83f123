//! Which triangles a valid patch may have at all, as far as the loop and the mesh around it can tell.

use super::beside::{Beside, each_bit};
use super::boxes::around;
use super::rim::Rim;
use crate::geometry::exact::{Plane, collinear};
use crate::geometry::tri_tri::{do_cross, segment_pierces_plane};

/// Triangles looked at for one loop, divided by how many obstacles each is held against; beyond, none is known to be clear.
const WORK: u32 = 1_000_000;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Known {
    Nothing,
    Clear,
    Not,
}

/// Number of a set of three, given ascending, in the combinatorial number system: those below k fill C(k, 3) places.
fn rank(triangle: [u32; 3]) -> usize {
    let [i, m, k] = triangle.map(|v| v as usize);
    i + m * m.saturating_sub(1) / 2 + k * k.saturating_sub(1) * k.saturating_sub(2) / 6
}

/// The triangles between a loop's vertices through which neither rim nor neighbouring triangles of the mesh pass: no valid
/// patch has another. Each is looked at once, however many triangulations ask.
pub(super) struct Clearance<'a> {
    rim: &'a Rim<'a>,
    /// The rim edges and the mesh's triangles beyond.
    beside: Beside,
    /// By the rank of the triangle among all.
    known: Vec<Known>,
    work: u32,
    /// Rim edges that passed through the triangles looked at last, the last one first: they often pass through the next one.
    latest: [usize; 3],
    /// Edges whose neighbouring triangles met those looked at last.
    met: [usize; 2],
    /// A triangle was refused because of the mesh.
    pub(super) mesh_in_the_way: bool,
    /// There is no triangulation of clear triangles, and so no valid one.
    pub(super) none_is_valid: bool,
}

impl<'a> Clearance<'a> {
    pub(super) fn new(rim: &'a Rim<'a>) -> Self {
        let work = WORK / (1 + rim.obstacles.len() as u32);
        Self {
            rim,
            beside: Beside::of(rim),
            known: Vec::new(),
            work,
            latest: [0; 3],
            met: [0; 2],
            mesh_in_the_way: false,
            none_is_valid: false,
        }
    }

    /// A triangulation of clear triangles was looked for, in all that may be used, and there is none. It tells nothing where too many were looked at.
    pub(super) fn found_none(&mut self) {
        self.none_is_valid = self.work > 0;
    }

    /// Is it known not to be clear? Corners ascending.
    pub(super) fn is_refused(&self, triangle: [u32; 3]) -> bool {
        self.known.get(rank(triangle)) == Some(&Known::Not)
    }

    /// Corners ascending.
    pub(super) fn is_clear(&mut self, triangle: [u32; 3]) -> bool {
        let n = self.rim.len();
        if self.known.is_empty() {
            self.known = vec![Known::Nothing; n * (n - 1) * (n - 2) / 6];
        }
        let rank = rank(triangle);
        if self.known[rank] == Known::Nothing && self.work > 0 {
            self.work -= 1;
            self.known[rank] = if self.look(triangle) { Known::Clear } else { Known::Not };
        }
        self.known[rank] == Known::Clear
    }

    fn look(&mut self, triangle: [u32; 3]) -> bool {
        let rim = self.rim;
        let corners = rim.corners(triangle);
        let next = |i: usize| (i + 1) % rim.len();
        // Most of what is near lies clearly on one side.
        let plane = Plane::new(&corners[0], &corners[1], &corners[2]);
        let pierces = |i: usize| {
            let (a, b) = (rim.points[i], rim.points[next(i)]);
            !plane.has_on_one_side(&[a, b]) && segment_pierces_plane(&a, &b, &corners, &plane)
        };
        let meets = |i: usize| rim.neighbour(i).is_some_and(|t| !plane.has_on_one_side(&t) && do_cross(&corners, &t));
        if self.latest.iter().any(|i| pierces(*i)) || collinear(&corners[0], &corners[1], &corners[2]) {
            return false;
        }
        // The mesh is known to be in the way, so it need not be told any more whether rim or mesh refuses a triangle.
        if self.mesh_in_the_way && self.met.iter().any(|i| meets(*i)) {
            return false;
        }
        let [may_pierce, may_meet] = self.beside.near(&around(&corners), &plane);
        let pierced =
            each_bit(may_pierce).find(|i| segment_pierces_plane(&rim.points[*i], &rim.points[next(*i)], &corners, &plane));
        if let Some(i) = pierced {
            self.latest = [i, self.latest[0], self.latest[1]];
            return false;
        }
        let met = each_bit(may_meet).find(|i| rim.neighbour(*i).is_some_and(|t| do_cross(&corners, &t)));
        self.met = met.map_or(self.met, |i| [i, self.met[0]]);
        let meets_mesh = met.is_some() || rim.meets_obstacle(&corners);
        self.mesh_in_the_way |= meets_mesh;
        !meets_mesh
    }
}

#[cfg(test)]
mod tests {
    use super::rank;

    #[test]
    fn every_triangle_has_its_own_place_and_no_place_is_empty() {
        let all = (2..9).flat_map(|k| (1..k).flat_map(move |m| (0..m).map(move |i| [i, m, k])));
        let ranks: Vec<usize> = all.map(rank).collect();
        assert_eq!(ranks, (0..9 * 8 * 7 / 6).collect::<Vec<_>>());
    }
}
