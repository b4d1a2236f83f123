//! Outlines on the flat maps of surfaces.

use std::f64::consts::TAU;

use super::carrier::Carrier;
use super::chart::{Chart, Turned};
use crate::curves::vector::{Point, add, scale};

/// A point of an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rim {
    /// Its number in the mesh.
    pub(super) vertex: u32,
    pub(super) point: Point,
    /// The place of its curve in the loop, and where on that (0 to 1 in the direction of the loop).
    pub(super) part: u32,
    pub(super) share: f64,
}

/// A corner of the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Corner {
    /// On the outline, by its number in the mesh.
    Rim(u32),
    /// Within, by its number among the added points.
    Inner(u32),
}

/// An edge that is to be divided: its ends in the direction of its ring, and how far from the first one, in parts of its length.
pub(super) type Wish = ([Corner; 2], f64);

/// Rings of corners with their places on a chart: the first one anticlockwise, those of holes clockwise.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) chart: Chart,
    pub(super) rings: Vec<Vec<(Corner, [f64; 2])>>,
    /// Points of cuts from one ring to another.
    pub(super) added: Vec<Point>,
    /// Whether the outer ring runs clockwise as it is given, so that the chart was mirrored.
    pub(super) is_mirrored: bool,
}

/// The number of a ring, and of a point in it.
type Place = (usize, usize);

impl Layout {
    /// The longest edge whose middle is no farther than a distance from the surface, and along which that turns no more than an angle. A cone's radius changes:
    /// its narrowest place within the outline decides, but where that is the apex: edges across it are off by three times the distance at most. O(places).
    pub(super) fn longest(&self, chord: f64, angle: f64) -> f64 {
        let Chart::Turned(Turned::Cone(_, half)) = self.chart else { return self.chart.longest(chord, angle) };
        let far = self.rings.iter().flatten().map(|(_, [x, y])| x.hypot(*y)).fold(f64::INFINITY, f64::min);
        (8.0 * chord * (far * half.tan()).max(4.0 * chord)).sqrt()
    }

    /// Divides edges of cuts, which are in rings once in each direction; whether any was. Both sides of a cut get the same point.
    /// O(places · log places + wishes²), where wishes are few.
    pub(super) fn divide(&mut self, wishes: &[Wish]) -> bool {
        if self.added.is_empty() {
            return false;
        }
        let mut known: Vec<([Corner; 2], usize, usize)> = Vec::new();
        for (number, ring) in self.rings.iter().enumerate() {
            let next = ring.iter().cycle().skip(1);
            known.extend(ring.iter().zip(next).enumerate().map(|(at, ((a, _), (b, _)))| ([*a, *b], number, at)));
        }
        known.sort_unstable();
        let find = |ends: [Corner; 2]| {
            let from = known.partition_point(|(other, ..)| *other < ends);
            known.get(from).filter(|(other, ..)| *other == ends).map(|(_, ring, at)| (*ring, *at))
        };
        let mut new: Vec<(Place, (Corner, [f64; 2]))> = Vec::new();
        for (ends, share) in wishes {
            let [a, b] = *ends;
            let (Some(there), Some(back)) = (find([a, b]), find([b, a])) else { continue };
            if new.iter().any(|(at, _)| *at == there) {
                continue;
            }
            let between = |(ring, at): Place, share: f64| {
                let ring = self.rings.get(ring)?;
                let ((_, p), (_, q)) = (ring.get(at)?, ring.get((at + 1) % ring.len())?);
                Some([p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])])
            };
            let (Some(place), Some(other)) = (between(there, *share), between(back, 1.0 - share)) else { continue };
            let corner = Corner::Inner(self.added.len() as u32);
            self.added.push(self.chart.point(place));
            new.extend([(there, (corner, place)), (back, (corner, other))]);
        }
        new.sort_by_key(|(at, _)| std::cmp::Reverse(*at));
        for ((ring, at), entry) in &new {
            if let Some(ring) = self.rings.get_mut(*ring) {
                ring.insert(at + 1, *entry);
            }
        }
        !new.is_empty()
    }
}

/// Twice the area within a ring.
pub(super) fn area(ring: &[(Corner, [f64; 2])]) -> f64 {
    let Some(&(_, [x, y])) = ring.first() else { return 0.0 };
    let pairs = ring.windows(2);
    pairs.map(|pair| if let &[(_, [a, b]), (_, [c, d])] = pair { (a - x) * (d - y) - (b - y) * (c - x) } else { 0.0 }).sum()
}

/// An outline on a carrier; `None` where it is not the boundary of a piece of it that can be laid flat.
pub(super) fn on_carrier(carrier: &Carrier, rings: &[Vec<Rim>], tolerance: f64) -> Option<Layout> {
    match Chart::of(carrier) {
        Chart::Turned(turned) => on_turned(turned, rings, tolerance),
        chart => {
            let place = |rim: &Rim| (Corner::Rim(rim.vertex), chart.flat(rim.point));
            let places: Vec<Vec<_>> = rings.iter().map(|ring| without_spurs(ring).iter().map(place).collect()).collect();
            Some(oriented(chart, places, Vec::new()))
        }
    }
}

/// Outer ring anticlockwise (mirrored, if it is not), the others clockwise (reversed, if they are not).
pub(super) fn oriented(chart: Chart, mut rings: Vec<Vec<(Corner, [f64; 2])>>, added: Vec<Point>) -> Layout {
    let is_mirrored = rings.first().is_some_and(|ring| area(ring) < 0.0);
    let outward = if is_mirrored { -1.0 } else { 1.0 };
    for ring in rings.iter_mut().skip(1) {
        if area(ring) * outward > 0.0 {
            ring.reverse();
        }
    }
    Layout { chart, rings, added, is_mirrored }
}

/// A ring without the points that it passes there and back again at once: seams that end at a pole. O(n).
fn without_spurs(ring: &[Rim]) -> Vec<Rim> {
    let mut kept: Vec<Rim> = Vec::with_capacity(ring.len());
    for rim in ring {
        match kept.len().checked_sub(2).and_then(|at| kept.get(at)) {
            Some(before) if before.vertex == rim.vertex => {
                kept.pop();
            }
            _ => kept.push(*rim),
        }
    }
    let mut first = 0;
    while kept.len() - first > 3 {
        let (Some(start), Some(second), Some(last)) = (kept.get(first), kept.get(first + 1), kept.last()) else { break };
        let before = kept.get(kept.len() - 2);
        if start.vertex == last.vertex {
            kept.pop();
        } else if second.vertex == last.vertex {
            first += 1;
        } else if before.is_some_and(|before| before.vertex == start.vertex) {
            kept.pop();
        } else {
            break;
        }
    }
    kept.split_off(first)
}

/// A ring with angles that count turns, and what they have grown by when it is closed.
type Lifted = (Vec<(Corner, [f64; 2])>, [f64; 2]);

fn on_turned(turned: Turned, rings: &[Vec<Rim>], tolerance: f64) -> Option<Layout> {
    let mut lifted: Vec<Lifted> = rings.iter().map(|ring| lift(&turned, ring, tolerance)).collect();
    let middle = |lifted: &[Lifted]| {
        let ring = lifted.first().map_or(&[][..], |(ring, _)| ring);
        let [low, high] =
            ring.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (_, [a, _])| [low.min(*a), high.max(*a)]);
        0.5 * (low + high)
    };
    let is_wound = |shift: &[f64; 2]| shift.iter().any(|x| x.abs() > 1.0);
    let wound: Vec<usize> = (0..lifted.len()).filter(|at| lifted.get(*at).is_some_and(|(_, shift)| is_wound(shift))).collect();
    let mut added = Vec::new();
    match *wound.as_slice() {
        [] => {}
        // Two rings around: one, by a cut between them.
        [0, other] => {
            let inner = lifted.remove(other);
            let outer = lifted.first_mut()?;
            cut(&turned, outer, inner, &mut added)?;
        }
        _ => return None,
    }
    let angle = middle(&lifted);
    let turned = centred(turned, angle);
    let offset = if matches!(turned, Turned::Cone(..)) { angle } else { 0.0 };
    let flat = |(corner, [around, other]): &(Corner, [f64; 2])| (*corner, turned.flat([around - offset, *other]));
    let places: Vec<Vec<_>> = lifted.iter().map(|(ring, _)| ring.iter().map(flat).collect()).collect();
    Some(oriented(Chart::Turned(turned), places, added))
}

/// A cone with its x-axis turned by an angle.
fn centred(turned: Turned, angle: f64) -> Turned {
    let Turned::Cone(mut frame, half) = turned else { return turned };
    let ([x, y, z], (sin, cos)) = (frame.axes, angle.sin_cos());
    frame.axes = [add(scale(x, cos), scale(y, sin)), add(scale(y, cos), scale(x, -sin)), z];
    Turned::Cone(frame, half)
}

/// Coordinates of a ring, each angle the nearest to the one before. Points at the apex have the angle of the one before, and a
/// ring begins behind them, where the angle may jump.
fn lift(turned: &Turned, ring: &[Rim], tolerance: f64) -> Lifted {
    let apex = ring.iter().rposition(|rim| turned.is_apex(rim.point, tolerance));
    let start = apex.map_or(0, |at| at + 1);
    let mut places: Vec<(Corner, [f64; 2])> = Vec::with_capacity(ring.len());
    let mut last: Option<[f64; 2]> = None;
    let near = |angle: f64, last: f64| angle + TAU * ((last - angle) / TAU).round();
    let mut follow = |rim: &Rim| {
        let [mut around, mut other] = turned.coordinates(rim.point);
        if let Some([a, b]) = last {
            around = if turned.is_apex(rim.point, tolerance) { a } else { near(around, a) };
            other = if turned.is_tube() { near(other, b) } else { other };
        }
        last = Some([around, other]);
        [around, other]
    };
    for rim in ring.iter().cycle().skip(start).take(ring.len()) {
        places.push((Corner::Rim(rim.vertex), follow(rim)));
    }
    let mut shift = [0.0; 2];
    if let (Some(rim), Some((_, [a, b])), None) = (ring.first(), places.first().copied(), apex) {
        let [c, d] = follow(rim);
        shift = [c - a, if turned.is_tube() { d - b } else { 0.0 }];
    }
    (places, shift)
}

/// Joins two rings that go around in opposite directions (if they do not, one is reversed) by a cut from the beginning of the
/// first one to the nearest point of the other one, which both sides of the cut share.
fn cut(turned: &Turned, outer: &mut Lifted, inner: Lifted, added: &mut Vec<Point>) -> Option<()> {
    let (ring, shift) = outer;
    let (mut other, mut back) = inner;
    if shift[0] * back[0] + shift[1] * back[1] > 0.0 {
        other.reverse();
        back = back.map(|x| -x);
        // Reversed, a ring begins with what was its last point; angles go on from there by themselves.
    }
    if (shift[0] + back[0]).abs() > 1e-6 || (shift[1] + back[1]).abs() > 1e-6 {
        return None;
    }
    let &(first, from) = ring.first()?;
    let gap = |place: [f64; 2]| {
        let turn = |a: f64, b: f64| (a - b) - TAU * ((a - b) / TAU).round();
        let rest = if turned.is_tube() { turn(from[1], place[1]) } else { 0.0 };
        turn(from[0], place[0]).hypot(rest)
    };
    let at = (0..other.len()).min_by(|a, b| gap(other[*a].1).total_cmp(&gap(other[*b].1)))?;
    // Points before the nearest one come behind the last, a turn farther.
    let mut tail: Vec<(Corner, [f64; 2])> = other.drain(..at).collect();
    tail.iter_mut().for_each(|(_, place)| *place = [place[0] + back[0], place[1] + back[1]]);
    other.extend(tail);
    let &(target, to) = other.first()?;
    let turn = |a: f64, b: f64| TAU * ((a - b) / TAU).round();
    let lag = [turn(from[0], to[0]), if turned.is_tube() { turn(from[1], to[1]) } else { 0.0 }];
    let moved = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a + c, b + d];
    let to = moved(to, lag);
    let steps = steps(turned, ring, [from, to]);
    let between: Vec<(Corner, [f64; 2])> = (1..steps)
        .map(|step| {
            let share = f64::from(step) / f64::from(steps);
            let place = [from[0] + (to[0] - from[0]) * share, from[1] + (to[1] - from[1]) * share];
            added.push(Chart::Turned(*turned).point(turned.flat(place)));
            (Corner::Inner(added.len() as u32 - 1), place)
        })
        .collect();
    let shift = *shift;
    ring.push((first, moved(from, shift)));
    ring.extend(between.iter().map(|(corner, place)| (*corner, moved(*place, shift))));
    ring.extend(other.iter().map(|(corner, place)| (*corner, moved(moved(*place, lag), shift))));
    ring.push((target, moved(moved(to, shift), back)));
    ring.extend(between.iter().rev());
    outer.1 = [0.0; 2];
    Some(())
}

/// Edges of a cut: about as long as those of the ring.
fn steps(turned: &Turned, ring: &[(Corner, [f64; 2])], [from, to]: [[f64; 2]; 2]) -> u32 {
    let length = |a: [f64; 2], b: [f64; 2]| {
        let ([x, y], [u, v]) = (turned.flat(a), turned.flat(b));
        (x - u).hypot(y - v)
    };
    let whole: f64 = ring.windows(2).map(|pair| length(pair[0].1, pair[1].1)).sum();
    let edge = whole / ring.len().saturating_sub(1).max(1) as f64;
    (length(from, to) / edge).round().clamp(1.0, 1000.0) as u32
}
