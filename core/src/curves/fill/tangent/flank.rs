//! Frames along the sides of a surface, by the normals of what is beside them.

use super::super::space;
use super::super::spline::SplineSurface;
use super::ribbon;
use crate::curves::vector::{Point, add, cross, dot, norm, scale, sub, unit};

/// Vectors shorter than this share of a surface's size are none.
const SHORT: f64 = 1e-9;
/// How far places within a side keep from its joints, where derivatives jump, in spans.
const OFF: f64 = 1e-9;

/// The normal of what is beside a part of a side.
pub(super) struct Known<'a> {
    /// The side: v = 0, u = 1, v = 1 or u = 0, each in the direction of u or v.
    pub(super) side: usize,
    /// The part of it.
    pub(super) span: [f64; 2],
    /// The normal at a place of the side and its point; its sign is of no account, but must not change along the part.
    pub(super) normal: Box<dyn Fn(f64, Point) -> Option<Point> + Sync + 'a>,
}

/// A side of a surface.
pub(super) struct Side<'a> {
    pub(super) surface: &'a SplineSurface,
    pub(super) number: usize,
    size: f64,
}

impl<'a> Side<'a> {
    pub(super) fn new(surface: &'a SplineSurface, number: usize) -> Self {
        let corners: Vec<Point> =
            [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.5, 0.5]].map(|at| surface.jet(at).point).to_vec();
        Self { surface, number, size: space::size(&corners) }
    }

    /// The corner at an end of a side, among (0, 0), (1, 0), (0, 1), (1, 1).
    pub(super) fn corner(number: usize, end: usize) -> usize {
        match number {
            0 => end,
            1 => 1 + 2 * end,
            2 => 2 + end,
            _ => 2 * end,
        }
    }

    pub(super) fn ends(&self) -> [usize; 2] {
        [0, 1].map(|end| Self::corner(self.number, end))
    }

    fn place(&self, s: f64) -> [f64; 2] {
        match self.number {
            0 => [s, 0.0],
            1 => [1.0, s],
            2 => [s, 1.0],
            _ => [0.0, s],
        }
    }

    pub(super) fn point(&self, s: f64) -> Point {
        self.surface.jet(self.place(s)).point
    }

    /// Derivatives along the side, and across it.
    pub(super) fn derivatives(&self, s: f64) -> [Point; 2] {
        let [u, v] = self.surface.jet(self.place(s)).first;
        if self.number.is_multiple_of(2) { [u, v] } else { [v, u] }
    }

    pub(super) fn across(&self, s: f64) -> Point {
        self.derivatives(s)[1]
    }

    /// Whether it is a point.
    pub(super) fn is_point(&self) -> bool {
        [0.0, 0.3, 0.7].into_iter().all(|s| norm(self.derivatives(s)[0]) <= SHORT * self.size)
    }

    /// Knots within it.
    pub(super) fn cuts(&self) -> Vec<f64> {
        let [u, v] = self.surface.knots();
        let mut cuts = if self.number.is_multiple_of(2) { u.clone() } else { v.clone() };
        cuts.dedup();
        cuts
    }
}

/// Places of a part of a side, on its own side of joints.
pub(super) fn inside([low, high]: [f64; 2]) -> impl Fn(f64) -> f64 {
    let off = OFF * (high - low);
    let low = if low > 0.0 { low + off } else { low };
    let high = if high < 1.0 { high - off } else { high };
    move |s: f64| s.clamp(low, high)
}

/// Directions along a side in the tangent plane of what is beside it, across it, and out of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) along: Point,
    pub(super) across: Point,
    pub(super) normal: Point,
}

/// A neighbour whose tangent planes a surface can have.
pub(super) struct Held<'a> {
    /// Its number among those that are known.
    pub(super) number: usize,
    pub(super) side: usize,
    pub(super) span: [f64; 2],
    /// Vectors across the side at both ends.
    pub(super) ends: [Point; 2],
    /// Slopes of these vectors, were they turned evenly from one end to the other.
    pub(super) slopes: [Point; 2],
    normal: &'a (dyn Fn(f64, Point) -> Option<Point> + Sync),
    /// Vectors that are added to normals at both ends.
    turns: [Point; 2],
}

impl<'a> Held<'a> {
    /// `None` where a side at a corner leaves the plane by more than an angle of a cosine.
    pub(super) fn new(sides: &[Side<'a>; 4], known: &'a [Known<'a>], number: usize, smooth: f64) -> Option<Self> {
        let Known { side: at, span, normal } = known.get(number)?;
        let side = sides.get(*at).filter(|side| !side.is_point())?;
        let mut held = Self {
            number,
            side: *at,
            span: *span,
            ends: [[0.0; 3]; 2],
            slopes: [[0.0; 3]; 2],
            normal: &**normal,
            turns: [[0.0; 3]; 2],
        };
        let steepest = (1.0 - smooth * smooth).max(0.0).sqrt();
        let is_near = |s: f64| {
            let along = unit(side.derivatives(inside(*span)(s))[0])?;
            Some(dot(held.given(side, s)?, along).abs() <= steepest)
        };
        if ![span[0], 0.5 * (span[0] + span[1]), span[1]].into_iter().all(|s| is_near(s) == Some(true)) {
            return None;
        }
        for end in [0, 1] {
            if held.is_at_corner(end) {
                let (normal, vector) = held.at_corner(sides, side, end, steepest)?;
                let given = held.given(side, *span.get(end)?)?;
                held.turns[end] = sub(scale(normal, dot(normal, given).signum()), given);
                held.ends[end] = vector;
            }
        }
        Some(held)
    }

    /// Whether an end is one of the side.
    pub(super) fn is_at_corner(&self, end: usize) -> bool {
        self.span.get(end) == Some(&(end as f64))
    }

    fn given(&self, side: &Side<'_>, s: f64) -> Option<Point> {
        unit((self.normal)(s, side.point(s))?)
    }

    /// The normal of the plane of both sides at a corner, and the vector of the other side.
    fn at_corner(&self, sides: &[Side<'_>; 4], side: &Side<'_>, end: usize, steepest: f64) -> Option<(Point, Point)> {
        let s = end as f64;
        let [along, vector] = side.derivatives(s);
        let mut other = vector;
        if norm(other) <= SHORT * side.size {
            // The side that meets this one in a point: the opposite one.
            other = sides.get((side.number + 2) % 4)?.derivatives(s)[0];
        }
        let (along, other) = (unit(along)?, unit(other)?);
        let given = self.given(side, s)?;
        if dot(given, other).abs() > steepest {
            return None;
        }
        let normal = cross(along, other);
        // Of sides that go the same way, the plane is the neighbour's.
        let normal = if norm(normal) > 1e-3 { normal } else { sub(given, scale(along, dot(given, along))) };
        Some((unit(normal)?, if norm(vector) <= SHORT * side.size { [0.0; 3] } else { vector }))
    }

    /// The frame at a place. At corners its plane is that of both sides; what it is turned by there fades up to the middle of the
    /// part.
    pub(super) fn frame(&self, side: &Side<'_>, s: f64) -> Option<Frame> {
        let [low, high] = self.span;
        let x = (s - low) / (high - low);
        // Each end has its half, so that in the middle the plane is the neighbour's.
        let [a, b] = [x, 1.0 - x].map(|x| 1.0 - (2.0 * x).clamp(0.0, 1.0)).map(|y| y * y * (3.0 - 2.0 * y));
        let turn = add(scale(self.turns[0], a), scale(self.turns[1], b));
        let normal = unit(add(self.given(side, s)?, turn))?;
        let [along, _] = side.derivatives(inside(self.span)(s));
        let along = unit(sub(along, scale(normal, dot(along, normal))))?;
        Some(Frame { along, across: cross(normal, along), normal })
    }
}

/// Neighbours that follow each other along a side get one plane and one vector where they meet; those whose planes differ by more
/// than an angle of a cosine there are dropped. Then all get their slopes.
pub(super) fn join(sides: &[Side<'_>; 4], held: &mut Vec<Held<'_>>, smooth: f64) {
    held.sort_by(|a, b| a.side.cmp(&b.side).then(a.span[0].total_cmp(&b.span[0])));
    let mut is_dropped = vec![false; held.len()];
    for at in 0..held.len() {
        for end in [0, 1] {
            if held.get(at).is_some_and(|held| !held.is_at_corner(end)) {
                let is_met = meet(sides, held, (at, end), smooth).is_some();
                is_dropped.iter_mut().skip(at).take(1).for_each(|dropped| *dropped |= !is_met);
            }
        }
        let slopes = held.get(at).and_then(|held| even(sides.get(held.side)?, held));
        match (held.get_mut(at), slopes) {
            (Some(held), Some(slopes)) => held.slopes = slopes,
            _ => is_dropped.iter_mut().skip(at).take(1).for_each(|dropped| *dropped = true),
        }
    }
    let mut number = 0;
    held.retain(|_| {
        number += 1;
        is_dropped.get(number - 1) == Some(&false)
    });
}

/// Sets the plane and the vector of an end within a side.
fn meet(sides: &[Side<'_>; 4], held: &mut [Held<'_>], (at, end): (usize, usize), smooth: f64) -> Option<()> {
    let own = held.get(at)?;
    let side = sides.get(own.side)?;
    let s = *own.span.get(end)?;
    let given = own.given(side, s)?;
    let beside = if end == 0 { at.checked_sub(1) } else { Some(at + 1) };
    let other = beside.and_then(|beside| held.get(beside)).filter(|other| other.side == own.side && other.span[1 - end] == s);
    let other = other.map(|other| other.given(side, s));
    let mut normal = given;
    if let Some(other) = other {
        let other = other?;
        let cosine = dot(given, other);
        if cosine.abs() < smooth {
            return None;
        }
        normal = add(given, scale(other, cosine.signum()));
    }
    // Along both sides of the joint, as the curves may have a corner there.
    let off = OFF * (own.span[1] - own.span[0]);
    let [before, behind] = [s - off, s + off].map(|s| side.derivatives(s));
    let along = unit(add(unit(before[0])?, unit(behind[0])?))?;
    let normal = unit(sub(normal, scale(along, dot(normal, along))))?;
    let vector = scale(add(before[1], behind[1]), 0.5);
    let own = held.get_mut(at)?;
    own.turns[end] = sub(normal, given);
    own.ends[end] = sub(vector, scale(normal, dot(vector, normal)));
    Some(())
}

/// Slopes at both ends of a vector that turns evenly in its frame from one end to the other.
fn even(side: &Side<'_>, held: &Held<'_>) -> Option<[Point; 2]> {
    let parts = parts(held, side)?;
    let vector = |s: f64| {
        let frame = held.frame(side, s)?;
        let x = (s - held.span[0]) / (held.span[1] - held.span[0]);
        let [a, b] = [0, 1].map(|part: usize| parts[0][part] + (parts[1][part] - parts[0][part]) * x);
        Some(add(scale(frame.along, a), scale(frame.across, b)))
    };
    ribbon::slopes(&vector, held.span)
}

/// Vectors at both ends by their frames.
fn parts(held: &Held<'_>, side: &Side<'_>) -> Option<[[f64; 2]; 2]> {
    let part = |end: usize| {
        let frame = held.frame(side, *held.span.get(end)?)?;
        let vector = *held.ends.get(end)?;
        Some([dot(vector, frame.along), dot(vector, frame.across)])
    };
    Some([part(0)?, part(1)?])
}

/// Both parts of the vectors across a side as cubic polynomials.
pub(super) struct Hermite {
    span: [f64; 2],
    values: [[f64; 2]; 2],
    slopes: [[f64; 2]; 2],
}

impl Hermite {
    /// With slopes of the vector at both ends.
    pub(super) fn new(side: &Side<'_>, held: &Held<'_>, slopes: [Point; 2]) -> Option<Self> {
        let values = parts(held, side)?;
        let along = ribbon::slopes(&|s| Some(held.frame(side, s)?.along), held.span)?;
        let across = ribbon::slopes(&|s| Some(held.frame(side, s)?.across), held.span)?;
        let slope = |end: usize| {
            let frame = held.frame(side, *held.span.get(end)?)?;
            let [a, b] = values[end];
            // The vector's own slope, less that of its frame.
            let rest = sub(slopes[end], add(scale(along[end], a), scale(across[end], b)));
            Some([dot(rest, frame.along), dot(rest, frame.across)])
        };
        Some(Self { span: held.span, values, slopes: [slope(0)?, slope(1)?] })
    }

    /// The vector of a place in its frame.
    pub(super) fn vector(&self, frame: &Frame, s: f64) -> Point {
        let width = self.span[1] - self.span[0];
        let x = (s - self.span[0]) / width;
        let y = 1.0 - x;
        let part = |at: usize| {
            let ends = self.values[0][at] * y * y * (1.0 + 2.0 * x) + self.values[1][at] * x * x * (1.0 + 2.0 * y);
            ends + width * x * y * (self.slopes[0][at] * y - self.slopes[1][at] * x)
        };
        add(scale(frame.along, part(0)), scale(frame.across, part(1)))
    }
}
