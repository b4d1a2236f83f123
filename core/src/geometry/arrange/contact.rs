//! Along which segments two triangles of one soup cut each other.

use std::cmp::Ordering;

use crate::geometry::arrange::coplanar;
use crate::geometry::arrange::plane::{across, on_line};
use crate::geometry::arrange::point::Point;
use crate::geometry::arrange::soup::{Contact, Contacts, Soup};
use crate::geometry::exact;
use crate::geometry::tri_tri::{self, in_a_point, one_sided, sides_of};

/// Adds the segments along which two triangles have to be cut for each other. What belongs to any surface is none: a common edge or
/// corner, a single point, all of the same triangle.
pub(crate) fn contact(soup: &Soup<'_>, first: usize, second: usize, into: &mut Contacts) {
    let (t, u) = (&soup.triangles[first], &soup.triangles[second]);
    let [of_t, of_u] = tri_tri::common(t, u);
    let common = of_t.iter().filter(|is| **is).count();
    if common == 3 {
        return;
    }
    let above = sides_of(t, u, of_u);
    if above == [0; 3] {
        return coplanar::overlap(soup, [first, second], common, into);
    }
    if common == 2 || one_sided(above) {
        return;
    }
    let below = sides_of(u, t, of_t);
    if one_sided(below) || in_a_point(above) && in_a_point(below) || separated(t, u) {
        return;
    }
    if let Some([low, high]) = crossing(soup, [first, second], [below, above]) {
        let ends = [into.end_at(low), into.end_at(high)];
        into.all.push(Contact { other: second as u32, ends, edge: None });
    }
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
fn crossing(soup: &Soup<'_>, pair: [usize; 2], sides: [[i8; 3]; 2]) -> Option<[Point; 2]> {
    let planes = pair.map(|t| soup.plane(t));
    let (axis, direction) = across(planes[0], planes[1])?;
    let order = |a: &Point, b: &Point| {
        let order = a.cmp_along(b, axis);
        if direction > 0 { order } else { order.reverse() }
    };
    let ends = |which: usize| -> Option<[Point; 2]> {
        let (corners, s) = (soup.corners(pair[which]), sides[which]);
        let on = (0..3).filter(|i| s[*i] == 0).map(|i| Point::corner(&corners[i]));
        let through = (0..3).filter(|i| s[*i] * s[(i + 1) % 3] < 0);
        let through = through.filter_map(|i| on_line(&[corners[i], corners[(i + 1) % 3]], planes[1 - which]));
        let mut found = on.chain(through);
        let first = found.next()?;
        let last = found.last().unwrap_or_else(|| first.clone());
        Some(if order(&last, &first) == Ordering::Less { [last, first] } else { [first, last] })
    };
    let ([low, high], [other_low, other_high]) = (ends(0)?, ends(1)?);
    let low = if order(&low, &other_low) == Ordering::Less { other_low } else { low };
    let high = if order(&high, &other_high) == Ordering::Greater { other_high } else { high };
    (order(&low, &high) == Ordering::Less).then_some([low, high])
}
