//! The constrained triangulation of what directed edges enclose on a surface.

use super::super::reason::Reason;
use super::super::surface::Surface;
use super::super::vector::{Point, between, distance};
use super::develop::Map;
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::collections::BTreeMap;

/// Steiner points of one patch.
const MOST_POINTS: usize = 4_000;

/// Steps of a grid of Steiner points, in the largest turn of the surface's triangles.
const STEP: f64 = 0.65;

/// Why edges enclose nothing that could be filled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// They cross, or pass through each other's ends.
    Crossing,
    /// They enclose a region the wrong way round, or twice: the face is to become smaller there.
    Sense,
    /// They do not close.
    Open,
    /// The surface cannot be laid out.
    Surface,
}

impl From<Fault> for Reason {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::Crossing => Self::Crossing,
            Fault::Sense => Self::Sense,
            Fault::Open => Self::Open,
            Fault::Surface => Self::Surface,
        }
    }
}

/// Triangles between corners: numbers below the count of vertices are those given, others are new points.
pub(super) struct Filling {
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) points: Vec<Point>,
}

/// Fills what lies to the left of directed edges between vertices, seen from outside. `angle`: the largest turn of the surface
/// in a triangle, radians, for cylinders and cones. `avoided`: edges that may not be; a point divides them. O(n log n).
pub(super) fn fill(
    surface: Surface,
    is_concave: bool,
    edges: &[(u32, u32)],
    at: impl Fn(u32) -> Point,
    (angle, avoided): (f64, &[(u32, u32)]),
) -> Result<Filling, Fault> {
    let edges = cancelled(edges)?;
    let mut vertices: Vec<u32> = edges.iter().flat_map(|(a, b)| [*a, *b]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    let points: Vec<Point> = vertices.iter().map(|v| at(*v)).collect();
    let found = |v: &u32| vertices.binary_search(v).ok();
    let place = |v: &u32| found(v).unwrap_or(0);
    let local: Vec<(usize, usize)> = edges.iter().map(|(a, b)| (place(a), place(b))).collect();
    let map = Map::new(surface, is_concave, &points, &local).ok_or(Fault::Surface)?;
    let images: Vec<[f64; 2]> = points.iter().map(|p| map.image(*p)).collect();
    let name = |k: usize| vertices.get(k).copied().unwrap_or(NEW + (k.saturating_sub(vertices.len())) as u32);
    if let Some(triangles) = lean(&map, surface, &images, &local, angle).filter(|_| avoided.is_empty()) {
        return Ok(Filling { triangles: triangles.into_iter().map(|t| t.map(name)).collect(), points: Vec::new() });
    }
    let turns = if map.is_polar() { turns(&images, &local) } else { 0 };
    let mut extra = steiner(&map, surface, &images, &local, (turns, STEP * angle))?;
    extra.extend(avoided.iter().filter_map(|(a, b)| divided(&map, &points, [found(a)?, found(b)?])));
    let mut flat = images;
    flat.extend(extra.iter().map(|p| map.image(*p)));
    let triangles = inside(&flat, &local)?;
    Ok(Filling { triangles: triangles.into_iter().map(|t| t.map(name)).collect(), points: extra })
}

/// The number of the first new point of a filling.
pub(super) const NEW: u32 = 1 << 31;

/// Edges without those that run both ways; at each vertex as many must begin as end.
fn cancelled(edges: &[(u32, u32)]) -> Result<Vec<(u32, u32)>, Fault> {
    let mut count: BTreeMap<(u32, u32), i32> = BTreeMap::new();
    let mut balance: BTreeMap<u32, i32> = BTreeMap::new();
    for (a, b) in edges {
        let step = if a < b { 1 } else { -1 };
        *count.entry(((*a).min(*b), (*a).max(*b))).or_default() += step;
        *balance.entry(*a).or_default() += 1;
        *balance.entry(*b).or_default() -= 1;
    }
    if balance.values().any(|x| *x != 0) || count.values().any(|x| x.abs() > 1) {
        return Err(Fault::Open);
    }
    let kept = count.into_iter().filter(|(_, x)| *x != 0);
    Ok(kept.map(|((a, b), x)| if x > 0 { (a, b) } else { (b, a) }).collect())
}

/// Times that edges wind around the origin.
fn turns(images: &[[f64; 2]], edges: &[(usize, usize)]) -> i64 {
    let angle = |(a, b): &(usize, usize)| {
        let ([x, y], [u, v]) = (images[*a], images[*b]);
        (x * v - y * u).atan2(x * u + y * v)
    };
    (edges.iter().map(angle).sum::<f64>() / std::f64::consts::TAU).round() as i64
}

/// Triangles of a cylinder's piece without new points: the height is pressed to the width of a step, so that edges run along the
/// axis, where no chord leaves the surface. `None` of other surfaces, and where a triangle would turn by more than `angle` and by
/// more than each edge given.
fn lean(map: &Map, surface: Surface, images: &[[f64; 2]], edges: &[(usize, usize)], angle: f64) -> Option<Vec<[usize; 3]>> {
    let Surface::Cylinder { radius, .. } = surface else { return None };
    if map.is_polar() {
        return None;
    }
    let heights = images.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[1]), h.max(p[1])));
    let press = (radius * angle / (heights.1 - heights.0).max(1e-300)).min(1.0);
    let pressed: Vec<[f64; 2]> = images.iter().map(|[u, v]| [*u, v * press]).collect();
    let triangles = inside(&pressed, edges).ok()?;
    let turn = |a: usize, b: usize| (images[a][0] - images[b][0]).abs();
    let most = 1.05 * edges.iter().map(|(a, b)| turn(*a, *b)).fold(radius * angle, f64::max);
    triangles.iter().all(|[a, b, c]| turn(*a, *b).max(turn(*b, *c)).max(turn(*c, *a)) <= most).then_some(triangles)
}

/// Points on the surface inside of what is filled, where a chord would leave it: a grid of as many steps as the turn asks for;
/// the apex of a cone that is filled all around.
fn steiner(
    map: &Map,
    surface: Surface,
    images: &[[f64; 2]],
    edges: &[(usize, usize)],
    (turns, angle): (i64, f64),
) -> Result<Vec<Point>, Fault> {
    if map.is_polar() {
        return match (surface, turns) {
            (_, 0) => Ok(Vec::new()),
            (Surface::Cone { apex, .. }, 1) => Ok(vec![super::meet::rounded(apex)]),
            _ => Err(Fault::Sense),
        };
    }
    let step = match surface {
        Surface::Cylinder { radius, .. } | Surface::Sphere { radius, .. } => radius * angle,
        Surface::Cone { apex, angle: half, .. } => {
            let radii = images.iter().filter_map(|i| map.point(*i)).map(|p| distance(p, apex) * half.sin());
            radii.fold(0.0, f64::max) * angle
        }
        _ => return Ok(Vec::new()),
    };
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for image in images {
        for k in 0..2 {
            low[k] = low[k].min(image[k]);
            high[k] = high[k].max(image[k]);
        }
    }
    let counts = [0, 1].map(|k| ((high[k] - low[k]) / step.max(1e-300)).ceil());
    if counts[0] <= 1.0 || counts[0] * counts[1] > MOST_POINTS as f64 || !counts[0].is_finite() {
        return Ok(Vec::new());
    }
    let mut found = Vec::new();
    for i in 1..counts[0] as usize {
        for j in 1..(counts[1] as usize).max(2) {
            let part = [i as f64 / counts[0], j as f64 / counts[1].max(2.0)];
            let image = [0, 1].map(|k| low[k] + part[k] * (high[k] - low[k]));
            if is_well_inside(image, images, edges, 0.35 * step) {
                found.extend(map.point(image).map(super::meet::rounded));
            }
        }
    }
    Ok(found)
}

/// The middle between two points of a surface, on it; `None` of curved maps that show the whole turn.
fn divided(map: &Map, points: &[Point], [a, b]: [usize; 2]) -> Option<Point> {
    let (p, q) = (*points.get(a)?, *points.get(b)?);
    let ([u, v], [s, t]) = (map.image(p), map.image(q));
    let middle = if map.is_flat() { Some(between(p, q, 0.5)) } else { map.point([(u + s) / 2.0, (v + t) / 2.0]) };
    middle.map(super::meet::rounded)
}

/// Whether edges wind once around a place and none is nearer than `gap`. O(edges).
fn is_well_inside([x, y]: [f64; 2], images: &[[f64; 2]], edges: &[(usize, usize)], gap: f64) -> bool {
    let mut winding = 0;
    for (a, b) in edges {
        let ([ax, ay], [bx, by]) = (images[*a], images[*b]);
        let (dx, dy) = (bx - ax, by - ay);
        let t = (((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy).max(1e-300)).clamp(0.0, 1.0);
        if (ax + t * dx - x).hypot(ay + t * dy - y) < gap {
            return false;
        }
        if (ay <= y) != (by <= y) {
            let side = dx * (y - ay) - dy * (x - ax);
            if ay <= y && side > 0.0 {
                winding += 1;
            } else if by <= y && side < 0.0 {
                winding -= 1;
            }
        }
    }
    winding == 1
}

/// Triangles of the constrained Delaunay triangulation of `points` around which `edges` wind once.
fn inside(points: &[[f64; 2]], edges: &[(usize, usize)]) -> Result<Vec<[usize; 3]>, Fault> {
    let mut mesh = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let largest = points.iter().flatten().fold(1e-300_f64, |most, x| most.max(x.abs()));
    for (number, [u, v]) in points.iter().enumerate() {
        // Numbers below 10⁻¹⁴ of the largest are noise, and spade refuses what is near 0.
        let clean = |x: f64| if (x / largest).abs() < 1e-14 { 0.0 } else { x / largest };
        let handle = mesh.insert(Point2::new(clean(*u), clean(*v))).map_err(|_| Fault::Surface)?;
        // A point on another one is none of its own.
        if handle.index() != number {
            return Err(Fault::Crossing);
        }
    }
    let vertex = FixedVertexHandle::from_index;
    for (a, b) in edges {
        if !mesh.can_add_constraint(vertex(*a), vertex(*b)) {
            return Err(Fault::Crossing);
        }
        mesh.add_constraint(vertex(*a), vertex(*b));
        if mesh.get_edge_from_neighbors(vertex(*a), vertex(*b)).is_none() {
            return Err(Fault::Crossing);
        }
    }
    let faces: Vec<[usize; 3]> = mesh.inner_faces().map(|face| face.vertices().map(|v| v.fix().index())).collect();
    let windings = windings(&faces, edges);
    if windings.iter().any(|w| !matches!(w, Some(0 | 1))) {
        return Err(Fault::Sense);
    }
    let mut kept: Vec<[usize; 3]> = faces.iter().zip(&windings).filter(|(_, w)| **w == Some(1)).map(|(f, _)| *f).collect();
    kept.sort_unstable();
    Ok(kept)
}

/// How often directed edges wind around each face, from the hull inwards.
fn windings(faces: &[[usize; 3]], edges: &[(usize, usize)]) -> Vec<Option<i32>> {
    let mut sides: Vec<((usize, usize), usize)> = Vec::with_capacity(faces.len() * 3);
    for (number, [a, b, c]) in faces.iter().enumerate() {
        sides.extend([(*a, *b), (*b, *c), (*c, *a)].map(|side| (side, number)));
    }
    sides.sort_unstable();
    let mut directed = edges.to_vec();
    directed.sort_unstable();
    let step = |(a, b): (usize, usize)| {
        i32::from(directed.binary_search(&(a, b)).is_ok()) - i32::from(directed.binary_search(&(b, a)).is_ok())
    };
    let across = |(a, b): (usize, usize)| sides.binary_search_by(|(side, _)| side.cmp(&(b, a))).ok().map(|at| sides[at].1);
    let mut found = vec![None; faces.len()];
    let mut queue = Vec::new();
    for ((a, b), number) in &sides {
        if across((*a, *b)).is_none() && found[*number].is_none() {
            found[*number] = Some(step((*a, *b)));
            queue.push(*number);
        }
    }
    while let Some(face) = queue.pop() {
        let [a, b, c] = faces[face];
        for side in [(a, b), (b, c), (c, a)] {
            if let (Some(other), Some(here)) = (across(side), found[face])
                && found[other].is_none()
            {
                found[other] = Some(here - step(side));
                queue.push(other);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_of_a_cylinder_takes_no_new_points() {
        // Two arcs of 9 chords of 5° each, 0.3 apart: 18 triangles.
        let at = |v: u32| {
            let turn = f64::from(v % 10) * 5.0_f64.to_radians();
            [4.0 * turn.cos(), 4.0 * turn.sin(), if v < 10 { 0.0 } else { 0.3 }]
        };
        let mut edges: Vec<(u32, u32)> = (0..9).map(|k| (k, k + 1)).collect();
        edges.push((9, 19));
        edges.extend((10..19).rev().map(|k| (k + 1, k)));
        edges.push((10, 0));
        let surface = Surface::Cylinder { origin: [0.0; 3], axis: [0.0, 0.0, 1.0], radius: 4.0 };
        let filling = fill(surface, false, &edges, at, (5.0_f64.to_radians(), &[])).unwrap();
        assert_eq!((filling.triangles.len(), filling.points.len()), (18, 0));
    }

    #[test]
    fn an_edge_that_may_not_be_is_divided() {
        let at = |v: u32| [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 2.0, 1.0], [0.0, 2.0, 1.0]][v as usize % 4];
        let plane = Surface::Plane { normal: [0.0, 0.0, 1.0], offset: 1.0 };
        let edges = [(0, 1), (1, 2), (2, 3), (3, 0)];
        let filling = fill(plane, false, &edges, at, (0.4, &[(0, 2)])).unwrap();
        assert_eq!((filling.triangles.len(), filling.points), (4, vec![[1.0, 1.0, 1.0]]));
    }
}
