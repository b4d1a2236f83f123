//! Waves that a profile does not want are smoothed.

use super::change::{Change, Told, moved, vertices_moved};
use crate::contract::report::Smoothed;
use crate::engine::mesh::Mesh;
use crate::engine::work::Work;
use crate::smooth::{self, Filter, Options};

/// Of the volume, a mesh may lose or gain so much by smoothing.
const VOLUME: f64 = 0.01;
/// More passes than these are no smoothing of waves any more.
const PASSES: usize = 10_000;

/// The mesh with its waves smoothed, or why that cannot be.
pub(super) fn smooth(mesh: &Mesh, work: Work<'_>) -> Result<Change, String> {
    let profile = work.profile;
    let edge = mean_edge(mesh).ok_or("it has no edges")?;
    let length = profile.smooth_waves_below_mm;
    let filter = Filter::of_waves(length / edge);
    let found = filter.and_then(|filter| Some((filter, filter.passes(length / edge, profile.smooth_leaves)?)));
    let (filter, passes) = found
        .ok_or_else(|| format!("its edges are {edge:.3e} long in the mean: waves of {length} are shorter than two of them"))?;
    if passes > PASSES {
        return Err(format!("it would take {passes} passes, and more than {PASSES} change more than waves"));
    }
    let feature_angle = Some(profile.keep_edges_degrees.to_radians());
    let options = Options { filter, passes, feature_angle, max_volume_change: Some(VOLUME) };
    let smoothed = smooth::smooth(mesh.vertices(), mesh.faces(), None, &options);
    let settled = &smoothed.settled;
    let told = Smoothed {
        passes: passes as u64,
        moved: vertices_moved(mesh, &settled.points),
        held: settled.held as u64,
        displacement: settled.largest,
        volume_change: smoothed.volume[1] - smoothed.volume[0],
        why_not: None,
    };
    let (gone, added) = moved(mesh, &settled.points);
    Ok(Change { gone, added: added.into(), told: Told::Smoothed(told) })
}

/// The mean length of edges, each counted once for each of its triangles; `None` without any. O(faces).
fn mean_edge(mesh: &Mesh) -> Option<f64> {
    let place = |vertex: u32| mesh.vertices().get(vertex as usize).copied().unwrap_or_default();
    let length = |a: u32, b: u32| {
        let [a, b] = [place(a), place(b)];
        (0..3).map(|axis| (f64::from(a[axis]) - f64::from(b[axis])).powi(2)).sum::<f64>().sqrt()
    };
    let sum: f64 = mesh.faces().iter().map(|[a, b, c]| length(*a, *b) + length(*b, *c) + length(*c, *a)).sum();
    let mean = sum / (3 * mesh.faces().len()) as f64;
    (mean > 0.0 && mean.is_finite()).then_some(mean)
}
