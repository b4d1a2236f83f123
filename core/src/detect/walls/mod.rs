//! Walls that are thinner than a given minimum: a hint, which changes no verdict.
//!
//! **In:** the records of a surface that is closed and faces outward, its size, a minimum.
//! **Out:** [`ThinWalls`]: the share of the surface, and the thinnest places.
//!
//! At points spread over the surface by area, the largest sphere in the material that touches it there ([`sphere`]) is looked for among all that is near
//! ([`near`], by [`cells`]). Points and answers depend on the records alone, so that neither threads nor memory change them.

mod cells;
mod near;
mod sphere;

use crate::contract::report::{ThinPlace, ThinWalls};
use crate::geometry::distance::place;
use crate::geometry::sums::Bounds;
pub(crate) use near::Surface;

/// About so many points are looked at; with fewer, a small place on a large part would often be missed.
const POINTS: f64 = 4096.0;
/// No more than one on a square of this share of the minimum ...
const SPACING: f64 = 0.25;
/// ... but for so many.
const FEWEST: f64 = 1024.0;
/// A wall is as thin as it is drawn, but for what single precision and the tessellation of curves make of it.
const TOLERANCE: f64 = 1e-3;
/// Memory for points and what is near them.
const BYTES: u64 = 8 << 20;
/// Shares of the diagonal below which single precision tells nothing.
const SMALLEST: f64 = 1e-7;
/// Places that are listed.
const PLACES: usize = 8;
/// No two of them are in one cell of this share of the diagonal.
const PLACE: f64 = 0.05;

/// Looks for walls thinner than `minimum` in a surface of this `area` in this box.
///
/// # Errors
/// In words, why that was not possible.
pub(crate) fn measure(surface: &Surface<'_>, (bounds, area): (&Bounds, f64), minimum: f64) -> Result<ThinWalls, String> {
    let diagonal = bounds.diagonal();
    if surface.limits.memory_bytes < BYTES {
        return Err(format!("that takes {} MiB of memory", BYTES >> 20));
    }
    if !(minimum >= diagonal * SMALLEST && area > 0.0 && area.is_finite()) {
        return Err("its coordinates are too large or too small for that".into());
    }
    // No sphere in it is larger.
    let most = minimum.min(2.0 * diagonal);
    let each = (area / POINTS).max((most * SPACING).powi(2)).min(area / FEWEST);
    let samples = surface.samples(each);
    let around = surface.around(&samples, most, diagonal).ok_or_else(|| {
        format!("too much lies within {minimum} mm of each place: a smaller `thin_wall_mm`, or fewer triangles, would do")
    })?;
    let thin = samples.iter().zip(around).filter_map(|(sample, around)| {
        let thickness = around.thickness().filter(|thickness| *thickness < minimum * (1.0 - TOLERANCE))?;
        Some(ThinPlace { at: sample.at.to_array().map(|x| x as f32), thickness })
    });
    let thin: Vec<ThinPlace> = thin.collect();
    let share = thin.len() as f64 / samples.len().max(1) as f64;
    Ok(ThinWalls { minimum, points: samples.len() as u64, share, places: thinnest(thin, diagonal * PLACE) })
}

/// The thinnest of each cell, the thinnest of all first.
fn thinnest(mut all: Vec<ThinPlace>, cell: f64) -> Vec<ThinPlace> {
    let cell_of = |thin: &ThinPlace| (place(thin.at) / cell).floor().to_array().map(|x| x as i64);
    all.sort_by(|a, b| cell_of(a).cmp(&cell_of(b)).then(a.thickness.total_cmp(&b.thickness)));
    all.dedup_by_key(|thin| cell_of(thin));
    all.sort_by(|a, b| a.thickness.total_cmp(&b.thickness));
    all.truncate(PLACES);
    all
}

#[cfg(test)]
mod tests;
