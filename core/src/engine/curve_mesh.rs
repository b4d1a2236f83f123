//! Filled outlines of curves as a mesh, in millimetres, and as a file of one.

use std::path::Path;

use crate::algorithms::triangulate::{FillSettings, Rim, triangulate};
use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::report::{Format, Report};
use crate::contract::settings::{Limits, OutputFormat, Profile};
use crate::curves::fill::{Filled, Surface};
use crate::engine::clock::Clock;
use crate::engine::formats::{self, Whole};
use crate::engine::work::Work;
use crate::engine::{copying, entry, nameless_stl};
use crate::geometry::position::{self, Position};
use crate::io::read::HEADER_BYTES;
use crate::io::record::{self, Record};

/// A file of the mesh of filled outlines.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct CurveMesh {
    /// What the written mesh is: an inspection of the file.
    pub report: Report,
    /// Numbers of the outlines that no surface fits, and that were closed as holes of meshes are.
    pub closed_as_holes: Vec<usize>,
    /// Numbers of the outlines that stay open.
    pub open: Vec<usize>,
    /// Triangles that single precision made flat, and that are left out.
    pub too_small: u64,
}

/// Writes the mesh of filled outlines to the new file `output`, in `format` and in millimetres, of which the curves have so many in their unit; reads it back and
/// judges it. Outlines without a surface are closed as holes of meshes are, where that is possible.
///
/// # Errors
/// [`Error`]; [`Error::Refused`] if there is no triangle.
pub(crate) fn write(
    (name, filled, millimetres): (&Path, &Filled, f64),
    (output, format): (&Path, OutputFormat),
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<CurveMesh> {
    let limits = &limits.spooling_beside(output);
    let points: Vec<[f32; 3]> =
        filled.mesh.points.iter().map(|point| Position::of(point.map(|x| (x * millimetres) as f32)).coordinates()).collect();
    let corners = |numbers: &[u32; 3]| numbers.map(|number| points.get(number as usize).copied().unwrap_or_default());
    let mut triangles: Vec<[[f32; 3]; 3]> = filled.mesh.triangles.iter().map(corners).collect();
    let (mut closed_as_holes, mut open) = (Vec::new(), Vec::new());
    for (number, (surface, report)) in filled.surfaces.iter().zip(&filled.reports).enumerate() {
        let Surface::Fallback(rings) = surface else { continue };
        match closed(rings, &points, report.is_flipped) {
            Some(patch) => {
                triangles.extend(patch);
                closed_as_holes.push(number);
            }
            None => open.push(number),
        }
    }
    let all = triangles.len();
    triangles.retain(|[a, b, c]| {
        let [a, b, c] = [a, b, c].map(|point| position::bits(*point));
        a != b && b != c && c != a
    });
    let too_small = (all - triangles.len()) as u64;
    if triangles.is_empty() {
        return Err(Error::Refused {
            path: name.into(),
            reason: format!("no outline of its curves could be filled; {}", first_problem(filled)),
            advice: "`suture curves` lists them".into(),
        });
    }
    let records: Vec<Record> = triangles.iter().map(|corners| record::encode(*corners, 0)).collect();
    drop(triangles);
    let profile = Profile::default();
    let work = Work { profile: &profile, limits, progress };
    let (made, spool) = nameless_stl::open(name, &[b' '; HEADER_BYTES], &records, || (), work)?;
    match formats::target(Format::Memory, Some("millimeter"), format).layout {
        None => copying::copy(&spool.path(), output, limits, progress)?,
        Some(layout) => {
            let whole = Whole { made: &made, title: "", parts: &[], input: name };
            formats::encode(&whole, output, layout, work, &mut Clock::start())?
        }
    };
    let report = entry::inspect(output, &profile, limits, progress)?;
    Ok(CurveMesh { report, closed_as_holes, open, too_small })
}

/// Why the first outline has no surface.
fn first_problem(filled: &Filled) -> String {
    let number = filled.reports.iter().position(|report| report.problem.is_some()).unwrap_or_default();
    let problem = filled.reports.get(number).and_then(|report| report.problem.as_ref());
    let why = problem.map_or_else(|| "its triangles vanish in single precision".into(), ToString::to_string);
    format!("outline {number}: {why}")
}

/// Triangles that close a ring of points as a hole of a mesh, turned as the ring runs, or the other way.
fn closed(rings: &[Vec<u32>], points: &[[f32; 3]], is_flipped: bool) -> Option<Vec<[[f32; 3]; 3]>> {
    let [ring] = rings else { return None };
    let mut around: Vec<[f32; 3]> = ring.iter().filter_map(|number| points.get(*number as usize)).copied().collect();
    around.dedup();
    if is_flipped {
        around.reverse();
    }
    let rim = Rim { points: &around, apexes: &[], obstacles: &[], forbidden: &|_, _| false };
    let patch = triangulate(&rim, &FillSettings::default()).ok()?;
    Some(patch.triangles.iter().map(|triangle| rim.corners(*triangle)).collect())
}
