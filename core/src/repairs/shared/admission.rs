//! Which loops may be closed: what the profile admits, and what is no rim of a lone sheet ([`crate::repairs::shared::lone_sheets`]).

use crate::contract::report::LoopClass;
use crate::contract::settings::{Bodies, Guarantee, Profile, Sheets};
use crate::detect::holes::{self, Shapes, loops::Loop};
pub(crate) use crate::repairs::shared::lone_sheets::THIN;
use crate::repairs::shared::lone_sheets::{self, Which};
use crate::repairs::shared::work::Work;
use crate::submesh::Submesh;
use crate::submesh::components::Reversed;
use crate::submesh::edges::Edges;
use crate::submesh::near::Tolerance;
use crate::topology::survey::Survey;
use std::collections::BTreeSet;

/// Why a loop is not to be closed.
#[derive(Clone, Debug, thiserror::Error)]
pub(crate) enum NotAdmitted {
    #[error("the profile fills no holes")]
    FillsNone,
    #[error("more than the profile's {0} edges")]
    Edges(u32),
    #[error("longer than the profile's {0:.3}")]
    Perimeter(f64),
    #[error("the profile leaves {0} loops open")]
    Class(&'static str),
    #[error("only another loop was to be closed")]
    NotAsked,
    #[error(
        "the rim of surface without thickness (a lone sheet), which bounds no material; `sheets` in the profile makes a solid of it: \"thicken\" a wall, \"base\" a block"
    )]
    Sheet,
}

/// The rules of a profile, and the loops that they refuse.
pub(crate) struct Admission<'p> {
    profile: &'p Profile,
    longest: f64,
    /// First vertices of loops that are not to be closed, ascending, with the reason.
    refused: Vec<(u32, NotAdmitted)>,
    /// By triangle of the submesh, as far as there are any: it is part of a lone sheet that has one side only.
    one_sided: Vec<bool>,
    /// By triangle of the submesh: its component.
    of_triangle: Vec<u32>,
    /// Components that were joined to others.
    joined: BTreeSet<u32>,
    /// First vertices of loops that were joined to another one, and are refused no more.
    admitted: BTreeSet<u32>,
}

impl<'p> Admission<'p> {
    /// O(n log n) in the loops, and a look at the components if a loop may be a sheet's.
    pub(crate) fn of(
        survey: &Survey<'_>,
        work: &mut Work<'_>,
        loops: &[Loop],
        shapes: &Shapes,
        reversed: &Reversed,
        tolerance: &Tolerance,
        (profile, only_loop): (&'p Profile, Option<[f32; 3]>),
    ) -> Self {
        let (submesh, edges) = work.edges();
        let by_share = profile.max_hole_perimeter_relative * survey.bounds.diagonal();
        let longest = if profile.max_hole_perimeter_mm > 0.0 { by_share.min(profile.max_hole_perimeter_mm) } else { by_share };
        let mut refused = Vec::new();
        let (mut one_sided, mut of_triangle) = (Vec::new(), Vec::new());
        if !profile.leave_open.is_empty() {
            let left = left_open(submesh, edges, loops, tolerance, profile);
            refused.extend(left.map(|(rim, class)| (rim.vertices[0], NotAdmitted::Class(class.name()))));
        }
        if !profile.closes_sheets() && profile.fill_holes {
            // What nobody would miss, closed or not, is not closed where it is dropped.
            let goes = profile.sheets == Sheets::Drop && profile.guarantee == Guarantee::Wrap && profile.bodies != Bodies::Keep;
            let which = if goes { Which::Unneeded } else { Which::Sheets };
            let sheets = lone_sheets::recognise(survey, submesh, edges, loops, shapes, reversed, which);
            refused.extend(sheets.rims.into_iter().map(|v| (v, NotAdmitted::Sheet)));
            (one_sided, of_triangle) = (sheets.one_sided, sheets.of_triangle);
        }
        if let Some(place) = only_loop {
            // As numbers: −0.0 is 0.0, and no vertex is where NaN is.
            let is_there = |v: &u32| submesh.positions[*v as usize] == place;
            let others = loops.iter().filter(|rim| !rim.vertices.iter().any(is_there));
            refused = others.map(|rim| (rim.vertices[0], NotAdmitted::NotAsked)).collect();
            one_sided.clear();
        }
        refused.sort_by_key(|(v, _)| *v);
        Self { profile, longest, refused, one_sided, of_triangle, joined: BTreeSet::new(), admitted: BTreeSet::new() }
    }

    /// May this loop be closed?
    pub(crate) fn check(&self, submesh: &Submesh, rim: &Loop) -> Result<(), NotAdmitted> {
        self.check_limits(submesh, rim)?;
        self.refusal(rim).map_or(Ok(()), |reason| Err(reason.clone()))
    }

    /// The same together with another loop: a sheet that is joined to something is lone no more.
    pub(crate) fn check_joined(&self, submesh: &Submesh, rim: &Loop) -> Result<(), NotAdmitted> {
        if self.is_sheet(rim) { self.check_limits(submesh, rim) } else { self.check(submesh, rim) }
    }

    /// Is it the rim of a lone sheet?
    pub(crate) fn is_sheet(&self, rim: &Loop) -> bool {
        matches!(self.refusal(rim), Some(NotAdmitted::Sheet))
    }

    /// Is this triangle part of a lone sheet that has one side only? Whatever edges it lacks, in loops or not, stay open.
    pub(crate) fn is_one_sided(&self, t: u32) -> bool {
        self.one_sided.get(t as usize) == Some(&true) && !self.is_joined(t)
    }

    /// These rims became one. Lone sheets that this joins to something are lone no more, whatever other rims they have. O(rims × log).
    pub(crate) fn joined(&mut self, rims: &[&Loop]) {
        let along = rims.iter().flat_map(|rim| &rim.triangles);
        let components: BTreeSet<u32> = along.filter_map(|t| self.of_triangle.get(*t as usize).copied()).collect();
        if components.len() > 1 {
            self.joined.extend(components);
        }
        self.admitted.extend(rims.iter().skip(1).map(|rim| rim.vertices[0]));
    }

    fn is_joined(&self, t: u32) -> bool {
        self.of_triangle.get(t as usize).is_some_and(|component| self.joined.contains(component))
    }

    fn check_limits(&self, submesh: &Submesh, rim: &Loop) -> Result<(), NotAdmitted> {
        if !self.profile.fill_holes {
            return Err(NotAdmitted::FillsNone);
        }
        if rim.vertices.len() as u64 > u64::from(self.profile.max_hole_edges) {
            return Err(NotAdmitted::Edges(self.profile.max_hole_edges));
        }
        if rim.perimeter(submesh) > self.longest {
            return Err(NotAdmitted::Perimeter(self.longest));
        }
        Ok(())
    }

    fn refusal(&self, rim: &Loop) -> Option<&NotAdmitted> {
        let at = self.refused.binary_search_by_key(&rim.vertices[0], |(v, _)| *v).ok()?;
        let reason = &self.refused[at].1;
        let is_lone_no_more = matches!(reason, NotAdmitted::Sheet) && self.is_joined(rim.triangles[0]);
        (!is_lone_no_more && !self.admitted.contains(&rim.vertices[0])).then_some(reason)
    }
}

/// Loops of kinds that the profile leaves open.
pub(crate) fn left_open<'l>(
    submesh: &Submesh,
    edges: &Edges,
    loops: &'l [Loop],
    tolerance: &Tolerance,
    profile: &Profile,
) -> impl Iterator<Item = (&'l Loop, LoopClass)> {
    let classes = holes::classify(submesh, edges, loops, tolerance, profile.gap_edge_share).map(|found| found.class);
    loops.iter().zip(classes).filter(|(_, class)| profile.leave_open.contains(class))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rim(triangles: &[u32]) -> Loop {
        let vertices = triangles.iter().map(|t| 10 + t).collect();
        Loop { vertices, triangles: triangles.to_vec(), branches: false, way: 0 }
    }

    /// A lone sheet of triangles 0 to 2, and triangles 3 to 5 of something else.
    #[test]
    fn a_sheet_is_lone_until_a_patch_joins_it_to_something() {
        let profile = Profile::default();
        let mut admission = Admission {
            profile: &profile,
            longest: f64::INFINITY,
            refused: vec![(10, NotAdmitted::Sheet)],
            one_sided: vec![true, true, true, false, false, false],
            of_triangle: vec![0, 0, 0, 1, 1, 1],
            joined: BTreeSet::new(),
            admitted: BTreeSet::new(),
        };
        let [own, of_both] = [rim(&[0, 1, 2]), rim(&[3, 4, 1])];
        admission.joined(&[&own]);
        assert!(admission.is_sheet(&own) && admission.is_one_sided(2), "a patch of its own joins it to nothing");
        admission.joined(&[&of_both]);
        assert!(!admission.is_sheet(&own) && !admission.is_one_sided(2));
    }
}
