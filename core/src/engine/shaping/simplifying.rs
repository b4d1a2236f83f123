//! Fewer triangles, as a profile asks for them.

use super::change::{Change, Told, replaced};
use crate::contract::report::Simplified;
use crate::contract::settings::Profile;
use crate::engine::mesh::Mesh;
use crate::engine::work::Work;
use crate::simplify::{self, Ended, Input, Options};

/// Memory for each triangle of a mesh that is simplified or smoothed.
pub(super) const BYTES_A_TRIANGLE: u64 = 320;

/// How many triangles a profile wants of so many.
pub(super) fn wanted(profile: &Profile, triangles: usize) -> Option<usize> {
    let count = (profile.simplify_triangles > 0).then(|| usize::try_from(profile.simplify_triangles).unwrap_or(usize::MAX));
    let share = (profile.simplify_ratio > 0.0).then_some((triangles as f64 * profile.simplify_ratio) as usize);
    count.into_iter().chain(share).min()
}

/// Why more triangles are left than were wanted.
pub(super) fn why_not(wanted: usize, ended: Ended, within: Option<f64>) -> String {
    let farther = if within.is_some() { "farther off than allowed" } else { "farther off than 1 % of the diagonal" };
    let why = match ended {
        Ended::Edges => "fewer would cross, turn over, or lose an edge of the part".into(),
        Ended::Both => format!("fewer would be {farther}, cross, turn over, or lose an edge of the part"),
        _ => format!("fewer would be {farther}"),
    };
    format!("{wanted} triangles were asked for; {why}")
}

/// The mesh with fewer triangles, or why that cannot be.
pub(super) fn simplify(mesh: &Mesh, work: Work<'_>) -> Result<Change, String> {
    let profile = work.profile;
    let wanted = wanted(profile, mesh.faces().len());
    let within = (profile.simplify_within_mm > 0.0).then_some(profile.simplify_within_mm);
    let options = Options {
        triangles: wanted,
        max_deviation: within,
        feature_angle: Some(profile.keep_edges_degrees.to_radians()),
        ..Options::default()
    };
    let input = Input { points: mesh.vertices(), faces: mesh.faces(), region: None, fixed: None, within: None };
    let outcome = simplify::simplify(&input, &options).map_err(|error| error.to_string())?;
    let proved = outcome.proved.unwrap_or_default();
    let left = outcome.faces.len();
    let why_not = wanted.filter(|wanted| left > *wanted).map(|wanted| why_not(wanted, outcome.ended, within));
    let told = Simplified {
        before: mesh.faces().len() as u64,
        after: outcome.faces.len() as u64,
        to_result: proved.forward,
        from_result: proved.backward,
        volume_change: outcome.volume[1] - outcome.volume[0],
        why_not,
    };
    let (gone, added) = replaced(mesh, (&outcome.points, &outcome.faces, &outcome.origins));
    Ok(Change { gone, added: added.into(), told: Told::Simplified(told) })
}
