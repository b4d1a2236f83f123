//! Periodic waves of a patch without a tool path, by the spectrum of its height.
//!
//! The patch's form is taken away as a parabolic surface. What is left is compared with waves of all directions and periods; scallops
//! are waves along the direction across the passes, which is a principal direction of the patch. This is a hint for a person: a knurl or a
//! thread gives the same spectrum.

use super::found::Mesh;
use super::options::Error;
use crate::curves::vector::{Point, add, cross, dot, plain_norm, plain_unit, scale, sub};
use rayon::prelude::*;

/// Vertices that are compared, at most: they are taken evenly out of all.
const SAMPLES: usize = 4096;
/// Directions in half a turn.
const DIRECTIONS: u32 = 60;
/// Periods between the shortest and the longest, in equal steps of wave number.
const PERIODS: u32 = 240;
/// Waves over the patch, at least: fewer are its form.
const WAVES: f64 = 4.0;

/// A wave that a patch may have. Someone has to look at it before it is taken for residue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hint {
    /// Direction across the crests, of length 1.
    pub across: [f64; 3],
    /// Distance of the crests, in millimetres.
    pub pitch: f64,
    /// From the lowest to the highest vertex but for 2 % on both sides, the patch's form taken away, in millimetres.
    pub height: f64,
    /// The part of the variance that a sine of this pitch explains, between 0 and 1; most of it for scallops, little of it without a wave.
    pub share: f64,
}

/// Looks for a wave in a patch of triangles; `None` if the patch is too small. O(directions · periods · samples).
///
/// # Errors
/// [`Error::Vertex`] if a triangle is not there, or a vertex of it.
pub fn hint(mesh: Mesh<'_>, patch: &[u32]) -> Result<Option<Hint>, Error> {
    let mut vertices: Vec<u32> = Vec::with_capacity(patch.len() * 3);
    let (mut normal, mut edges) = ([0.0; 3], 0.0);
    for number in patch {
        let face = mesh.faces.get(*number as usize).ok_or(Error::Vertex(*number as usize))?;
        if face.iter().any(|vertex| !mesh.points.get(*vertex as usize).is_some_and(|point| point.iter().all(|x| x.is_finite()))) {
            return Err(Error::Vertex(*number as usize));
        }
        let [a, b, c] = mesh.corners(face);
        normal = add(normal, cross(sub(b, a), sub(c, a)));
        edges += plain_norm(sub(b, a)) / patch.len() as f64;
        vertices.extend(face);
    }
    vertices.sort_unstable();
    vertices.dedup();
    let Some(normal) = plain_unit(normal) else { return Ok(None) };
    let stride = vertices.len().div_ceil(SAMPLES).max(1);
    let places: Vec<Point> = vertices
        .iter()
        .step_by(stride)
        .filter_map(|vertex| mesh.points.get(*vertex as usize))
        .map(|point| point.map(f64::from))
        .collect();
    let side = if normal[0].abs() < 0.7 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let Some(first) = plain_unit(sub(side, scale(normal, dot(side, normal)))) else { return Ok(None) };
    Ok(search(&places, [first, cross(normal, first), normal], edges))
}

fn search(places: &[Point], [first, second, normal]: [Point; 3], edge: f64) -> Option<Hint> {
    let middle = scale(places.iter().copied().fold([0.0; 3], add), 1.0 / places.len().max(1) as f64);
    let flat = |place: &Point| [first, second, normal].map(|axis| dot(sub(*place, middle), axis));
    let mut list: Vec<Point> = places.iter().map(flat).collect();
    let size = list.iter().map(|[x, y, _]| x.hypot(*y)).fold(0.0, f64::max);
    let (longest, shortest) = (2.0 * size / WAVES, 2.5 * edge);
    if list.len() < 64 || !(shortest > 0.0 && longest > shortest) {
        return None;
    }
    flatten(&mut list, size)?;
    let total: f64 = list.iter().map(|[_, _, z]| z * z).sum();
    if total <= 0.0 {
        return None;
    }
    let share = |angle: f64, wave: f64| {
        let (sin, cos) = angle.sin_cos();
        let add = |(a, b): (f64, f64), [x, y, z]: &Point| {
            let (s, c) = (wave * (x * cos + y * sin)).sin_cos();
            (a + z * s, b + z * c)
        };
        let (a, b) = list.iter().fold((0.0, 0.0), add);
        2.0 * (a * a + b * b) / (list.len() as f64 * total)
    };
    let (low, high) = (std::f64::consts::TAU / longest, std::f64::consts::TAU / shortest);
    let (turn, step) = (std::f64::consts::PI / f64::from(DIRECTIONS), (high - low) / f64::from(PERIODS));
    let best = |angles: &[f64], waves: &[f64]| {
        let of = |angle: &f64| waves.iter().map(|wave| (share(*angle, *wave), *angle, *wave)).max_by(|a, b| a.0.total_cmp(&b.0));
        let each: Vec<Option<(f64, f64, f64)>> = angles.par_iter().map(of).collect();
        each.into_iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0))
    };
    let angles: Vec<f64> = (0..DIRECTIONS).map(|n| f64::from(n) * turn).collect();
    let waves: Vec<f64> = (0..=PERIODS).map(|n| low + f64::from(n) * step).collect();
    let (_, angle, wave) = best(&angles, &waves)?;
    let near = |value: f64, width: f64| (-10..=10).map(|n| value + f64::from(n) * 0.1 * width).collect::<Vec<_>>();
    let (share, angle, wave) = best(&near(angle, turn), &near(wave, step))?;
    let mut heights: Vec<f64> = list.iter().map(|[_, _, z]| *z).collect();
    heights.sort_unstable_by(f64::total_cmp);
    let at = |part: f64| heights.get((heights.len() as f64 * part) as usize).copied().unwrap_or(0.0);
    let across = add(scale(first, angle.cos()), scale(second, angle.sin()));
    Some(Hint { across, pitch: std::f64::consts::TAU / wave, height: at(0.98) - at(0.02), share })
}

/// Takes the least-squares parabolic surface away from heights; `None` if the places do not determine one.
fn flatten(list: &mut [Point], size: f64) -> Option<()> {
    let terms = |[x, y, _]: &Point| {
        let (x, y) = (x / size, y / size);
        [1.0, x, y, x * x, x * y, y * y]
    };
    let mut rows = [[0.0; 7]; 6];
    for place in list.iter() {
        let terms = terms(place);
        for (row, a) in rows.iter_mut().zip(terms) {
            row.iter_mut().zip(terms.into_iter().chain([place[2]])).for_each(|(sum, b)| *sum += a * b);
        }
    }
    // Gauss and Jordan; the matrix is positive, so that its pivots need no search.
    for pivot in 0..6 {
        let row = rows[pivot];
        if row[pivot].abs() <= 1e-12 * list.len() as f64 {
            return None;
        }
        for (_, other) in rows.iter_mut().enumerate().filter(|(number, _)| *number != pivot) {
            let factor = other[pivot] / row[pivot];
            other.iter_mut().zip(row).for_each(|(x, y)| *x -= factor * y);
        }
    }
    let mut shape = [0.0; 6];
    shape.iter_mut().zip(rows).enumerate().for_each(|(n, (shape, row))| *shape = row[6] / row[n]);
    for place in list {
        place[2] -= terms(place).into_iter().zip(shape).map(|(a, b)| a * b).sum::<f64>();
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bent sheet with scallops of a ball of radius 3, their crests a given distance apart, across a given direction.
    fn sheet(pitch: f64, angle: f64, scallops: f64) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let count = 80;
        let place = |i: i32, j: i32| {
            let (x, y) = (f64::from(i) * 0.15, f64::from(j) * 0.15);
            let along = x * angle.cos() + y * angle.sin();
            let off = along - (along / pitch).round() * pitch;
            [x, y, 0.01 * x * x - 0.02 * y * x + scallops * (3.0 - (9.0 - off * off).sqrt())].map(|x| x as f32)
        };
        let points = (0..=count).flat_map(|j| (0..=count).map(move |i| place(i, j))).collect();
        let at = |i: i32, j: i32| (j * (count + 1) + i) as u32;
        let cells = (0..count).flat_map(|j| (0..count).map(move |i| (i, j)));
        (
            points,
            cells
                .flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]])
                .collect(),
        )
    }

    /// Pitch, direction and height are those that were put in; a sheet without scallops shows no wave.
    #[test]
    fn scallops_show_in_the_spectrum() {
        for (pitch, angle) in [(1.0, 0.0), (1.4, 0.5), (0.9, 2.0)] {
            let (points, faces) = sheet(pitch, angle, 1.0);
            let patch: Vec<u32> = (0..faces.len() as u32).collect();
            let hint = hint(Mesh { points: &points, faces: &faces }, &patch).expect("a mesh").expect("a hint");
            let height = 3.0 - (9.0 - pitch * pitch / 4.0).sqrt();
            assert!((hint.pitch - pitch).abs() < 0.03 * pitch, "{hint:?}");
            // The sheet leans, and its patch's plane with it.
            let level = hint.across[0].hypot(hint.across[1]);
            assert!((hint.across[0] * angle.cos() + hint.across[1] * angle.sin()).abs() > 0.998 * level, "{hint:?}");
            assert!((0.8..1.1).contains(&(hint.height / height)) && hint.share > 0.8, "{hint:?}");
        }
        let (points, faces) = sheet(1.0, 0.0, 0.0);
        let patch: Vec<u32> = (0..faces.len() as u32).collect();
        let hint = hint(Mesh { points: &points, faces: &faces }, &patch).expect("a mesh").expect("a hint");
        assert!(hint.share < 0.2, "{hint:?}");
    }
}
