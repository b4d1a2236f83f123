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
            let pair = cross(surface, (now.face, k), a.place, b.place);
            let cost = [now.cost[0].max(pair.off), pair.place.distance_squared(b.place)];
            let room = reached.len() < MOST;
            match reached.iter_mut().find(|r| r.face == face) {
                Some(known) if known.cost[0] > cost[0] && !known.is_done => {
                    (known.before, known.corner, known.cost) = (at, k, cost);
                }
                Some(_) => {}
                None if room => {
                    reached.push(Reached { face, before: at, corner: k, cost, is_done: false });
                }
                None => {}
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
