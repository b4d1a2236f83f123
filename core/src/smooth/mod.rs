//! Smoothing of triangle meshes without shrinkage, and without anything that crosses for it.
//!
//! **In:** points, faces, which faces may change, how much of waves of which length is to be left.
//! **Out:** points, the largest displacement, the volume before and after.
//! **Promise:** no triangle crosses another one, turns over or loses its area for it; the rim of what may change, and all outside of it, has the same bits.

mod settle;
mod taubin;

pub(crate) use settle::{Settled, settle};
pub(crate) use taubin::Filter;

use glam::DVec3;
use rayon::prelude::*;

use crate::algorithms::fans::{Around, corners_by_vertex};
use crate::geometry::distance::place;
use crate::geometry::exact::Point;

/// How often the way of all vertices is halved to keep the volume.
const HALVES: usize = 10;

/// How a mesh is smoothed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Options {
    /// The filter.
    pub filter: Filter,
    /// How often it is used; [`Filter::passes`] tells it by the wave.
    pub passes: usize,
    /// Vertices stay on edges whose triangles' normals differ by more than this angle, in radians.
    pub feature_angle: Option<f64>,
    /// The largest change of the volume below the faces, as a share of it.
    pub max_volume_change: Option<f64>,
}

/// The smoothed mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Smoothed {
    /// Where the vertices are, and how far they went: no place of one surface is farther from the other.
    pub settled: Settled,
    /// The volume before and after, signed.
    pub volume: [f64; 2],
    /// The share of the way that all vertices were let go, to keep the volume.
    pub share: f64,
}

/// Smooths a mesh: `faces` refer to `points`, which are finite. Vertices of faces outside `region`, and those whose triangles form no closed fan, stay. O(n log n).
pub(crate) fn smooth(points: &[Point], faces: &[[u32; 3]], region: Option<&[bool]>, options: &Options) -> Smoothed {
    let (starts, neighbours) = movable(points, faces, region, options.feature_angle);
    let mut places: Vec<DVec3> = points.par_iter().map(|p| place(*p)).collect();
    options.filter.pass(&mut places, &starts, &neighbours, options.passes);
    let target = |v: usize, share: f64| -> Point {
        if starts[v] == starts[v + 1] {
            return points[v];
        }
        let from = place(points[v]);
        (from + (places[v] - from) * share).to_array().map(|x| x as f32 + 0.0)
    };
    let before = volume(points, faces);
    let mut share = 1.0;
    let mut wanted: Vec<Point> = (0..points.len()).into_par_iter().map(|v| target(v, 1.0)).collect();
    let mut settled = settle(points, faces, &wanted);
    if let Some(most) = options.max_volume_change {
        for _ in 0..HALVES {
            if (volume(&settled.points, faces) - before).abs() <= most * before.abs() {
                break;
            }
            share *= 0.5;
            wanted = (0..points.len()).into_par_iter().map(|v| target(v, share)).collect();
            settled = settle(points, faces, &wanted);
        }
        if (volume(&settled.points, faces) - before).abs() > most * before.abs() {
            (share, settled) = (0.0, settle(points, faces, points));
        }
    }
    let after = volume(&settled.points, faces);
    Smoothed { settled, volume: [before, after], share }
}

/// The neighbours of each vertex that may move, from where to where.
fn movable(points: &[Point], faces: &[[u32; 3]], region: Option<&[bool]>, feature: Option<f64>) -> (Vec<u32>, Vec<u32>) {
    let mut stays = vec![false; points.len()];
    for (f, face) in faces.iter().enumerate() {
        if region.is_some_and(|region| !region.get(f).copied().unwrap_or(false)) {
            face.iter().for_each(|v| stays[*v as usize] = true);
        }
    }
    let (corner_starts, corners) = corners_by_vertex(points.len(), faces);
    let cosine = feature.map_or(-2.0, f64::cos);
    let neighbours = |around: &mut Around, v: usize| {
        let own = corners.get(corner_starts[v] as usize..corner_starts[v + 1] as usize).unwrap_or_default();
        let around = around.of(points, faces, own).filter(|around| !stays[v] && around.features(cosine) == Some(0));
        around.map_or_else(Vec::new, |around| around.neighbours().collect())
    };
    let lists: Vec<Vec<u32>> =
        (0..points.len()).into_par_iter().with_min_len(1 << 10).map_init(Around::default, neighbours).collect();
    let mut starts = Vec::with_capacity(points.len() + 1);
    starts.push(0);
    let mut sum = 0;
    for list in &lists {
        sum += list.len() as u32;
        starts.push(sum);
    }
    (starts, lists.concat())
}

/// The signed volume between the faces and their middle; in one order, whatever the number of threads.
pub(crate) fn volume(points: &[Point], faces: &[[u32; 3]]) -> f64 {
    let middle = points.iter().fold(DVec3::ZERO, |sum, p| sum + place(*p)) / points.len().max(1) as f64;
    let of = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| place(points[v as usize]) - middle);
        a.dot(b.cross(c))
    };
    faces.iter().map(of).sum::<f64>() / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A closed tube along x with ripples of four edges along it, ends apart: a torus of a large radius is as good, and has no ends.
    fn rippled(n: u32, m: u32, height: f64) -> (Vec<Point>, Vec<[u32; 3]>) {
        let turn = |i: u32, n: u32| f64::from(i) / f64::from(n) * std::f64::consts::TAU;
        let point = |i: u32| {
            let (u, v) = (turn(i / m, n), turn(i % m, m));
            let r = 2.0 + height * (f64::from(i / m) * std::f64::consts::FRAC_PI_2).cos();
            [(10.0 + r * v.cos()) * u.cos(), (10.0 + r * v.cos()) * u.sin(), r * v.sin()].map(|x| x as f32)
        };
        let at = |i: u32, j: u32| i % n * m + j % m;
        let squares = (0..n * m).map(|s| (s / m, s % m));
        let faces = squares.flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        });
        ((0..n * m).map(point).collect(), faces.collect())
    }

    fn options() -> Options {
        Options { filter: Filter::default(), passes: 8, feature_angle: None, max_volume_change: Some(0.02) }
    }

    #[test]
    fn ripples_go_and_the_volume_stays() {
        let (points, faces) = rippled(96, 24, 0.1);
        let smoothed = smooth(&points, &faces, None, &options());
        let height = |p: &Point| {
            let out = f64::from(p[0]).hypot(f64::from(p[1])) - 10.0;
            (out.hypot(f64::from(p[2])) - 2.0).abs()
        };
        let [before, after] =
            [&points, &smoothed.settled.points].map(|all| all.iter().map(height).sum::<f64>() / all.len() as f64);
        assert!(after < 0.4 * before, "{before} {after}");
        // The filter makes the tube's own roundness larger by a little: of the six neighbours, two stand beside a vertex, and four a step of the 24 around.
        let k = 4.0 / 6.0 * (1.0 - (std::f64::consts::TAU / 24.0).cos());
        let wider = options().filter.transfer(k).powi(8 * 2);
        // Ripples of height a on a radius r hold a²∕2r² of the volume, which goes with them: 0.1 of 2.
        let [was, is] = smoothed.volume;
        assert!((is / was - wider).abs() < 2.0 * 0.1_f64.powi(2) / (2.0 * 2.0_f64.powi(2)), "{} {wider}", is / was);
        assert!(smoothed.share == 1.0 && smoothed.settled.held == 0);
        assert!(smoothed.settled.largest <= 0.2, "not more than from crest to trough");
    }

    #[test]
    fn what_may_not_change_stays_to_the_bit() {
        let (points, faces) = rippled(48, 24, 0.1);
        let region: Vec<bool> = (0..faces.len()).map(|f| f % 1000 < 300).collect();
        let smoothed = smooth(&points, &faces, Some(&region), &options());
        let mut moved = 0;
        for (face, own) in faces.iter().zip(&region) {
            let count = face.iter().filter(|v| smoothed.settled.points[**v as usize] != points[**v as usize]).count();
            assert!(*own || count == 0);
            moved += count;
        }
        assert!(moved > 0);
    }

    #[test]
    fn a_volume_that_may_not_change_stops_all() {
        let (points, faces) = rippled(48, 24, 0.1);
        let smoothed = smooth(&points, &faces, None, &Options { max_volume_change: Some(0.0), ..options() });
        assert_eq!((smoothed.share, &smoothed.settled.points), (0.0, &points));
    }
}
