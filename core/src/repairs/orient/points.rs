//! Points on parts of surface, spread by area. They do not depend on the order in which triangles come.

use std::cmp::Ordering;
use std::collections::{BTreeMap, HashMap, HashSet};

use glam::DVec3;

use crate::geometry::distance::place;
use crate::geometry::position::Position;
use crate::io::record;
use crate::submesh::Submesh;
use crate::submesh::components::{Components, Reversed};
use crate::topology::survey::Survey;

/// Triangles of each part, at most.
const POINTS: usize = 32;

/// Points that are spread over these triangles.
const SPREAD: usize = 128;

/// By how much each point of a part lies further in the unit square than the one before: the sequence R2, of the root of x³ = x + 1.
const FURTHER: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_2];

/// A triangle that one of the points is in.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Point {
    /// Area over a number between 0 and 1 of its own: the points with the largest are spread evenly over the area (Duffield, Lund & Thorup,
    /// "Priority sampling for estimation of arbitrary subset sums", JACM 54(6), 2007).
    priority: f64,
    record: u32,
    pub(crate) corners: [[f32; 3]; 3],
}

impl Point {
    fn of(corners: [[f32; 3]; 3], record: u32) -> Self {
        let [a, b, c] = corners.map(place);
        let x = (u64::from(record) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let x = (x ^ x >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93);
        let share = ((x >> 11) as f64 + 1.0) / (1u64 << 53) as f64;
        Self { priority: (b - a).cross(c - a).length() / share, record, corners }
    }

    /// Twice the area.
    fn area(&self) -> f64 {
        let [a, b, c] = self.corners.map(place);
        (b - a).cross(c - a).length()
    }

    /// A point in the triangle, by number.
    fn at(&self, number: usize) -> [f64; 3] {
        let [a, b, c] = self.corners.map(place);
        let [u, v] = FURTHER.map(|further| {
            let far = (number as f64 + 1.0) * further;
            far - far.floor()
        });
        let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
        let point: DVec3 = a + (b - a) * u + (c - a) * v;
        point.to_array()
    }

    fn is_before(&self, other: &Self) -> bool {
        let by_place = || self.corners.map(Position::of) < other.corners.map(Position::of);
        match self.priority.total_cmp(&other.priority).then(other.record.cmp(&self.record)) {
            Ordering::Equal => by_place(),
            order => order.is_gt(),
        }
    }
}

/// Takes a point in, if it is among the first.
fn note(points: &mut Vec<Point>, point: Point) {
    let at = points.partition_point(|other| other.is_before(&point));
    if at < POINTS {
        points.truncate(POINTS - 1);
        points.insert(at, point);
    }
}

/// The first points of the parts that are asked about, by part.
pub(crate) fn first_points(
    survey: &Survey<'_>,
    submesh: &Submesh,
    reversed: &Reversed,
    parts: &Components,
    asked: &[u32],
) -> Vec<(u32, Point)> {
    let wanted: HashSet<u32> = asked.iter().copied().collect();
    let found = survey.visit_regular(
        |region| wanted.contains(&parts.of_region[region as usize]),
        HashMap::<u32, Vec<Point>>::new,
        |found, triangle, region| {
            let [a, b, c] = record::corners(&survey.records[triangle as usize]);
            let corners = if reversed.regions[region as usize] { [a, c, b] } else { [a, b, c] };
            note(found.entry(parts.of_region[region as usize]).or_default(), Point::of(corners, triangle));
        },
    );
    let mut points: BTreeMap<u32, Vec<Point>> = BTreeMap::new();
    // Which points are the first does not depend on the order that they come in.
    for (part, found) in found.into_iter().flatten() {
        let own = points.entry(part).or_default();
        found.into_iter().for_each(|point| note(own, point));
    }
    for t in submesh.living().filter(|t| wanted.contains(&parts.of_triangle[*t as usize])) {
        note(points.entry(parts.of_triangle[t as usize]).or_default(), Point::of(submesh.points(t), submesh.record(t)));
    }
    points.into_iter().flat_map(|(part, points)| points.into_iter().map(move |p| (part, p))).collect()
}

/// Points spread over the parts that are asked about: the place of each part among those and a point, as many of each part, by part.
pub(crate) fn spread(
    survey: &Survey<'_>,
    submesh: &Submesh,
    reversed: &Reversed,
    parts: &Components,
    asked: &[u32],
) -> Vec<(u32, [f64; 3])> {
    let all = first_points(survey, submesh, reversed, parts, asked);
    let mut spread = Vec::with_capacity(asked.len() * SPREAD);
    for own in all.chunk_by(|a, b| a.0 == b.0) {
        // Each triangle stands for those like it that were not taken (Duffield, Lund & Thorup 2007).
        let least = if own.len() == POINTS { own.iter().map(|(_, p)| p.priority).fold(f64::INFINITY, f64::min) } else { 0.0 };
        let weights: Vec<f64> = own.iter().map(|(_, point)| point.area().max(least)).collect();
        let all: f64 = weights.iter().sum();
        let (mut at, mut up_to) = (0, weights[0]);
        for i in 0..SPREAD {
            let wanted = (i as f64 + 0.5) / SPREAD as f64 * all;
            while up_to < wanted && at + 1 < own.len() {
                at += 1;
                up_to += weights[at];
            }
            spread.push((own[0].0, own[at].1.at(i)));
        }
    }
    spread
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_points_spread_by_area_do_not_depend_on_their_order() {
        let all: Vec<Point> =
            (0..200u32).map(|n| Point::of([[0.0; 3], [1.0 + n as f32, 0.0, 0.0], [0.0, 1.0, 0.0]], n)).collect();
        let mut forward = Vec::new();
        all.iter().for_each(|p| note(&mut forward, *p));
        let mut backward = Vec::new();
        all.iter().rev().for_each(|p| note(&mut backward, *p));
        assert_eq!(forward.len(), POINTS);
        assert!(forward == backward);
    }
}
