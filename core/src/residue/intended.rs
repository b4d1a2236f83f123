//! The intended surface at a point: what the tool would leave if there were passes between its passes.
//!
//! The plane through the point at right angles to its pass shows the neighbouring passes as places of the tool's centre. A curve through
//! them, from two parabolas that blend, stands for the passes in between; the tool swept along it touches the intended surface,
//! which goes through the contact points of all passes. For a ball of radius r and straight passes a step s apart this is the plane below
//! scallops of height r − √(r² − s²/4) (B. K. Choi, R. B. Jerard, *Sculptured Surface Machining*, 1998, section 3.4). For a flat
//! tool whose passes are v apart along the axis and w across, the steps are v·w/√(v² + w²) high.

use super::cuts::Family;
use super::sweep::{Crossing, Touch, section, silhouette, silhouette_depth};
use crate::curves::vector::{Point, add, cross, dot, plain_norm, plain_unit, scale, sub};

/// Radii of the tool between neighbouring passes, at most.
const STEP_MOST: f64 = 1.4;
/// Radii between passes, at least: nearer ones repeat each other.
const STEP_LEAST: f64 = 0.003;
/// Radii around a place within which the path's direction is taken.
const WINDOW: f64 = 0.1;
/// Radii before a pass's end that count as its border.
const BORDER: f64 = 0.01;
/// Beyond the end of a pass, in radii, or as the slope of what the tool leaves along its path.
const SKEW: f64 = 0.02;
/// A path that climbs less than this part of its length is level.
const LEVEL: f64 = 0.02;
/// A part of the way to the next pass that counts as the contact line itself.
const CONTACT: f64 = 0.02;
/// Cosine of the angle between steps from pass to pass above which they are one surface.
const SMOOTH: f64 = 0.77;
/// Cosine of the angle between the steps on both sides of a pair below which a feature lies between the pair.
const FEATURE: f64 = 0.4;

/// A vertex beside the intended surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Verdict {
    /// Whether it lies on the border of what the passes intend.
    pub(crate) is_border: bool,
    /// The nearest point of the intended surface.
    pub(crate) target: Point,
    /// Height above the intended surface.
    pub(crate) height: f64,
    /// Distance of the neighbouring passes.
    pub(crate) step: f64,
    /// The part of the step that goes along the axis.
    pub(crate) rise: f64,
}

/// Bounds of the search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    pub(crate) tolerance: f64,
    pub(crate) height_max: f64,
}

/// Lists that are lent from vertex to vertex.
#[derive(Default)]
pub(crate) struct Scratch {
    pub(crate) stack: Vec<(f64, u32, u32)>,
    crossings: Vec<Crossing>,
}

/// The view along a pass: tool, axis, course.
struct View<'a> {
    family: &'a Family,
    axis: Point,
    course: Point,
    crossings: &'a [Crossing],
}

impl View<'_> {
    fn distance(&self, from_centre: Point) -> (f64, Point) {
        silhouette(&self.family.profile, self.axis, self.course, from_centre)
    }

    fn depth(&self, from_centre: Point) -> f64 {
        silhouette_depth(&self.family.profile, self.axis, self.course, from_centre)
    }

    /// Whether what a pass leaves is cut away by others: its contact with the intended surface, about whose normal `down` is, lies in
    /// their volume.
    fn is_hidden(&self, place: Point, down: Point) -> bool {
        let side = cross(self.course, down);
        let slack = 2e-4 * self.family.profile.radius;
        [0.0f64, 0.17, -0.17, 0.34, -0.34].iter().all(|angle| {
            let normal = add(scale(down, angle.cos()), scale(side, angle.sin()));
            let contact = add(place, self.family.profile.support(normal, self.axis));
            let is_cut = |other: &Crossing| other.place != place && self.depth(sub(contact, other.place)) < -slack;
            self.crossings.iter().any(is_cut)
        })
    }

    /// The nearest pass beyond `place` in a direction, or on that side of it, which others do not hide.
    fn next(&self, place: Point, ahead: Point, cosine: f64, down: Point) -> Option<Point> {
        let radius = self.family.profile.radius;
        let mut few: Vec<(f64, Point)> = Vec::new();
        for crossing in self.crossings {
            let step = sub(crossing.place, place);
            let length = plain_norm(step);
            if length > STEP_LEAST * radius && length < step_most(self.family) && dot(step, ahead) > cosine * length {
                few.push((length, crossing.place));
            }
        }
        few.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1[0].total_cmp(&b.1[0])).then(a.1[1].total_cmp(&b.1[1])));
        few.into_iter().map(|(_, next)| next).find(|next| {
            let step = sub(*next, place);
            let across = cross(step, self.course);
            let normal = if dot(across, down) < 0.0 { scale(across, -1.0) } else { across };
            plain_unit(normal).is_some_and(|normal| !self.is_hidden(*next, normal))
        })
    }
}

/// Distance of neighbouring passes, at most: flat parts of the tool may leave as much between its round ones.
fn step_most(family: &Family) -> f64 {
    let profile = &family.profile;
    (STEP_MOST * profile.radius).max(2.0 * profile.flat() + STEP_MOST * profile.round)
}

/// Judges a point that a pass touches; `None` where no surface is intended beside the cut one.
pub(crate) fn judge(family: &Family, point: Point, touch: Touch, limits: Limits, lent: &mut Scratch) -> Option<Verdict> {
    let radius = family.profile.radius;
    let (course, [behind, ahead]) = family.direction(touch.piece, touch.at, WINDOW * radius)?;
    let segment = family.segment(touch.piece)?;
    let axis = segment.axis;
    // A plunge is no pass.
    if dot(course, axis).abs() > 0.95 {
        return None;
    }
    let tip = add(segment.from, scale(segment.way(), touch.at));
    let gradient = family.profile.distance(sub(point, tip), axis).1;
    let border = BORDER * radius;
    let tip_on_axis = add(tip, scale(axis, family.profile.centre()));
    // A level tool lies beside the points that it touches; where it climbs, the slope of its surface along the path tells the same.
    let is_level = dot(course, axis).abs() < LEVEL;
    let skew = if is_level { dot(sub(point, tip_on_axis), course) / radius } else { dot(gradient, course) };
    if (ahead < border && skew > SKEW) || (behind < border && skew < -SKEW) {
        return None;
    }
    // At its ends the plane lies a little within the pass, so that passes that end there too are seen.
    let inwards = if behind < border {
        border
    } else if ahead < border {
        -border
    } else {
        0.0
    };
    let centre = add(tip_on_axis, scale(course, inwards));
    let from_centre = sub(point, centre);
    let mut from_centre = sub(from_centre, scale(course, dot(from_centre, course)));
    let flat = family.profile.flat();
    let reaches =
        if flat > 0.0 { [radius + 2.0 * step_most(family); 3] } else { [0.4, 1.2, 2.0 * STEP_MOST].map(|part| part * radius) };
    for (try_, reach) in reaches.into_iter().enumerate() {
        section(family, centre, course, reach, &mut lent.stack, &mut lent.crossings);
        if flat > 0.0 {
            from_centre = recentre(family, from_centre, (axis, course), &mut lent.crossings);
        }
        let view = View { family, axis, course, crossings: &lent.crossings };
        let neighbours = Neighbours::find(&view, from_centre)?;
        if neighbours.is_complete() || try_ == 2 || flat > 0.0 {
            let is_end = behind.min(ahead) < border;
            return neighbours.verdict(&view, point, from_centre, is_end, limits);
        }
    }
    None
}

/// Of passes that touch a point equally, takes the one whose edge is nearest, and makes it the origin.
fn recentre(family: &Family, from_centre: Point, (axis, course): (Point, Point), crossings: &mut [Crossing]) -> Point {
    let slack = 1e-6 * family.profile.radius;
    let mut best: Option<(f64, f64, Point)> = None;
    for crossing in crossings.iter() {
        let away = sub(from_centre, crossing.place);
        let distance = silhouette_depth(&family.profile, axis, course, away);
        let far = plain_norm(sub(away, scale(axis, dot(away, axis))));
        let is_better = best.is_none_or(|(least, edge, _)| {
            distance < least - slack || (distance < least + slack && far > edge + slack && far < family.profile.radius + slack)
        });
        if is_better {
            best = Some((distance, far, crossing.place));
        }
    }
    let Some((.., origin)) = best else { return from_centre };
    crossings.iter_mut().for_each(|crossing| crossing.place = sub(crossing.place, origin));
    sub(from_centre, origin)
}

/// Passes on both sides of the point's own, and the ones beyond.
struct Neighbours {
    distance: f64,
    gradient: Point,
    near: [Option<Point>; 2],
    /// The pass beyond each of them.
    far: [Option<Point>; 2],
}

impl Neighbours {
    fn find(view: &View<'_>, from_centre: Point) -> Option<Self> {
        let (distance, gradient) = view.distance(from_centre);
        let side = plain_unit(cross(view.course, gradient))?;
        let near = [side, scale(side, -1.0)].map(|ahead| view.next([0.0; 3], ahead, 1e-3, gradient));
        let far = near.map(|next| next.and_then(|next| view.next(next, plain_unit(next)?, SMOOTH, gradient)));
        Some(Self { distance, gradient, near, far })
    }

    fn is_complete(&self) -> bool {
        self.far.iter().all(Option::is_some)
    }

    /// The side of the point: 0 or 1, by the direction in which the passes go on.
    fn side(&self, from_centre: Point) -> Option<usize> {
        let tangent = match (self.near, self.far) {
            ([Some(a), Some(b)], _) => {
                let (long, short) = (plain_norm(a), plain_norm(b));
                // The slope of the parabola through three places, over the length of their chords.
                sub(scale(a, short / long), scale(b, long / short))
            }
            ([Some(a), None], [far, _]) => outset(a, far),
            ([None, Some(b)], [_, far]) => scale(outset(b, far), -1.0),
            ([None, None], _) => return None,
        };
        // Under a flat part of the tool the gradient tells nothing; the place does.
        let slope = dot(self.gradient, tangent);
        let slope = if slope.abs() < 1e-9 * plain_norm(tangent) { dot(from_centre, tangent) } else { slope };
        Some(usize::from(slope < 0.0))
    }

    fn verdict(&self, view: &View<'_>, point: Point, from_centre: Point, is_end: bool, limits: Limits) -> Option<Verdict> {
        let side = self.side(from_centre)?;
        let (side, is_last) = match self.near[side] {
            Some(_) => (side, self.near[1 - side].is_none()),
            None => (1 - side, true),
        };
        let step = self.near.get(side).copied().flatten()?;
        let curve = Curve::new(step, self.near[1 - side], self.far[side])?;
        let (at, own, normal) = curve.foot(view, from_centre, self.gradient)?;
        let length = plain_norm(step);
        let radius = view.family.profile.radius;
        let is_contact = at < CONTACT;
        if !(-CONTACT..=1.0 + CONTACT).contains(&at) {
            return None;
        }
        // A flat part of the tool covers the way to the next pass: nothing is left here, but perhaps beside it.
        let beside = view.depth(sub(from_centre, curve.point(CONTACT)));
        if view.family.profile.flat() > 0.0
            && (beside - self.distance).abs() < 1e-6 * radius
            && self.distance.abs() <= limits.tolerance
        {
            return Some(Verdict { is_border: true, target: point, height: 0.0, step: length, rise: 0.0 });
        }
        let most = height_most(&view.family.profile, step, view.axis) + plain_norm(sub(curve.point(0.5), scale(step, 0.5)));
        let is_high = own > 1.2 * most.min(limits.height_max) + limits.tolerance || own < -limits.tolerance;
        if is_high || self.distance.abs() > limits.tolerance + 0.5 * most {
            return None;
        }
        let height = curve.flatter(normal).and_then(|flatter| flatter.foot(view, from_centre, self.gradient));
        let height = height.map_or(own, |(_, height, _)| own.min(height.max(0.0)));
        let rise = (dot(step, view.axis) / length).abs();
        let is_border = is_end || (is_contact && is_last);
        Some(Verdict { is_border, target: add(point, scale(normal, height)), height, step: length, rise })
    }
}

/// The direction in which the passes leave the own one, by the next and the one beyond.
fn outset(next: Point, far: Option<Point>) -> Point {
    let Some(far) = far else { return next };
    let beyond = sub(far, next);
    let ratio = plain_norm(next) / plain_norm(beyond);
    // Slope at the first of three places of the parabola through them.
    sub(next, scale(sub(scale(beyond, ratio), next), 1.0 / (1.0 + 1.0 / ratio)))
}

/// Height of what two passes leave, at most: steps of a sharp corner, and the scallop of a round one.
fn height_most(profile: &super::profile::Profile, step: Point, axis: Point) -> f64 {
    let length = plain_norm(step);
    let along = dot(step, axis).abs();
    let across = (length * length - along * along).max(0.0).sqrt();
    let half = (0.5 * length).min(profile.round);
    let scallop = profile.round - (profile.round * profile.round - half * half).sqrt();
    if profile.is_ball() { scallop } else { scallop + along * across / length }
}

/// The passes between two passes: the first at the origin, where the parameter is 0, the second where it is 1.
struct Curve {
    step: Point,
    /// Bends at both ends; the curve is `t·step + t·(t − 1)·bend`.
    bends: [Point; 2],
    /// For each bend, how far it is believed where it leads into the part, between 0 and 1.
    trusts: [f64; 2],
}

impl Curve {
    /// `None` if a feature lies between the two.
    fn new(step: Point, before: Option<Point>, behind: Option<Point>) -> Option<Self> {
        let length = plain_norm(step);
        let cosine = |a: Point, b: Point| dot(a, b) / (plain_norm(a) * plain_norm(b));
        if let (Some(before), Some(behind)) = (before, behind)
            && cosine(scale(before, -1.0), sub(behind, step)) < FEATURE
        {
            return None;
        }
        // Second divided differences over the lengths of chords.
        let first = before.filter(|before| cosine(*before, step) < -SMOOTH).map(|before| {
            let at = plain_norm(before) / length;
            (scale(add(step, scale(before, 1.0 / at)), 1.0 / (1.0 + at)), trust(at))
        });
        let second = behind.map(|behind| sub(behind, step)).filter(|beyond| cosine(*beyond, step) > SMOOTH).map(|beyond| {
            let at = plain_norm(beyond) / length;
            (scale(sub(scale(beyond, 1.0 / at), step), 1.0 / (1.0 + at)), trust(at))
        });
        let straight = ([0.0; 3], 1.0);
        let [first, second] = [first.or(second).unwrap_or(straight), second.or(first).unwrap_or(straight)];
        Some(Self { step, bends: [first.0, second.0], trusts: [first.1, second.1] })
    }

    /// The curve that goes into the part, in the direction `down`, no farther than its bends are believed; `None` if it does so itself.
    fn flatter(&self, down: Point) -> Option<Self> {
        let mut flatter = Self { trusts: [1.0; 2], ..*self };
        for (bend, trust) in flatter.bends.iter_mut().zip(self.trusts).filter(|(bend, _)| dot(**bend, down) < 0.0) {
            *bend = scale(*bend, trust);
        }
        (flatter.bends != self.bends).then_some(flatter)
    }

    fn point(&self, at: f64) -> Point {
        let bend = add(scale(self.bends[0], 1.0 - at), scale(self.bends[1], at));
        add(scale(self.step, at), scale(bend, at * (at - 1.0)))
    }

    fn slope(&self, at: f64) -> Point {
        let bend = add(scale(self.bends[0], 1.0 - at), scale(self.bends[1], at));
        let change = sub(self.bends[1], self.bends[0]);
        add(add(self.step, scale(bend, 2.0 * at - 1.0)), scale(change, at * (at - 1.0)))
    }

    /// The place whose tool touches the intended surface where a point is nearest to that: its parameter, the point's height above the
    /// surface, which is negative beneath it, and the surface's normal, into the part. `down` is about that normal.
    fn foot(&self, view: &View<'_>, from_centre: Point, down: Point) -> Option<(f64, f64, Point)> {
        // How far the point lies ahead of what the tool touches from a place; the place of the foot is where that changes its sign.
        let look = |at: f64| {
            let slope = self.slope(at);
            let normal = plain_unit(cross(view.course, slope))?;
            let normal = if dot(normal, down) < 0.0 { scale(normal, -1.0) } else { normal };
            let contact = add(self.point(at), view.family.profile.support(normal, view.axis));
            let away = sub(from_centre, contact);
            Some((dot(away, slope), (at, -dot(away, normal), normal)))
        };
        let slack = 1e-9 * dot(self.step, self.step);
        let (mut first, here) = look(0.0)?;
        if first.abs() <= slack {
            return Some(here);
        }
        let far = if first > 0.0 { 1.1 } else { -0.1 };
        let (mut second, there) = look(far)?;
        if (second > 0.0) == (first > 0.0) {
            return Some(there);
        }
        // The Illinois method: M. Dowell, P. Jarratt, *A modified regula falsi method for computing the root of an equation*, BIT 11, 1971.
        let (mut low, mut high, mut found) = (0.0, far, there);
        for _ in 0..STEPS {
            let at = low + (high - low) * first / (first - second);
            let (ahead, foot) = look(at)?;
            found = foot;
            if ahead.abs() <= slack {
                break;
            }
            if (ahead > 0.0) == (second > 0.0) {
                first *= 0.5;
            } else {
                (low, first) = (high, second);
            }
            (high, second) = (at, ahead);
        }
        Some(found)
    }
}

/// How far a bend is believed that was measured beside a step, over a way of this part of its length. A short way tells the slope at one
/// end, and nothing of how it goes on: a parabola through such places leads deeper than all of them.
fn trust(part: f64) -> f64 {
    (2.0 * part - 0.5).clamp(0.0, 1.0)
}

/// Steps of the search for a foot, at most; a handful is usual.
const STEPS: usize = 34;
