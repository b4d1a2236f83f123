//! Patches behind inner loops: what stands on, or is sunk into, the middle of a face.
//!
//! The mesh is cut along all inner loops of flat, cylindrical and conical faces. A piece that has no inner loops of its own
//! lies on its carriers like a boss, or leads through the part like a hole.

use super::super::loops::loops;
use super::super::mesh::Mesh;
use super::super::segments::{Segment, Segments};
use super::super::sets::Sets;
use super::super::surface::Surface;
use super::super::vector::{Point, add, cross, distance, dot, frame, mean, sub};
use super::channels::is_convex;
use super::measure::rim;

/// A face with a hole has six triangles at least.
const LEAST_TRIANGLES: usize = 6;
/// Cosine of 40°: rows of facets of a smooth body turn by less, chamfers by 45°.
const COS_ROW: f64 = 0.766;

/// The pieces without inner loops of their own, each as rising numbers of triangles. O(n log n).
pub(super) fn pieces(mesh: &Mesh, segments: &Segments, widest: Option<f64>) -> Vec<Vec<u32>> {
    let mut is_cut = vec![false; mesh.triangles.len() * 3];
    let mut cuts = Vec::new();
    // Spheres come last: what is a loop within another face is none within them.
    let is_ball = |segment: &Segment| matches!(segment.surface, Surface::Sphere { .. });
    let faces = || (0_u32..).zip(&segments.list);
    for (number, segment) in faces().filter(|(_, s)| !is_ball(s)).chain(faces().filter(|(_, s)| is_ball(s))) {
        if segment.triangles.len() < LEAST_TRIANGLES || matches!(segment.surface, Surface::Torus { .. }) {
            continue;
        }
        let rims = loops(mesh, &segment.triangles, |t| segments.of[t as usize] == number);
        let least = if is_ball(segment) { 1 } else { 2 };
        if is_ball(segment) && is_row(mesh, segment, &rims) {
            continue;
        }
        if rims.len() < least || is_ledge(mesh, segments, &rims, widest) {
            continue;
        }
        if segment.surface.is_plane() && is_chord(mesh, segments, segment, &rims) {
            continue;
        }
        let is_new = |rim: &Vec<u32>| rim.iter().all(|half| !is_cut[*half as usize]);
        for rim in rims.into_iter().filter(|rim| is_inner(mesh, segment, rim)).filter(is_new).collect::<Vec<_>>() {
            for half in &rim {
                is_cut[*half as usize] = true;
                is_cut[mesh.twin[*half as usize] as usize] = true;
            }
            cuts.extend(rim.first().copied());
        }
    }
    if cuts.is_empty() {
        return Vec::new();
    }
    let mut sets = Sets::new(mesh.triangles.len());
    for half in (0..is_cut.len() as u32).filter(|half| !is_cut[*half as usize]) {
        sets.join(half / 3, mesh.across(half));
    }
    let mut is_carrier = vec![false; mesh.triangles.len()];
    let mut is_feature = vec![false; mesh.triangles.len()];
    for half in &cuts {
        is_carrier[sets.root(half / 3) as usize] = true;
        is_feature[sets.root(mesh.across(*half)) as usize] = true;
    }
    sets.groups(|root| is_feature[root as usize] && !is_carrier[root as usize])
}

/// Whether a face is the step of a counterbored hole: a ring between two circles around one axis, the outer one a valley no
/// wider than holes that are to go, the inner one a ridge.
fn is_ledge(mesh: &Mesh, segments: &Segments, rims: &[Vec<u32>], widest: Option<f64>) -> bool {
    let ([one, other], Some(widest)) = (rims, widest) else { return false };
    let circle = |halves: &Vec<u32>| {
        let points: Vec<Point> = halves.iter().map(|half| mesh.at(mesh.from(*half))).collect();
        let found = rim(&points);
        found.diameter.map(|d| (d, found.centre, halves.iter().all(|half| is_convex(mesh, segments, *half))))
    };
    let (Some(a), Some(b)) = (circle(one), circle(other)) else { return false };
    let ((wide, centre, is_ridge), (narrow, place, is_step)) = if a.0 > b.0 { (a, b) } else { (b, a) };
    wide < widest && !is_ridge && is_step && distance(centre, place) < 0.05 * narrow
}

/// Whether a segment has no vertices but those of its rims: two circles of a cone lie on a sphere, too.
fn is_row(mesh: &Mesh, segment: &Segment, rims: &[Vec<u32>]) -> bool {
    let mut own: Vec<u32> = rims.iter().flatten().map(|half| mesh.from(*half)).collect();
    own.sort_unstable();
    segment.triangles.iter().flat_map(|t| mesh.triangles[*t as usize]).all(|v| own.binary_search(&v).is_ok())
}

/// Whether a ring, flat or round, is no face but one row of the facets of a smooth body, as the crest of a lathed one is: it turns into flats
/// or cones of half to twice its width at all of its rims, by less than 40°.
pub(super) fn is_chord(mesh: &Mesh, segments: &Segments, face: &Segment, rims: &[Vec<u32>]) -> bool {
    let length = |half: &u32| distance(mesh.at(mesh.from(*half)), mesh.at(mesh.to(*half)));
    let outline: f64 = rims.iter().flatten().map(length).sum();
    let own = 2.0 * face.area / outline.max(1e-300);
    rims.iter().all(|rim| {
        let mut beside: Vec<u32> = rim.iter().map(|half| segments.get(mesh.across(*half)).0).collect();
        beside.sort_unstable();
        beside.dedup();
        let parts = || beside.iter().map(|s| &segments.list[*s as usize]);
        let width = parts().map(|s| s.area).sum::<f64>() / rim.iter().map(length).sum::<f64>().max(1e-300);
        let is_smooth = |half: &u32| {
            let middle = mesh.at(mesh.from(*half));
            dot(face.outward(middle), segments.get(mesh.across(*half)).1.outward(middle)) > COS_ROW
        };
        width > 0.5 * own
            && width < 2.0 * own
            && parts().all(|s| matches!(s.surface, Surface::Plane { .. } | Surface::Cone { .. }))
            && rim.iter().all(is_smooth)
    })
}

/// Whether a loop bounds its face from within: it turns the other way, and not around a cylinder.
fn is_inner(mesh: &Mesh, segment: &Segment, rim: &[u32]) -> bool {
    let points: Vec<Point> = rim.iter().map(|half| mesh.at(mesh.from(*half))).collect();
    let pairs = || points.iter().zip(points.iter().cycle().skip(1));
    let Some((origin, axis)) = segment.surface.axis() else {
        let start = if matches!(segment.surface, Surface::Sphere { .. }) { mean(&points) } else { points[0] };
        let area = pairs().fold([0.0; 3], |sum, (a, b)| add(sum, cross(sub(*a, start), sub(*b, start))));
        return dot(area, segment.outward(start)) < 0.0;
    };
    let [e, f] = frame(axis);
    let polar = |p: &Point| {
        let d = sub(*p, origin);
        (dot(d, f).atan2(dot(d, e)), dot(d, axis))
    };
    let (mut turn, mut area) = (0.0, 0.0);
    for (a, b) in pairs() {
        let ((s, h), (t, k)) = (polar(a), polar(b));
        let step = (t - s + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        // −∮ h dθ is the area, seen from outside.
        area -= step * (h + k) / 2.0;
        turn += step;
    }
    // A cone that opens along its axis is seen from outside as a cylinder is.
    turn.abs() < 1.0 && if segment.is_concave { area > 0.0 } else { area < 0.0 }
}
