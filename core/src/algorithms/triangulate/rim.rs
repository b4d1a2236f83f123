//! A boundary loop, and what is valid as its patch: exact tests.

use super::boxes::{Boxes, EMPTY, around};
use super::patch::Unfillable;
use crate::geometry::exact::{Point, at, collinear};
use crate::geometry::position::Position;
use crate::geometry::self_crossing::{SelfCrossing, self_crossing};
use crate::geometry::tri_tri::{Contact, Triangle, common, do_cross, self_intersection, triangles_cross};
use glam::DVec3;

/// A boundary loop and what its patch must respect.
pub(crate) struct Rim<'a> {
    /// Distinct finite positions, in the direction in which the patch traverses the loop: rim edge i runs from vertex i to
    /// vertex i + 1 (the last one back to 0).
    pub points: &'a [Point],
    /// For each rim edge the third corner of the mesh's triangle on its other side, where known; may be shorter than the loop.
    /// The patch then crosses none of these triangles, does not fold back flat onto them, and bends little against them.
    pub apexes: &'a [Option<Point>],
    /// Other triangles of the mesh that the patch must not cross.
    pub obstacles: &'a [Triangle],
    /// Is the chord between these two vertices (smaller index first) an edge of the mesh already? Never asked of rim edges.
    pub forbidden: &'a dyn Fn(u32, u32) -> bool,
}

/// A fault of a triangulation.
pub(super) enum Fault {
    /// A triangle or chord that the rim does not admit.
    Inadmissible,
    /// Two triangles cross.
    Crossing(usize, usize),
    /// Too crowded to tell.
    Undecided,
}

impl From<Fault> for Unfillable {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::Inadmissible => Self::Blocked,
            Fault::Crossing(..) => Self::CrossesItself,
            Fault::Undecided => Self::TooLarge,
        }
    }
}

impl Rim<'_> {
    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    pub(super) fn is_loop(&self) -> bool {
        self.len() >= 3 && u32::try_from(self.len()).is_ok() && are_distinct(self.points)
    }

    pub(super) fn on_one_line(&self) -> bool {
        self.points.iter().skip(2).all(|p| collinear(&self.points[0], &self.points[1], p))
    }

    pub(crate) fn corners(&self, t: [u32; 3]) -> [Point; 3] {
        t.map(|v| self.points[v as usize])
    }

    pub(super) fn area(&self, t: [u32; 3]) -> f64 {
        let [a, b, c] = self.corners(t).map(|p| at(&p));
        0.5 * (b - a).cross(c - a).length()
    }

    /// The mesh's triangle beyond rim edge `i`, as the mesh turns it.
    pub(super) fn neighbour(&self, i: usize) -> Option<Triangle> {
        let apex = self.apexes.get(i).copied().flatten().filter(|a| a.iter().all(|x| x.is_finite()))?;
        Some([self.points[(i + 1) % self.len()], self.points[i], apex])
    }

    /// Its unit normal; zero where there is none.
    pub(super) fn normal_beyond(&self, i: usize) -> DVec3 {
        self.neighbour(i).map_or(DVec3::ZERO, |t| {
            let [a, b, c] = t.map(|p| at(&p));
            (b - a).cross(c - a).normalize_or_zero()
        })
    }

    /// The rim edge from `a` to `b`, by its number.
    pub(super) fn rim_edge(&self, a: u32, b: u32) -> Option<usize> {
        let (a, b) = (a as usize, b as usize);
        (b == (a + 1) % self.len()).then_some(a)
    }

    /// May the patch have an edge between `a` and `b`?
    pub(crate) fn allows(&self, a: u32, b: u32) -> bool {
        self.rim_edge(a, b).is_some() || self.rim_edge(b, a).is_some() || !(self.forbidden)(a.min(b), a.max(b))
    }

    /// Has the triangle an area, and is it not folded flat onto the mesh's triangle beyond one of its rim edges?
    pub(super) fn admits(&self, t: [u32; 3]) -> bool {
        let corners = self.corners(t);
        !collinear(&corners[0], &corners[1], &corners[2])
            && (0..3).all(|k| {
                let neighbour = self.rim_edge(t[k], t[(k + 1) % 3]).and_then(|i| self.neighbour(i));
                neighbour.is_none_or(|beyond| triangles_cross(&corners, &beyond) != Contact::Overlap)
            })
    }

    pub(crate) fn meets_obstacle(&self, corners: &Triangle) -> bool {
        self.obstacles.iter().any(|other| do_cross(corners, other))
    }

    /// Is this triangulation of the polygon valid: every triangle with an area and clear of the obstacles and the mesh's triangles along the rim,
    /// every chord allowed, and nothing crosses or folds onto itself? `graph`: it is known to be a graph over a plane, which cannot
    /// cross itself.
    pub(super) fn accepts(&self, triangles: &[[u32; 3]], graph: bool) -> Result<(), Fault> {
        let beyond = (0..self.apexes.len().min(self.len())).map(|i| self.neighbour(i)).collect();
        let allows = |a: u32, b: u32| self.allows(a, b);
        let around = Surroundings::new(self.points, beyond, &allows);
        if !triangles.iter().all(|t| around.admits(t) && !self.meets_obstacle(&self.corners(*t))) {
            return Err(Fault::Inadmissible);
        }
        if graph { Ok(()) } else { crosses_itself(self.points, triangles) }
    }
}

/// The surface that a patch between one rim or several must respect.
pub(super) struct Surroundings<'a> {
    pub(super) points: &'a [Point],
    /// The mesh's triangles along the rims.
    pub(super) beyond: Vec<Option<Triangle>>,
    pub(super) boxes: Boxes,
    /// May the patch have an edge between two vertices?
    pub(super) allows: &'a dyn Fn(u32, u32) -> bool,
}

impl<'a> Surroundings<'a> {
    pub(super) fn new(points: &'a [Point], beyond: Vec<Option<Triangle>>, allows: &'a dyn Fn(u32, u32) -> bool) -> Self {
        let boxes = Boxes::new(beyond.iter().map(|t| t.map_or(EMPTY, |t| around(&t))));
        Self { points, beyond, boxes, allows }
    }

    /// Has the triangle an area, is it clear of the mesh's triangles, and are its edges allowed? Exact.
    pub(super) fn admits(&self, t: &[u32; 3]) -> bool {
        let corners = t.map(|v| self.points[v as usize]);
        // Whether neighbours touch or are apart does not matter, and is what takes longest to tell.
        let crosses = |other: Triangle| self_intersection(&corners, &other, common(&corners, &other)).is_some();
        !collinear(&corners[0], &corners[1], &corners[2])
            && (0..3).all(|k| (self.allows)(t[k], t[(k + 1) % 3]))
            && !self.boxes.any_near(&around(&corners), |i| self.beyond[i].is_some_and(crosses))
    }
}

/// Are all positions finite, and no two of them equal?
pub(super) fn are_distinct(points: &[Point]) -> bool {
    if !points.as_flattened().iter().all(|x| x.is_finite()) {
        return false;
    }
    let mut sorted: Vec<Position> = points.iter().copied().map(Position::of).collect();
    sorted.sort_unstable();
    sorted.windows(2).all(|w| w[0] != w[1])
}

/// Does any triangle cross another or fold onto it? Each has an area. Exact.
pub(super) fn crosses_itself(points: &[Point], triangles: &[[u32; 3]]) -> Result<(), Fault> {
    let solid: Vec<Triangle> = triangles.iter().map(|t| t.map(|v| points[v as usize])).collect();
    // Enough for any patch but one great fan after the other; a bound by count, so the same everywhere.
    match self_crossing(&solid, 2_000_000 + 500 * solid.len() as u64) {
        SelfCrossing::None => Ok(()),
        SelfCrossing::Pair(i, j) => Err(Fault::Crossing(i, j)),
        SelfCrossing::Undecided => Err(Fault::Undecided),
    }
}

/// Does no edge between two places have two triangles on one side?
pub(super) fn runs_once<P: Ord>(triangles: &[[u32; 3]], place: impl Fn(u32) -> P) -> bool {
    let mut sides: Vec<[P; 2]> = triangles.iter().flat_map(|t| [0, 1, 2].map(|k| [place(t[k]), place(t[(k + 1) % 3])])).collect();
    sides.sort_unstable();
    sides.windows(2).all(|w| w[0] != w[1])
}
