//! Lifts tools off the surface that is meant.
//!
//! A tool with a flat end that touches a hollow at its corner may cut below the surface with another part. Programs avoid this: the tool
//! goes up along its axis until no part of it is below the surface. B. K. Choi and R. B. Jerard, *Sculptured Surface Machining*, 1998, tell
//! how programs are made.

use super::cutter::Cutter;
use super::surface::Surface;
use crate::space::{Vector, length, minus, plus, times};

/// Directions from the axis in which the search for the deepest place begins.
const DIRECTIONS: usize = 16;

/// Places in each of them.
const PLACES: usize = 8;

/// The search for the deepest place ends at steps of this part of the tool's radius, and of so many radians.
const FINE: f64 = 1e-7;

/// A tool that is deeper than this, in millimetres, cuts; less is rounding.
const DEEP: f64 = 1e-9;

/// The way of a tip over a surface: no move is longer than `most`, and each place is raised until no part of the tool is below the surface.
/// Places where none is stay as they are.
pub(super) fn lifted(cutter: Cutter, surface: Surface, tips: &[Vector], most: f64) -> Vec<Vector> {
    let raised = |tip: Vector| {
        let depth = depth(cutter, surface, tip);
        if depth > DEEP { [tip[0], tip[1], tip[2] + depth] } else { tip }
    };
    let mut way: Vec<Vector> = tips.first().copied().into_iter().collect();
    for [from, to] in tips.array_windows() {
        let count = (length(minus(*to, *from)) / most).ceil().max(1.0);
        let between = (1..count as usize).map(|k| plus(times(*from, 1.0 - k as f64 / count), times(*to, k as f64 / count)));
        way.extend(between.chain([*to]));
    }
    way.into_iter().map(raised).collect()
}

/// How far the surface stands above the tool's lower side, at most; negative if the tool is in the air. Without end in the air of planes and
/// cones, which have no hollow.
fn depth(cutter: Cutter, surface: Surface, tip: Vector) -> f64 {
    let value = |[turn, far]: [f64; 2]| {
        let z = surface.above(tip[0] + far * turn.cos(), tip[1] + far * turn.sin());
        z.map_or(f64::NEG_INFINITY, |z| z - tip[2] - cutter.rise(far))
    };
    let from = |n: usize| {
        let turn = std::f64::consts::TAU * n as f64 / DIRECTIONS as f64;
        let places = (0..=PLACES).map(|k| [turn, cutter.radius * k as f64 / PLACES as f64]);
        let best = places.max_by(|a, b| value(*a).total_cmp(&value(*b)));
        climb(&value, best.unwrap_or_default(), cutter.radius)
    };
    (0..DIRECTIONS).map(from).fold(f64::NEG_INFINITY, f64::max)
}

/// The greatest value about a place, by direction and distance from the axis: goes aside as long as that is higher, then with half the step
/// (R. Hooke, T. A. Jeeves, *"Direct search" solution of numerical and statistical problems*, Journal of the ACM 8, 1961).
fn climb(value: &impl Fn([f64; 2]) -> f64, mut place: [f64; 2], radius: f64) -> f64 {
    let mut best = value(place);
    let mut step = 1.0 / PLACES as f64;
    while step > FINE {
        let [turn, far] = place;
        let [less, more] = [-1.0, 1.0].map(|sign| (far + sign * step * radius).clamp(0.0, radius));
        let aside = [[turn + step, far], [turn - step, far], [turn, less], [turn, more]];
        match aside.into_iter().map(|place| (value(place), place)).max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((higher, there)) if higher > best => (best, place) = (higher, there),
            _ => step *= 0.5,
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAVES: Surface = Surface::Free(1.0, 40.0);

    #[test]
    fn the_deepest_place_is_found() {
        // Asked at many places around the axis: between two of them the surface changes by less than 1e-4.
        for (radius, corner) in [(2.0, 0.0), (2.0, 1.0), (3.0, 3.0)] {
            let cutter = Cutter { radius, corner };
            for tip in [[0.0, 9.74, 0.0], [1.0, 9.2, -0.01], [30.0, -4.5, -1.0], [10.0, -4.5, 1.0], [5.5, 3.0, 0.4]] {
                let mut most = f64::NEG_INFINITY;
                for (n, k) in (0..1440).flat_map(|n| (0..=400).map(move |k| (n, k))) {
                    let (sin, cos) = (std::f64::consts::TAU * f64::from(n) / 1440.0).sin_cos();
                    let far = radius * f64::from(k) / 400.0;
                    let z = WAVES.above(tip[0] + far * cos, tip[1] + far * sin).unwrap();
                    most = most.max(z - tip[2] - cutter.rise(far));
                }
                let found = depth(cutter, WAVES, tip);
                assert!((-1e-9..1e-4).contains(&(found - most)), "{cutter:?} {tip:?}: {found}, {most}");
            }
        }
    }

    #[test]
    fn a_tool_that_fits_stays_and_others_only_touch() {
        let cutter = Cutter { radius: 2.0, corner: 1.0 };
        // Along this line the surface is level at 9.74 and turns there: the tip goes to the other side of the place that it touches.
        let tips: Vec<Vector> = (0..=96).map(|j| cutter.tip(WAVES.at(0.5, 0.25 * f64::from(j)))).collect();
        let way = lifted(cutter, WAVES, &tips, 0.4);
        assert!(way.array_windows().all(|[a, b]| length(minus(*a, *b)) < 0.45) && way.len() > tips.len());
        assert!(way.iter().all(|tip| depth(cutter, WAVES, *tip) < 2.0 * DEEP));
        let deepest = tips.iter().map(|tip| depth(cutter, WAVES, *tip)).fold(0.0, f64::max);
        assert!(deepest > 0.01, "nothing was to be lifted: {deepest}");
        let kept = tips.iter().filter(|tip| way.contains(tip)).count();
        assert!((60..97).contains(&kept), "{kept}");
    }

    #[test]
    fn planes_and_cones_lift_nothing() {
        let cutter = Cutter { radius: 3.0, corner: 0.0 };
        for surface in [Surface::Plane(80.0), Surface::Cone(20.0, 60.0)] {
            assert_eq!(lifted(cutter, surface, &[[1.0, 2.0, -3.0]], 1.0), [[1.0, 2.0, -3.0]]);
        }
    }
}
