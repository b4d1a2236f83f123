//! A patch that continues the surface around it: new vertices as dense as there, positions such that tangent planes and curvature go
//! on across the rim.
//!
//! `fill` closes a hole with triangles between its rim's vertices. Here such a patch, be it a disc, an annulus between two rims or any
//! other piece, is refined (`refine`), made smooth (`fair`, or `rbf`) on both
//! sides of a crease that goes through (`crease`), rounded to f32 and tested exactly (`check`). Nothing is known of
//! where it comes from. Floating point ranks and places; whether the result is valid is decided with exact predicates. Every bound of
//! work is a count, all arithmetic is + − × ÷ √ in a fixed order: the same bits everywhere.

mod check;
mod coarse;
mod coons;
mod crease;
mod fair;
mod rbf;
mod refine;
mod sheet;
mod sparse;
#[cfg(test)]
mod tests;

use glam::DVec3;

use crate::geometry::exact::{Point, at};
use crate::geometry::position::Position;
pub(crate) use coarse::{CoarsePatch, Shaped, Unshaped};
use fair::{Energy, solve};
use refine::refine;
use sheet::Sheet;
pub(crate) use sheet::{edges, sorted};

/// How the new vertices are placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Method {
    /// Least change of curvature.
    Fair,
    /// On the surface that blends the sides of the rim between its corners; of a rim with less than two, as [`Method::Fair`].
    Coons,
    /// On an implicit surface through the surroundings, which has no creases: where one goes through the patch, as [`Method::Fair`].
    Implicit,
}

/// Bounds of the methods. They decide results.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ShapeSettings {
    pub(crate) method: Method,
    /// Edges are to be so many times shorter than those around.
    pub(crate) finer: f64,
    /// New vertices, at most; a patch that would need more gets longer edges. 5,000 take about a second.
    pub(crate) max_vertices: usize,
}

impl Default for ShapeSettings {
    fn default() -> Self {
        Self { method: Method::Fair, finer: 1.0, max_vertices: 5_000 }
    }
}

/// Passes of the smoothing, each on the surface of the one before.
const PASSES: usize = 4;
/// It has settled when vertices move less than this share of the rim's radius, root mean square.
const SETTLED: f64 = 4e-3;

/// Is the rim an edge of the surface for certain, so that [`shape()`] fails with [`Unshaped::RimIsEdge`] at the latest? `turn`: the cosines between the
/// normals on both sides of the rim's edges of two triangles, times the edges' lengths; `length`: that of these edges.
pub(crate) fn is_edge(turn: f64, length: f64) -> bool {
    // Other units, another rounding.
    turn < (crease::TURN - 1e-6) * length
}

/// Refines a coarse patch and makes it continue the surface around. O(n^1.5) for n vertices and triangles altogether.
///
/// # Errors
/// [`Unshaped`]: the coarse patch is to be used.
pub(crate) fn shape(coarse: &CoarsePatch<'_>, settings: &ShapeSettings) -> Result<Shaped, Unshaped> {
    if is_fine(coarse, settings.finer) {
        return Err(Unshaped::NothingToAdd);
    }
    let mut sheet = sheet_of(coarse, settings.finer).ok_or(Unshaped::NotASurface)?;
    if settings.method == Method::Coons
        && let Ok(shaped) = blended(coarse, settings)
    {
        return Ok(shaped);
    }
    if refine::is_fine(&sheet) {
        return Err(Unshaped::NothingToAdd);
    }
    let crease::Creases { mut sharp, through } = crease::find(&sheet)?;
    if !tells_curvature(&sheet, coarse, &sharp) {
        return Err(Unshaped::Uncurved);
    }
    let divided;
    if !through.is_empty() {
        divided = crease::with_edges(coarse, &sheet, &through).ok_or(Unshaped::Creased)?;
        sheet = sheet_of(&CoarsePatch { patch: &divided, ..*coarse }, settings.finer).ok_or(Unshaped::NotASurface)?;
    }
    let most = most_vertices(&mut sheet, settings);
    if !through.iter().all(|ends| crease::carry_on(&mut sheet, *ends)) {
        return Err(Unshaped::Creased);
    }
    sharp.resize(sheet.held, true);
    if refine(&mut sheet, most) == 0 {
        return Err(Unshaped::NothingToAdd);
    }
    if settings.method == Method::Implicit && through.is_empty() {
        implicit(&mut sheet)?;
        return finish(&sheet, coarse);
    }
    let unfaired = sheet.points.clone();
    for energy in [Energy::Curvature, Energy::Plate] {
        sheet.points.clone_from(&unfaired);
        match fair(&mut sheet, &sharp, energy) {
            Ok(()) => match finish(&sheet, coarse) {
                Err(Unshaped::Crosses) if energy == Energy::Curvature => {}
                done => return done,
            },
            Err(Unshaped::TooFar) if energy == Energy::Curvature => {}
            Err(error) => return Err(error),
        }
    }
    Err(Unshaped::Crosses)
}

/// The patch between feature curves, whatever the surface around does.
fn blended(coarse: &CoarsePatch<'_>, settings: &ShapeSettings) -> Result<Shaped, Unshaped> {
    let mut sheet = sheet_of(coarse, settings.finer).ok_or(Unshaped::NotASurface)?;
    let most = most_vertices(&mut sheet, settings);
    if refine(&mut sheet, most) == 0 {
        return Err(Unshaped::NothingToAdd);
    }
    coons::place(&mut sheet)?;
    finish(&sheet, coarse)
}

/// How many vertices may be new; longer edges are wanted where it would be more.
fn most_vertices(sheet: &mut Sheet<'_>, settings: &ShapeSettings) -> usize {
    let rim = sheet.on_rim.iter().filter(|on| **on).count() as f64;
    let most = settings.max_vertices.min((50.0 * rim * rim.sqrt()) as usize);
    let needed = vertices_needed(sheet);
    if needed > most as f64 {
        let coarser = (needed / most as f64).sqrt();
        for scale in &mut sheet.scale {
            *scale *= coarser;
        }
    }
    most
}

fn sheet_of<'a>(coarse: &CoarsePatch<'a>, finer: f64) -> Option<Sheet<'a>> {
    let mut sheet = Sheet::new(coarse)?;
    sheet.scale.iter_mut().for_each(|scale| *scale /= finer);
    Some(sheet)
}

/// Are at least half of the vertices next to the rim on smooth surface?
fn tells_curvature(sheet: &Sheet<'_>, coarse: &CoarsePatch<'_>, sharp: &[bool]) -> bool {
    let is_on_rim = |v: &u32| sheet.on_rim[*v as usize];
    let beside = coarse.around.iter().filter(|t| t.iter().any(is_on_rim)).flatten().filter(|v| !is_on_rim(v));
    let mut next: Vec<u32> = beside.copied().collect();
    next.sort_unstable();
    next.dedup();
    2 * next.iter().filter(|v| !sharp[**v as usize]).count() >= next.len()
}

/// Cheap: is no triangle large enough to be divided, whatever the scale?
fn is_fine(coarse: &CoarsePatch<'_>, finer: f64) -> bool {
    let corners = |t: &[u32; 3]| t.map(|v| at(&coarse.positions[v as usize]));
    let least = coarse
        .around
        .iter()
        .map(corners)
        .map(|[a, b, c]| a.distance_squared(b).min(b.distance_squared(c)).min(c.distance_squared(a)))
        .fold(f64::INFINITY, f64::min);
    coarse.patch.iter().map(corners).all(|t| {
        let centre = (t[0] + t[1] + t[2]) / 3.0;
        t.iter().any(|p| refine::DENSITY * refine::DENSITY * finer * finer * p.distance_squared(centre) <= least)
    })
}

/// About how many vertices the scales ask for.
fn vertices_needed(sheet: &Sheet<'_>) -> f64 {
    let each = |t: &[u32; 3]| {
        let scale = t.iter().map(|&v| sheet.scale[v as usize]).sum::<f64>() / 3.0;
        // Two triangles a vertex, of √3/4 of the square of the scale each.
        sheet.normal(*t).length() / (3.0_f64.sqrt() * scale * scale)
    };
    sheet.triangles.iter().map(each).sum()
}

/// Places the new vertices.
fn fair(sheet: &mut Sheet<'_>, sharp: &[bool], energy: Energy) -> Result<(), Unshaped> {
    let mut sharp = sharp.to_vec();
    sharp.resize(sheet.points.len(), false);
    solve(sheet, &sharp, Energy::Membrane).ok_or(Unshaped::Unsolved)?;
    sheet.relax();
    for _ in 0..PASSES {
        let moved = solve(sheet, &sharp, energy).ok_or(Unshaped::Unsolved)?;
        if !within(sheet) {
            return Err(Unshaped::TooFar);
        }
        if moved < SETTLED {
            break;
        }
        sheet.relax();
    }
    Ok(())
}

/// Likewise, onto an implicit surface.
fn implicit(sheet: &mut Sheet<'_>) -> Result<(), Unshaped> {
    let smooth = vec![false; sheet.points.len()];
    solve(sheet, &smooth, Energy::Membrane).ok_or(Unshaped::Unsolved)?;
    sheet.relax();
    rbf::project(sheet).ok_or(Unshaped::Unsolved)?;
    sheet.relax();
    if within(sheet) { Ok(()) } else { Err(Unshaped::TooFar) }
}

/// Is everything within the rim's box grown by a quarter of its diagonal?
fn within(sheet: &Sheet<'_>) -> bool {
    let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for (p, _) in sheet.points.iter().zip(&sheet.on_rim).filter(|(_, on)| **on) {
        (lo, hi) = (lo.min(*p), hi.max(*p));
    }
    let room = DVec3::splat(0.25 * (hi - lo).length());
    sheet.points[sheet.fixed..].iter().all(|p| p.cmpge(lo - room).all() && p.cmple(hi + room).all())
}

fn finish(sheet: &Sheet<'_>, coarse: &CoarsePatch<'_>) -> Result<Shaped, Unshaped> {
    let round = |p: &DVec3| Position::nearest(*p * sheet.unit + sheet.centre).coordinates();
    let added: Vec<Point> = sheet.points[sheet.fixed..].iter().map(round).collect();
    let shaped = Shaped { added, triangles: sheet.triangles.clone() };
    if check::is_valid(coarse, &shaped) { Ok(shaped) } else { Err(Unshaped::Crosses) }
}
