//! The image of a triangle, by those of its edges: polygons that lie in one face each.
//!
//! The loop around the triangle is cut at places of it that lie in one face, the longest run of them first, until nothing is left. Where it runs
//! around vertices of the surface, these are joined to the loop by spokes, and each sector is cut by itself.

use glam::DVec3;

use crate::geometry::distance::nearest_of_triangle;
use crate::proof::chain::{self, Lent, Pair};
use crate::proof::surface::{Spot, Surface};
use crate::util::ids::NONE;

/// How many vertices may lie within each other's sectors.
const DEPTH: usize = 4;

/// A polygon of a triangle whose image is the polygon of these spots in a face.
pub(super) struct Piece<'a> {
    pub(super) face: u32,
    pub(super) corners: &'a [Pair],
}

/// The faces that hold two spots, or more of them in a row.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shared {
    /// One or two, the second one [`NONE`] if there is one; none if both are.
    Faces([u32; 2]),
    /// All spots are this vertex.
    Vertex(u32),
}

impl Shared {
    const NO: Self = Self::Faces([NONE; 2]);

    #[inline]
    fn of(surface: &Surface<'_>, [a, b]: [&Spot; 2]) -> Self {
        let Some(face) = surface.common([a, b]) else { return Self::NO };
        let (Some(a), Some(b)) = (surface.within(a, face), surface.within(b, face)) else { return Self::NO };
        let is_out = [0, 1, 2].map(|k: usize| a[k] == 0.0 && b[k] == 0.0);
        match is_out {
            [false, false, false] => Self::Faces([face, NONE]),
            [true, true, _] => Self::Vertex(surface.faces[face as usize][2]),
            [true, _, true] => Self::Vertex(surface.faces[face as usize][1]),
            [_, true, true] => Self::Vertex(surface.faces[face as usize][0]),
            [true, ..] => Self::Faces([face, surface.beyond(face, 1).unwrap_or(NONE)]),
            [_, true, _] => Self::Faces([face, surface.beyond(face, 2).unwrap_or(NONE)]),
            [.., true] => Self::Faces([face, surface.beyond(face, 0).unwrap_or(NONE)]),
        }
    }

    /// The same, where it is known which faces hold each of the spots.
    #[inline]
    fn by_holders(surface: &Surface<'_>, spots: [&Spot; 2], holders: [Option<[u32; 2]>; 2]) -> Self {
        match holders {
            [Some(own), Some(others)] => kept(own, |face| others.contains(&face)),
            _ => Self::of(surface, spots),
        }
    }

    /// Those of both.
    #[inline]
    fn and(self, surface: &Surface<'_>, other: Self) -> Self {
        match (self, other) {
            (Self::Faces(own), Self::Faces(others)) => kept(own, |face| others.contains(&face)),
            (Self::Faces(own), Self::Vertex(v)) | (Self::Vertex(v), Self::Faces(own)) => {
                kept(own, |face| surface.faces[face as usize].contains(&v))
            }
            (Self::Vertex(v), Self::Vertex(w)) if v == w => self,
            _ => Self::NO,
        }
    }

    /// One of them.
    #[inline]
    fn one(self, surface: &Surface<'_>) -> Option<u32> {
        match self {
            Self::Faces([face, _]) => (face != NONE).then_some(face),
            Self::Vertex(v) => surface.around(v).first().copied(),
        }
    }
}

#[inline]
fn kept([a, b]: [u32; 2], keeps: impl Fn(u32) -> bool) -> Shared {
    let keeps = |face: u32| face != NONE && keeps(face);
    match (keeps(a), keeps(b)) {
        (true, true) => Shared::Faces([a, b]),
        (true, false) => Shared::Faces([a, NONE]),
        (false, true) => Shared::Faces([b, NONE]),
        (false, false) => Shared::NO,
    }
}

/// The start of the first of the longest runs.
#[inline]
fn longest(steps: &[Step]) -> usize {
    let longer = |best: usize, at: usize| if steps[at].run.steps > steps[best].run.steps { at } else { best };
    (1..steps.len()).fold(0, longer)
}

/// A triangle that is cut, of which no spoke is to be farther than `aim` if it can be nearer.
#[derive(Clone, Copy)]
pub(super) struct Cut<'c> {
    pub(super) surface: &'c Surface<'c>,
    pub(super) triangle: [DVec3; 3],
    pub(super) aim: f64,
}

/// Lists lent to many calls.
#[derive(Default)]
pub(super) struct Lists {
    /// The loop.
    pub(super) rim: Vec<Pair>,
    /// The steps of it that are not cut off yet.
    steps: Vec<Step>,
    piece: Vec<Pair>,
}

/// The step of a loop from a pair to the next one.
#[derive(Clone, Copy)]
struct Step {
    /// The pair, by its place in the loop as it was.
    pair: u32,
    /// The faces that hold it and the next one.
    shared: Shared,
    /// The longest run from here on.
    run: Run,
}

/// So many steps of a loop lie in one face each, in these; none of them if there is no step.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Run {
    steps: u32,
    common: Shared,
}

impl Run {
    const NO: Self = Self { steps: 0, common: Shared::NO };

    /// The longest one from `start` on.
    #[inline]
    fn from(surface: &Surface<'_>, all: &[Step], start: usize) -> Self {
        let (mut common, mut run, mut at) = (all[start].shared, Self::NO, start);
        while common != Shared::NO {
            run = Self { steps: run.steps + 1, common };
            if run.steps as usize == all.len() {
                break;
            }
            at = if at + 1 == all.len() { 0 } else { at + 1 };
            common = common.and(surface, all[at].shared);
        }
        run
    }
}

impl Cut<'_> {
    /// Cuts a loop of pairs around the triangle into pieces; false if it does not know how. `visit` may have been told some of them all the same.
    pub(super) fn fill(&self, lists: &mut Lists, chain: &mut Lent, visit: &mut dyn FnMut(Piece<'_>)) -> bool {
        self.sector(lists, chain, DEPTH, visit)
    }

    fn sector(&self, lists: &mut Lists, chain: &mut Lent, depth: usize, visit: &mut dyn FnMut(Piece<'_>)) -> bool {
        self.begin(lists);
        loop {
            let start = longest(&lists.steps);
            let Run { steps, common } = lists.steps[start].run;
            let face = if steps < 2 { None } else { common.one(self.surface) };
            let Some(face) = face else {
                return self.around_vertex(lists, visit) || (depth > 0 && self.spokes(lists, chain, depth, visit));
            };
            let Lists { rim, steps: left, piece } = lists;
            let is_all = steps as usize == left.len();
            piece.clear();
            let run = left[start..].iter().chain(&left[..start]).take(steps as usize + usize::from(!is_all));
            piece.extend(run.map(|step| rim[step.pair as usize]));
            if is_all {
                // From the beginning of the loop on.
                piece.rotate_right(start);
            }
            visit(Piece { face, corners: piece });
            if is_all {
                return true;
            }
            self.cut_run(lists, start, steps as usize);
            if lists.steps.len() < 3 {
                return false;
            }
        }
    }

    /// The steps of a whole loop.
    fn begin(&self, lists: &mut Lists) {
        let Lists { rim, steps, .. } = lists;
        steps.clear();
        let Some(first) = rim.first() else { return };
        let first = (&first.spot, self.surface.holders(&first.spot));
        let mut here = first;
        for pair in 0..rim.len() {
            let next = rim.get(pair + 1).map_or(first, |next| (&next.spot, self.surface.holders(&next.spot)));
            let shared = Shared::by_holders(self.surface, [here.0, next.0], [here.1, next.1]);
            steps.push(Step { pair: pair as u32, shared, run: Run::NO });
            here = next;
        }
        for at in 0..steps.len() {
            steps[at].run = Run::from(self.surface, steps, at);
        }
    }

    /// Cuts off a run of so many steps.
    fn cut_run(&self, lists: &mut Lists, start: usize, cut: usize) {
        let Lists { rim, steps, .. } = lists;
        // All but the ends of the run go: behind its start, and before its end where it runs beyond the list's.
        let end = steps.len().min(start + cut);
        let beyond = start + cut - end;
        steps.drain(start + 1..end);
        if beyond > 0 {
            steps.drain(..beyond);
        }
        let (start, n) = (start - beyond, steps.len());
        let spots = [start, (start + 1) % n].map(|at| &rim[steps[at].pair as usize].spot);
        steps[start].shared = Shared::by_holders(self.surface, spots, spots.map(|spot| self.surface.holders(spot)));
        // The runs up to it and over it are other ones now.
        for at in 0..n {
            let back = if at <= start { start - at } else { start + n - at };
            if steps[at].run.steps as usize >= back {
                steps[at].run = Run::from(self.surface, steps, at);
            }
        }
    }

    /// A vertex of the surface as the image of the nearest place of the triangle.
    fn apex(&self, v: u32) -> Option<Pair> {
        let spot = self.surface.at_vertex(v)?;
        let position = self.surface.position(&spot);
        let place = nearest_of_triangle(&self.triangle, position);
        Some(Pair { place, spot, off: place.distance(position) })
    }

    /// Fills a loop that runs around one vertex of the surface.
    fn around_vertex(&self, lists: &Lists, visit: &mut dyn FnMut(Piece<'_>)) -> bool {
        let Lists { rim, steps, .. } = lists;
        let n = steps.len();
        let Some(face) = steps.first().and_then(|step| step.shared.one(self.surface)) else { return false };
        for v in self.surface.faces[face as usize] {
            let face = |i: usize| steps[i].shared.and(self.surface, Shared::Vertex(v)).one(self.surface);
            let Some(apex) = self.apex(v).filter(|_| (0..n).all(|i| face(i).is_some())) else { continue };
            for i in 0..n {
                if let Some(face) = face(i) {
                    let [from, to] = [i, (i + 1) % n].map(|at| rim[steps[at].pair as usize]);
                    visit(Piece { face, corners: &[apex, from, to] });
                }
            }
            return true;
        }
        false
    }

    /// Fills a loop around more than one vertex: the one that is nearest to the triangle is joined to each pair of the loop.
    fn spokes(&self, lists: &Lists, chain: &mut Lent, depth: usize, visit: &mut dyn FnMut(Piece<'_>)) -> bool {
        let rim: Vec<Pair> = lists.steps.iter().map(|step| lists.rim[step.pair as usize]).collect();
        let is_on_rim = |v: &u32| {
            rim.iter().any(|pair| self.surface.at_vertex(*v).is_some_and(|spot| is_same(self.surface, &spot, &pair.spot)))
        };
        let faces = lists.steps.iter().filter_map(|step| step.shared.one(self.surface));
        let vertices = faces.flat_map(|face| self.surface.faces[face as usize]).filter(|v| !is_on_rim(v));
        let Some(apex) = vertices.filter_map(|v| self.apex(v)).min_by(|a, b| a.off.total_cmp(&b.off)) else { return false };
        let mut spokes = Vec::with_capacity(rim.len());
        for pair in &rim {
            let mut spoke = Vec::new();
            if !chain::between(self.surface, [&apex, pair], self.aim, chain, &mut spoke) {
                return false;
            }
            spokes.push(spoke);
        }
        let mut sector = Lists::default();
        (0..rim.len()).all(|i| {
            let next = (i + 1) % rim.len();
            sector.rim.clear();
            sector.rim.push(apex);
            sector.rim.extend(&spokes[i]);
            sector.rim.extend([rim[i], rim[next]]);
            sector.rim.extend(spokes[next].iter().rev());
            self.sector(&mut sector, chain, depth - 1, visit)
        })
    }
}

/// Are two spots one place?
fn is_same(surface: &Surface<'_>, a: &Spot, b: &Spot) -> bool {
    surface.within(a, b.face).is_some_and(|shares| shares == b.shares)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles with one edge in common, and a third one beside: corners, middles of edges, and insides.
    #[test]
    fn faces_of_two_spots_are_the_same_however_they_are_found() {
        let points = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0], [-4.0, 4.0, 0.0]];
        let faces = [[0, 1, 2], [2, 3, 0], [3, 4, 0]];
        let surface = Surface::new(&points, &faces);
        let shares = [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, 0.25, 0.75], [0.25, 0.0, 0.75], [0.5, 0.25, 0.25]];
        let spots: Vec<Spot> = (0..3).flat_map(|face| shares.iter().map(move |shares| Spot { face, shares: *shares })).collect();
        let mut by_two = 0;
        for a in &spots {
            for b in &spots {
                let holders = [a, b].map(|spot| surface.holders(spot));
                let known = Shared::by_holders(&surface, [a, b], holders);
                assert_eq!(known, Shared::of(&surface, [a, b]), "{a:?} {b:?}");
                by_two += usize::from(
                    holders.iter().all(Option::is_some) && matches!(known, Shared::Faces([f, g]) if f != g && g != NONE),
                );
            }
        }
        assert!(by_two > 0, "two lie on one inner edge");
        assert_eq!(surface.holders(&spots[0]), None, "a corner");
        assert_eq!(surface.holders(&spots[4]), Some([0, NONE]), "an inside");
    }
}
