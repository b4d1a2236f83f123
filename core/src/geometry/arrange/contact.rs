//! Along which segments two triangles of one soup cut each other.

use std::cmp::Ordering;
use std::sync::OnceLock;

use crate::geometry::arrange::coplanar;
use crate::geometry::arrange::point::{BITS, Corner, Plane, Point, cross, on_line};
use crate::geometry::exact;

/// A segment that two triangles have in common: in which order the ends stand depends on their order.
#[derive(Clone, Debug)]
pub(crate) struct Contact {
    pub(crate) ends: [Point; 2],
    /// For a crossing of two planes, that of the other triangle.
    pub(crate) edge: Option<[Corner; 2]>,
}

/// Triangles with their corners in units in which all of these are whole.
pub(crate) struct Soup<'a> {
    pub(crate) triangles: &'a [[[f32; 3]; 3]],
    /// Two to this power is the unit.
    pub(crate) power: i32,
    planes: Vec<OnceLock<Box<Plane>>>,
}

impl<'a> Soup<'a> {
    /// `None` if coordinates have too many bits between the largest and the smallest.
    pub(crate) fn new(triangles: &'a [[[f32; 3]; 3]]) -> Option<Self> {
        let all = || triangles.as_flattened().as_flattened().iter().filter(|x| **x != 0.0).map(|x| parts(*x));
        let power = all().map(|(mantissa, power)| power + mantissa.trailing_zeros() as i32).min().unwrap_or(0);
        let top = all().map(|(_, power)| power + 24).max().unwrap_or(0);
        let planes = (0..triangles.len()).map(|_| OnceLock::new()).collect();
        (top - power <= BITS as i32).then_some(Self { triangles, power, planes })
    }

    pub(crate) fn corners(&self, t: usize) -> [Corner; 3] {
        self.triangles[t].map(|p| p.map(|x| self.whole(x)))
    }

    fn whole(&self, x: f32) -> i128 {
        let (mantissa, power) = parts(x);
        let by = power - self.power;
        let magnitude = if by >= 0 { i128::from(mantissa) << by } else { i128::from(mantissa) >> -by };
        if x < 0.0 { -magnitude } else { magnitude }
    }

    pub(crate) fn plane(&self, t: usize) -> &Plane {
        self.planes[t].get_or_init(|| Box::new(Plane::of(&self.corners(t))))
    }
}

/// The magnitude as a whole number times a power of two; for zero any power.
fn parts(x: f32) -> (u32, i32) {
    let (bits, exponent) = (x.to_bits() & 0x7f_ffff, x.to_bits() >> 23 & 0xff);
    match (bits, exponent) {
        (0, 0) => (0, 0),
        (_, 0) => (bits, -149),
        _ => (bits | 1 << 23, exponent as i32 - 150),
    }
}

/// The segments along which two triangles have to be cut for each other. What belongs to any surface is none: a common edge or
/// corner, a single point, all of the same triangle.
pub(crate) fn contact(soup: &Soup<'_>, first: usize, second: usize) -> Vec<Contact> {
    let (t, u) = (&soup.triangles[first], &soup.triangles[second]);
    let common = t.iter().filter(|p| u.contains(p)).count();
    if common == 3 {
        return Vec::new();
    }
    let above = sides(t, u);
    if above == [0; 3] {
        return if coplanar_apart(t, u) { Vec::new() } else { coplanar::overlap(soup, [first, second], common) };
    }
    if common == 2 || one_sided(above) {
        return Vec::new();
    }
    let below = sides(u, t);
    if one_sided(below) || at_a_corner(above).is_some() && at_a_corner(below).is_some() || separated(t, u) {
        return Vec::new();
    }
    crossing(soup, [first, second], [below, above]).into_iter().collect()
}

/// The sides of the corners of `u` by the plane of `t`.
fn sides(t: &[[f32; 3]; 3], u: &[[f32; 3]; 3]) -> [i8; 3] {
    let plane = exact::Plane::new(&t[0], &t[1], &t[2]);
    [0, 1, 2].map(|k| if t.contains(&u[k]) { 0 } else { plane.side(&u[k]) })
}

fn one_sided(s: [i8; 3]) -> bool {
    s[0] != 0 && s[0] == s[1] && s[1] == s[2]
}

/// The corner that alone lies in the other's plane, with the others on one side.
fn at_a_corner(s: [i8; 3]) -> Option<usize> {
    (0..3).find(|i| s[*i] == 0 && s[(i + 1) % 3] != 0 && s[(i + 1) % 3] == s[(i + 2) % 3])
}

/// Does an edge of one have the other triangle strictly beyond it, in the plane of both?
fn coplanar_apart(t: &[[f32; 3]; 3], u: &[[f32; 3]; 3]) -> bool {
    (0..3).any(|axis| {
        let beyond = |t: &[[f32; 3]; 3], u: &[[f32; 3]; 3]| {
            let own = exact::orientation_along(&t[0], &t[1], &t[2], axis);
            let out = |k: usize| u.iter().all(|p| exact::orientation_along(&t[k], &t[(k + 1) % 3], p, axis) == -own);
            own != 0 && (0..3).any(out)
        };
        beyond(t, u) || beyond(u, t)
    })
}

/// Are they certainly apart along a direction across two edges? (Planes tell them apart before.)
fn separated(t: &[[f32; 3]; 3], u: &[[f32; 3]; 3]) -> bool {
    let local = |p: &[f32; 3]| exact::at(p) - exact::at(&t[0]);
    let (t, u) = (t.each_ref().map(local), u.each_ref().map(local));
    let size = t.iter().chain(&u).fold(0.0_f64, |m, p| m.max(p.abs().max_element()));
    // No product exceeds 24 sizes³; some ten are rounded, by 2⁻⁵³ each.
    let error = size * size * size / f64::from(1 << 22) / f64::from(1 << 22);
    (0..9).any(|i| {
        let axis = (t[(i / 3 + 1) % 3] - t[i / 3]).cross(u[(i % 3 + 1) % 3] - u[i % 3]);
        let range = |t: &[glam::DVec3; 3]| {
            let at = t.map(|p| axis.dot(p));
            (at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2]))
        };
        let ((low, high), (other_low, other_high)) = (range(&t), range(&u));
        other_low - high > error || low - other_high > error
    })
}

/// The segment in which two triangles meet whose planes cross, if it has a length. `sides` of the corners of each by the other's plane.
fn crossing(soup: &Soup<'_>, pair: [usize; 2], sides: [[i8; 3]; 2]) -> Option<Contact> {
    let planes = pair.map(|t| soup.plane(t));
    let along = cross(&planes[0].normal, &planes[1].normal);
    let axis = (0..3).max_by_key(|k| along[*k].bits())?;
    let order = |a: &Point, b: &Point| {
        let order = a.cmp_along(b, axis);
        if along[axis].sign() > 0 { order } else { order.reverse() }
    };
    let ends = |which: usize| {
        let (corners, s) = (soup.corners(pair[which]), sides[which]);
        let on = (0..3).filter(|i| s[*i] == 0).map(|i| Point::corner(&corners[i]));
        let through = (0..3).filter(|i| s[*i] * s[(i + 1) % 3] < 0);
        let through = through.filter_map(|i| on_line(&[corners[i], corners[(i + 1) % 3]], planes[1 - which]));
        let found: Vec<Point> = on.chain(through).collect();
        let (first, last) = (found.first()?, found.last()?);
        let ends = if order(last, first) == Ordering::Less { [last, first] } else { [first, last] };
        Some(ends.map(Clone::clone))
    };
    let ([low, high], [other_low, other_high]) = (ends(0)?, ends(1)?);
    let low = if order(&low, &other_low) == Ordering::Less { other_low } else { low };
    let high = if order(&high, &other_high) == Ordering::Greater { other_high } else { high };
    (order(&low, &high) == Ordering::Less).then(|| Contact { ends: [low, high], edge: None })
}
