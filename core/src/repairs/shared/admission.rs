//! Which loops may be closed: what the profile admits, and what is no rim of a lone sheet.
//!
//! A sheet that bounds nothing was meant to be one, or lacks everything but one side: whatever closes it turns it into a body that nobody
//! drew. Its rim is told from a hole by the patch, which would lie back along the surface, and by what it would enclose: next to nothing for
//! the surface's size. (A relief without its bottom encloses more, and is closed.)

use crate::contract::report::LoopClass;
use crate::contract::settings::Profile;
use crate::detect::holes::{self, Shapes, loops::Loop, owners};
use crate::repairs::shared::work::Work;
use crate::submesh::Submesh;
use crate::submesh::components::{Components, Reversed, Through};
use crate::submesh::edges::Edges;
use crate::submesh::near::Tolerance;
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// A patch lies back along the surface if it continues it by less than this ([`Shapes::continues`]).
const LIES_BACK: f64 = -0.5;
/// And if it is at least this share of the surface: the patch of a sheet is about as large as the sheet.
const LARGE: f64 = 0.25;
/// A sheet encloses less than this share of its size: the root of the area of one side, cubed. A plate that rises by a fiftieth of its width
/// on average.
pub(crate) const THIN: f64 = 0.02;

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
    #[error("the rim of a lone sheet, which would enclose next to nothing; the profile's `close_sheets` closes it")]
    Sheet,
}

/// What decides of a submesh's loops.
pub(crate) struct Admission<'p> {
    profile: &'p Profile,
    longest: f64,
    /// First vertices of loops that are not to be closed, ascending, with the reason.
    refused: Vec<(u32, NotAdmitted)>,
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
        if !profile.leave_open.is_empty() {
            let left = left_open(submesh, edges, loops, tolerance, profile);
            refused.extend(left.map(|(rim, class)| (rim.vertices[0], NotAdmitted::Class(class.name()))));
        }
        if !profile.close_sheets && profile.fill_holes {
            refused.extend(sheet_rims(survey, submesh, edges, loops, shapes, reversed).map(|v| (v, NotAdmitted::Sheet)));
        }
        if let Some(place) = only_loop {
            // As numbers: −0.0 is 0.0, and no vertex is where NaN is.
            let is_there = |v: &u32| submesh.positions[*v as usize] == place;
            let others = loops.iter().filter(|rim| !rim.vertices.iter().any(is_there));
            refused = others.map(|rim| (rim.vertices[0], NotAdmitted::NotAsked)).collect();
        }
        refused.sort_by_key(|(v, _)| *v);
        Self { profile, longest, refused }
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

    /// These sheets are lone no more.
    pub(crate) fn joined(&mut self, rims: &[&Loop]) {
        let mut firsts: Vec<u32> = rims.iter().map(|rim| rim.vertices[0]).collect();
        firsts.sort_unstable();
        self.refused.retain(|(v, _)| firsts.binary_search(v).is_err());
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
        Some(&self.refused[at].1)
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

/// First vertices of the loops that are rims of lone sheets.
fn sheet_rims<'l>(
    survey: &Survey<'_>,
    submesh: &Submesh,
    edges: &Edges,
    loops: &'l [Loop],
    shapes: &Shapes,
    reversed: &Reversed,
) -> impl Iterator<Item = u32> + use<'l> {
    let mut lies_back: Vec<bool> = shapes.continues().map(|continues| continues < LIES_BACK).collect();
    let mut of_loop = vec![NONE; loops.len()];
    let mut is_sheet = Vec::new();
    if lies_back.contains(&true) {
        let components = Components::of(survey, submesh, edges, reversed, Through::EveryEdge);
        let middle = survey.measure.middle();
        // What the components enclose once their loops are closed, and the area they have then.
        let mut enclosed: Vec<(f64, f64)> =
            components.list.iter().map(|c| (survey.measure.volume(c.extent), survey.measure.area(c.extent))).collect();
        for ((rim, component), lies_back) in loops.iter().zip(&mut of_loop).zip(&mut lies_back) {
            *component = components.of_triangle[rim.triangles[0] as usize];
            if let Some((volume, area)) = enclosed.get_mut(*component as usize) {
                let (more, patch) = owners::fan(submesh, &rim.vertices, middle);
                *lies_back &= patch >= LARGE * survey.measure.area(components.list[*component as usize].extent);
                *volume += more;
                *area += patch;
            }
        }
        is_sheet = enclosed.iter().map(|(volume, area)| volume.abs() < THIN * (area / 2.0).powi(3).sqrt()).collect();
    }
    loops
        .iter()
        .zip(lies_back)
        .zip(of_loop)
        .filter(move |((_, lies_back), component)| *lies_back && is_sheet.get(*component as usize) == Some(&true))
        .map(|((rim, _), _)| rim.vertices[0])
}
