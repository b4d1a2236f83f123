//! What a repair did to the skin of a file whose meaning nobody knows: which part of the surface that could be seen from outside is
//! gone, and which part of the result was never drawn.
//!
//! Points are spread evenly over a surface, one for each equal piece of its area, in file order, so that the same meshes give the same
//! points. A point is *far* if the other mesh is farther than half a hundredth of the diagonal of the file. It *can be seen* if at
//! least two of [`RAYS`] rays from it, spread over all directions, meet nothing of its own mesh.
//!
//! Of a share of s, the n points of a mesh give it within about √(s / n): a thousandth of 40 000 points is 0.0010 ± 0.0002.
//!
//! O(n log n) time, and rays only from points that are far, and from each 32nd point for the whole of what can be seen.

use std::collections::{HashMap, HashSet};

use super::judgement::Triangle;
use super::near::Near;
use crate::space::{Vector, bounds, cross, dot, length, minus, plus, times, unit, wide};

/// The skin that a repair lost or invented.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "compare", derive(serde::Serialize, serde::Deserialize))]
pub struct Skin {
    /// Of the file's surface that can be seen, the share that is far from the result.
    pub lost: f64,
    /// The largest distance of such a place, as a share of the file's diagonal.
    pub lost_by: f64,
    /// Of the result's surface that can be seen, the share that is far from all that the file had.
    pub invented: f64,
    /// The same without patches that are plausible: flat, or small.
    pub implausible: f64,
    /// The largest distance of an implausible place, as a share of the file's diagonal.
    pub implausible_by: f64,
    /// Where most was lost, the farthest first.
    pub lost_at: Vec<Place>,
    /// Where most was invented that is not plausible.
    pub implausible_at: Vec<Place>,
}

/// A place where surface was lost or invented.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "compare", derive(serde::Serialize, serde::Deserialize))]
pub struct Place {
    /// Its farthest point.
    pub at: Vector,
    /// How far that is, in units of the file.
    pub far: f64,
    /// Share of all that can be seen.
    pub share: f64,
}

/// Points on each mesh.
const POINTS: usize = 40_000;
/// Each so many points are asked whether they can be seen, for the whole of what can.
const PROBE: usize = 32;
/// Rays of a point.
const RAYS: usize = 96;
/// So many must escape.
const ESCAPE: usize = 2;
/// Far, as a share of the diagonal.
const FAR: f64 = 0.005;
/// A patch of less than this share of the result's surface is small: on one side of a cube, a square of a third of its width.
const SMALL: f64 = 0.02;
/// Places within this share of the diagonal are one.
const ONE_PLACE: f64 = 0.1;
/// Places that are named.
const PLACES: usize = 5;

/// A point on a mesh.
struct Point {
    at: Vector,
    triangle: usize,
}

/// Points of equal area.
fn points(triangles: &[Triangle]) -> Vec<Point> {
    let areas: Vec<f64> = triangles.iter().map(area).collect();
    let all: f64 = areas.iter().sum();
    let piece = all / POINTS as f64;
    let (mut found, mut done, mut next) = (Vec::with_capacity(POINTS), 0.0, 0.5 * piece);
    for (number, &area) in areas.iter().enumerate() {
        done += area;
        while next < done && found.len() < POINTS {
            // A sequence that fills the unit square evenly, folded into the triangle.
            let k = found.len() as f64;
            let (mut s, mut t) = ((k * 0.754_877_666_246_692_8).fract(), (k * 0.569_840_290_998_053_3).fract());
            if s + t > 1.0 {
                (s, t) = (1.0 - s, 1.0 - t);
            }
            let [a, b, c] = triangles[number].map(wide);
            found.push(Point { at: plus(a, plus(times(minus(b, a), s), times(minus(c, a), t))), triangle: number });
            next += piece;
        }
    }
    found
}

fn area(triangle: &Triangle) -> f64 {
    let [a, b, c] = triangle.map(wide);
    length(cross(minus(b, a), minus(c, a))) / 2.0
}

/// Directions spread evenly over a sphere, those that follow each other far apart, so that a way out is soon found.
fn directions() -> Vec<Vector> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let at = |k: usize| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / RAYS as f64;
        let (s, c) = (golden * (k as f64 + 0.5)).sin_cos();
        let r = (1.0 - z * z).sqrt();
        [r * c, r * s, z]
    };
    (0..RAYS).map(|k| at(k * 37 % RAYS)).collect()
}

/// One mesh, seen from outside, and what of it is far from the other.
struct Look {
    /// Points that can be seen, in all.
    seen: f64,
    /// Far points that can be seen, with their distances.
    far: Vec<(Point, f64)>,
}

fn look(mesh: &[Triangle], other: &[Triangle], diagonal: f64) -> Look {
    let (own, there, rays) = (Near::new(mesh), Near::new(other), directions());
    let can_be_seen = |p: Vector| {
        let mut free = 0;
        rays.iter().any(|&to| {
            free += usize::from(!own.is_met(p, to, 1e-5 * diagonal));
            free >= ESCAPE
        })
    };
    let (mut seen, mut looked, mut far, all) = (0, 0, Vec::new(), points(mesh));
    let count = all.len() as f64;
    // What stands in both is nowhere far away.
    let standing: HashSet<_> = other.iter().map(corners).collect();
    let stands: Vec<bool> = mesh.iter().map(|triangle| standing.contains(&corners(triangle))).collect();
    for (number, point) in all.into_iter().enumerate() {
        let is_probe = number.is_multiple_of(PROBE);
        let distance = if stands[point.triangle] { 0.0 } else { there.distance_above(point.at, FAR * diagonal) };
        let is_far = distance > FAR * diagonal;
        if !is_probe && !is_far {
            continue;
        }
        let visible = can_be_seen(point.at);
        looked += u32::from(is_probe);
        seen += u32::from(is_probe && visible);
        if is_far && visible {
            far.push((point, distance));
        }
    }
    Look { seen: count * f64::from(seen) / f64::from(looked.max(1)), far }
}

/// A triangle by its exact corners, in whatever direction.
fn corners(triangle: &Triangle) -> [[u32; 3]; 3] {
    let mut corners = triangle.map(|p| p.map(|x| (x + 0.0).to_bits()));
    corners.sort_unstable();
    corners
}

/// Judges what became of the skin of `before`.
pub fn skin(before: &[Triangle], after: &[Triangle]) -> Skin {
    let [lo, hi] = bounds(before.as_flattened().iter().map(|p| wide(*p)));
    let diagonal = length(minus(hi, lo));
    if before.is_empty() || diagonal <= 0.0 {
        return Skin::default();
    }
    let lost = look(before, after, diagonal);
    let made = look(after, before, diagonal);
    let patches = Patches::of(after, &made.far, diagonal);
    let invented = made.far.len() as f64 / made.seen.max(1.0);
    let implausible: Vec<_> = made.far.into_iter().filter(|(point, _)| !patches.is_plausible(point.triangle)).collect();
    let most = |points: &[(Point, f64)]| points.iter().map(|(_, far)| *far).filter(|far| far.is_finite()).fold(0.0, f64::max);
    Skin {
        lost: lost.far.len() as f64 / lost.seen.max(1.0),
        lost_by: most(&lost.far) / diagonal,
        invented,
        implausible: implausible.len() as f64 / made.seen.max(1.0),
        implausible_by: most(&implausible) / diagonal,
        lost_at: places(&lost.far, lost.seen, diagonal),
        implausible_at: places(&implausible, made.seen, diagonal),
    }
}

/// The farthest point, then the farthest that is not near it, and so on; each with the points near it.
fn places(points: &[(Point, f64)], seen: f64, diagonal: f64) -> Vec<Place> {
    let mut left: Vec<_> = points.iter().map(|(point, far)| (point.at, *far)).collect();
    let mut found = Vec::new();
    while found.len() < PLACES {
        let Some(&(at, far)) = left.iter().max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        let count = left.len();
        left.retain(|(other, _)| length(minus(*other, at)) > ONE_PLACE * diagonal);
        found.push(Place { at, far, share: (count - left.len()) as f64 / seen.max(1.0) });
    }
    found
}

/// The triangles of the result that belong to a plausible patch.
struct Patches {
    plausible: HashMap<usize, bool>,
}

impl Patches {
    /// Triangles with a far point hang together over common vertices. Such a set is plausible if all of it is in one plane, which is
    /// then its rim's, or if it is small.
    fn of(triangles: &[Triangle], far: &[(Point, f64)], diagonal: f64) -> Self {
        let mut numbers: Vec<usize> = far.iter().map(|(point, _)| point.triangle).collect();
        numbers.dedup();
        let mut of_vertex: HashMap<[u32; 3], usize> = HashMap::new();
        let mut above: Vec<usize> = (0..numbers.len()).collect();
        for (k, &number) in numbers.iter().enumerate() {
            for p in triangles[number] {
                let other = *of_vertex.entry(p.map(|x| (x + 0.0).to_bits())).or_insert(k);
                let (a, b) = (top(&mut above, k), top(&mut above, other));
                above[a.max(b)] = a.min(b);
            }
        }
        let mut sets: HashMap<usize, Vec<usize>> = HashMap::new();
        for (k, &number) in numbers.iter().enumerate() {
            sets.entry(top(&mut above, k)).or_default().push(number);
        }
        let all: f64 = triangles.iter().map(area).sum();
        let is_plausible = |set: &Vec<usize>| {
            let size: f64 = set.iter().map(|&number| area(&triangles[number])).sum();
            size <= SMALL * all || is_flat(set.iter().map(|&number| triangles[number].map(wide)), FAR * diagonal)
        };
        let plausible = sets.values().flat_map(|set| {
            let word = is_plausible(set);
            set.iter().map(move |&number| (number, word))
        });
        Self { plausible: plausible.collect() }
    }

    fn is_plausible(&self, triangle: usize) -> bool {
        self.plausible.get(&triangle).copied().unwrap_or(false)
    }
}

fn top(above: &mut [usize], mut of: usize) -> usize {
    while above[of] != of {
        above[of] = above[above[of]];
        of = above[of];
    }
    of
}

/// All corners are within `limit` of the plane through their middle that faces as the triangles do together.
fn is_flat(triangles: impl Iterator<Item = [Vector; 3]> + Clone, limit: f64) -> bool {
    let (mut normal, mut middle, mut weight) = ([0.0; 3], [0.0; 3], 0.0);
    for [a, b, c] in triangles.clone() {
        let own = cross(minus(b, a), minus(c, a));
        normal = plus(normal, own);
        middle = plus(middle, times(plus(a, plus(b, c)), length(own) / 3.0));
        weight += length(own);
    }
    // What faces all ways is a body, or a bridge.
    if length(normal) < 0.9 * weight {
        return false;
    }
    let (normal, middle) = (unit(normal), times(middle, 1.0 / weight.max(f64::MIN_POSITIVE)));
    triangles.flatten().all(|p| dot(minus(p, middle), normal).abs() <= limit)
}

#[cfg(test)]
mod tests {
    use super::super::shells::tests::{cuboid, inside_out};
    use super::*;

    #[test]
    fn nothing_was_done() {
        let cube = cuboid([0.0; 3], [10.0; 3]);
        assert_eq!(skin(&cube, &cube), Skin::default());
        assert_eq!(skin(&[], &cube), Skin::default());
    }

    #[test]
    fn a_body_that_is_gone_was_seen_and_a_cavity_was_not() {
        let (cube, other) = (cuboid([0.0; 3], [10.0; 3]), cuboid([12.0, 0.0, 0.0], [17.0, 5.0, 5.0]));
        let cavity = inside_out(cuboid([3.0; 3], [7.0; 3]));
        let before = [cube.clone(), other, cavity].concat();
        let found = skin(&before, &cube);
        // 150 of 750; the side towards the cube is near nothing, too.
        assert!((found.lost - 0.2).abs() < 0.01 && found.invented == 0.0, "{found:?}");
        assert!(found.lost_by > 0.2 && found.lost_at.len() > 1 && found.lost_at[0].at[0] > 16.0, "{found:?}");
    }

    #[test]
    fn a_flat_patch_and_a_small_one_are_plausible_and_a_body_is_not() {
        let cube = cuboid([0.0; 3], [10.0; 3]);
        // Without one side, which was made again.
        let flat = skin(&cube[2..], &cube);
        assert!((flat.invented - 1.0 / 6.0).abs() < 0.02 && flat.implausible == 0.0 && flat.lost == 0.0, "{flat:?}");
        let speck = skin(&cube, &[cube.clone(), cuboid([11.0; 3], [11.5; 3])].concat());
        assert!(speck.invented > 0.001 && speck.implausible == 0.0, "{speck:?}");
        let body = skin(&cube, &[cube.clone(), cuboid([11.0; 3], [13.0; 3])].concat());
        assert!((body.implausible - 24.0 / 624.0).abs() < 0.004 && body.implausible == body.invented, "{body:?}");
        assert!(body.implausible_at.iter().all(|place| place.at.iter().all(|x| *x >= 11.0 && *x <= 13.0)), "{body:?}");
    }
}
