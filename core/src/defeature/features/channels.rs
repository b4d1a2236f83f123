//! Channels: depressions that reach the edges of their faces.
//!
//! Faces that meet in concave or smooth edges hang together; what they form is bounded by convex edges (the attributed
//! adjacency graph of Joshi and Chang, Computer-Aided Design 20, 1988). A channel has two walls that face each other, and is
//! nowhere wider than between them; or two that lean towards each other, and its width is that of its mouth.

use super::super::feature::{Kind, Limits};
use super::super::mesh::Mesh;
use super::super::segments::{Segment, Segments};
use super::super::sets::Sets;
use super::super::surface::Surface;
use super::super::vector::{Point, cross, dot, mean, scale, sub};
use super::patch::{COS_SMOOTH, Candidate, confidence, extent};
use crate::defeature::loops::loops;

/// Cosine of the least angle between the normals of leaning walls, 20°: a V is no wider than 160°.
const COS_MOUTH: f64 = 0.94;
/// Segments of a channel.
const MOST_SEGMENTS: usize = 400;

/// Channels narrower than the limit. O(n log n).
pub(super) fn find(mesh: &Mesh, segments: &Segments, limits: &Limits) -> Vec<Candidate> {
    let mut sets = Sets::new(segments.list.len());
    for half in 0..mesh.twin.len() as u32 {
        let (a, b) = (segments.of[(half / 3) as usize], segments.of[mesh.across(half) as usize]);
        if a < b && !is_convex(mesh, segments, half) {
            sets.join(a, b);
        }
    }
    let groups = sets.groups(|_| true);
    groups
        .into_iter()
        .filter(|g| g.len() > 1 && g.len() <= MOST_SEGMENTS)
        .filter_map(|g| channel(mesh, segments, &g, limits))
        .collect()
}

/// Whether the segments at a half-edge meet in a ridge.
pub(super) fn is_convex(mesh: &Mesh, segments: &Segments, half: u32) -> bool {
    let (a, b) = (mesh.at(mesh.from(half)), mesh.at(mesh.to(half)));
    let middle = mean(&[a, b]);
    let (n, m) = (segments.get(half / 3).1.outward(middle), segments.get(mesh.across(half)).1.outward(middle));
    dot(n, m) < COS_SMOOTH && dot(cross(n, m), sub(b, a)) > 0.0
}

/// A flat wall: its area, the direction out of the part, and a point of it.
struct Wall {
    area: f64,
    normal: Point,
    point: Point,
}

/// The largest two walls that face each other in parallel: their normal, and how far they are apart.
fn facing(walls: &[Wall], limit: f64) -> Option<(Point, f64)> {
    let mut best: Option<(f64, Point, f64)> = None;
    for (k, one) in walls.iter().enumerate() {
        for other in walls.iter().skip(k + 1) {
            let gap = dot(sub(other.point, one.point), one.normal);
            let area = one.area.min(other.area);
            let is_larger = best.is_none_or(|(least, ..)| area > least);
            if dot(one.normal, other.normal) < -0.9998 && gap > 0.0 && gap < limit && is_larger {
                best = Some((area, one.normal, gap));
            }
        }
    }
    best.map(|(_, normal, gap)| (normal, gap))
}

/// The direction across the largest two walls that lean towards each other, as those of a V do.
fn leaning(walls: &[Wall]) -> Option<Point> {
    let mut best: Option<(f64, Point)> = None;
    for (k, one) in walls.iter().enumerate() {
        for other in walls.iter().skip(k + 1) {
            let way = sub(other.point, one.point);
            let area = one.area.min(other.area);
            let leans = dot(one.normal, other.normal) < COS_MOUTH && dot(way, one.normal) > 0.0 && dot(way, other.normal) < 0.0;
            if leans && best.is_none_or(|(least, _)| area > least) {
                best = Some((area, super::patch::direction(sub(one.normal, other.normal))));
            }
        }
    }
    best.map(|(_, across)| across)
}

fn channel(mesh: &Mesh, segments: &Segments, group: &[u32], limits: &Limits) -> Option<Candidate> {
    let limit = limits.grooves_below?;
    let parts: Vec<&Segment> = group.iter().map(|s| &segments.list[*s as usize]).collect();
    let walls: Vec<Wall> = parts
        .iter()
        .filter(|s| s.surface.is_plane() && s.is_proven)
        .filter_map(|s| {
            s.triangles.first().map(|t| Wall { area: s.area, normal: s.outward(mesh.centroid(*t)), point: mesh.centroid(*t) })
        })
        .collect();
    let mut triangles: Vec<u32> = parts.iter().flat_map(|s| s.triangles.iter().copied()).collect();
    triangles.sort_unstable();
    let width = |normal: Point| {
        let heights = triangles.iter().flat_map(|t| mesh.triangles[*t as usize]).map(|v| dot(normal, mesh.at(v)));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        high - low
    };
    let (normal, gap) = match facing(&walls, limit) {
        Some((normal, gap)) if width(normal) <= gap + 16.0 * mesh.flatness() => (normal, gap),
        Some(_) => return None,
        None => leaning(&walls).map(|across| (across, width(across))).filter(|(_, gap)| *gap < limit)?,
    };
    let rims = loops(mesh, &triangles, |t| triangles.binary_search(&t).is_ok());
    let is_ring = parts.iter().any(|s| matches!(s.surface, Surface::Cylinder { axis, .. } if dot(axis, normal).abs() > 0.999));
    if !segments.are_drawn(mesh, group, &rims) {
        return None;
    }
    let kind = if is_ring && rims.len() == 2 { Kind::RingGroove } else { Kind::Groove };
    let points: Vec<Point> = triangles.iter().map(|t| mesh.centroid(*t)).collect();
    let sum = triangles.iter().fold([0.0; 3], |sum: Point, t| {
        let n = mesh.normals[*t as usize];
        [0, 1, 2].map(|k| sum[k] + mesh.areas[*t as usize] * n[k])
    });
    let across = sub(sum, scale(normal, dot(sum, normal)));
    let axis = if kind == Kind::RingGroove { normal } else { super::patch::direction(across) };
    let (centre, length) = (mean(&points), extent(mesh, &triangles));
    let confidence = confidence(mesh, segments, group);
    let depth = parts.iter().map(|s| s.area).fold(0.0, f64::max) / length.max(1e-300);
    Some(Candidate { kind, centre, axis, size: gap, length, depth, confidence, triangles, loops: rims, strips: Vec::new() })
}
