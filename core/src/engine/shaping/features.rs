//! Features that a profile does not want: looked for in a mesh that is good, and told of in its report.

use super::change::{Change, Told, encoded};
use crate::contract::report::{Feature, Features, MOST_LISTED, Report};
use crate::contract::settings::Profile;
use crate::defeature::{self, Limits as Below, Removed};
use crate::engine::mesh::Mesh;
use crate::util::bits;

/// The features that the profile does not want, if there are any such.
pub(super) fn limits_of(profile: &Profile) -> Option<Below> {
    let limit = |below: f64| (below > 0.0).then_some(below);
    let below = Below {
        holes_below: limit(profile.remove_holes_below_mm),
        fillets_below: limit(profile.remove_fillets_below_mm),
        grooves_below: limit(profile.remove_grooves_below_mm),
        bosses_below: limit(profile.remove_bosses_below_mm),
    };
    (below != Below::default()).then_some(below)
}

/// The features of a mesh that are to go, or why none can be looked for.
pub(super) fn find(mesh: &Mesh, below: &Below) -> Result<Change, String> {
    let removed = defeature::defeature(mesh.vertices(), mesh.faces(), below).map_err(|error| error.to_string())?;
    let told = Told::Features(told(&removed));
    let gone = bits::of(mesh.faces().len(), removed.removed_triangles.into_iter());
    Ok(Change { gone, added: encoded(removed.added.into_iter()).into(), told })
}

/// Features that were found, for the report.
fn told(removed: &Removed) -> Features {
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
pub(super) fn left(mut features: Features, judged: &Report) -> Features {
    let why = format!("without its features the mesh is not good: {}", judged.verdict.reasons.join("; "));
    for feature in &mut features.listed {
        feature.left.get_or_insert_with(|| "the mesh is not good without it".into());
    }
    let all = features.removed + features.left;
    Features { removed: 0, left: all, triangles_gone: 0, triangles_added: 0, why_not: Some(why), listed: features.listed }
}
