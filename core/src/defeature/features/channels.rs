//! Channels: depressions that reach the edges of their faces.
//!
//! Faces that meet in concave or smooth edges hang together; what they form is bounded by convex edges (the attributed
//! adjacency graph of Joshi and Chang, Computer-Aided Design 20, 1988). A channel has two walls that face each other, and is
//! nowhere wider than between them; or two that lean towards each other, and its width is that of its mouth.

use super::super::feature::{Kind, Limits};
use super::super::mesh::Mesh;
use super::super::segments::{Segment, Segments};
use super::super::sets::Sets;
use super::super::surface::{Surface, meridian};
use super::super::vector::{Point, along, cross, dot, frame, mean, norm, scale, sub, unit};
use super::patch::{COS_SMOOTH, Candidate, Entry, confidence};
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
    segment: u32,
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
fn leaning(walls: &[Wall]) -> Option<(Point, [&Wall; 2])> {
    let mut best: Option<(f64, Point, [&Wall; 2])> = None;
    for (k, one) in walls.iter().enumerate() {
        for other in walls.iter().skip(k + 1) {
            let way = sub(other.point, one.point);
            let area = one.area.min(other.area);
            let leans = dot(one.normal, other.normal) < COS_MOUTH && dot(way, one.normal) > 0.0 && dot(way, other.normal) < 0.0;
            if leans && best.is_none_or(|(least, ..)| area > least) {
                best = Some((area, super::patch::direction(sub(one.normal, other.normal)), [one, other]));
            }
        }
    }
    best.map(|(_, across, pair)| (across, pair))
}

/// Whether a V is as wide at one end as at the other, within a twentieth: any two flat pieces lean. The longest edge of each wall
/// at the mouth runs along the line in which both meet.
fn is_even(mesh: &Mesh, segments: &Segments, rims: &[Vec<u32>], pair: [&Wall; 2], width: f64) -> bool {
    let way = super::patch::direction(cross(pair[0].normal, pair[1].normal));
    pair.iter().all(|wall| {
        let own = rims.iter().flatten().filter(|half| segments.of[(**half / 3) as usize] == wall.segment);
        let edges = own.map(|half| sub(mesh.at(mesh.to(*half)), mesh.at(mesh.from(*half))));
        let longest = edges.max_by(|a, b| dot(*a, *a).total_cmp(&dot(*b, *b)));
        longest.is_some_and(|edge| norm(cross(edge, way)) <= 0.05 * width)
    })
}

/// Channels that cross: each vertex lies between two walls that face each other, of those that are nearest to each other. The
/// normal and the width of the widest.
fn crossing(mesh: &Mesh, walls: &[Wall], triangles: &[u32], limit: f64) -> Option<(Point, f64)> {
    let nearest = |one: &Wall| {
        let gap = |other: &Wall| dot(sub(other.point, one.point), one.normal);
        let faces = |other: &&Wall| dot(one.normal, other.normal) < -0.9998 && gap(other) > 0.0 && gap(other) < limit;
        let found = walls.iter().filter(faces).map(gap).min_by(f64::total_cmp)?;
        Some((one.normal, dot(one.normal, one.point), found))
    };
    let slabs: Vec<(Point, f64, f64)> = walls.iter().filter_map(nearest).collect();
    let slack = 16.0 * mesh.flatness();
    let is_within = |point: Point| {
        slabs.iter().any(|(normal, low, gap)| {
            let height = dot(*normal, point) - low;
            height >= -slack && height <= gap + slack
        })
    };
    let mut vertices = triangles.iter().flat_map(|t| mesh.triangles[*t as usize]);
    let widest = slabs.iter().max_by(|a, b| a.2.total_cmp(&b.2))?;
    vertices.all(|v| is_within(mesh.at(v))).then_some((widest.0, widest.2))
}

/// The least and the largest value at vertices of triangles.
fn range(mesh: &Mesh, triangles: &[u32], value: impl Fn(Point) -> f64) -> [f64; 2] {
    let values = triangles.iter().flat_map(|t| mesh.triangles[*t as usize]).map(|v| value(mesh.at(v)));
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

fn channel(mesh: &Mesh, segments: &Segments, group: &[u32], limits: &Limits) -> Option<Candidate> {
    let limit = limits.grooves_below?;
    let parts: Vec<&Segment> = group.iter().map(|s| &segments.list[*s as usize]).collect();
    let wall = |(s, segment): (&&Segment, &u32)| {
        let point = mesh.centroid(*s.triangles.first()?);
        let flat = s.surface.is_plane() && s.is_proven;
        flat.then(|| Wall { area: s.area, normal: s.outward(point), point, segment: *segment })
    };
    let walls: Vec<Wall> = parts.iter().zip(group).filter_map(wall).collect();
    let mut triangles: Vec<u32> = parts.iter().flat_map(|s| s.triangles.iter().copied()).collect();
    triangles.sort_unstable();
    let rims = loops(mesh, &triangles, |t| triangles.binary_search(&t).is_ok());
    let range = |way: Point| range(mesh, &triangles, |p| dot(way, p));
    let width = |normal: Point| range(normal)[1] - range(normal)[0];
    let (normal, gap) = match facing(&walls, limit) {
        Some((normal, gap)) if width(normal) <= gap + 16.0 * mesh.flatness() => (normal, gap),
        Some(_) => crossing(mesh, &walls, &triangles, limit)?,
        None => {
            let (across, pair) = leaning(&walls)?;
            let gap = width(across);
            (gap < limit && is_even(mesh, segments, &rims, pair, gap)).then_some((across, gap))?
        }
    };
    let is_ring = parts.iter().any(|s| matches!(s.surface, Surface::Cylinder { axis, .. } if dot(axis, normal).abs() > 0.999));
    if !segments.are_drawn(mesh, group, &rims) {
        return None;
    }
    let kind = if is_ring && rims.len() == 2 { Kind::RingGroove } else { Kind::Groove };
    let confidence = confidence(mesh, segments, group);
    let entry = entry(mesh, (&parts, &walls), triangles, (kind, normal, gap))?;
    Some(Candidate::new(entry, confidence, rims))
}

/// Place and sizes of a channel, by the extents of its triangles across the walls, out of the floor and along both.
fn entry(
    mesh: &Mesh,
    (parts, walls): (&[&Segment], &[Wall]),
    triangles: Vec<u32>,
    (kind, normal, size): (Kind, Point, f64),
) -> Option<Entry> {
    let range = |way: Point| range(mesh, &triangles, |p| dot(way, p));
    // Out of the floor, or of all faces.
    let floors = walls.iter().filter(|w| dot(w.normal, normal).abs() < 1e-3);
    let floor = floors.max_by(|a, b| a.area.total_cmp(&b.area)).map(|w| w.normal);
    let sum = triangles.iter().fold([0.0; 3], |sum: Point, t| {
        let n = mesh.normals[*t as usize];
        [0, 1, 2].map(|k| sum[k] + mesh.areas[*t as usize] * n[k])
    });
    let up = floor.unwrap_or(sum);
    let up = unit(sub(up, scale(normal, dot(up, normal)))).unwrap_or(frame(normal)[0]);
    let mut centre = [0.0; 3];
    for way in [normal, up, cross(normal, up)] {
        let [low, high] = range(way);
        centre = along(centre, way, (low + high) / 2.0);
    }
    if kind == Kind::RingGroove {
        let turned = parts.iter().find_map(|s| s.surface.axis().filter(|(_, axis)| dot(*axis, normal).abs() > 0.999));
        let (origin, around) = turned?;
        let [low, high] = self::range(mesh, &triangles, |p| meridian(origin, around, p)[1]);
        let centre = along(origin, around, dot(sub(centre, origin), around));
        return Some(Entry { kind, centre, axis: normal, size, length: 2.0 * high, depth: high - low, triangles });
    }
    let span = |way: Point| range(way)[1] - range(way)[0];
    let (depth, length) = (span(up), span(cross(normal, up)).max(span(normal)));
    Some(Entry { kind, centre, axis: up, size, length, depth, triangles })
}
