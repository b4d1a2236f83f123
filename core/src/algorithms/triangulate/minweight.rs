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

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::clear::Clearance;
use super::patch::Unfillable;
use super::rim::Rim;
pub(super) use super::weights::Weight;
use super::weights::{Row, Weights, first_before};
use crate::geometry::exact::{at, collinear};
use crate::util::steps;

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

    /// When its turn comes among others on its chord: the lighter first, of equal ones those that are without their triangles yet, and of these the first.
    fn turn(&self, weight: Weight, is_whole: bool) -> Turn {
        // Bits of floats that are not negative are in the order of the floats.
        let (bend, area) = (u64::from(self.bend), self.area.to_bits());
        let (first, second) = match weight {
            Weight::Bend => (bend, area),
            Weight::Area => (area, bend),
        };
        (first, second, is_whole, self.apex)
    }

    /// Does it count for as much where it is a part of another one?
    fn weighs_as(&self, other: &Self) -> bool {
        Self { apex: RIM, ..*self } == Self { apex: RIM, ..*other }
    }
}

/// Weights, in the order in which they count, of a part with or without its triangle; and its apex.
type Turn = (u64, u64, bool, u32);

/// The parts. The loop over the apexes of a chord runs along a row of those with its first vertex and one of those with its last.
struct Parts {
    n: usize,
    rows: Weights,
    columns: Weights,
    apexes: Vec<u32>,
    normals: Vec<DVec3>,
}

impl Parts {
    fn none(n: usize) -> Self {
        let none = || Weights::none(n * n);
        Self { n, rows: none(), columns: none(), apexes: vec![RIM; n * n], normals: vec![DVec3::ZERO; n * n] }
    }

    fn get(&self, i: usize, k: usize) -> Part {
        let at = i * self.n + k;
        let (bend, area) = self.rows.get(at);
        Part { bend, area, apex: self.apexes[at], normal: self.normals[at] }
    }

    fn normal(&self, i: usize, k: usize) -> DVec3 {
        self.normals[i * self.n + k]
    }

    fn set(&mut self, i: usize, k: usize, part: Part) {
        let at = i * self.n + k;
        (self.apexes[at], self.normals[at]) = (part.apex, part.normal);
        self.rows.set(at, part.bend, part.area);
        self.columns.set(k * self.n + i, part.bend, part.area);
    }

    /// The parts beyond (i, m) and (m, k) as one, without the triangle between them.
    fn joined(&self, (i, k): (usize, usize), m: usize) -> Part {
        let (left, right) = (self.rows.get(i * self.n + m), self.columns.get(k * self.n + m));
        Part { bend: left.0.max(right.0), area: left.1 + right.1, apex: m as u32, normal: DVec3::ZERO }
    }

    /// The weights of the parts beyond (i, m) and (m, k), for each m from `first` to k.
    fn beside(&self, (i, k): (usize, usize), first: usize) -> [Row<'_>; 2] {
        [self.rows.row(i * self.n + first..i * self.n + k), self.columns.row(k * self.n + first..k * self.n + k)]
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
    /// Of no chord; its memory is used again.
    turns: BinaryHeap<Reverse<Turn>>,
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
            turns: BinaryHeap::new(),
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
        if !self.rim.allows(i as u32, k as u32) {
            self.mesh_in_the_way = true;
            return Part::NONE;
        }
        // The lightest first: what is heavier than one that may be used need not be looked at.
        let best = self.lightest(i, k);
        if best.apex == RIM || self.may_use([i as u32, best.apex, k as u32]) {
            return best;
        }
        self.next_lightest((i, k), best.apex)
    }

    /// The best part; of equal ones the first.
    fn lightest(&self, i: usize, k: usize) -> Part {
        let mut best = self.bound(i, k);
        let mut from = i + 1;
        while let Some(part) = self.next_before(&best, (i, k), from) {
            from = part.apex as usize + 1;
            let part = self.with_triangle(part, (i, k));
            if part.before(&best, self.weight) {
                best = part;
            }
        }
        best
    }

    /// No part, but as heavy as the lighter one of two by a hair more: a chord often has the apex of a chord beside it, and most others are heavier then.
    fn bound(&self, i: usize, k: usize) -> Part {
        let mut bound = Part::NONE;
        for m in [self.parts.apexes[i * self.parts.n + k - 1], self.parts.apexes[(i + 1) * self.parts.n + k]] {
            if m != RIM && (i + 1..k).contains(&(m as usize)) {
                let part = self.with_triangle(self.parts.joined((i, k), m as usize), (i, k));
                if part.before(&bound, self.weight) {
                    bound = part;
                }
            }
        }
        // Of weights that are the same the bends are the same, too.
        Part { area: bound.area.next_up(), apex: RIM, normal: DVec3::ZERO, ..bound }
    }

    /// The best part whose triangle may be used, where that on the lightest may not.
    fn next_lightest(&mut self, (i, k): (usize, usize), lightest: u32) -> Part {
        let mut turns = std::mem::take(&mut self.turns).into_vec();
        turns.clear();
        let parts = (i + 1..k).filter(|m| *m as u32 != lightest).map(|m| self.parts.joined((i, k), m));
        turns.extend(parts.filter(|part| part.area != f64::INFINITY).map(|part| Reverse(part.turn(self.weight, false))));
        let mut turns = BinaryHeap::from(turns);
        let mut found = Part::NONE;
        while let Some(Reverse((.., is_whole, m))) = turns.pop() {
            steps::count(1);
            let triangle = [i as u32, m, k as u32];
            if if is_whole { !self.may_use(triangle) } else { self.is_refused(triangle) } {
                continue;
            }
            let part = self.with_triangle(self.parts.joined((i, k), m as usize), (i, k));
            if is_whole {
                found = part;
                break;
            }
            // Its turn comes when nothing is left that may be lighter.
            turns.push(Reverse(part.turn(self.weight, true)));
        }
        self.turns = turns;
        found
    }

    /// A part with the triangle on its chord, where what is beyond that is known.
    fn with_triangle(&self, mut part: Part, (i, k): (usize, usize)) -> Part {
        let m = part.apex as usize;
        // The chord from the last vertex to the first is a rim edge: the mesh goes on beyond it.
        let beyond = if i == 0 && k + 1 == self.rim.len() { self.rim.normal_beyond(k) } else { DVec3::ZERO };
        let normal = (self.positions[m] - self.positions[i]).cross(self.positions[k] - self.positions[i]);
        let length = normal.length();
        part.area += 0.5 * length;
        part.normal = if length > 0.0 { normal / length } else { DVec3::ZERO };
        for other in [self.parts.normal(i, m), self.parts.normal(m, k), beyond] {
            part.bend = part.bend.max(bend(part.normal, other));
        }
        part
    }

    /// The first apex of a chord from `from` on whose parts alone weigh less than the best, and what they weigh.
    fn next_before(&self, best: &Part, (i, k): (usize, usize), from: usize) -> Option<Part> {
        let found = first_before(self.parts.beside((i, k), from), (best.bend, best.area), self.weight);
        steps::count(found.map_or(k - from, |(place, ..)| place + 1));
        let (place, bend, area) = found?;
        Some(Part { bend, area, apex: (from + place) as u32, normal: DVec3::ZERO })
    }

    /// Is it known that a triangle may not be used?
    fn is_refused(&self, triangle: [u32; 3]) -> bool {
        match &self.choice {
            Choice::Clear(clearance) => clearance.is_refused(triangle),
            Choice::Any => false,
        }
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
