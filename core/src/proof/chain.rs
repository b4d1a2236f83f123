//! The image of an edge: a polyline on the surface from spot to spot, of which each piece lies in one face.
//!
//! It depends on the edge alone, so that triangles on both sides of it have the same one, and the map is continuous. Of all ways from face to face, one is
//! taken whose edges are as near as is aimed at to the edge that is mapped, straight on; if there is none, the one whose farthest edge is nearest.

use std::cmp::Ordering;

use glam::DVec3;

use crate::geometry::distance::{nearest_of_segments, share_along};
use crate::proof::surface::{Spot, Surface};

/// A place of the surface that is mapped, its image, and how far that is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub(super) place: DVec3,
    pub(super) spot: Spot,
    pub(super) off: f64,
}

/// Faces looked at, at most.
const MOST: usize = 64;

/// A face on the way.
#[derive(Clone, Copy)]
struct Reached {
    face: u32,
    /// The one before, by its place in the list, and its corner from which the edge between begins.
    before: usize,
    corner: usize,
    /// The farthest edge up to here, or the aim if that is more; then how much of the way is left.
    cost: [f64; 2],
    is_done: bool,
}

/// Lists lent to many calls.
#[derive(Default)]
pub(super) struct Lent {
    ends: Vec<u32>,
    reached: Vec<Reached>,
    path: Vec<usize>,
}

/// Appends what is between two ends; false if no short way was found.
pub(super) fn between(surface: &Surface<'_>, [a, b]: [&Pair; 2], aim: f64, lent: &mut Lent, out: &mut Vec<Pair>) -> bool {
    if surface.common([&a.spot, &b.spot]).is_some() {
        return true;
    }
    if let Some(pair) = over(surface, [a, b], aim) {
        out.push(pair);
        return true;
    }
    if straight(surface, [a, b], aim, lent, out) {
        return true;
    }
    let Some(last) = search(surface, [a, b], aim, lent) else { return false };
    let Lent { reached, path, .. } = lent;
    path.clear();
    let mut step = last;
    while let Some(one) = reached.get(step).filter(|r| r.before != usize::MAX) {
        path.push(step);
        step = one.before;
    }
    let mut from = a.place;
    for step in path.iter().rev() {
        let one = reached[*step];
        let pair = cross(surface, (reached[one.before].face, one.corner), from, b.place);
        from = pair.place;
        out.push(pair);
    }
    true
}

/// The only pair between two ends, where their faces are neighbours, and the edge between them is as near as is aimed at: it nearly always is.
#[inline]
pub(super) fn over(surface: &Surface<'_>, [a, b]: [&Pair; 2], aim: f64) -> Option<Pair> {
    let k = (0..3).find(|k| surface.beyond(a.spot.face, *k) == Some(b.spot.face))?;
    Some(cross(surface, (a.spot.face, k), a.place, b.place)).filter(|pair| pair.off <= aim)
}

/// Appends what is between two ends where the way straight on, from face to face, leads over edges as near as is aimed at; else nothing, and false.
/// Most ways are such, and of each face one edge is looked at, where the search for the best way looks at all.
fn straight(surface: &Surface<'_>, [a, b]: [&Pair; 2], aim: f64, lent: &mut Lent, out: &mut Vec<Pair>) -> bool {
    let start = out.len();
    let ahead = b.place - a.place;
    surface.faces_of(&a.spot, &mut lent.ends);
    let first = lent.ends.iter().find_map(|face| Some((*face, first_exit(surface, (*face, &a.spot), a.place, ahead)?)));
    let (mut next, mut from) = (first, a.place);
    while let Some((face, k)) = next.filter(|_| out.len() - start < MOST) {
        let pair = cross(surface, (face, k), from, b.place);
        let Some(beyond) = surface.beyond(face, k).filter(|_| pair.off <= aim) else { break };
        from = pair.place;
        out.push(pair);
        if surface.within(&b.spot, beyond).is_some() {
            return true;
        }
        next = next_exit(surface, (face, beyond), a.place, ahead);
    }
    out.truncate(start);
    false
}

/// Is a place to the left of a way, as seen from outside of a face?
#[inline]
fn is_left([p, q, r]: &[DVec3; 3], place: DVec3, from: DVec3, ahead: DVec3) -> bool {
    ahead.cross(place - from).dot((*q - *p).cross(*r - *p)) > 0.0
}

/// The corner from which the edge begins over which a way leaves the face that it starts in: its end is to the left, and the corner is not.
fn first_exit(surface: &Surface<'_>, (face, spot): (u32, &Spot), from: DVec3, ahead: DVec3) -> Option<usize> {
    let corners = surface.corners(face);
    let shares = surface.within(spot, face)?;
    let is_left = corners.map(|corner| is_left(&corners, corner, from, ahead));
    (0..3).find(|k| shares[(k + 2) % 3] > 0.0 && !is_left[*k] && is_left[(k + 1) % 3])
}

/// The same for a face that it has come to from another one.
#[inline]
fn next_exit(surface: &Surface<'_>, (before, face): (u32, u32), from: DVec3, ahead: DVec3) -> Option<(u32, usize)> {
    let entry = (0..3).find(|k| surface.beyond(face, *k) == Some(before))?;
    let corners = surface.corners(face);
    let opposite = (entry + 2) % 3;
    let k = if is_left(&corners, corners[opposite], from, ahead) { (entry + 1) % 3 } else { opposite };
    Some((face, k))
}

/// The faces from one end to the other, in `lent`; the place of the last one.
fn search(surface: &Surface<'_>, [a, b]: [&Pair; 2], aim: f64, lent: &mut Lent) -> Option<usize> {
    let Lent { ends, reached, .. } = lent;
    reached.clear();
    surface.faces_of(&a.spot, ends);
    reached.extend(ends.iter().map(|face| Reached {
        face: *face,
        before: usize::MAX,
        corner: 0,
        cost: [aim, f64::INFINITY],
        is_done: false,
    }));
    loop {
        let open = reached.iter().enumerate().filter(|(_, r)| !r.is_done);
        let (at, now) = open.min_by(|x, y| order(&x.1.cost, &y.1.cost).then(x.0.cmp(&y.0))).map(|(at, r)| (at, *r))?;
        if surface.within(&b.spot, now.face).is_some() {
            return Some(at);
        }
        reached[at].is_done = true;
        for k in 0..3 {
            let Some(face) = surface.beyond(now.face, k) else { continue };
            let known = reached.iter().position(|r| r.face == face);
            // No way is better than the one to a face that is done, or over edges that are all near.
            let is_settled = |i: usize| reached[i].is_done || reached[i].cost[0] <= aim;
            if known.map_or(reached.len() >= MOST, is_settled) {
                continue;
            }
            let pair = cross(surface, (now.face, k), a.place, b.place);
            let cost = [now.cost[0].max(pair.off), pair.place.distance_squared(b.place)];
            let way = Reached { face, before: at, corner: k, cost, is_done: false };
            match known {
                Some(i) if reached[i].cost[0] > cost[0] => reached[i] = way,
                Some(_) => {}
                None => reached.push(way),
            }
        }
    }
}

fn order(a: &[f64; 2], b: &[f64; 2]) -> Ordering {
    a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]))
}

/// Where an edge that is mapped, and the edge of a face from corner `k` on, are nearest to each other.
#[inline]
fn cross(surface: &Surface<'_>, (face, k): (u32, usize), from: DVec3, to: DVec3) -> Pair {
    let corners = surface.corners(face);
    let [p, q] = [corners[k], corners[(k + 1) % 3]];
    let (place, t, off) = nearest([from, to], [p, q]);
    let mut shares = [0.0; 3];
    (shares[k], shares[(k + 1) % 3]) = (1.0 - t, t);
    Pair { place, spot: Spot { face, shares }, off }
}

/// The place of the first segment that is nearest to the second, the share of the second where that is, and the distance.
#[inline]
fn nearest([a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> (DVec3, f64, f64) {
    let (u, v, w) = (b - a, d - c, a - c);
    let (uu, uv, vv, uw, vw) = (u.dot(u), u.dot(v), v.dot(v), u.dot(w), v.dot(w));
    let det = uu * vv - uv * uv;
    // Nearly always both are nearest within their ends.
    let scale = det.recip();
    let (s, t) = ((uv * vw - vv * uw) * scale, (uu * vw - uv * uw) * scale);
    if det > 0.0 && s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0 {
        let place = a + u * s;
        return (place, t, place.distance(c * (1.0 - t) + d * t));
    }
    let (place, near) = nearest_of_segments([a, b], [c, d]);
    let t = share_along(near, c, d);
    (place, t, place.distance(c * (1.0 - t) + d * t))
}
