//! How flat a patch is.

use glam::DVec3;

/// A rim that nobody cut with a plane, as the bottom of a scan, rises and falls by this share of its size: the root of the area across it.
const RAGGED: f64 = 0.05;

/// How far places reach along a direction of any length; infinite if it has none. O(places).
pub(crate) fn height(places: impl Iterator<Item = DVec3>, along: DVec3) -> f64 {
    let Some(along) = along.try_normalize() else { return f64::INFINITY };
    let heights = places.map(|p| p.dot(along));
    let (lo, hi) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), h| (lo.min(h), hi.max(h)));
    hi - lo
}

/// Does what reaches so high across this area rise and fall more than a rim does that was cut by hand?
pub(crate) fn is_ragged(height: f64, area: f64) -> bool {
    height > RAGGED * area.sqrt()
}
