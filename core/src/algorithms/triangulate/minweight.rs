//! The minimum-weight triangulation of a loop in space, by dynamic programming over the chords.
//!
//! Barequet & Sharir, "Filling gaps in the boundary of a polyhedron", CAGD 12 (1995), with the weight of Liepa, "Filling holes
//! in meshes", SGP 2003: first the sharpest bend between neighbouring triangles, those of the mesh across the rim included, then
//! the area. As there, the best triangulation of a part is taken to be the one that the whole will use, which is not exact for
//! bends. Bends count in steps, so that a flatter patch by a hair does not outweigh one half as large.
//!
//! A patch may come out crossing itself. A thorough second run leaves out every triangle that a rim edge or a neighbouring
//! triangle of the mesh passes through: no valid patch has one. That costs five to ten times the first run, nearly all of it
//! in exact predicates. O(n³) time, O(n²) memory.

use glam::DVec3;

use super::clear::Clearance;
use super::patch::Unfillable;
use super::rim::Rim;
use crate::geometry::exact::{at, collinear};

/// The weight that is minimised first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Weight {
    /// The sharpest bend, then the area.
    Bend,
    /// The area, then the sharpest bend.
    Area,
}

/// Steps of 1 − cos of the angle between normals; one step is 14° near flat.
const BEND_STEPS: f64 = 32.0;

const RIM: u32 = u32::MAX;

/// The best triangulation of the part of the polygon beyond the chord (i, k), i < k.
#[derive(Clone, Copy)]
struct Part {
    bend: u32,
    /// Infinite: the part cannot be triangulated.
    area: f64,
    /// The triangle on the chord is (i, apex, k); [`RIM`] for a rim edge.
    apex: u32,
    /// Unit normal of that triangle (for a rim edge: of the mesh's triangle; zero: unknown).
    normal: DVec3,
}

impl Part {
    const NONE: Self = Self { bend: u32::MAX, area: f64::INFINITY, apex: RIM, normal: DVec3::ZERO };

    fn before(&self, other: &Self, weight: Weight) -> bool {
        let (by_bend, by_area) = (self.bend.cmp(&other.bend), self.area.total_cmp(&other.area));
        match weight {
            Weight::Bend => by_bend.then(by_area).is_lt(),
            Weight::Area => by_area.then(by_bend).is_lt(),
        }
    }
}

fn bend(a: DVec3, b: DVec3) -> u32 {
    if a == DVec3::ZERO || b == DVec3::ZERO { 0 } else { ((1.0 - a.dot(b)) * BEND_STEPS) as u32 }
}

/// The triangles that may be used.
pub(super) enum Choice<'a, 'b> {
    /// All that have an area and are not folded flat onto the mesh.
    Any,
    /// Only those through which neither rim nor neighbouring triangles pass, and that are not listed (corners ascending).
    Clear(&'a mut Clearance<'b>, &'a [[u32; 3]]),
}

/// The best triangulation.
///
/// Where there is none the error says what stood against it: [`Unfillable::Blocked`] if the mesh around had a part in it,
/// [`Unfillable::CrossesItself`] if the loop alone did.
pub(super) fn triangulate(rim: &Rim<'_>, weight: Weight, choice: Choice<'_, '_>) -> Result<Vec<[u32; 3]>, Unfillable> {
    let n = rim.len();
    // parts[i][k - i - 1] is the part beyond (i, k).
    let parts = (0..n.saturating_sub(1)).map(|i| {
        let mut row = Vec::with_capacity(n - 1 - i);
        row.push(Part { bend: 0, area: 0.0, apex: RIM, normal: rim.normal_beyond(i) });
        row
    });
    let mut table = Table {
        rim,
        weight,
        choice,
        positions: rim.points.iter().map(at).collect(),
        parts: parts.collect(),
        mesh_in_the_way: false,
    };
    for span in 2..n {
        for i in 0..n - span {
            let part = table.best_part(i, i + span);
            table.parts[i].push(part);
        }
    }
    let reason = if table.mesh_in_the_way { Unfillable::Blocked } else { Unfillable::CrossesItself };
    collect(&table.parts, n).ok_or(reason)
}

struct Table<'a, 'b> {
    rim: &'a Rim<'a>,
    weight: Weight,
    choice: Choice<'a, 'b>,
    positions: Vec<DVec3>,
    parts: Vec<Vec<Part>>,
    /// A chord or triangle was refused because of the mesh around.
    mesh_in_the_way: bool,
}

impl Table<'_, '_> {
    fn best_part(&mut self, i: usize, k: usize) -> Part {
        let mut best = Part::NONE;
        if !self.rim.allows(i as u32, k as u32) {
            self.mesh_in_the_way = true;
            return best;
        }
        // The chord from the last vertex to the first is a rim edge: the mesh goes on beyond it.
        let beyond = if i == 0 && k + 1 == self.rim.len() { self.rim.normal_beyond(k) } else { DVec3::ZERO };
        for m in i + 1..k {
            let (left, right) = (&self.parts[i][m - i - 1], &self.parts[m][k - m - 1]);
            let (bend_of_parts, area) = (left.bend.max(right.bend), left.area + right.area);
            let mut part = Part { bend: bend_of_parts, area, apex: m as u32, normal: DVec3::ZERO };
            if area == f64::INFINITY || !part.before(&best, self.weight) {
                continue;
            }
            let normal = (self.positions[m] - self.positions[i]).cross(self.positions[k] - self.positions[i]);
            let length = normal.length();
            part.area += 0.5 * length;
            part.normal = if length > 0.0 { normal / length } else { DVec3::ZERO };
            for other in [left.normal, right.normal, beyond] {
                part.bend = part.bend.max(bend(part.normal, other));
            }
            let triangle = [i as u32, m as u32, k as u32];
            if part.before(&best, self.weight) && self.may_use(triangle) {
                best = part;
            }
        }
        best
    }

    fn may_use(&mut self, triangle: [u32; 3]) -> bool {
        match &mut self.choice {
            Choice::Clear(clearance, banned) => {
                let clear = clearance.is_clear(triangle);
                self.mesh_in_the_way |= clearance.mesh_in_the_way;
                clear && !banned.contains(&triangle)
            }
            Choice::Any => {
                let [a, b, c] = self.rim.corners(triangle);
                if collinear(&a, &b, &c) {
                    return false;
                }
                let admitted = self.rim.admits(triangle);
                self.mesh_in_the_way |= !admitted;
                admitted
            }
        }
    }
}

fn collect(parts: &[Vec<Part>], n: usize) -> Option<Vec<[u32; 3]>> {
    let mut triangles = Vec::with_capacity(n - 2);
    let mut stack = vec![(0, n - 1)];
    while let Some((i, k)) = stack.pop() {
        let part = &parts[i][k - i - 1];
        if part.area == f64::INFINITY {
            return None;
        }
        if part.apex != RIM {
            let m = part.apex as usize;
            triangles.push([i as u32, part.apex, k as u32]);
            stack.extend([(i, m), (m, k)]);
        }
    }
    Some(triangles)
}
