//! Strips between two faces: fillets, that touch both smoothly, and chamfers, that meet both in blunt edges.
//!
//! A strip has two long rims, each on one face (its supports), and ends where it meets other faces or other strips. Strips, and
//! corner pieces between them, that touch make one network, which is removed as a whole: each strip becomes the curve in which
//! its supports meet, each set of ends that touch a point.

use super::super::feature::{Kind, Limits};
use super::super::loops::loops;
use super::super::mesh::Mesh;
use super::super::segments::{Segment, Segments};
use super::super::sets::Sets;
use super::super::surface::{Surface, radial};
use super::super::vector::{Point, cross, distance, dot, mean, norm, sub};
use super::channels::is_convex;
use super::patch::{Candidate, Entry, confidence, direction, extent};
use super::strip::Strip;

/// Cosine of 4°: supports of a fillet touch it within that.
const COS_TOUCH: f64 = 0.9975;
/// Cosines of 15° and 75°: between them chamfers meet their faces.
const CHAMFER: [f64; 2] = [0.259, 0.966];
/// Cosine of the largest turn of a chamfer, 110°: a narrow flat between steeper faces is the tip of a tooth, or the floor of a groove.
const COS_BEVEL: f64 = -0.342;
/// Cosine of the largest turn of a strip, 150°: beyond, its faces hardly meet.
const COS_TURN: f64 = -0.866;
/// The least area of a fillet's support beside its own: a shaft's end that is rounded over most of its radius leaves little.
const LEAST_SUPPORT: f64 = 0.15;
/// Pieces of one network.
const MOST_PIECES: usize = 2_000;

/// Networks of strips below the limit. O(n log n).
pub(super) fn find(mesh: &Mesh, segments: &Segments, limits: &Limits) -> Vec<Candidate> {
    let Some(limit) = limits.fillets_below else { return Vec::new() };
    let is_round = |s: &Segment| !matches!(s.surface, Surface::Cone { .. }) && s.surface.radius().is_some_and(|r| r < limit);
    let rounds: Vec<bool> = segments.list.iter().map(is_round).collect();
    let mut strips: Vec<Option<Strip>> = Vec::with_capacity(segments.list.len());
    for number in 0..segments.list.len() as u32 {
        let fillet = if rounds[number as usize] { strip(mesh, segments, number, Kind::Fillet) } else { None };
        strips.push(fillet.filter(|s| s.supports.iter().all(|p| !rounds[*p as usize])));
    }
    for number in 0..segments.list.len() as u32 {
        if strips[number as usize].is_none() && !rounds[number as usize] {
            strips[number as usize] = strip(mesh, segments, number, Kind::Chamfer).filter(|s| s.size < limit);
        }
    }
    // A chamfer's face may not be a chamfer itself.
    let chamfer = |s: u32| strips[s as usize].as_ref().is_some_and(|s| s.kind == Kind::Chamfer);
    let doubtful: Vec<usize> =
        (0..strips.len()).filter(|k| strips[*k].as_ref().is_some_and(|s| s.supports.iter().any(|p| chamfer(*p)))).collect();
    doubtful.into_iter().for_each(|k| strips[k] = None);
    networks(mesh, segments, &strips, &rounds)
}

/// The strip that a segment is, if it is one.
fn strip(mesh: &Mesh, segments: &Segments, number: u32, kind: Kind) -> Option<Strip> {
    let segment = &segments.list[number as usize];
    let is_shape = match segment.surface {
        Surface::Cylinder { .. } | Surface::Torus { .. } => kind == Kind::Fillet,
        Surface::Plane { .. } => kind == Kind::Chamfer && segment.is_proven && segment.triangles.len() <= 64,
        Surface::Cone { .. } => kind == Kind::Chamfer,
        Surface::Sphere { .. } => false,
    };
    if !is_shape {
        return None;
    }
    let rims = loops(mesh, &segment.triangles, |t| segments.of[t as usize] == number);
    let lengthwise = if segment.surface.is_plane() { Some(longest(mesh, rims.first()?)) } else { None };
    let is_long = |half: u32| runs_along(mesh, segment, half, lengthwise);
    let (sides, ends) = match &rims[..] {
        [one, other] if one.iter().chain(other).all(|h| is_long(*h)) => ([one.clone(), other.clone()], [Vec::new(), Vec::new()]),
        [rim] => split(mesh, rim, is_long)?,
        _ => return None,
    };
    let supports = [support(mesh, segments, &sides[0])?, support(mesh, segments, &sides[1])?];
    if supports[0] == supports[1] || supports.iter().any(|s| !segments.list[*s as usize].is_proven) {
        return None;
    }
    let fits = match kind {
        Kind::Fillet => touches(mesh, segments, segment, &sides, supports),
        _ => bevels(mesh, segments, number, &sides, supports),
    };
    let size = segment.surface.radius().filter(|_| kind == Kind::Fillet).or_else(|| width(mesh, &sides))?;
    fits.then_some(Strip { segment: number, supports, rims: sides, ends, kind, size })
}

/// The direction of the longest edge of a rim.
fn longest(mesh: &Mesh, rim: &[u32]) -> Point {
    let edge = |half: &u32| sub(mesh.at(mesh.to(*half)), mesh.at(mesh.from(*half)));
    direction(rim.iter().map(edge).max_by(|a, b| norm(*a).total_cmp(&norm(*b))).unwrap_or([0.0; 3]))
}

/// Whether an edge runs lengthwise: along a cylinder, around a cone or torus, as the longest edge of a plane.
fn runs_along(mesh: &Mesh, segment: &Segment, half: u32, lengthwise: Option<Point>) -> bool {
    let (a, b) = (mesh.at(mesh.from(half)), mesh.at(mesh.to(half)));
    let way = match (segment.surface, lengthwise) {
        (_, Some(way)) => way,
        (Surface::Cylinder { axis, .. }, _) => axis,
        (Surface::Cone { apex: centre, axis, .. } | Surface::Torus { centre, axis, .. }, _) => {
            direction(cross(axis, radial(centre, axis, mean(&[a, b]))))
        }
        _ => return false,
    };
    dot(direction(sub(b, a)), way).abs() > 0.98
}

type Sides = ([Vec<u32>; 2], [Vec<u32>; 2]);

/// A boundary split into long rim, end, long rim, end. Lengthwise edges much shorter than the longest rim belong to the ends:
/// these are jagged where a few triangles of the next piece lie on this one's surface.
fn split(mesh: &Mesh, rim: &[u32], is_long: impl Fn(u32) -> bool) -> Option<Sides> {
    let mut labels: Vec<bool> = rim.iter().map(|half| is_long(*half)).collect();
    let parts = parts(rim, &labels)?;
    let length =
        |part: &[usize]| -> f64 { part.iter().map(|k| distance(mesh.at(mesh.from(rim[*k])), mesh.at(mesh.to(rim[*k])))).sum() };
    let most = parts.iter().filter(|(label, _)| *label).map(|(_, part)| length(part)).fold(0.0, f64::max);
    let short = parts.iter().filter(|(label, part)| *label && length(part) < 0.2 * most);
    short.flat_map(|(_, part)| part.iter().copied()).collect::<Vec<_>>().into_iter().for_each(|k| labels[k] = false);
    let parts: Vec<(bool, Vec<u32>)> =
        self::parts(rim, &labels)?.into_iter().map(|(label, part)| (label, part.into_iter().map(|k| rim[k]).collect())).collect();
    let [(true, a), (false, b), (true, c), (false, d)] = <[_; 4]>::try_from(parts).ok()? else { return None };
    Some(([a, c], [b, d]))
}

/// Stretches of one label, as places in the rim; the first one is long.
fn parts(rim: &[u32], labels: &[bool]) -> Option<Vec<(bool, Vec<usize>)>> {
    let n = rim.len();
    let start = (0..n).find(|k| labels[*k] && !labels[(k + n - 1) % n])?;
    let mut parts: Vec<(bool, Vec<usize>)> = Vec::new();
    for k in (start..start + n).map(|k| k % n) {
        match parts.last_mut() {
            Some((label, part)) if *label == labels[k] => part.push(k),
            _ => parts.push((labels[k], vec![k])),
        }
    }
    Some(parts)
}

/// The one segment that all of a rim borders on; pieces of the same surface count as one.
fn support(mesh: &Mesh, segments: &Segments, rim: &[u32]) -> Option<u32> {
    let first = *rim.first()?;
    let (number, segment) = segments.get(mesh.across(first));
    let near = mesh.at(mesh.from(first));
    let tolerance = 8.0 * mesh.flatness();
    let same = |half: &u32| {
        let (other, piece) = segments.get(mesh.across(*half));
        other == number || piece.surface.is_same(&segment.surface, near, tolerance, 1.0)
    };
    rim.iter().all(same).then_some(number)
}

/// Whether a strip's surface touches its supports, and turns by less than 150°.
fn touches(mesh: &Mesh, segments: &Segments, segment: &Segment, sides: &[Vec<u32>; 2], supports: [u32; 2]) -> bool {
    let normals = |k: usize| {
        let half = sides[k][sides[k].len() / 2];
        let point = mesh.at(mesh.from(half));
        (segment.outward(point), segments.list[supports[k] as usize].outward(point))
    };
    let ((a, p), (b, q)) = (normals(0), normals(1));
    let large = |k: usize| segments.list[supports[k] as usize].area > LEAST_SUPPORT * segment.area;
    dot(a, p) > COS_TOUCH && dot(b, q) > COS_TOUCH && dot(p, q) > COS_TURN && dot(p, q) < 0.98 && large(0) && large(1)
}

/// Whether a flat or conical strip meets both supports, larger than itself, in ridges, or in both in valleys, of 15° to 75°.
fn bevels(mesh: &Mesh, segments: &Segments, number: u32, sides: &[Vec<u32>; 2], supports: [u32; 2]) -> bool {
    let segment = &segments.list[number as usize];
    let convex = |k: usize| is_convex(mesh, segments, sides[k][sides[k].len() / 2]);
    let cosine = |k: usize| {
        let half = sides[k][sides[k].len() / 2];
        let point = mean(&[mesh.at(mesh.from(half)), mesh.at(mesh.to(half))]);
        dot(segment.outward(point), segments.list[supports[k] as usize].outward(point))
    };
    let blunt = |k: usize| cosine(k) > CHAMFER[0] && cosine(k) < CHAMFER[1];
    let large = |k: usize| segments.list[supports[k] as usize].area > 1.2 * segment.area;
    let length = |k: usize| -> f64 { sides[k].iter().map(|h| distance(mesh.at(mesh.from(*h)), mesh.at(mesh.to(*h)))).sum() };
    let long = width(mesh, sides).is_some_and(|width| length(0).min(length(1)) > 1.5 * width);
    let outward = |k: usize| {
        let half = sides[k][sides[k].len() / 2];
        segments.list[supports[k] as usize].outward(mesh.at(mesh.from(half)))
    };
    let is_edge = dot(outward(0), outward(1)) > COS_BEVEL;
    is_edge
        && is_even(segments, segment, supports, length(0).max(length(1)), width(mesh, sides))
        && convex(0) == convex(1)
        && blunt(0)
        && blunt(1)
        && large(0)
        && large(1)
        && long
}

/// Whether a flat chamfer of flat faces is as wide at one end as at the other, within a twentieth: any three planes have two edges.
fn is_even(segments: &Segments, segment: &Segment, supports: [u32; 2], length: f64, width: Option<f64>) -> bool {
    let [one, other] = supports.map(|s| segments.list[s as usize].surface);
    match (segment.surface, one, other, width) {
        (Surface::Plane { normal, .. }, Surface::Plane { normal: a, .. }, Surface::Plane { normal: b, .. }, Some(width)) => {
            norm(cross(direction(cross(normal, a)), direction(cross(normal, b)))) * length <= 0.05 * width
        }
        _ => true,
    }
}

/// The distance of the two rims: the least from the middle of the shorter one to a vertex or edge of the other.
fn width(mesh: &Mesh, sides: &[Vec<u32>; 2]) -> Option<f64> {
    let ends = |h: &u32| [mesh.at(mesh.from(*h)), mesh.at(mesh.to(*h))];
    let middle = mean(&ends(sides[0].get(sides[0].len() / 2)?));
    let gap = |h: &u32| {
        let [a, b] = ends(h);
        let d = sub(b, a);
        let t = (dot(sub(middle, a), d) / dot(d, d).max(1e-300)).clamp(0.0, 1.0);
        distance(middle, [0, 1, 2].map(|k| a[k] + t * d[k]))
    };
    sides[1].iter().map(gap).min_by(f64::total_cmp)
}

/// Strips and corner pieces that touch, as candidates.
fn networks(mesh: &Mesh, segments: &Segments, strips: &[Option<Strip>], rounds: &[bool]) -> Vec<Candidate> {
    // A bore between the rounded rims at its ends is no corner: they are fillets of it.
    let mut is_support = vec![false; strips.len()];
    strips.iter().flatten().flat_map(|strip| strip.supports).for_each(|s| is_support[s as usize] = true);
    let is_corner =
        |s: u32| strips[s as usize].is_none() && !is_support[s as usize] && is_corner(mesh, segments, strips, rounds, s);
    let corners: Vec<bool> = (0..strips.len() as u32).map(is_corner).collect();
    let is_piece = |s: u32| strips[s as usize].is_some() || corners[s as usize];
    let mut sets = Sets::new(strips.len());
    for half in 0..mesh.twin.len() as u32 {
        let (a, b) = (segments.of[(half / 3) as usize], segments.of[mesh.across(half) as usize]);
        if a < b && is_piece(a) && is_piece(b) {
            sets.join(a, b);
        }
    }
    let groups = sets.groups(|_| true);
    let mut found = Vec::new();
    for group in groups.into_iter().filter(|g| g.len() <= MOST_PIECES) {
        let mut own: Vec<Strip> = group.iter().filter_map(|s| strips[*s as usize].clone()).collect();
        own.sort_by(|a, b| b.size.total_cmp(&a.size));
        let mut triangles: Vec<u32> = group.iter().flat_map(|s| segments.list[*s as usize].triangles.iter().copied()).collect();
        triangles.sort_unstable();
        let loops = loops(mesh, &triangles, |t| triangles.binary_search(&t).is_ok());
        let confidence = confidence(mesh, segments, &group);
        let mut kin = kin(mesh, segments, &own);
        if kin.is_empty() {
            continue;
        }
        let first = kin.remove(0);
        // Corners belong to the widest.
        let length = if kin.is_empty() { extent(mesh, &triangles) } else { first.length };
        let network = Candidate::new(Entry { length, triangles, ..first }, confidence, loops);
        found.push(Candidate { strips: own, kin, ..network });
    }
    found
}

/// The fillets and chamfers of a network: strips of one kind and size are one, the widest first.
fn kin(mesh: &Mesh, segments: &Segments, strips: &[Strip]) -> Vec<Entry> {
    let mut sorted: Vec<&Strip> = strips.iter().collect();
    sorted.sort_by(|a, b| b.size.total_cmp(&a.size));
    let mut groups: Vec<Vec<&Strip>> = Vec::new();
    for strip in sorted {
        let is_same = |group: &Vec<&Strip>| {
            group.first().is_some_and(|first| first.kind == strip.kind && (first.size - strip.size).abs() <= 0.01 * first.size)
        };
        match groups.iter_mut().find(|group| is_same(group)) {
            Some(group) => group.push(strip),
            None => groups.push(vec![strip]),
        }
    }
    let told = |group: Vec<&Strip>| {
        let first = group.first()?;
        let mut triangles: Vec<u32> =
            group.iter().flat_map(|s| segments.list[s.segment as usize].triangles.iter().copied()).collect();
        triangles.sort_unstable();
        let points: Vec<Point> = first.rims.iter().flatten().map(|h| mesh.at(mesh.from(*h))).collect();
        let axis = segments.list[first.segment as usize].surface.axis().map(|(_, axis)| axis);
        let axis = axis.unwrap_or_else(|| first.rims.first().map_or([0.0; 3], |rim| longest(mesh, rim)));
        let (centre, length) = (mean(&points), extent(mesh, &triangles));
        Some(Entry { kind: first.kind, centre, axis, size: first.size, length, depth: 0.0, triangles })
    };
    groups.into_iter().filter_map(told).collect()
}

/// Whether a segment is the corner between strips: round and small, or flat and small, with nothing but strips along most of
/// its outline.
fn is_corner(mesh: &Mesh, segments: &Segments, strips: &[Option<Strip>], rounds: &[bool], number: u32) -> bool {
    let segment = &segments.list[number as usize];
    if segment.triangles.len() > 4_000 || segment.triangles.is_empty() {
        return false;
    }
    let (mut own, mut all, mut near) = (0.0, 0.0, 0);
    let mut last = u32::MAX;
    for half in segment.triangles.iter().flat_map(|t| 3 * t..3 * t + 3) {
        let other = segments.of[mesh.across(half) as usize];
        if other == number {
            continue;
        }
        let length = distance(mesh.at(mesh.from(half)), mesh.at(mesh.to(half)));
        all += length;
        if strips[other as usize].is_some() {
            own += length;
            near += usize::from(other != last);
            last = other;
        }
    }
    let share = if rounds[number as usize] { 0.5 } else { 0.98 };
    near >= 2 && own > share * all
}
