//! How high the tool path leaves the stock over each place of the intended surface.

use super::case::Case;
use super::lattice::{Lattice, margin};
use super::pass::Pass;
use crate::space::{Vector, plus, times};

/// A place of the upper side: its point, and its height over the intended surface in millimetres.
pub(super) type Top = (Vector, f64);

/// More than rounding does to a distance, in millimetres.
const SLACK: f64 = 1e-6;

/// The swept volume of a case.
pub(super) struct Sweep<'a> {
    case: &'a Case,
    passes: &'a [Pass],
    links: &'a [Pass],
    /// Heights among which the volume is looked for.
    range: [f64; 2],
}

impl<'a> Sweep<'a> {
    /// The volume that these passes and the cuts between them sweep.
    pub(super) fn of(case: &'a Case, passes: &'a [Pass], links: &'a [Pass]) -> Self {
        let (r, c) = (case.cutter.radius, case.cutter.corner);
        // A scallop of a ball is about s²/8r high. On a slope, a corner leaves up to half a step.
        let most = (case.step * case.step / 8.0 / c.max(0.3 * r)).max(case.step * 0.5);
        Self { case, passes, links, range: [-0.1 * case.step, most.min(0.6 * r)] }
    }

    /// The upper side, row after row. Threads share the rows, and their number does not matter to the result.
    pub(super) fn tops(&self, lattice: &Lattice) -> Vec<Vec<Top>> {
        self.shared(lattice, std::thread::available_parallelism().map_or(1, usize::from))
    }

    fn shared(&self, lattice: &Lattice, threads: usize) -> Vec<Vec<Top>> {
        let last = lattice.rows.len() - 1;
        let rows: Vec<(usize, f64)> = lattice.rows.iter().copied().enumerate().collect();
        let work = |(j, v): &(usize, f64)| self.row(*v, *j == 0 || *j == last);
        std::thread::scope(|scope| {
            let parts = rows.chunks(rows.len().div_ceil(threads));
            let parts: Vec<_> = parts.map(|part| scope.spawn(move || part.iter().map(work).collect::<Vec<_>>())).collect();
            parts.into_iter().flat_map(|part| part.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
        })
    }

    /// One row. The stock's border is smooth: it stands as high everywhere, over what closes the part. The upper border lies on the
    /// intended surface, so that nothing of a steep wall hangs over it.
    fn row(&self, v: f64, is_border: bool) -> Vec<Top> {
        let us = self.columns(v);
        let top = |(i, u): (usize, &f64)| {
            let height = if i + 1 == us.len() {
                0.0
            } else if is_border || i == 0 {
                self.range[1]
            } else {
                self.height(*u, v)
            };
            (self.case.surface.lifted(*u, v, height), height)
        };
        us.iter().enumerate().map(top).collect()
    }

    /// `u` of each vertex of a row: margin, passes with the cells between them, margin.
    fn columns(&self, v: f64) -> Vec<f64> {
        let (step, half, margin) = (self.case.step, self.case.half(), margin(self.case));
        let mut us: Vec<f64> = margin.iter().rev().map(|m| -m).collect();
        for k in 0..self.case.strips() {
            let cusp = self.cusp(k, v);
            us.extend((0..half).map(|j| (k as f64 + cusp * j as f64 / half as f64) * step));
            us.extend((0..half).map(|j| (k as f64 + (cusp + (1.0 - cusp) * j as f64 / half as f64)) * step));
        }
        let end = self.case.width();
        us.push(end);
        us.extend(margin.iter().map(|m| end + m));
        us
    }

    /// Where the cusp between a pass and the next one lies, as a share of the step: both passes leave as much there.
    fn cusp(&self, k: usize, v: f64) -> f64 {
        let (mut low, mut high) = (0.02, 0.98);
        for _ in 0..18 {
            let middle = 0.5 * (low + high);
            let ray = self.case.surface.at((k as f64 + middle) * self.case.step, v);
            let [a, b] = [k, k + 1].map(|k| self.passes[k].entry(self.case.cutter, ray, self.range));
            if a < b { low = middle } else { high = middle }
        }
        let cusp = 0.5 * (low + high);
        if (0.03..0.97).contains(&cusp) { cusp } else { 0.5 }
    }

    /// The height that is left over these parameters.
    fn height(&self, u: f64, v: f64) -> f64 {
        let (case, ray) = (self.case, self.case.surface.at(u, v));
        let far = |k: usize| (k as f64 - u / case.step).abs();
        let mut near: Vec<usize> = (0..self.passes.len()).collect();
        near.sort_by(|a, b| far(*a).total_cmp(&far(*b)));
        // Links cut at the passes' ends alone.
        let reach = 1.2 * case.cutter.radius;
        let links = if v < reach || v > case.length - reach { self.links } else { &[] };
        let is_beside = (0.0..=case.length).contains(&v);
        let from = plus(ray.0, times(ray.1, self.range[0]));
        near.iter().map(|k| &self.passes[*k]).chain(links).fold(self.range[1], |least, pass| {
            // On the way up to `least` the distance falls by no more than the way is long. Beside a pass this is so; beyond its ends
            // a pass may be too far away for `Pass::distance` to see it.
            let is_beyond = is_beside && pass.distance(case.cutter, from) > least - self.range[0] + SLACK;
            if is_beyond { least } else { least.min(pass.entry(case.cutter, ray, self.range)) }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::case::{CASES, FRESH};
    use super::super::close::close;
    use super::super::cutter::Cutter;
    use super::super::program::{passes, program};
    use super::super::surface::Surface;
    use super::*;
    use crate::space::{cross, minus, wide};

    /// Four short passes of a ball of radius 2, joined at their ends, over a wavy surface.
    fn wavy() -> Case {
        let cutter = Cutter { radius: 2.0, corner: 2.0 };
        let surface = Surface::Free(1.0, 30.0);
        Case { name: "wavy", surface, cutter, step: 0.8, passes: 4, length: 3.0, cells: 4, noise: 0.0, zigzag: true }
    }

    #[test]
    fn any_number_of_threads_gives_the_same_heights() {
        let case = wavy();
        let passes = passes(&case);
        let (_, links) = program(&case, &passes);
        let (sweep, lattice) = (Sweep::of(&case, &passes, &links), Lattice::of(&case));
        let one = sweep.shared(&lattice, 1);
        assert_eq!(one.len(), lattice.rows.len());
        assert!(one.iter().all(|row| row.len() == lattice.columns));
        for threads in [2, 3, 1000] {
            assert!(sweep.shared(&lattice, threads) == one, "{threads} threads");
        }
    }

    /// Passes of a bull nose around a saddle, where its tip goes from one side of the place that it touches to the other.
    fn saddle() -> Case {
        let cutter = Cutter { radius: 2.0, corner: 1.0 };
        Case { surface: Surface::Free(1.0, 40.0), cutter, step: 0.5, passes: 8, length: 14.0, zigzag: false, ..wavy() }
    }

    #[test]
    fn no_pass_holds_a_vertex_deep_inside() {
        // Passes that are skipped must not cut deeper than those that were looked at: all of them are asked here.
        for case in [wavy(), saddle()] {
            let passes = passes(&case);
            let (_, links) = program(&case, &passes);
            let lattice = Lattice::of(&case);
            let tops = Sweep::of(&case, &passes, &links).tops(&lattice);
            for (j, row) in tops.iter().enumerate() {
                for (i, (point, height)) in row.iter().enumerate().filter(|(i, _)| lattice.is_within(*i, j)) {
                    let all = passes.iter().chain(&links).map(|pass| pass.distance(case.cutter, *point));
                    let least = all.fold(f64::INFINITY, f64::min);
                    assert!(least.abs() < 1e-6, "vertex {i} of row {j}, {height} high, is {least} away from the volume");
                }
            }
        }
    }

    #[test]
    fn nothing_is_cut_below_the_surface() {
        // A straight move of 0.25 goes below the surface by its length squared over 8 radii of curvature, which are 40 and more here.
        let case = saddle();
        let passes = passes(&case);
        let tops = Sweep::of(&case, &passes, &[]).tops(&Lattice::of(&case));
        let least = tops.iter().flatten().map(|top| top.1).fold(f64::INFINITY, f64::min);
        assert!((-2e-4..0.0).contains(&least), "{least}");
    }

    #[test]
    fn cusps_of_a_slope_lie_where_circles_meet() {
        // Balls touch the slope at the passes, and their centres are a step apart: they meet half-way, whatever the slope.
        let case = Case { surface: Surface::Plane(35.0), ..wavy() };
        let passes = passes(&case);
        let cusp = Sweep::of(&case, &passes, &[]).cusp(1, 1.5);
        assert!((cusp - 0.5).abs() < 1e-5, "{cusp}");
    }

    /// The border of a case's part, with nothing within.
    fn border(case: &Case, lattice: &Lattice) -> Vec<[f32; 3]> {
        let passes = passes(case);
        let sweep = Sweep::of(case, &passes, &[]);
        let ends = [-case.cutter.radius * 0.9, case.width() + case.cutter.radius * 0.9];
        let last = lattice.rows.len() - 1;
        let row = |(j, v): (usize, &f64)| {
            if j == 0 || j == last {
                return sweep.row(*v, true);
            }
            let [from, to] = [(ends[0], sweep.range[1]), (ends[1], 0.0)].map(|(u, h)| (case.surface.lifted(u, *v, h), h));
            let mut row = vec![from; lattice.columns - 1];
            row.push(to);
            row
        };
        lattice.rows.iter().enumerate().flat_map(row).map(|(point, _)| point.map(|x| x as f32)).collect()
    }

    #[test]
    fn bottoms_of_all_cases_lie_flat() {
        // A border that is far from straight would fold the fans of the bottom over.
        for case in CASES.iter().chain(&FRESH) {
            let lattice = Lattice::of(case);
            let (mut points, mut faces) = (border(case, &lattice), Vec::new());
            close(&mut points, &mut faces, &lattice);
            let level = points[points.len() - 1][2];
            let bottom =
                faces.iter().map(|face| face.map(|v| points[v as usize])).filter(|face| face.iter().all(|p| p[2] == level));
            let mut count = 0;
            for corners in bottom {
                let [a, b, c] = corners.map(wide);
                assert!(cross(minus(b, a), minus(c, a))[2] < 0.0, "{}: {corners:?} faces up", case.name);
                count += 1;
            }
            assert_eq!(count, 2 * (lattice.columns + lattice.rows.len()) - 6, "{}", case.name);
        }
    }
}
