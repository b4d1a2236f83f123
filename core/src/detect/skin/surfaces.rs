//! The surface before and after the repairs.

use crate::contract::report::RepairName;
use crate::geometry::position::{self, Position};
use crate::submesh::components::Reversed;
use crate::submesh::{Origin, Submesh};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// A triangle by its positions.
pub(super) type Corners = [[f32; 3]; 3];

/// Triangles of the submesh in a part of what is in memory.
const PART: usize = 8192;

/// By region of regular surface, the repair that dropped it.
pub(crate) type DroppedBy = Vec<Option<RepairName>>;

/// A surface: before the repairs, or after them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Which {
    /// What was there, and what the profile asked to be added: what that covers was no skin any more.
    Before,
    /// The same, with small holes closed: what can be seen through these only was no skin.
    Closed,
    After,
}

/// Both surfaces: regular surface that stands in both, and what the submesh has of either.
pub(crate) struct Surfaces<'a> {
    pub(crate) survey: &'a Survey<'a>,
    pub(crate) submesh: &'a Submesh,
    pub(crate) reversed: &'a Reversed,
    pub(crate) dropped_by: &'a DroppedBy,
    pub(crate) wrapped: &'a [Corners],
    /// Triangles of the submesh that close small holes.
    pub(crate) holes: Vec<u32>,
    /// The triangles of cavities that poke out, each by its corners, whichever way round; ascending.
    pub(crate) of_cavities: Vec<[Position; 3]>,
}

/// A triangle by its corners, whichever way round.
pub(crate) fn by_corners(corners: &Corners) -> [Position; 3] {
    let mut key = corners.map(Position::of);
    key.sort_unstable();
    key
}

impl Surfaces<'_> {
    /// Does a region of regular surface stand there?
    pub(crate) fn has(&self, which: Which, region: u32) -> bool {
        which != Which::After || !self.reversed.dropped[region as usize]
    }

    pub(crate) fn is_of_cavity(&self, corners: &Corners) -> bool {
        !self.of_cavities.is_empty() && self.of_cavities.binary_search(&by_corners(corners)).is_ok()
    }

    /// How many parts the triangles of a surface have that are not regular, each for a thread.
    pub(crate) fn parts(&self) -> usize {
        1 + self.submesh.triangles.len().div_ceil(PART)
    }

    /// Visits those of one part.
    pub(crate) fn each_of_part(&self, which: Which, part: usize, mut visit: impl FnMut(&Corners)) {
        let Some(part) = part.checked_sub(1) else {
            match which {
                Which::Closed => self.holes.iter().for_each(|t| visit(&self.submesh.points(*t))),
                Which::Before => {}
                Which::After => self.wrapped.iter().for_each(visit),
            }
            return;
        };
        for t in (part * PART..self.submesh.triangles.len().min((part + 1) * PART)).map(|t| t as u32) {
            let lives = || self.submesh.lives(t);
            match which {
                Which::Before | Which::Closed => {
                    self.submesh.as_read(self.survey.records, t).iter().for_each(&mut visit);
                    if lives() && is_asked_for(self.made_by(t)) {
                        visit(&self.submesh.points(t));
                    }
                }
                Which::After if lives() => visit(&self.submesh.points(t)),
                Which::After => {}
            }
        }
    }

    /// The triangles that were there and are not there any more, or not as they were, turned as they were in the end, each by its record, with the
    /// repair that did it; but for walls
    /// that parts of a body had in common.
    pub(crate) fn each_gone(&self, mut visit: impl FnMut(u32, &Corners, Option<RepairName>)) {
        for t in self.submesh.beside_records(self.survey) {
            let triangle = &self.submesh.triangles[t as usize];
            if let Some(corners) = self.submesh.as_read(self.survey.records, t)
                && !is_no_harm(triangle.by)
                && !self.submesh.stands(self.survey.records, t)
            {
                let [a, b, c] = corners;
                let points = self.submesh.points(t);
                let is_turned = points == [a, c, b] || points == [c, b, a] || points == [b, a, c];
                visit(triangle.record(), &if is_turned { [a, c, b] } else { corners }, triangle.by);
            }
        }
    }

    /// The same of dropped regions, in no order; each chunk gathers by `visit` in a list of its own.
    pub(crate) fn each_dropped<R: Send + Default>(
        &self,
        visit: impl Fn(&mut R, u32, &Corners, Option<RepairName>) + Sync,
    ) -> Vec<R> {
        self.survey.visit_regular(
            |region| self.reversed.dropped[region as usize],
            R::default,
            |into, place, region| {
                let by = self.dropped_by.get(region as usize).copied().flatten();
                let [a, b, c] = position::corners(&self.survey.records[place as usize]);
                let is_turned = self.reversed.regions[region as usize];
                if !is_no_harm(by) {
                    visit(into, place, &if is_turned { [a, c, b] } else { [a, b, c] }, by);
                }
            },
        )
    }

    /// The triangles of the file that are in memory, each by its record.
    pub(crate) fn each_irregular(&self, mut visit: impl FnMut(u32, &Corners)) {
        for t in self.submesh.beside_records(self.survey) {
            if let Some(corners) = self.submesh.as_read(self.survey.records, t) {
                visit(self.submesh.record(t), &corners);
            }
        }
    }

    /// All others, in no order; each chunk gathers by `visit` in a list of its own.
    pub(crate) fn each_regular<R: Send + Default>(&self, visit: impl Fn(&mut R, u32, &Corners) + Sync) -> Vec<R> {
        self.survey.visit_regular(
            |_| true,
            R::default,
            |into, place, _| visit(into, place, &position::corners(&self.survey.records[place as usize])),
        )
    }

    /// The triangles that were not there as they are, each by a number of its own, with the repair that made them.
    pub(crate) fn each_added(&self, mut visit: impl FnMut(u32, &Corners, Option<RepairName>)) {
        for t in self.submesh.beside_records(self.survey).filter(|t| self.submesh.lives(*t)) {
            let (points, by) = (self.submesh.points(t), self.made_by(t));
            if !is_no_harm(by) && !self.submesh.stands(self.survey.records, t) {
                visit(t, &points, by);
            }
        }
        let first = self.submesh.triangles.len() as u32;
        (first..).zip(self.wrapped).for_each(|(n, corners)| visit(n, corners, Some(RepairName::Wrap)));
    }

    /// The repair that made a triangle what it is.
    fn made_by(&self, t: u32) -> Option<RepairName> {
        let triangle = &self.submesh.triangles[t as usize];
        match triangle.origin {
            Origin::Added(by) => Some(by),
            Origin::Input(_) | Origin::Part(_) => triangle.by,
        }
    }

    /// Twice the area of all that was there, in the survey's units.
    pub(crate) fn area_before(&self) -> i128 {
        let measure = &self.survey.measure;
        let regular: i128 = self.survey.regions.iter().filter(|r| r.first != NONE).map(|r| r.extent.area).sum();
        let triangles = self.submesh.beside_records(self.survey);
        let irregular = triangles.filter_map(|t| self.submesh.as_read(self.survey.records, t));
        regular + irregular.map(|corners| measure.triangle(&corners).area).sum::<i128>()
    }
}

/// Walls that parts of a body had in common bound nothing, and what the profile asked for is as it was asked for.
fn is_no_harm(by: Option<RepairName>) -> bool {
    by == Some(RepairName::CommonWall) || is_asked_for(by)
}

fn is_asked_for(by: Option<RepairName>) -> bool {
    matches!(by, Some(RepairName::SheetSolids | RepairName::Skirt))
}
