//! Removal of strips between faces: each becomes the curve in which its faces meet.

use super::super::features::patch::Candidate;
use super::super::mesh::Mesh;
use super::super::reason::Reason;
use super::super::segments::Segments;
use super::super::sets::Sets;
use super::super::vector::{Point, distance, dot, mean, sub};
use super::plan::{Edit, Plan};
use super::trial::Trial;
use std::collections::BTreeMap;

/// Ends of strips that touch: each set becomes one point.
struct Joints {
    /// The joint of each end, two for each strip.
    of: Vec<usize>,
    /// Joints by the vertices of the ends.
    at: BTreeMap<u32, usize>,
}

/// Plans the removal of a network. O(n log n) in its rims.
pub(crate) fn plan(mesh: &Mesh, segments: &Segments, candidate: &Candidate, reach: f64, trial: &Trial) -> Result<Edit, Reason> {
    let mut plan = Plan::new(mesh, segments, reach);
    let mut runs = Vec::new();
    for rim in &candidate.loops {
        runs.push(plan.follow(rim)?);
    }
    let joints = joints(mesh, segments, candidate);
    let corners = corners(mesh, segments, &mut plan, candidate, &joints, &runs)?;
    for run in runs.iter().filter(|run| run.len() > 1) {
        for (k, (carrier, vertex)) in run.iter().enumerate() {
            let before = run[(k + run.len() - 1) % run.len()].0;
            let joint = joints.at.get(vertex).ok_or(Reason::Open)?;
            plan.join(before, *carrier, *vertex, corners[*joint])?;
        }
    }
    for (number, strip) in candidate.strips.iter().enumerate() {
        let near = strip.rims[0].first().map_or([0.0; 3], |h| mesh.at(mesh.from(*h)));
        let [one, other] = [plan.carrier(strip.supports[0], near)?, plan.carrier(strip.supports[1], near)?];
        let ends = strip.ends[0].first().map(|_| [corners[joints.of[2 * number]], corners[joints.of[2 * number + 1]]]);
        let way = way(mesh, &mut plan, &strip.rims, [one, other], ends)?;
        plan.along(one, other, &way);
    }
    plan.finish(&candidate.entry.triangles, trial)
}

/// Ends that share vertices, directly or over corner pieces.
fn joints(mesh: &Mesh, segments: &Segments, candidate: &Candidate) -> Joints {
    let count = candidate.strips.len() * 2;
    let mut sets = Sets::new(count);
    let mut strips: Vec<u32> = candidate.strips.iter().map(|strip| strip.segment).collect();
    strips.sort_unstable();
    // Each vertex of an end, and each corner piece across it, belongs to the joint.
    let mut by_key: BTreeMap<(bool, u32), usize> = BTreeMap::new();
    let mut join = |key: (bool, u32), end: usize| sets.join(*by_key.entry(key).or_insert(end) as u32, end as u32);
    let inside = |t: u32| candidate.entry.triangles.binary_search(&t).is_ok();
    for (number, strip) in candidate.strips.iter().enumerate() {
        for side in 0..2 {
            for half in &strip.ends[side] {
                let end = 2 * number + side;
                let across = mesh.across(*half);
                if inside(across) {
                    join((false, mesh.from(*half)), end);
                    join((false, mesh.to(*half)), end);
                    let piece = segments.of[across as usize];
                    if strips.binary_search(&piece).is_err() {
                        join((true, piece), end);
                    }
                }
            }
        }
    }
    let of: Vec<usize> = (0..count as u32).map(|end| sets.root(end) as usize).collect();
    let mut at = BTreeMap::new();
    for (number, strip) in candidate.strips.iter().enumerate() {
        for side in 0..2 {
            for half in &strip.ends[side] {
                at.entry(mesh.from(*half)).or_insert(of[2 * number + side]);
                at.entry(mesh.to(*half)).or_insert(of[2 * number + side]);
            }
        }
    }
    Joints { of, at }
}

/// The new vertex of each joint: where the supports of its strips and the faces at its ends meet. Joints that are none get
/// vertex 0.
fn corners(
    mesh: &Mesh,
    segments: &Segments,
    plan: &mut Plan<'_>,
    candidate: &Candidate,
    joints: &Joints,
    runs: &[Vec<(usize, u32)>],
) -> Result<Vec<u32>, Reason> {
    let mut members: Vec<(Vec<usize>, Vec<Point>)> = vec![(Vec::new(), Vec::new()); joints.of.len()];
    for (number, strip) in candidate.strips.iter().enumerate() {
        for side in 0..2 {
            for half in &strip.ends[side] {
                let point = mesh.at(mesh.from(*half));
                members[joints.of[2 * number + side]].1.push(point);
                members[joints.of[2 * number + side]].1.push(mesh.at(mesh.to(*half)));
                let across = mesh.across(*half);
                if candidate.entry.triangles.binary_search(&across).is_err() {
                    let carrier = plan.carrier(segments.of[across as usize], point)?;
                    members[joints.of[2 * number + side]].0.push(carrier);
                }
                for support in strip.supports {
                    let carrier = plan.carrier(support, point)?;
                    members[joints.of[2 * number + side]].0.push(carrier);
                }
            }
        }
    }
    // Faces that only touch a joint in a corner belong to it, too.
    for run in runs.iter().filter(|run| run.len() > 1) {
        for (k, (carrier, vertex)) in run.iter().enumerate() {
            if let Some(joint) = joints.at.get(vertex) {
                members[*joint].0.extend([*carrier, run[(k + run.len() - 1) % run.len()].0]);
            }
        }
    }
    let mut found = vec![0; joints.of.len()];
    for (joint, (mut carriers, points)) in members.into_iter().enumerate().filter(|(_, (carriers, _))| !carriers.is_empty()) {
        carriers.sort_unstable();
        carriers.dedup();
        let point = plan.meet(&carriers, mean(&points))?;
        found[joint] = plan.vertex(point);
    }
    Ok(found)
}

/// The curve that takes a strip's place, from the joint at its first end to that at its second one; closed for rings. Its
/// points are the feet of the vertices of the finer rim.
fn way(
    mesh: &Mesh,
    plan: &mut Plan<'_>,
    rims: &[Vec<u32>; 2],
    pair: [usize; 2],
    ends: Option<[u32; 2]>,
) -> Result<Vec<u32>, Reason> {
    let is_first = rims[0].len() >= rims[1].len();
    let rim = if is_first { &rims[0] } else { &rims[1] };
    let mut vertices: Vec<u32> = rim.iter().map(|half| mesh.from(*half)).collect();
    if ends.is_some() && !vertices.is_empty() {
        vertices.remove(0);
    }
    if is_first {
        vertices.reverse();
    }
    let mut points: Vec<Point> = Vec::new();
    for vertex in vertices {
        let point = plan.meet(&pair, mesh.at(vertex))?;
        if points.last().is_none_or(|last| distance(*last, point) > 4.0 * mesh.flatness()) {
            points.push(point);
        }
    }
    let Some([a, b]) = ends else {
        let mut way: Vec<u32> = points.into_iter().map(|p| plan.vertex(p)).collect();
        way.extend(way.first().copied());
        return if way.len() > 3 { Ok(way) } else { Err(Reason::NoMeeting) };
    };
    let (from, to) = (plan.at(a), plan.at(b));
    let d = sub(to, from);
    // Points beyond the ends, where strips are mitred, are none of the curve's; on a straight line no point is needed.
    let bend = |p: &Point| {
        let t = dot(sub(*p, from), d) / dot(d, d).max(1e-300);
        (t, distance(*p, [0, 1, 2].map(|k| from[k] + t * d[k])))
    };
    if points.iter().all(|p| bend(p).1 <= 8.0 * mesh.flatness()) {
        points.clear();
    }
    points.retain(|p| distance(*p, from) > 8.0 * mesh.flatness() && distance(*p, to) > 8.0 * mesh.flatness());
    let mut way = vec![a];
    way.extend(points.into_iter().map(|p| plan.vertex(p)));
    way.push(b);
    Ok(way)
}
