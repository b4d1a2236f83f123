//! Parts: vertices, triangles, labels and program of a case.

use super::case::Case;
use super::close::close;
use super::lattice::Lattice;
use super::program::{passes, program};
use super::sweep::{Sweep, Top};

/// Less height than this everywhere, in millimetres, is no residue: the tool leaves nothing.
const NOTHING: f64 = 1e-4;

/// A vertex that stands higher than this, in millimetres, does not touch a pass.
const OFF: f64 = 1e-5;

/// A part, and the truth about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Vertices, in millimetres.
    pub points: Vec<[f32; 3]>,
    /// Triangles, counter-clockwise from outside; together they are closed.
    pub faces: Vec<[u32; 3]>,
    /// Whether a triangle is residue, for each one.
    pub labels: Vec<bool>,
    /// The tool path as G-code.
    pub code: String,
    /// The greatest height over the intended surface within what the passes cover, in millimetres, before noise.
    pub height: f64,
}

impl Part {
    /// The part as binary STL.
    pub fn stl(&self) -> Vec<u8> {
        let mut bytes = vec![0; 80];
        bytes.extend((self.faces.len() as u32).to_le_bytes());
        for corners in self.triangles() {
            bytes.extend([0; 12]);
            bytes.extend(corners.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    /// The corners of each triangle.
    pub fn triangles(&self) -> impl Iterator<Item = [[f32; 3]; 3]> {
        self.faces.iter().map(|face| face.map(|v| self.points.get(v as usize).copied().unwrap_or([f32::NAN; 3])))
    }
}

/// Makes a part: the same one for the same case, whatever the number of threads. The work is linear in vertices.
pub fn make(case: &Case) -> Part {
    let passes = passes(case);
    let (code, links) = program(case, &passes);
    let lattice = Lattice::of(case);
    let tops = Sweep::of(case, &passes, &links).tops(&lattice);
    let height = greatest(&lattice, &tops);
    let mut points = scattered(&tops, case.noise);
    let (mut faces, mut labels) = (Vec::new(), Vec::new());
    let tops: Vec<Top> = tops.into_iter().flatten().collect();
    for ([i, j], pair) in lattice.triangles() {
        let is_left = height > NOTHING && lattice.is_covered(i, j);
        faces.extend(pair);
        labels.extend(pair.map(|face| is_left && face.into_iter().any(|v| tops[v as usize].1 > OFF)));
    }
    close(&mut points, &mut faces, &lattice);
    labels.resize(faces.len(), false);
    Part { points, faces, labels, code, height }
}

/// The greatest height within what the passes cover.
fn greatest(lattice: &Lattice, tops: &[Vec<Top>]) -> f64 {
    let places = tops.iter().enumerate().flat_map(|(j, row)| row.iter().enumerate().map(move |(i, top)| (i, j, top.1)));
    places.filter(|(i, j, _)| lattice.is_within(*i, *j)).map(|(_, _, height)| height).fold(0.0, f64::max)
}

/// The points, each coordinate moved by up to `noise` (xorshift: Marsaglia 2003).
fn scattered(tops: &[Vec<Top>], noise: f64) -> Vec<[f32; 3]> {
    let mut seed = 0x9e37_79b9_7f4a_7c15u64;
    let mut random = move || {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    tops.iter().flatten().map(|(point, _)| point.map(|x| (x + noise * random()) as f32)).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::super::cutter::Cutter;
    use super::super::surface::Surface;
    use super::*;
    use crate::space::{cross, dot, wide};

    /// Four passes of a tool, 6 long.
    fn small(surface: Surface, (radius, corner): (f64, f64), step: f64) -> Case {
        let cutter = Cutter { radius, corner };
        Case { name: "small", surface, cutter, step, passes: 4, length: 6.0, cells: 6, noise: 0.0, zigzag: false }
    }

    #[test]
    fn a_ball_leaves_scallops_of_the_exact_height() {
        // Circles of radius r, a step s apart, meet r − √(r² − s²/4) above the line that they touch. The search for the cusp stops at
        // 2⁻¹⁹ of the step, where the circle climbs by less than 1 in 2.
        for (r, s) in [(3.0, 0.5), (3.0, 1.0), (3.0, 2.0), (1.25, 1.1)] {
            let exact = r - (r * r - s * s / 4.0f64).sqrt();
            for slope in [0.0, 40.0] {
                let part = make(&small(Surface::Plane(slope), (r, r), s));
                assert!((part.height - exact).abs() < 1e-6 * s, "radius {r}, step {s}, slope {slope}: {} {exact}", part.height);
            }
        }
    }

    #[test]
    fn a_flat_end_leaves_steps_on_a_slope() {
        // Each pass leaves a level step and an upright one; their edge is s·sin α·cos α above the slope.
        for (slope, step) in [(30.0f64, 0.5), (10.0, 0.8), (75.0, 0.6)] {
            let (sin, cos) = slope.to_radians().sin_cos();
            let part = make(&small(Surface::Plane(slope), (3.0, 0.0), step));
            assert!((part.height - step * sin * cos).abs() < 1e-5 * step, "{slope}: {}", part.height);
        }
    }

    #[test]
    fn a_flat_end_leaves_nothing_on_a_floor() {
        let part = make(&small(Surface::Plane(0.0), (3.0, 0.0), 1.0));
        assert!(part.height < 1e-9, "{}", part.height);
        assert_eq!(part.labels, vec![false; part.faces.len()]);
    }

    #[test]
    fn labels_are_of_the_triangles_between_the_passes() {
        for (surface, corner) in [(Surface::Plane(0.0), 3.0), (Surface::Plane(50.0), 1.0)] {
            let case = small(surface, (3.0, corner), 1.0);
            let part = make(&case);
            let bottom = part.points.iter().map(|p| p[2]).fold(f32::INFINITY, f32::min);
            assert!(part.labels.contains(&true) && part.labels.len() == part.faces.len());
            for (corners, label) in part.triangles().zip(&part.labels) {
                let feet = corners.map(|p| surface.foot(wide(p)));
                let [u, v] = [feet.iter().map(|f| f.u).sum::<f64>() / 3.0, feet.iter().map(|f| f.v).sum::<f64>() / 3.0];
                let is_upper = corners.iter().all(|p| p[2] != bottom);
                let is_covered = (0.0..case.width()).contains(&u) && (0.0..case.length).contains(&v);
                assert_eq!(*label, is_upper && is_covered, "{surface:?} {corners:?}");
            }
        }
    }

    #[test]
    fn parts_are_closed_and_their_inside_is_inside() {
        let surfaces = [Surface::Plane(0.0), Surface::Plane(80.0), Surface::Cone(15.0, 60.0), Surface::Free(1.0, 30.0)];
        for surface in surfaces {
            let part = make(&small(surface, (2.0, 2.0), 0.9));
            let edges = part.faces.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
            let once: BTreeSet<(u32, u32)> = edges.collect();
            assert_eq!(once.len(), 3 * part.faces.len(), "{surface:?}: an edge is there twice in one direction");
            assert!(once.iter().all(|(a, b)| once.contains(&(*b, *a))), "{surface:?}: an edge lacks its opposite");
            // A sphere: V − E + F = 2.
            assert_eq!(part.points.len() + part.faces.len(), once.len() / 2 + 2, "{surface:?}");
            let volume: f64 = part.triangles().map(|t| t.map(wide)).map(|[a, b, c]| dot(a, cross(b, c)) / 6.0).sum();
            assert!(volume > 0.0, "{surface:?}: {volume}");
        }
    }

    #[test]
    fn noise_moves_vertices_by_no_more_than_it_says() {
        let case = small(Surface::Plane(20.0), (2.0, 2.0), 0.9);
        let (still, noisy) = (make(&case), make(&Case { noise: 0.01, ..case }));
        let upper = Lattice::of(&case).rows.len() * Lattice::of(&case).columns;
        let moved = |n: usize| (0..3).map(|k| (still.points[n][k] - noisy.points[n][k]).abs()).fold(0.0, f32::max);
        let most = (0..upper).map(moved).fold(0.0, f32::max);
        assert!((0.009..0.010_001).contains(&most), "{most}");
        assert_eq!((&still.faces, &still.labels, still.height), (&noisy.faces, &noisy.labels, noisy.height));
    }

    #[test]
    fn stl_holds_the_triangles() {
        let part = make(&small(Surface::Plane(0.0), (2.0, 2.0), 0.9));
        let bytes = part.stl();
        assert_eq!(bytes.len(), 84 + 50 * part.faces.len());
        assert_eq!(bytes[80..84], (part.faces.len() as u32).to_le_bytes());
        let number = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        for (n, corners) in part.triangles().enumerate() {
            let read: Vec<f32> = (0..9).map(|k| number(84 + 50 * n + 12 + 4 * k)).collect();
            assert_eq!(read, corners.as_flattened(), "triangle {n}");
        }
    }

    #[test]
    fn senseless_counts_still_make_a_part() {
        let case = small(Surface::Plane(0.0), (2.0, 2.0), 0.9);
        let least = make(&Case { passes: 2, cells: 2, ..case });
        assert_eq!(make(&Case { passes: 0, cells: 0, ..case }), least);
        assert_eq!(make(&Case { passes: 1, cells: 1, ..case }), least);
        for length in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            make(&Case { length, passes: 2, cells: 2, ..case });
        }
    }
}
