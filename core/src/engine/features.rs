//! Features that a profile does not want: looked for in a mesh that is good, and told of in its report.

use std::path::Path;

use crate::contract::error::{Error, Result};
use crate::contract::report::{Feature, Features, MOST_LISTED, Outcome, RepairName, Report};
use crate::contract::settings::Profile;
use crate::defeature::{self, Limits as Below, Removed};
use crate::engine::judging;
use crate::engine::mesh::Mesh;
use crate::engine::work::Work;
use crate::io::record::{self, Record};
use crate::output::edit::Edit;
use crate::util::parallel;

/// Memory for each triangle while features are looked for.
const BYTES_A_TRIANGLE: u64 = 1 << 10;

/// What the profile wants to be rid of, if anything.
pub(crate) fn limits_of(profile: &Profile) -> Option<Below> {
    let limit = |below: f64| (below > 0.0).then_some(below);
    let below = Below {
        holes_below: limit(profile.remove_holes_below_mm),
        fillets_below: limit(profile.remove_fillets_below_mm),
        grooves_below: limit(profile.remove_grooves_below_mm),
        bosses_below: limit(profile.remove_bosses_below_mm),
    };
    (profile.repair && below != Below::default()).then_some(below)
}

/// The features of a mesh that are to go, or why none was looked for.
pub(crate) fn find(
    (path, records): (&Path, &[Record]),
    report: &Report,
    below: &Below,
    work: Work<'_>,
) -> Result<std::result::Result<Removed, String>> {
    if !report.verdict.good {
        return Ok(Err("the mesh is not good, so no feature of it was looked for".into()));
    }
    let needed = records.len() as u64 * BYTES_A_TRIANGLE;
    if needed > work.limits.memory_bytes {
        let [needed, given] = [needed, work.limits.memory_bytes].map(|bytes| bytes.div_ceil(1 << 20));
        return Ok(Err(format!("features of so many triangles take {needed} MiB of memory, and {given} MiB may be used")));
    }
    work.progress.at("features", 0, records.len() as u64);
    let corners: Vec<_> = records.iter().map(record::corners).collect();
    let mesh = match Mesh::from_triangles(&corners) {
        Ok(mesh) => mesh,
        Err(error) => return Ok(Err(error.to_string())),
    };
    drop(corners);
    let removed = parallel::in_pool(work.limits.threads, || defeature::defeature(mesh.vertices(), mesh.faces(), below));
    if work.progress.cancelled() {
        return Err(Error::cancelled(path, "features"));
    }
    Ok(removed.map_err(|error| error.to_string()))
}

/// New triangles of the mesh without its features.
pub(crate) fn added(removed: &Removed) -> Vec<Record> {
    removed.added.iter().map(|corners| record::encode(*corners, 0)).collect()
}

/// Completes the report of a repair by what was `judged` of the mesh without its features. `edit`: all that was done, of so many records.
pub(crate) fn tell(report: &mut Report, features: &Features, judged: Report, edit: Option<(&Edit, usize)>) {
    if report.outcome == Outcome::Clean {
        report.outcome = Outcome::Repaired;
    }
    let note = format!("{} triangles removed, {} added", features.triangles_gone, features.triangles_added);
    judging::add_last(report, RepairName::Defeature, features.removed, note);
    if let Some((edit, records)) = edit {
        report.edit = edit.summary(records);
        report.edit_records = report.limits.list_edit.then(|| edit.listed());
    }
    judging::certify_anew(report, judged.certificate);
    (report.after, report.thin_walls) = (Some(judged.before), judged.thin_walls);
}

/// What was found, for the report.
pub(crate) fn told(removed: &Removed) -> Features {
    let is_left = |feature: &&defeature::Feature| matches!(feature.outcome, defeature::Outcome::Left(_));
    let left = removed.features.iter().filter(is_left).count() as u64;
    let listed = removed.features.iter().take(MOST_LISTED).map(|feature| Feature {
        kind: feature.kind.to_string(),
        centre: feature.centre,
        axis: feature.axis,
        size: feature.size,
        length: feature.length,
        depth: feature.depth,
        confidence: feature.confidence,
        triangles: feature.triangles.len() as u64,
        left: match &feature.outcome {
            defeature::Outcome::Left(reason) => Some(reason.to_string()),
            defeature::Outcome::Removed => None,
        },
    });
    Features {
        removed: removed.features.len() as u64 - left,
        left,
        triangles_gone: removed.removed_triangles.len() as u64,
        triangles_added: removed.added.len() as u64,
        why_not: None,
        listed: listed.collect(),
    }
}

/// No feature is removed after all, since the result would be no good.
pub(crate) fn left(mut features: Features, judged: &Report) -> Features {
    let why = format!("without its features the mesh is not good: {}", judged.verdict.reasons.join("; "));
    for feature in &mut features.listed {
        feature.left.get_or_insert_with(|| "the mesh is not good without it".into());
    }
    let all = features.removed + features.left;
    Features { removed: 0, left: all, triangles_gone: 0, triangles_added: 0, why_not: Some(why), listed: features.listed }
}
