//! The volume that a tool sweeps: the cut nearest to a point, and the passes that cross a plane.

use super::cuts::{Family, Segment};
use super::profile::Profile;
use crate::curves::vector::{Point, add, dot, plain_norm, scale, sub};

/// Steps of the search for the least distance, at most; each halves the interval at least every second time.
const STEPS: usize = 40;

/// Pieces of a pass that a flat tool covers at once, at most.
const COVERED: usize = 1 << 12;

/// Where a cut comes nearest to a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    /// Number of the piece in its family.
    pub(crate) piece: u32,
    /// Part of the piece's length.
    pub(crate) at: f64,
    /// Signed distance of the point from the tool there; negative within.
    pub(crate) distance: f64,
}

/// A place where a pass crosses a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// The tool's centre, relative to the plane's point.
    pub(crate) place: Point,
    /// The tool's axis.
    pub(crate) axis: Point,
}

/// The cut nearest to a point, nearer than `most`. `start` is a piece to begin with, which saves time; `other` is a direction
/// from which that of the cut has to differ by more than 45°. O(log n) for n pieces if few come as near.
pub(crate) fn nearest(
    family: &Family,
    point: Point,
    most: f64,
    start: Option<u32>,
    other: Option<Point>,
    stack: &mut Vec<(f64, u32, u32)>,
) -> Option<Touch> {
    let mut best = most;
    let mut touch = None;
    let mut visit = |piece: u32, best: &mut f64| {
        let Some(segment) = family.segment(piece) else { return };
        if other.is_some_and(|other| dot(other, segment.way()).abs() > 0.7 * plain_norm(segment.way())) {
            return;
        }
        if let Some((at, distance)) = least(&family.profile, &segment, point, *best) {
            *best = distance;
            touch = Some(Touch { piece, at, distance });
        }
    };
    if let Some(piece) = start {
        visit(piece, &mut best);
    }
    let profile = &family.profile;
    if family.is_upright {
        let bound = |bounds: &super::tree::Bounds| {
            let [x, y, _] = bounds.away(point);
            profile.bound((x * x + y * y).sqrt(), f64::from(bounds.low[2]) - point[2])
        };
        family.tree.search(&mut best, stack, bound, visit);
    } else {
        let bound = |bounds: &super::tree::Bounds| plain_norm(bounds.away(point)) - profile.radius;
        family.tree.search(&mut best, stack, bound, visit);
    }
    touch.map(|touch| settle(family, touch, point))
}

/// Among places of a pass that are as near, takes the one beside the point: flat tools touch along a part of their way. O(pieces that
/// the tool covers).
fn settle(family: &Family, touch: Touch, point: Point) -> Touch {
    let mut touch = touch;
    let mut course = None;
    for _ in 0..COVERED {
        let Some(segment) = family.segment(touch.piece) else { return touch };
        let way = segment.way();
        let free = dot(sub(point, segment.from), way) / dot(way, way);
        let at = free.clamp(0.0, 1.0);
        let distance = family.profile.depth(sub(point, add(segment.from, scale(way, at))), segment.axis);
        if distance > touch.distance + 1e-9 {
            return touch;
        }
        touch.at = at;
        let step = if free > 1.0 {
            1
        } else if free < 0.0 {
            -1
        } else {
            return touch;
        };
        if course.is_some_and(|course| course != step) || family.profile.flat() == 0.0 {
            return touch;
        }
        course = Some(step);
        let Some(next) = family.next(touch.piece, &segment, step) else { return touch };
        touch.piece = next;
        touch.at = if step > 0 { 0.0 } else { 1.0 };
    }
    touch
}

/// The place of a piece where the tool is nearest to a point, and the signed distance there; `None` if it is not below `most`. The
/// tool is convex: so is the distance over the place.
fn least(profile: &Profile, segment: &Segment, point: Point, most: f64) -> Option<(f64, f64)> {
    let way = segment.way();
    let slope = |at: f64| {
        let (distance, gradient) = profile.distance(sub(point, add(segment.from, scale(way, at))), segment.axis);
        (distance, -dot(gradient, way))
    };
    if profile.is_ball() {
        // Of a sphere, the least distance is where its centre is nearest; that of the shank above it may be elsewhere.
        let from_centre = sub(sub(point, segment.from), scale(segment.axis, profile.centre()));
        let at = (dot(from_centre, way) / dot(way, way)).clamp(0.0, 1.0);
        let away = sub(from_centre, scale(way, at));
        if dot(away, segment.axis) <= 0.0 {
            let distance = plain_norm(away) - profile.radius;
            return (distance < most).then_some((at, distance));
        }
    }
    let (mut low, mut high) = (0.0, 1.0);
    let (first, mut falls) = slope(low);
    if falls >= 0.0 {
        return (first < most).then_some((low, first));
    }
    let (last, mut rises) = slope(high);
    if rises <= 0.0 {
        return (last < most).then_some((high, last));
    }
    // Both tangents lie below the distance; where they meet is the least that it can be.
    if first + falls * (last - first - rises) / (falls - rises) >= most {
        return None;
    }
    let mut best = if first < last { (low, first) } else { (high, last) };
    let mut at = (dot(sub(point, segment.from), way) / dot(way, way)).clamp(0.0, 1.0);
    let scale = plain_norm(way);
    for step in 0..STEPS {
        let (distance, rise) = slope(at);
        if distance < best.1 {
            best = (at, distance);
        }
        if rise.abs() <= 1e-10 * scale {
            break;
        }
        if rise < 0.0 {
            (low, falls) = (at, rise);
        } else {
            (high, rises) = (at, rise);
        }
        if high - low < 1e-12 {
            break;
        }
        // Halving in every second step bounds the number of steps where the slope jumps.
        at = if step % 2 == 0 { low + (high - low) * falls / (falls - rises) } else { 0.5 * (low + high) };
    }
    (best.1 < most).then_some(best)
}

/// Passes that cross the plane through a place of the tool's centre, at right angles to a direction, up to `reach` from the place.
pub(crate) fn section(
    family: &Family,
    origin: Point,
    normal: Point,
    reach: f64,
    stack: &mut Vec<(f64, u32, u32)>,
    crossings: &mut Vec<Crossing>,
) {
    crossings.clear();
    let centre = family.profile.centre();
    // Boxes hold tips: of upright tools, all are the same way below the centres; of others, boxes hold the whole axis.
    let tip = if family.is_upright { sub(origin, [0.0, 0.0, centre]) } else { origin };
    let bound = |bounds: &super::tree::Bounds| {
        let is_near = plain_norm(bounds.away(tip)) <= reach && bounds.meets_plane(tip, normal);
        if is_near { 0.0 } else { 1.0 }
    };
    let visit = |piece: u32, _: &mut f64| {
        let Some(segment) = family.segment(piece) else { return };
        let rise = scale(segment.axis, centre);
        let [from, to] = [segment.from, segment.to].map(|tip| sub(add(tip, rise), origin));
        let (before, behind) = (dot(from, normal), dot(to, normal));
        if (before < 0.0) == (behind < 0.0) {
            return;
        }
        let way = sub(to, from);
        let place = add(from, scale(way, before / (before - behind)));
        if (behind - before).abs() >= 0.5 * plain_norm(way) && dot(place, place) <= reach * reach {
            crossings.push(Crossing { place, axis: segment.axis });
        }
    };
    family.tree.search(&mut 0.5, stack, bound, visit);
}

/// The distance that [`silhouette`] finds.
pub(crate) fn silhouette_depth(profile: &Profile, axis: Point, course: Point, from_centre: Point) -> f64 {
    if is_widest(profile, axis, course, from_centre) {
        return profile.depth(add(from_centre, scale(axis, profile.centre())), axis);
    }
    silhouette(profile, axis, course, from_centre).0
}

/// Whether the tool is nowhere along a line through its centre nearer to a point beside that centre than there.
fn is_widest(profile: &Profile, axis: Point, course: Point, from_centre: Point) -> bool {
    dot(axis, course).abs() < 1e-4 || (profile.is_ball() && dot(from_centre, axis) <= 0.0)
}

/// Signed distance of a point from what a tool sweeps along an endless line through its centre, and its gradient. The point is
/// given from the centre, at right angles to the line.
pub(crate) fn silhouette(profile: &Profile, axis: Point, course: Point, from_centre: Point) -> (f64, Point) {
    let from_tip = add(from_centre, scale(axis, profile.centre()));
    if is_widest(profile, axis, course, from_centre) {
        return profile.distance(from_tip, axis);
    }
    let slope = |at: f64| {
        let (distance, gradient) = profile.distance(add(from_tip, scale(course, at)), axis);
        (distance, gradient, dot(gradient, course))
    };
    let reach = 4.0 * profile.radius + plain_norm(from_centre);
    let (mut low, mut high) = (-reach, reach);
    let mut best = slope(0.0);
    let mut at = 0.0;
    for _ in 0..STEPS {
        let here = slope(at);
        if here.0 < best.0 {
            best = here;
        }
        if here.2.abs() < 1e-9 {
            break;
        }
        if here.2 < 0.0 {
            low = at
        } else {
            high = at
        }
        at = 0.5 * (low + high);
    }
    let gradient = sub(best.1, scale(course, dot(best.1, course)));
    let length = plain_norm(gradient);
    (best.0, if length > 0.0 { scale(gradient, 1.0 / length) } else { best.1 })
}
