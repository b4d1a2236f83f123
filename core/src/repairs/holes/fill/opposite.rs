//! Holes of one outline that lie opposite each other, and were closed each for itself.
//!
//! Where the walls of a bore are lost, a block with two holes is left: plugged, it is another part. Where a pin or a standoff between two faces is lost,
//! each face has a hole: capped, what was one body is two. The same files come of a block, or of two plates, that lost pieces of their skin. So both ways
//! are guesses, and the larger they are, the more there is to ask. Two mouths of one body that face each other, in which walls end, may be the ends of a
//! piece that is missing in between.

use glam::DVec3;

use super::closing::Closing;
use super::rims::{DRILLED, END, GOES_ON, HOLE, axis, goes_on, is_round, lies_on, middle_of_length};
use crate::detect::holes::loops::Loop;
use crate::repairs::holes::patches::Placed;
use crate::submesh::Submesh;
use crate::submesh::components::Components;
use crate::topology::survey::Survey;
use crate::util::words::{At, Counted};

/// The largest holes are looked at, so many of them.
const MOST_HOLES: usize = 256;
/// And have so many edges at least: a triangle of a grid that is lost lies opposite to many others.
const LEAST_EDGES: usize = 4;
/// Cosine between a hole's axis and the way to the opposite one.
const ALONG: f64 = 0.97;
/// Outlines of one shape differ in length by less than this factor.
const AS_LONG: f64 = 1.1;
/// Cosine of the angle by which mouths that face each other lean, on average, at least; the rim of one may be ragged, which turns its axis.
const FACING: f64 = 0.5;
/// Areas of mouths that face each other differ by a factor below this one.
const AS_LARGE: f64 = 3.0;

/// Where a hole opens.
pub(super) struct Mouth {
    pub(super) middle: DVec3,
    /// The directed area of a cap, out of the body.
    pub(super) axis: DVec3,
    pub(super) perimeter: f64,
}

/// The volume between two mouths of one body that face each other; 0 if they do not.
pub(super) fn between(a: &Mouth, b: &Mouth) -> f64 {
    let way = b.middle - a.middle;
    let (along, [one, other]) = (way.normalize_or_zero(), [a.axis.length(), b.axis.length()]);
    let facing = [a.axis.dot(along) / one, -b.axis.dot(along) / other];
    let is_facing = facing[0].min(facing[1]) > 0.0 && facing[0] + facing[1] > 2.0 * FACING;
    let are_alike = one < AS_LARGE * other && other < AS_LARGE * one;
    let is_near = way.length() < a.perimeter.max(b.perimeter);
    if is_facing && are_alike && is_near { 0.5 * (one + other) * way.length() } else { 0.0 }
}

/// A hole that was closed for itself.
pub(super) struct Hole<'a> {
    pub(super) rim: &'a Loop,
    pub(super) patch: &'a Placed,
    /// The first of the patch's triangles that are left.
    pub(super) first: u32,
    pub(super) mouth: Mouth,
    /// How much the surface goes on across it: 1 in a plane, 0 where walls end.
    pub(super) goes_on: f64,
    /// Its body, by number, and the size of its volume.
    pub(super) body: u32,
    pub(super) volume: f64,
}

/// The holes of these bodies that were closed by a patch each, which is in. O(patches and their rims).
pub(super) fn holes<'a>(closing: &'a Closing<'_>, survey: &Survey<'_>, submesh: &Submesh, bodies: &Components) -> Vec<Hole<'a>> {
    let hole = |patch: &'a Placed| {
        let [rim] = patch.rims.as_slice() else { return None };
        let (rim, first) = (closing.rim(*rim), patch.living(submesh).next()?);
        let body = bodies.of_triangle[first as usize];
        let mouth = Mouth { middle: middle_of_length(submesh, rim), axis: axis(submesh, rim), perimeter: rim.perimeter(submesh) };
        let volume = survey.measure.volume(bodies.list[body as usize].extent).abs();
        Some(Hole { rim, patch, first, mouth, goes_on: goes_on(submesh, rim), body, volume })
    };
    closing.placed.iter().filter(|patch| patch.is_in()).filter_map(hole).collect()
}

/// A line on the holes opposite each other, if what lies between them is more than a small share of their body. O(holes² + outlines).
pub(super) fn doubt(submesh: &Submesh, holes: &[Hole<'_>]) -> Option<String> {
    let mut holes: Vec<&Hole<'_>> = holes.iter().filter(|hole| hole.rim.vertices.len() >= LEAST_EDGES).collect();
    holes.sort_by(|a, b| b.mouth.axis.length().total_cmp(&a.mouth.axis.length()));
    holes.truncate(MOST_HOLES);
    let mut pairs: Vec<(f64, [usize; 2])> = Vec::new();
    for (i, a) in holes.iter().enumerate() {
        let opposite = (i + 1..holes.len()).filter(|j| are_opposite(submesh, a, holes[*j]));
        pairs.extend(opposite.map(|j| (a.mouth.middle.distance(holes[j].mouth.middle), [i, j])));
    }
    // The nearest first, each hole once.
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut is_taken = vec![false; holes.len()];
    let (mut share, mut first, mut count) = (0.0, None, 0);
    for (apart, pair) in pairs {
        if pair.iter().any(|i| is_taken[*i]) {
            continue;
        }
        pair.iter().for_each(|i| is_taken[*i] = true);
        let [a, b] = pair.map(|i| holes[i]);
        share += a.mouth.axis.length().min(b.mouth.axis.length()) * apart / a.volume.min(b.volume);
        first.get_or_insert([a, b].map(|hole| submesh.points(hole.first)[0]));
        count += 1;
    }
    let [a, b] = first.filter(|_| share > GOES_ON)?;
    let pairs = Counted(count, "pair", "pairs");
    Some(format!(
        "{pairs} of holes that lie opposite each other were closed one by one: {:.1} % of the body lies between them, a way through or a pin that \
         may have lost its walls, as between {} and {}",
        share * 100.0,
        At(a),
        At(b)
    ))
}

/// Does one of two holes lie in flat surface, and the other one, of the same outline or both of them round, on its axis?
fn are_opposite(submesh: &Submesh, a: &Hole<'_>, b: &Hole<'_>) -> bool {
    let (one, other) = (&a.mouth, &b.mouth);
    let way = other.middle - one.middle;
    let along = way.normalize_or_zero();
    let is_along = |mouth: &Mouth| mouth.axis.dot(along).abs() > ALONG * mouth.axis.length();
    if a.goes_on.max(b.goes_on) < HOLE || a.goes_on.min(b.goes_on) < -END || !is_along(one) || !is_along(other) {
        return false;
    }
    let radius = (one.axis.length().min(other.axis.length()) / std::f64::consts::PI).sqrt();
    let is_coaxial = way.reject_from_normalized(one.axis.normalize_or_zero()).length() < DRILLED * radius;
    let are_alike = one.perimeter < AS_LONG * other.perimeter && other.perimeter < AS_LONG * one.perimeter;
    is_coaxial && (is_round(submesh, a.rim) && is_round(submesh, b.rim) || are_alike && lies_on(submesh, [a.rim, b.rim]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::settings::Profile;
    use crate::repairs::holes::fill::fill;
    use crate::testing::{Corners, after, plate, reversed, shifted};

    /// A square hole of 2 by 2 in the middle of a plate of 8 by 8.
    fn is_whole(x: u8, y: u8) -> bool {
        !(3..5).contains(&x) || !(3..5).contains(&y)
    }

    /// A block with these two ends of 8 by 8, from z = 0, and walls of unit width.
    fn block(lower: &[Corners], upper: &[Corners], high: f32) -> Vec<Corners> {
        let corners = [[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]];
        let mut all = [reversed(lower), shifted(upper, [0.0, 0.0, high])].concat();
        for k in 0..4 {
            let (from, to): ([f32; 2], [f32; 2]) = (corners[k], corners[(k + 1) % 4]);
            let at = |i: f32, z: f32| [from[0] + (to[0] - from[0]) * i / 8.0, from[1] + (to[1] - from[1]) * i / 8.0, z];
            for i in (0..8).map(|i| i as f32) {
                let [a, b, c, d] = [at(i, 0.0), at(i + 1.0, 0.0), at(i + 1.0, high), at(i, high)];
                all.extend([[a, b, c], [a, c, d]]);
            }
        }
        all
    }

    /// Loops that were closed, and how often opposite holes were told.
    fn told(mesh: &[Corners]) -> (u64, usize) {
        let closed = after(mesh, |d, _| fill(d, &Profile::default())).result;
        let is_of_these = |doubt: &&String| doubt.contains("opposite each other");
        (closed.loops, closed.judged.doubts.iter().filter(is_of_these).count())
    }

    #[test]
    fn a_bore_without_walls_is_told() {
        let (whole, holed) = (plate(8, |_, _| true), plate(8, is_whole));
        assert_eq!(told(&block(&holed, &holed, 6.0)), (2, 1));
        assert_eq!(told(&block(&holed, &whole, 6.0)), (1, 0), "one hole");
        let beside = plate(8, |x, y| is_whole(x + 1, y));
        assert_eq!(told(&block(&holed, &beside, 6.0)), (2, 0), "not on the same axis");
        let smaller = plate(8, |x, y| x != 3 || y != 3);
        assert_eq!(told(&block(&smaller, &holed, 6.0)), (2, 0), "not of one outline");
    }

    #[test]
    fn a_pin_without_walls_is_told() {
        let (whole, holed) = (plate(8, |_, _| true), plate(8, is_whole));
        let far = shifted(&block(&holed, &whole, 2.0), [0.0, 0.0, 8.0]);
        assert_eq!(told(&[block(&whole, &holed, 2.0), far].concat()), (2, 1));
    }

    #[test]
    fn lost_triangles_are_none() {
        let mut one_lost = plate(8, |_, _| true);
        one_lost.remove(30);
        assert_eq!(told(&block(&one_lost, &one_lost, 6.0)), (2, 0));
    }

    #[test]
    fn mouths_that_face_each_other_enclose_what_may_be_missing() {
        let mouth = |x: f64, way: f64| Mouth { middle: DVec3::X * x, axis: DVec3::X * way, perimeter: 4.0 };
        assert!((between(&mouth(0.0, 1.0), &mouth(2.0, -1.0)) - 2.0).abs() < 1e-12);
        assert_eq!(between(&mouth(0.0, -1.0), &mouth(2.0, 1.0)), 0.0, "ends of a tube");
        assert_eq!(between(&mouth(0.0, 1.0), &mouth(5.0, -1.0)), 0.0, "too far");
        assert_eq!(between(&mouth(0.0, 1.0), &mouth(2.0, -4.0)), 0.0, "of another size");
    }
}
