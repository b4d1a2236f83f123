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
use super::weights::{self, Chord, Weighs, Weights};
use crate::geometry::exact::{at, collinear};
use crate::util::steps;

const RIM: u32 = u32::MAX;

/// The best triangulation of the part of the polygon beyond the chord (i, k), i < k.
#[derive(Clone, Copy, PartialEq)]
struct Part {
    /// With an infinite area the part cannot be triangulated.
    weighs: Weighs,
    /// The triangle on the chord is (i, apex, k); [`RIM`] for a rim edge.
    apex: u32,
    /// Unit normal of that triangle (for a rim edge: of the mesh's triangle; zero: unknown).
    normal: DVec3,
}

impl Part {
    const NONE: Self = Self { weighs: Weighs::NOTHING_LIKE_IT, apex: RIM, normal: DVec3::ZERO };

    /// Does it count for as much where it is a part of another one?
    fn weighs_as(&self, other: &Self) -> bool {
        Self { apex: RIM, ..*self } == Self { apex: RIM, ..*other }
    }
}

/// When the turn of a triangle comes among others on its chord: the lighter first, of equal ones the first. Its weights, in the order in which they count; and its apex.
type Turn = (u64, u64, u32);

fn turn(weighs: Weighs, apex: u32, weight: Weight) -> Turn {
    // Bits of floats that are not negative are in the order of the floats.
    let (bend, area) = (weighs.bend.to_bits(), weighs.area.to_bits());
    match weight {
        Weight::Bend => (bend, area, apex),
        Weight::Area => (area, bend, apex),
    }
}

/// The parts. The loop over the apexes of a chord runs along a row of those with its first vertex and one of those with its last.
struct Parts {
    n: usize,
    rows: Weights,
    columns: Weights,
    apexes: Vec<u32>,
}

impl Parts {
    fn none(n: usize) -> Self {
        let none = || Weights::none(n * n);
        Self { n, rows: none(), columns: none(), apexes: vec![RIM; n * n] }
    }

    fn get(&self, i: usize, k: usize) -> Part {
        let at = i * self.n + k;
        Part { weighs: self.rows.get(at), apex: self.apexes[at], normal: self.rows.normal(at) }
    }

    fn set(&mut self, i: usize, k: usize, part: Part) {
        let at = i * self.n + k;
        self.apexes[at] = part.apex;
        self.rows.set(at, part.weighs, part.normal);
        self.columns.set(k * self.n + i, part.weighs, part.normal);
    }
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
    /// By coordinate.
    positions: [Vec<f64>; 3],
    parts: Parts,
    /// Of no chord; their memory is used again.
    turns: BinaryHeap<Reverse<Turn>>,
    weighed: Vec<Weighs>,
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
            positions: std::array::from_fn(|k| rim.points.iter().map(|p| at(p)[k]).collect()),
            parts: Parts::none(n),
            turns: BinaryHeap::new(),
            weighed: Vec::new(),
            mesh_in_the_way: false,
        };
        for i in 0..n.saturating_sub(1) {
            table.parts.set(i, i + 1, Part { weighs: Weighs { bend: 0.0, area: 0.0 }, apex: RIM, normal: rim.normal_beyond(i) });
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

    /// The triangles on a chord, by their apexes, from the one after its first end on.
    fn chord(&self, i: usize, k: usize) -> Chord<'_> {
        let n = self.rim.len();
        let end = |at: usize| DVec3::from(self.positions.each_ref().map(|all| all[at]));
        Chord {
            parts: [self.parts.rows.row(i * n + i + 1..i * n + k), self.parts.columns.row(k * n + i + 1..k * n + k)],
            apexes: self.positions.each_ref().map(|all| &all[i + 1..k]),
            ends: [end(i), end(k)],
            // The chord from the last vertex to the first is a rim edge: the mesh goes on beyond it.
            beyond: if i == 0 && k + 1 == n { self.rim.normal_beyond(k) } else { DVec3::ZERO },
            weight: self.weight,
        }
    }

    /// The best part; of equal ones the first.
    fn lightest(&self, i: usize, k: usize) -> Part {
        steps::count(k - i - 1);
        let chord = self.chord(i, k);
        let found = weights::lightest(&chord, self.bound(&chord, (i, k)));
        found.map_or(Part::NONE, |place| Self::part(&chord, i, place))
    }

    /// The part whose triangle has the apex at this place.
    fn part(chord: &Chord<'_>, i: usize, place: usize) -> Part {
        let (weighs, normal) = weights::with_triangle(chord, place);
        Part { weighs, apex: (i + 1 + place) as u32, normal }
    }

    /// Heavier by a hair than the lighter one of two: a chord often has the apex of a chord beside it, and most others need not be weighed then.
    fn bound(&self, chord: &Chord<'_>, (i, k): (usize, usize)) -> Weighs {
        let n = self.rim.len();
        let mut bound = Weighs::NOTHING_LIKE_IT;
        for m in [self.parts.apexes[i * n + k - 1], self.parts.apexes[(i + 1) * n + k]] {
            if m != RIM && (i + 1..k).contains(&(m as usize)) {
                let (weighs, _) = weights::with_triangle(chord, m as usize - i - 1);
                if weighs.is_before(bound, self.weight) {
                    bound = weighs;
                }
            }
        }
        // One of equal weight is found, too.
        Weighs { area: bound.area.next_up(), ..bound }
    }

    /// The best part whose triangle may be used, where that on the lightest may not.
    fn next_lightest(&mut self, (i, k): (usize, usize), lightest: u32) -> Part {
        let (mut turns, mut weighed) = (std::mem::take(&mut self.turns).into_vec(), std::mem::take(&mut self.weighed));
        turns.clear();
        weighed.clear();
        weights::weigh_all(&self.chord(i, k), &mut weighed);
        let all = (i as u32 + 1..).zip(&weighed).filter(|(m, weighs)| *m != lightest && weighs.area != f64::INFINITY);
        let all = all.filter(|(m, _)| !self.is_refused([i as u32, *m, k as u32]));
        turns.extend(all.map(|(m, weighs)| Reverse(turn(*weighs, m, self.weight))));
        let mut turns = BinaryHeap::from(turns);
        let mut found = Part::NONE;
        while let Some(Reverse((.., m))) = turns.pop() {
            steps::count(1);
            if self.may_use([i as u32, m, k as u32]) {
                found = Self::part(&self.chord(i, k), i, m as usize - i - 1);
                break;
            }
        }
        (self.turns, self.weighed) = (turns, weighed);
        found
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
        if part.weighs.area == f64::INFINITY {
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
