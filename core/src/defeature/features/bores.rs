//! Holes by their walls: concave cylinders that no inner loop led to.
//!
//! A hole across a step has no loop within one face, two that overlap have no round one. Coaxial walls and bottoms make a patch;
//! where it ends in ridges, the faces around it go on. What is seen and cannot be removed is told of.

use super::super::feature::{Kind, Limits};
use super::super::mesh::Mesh;
use super::super::reason::Reason;
use super::super::segments::{Segment, Segments};
use super::super::surface::{Surface, meridian, radial};
use super::super::vector::{Point, cross, distance, dot, frame, norm, sub};
use super::channels::is_convex;
use super::inner::is_chord;
use super::patch::{self, Candidate, EDGE, Entry, classify};
use crate::defeature::loops::loops;

/// The largest angle between neighbouring vertices around a wall, radians: beyond, it is open on a side.
const ALL_ROUND: f64 = 1.1;
/// That of a wall that is most of a hole: 160°.
const MOST_ROUND: f64 = 2.8;
/// The share of a rim's length that is a ridge.
const LEAST_RIDGE: f64 = 0.95;
/// Segments of one hole.
const MOST_SEGMENTS: usize = 64;

/// Holes below the limit that are none of those `known`. O(n log n).
pub(super) fn find(mesh: &Mesh, segments: &Segments, limits: &Limits, known: &[Candidate]) -> Vec<Candidate> {
    let Some(limit) = limits.holes_below else { return Vec::new() };
    let mut is_known = vec![false; mesh.triangles.len()];
    known.iter().flat_map(|c| &c.entry.triangles).for_each(|t| is_known[*t as usize] = true);
    let mut found = Vec::new();
    for (number, segment) in segments.list.iter().enumerate() {
        let Surface::Cylinder { origin, axis, radius } = segment.surface else { continue };
        let is_seen = segment.triangles.iter().any(|t| is_known[*t as usize]);
        if !segment.is_concave || 2.0 * radius >= limit || is_seen {
            continue;
        }
        let gap = gap(mesh, segment, (origin, axis));
        let rims = loops(mesh, &segment.triangles, |t| segments.of[t as usize] == number as u32);
        if gap > MOST_ROUND || is_chord(mesh, segments, segment, &rims) {
            continue;
        }
        let numbers = coaxial(mesh, segments, number as u32, (origin, axis, radius));
        let mut triangles: Vec<u32> = numbers.iter().flat_map(|s| segments.list[*s as usize].triangles.iter().copied()).collect();
        triangles.sort_unstable();
        if triangles.iter().any(|t| is_known[*t as usize]) {
            continue;
        }
        triangles.iter().for_each(|t| is_known[*t as usize] = true);
        let ends = loops(mesh, &triangles, |t| triangles.binary_search(&t).is_ok());
        // A cavity is no hole.
        if ends.is_empty() {
            continue;
        }
        let is_open = gap > ALL_ROUND || !ends_in_ridges(mesh, segments, &ends);
        let hole = if is_open { None } else { classify(mesh, segments, triangles.clone()) };
        let told = Told::new(mesh, segments, segment, &numbers);
        found.push(match hole.filter(|c| c.entry.kind.is_hole()) {
            Some(hole) => told.of((hole.entry.kind, hole.entry.size, hole.confidence), triangles, hole.loops),
            None => {
                let kind = if told.has_end { Kind::BlindHole } else { Kind::ThroughHole };
                let sure = patch::confidence(mesh, segments, &numbers);
                Candidate { barred: Some(Reason::Walls), ..told.of((kind, 2.0 * radius, sure), triangles, ends) }
            }
        });
    }
    found
}

/// The largest angle between neighbouring vertices of a segment around an axis.
fn gap(mesh: &Mesh, segment: &Segment, (origin, axis): (Point, Point)) -> f64 {
    let [e, f] = frame(axis);
    let vertices = segment.triangles.iter().flat_map(|t| mesh.triangles[*t as usize]);
    let mut angles: Vec<f64> = vertices.map(|v| radial(origin, axis, mesh.at(v))).map(|d| dot(d, f).atan2(dot(d, e))).collect();
    angles.sort_by(f64::total_cmp);
    let wrap = angles.first().zip(angles.last()).map_or(7.0, |(a, b)| a + std::f64::consts::TAU - b);
    angles.windows(2).map(|w| w[1] - w[0]).fold(wrap, f64::max)
}

/// A wall and what hangs together with it around its axis: round segments, and flat bottoms no wider than its edges.
fn coaxial(mesh: &Mesh, segments: &Segments, first: u32, (origin, axis, radius): (Point, Point, f64)) -> Vec<u32> {
    let is_near = |segment: &Segment| {
        let mut vertices = segment.triangles.iter().take(4_000).flat_map(|t| mesh.triangles[*t as usize]);
        vertices.all(|v| meridian(origin, axis, mesh.at(v))[1] <= EDGE * radius)
    };
    let on_axis = |p: Point| norm(cross(sub(p, origin), axis)) <= 0.02 * radius;
    let belongs = |segment: &Segment| match segment.surface {
        Surface::Plane { normal, .. } => dot(normal, axis).abs() > 0.9999 && is_near(segment),
        Surface::Sphere { centre, .. } => on_axis(centre) && is_near(segment),
        Surface::Cylinder { origin: p, axis: a, .. }
        | Surface::Cone { apex: p, axis: a, .. }
        | Surface::Torus { centre: p, axis: a, .. } => dot(a, axis).abs() > 0.9998 && on_axis(p) && is_near(segment),
    };
    let mut found = vec![first];
    let mut next = 0;
    while let Some(&number) = found.get(next).filter(|_| found.len() <= MOST_SEGMENTS) {
        next += 1;
        for half in segments.list[number as usize].triangles.iter().flat_map(|t| 3 * t..3 * t + 3) {
            let (other, segment) = segments.get(mesh.across(half));
            if !found.contains(&other) && belongs(segment) {
                found.push(other);
            }
        }
    }
    found
}

/// Whether most of the rims' length is a ridge: the faces across them go on over the hole.
fn ends_in_ridges(mesh: &Mesh, segments: &Segments, rims: &[Vec<u32>]) -> bool {
    let (mut ridge, mut all) = (0.0, 0.0);
    for half in rims.iter().flatten() {
        let length = distance(mesh.at(mesh.from(*half)), mesh.at(mesh.to(*half)));
        all += length;
        ridge += if is_convex(mesh, segments, *half) { length } else { 0.0 };
    }
    ridge >= LEAST_RIDGE * all
}

/// A hole as its wall tells it.
struct Told {
    wall: Entry,
    /// Whether a flat, a cone's tip or a sphere closes it.
    has_end: bool,
}

impl Told {
    fn new(mesh: &Mesh, segments: &Segments, segment: &Segment, numbers: &[u32]) -> Self {
        let is_end = |s: &u32| !matches!(segments.list[*s as usize].surface, Surface::Cylinder { .. } | Surface::Torus { .. });
        Self { wall: patch::bore(mesh, segment, &segment.triangles), has_end: numbers.iter().any(is_end) }
    }

    fn of(self, (kind, size, confidence): (Kind, f64, f64), triangles: Vec<u32>, loops: Vec<Vec<u32>>) -> Candidate {
        Candidate::new(Entry { kind, size, triangles, ..self.wall }, confidence, loops)
    }
}
