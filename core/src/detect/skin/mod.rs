//! How much of the surface that can be seen a repair has lost, and how much it has invented.
//!
//! **In:** the file as it was surveyed, and the submesh after all repairs.
//! **Out:** [`Skin`]: areas, largest distances, places and causes.
//!
//! Untouched triangles are the same bytes, so that only what was deleted, moved or added can have done harm: the cost follows the edit. Points are
//! taken on these triangles, by area ([`samples`]). First their distance from the other surface is looked at ([`near`]); only of those beyond the
//! limit it is asked whether they can be seen from outside ([`seen`]). *Lost* is what could be seen before and is far from the result; *invented* is
//! what can be seen in the result and is far from all that was there, less plausible patches ([`patches`]). Walls that parts of a body had in common
//! bound nothing, and are no skin.
//!
//! All counts are of points that depend on the mesh alone, so that neither chunks nor threads change them.

mod near;
mod patches;
mod samples;
mod seen;
mod surfaces;

use crate::contract::report::{RepairName, Skin, SkinCause, SkinChange, SkinPlace};
use crate::detect::bodies;
use crate::submesh::Submesh;
use crate::submesh::components::{Components, Reversed};
use crate::topology::survey::Survey;

use patches::Patches;
use samples::Samples;
use seen::OnSurface;
pub(crate) use surfaces::DroppedBy;
use surfaces::{Surfaces, Which};

/// The points whose distance is measured, of those that are farther than the limit.
const MEASURED: usize = 64;
/// The points that are asked whether they can be seen.
const ASKED: usize = 4096;
/// From this share of all surface on it is asked how much of that can be seen.
const WORTHWHILE: f64 = 1e-4;
/// By about so many points.
const PROBED: f64 = 1024.0;
/// The places that are listed.
const PLACES: usize = 8;
/// Places are cells of this share of the diagonal.
const PLACE: f64 = 0.05;

/// What the repairs know of the surface, beside the submesh.
#[derive(Clone, Copy, Default)]
pub(crate) struct Known<'a> {
    /// The triangles of wraps, which are not in the submesh.
    pub(crate) wrapped: &'a [[[f32; 3]; 3]],
    /// Triangles of patches that nothing speaks against, ascending.
    pub(crate) explained: &'a [u32],
    /// The triangles of cavities that poke out of what they are in: what is inside them is none of the skin, the file itself says so.
    pub(crate) cavities: &'a [[[f32; 3]; 3]],
}

/// What the repairs made of the surface. `reach`: the distance up to which surface is where it was. O(edit × log), and reads the chunks around
/// points that are far from what is in the submesh.
pub(crate) fn measure(
    survey: &Survey<'_>,
    submesh: &Submesh,
    (reversed, dropped_by): (&Reversed, &DroppedBy),
    pieces: &Components,
    known: &Known<'_>,
    reach: f64,
) -> Skin {
    let Patches { plausible, holes } = patches::judged(survey, submesh, pieces, known.explained, reach);
    let mut of_cavities: Vec<_> = known.cavities.iter().map(surfaces::by_corners).collect();
    of_cavities.sort_unstable();
    let surfaces = Surfaces { survey, submesh, reversed, dropped_by, wrapped: known.wrapped, holes, of_cavities };
    let whole = survey.measure.area_of(surfaces.area_before());
    let gone = Samples::gone(&surfaces, reach);
    let mut lost = change(&surfaces, [Which::Closed, Which::After], (&gone, known.cavities), reach, whole);
    let added = Samples::added(&surfaces, &plausible, reach);
    let mut invented = change(&surfaces, [Which::After, Which::Before], (&added, &[]), reach, whole);
    if lost.share.max(invented.share) >= WORTHWHILE {
        let visible = share_that_is_seen(&surfaces, whole, reach);
        for change in [&mut lost, &mut invented] {
            change.share = (change.share / visible).min(1.0);
        }
    }
    Skin { reach, lost, invented }
}

/// The share of all that was there that could be seen; some of it always.
fn share_that_is_seen(surfaces: &Surfaces<'_>, whole: f64, reach: f64) -> f64 {
    let all = Samples::all(surfaces, whole / PROBED);
    let points: Vec<OnSurface> = all.points.iter().map(|at| OnSurface { at: *at, front: None }).collect();
    let seen = seen::from_outside(surfaces, Which::Closed, &points, reach).into_iter().filter(|seen| *seen).count();
    (seen.max(1) as f64 / points.len().max(1) as f64).min(1.0)
}

/// What of the samples, which lie on `of`, can be seen there, is in no cavity, and is far from `other`.
fn change(
    surfaces: &Surfaces<'_>,
    [of, other]: [Which; 2],
    (samples, cavities): (&Samples, &[[[f32; 3]; 3]]),
    reach: f64,
    whole: f64,
) -> SkinChange {
    let far = near::beyond(surfaces, other, &samples.points, reach);
    let points: Vec<[f64; 3]> = far.iter().map(|s| samples.points[*s as usize]).collect();
    let windings = bodies::windings_of(cavities, &points);
    let far: Vec<u32> = far.into_iter().zip(windings).filter(|(_, winding)| *winding >= 0).map(|(s, _)| s).collect();
    // Of many, a part stands for all: each for as many.
    let every = far.len().div_ceil(ASKED).max(1);
    let asked: Vec<u32> = far.into_iter().step_by(every).collect();
    let at = |s: &u32| samples.points[*s as usize];
    let on_surface = |s: &u32| OnSurface { at: at(s), front: samples.fronts[*s as usize] };
    let can_be_seen = seen::from_outside(surfaces, of, &asked.iter().map(on_surface).collect::<Vec<_>>(), reach);
    let visible: Vec<u32> = asked.into_iter().zip(can_be_seen).filter(|(_, seen)| *seen).map(|(s, _)| s).collect();
    if visible.is_empty() {
        return SkinChange::default();
    }
    let each = samples.area_of_each * every as f64;
    let area = visible.len() as f64 * each;
    let some: Vec<u32> = visible.iter().copied().step_by(visible.len().div_ceil(MEASURED)).collect();
    let distances = near::distances(surfaces, other, &some.iter().map(at).collect::<Vec<_>>(), reach);
    let measured: Vec<(u32, f64)> = some.into_iter().zip(distances).collect();
    SkinChange {
        area,
        share: if whole > 0.0 { (area / whole).min(1.0) } else { 1.0 },
        farthest: measured.iter().map(|(_, d)| *d).fold(0.0, f64::max),
        causes: causes(samples, &visible, each),
        places: places(surfaces, samples, &visible, &measured, each),
    }
}

/// The area by the repair that did it, the largest first.
fn causes(samples: &Samples, visible: &[u32], each: f64) -> Vec<SkinCause> {
    let mut names: Vec<RepairName> = visible.iter().filter_map(|s| samples.causes[*s as usize]).collect();
    names.sort_unstable();
    let count = |same: &[RepairName]| SkinCause { repair: same[0], area: same.len() as f64 * each };
    let mut causes: Vec<SkinCause> = names.chunk_by(|a, b| a == b).map(count).collect();
    causes.sort_by(|a, b| b.area.total_cmp(&a.area).then(a.repair.cmp(&b.repair)));
    causes
}

/// Where it is, the largest area first.
fn places(surfaces: &Surfaces<'_>, samples: &Samples, visible: &[u32], measured: &[(u32, f64)], each: f64) -> Vec<SkinPlace> {
    let side = surfaces.survey.bounds.diagonal() * PLACE;
    let cell = |s: u32| samples.points[s as usize].map(|x| (x / side).floor() as i64);
    let mut in_cells: Vec<([i64; 3], u32)> = visible.iter().map(|s| (cell(*s), *s)).collect();
    in_cells.sort_unstable();
    let place = |same: &[([i64; 3], u32)]| {
        let points = same.iter().map(|(_, s)| samples.points[*s as usize]);
        let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in points {
            for k in 0..3 {
                lo[k] = lo[k].min(p[k]);
                hi[k] = hi[k].max(p[k]);
            }
        }
        let here = measured.iter().filter(|(s, _)| cell(*s) == same[0].0).map(|(_, d)| *d);
        let bounds = [lo, hi].map(|p| p.map(|x| x as f32));
        SkinPlace { bounds, area: same.len() as f64 * each, farthest: here.fold(0.0, f64::max) }
    };
    let mut places: Vec<SkinPlace> = in_cells.chunk_by(|a, b| a.0 == b.0).map(place).collect();
    places.sort_by(|a, b| b.area.total_cmp(&a.area));
    places.truncate(PLACES);
    places
}

#[cfg(test)]
mod tests;
