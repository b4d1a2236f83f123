//! Work on a mesh that is repaired already: features, residue of tools, waves and triangles that a profile does not want.
//!
//! Each step looks at the mesh and says which triangles go and which come; the mesh that it makes is judged by itself, and counts only if it is no worse.

mod change;
mod corrections;
mod features;
mod large;
mod residue;
mod simplifying;
mod smoothing;

use std::path::Path;

use crate::contract::defects::Defects;
use crate::contract::error::{Error, Result};
use crate::contract::report::{Features, Outcome, RepairName, Report, Residue, Simplified, Smoothed};
use crate::contract::settings::Profile;
use crate::engine::judging;
use crate::engine::mesh::Mesh;
use crate::engine::work::Work;
use crate::io::record::Record;
use crate::output::edit::Edit;
use crate::util::parallel;
pub(crate) use change::{Change, Told};
pub(crate) use corrections::Origins;

/// A step that a profile asks for.
#[derive(Clone, Debug)]
pub(crate) enum Step {
    /// Small features go.
    Features(crate::defeature::Limits),
    /// Residue of a tool goes, or is looked for without a tool path.
    Residue,
    /// Waves go.
    Smooth,
    /// Triangles are made fewer.
    Simplify,
}

/// The steps that a profile asks for, in their order.
pub(crate) fn steps(profile: &Profile) -> Vec<Step> {
    if !profile.repair {
        return Vec::new();
    }
    let features = features::limits_of(profile).map(Step::Features);
    let is_residue = !profile.residue.toolpath.is_empty() || profile.residue.without_path;
    let residue = is_residue.then_some(Step::Residue);
    let smooth = (profile.smooth_waves_below_mm > 0.0).then_some(Step::Smooth);
    let is_simpler = profile.simplify_triangles > 0 || profile.simplify_ratio > 0.0 || profile.simplify_within_mm > 0.0;
    [features, residue, smooth, is_simpler.then_some(Step::Simplify)].into_iter().flatten().collect()
}

impl Step {
    /// As stages of a report call it.
    pub(crate) fn stage(&self) -> &'static str {
        match self {
            Self::Features(_) => "features",
            Self::Residue => "residue",
            Self::Smooth => "smooth",
            Self::Simplify => "simplify",
        }
    }

    /// As an edit and a list of repairs call it.
    pub(crate) fn repair(&self) -> RepairName {
        match self {
            Self::Features(_) => RepairName::Defeature,
            Self::Residue => RepairName::Residue,
            Self::Smooth => RepairName::Smooth,
            Self::Simplify => RepairName::Simplify,
        }
    }

    /// Memory for each triangle while it looks.
    fn bytes_a_triangle(&self) -> u64 {
        match self {
            Self::Features(_) => 1 << 10,
            Self::Residue => residue::BYTES_A_TRIANGLE,
            Self::Smooth | Self::Simplify => simplifying::BYTES_A_TRIANGLE,
        }
    }

    /// Looks at a mesh; why nothing changes, where nothing can. `origins`: of its triangles, where a step wants to know them.
    ///
    /// # Errors
    /// [`Error::cancelled`].
    pub(crate) fn look(
        &self,
        (path, records): (&Path, &[Record]),
        (report, origins): (&Report, &(dyn Fn() -> Origins + Sync)),
        work: Work<'_>,
    ) -> Result<std::result::Result<Change, Told>> {
        if matches!(self, Self::Features(_)) && !report.verdict.good {
            return Ok(Err(self.refused("the mesh is not good, so no feature of it was looked for".into())));
        }
        if matches!(self, Self::Simplify) && large::is_large(records.len()) {
            let found = large::simplify((path, records), &large::Sizes::USUAL, work)?;
            return Ok(found.map_err(|why| self.refused(why)));
        }
        let needed = records.len() as u64 * self.bytes_a_triangle();
        if needed > work.limits.memory_bytes {
            let [needed, given] = [needed, work.limits.memory_bytes].map(|bytes| bytes.div_ceil(1 << 20));
            let why = format!("it takes {needed} MiB of memory for so many triangles, and {given} MiB may be used");
            return Ok(Err(self.refused(why)));
        }
        work.progress.at(self.stage(), 0, records.len() as u64);
        let found = parallel::in_pool(work.limits.threads, || {
            let mesh = Mesh::of_records(records).map_err(|error| error.to_string())?;
            match self {
                Self::Features(below) => features::find(&mesh, below),
                Self::Residue => residue::find(&mesh, origins, work),
                Self::Smooth => smoothing::smooth(&mesh, work),
                Self::Simplify => simplifying::simplify(&mesh, work),
            }
        });
        if work.progress.cancelled() {
            return Err(Error::cancelled(path, self.stage()));
        }
        Ok(found.map_err(|why| self.refused(why)))
    }

    /// The reason why nothing was done.
    fn refused(&self, why: String) -> Told {
        let why_not = Some(why);
        match self {
            Self::Features(_) => Told::Features(Features { why_not, ..Features::default() }),
            Self::Residue => Told::Residue(Residue { why_not, ..Residue::default() }),
            Self::Smooth => Told::Smoothed(Smoothed { why_not, ..Smoothed::default() }),
            Self::Simplify => Told::Simplified(Simplified { why_not, ..Simplified::default() }),
        }
    }
}

impl Told {
    /// Puts it into the report.
    pub(crate) fn put(self, report: &mut Report) {
        match self {
            Self::Features(told) => report.features = Some(told),
            Self::Residue(told) => residue::put(told, report),
            Self::Smoothed(told) => report.smoothed = Some(told),
            Self::Simplified(told) => report.simplified = Some(told),
        }
    }

    /// The same where the mesh stays as it was after all, since the changed one is worse.
    pub(crate) fn left(self, judged: &Report) -> Self {
        let why = |how: &str| Some(format!("{how} the mesh is not good: {}", judged.verdict.reasons.join("; ")));
        match self {
            Self::Features(told) => Self::Features(features::left(told, judged)),
            Self::Residue(Residue { regions, findings, .. }) => {
                Self::Residue(Residue { why_not: why("without residue"), regions, findings, ..Residue::default() })
            }
            Self::Smoothed(_) => Self::Smoothed(Smoothed { why_not: why("smoothed,"), ..Smoothed::default() }),
            Self::Simplified(Simplified { before, .. }) => Self::Simplified(Simplified {
                before,
                after: before,
                why_not: why("with fewer triangles"),
                ..Simplified::default()
            }),
        }
    }

    /// How many things were done.
    fn count(&self) -> u64 {
        match self {
            Self::Features(told) => told.removed,
            Self::Residue(told) => told.moved,
            Self::Smoothed(told) => told.moved,
            Self::Simplified(told) => told.before.saturating_sub(told.after),
        }
    }
}

/// Whether a changed mesh may be the result: it is good, or the mesh before was not, and it has no more of any defect.
pub(crate) fn is_no_worse(report: &Report, judged: &Report) -> bool {
    let counts = |of: &Defects| {
        let crossing = of.self_intersections.as_ref().map_or(0, |found| found.triangles);
        [
            of.boundary_edges,
            of.nonmanifold_edges,
            of.nonmanifold_vertices,
            of.inconsistent_edges,
            of.degenerate_area,
            of.duplicates_same,
            of.duplicates_opposite,
            crossing,
        ]
    };
    let before = counts(report.after.as_ref().unwrap_or(&report.before));
    judged.verdict.good
        || !report.verdict.good && before.iter().zip(counts(&judged.before)).all(|(before, after)| after <= *before)
}

/// Completes the report of a repair by what was `judged` of the changed mesh, and how many triangles have gone and come. `edit`: all that was done, of so
/// many records.
pub(crate) fn tell(
    report: &mut Report,
    (step, told, [gone, added]): (&Step, Told, [u64; 2]),
    judged: Report,
    edit: Option<(&Edit, usize)>,
) {
    if report.outcome == Outcome::Clean {
        report.outcome = Outcome::Repaired;
    }
    let note = format!("{gone} triangles removed, {added} added");
    judging::add_last(report, step.repair(), told.count(), note);
    if let Some((edit, records)) = edit {
        report.edit = edit.summary(records);
        report.edit_records = report.limits.list_edit.then(|| edit.listed());
    }
    judging::certify_anew(report, judged.certificate);
    (report.after, report.thin_walls) = (Some(judged.before), judged.thin_walls);
    told.put(report);
}
