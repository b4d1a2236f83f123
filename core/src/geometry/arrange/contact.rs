//! Along which segments two triangles of one soup cut each other.

use std::cmp::Ordering;

use crate::geometry::arrange::coplanar;
use crate::geometry::arrange::point::{Point, cross, on_line};
use crate::geometry::arrange::soup::{Contact, Soup};
use crate::geometry::exact;
use crate::geometry::tri_tri::{self, in_a_point, one_sided, sides_of};

/// The segments along which two triangles have to be cut for each other. What belongs to any surface is none: a common edge or
/// corner, a single point, all of the same triangle.
pub(crate) fn contact(soup: &Soup<'_>, first: usize, second: usize) -> Vec<Contact> {
    let (t, u) = (&soup.triangles[first], &soup.triangles[second]);
    let [of_t, of_u] = tri_tri::common(t, u);
    let common = of_t.iter().filter(|is| **is).count();
    if common == 3 {
        return Vec::new();
    }
    let above = sides_of(t, u, of_u);
    if above == [0; 3] {
        return if coplanar_apart(t, u) { Vec::new() } else { coplanar::overlap(soup, [first, second], common) };
    }
    if common == 2 || one_sided(above) {
        return Vec::new();
    }
    let below = sides_of(u, t, of_t);
    if one_sided(below) || in_a_point(above) && in_a_point(below) || separated(t, u) {
        return Vec::new();
    }
    crossing(soup, [first, second], [below, above]).into_iter().collect()
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
    (order(&low, &high) == Ordering::Less).then_some(Contact { ends: [low, high], edge: None })
}
