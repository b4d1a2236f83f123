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
const PERIODS: usize = 240;
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
    let Some(axes) = axes(normal) else { return Ok(None) };
    let middle = scale(places.iter().copied().fold([0.0; 3], add), 1.0 / places.len().max(1) as f64);
    let flat = |place: &Point| axes.map(|axis| dot(sub(*place, middle), axis));
    let mut list: Vec<Point> = places.iter().map(flat).collect();
    let size = size(&list);
    if flatten(&mut list, size).is_none() {
        return Ok(None);
    }
    Ok(search(&list, axes, [2.5 * edges, 2.0 * size / WAVES]))
}

/// Two directions along a plane of this unit normal, and the normal.
pub(super) fn axes(normal: Point) -> Option<[Point; 3]> {
    let side = if normal[0].abs() < 0.7 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let first = plain_unit(sub(side, scale(normal, dot(side, normal))))?;
    Some([first, cross(normal, first), normal])
}

/// How far places are from the middle at most, along the plane.
pub(super) fn size(list: &[Point]) -> f64 {
    list.iter().map(|[x, y, _]| x.hypot(*y)).fold(0.0, f64::max)
}

/// The strongest wave of this range of lengths among heights over a plane.
pub(super) fn search(list: &[Point], [first, second, _]: [Point; 3], [shortest, longest]: [f64; 2]) -> Option<Hint> {
    let total: f64 = list.iter().map(|[_, _, z]| z * z).sum();
    if list.len() < 64 || !(shortest > 0.0 && longest > shortest && total > 0.0) {
        return None;
    }
    let best = |angles: &[f64], low: f64, step: f64, count: usize| {
        let of = |angle: &f64| {
            let shares = shares(list, *angle, (low, step, count));
            let waves = shares.into_iter().enumerate().map(|(n, power)| (power / total, *angle, low + n as f64 * step));
            waves.max_by(|a, b| a.0.total_cmp(&b.0))
        };
        let each: Vec<Option<(f64, f64, f64)>> = angles.par_iter().map(of).collect();
        each.into_iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0))
    };
    let (low, high) = (std::f64::consts::TAU / longest, std::f64::consts::TAU / shortest);
    let (turn, step) = (std::f64::consts::PI / f64::from(DIRECTIONS), (high - low) / PERIODS as f64);
    let angles: Vec<f64> = (0..DIRECTIONS).map(|n| f64::from(n) * turn).collect();
    let (_, angle, wave) = best(&angles, low, step, PERIODS + 1)?;
    let near: Vec<f64> = (-10..=10).map(|n| angle + f64::from(n) * 0.1 * turn).collect();
    let (share, angle, wave) = best(&near, wave - step, 0.1 * step, 21)?;
    let mut heights: Vec<f64> = list.iter().map(|[_, _, z]| *z).collect();
    heights.sort_unstable_by(f64::total_cmp);
    let at = |part: f64| heights.get((heights.len() as f64 * part) as usize).copied().unwrap_or(0.0);
    let across = add(scale(first, angle.cos()), scale(second, angle.sin()));
    // Where places lie unevenly, waves are not independent of each other, and one may take more than there is.
    Some(Hint { across, pitch: std::f64::consts::TAU / wave, height: at(0.98) - at(0.02), share: share.min(1.0) })
}

/// The part of the sum of squares of heights that waves in one direction explain, `count` of them by equal steps of wave number. Each place's phase goes on from
/// wave to wave by one turn: a sine for each would take ten times as long.
fn shares(list: &[Point], angle: f64, (low, step, count): (f64, f64, usize)) -> Vec<f64> {
    let (sin, cos) = angle.sin_cos();
    let mut sums = vec![(0.0, 0.0); count];
    for [x, y, z] in list {
        let along = x * cos + y * sin;
        let ((mut s, mut c), (ds, dc)) = ((low * along).sin_cos(), (step * along).sin_cos());
        for (a, b) in &mut sums {
            (*a, *b) = (*a + z * s, *b + z * c);
            (s, c) = (s * dc + c * ds, c * dc - s * ds);
        }
    }
    sums.into_iter().map(|(a, b)| 2.0 * (a * a + b * b) / list.len() as f64).collect()
}

/// Takes the least-squares parabolic surface away from heights; `None` if the places do not determine one.
pub(super) fn flatten(list: &mut [Point], size: f64) -> Option<()> {
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
