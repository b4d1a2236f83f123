//! Outlines laid flat on surfaces of an equation: rings that run around one are cut open.

use std::f64::consts::TAU;

use super::chart::{Chart, Turned};
use super::layout::{Corner, Layout, Lifted, Rim, oriented, steps, without_spurs};
use super::side;
use crate::curves::elementary::Elementary;
use crate::curves::vector::{Point, add, scale};

/// An outline on a carrier, which is to the left of it as seen from outside, or to its right, or wherever it is smaller; `None` where it is not the boundary of a piece of it that can be laid flat.
pub(super) fn on_carrier(carrier: &Elementary, (rings, is_left): (&[Vec<Rim>], Option<bool>), tolerance: f64) -> Option<Layout> {
    match Chart::of(carrier) {
        Chart::Turned(turned) => on_turned(turned, (rings, is_left), tolerance),
        chart => {
            let place = |rim: &Rim| (Corner::Rim(rim.vertex), chart.flat(rim.point));
            let places: Vec<Vec<_>> = rings.iter().map(|ring| without_spurs(ring).iter().map(place).collect()).collect();
            Some(oriented(chart, places, Vec::new()))
        }
    }
}

fn on_turned(turned: Turned, (rings, is_left): (&[Vec<Rim>], Option<bool>), tolerance: f64) -> Option<Layout> {
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
        [] if turned.is_tube() && side::is_around(&lifted, is_left) => {
            let rings = lifted.into_iter().map(|(ring, _)| ring).collect();
            return side::around(turned, rings);
        }
        [] => {}
        // Two rings around: one, by a cut between them.
        [0, other] => {
            let inner = lifted.remove(other);
            let outer = lifted.first_mut()?;
            cut(&turned, (outer, inner), is_left, &mut added)?;
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

/// Whether a ring runs around the axis, so that it has no flat place alone.
pub(super) fn is_around(turned: &Turned, ring: &[Rim], tolerance: f64) -> bool {
    let (_, shift) = lift(turned, ring, tolerance);
    shift[0].abs() > 1.0
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
fn cut(turned: &Turned, (outer, inner): (&mut Lifted, Lifted), is_left: Option<bool>, added: &mut Vec<Point>) -> Option<()> {
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
    let lag = moved(lag, side::turn_more(turned, *shift, [from, moved(to, lag)], is_left));
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
