//! Diagnosis: what is known of a file before anything is done about it.
//!
//! **In:** records, a profile, limits.
//! **Out:** a [`Diagnosis`]: the survey, the submesh, its defects, and the tolerances that follow from the size of the surface.
//! **Promise:** nothing is changed; `inspect` ends here.

use std::path::Path;

use crate::contract::error::Result;
use crate::contract::progress::Progress;
use crate::contract::report::Defects;
use crate::contract::settings::{Limits, Profile};
use crate::detect::defects;
use crate::geometry::sums::{Bounds, step_at};
use crate::io::record;
use crate::stream::budget;
use crate::submesh::Submesh;
use crate::submesh::edges::{Edge, Edges};
use crate::submesh::near::Tolerance;
use crate::topology::survey::Survey;

/// The survey of a file, its untouched submesh and its defects.
pub(crate) struct Diagnosis<'a> {
    pub(crate) survey: Survey<'a>,
    pub(crate) submesh: Submesh,
    pub(crate) tolerance: Tolerance,
    pub(crate) defects: Defects,
}

impl<'a> Diagnosis<'a> {
    pub(crate) fn of(
        path: &Path,
        records: &'a [record::Record],
        profile: &Profile,
        limits: &Limits,
        progress: &dyn Progress,
    ) -> Result<Self> {
        Self::after(Survey::new(path, records, profile.check_self_intersections, limits, progress)?, path, profile)
    }

    /// The diagnosis of a survey.
    pub(crate) fn after(survey: Survey<'a>, path: &Path, profile: &Profile) -> Result<Self> {
        let submesh = Submesh::gather(&survey);
        let edges = Edges::of(&submesh);
        let boundary_edges = edges.iter().filter(Edge::is_boundary).count() as u64;
        survey.take_boundary(path, boundary_edges, budget::boundary_bytes(boundary_edges))?;
        Ok(Self::counted(survey, submesh, &edges, profile))
    }

    /// Of a submesh that is as gathered.
    pub(crate) fn count(survey: Survey<'a>, submesh: Submesh, profile: &Profile) -> Self {
        let edges = Edges::of(&submesh);
        Self::counted(survey, submesh, &edges, profile)
    }

    fn counted(survey: Survey<'a>, submesh: Submesh, edges: &Edges, profile: &Profile) -> Self {
        let tolerance = tolerance(&survey.bounds, profile);
        let defects = defects::count(&survey, &submesh, edges, &tolerance);
        Self { survey, submesh, tolerance, defects }
    }

    /// Gives the memory of everything else back.
    pub(crate) fn into_survey(self) -> Survey<'a> {
        self.survey
    }

    /// The box of all triangles that have an area.
    pub(crate) fn surface_bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        self.survey.regions.iter().for_each(|p| bounds.add(&p.bounds));
        self.submesh.living().filter(|t| !self.submesh.is_collinear(*t)).for_each(|t| bounds.include(&self.submesh.points(t)));
        bounds.normalised()
    }
}

/// Never below what f32 tells apart at the model's coordinates: four steps of the largest one.
pub(crate) fn tolerance(bounds: &Bounds, profile: &Profile) -> Tolerance {
    if profile.weld_relative <= 0.0 {
        return Tolerance { weld: 0.0, edge_share: 0.0 };
    }
    let step = step_at(bounds.largest_coordinate());
    Tolerance { weld: (profile.weld_relative * bounds.diagonal()).max(4.0 * step), edge_share: profile.weld_max_edge_share }
}
