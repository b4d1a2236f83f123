//! A picture of curves, and of the surfaces that fill them.

use std::path::Path;

use suture_core::curves::Network;
use suture_core::curves::curve::Shape;
use suture_core::curves::fill::FilledNetwork;
use suture_core::record::{self, Point, Record};

use crate::cli::meshes::FillCurvesArgs;
use crate::create;
use crate::picture::strokes::{Mark, Stroke};
use crate::picture::{Options, draw_curves};

/// Pixels of each of its two halves.
const SIZE: (usize, usize) = (800, 600);
/// Chords of a curve that is not straight, and of all curves together.
const CHORDS: usize = 96;
const MOST_CHORDS: usize = 400_000;

/// Draws them to a new file: the curves at the left, the surfaces at the right. Outlines of `left` have none.
///
/// # Errors
/// A line for people.
pub(super) fn write(
    path: &Path,
    (network, filled, left): (&Network, &FilledNetwork, &[usize]),
    args: &FillCurvesArgs,
) -> Result<(), String> {
    let shown = path.display();
    let limits = args.spend.limits(false);
    let strokes = strokes(network, filled, left);
    let mesh = records(filled);
    let options = Options { size: SIZE, eye: None, behind: false, threads: limits.threads, memory: limits.memory_bytes };
    let picture = draw_curves(&strokes, &mesh, &options).ok_or_else(|| format!("{shown}: nothing of it can be drawn"))?;
    let bytes = picture.png().map_err(|error| format!("{shown}: {error}"))?;
    create::place(path, &bytes, args.force).map_err(|error| format!("{shown}: cannot be written: {error}"))
}

/// Curves as chains of points; the aids of a file's drawing are no curves of surfaces.
fn strokes(network: &Network, filled: &FilledNetwork, left: &[usize]) -> Vec<Stroke> {
    let shapes = filled.shapes(network);
    let mut bounds = vec![false; shapes.len()];
    let outlines = filled.outlines.iter().enumerate().filter(|(number, _)| left.binary_search(number).is_err());
    for used in outlines.flat_map(|(_, outline)| outline.rings()).flatten() {
        bounds.iter_mut().skip(used.curve).take(1).for_each(|is_bound| *is_bound = true);
    }
    let is_left_out = |number: usize| filled.loops.as_ref().is_some_and(|loops| loops.left_out.binary_search(&number).is_ok());
    let chords = (MOST_CHORDS / shapes.len().max(1)).clamp(1, CHORDS);
    let marked = shapes.into_iter().zip(bounds).enumerate().filter(|(number, _)| !is_left_out(*number));
    let mut strokes: Vec<Stroke> = marked
        .map(|(number, (shape, is_bound))| {
            let mark = match (is_bound, number < network.curves.len()) {
                (false, _) => Mark::Left,
                (true, true) => Mark::Bounds,
                (true, false) => Mark::Added,
            };
            Stroke { points: points(shape, chords), mark }
        })
        .collect();
    // A curve that stands for another one is drawn over it.
    strokes.sort_by_key(|stroke| stroke.mark != Mark::Left);
    strokes
}

fn points(shape: &Shape, chords: usize) -> Vec<Point> {
    if let Shape::Polyline(points) = shape {
        return points.iter().map(|point| point.map(|x| x as f32)).collect();
    }
    let [low, high] = shape.domain();
    let chords = if matches!(shape, Shape::Line(_)) { 1 } else { chords };
    (0..=chords).map(|k| shape.point(low + (high - low) * k as f64 / chords as f64).map(|x| x as f32)).collect()
}

fn records(filled: &FilledNetwork) -> Vec<Record> {
    let mesh = &filled.filled.mesh;
    let point = |number: u32| mesh.points.get(number as usize).copied().unwrap_or_default().map(|x| x as f32);
    mesh.triangles.iter().map(|triangle| record::encode(triangle.map(point), 0)).collect()
}
