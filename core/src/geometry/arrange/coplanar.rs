//! The overlap of two triangles in one plane: the second, clipped by the edges of the first (Sutherland and Hodgman).

use crate::geometry::arrange::flat::turn;
use crate::geometry::arrange::point::{Corner, Point, on_lines};
use crate::geometry::arrange::soup::{Contact, Soup};
use crate::geometry::exact;

/// A corner of the rest, and the edge that the side from it on lies on.
#[derive(Clone)]
struct Corner2 {
    point: Point,
    edge: [Corner; 2],
}

/// The border of what both cover; `common` corners are those of both.
pub(crate) fn overlap(soup: &Soup<'_>, pair: [usize; 2], common: usize) -> Vec<Contact> {
    let axis = dominant_axis(soup, pair[0]);
    let [clip, subject] = pair.map(|t| {
        let mut corners = soup.corners(t);
        let [a, b, c] = &soup.triangles[t];
        if exact::orientation_along(a, b, c, axis) < 0 {
            corners.swap(1, 2);
        }
        corners
    });
    let edge = |c: &[Corner; 3], k: usize| [c[k], c[(k + 1) % 3]];
    let mut rest: Vec<Corner2> = (0..3).map(|k| Corner2 { point: Point::corner(&subject[k]), edge: edge(&subject, k) }).collect();
    for k in 0..3 {
        rest = clipped(&rest, &edge(&clip, k), axis);
    }
    let rest = reduced(rest, axis);
    let side =
        |k: usize| Contact { ends: [rest[k].point.clone(), rest[(k + 1) % rest.len()].point.clone()], edge: Some(rest[k].edge) };
    match rest.len() {
        0 | 1 => Vec::new(),
        2 if common == 2 => Vec::new(),
        2 => vec![side(0)],
        sides => (0..sides).map(side).collect(),
    }
}

/// The axis along which a triangle's normal is longest; of equal ones the last.
pub(crate) fn dominant_axis(soup: &Soup<'_>, t: usize) -> usize {
    let n = &soup.plane(t).normal;
    let absolute = |k: usize| if n[k].sign() < 0 { n[k].negated() } else { n[k] };
    (1..3).fold(0, |best, k| if absolute(k).cmp(&absolute(best)).is_ge() { k } else { best })
}

/// The part of a polygon that lies to the left of an edge, or on it.
fn clipped(rest: &[Corner2], edge: &[Corner; 2], axis: usize) -> Vec<Corner2> {
    let ends = edge.each_ref().map(Point::corner);
    let inside: Vec<bool> = rest.iter().map(|c| turn([&ends[0], &ends[1], &c.point], axis) >= 0).collect();
    let mut out = Vec::with_capacity(rest.len() + 2);
    for (k, from) in rest.iter().enumerate() {
        let next = (k + 1) % rest.len();
        if inside[k] != inside[next] {
            let along = if inside[k] { *edge } else { from.edge };
            out.extend(on_lines(&from.edge, edge, axis).map(|point| Corner2 { point, edge: along }));
        }
        if inside[next] {
            out.push(rest[next].clone());
        }
    }
    out
}

/// Without corners that are there twice, or between two others; of what is all on one line, the ends.
fn reduced(corners: Vec<Corner2>, axis: usize) -> Vec<Corner2> {
    let mut rest: Vec<Corner2> = Vec::with_capacity(corners.len());
    for corner in corners {
        match rest.last_mut() {
            Some(last) if last.point.is(&corner.point) => last.edge = corner.edge,
            _ => rest.push(corner),
        }
    }
    while rest.len() > 1 && rest[0].point.is(&rest[rest.len() - 1].point) {
        rest.pop();
    }
    let count = rest.len();
    if count <= 2 {
        return rest;
    }
    let corner = |k: usize| &rest[k % count].point;
    let bends: Vec<bool> = (0..count).map(|k| turn([corner(k + count - 1), corner(k), corner(k + 1)], axis) != 0).collect();
    if bends.iter().any(|bends| *bends) {
        return rest.into_iter().zip(bends).filter(|(_, bends)| *bends).map(|(corner, _)| corner).collect();
    }
    ends(&rest)
}

/// The ends of corners on one line, in the direction from the first to the second.
fn ends(line: &[Corner2]) -> Vec<Corner2> {
    let Some(k) = (0..3).find(|k| line[0].point.cmp_along(&line[1].point, *k).is_ne()) else { return Vec::new() };
    let along = |a: &Corner2, b: &Corner2| {
        let order = a.point.cmp_along(&b.point, k);
        if line[0].point.cmp_along(&line[1].point, k).is_lt() { order } else { order.reverse() }
    };
    let edge = line[0].edge;
    let (low, high) = line.iter().fold((&line[0], &line[0]), |(low, high), c| {
        (if along(c, low).is_lt() { c } else { low }, if along(c, high).is_gt() { c } else { high })
    });
    [low, high].map(|c| Corner2 { point: c.point.clone(), edge }).to_vec()
}
