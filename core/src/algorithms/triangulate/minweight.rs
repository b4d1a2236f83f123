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
use crate::util::steps;

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
#[derive(Clone, Copy, PartialEq)]
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

    /// Does it count for as much where it is a part of another one?
    fn weighs_as(&self, other: &Self) -> bool {
        Self { apex: RIM, ..*self } == Self { apex: RIM, ..*other }
    }
}

/// Bend and area of a part.
type Weights = (u32, f64);

/// The parts. The loop over the apexes of a chord runs along a row of those with its first vertex and one of those with its last.
struct Parts {
    n: usize,
    rows: Vec<Weights>,
    columns: Vec<Weights>,
    apexes: Vec<u32>,
    normals: Vec<DVec3>,
}

impl Parts {
    fn none(n: usize) -> Self {
        let none = vec![(Part::NONE.bend, Part::NONE.area); n * n];
        Self { n, columns: none.clone(), rows: none, apexes: vec![RIM; n * n], normals: vec![DVec3::ZERO; n * n] }
    }

    fn get(&self, i: usize, k: usize) -> Part {
        let at = i * self.n + k;
        let (bend, area) = self.rows[at];
        Part { bend, area, apex: self.apexes[at], normal: self.normals[at] }
    }

    fn normal(&self, i: usize, k: usize) -> DVec3 {
        self.normals[i * self.n + k]
    }

    fn set(&mut self, i: usize, k: usize, part: Part) {
        let at = i * self.n + k;
        (self.rows[at], self.apexes[at], self.normals[at]) = ((part.bend, part.area), part.apex, part.normal);
        self.columns[k * self.n + i] = self.rows[at];
    }

    /// The weights of the parts beyond (i, m) and (m, k), for each m from `first` to k.
    fn beside(&self, (i, k): (usize, usize), first: usize) -> impl Iterator<Item = (&Weights, &Weights)> {
        self.rows[i * self.n..][first..k].iter().zip(&self.columns[k * self.n..][first..k])
    }
}

fn bend(a: DVec3, b: DVec3) -> u32 {
    if a == DVec3::ZERO || b == DVec3::ZERO { 0 } else { ((1.0 - a.dot(b)) * BEND_STEPS) as u32 }
}

/// The triangles that may be used.
pub(super) enum Choice<'a, 'b> {
    /// All that have an area and are not folded flat onto the mesh.
    Any,
    /// Only those through which neither rim nor neighbouring triangles pass.
    Clear(&'a mut Clearance<'b>),
}

/// The best triangulation.
///
/// Where there is none the error says what stood against it: [`Unfillable::Blocked`] if the mesh around had a part in it,
/// [`Unfillable::CrossesItself`] if the loop alone did.
pub(super) fn triangulate(rim: &Rim<'_>, weight: Weight, choice: Choice<'_, '_>) -> Result<Vec<[u32; 3]>, Unfillable> {
    Table::new(rim, weight, choice).best()
}

/// The best triangulations of all parts of a loop.
pub(super) struct Table<'a, 'b> {
    rim: &'a Rim<'a>,
    weight: Weight,
    choice: Choice<'a, 'b>,
    /// Triangles that are not used, corners ascending.
    banned: Vec<[u32; 3]>,
    positions: Vec<DVec3>,
    parts: Parts,
    /// A chord or triangle was refused because of the mesh around.
    mesh_in_the_way: bool,
}

impl<'a, 'b> Table<'a, 'b> {
    pub(super) fn new(rim: &'a Rim<'a>, weight: Weight, choice: Choice<'a, 'b>) -> Self {
        Self::without(rim, weight, choice, Vec::new())
    }

    /// The same, where some triangles are banned already.
    fn without(rim: &'a Rim<'a>, weight: Weight, choice: Choice<'a, 'b>, banned: Vec<[u32; 3]>) -> Self {
        let n = rim.len();
        let mut table = Self {
            rim,
            weight,
            choice,
            banned,
            positions: rim.points.iter().map(at).collect(),
            parts: Parts::none(n),
            mesh_in_the_way: false,
        };
        for i in 0..n.saturating_sub(1) {
            table.parts.set(i, i + 1, Part { bend: 0, area: 0.0, apex: RIM, normal: rim.normal_beyond(i) });
        }
        for span in 2..n {
            for i in 0..n - span {
                let part = table.best_part(i, i + span);
                table.parts.set(i, i + span, part);
            }
        }
        table
    }

    /// The best triangulation as [`triangulate`] finds it, but for what is banned.
    pub(super) fn best(&self) -> Result<Vec<[u32; 3]>, Unfillable> {
        let reason = if self.mesh_in_the_way { Unfillable::Blocked } else { Unfillable::CrossesItself };
        collect(&self.parts).ok_or(reason)
    }

    pub(super) fn banned(&self) -> usize {
        self.banned.len()
    }

    /// A triangle is not to be used any more, corners ascending. Only parts that hold what changed are looked at again: all others would ask
    /// for the same triangles and come out the same. O(n²) where few change.
    pub(super) fn ban(&mut self, triangle: [u32; 3]) {
        self.banned.push(triangle);
        let (n, [first, _, last]) = (self.rim.len(), triangle.map(|v| v as usize));
        // Is there a part with another weight that begins here, or ends here?
        let mut changed = vec![[false; 2]; n];
        for span in last - first..n {
            for i in last.saturating_sub(span)..=first.min(n - 1 - span) {
                let k = i + span;
                if (i, k) != (first, last) && !changed[i][0] && !changed[k][1] {
                    continue;
                }
                let part = self.best_part(i, k);
                if !part.weighs_as(&self.parts.get(i, k)) {
                    (changed[i][0], changed[k][1]) = (true, true);
                }
                self.parts.set(i, k, part);
            }
        }
    }

    fn best_part(&mut self, i: usize, k: usize) -> Part {
        let mut best = Part::NONE;
        if !self.rim.allows(i as u32, k as u32) {
            self.mesh_in_the_way = true;
            return best;
        }
        // The chord from the last vertex to the first is a rim edge: the mesh goes on beyond it.
        let beyond = if i == 0 && k + 1 == self.rim.len() { self.rim.normal_beyond(k) } else { DVec3::ZERO };
        let mut from = i + 1;
        while let Some((m, mut part)) = self.next_before(&best, (i, k), from) {
            from = m + 1;
            let normal = (self.positions[m] - self.positions[i]).cross(self.positions[k] - self.positions[i]);
            let length = normal.length();
            part.area += 0.5 * length;
            part.normal = if length > 0.0 { normal / length } else { DVec3::ZERO };
            for other in [self.parts.normal(i, m), self.parts.normal(m, k), beyond] {
                part.bend = part.bend.max(bend(part.normal, other));
            }
            if part.before(&best, self.weight) && self.may_use([i as u32, m as u32, k as u32]) {
                best = part;
            }
        }
        best
    }

    /// The first apex of a chord from `from` on whose parts alone weigh less than the best, and what they weigh.
    fn next_before(&self, best: &Part, (i, k): (usize, usize), from: usize) -> Option<(usize, Part)> {
        for (m, (left, right)) in (from..).zip(self.parts.beside((i, k), from)) {
            steps::count(1);
            let (bend, area) = (left.0.max(right.0), left.1 + right.1);
            let part = Part { bend, area, apex: m as u32, normal: DVec3::ZERO };
            if area != f64::INFINITY && part.before(best, self.weight) {
                return Some((m, part));
            }
        }
        None
    }

    fn may_use(&mut self, triangle: [u32; 3]) -> bool {
        match &mut self.choice {
            Choice::Clear(clearance) => {
                let clear = clearance.is_clear(triangle);
                self.mesh_in_the_way |= clearance.mesh_in_the_way;
                clear && !self.banned.contains(&triangle)
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

fn collect(parts: &Parts) -> Option<Vec<[u32; 3]>> {
    let n = parts.n;
    let mut triangles = Vec::with_capacity(n - 2);
    let mut stack = vec![(0, n - 1)];
    while let Some((i, k)) = stack.pop() {
        let part = parts.get(i, k);
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

#[cfg(test)]
mod tests;
