//! How near a repaired part comes to the surface that was meant.

use super::case::Case;
use super::part::Part;
use super::surface::Foot;
use crate::space::{Vector, plus, times, wide};

/// The measures of a repaired part, well within what the passes cover.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// The greatest height above the intended surface, in millimetres.
    pub height_after: f64,
    /// The greatest distance from the intended surface on either side, in millimetres; infinite where a point is no number.
    pub off: f64,
    /// The number of triangles whose centre lies there.
    pub triangles: usize,
}

/// Measures triangles in any order, at corners, middles of edges and centres. Only points that lie well within what the passes cover
/// count: a step away from the first pass and the last, and the tool's radius away from their ends. A triangle that reaches the level
/// of the part's bottom is of its sides or its bottom. The work is linear in triangles.
pub fn judge(case: &Case, part: &Part, triangles: &[[[f32; 3]; 3]]) -> Verdict {
    let level = part.points.iter().map(|p| p[2]).fold(f32::INFINITY, f32::min);
    let mut verdict = Verdict { height_after: 0.0, off: 0.0, triangles: 0 };
    for corners in triangles.iter().filter(|corners| corners.iter().all(|p| p[2] != level)) {
        let [a, b, c] = corners.map(wide);
        let centre = times(plus(plus(a, b), c), 1.0 / 3.0);
        if let Some(distance) = measured(case, centre) {
            verdict.triangles += 1;
            verdict.see(distance);
        }
        for p in [a, b, c, middle(a, b), middle(b, c), middle(c, a)] {
            if let Some(distance) = measured(case, p) {
                verdict.see(distance);
            }
        }
    }
    verdict
}

impl Verdict {
    fn see(&mut self, distance: f64) {
        self.height_after = self.height_after.max(distance);
        self.off = self.off.max(distance.abs());
    }
}

fn middle(a: Vector, b: Vector) -> Vector {
    times(plus(a, b), 0.5)
}

/// The signed distance of a point that lies well within what the passes cover; infinite if it is no number.
fn measured(case: &Case, p: Vector) -> Option<f64> {
    let Foot { u, v, distance } = case.surface.foot(p);
    if !(u.is_finite() && v.is_finite() && distance.is_finite()) {
        return Some(f64::INFINITY);
    }
    let (step, radius) = (case.step, case.cutter.radius);
    let is_within = (step..=case.width() - step).contains(&u) && (radius..=case.length - radius).contains(&v);
    is_within.then_some(distance)
}

#[cfg(test)]
mod tests {
    use super::super::cutter::Cutter;
    use super::super::part::make;
    use super::super::surface::Surface;
    use super::*;

    /// Five passes of a tool of radius 3, a millimetre apart and 12 long.
    fn small(surface: Surface, corner: f64) -> Case {
        let cutter = Cutter { radius: 3.0, corner };
        Case { name: "small", surface, cutter, step: 1.0, passes: 5, length: 12.0, cells: 6, noise: 0.0, zigzag: false }
    }

    fn all(part: &Part) -> Vec<[[f32; 3]; 3]> {
        part.triangles().collect()
    }

    /// The part with its upper vertices moved.
    fn moved(part: &Part, to: impl Fn(f32) -> f32) -> Vec<[[f32; 3]; 3]> {
        let bottom = part.points.iter().map(|p| p[2]).fold(f32::INFINITY, f32::min);
        let place = |[x, y, z]: [f32; 3]| [x, y, if z == bottom { z } else { to(z) }];
        part.triangles().map(|corners| corners.map(place)).collect()
    }

    #[test]
    fn a_part_that_nobody_repaired_has_its_own_height() {
        for (slope, corner) in [(0.0, 3.0), (30.0, 0.0), (30.0, 1.0), (80.0, 3.0)] {
            let case = small(Surface::Plane(slope), corner);
            let part = make(&case);
            let verdict = judge(&case, &part, &all(&part));
            assert!((verdict.height_after - part.height).abs() < 1e-5, "{slope}: {verdict:?}, {}", part.height);
            assert!((verdict.off - part.height).abs() < 1e-5, "{slope}: {verdict:?}, {}", part.height);
        }
    }

    #[test]
    fn triangles_well_within_are_counted() {
        // Rows are half a millimetre apart: 12 of them lie 3 or more away from the ends, over two strips of six cells.
        let case = small(Surface::Plane(0.0), 3.0);
        let part = make(&case);
        assert_eq!(judge(&case, &part, &all(&part)).triangles, 12 * 2 * 6 * 2);
    }

    #[test]
    fn a_moved_surface_is_off_by_what_it_moved() {
        let case = small(Surface::Plane(0.0), 3.0);
        let part = make(&case);
        let flat = judge(&case, &part, &moved(&part, |_| 0.0));
        assert_eq!((flat.height_after, flat.off), (0.0, 0.0));
        assert_eq!(flat.triangles, 12 * 2 * 6 * 2);
        let up = judge(&case, &part, &moved(&part, |z| z + 0.25));
        assert!((up.height_after - part.height - 0.25).abs() < 1e-6 && up.off == up.height_after, "{up:?}");
        // The passes touched the floor.
        let down = judge(&case, &part, &moved(&part, |z| z - 0.25));
        assert!(down.height_after == 0.0 && (down.off - 0.25).abs() < 1e-6, "{down:?}");
    }

    #[test]
    fn middles_and_centres_are_looked_at() {
        // Corners on the wall of a cone of radius r at one height, an angle of 2a apart: the middle of their edge lies r(1 − cos a) nearer
        // to the axis, and sin 60° of that above the wall.
        let surface = Surface::Cone(20.0, 60.0);
        let case = small(surface, 3.0);
        let part = make(&case);
        let at = |u: f64, v: f64| surface.at(u, v).0.map(|x| x as f32);
        let verdict = judge(&case, &part, &[[at(1.5, 4.0), at(1.5, 8.0), at(2.5, 6.0)]]);
        let exact = (20.0 + 1.5 * 0.5) * (1.0 - 0.1f64.cos()) * 0.75f64.sqrt();
        assert!((verdict.height_after - exact).abs() < 1e-5, "{verdict:?}, {exact}");
        assert_eq!(verdict.triangles, 1);
    }

    #[test]
    fn margins_and_bottom_do_not_count() {
        let case = small(Surface::Plane(0.0), 3.0);
        let part = make(&case);
        let bottom = part.points[part.points.len() - 1][2];
        for [u, v, z] in [[0.5, 6.0, 0.2], [3.5, 6.0, 0.2], [2.0, 2.5, 0.2], [2.0, 9.5, 0.2], [2.0, 6.0, bottom]] {
            let verdict = judge(&case, &part, &[[[u, v, z], [u + 0.1, v, z], [u, v + 0.1, z]]]);
            assert_eq!(verdict, Verdict { height_after: 0.0, off: 0.0, triangles: 0 }, "{u} {v} {z}");
        }
    }

    #[test]
    fn a_point_that_is_no_number_is_infinitely_far() {
        for surface in [Surface::Plane(0.0), Surface::Cone(20.0, 60.0), Surface::Free(1.0, 30.0)] {
            let case = small(surface, 3.0);
            let part = Part { points: vec![[0.0; 3]], faces: Vec::new(), labels: Vec::new(), code: String::new(), height: 0.0 };
            let verdict = judge(&case, &part, &[[[2.0, 6.0, 1.0], [2.0, f32::NAN, 1.0], [2.5, 6.0, 1.0]]]);
            assert_eq!(verdict.off, f64::INFINITY, "{surface:?}");
        }
    }
}
