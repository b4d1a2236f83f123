//! Triangles between rings of places in a plane: Delaunay's with the rings as constraints, refined within.
//!
//! Based on: L. P. Chew, *Guaranteed-quality mesh generation for curved surfaces*, SoCG 1993 (centres of circles around triangles
//! that are too large or too flat), but edges of rings are never split: a centre that is too near to one gives way to a place at
//! a fair distance from it.

use spade::handles::{DirectedEdgeHandle, FaceHandle, FixedVertexHandle, InnerTag};
use spade::{CdtEdge, ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

type Cdt = ConstrainedDelaunayTriangulation<Point2<f64>>;
type Face<'a> = FaceHandle<'a, InnerTag, Point2<f64>, (), CdtEdge<()>, ()>;
type Edge<'a> = DirectedEdgeHandle<'a, Point2<f64>, (), CdtEdge<()>, ()>;

/// Passes over all triangles, at most.
const PASSES: u32 = 40;
/// The largest ratio of the radius around a triangle to its shortest edge: of an angle of 25°.
const RATIO: f64 = 1.183;
/// Heights of new places above edges of rings, in lengths of these: the least, and what is chosen instead.
const HEIGHTS: [f64; 2] = [0.45, 0.7];

/// Places, those of the rings first and in their order, and triangles, all anticlockwise.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Flat {
    pub(super) places: Vec<[f64; 2]>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Triangles within rings (the outer one anticlockwise, others clockwise). No angle below 25° where rings allow it, no circle
/// around a triangle wider than one with edges of the length `longest`, and no more than `inner` places within. `None` of rings
/// that cross themselves or each other. O(n log n) a pass, at most 40 passes, each of which makes places denser.
pub(super) fn triangles(rings: &[Vec<[f64; 2]>], longest: f64, inner: usize) -> Option<Flat> {
    let all: Vec<[f64; 2]> = rings.iter().flatten().copied().collect();
    let [low, high] = all.iter().fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], [x, y]| {
        [[low[0].min(*x), low[1].min(*y)], [high[0].max(*x), high[1].max(*y)]]
    });
    let size = (high[0] - low[0]).max(high[1] - low[1]);
    if all.len() < 3 || !(size > 0.0 && size.is_finite()) {
        return None;
    }
    let points: Vec<Point2<f64>> = all.iter().map(|[x, y]| Point2::new((x - low[0]) / size, (y - low[1]) / size)).collect();
    let (mut cdt, numbers) = constrained(&points, rings)?;
    let mut is_inside = inside(&cdt);
    // Rings that lie in one another otherwise than they should have another area.
    let area: f64 = cdt.inner_faces().filter(|face| is_in(&is_inside, *face)).map(|face| face.area()).sum();
    let expected = rings.iter().map(|ring| shoelace(ring)).sum::<f64>() / (size * size);
    if !(expected > 0.0 && (area - expected).abs() <= 1e-6 * expected) {
        return None;
    }
    let radius = longest / size / 3.0_f64.sqrt();
    for _ in 0..PASSES {
        let room = (all.len() + inner).saturating_sub(cdt.num_vertices());
        if pass(&mut cdt, &is_inside, radius, room) == 0 {
            break;
        }
        // Places are added within alone, and edges of rings stay: what is outside does.
        is_inside.resize(cdt.num_all_faces(), true);
    }
    let mut flat = Flat { places: all, triangles: Vec::new() };
    let new = cdt.vertices().skip(flat.places.len()).map(|vertex| vertex.data().position());
    flat.places.extend(new.map(|place| [low[0] + place.x * size, low[1] + place.y * size]));
    let faces = cdt.inner_faces().filter(|face| is_in(&is_inside, *face));
    let number = |vertex: usize| numbers.get(vertex).copied().unwrap_or(vertex as u32);
    flat.triangles = faces.map(|face| face.vertices().map(|vertex| number(vertex.fix().index()))).collect();
    Some(flat)
}

/// The triangulation with rings as constraints, and for each vertex of it the number of its place. Places go in by halving
/// strides, each with a neighbour on its ring for a hint: an order that is always the same, which `spade` does not promise of its
/// bulk loading.
fn constrained(points: &[Point2<f64>], rings: &[Vec<[f64; 2]>]) -> Option<(Cdt, Vec<u32>)> {
    let mut cdt = Cdt::new();
    let mut handles = vec![cdt.insert(*points.first()?).ok()?; points.len()];
    let mut numbers = vec![0];
    let mut stride = points.len().next_power_of_two();
    while stride > 0 {
        for at in (stride..points.len()).step_by(2 * stride) {
            let handle = cdt.insert_with_hint(*points.get(at)?, *handles.get(at - stride)?).ok()?;
            // A place that is there already.
            if handle.index() != numbers.len() {
                return None;
            }
            *handles.get_mut(at)? = handle;
            numbers.push(at as u32);
        }
        stride /= 2;
    }
    let mut first = 0;
    for ring in rings {
        let around = handles.get(first..first + ring.len())?;
        for (a, b) in around.iter().zip(around.iter().cycle().skip(1)) {
            if a == b || !cdt.can_add_constraint(*a, *b) {
                return None;
            }
            cdt.add_constraint(*a, *b);
        }
        first += ring.len();
    }
    Some((cdt, numbers))
}

fn is_in(is_inside: &[bool], face: Face<'_>) -> bool {
    is_inside.get(face.fix().index()) == Some(&true)
}

/// Faces that an odd number of edges of rings separates from the outside. O(faces).
fn inside(cdt: &Cdt) -> Vec<bool> {
    let mut depth: Vec<Option<bool>> = vec![None; cdt.num_all_faces()];
    let outer = cdt.outer_face();
    let mut stack = vec![(outer.fix(), false)];
    while let Some((face, is_inside)) = stack.pop() {
        let Some(known) = depth.get_mut(face.index()).filter(|known| known.is_none()) else { continue };
        *known = Some(is_inside);
        // Edges of the hull have the outer face at their left.
        let mut cross = |edge: Edge<'_>| stack.push((edge.rev().face().fix(), is_inside != edge.is_constraint_edge()));
        match cdt.face(face).as_inner() {
            Some(inner) => inner.adjacent_edges().into_iter().for_each(&mut cross),
            None => cdt.convex_hull().for_each(&mut cross),
        }
    }
    depth.into_iter().map(|known| known == Some(true)).collect()
}

/// A triangle that is too flat or too large.
#[derive(Clone, Copy, Debug)]
struct Wanted {
    badness: f64,
    corners: [FixedVertexHandle; 3],
    centre: Point2<f64>,
    round: f64,
}

/// Adds a place for each triangle that is too flat or too large, the worst first; how many were added.
fn pass(cdt: &mut Cdt, is_inside: &[bool], radius: f64, room: usize) -> usize {
    let mut wanted: Vec<Wanted> = Vec::new();
    for face in cdt.inner_faces().filter(|face| is_in(is_inside, *face)) {
        let (centre, squared) = face.circumcircle();
        let round = squared.sqrt();
        let shortest = face.adjacent_edges().iter().map(|edge| edge.length_2()).fold(f64::INFINITY, f64::min).sqrt();
        let badness = (round / shortest / RATIO).max(round / radius);
        if badness > 1.0 && badness.is_finite() {
            let corners = face.vertices().map(|corner| corner.fix());
            wanted.push(Wanted { badness, corners, centre, round });
        }
    }
    wanted.sort_by(|a, b| b.badness.total_cmp(&a.badness).then(a.centre.x.total_cmp(&b.centre.x)));
    let mut added = 0;
    for one in wanted {
        if added >= room {
            break;
        }
        if let Some(place) = place(cdt, &one)
            && cdt.insert_with_hint(place, one.corners[0]).is_ok()
        {
            added += 1;
        }
    }
    added
}

/// Where a way through triangles ends: in one, or at an edge of a ring.
enum End<'a> {
    In(Face<'a>),
    At(Edge<'a>),
}

/// Steps of a way, at most.
const STEPS: u32 = 1000;

/// The triangle with these corners, if it is still there.
fn still<'a>(cdt: &'a Cdt, [a, b, c]: [FixedVertexHandle; 3]) -> Option<Face<'a>> {
    let edge = cdt.get_edge_from_neighbors(a, b)?;
    (edge.next().to().fix() == c).then(|| edge.face().as_inner()).flatten()
}

/// The way from a triangle to a place, over any edge that the place is beyond; in Delaunay triangulations it ends (O. Devillers
/// and others 2002).
fn walk<'a>(mut face: Face<'a>, place: Point2<f64>) -> Option<End<'a>> {
    for _ in 0..STEPS {
        let Some(edge) = face.adjacent_edges().into_iter().find(|edge| edge.side_query(place).is_on_right_side()) else {
            return Some(End::In(face));
        };
        if edge.is_constraint_edge() {
            return Some(End::At(edge));
        }
        face = edge.rev().face().as_inner()?;
    }
    None
}

/// Where to put the place for a triangle: in the centre of its circle, or where the way there from its middle meets a ring, above
/// that edge. `None` if others are nearer there than is good.
fn place(cdt: &Cdt, wanted: &Wanted) -> Option<Point2<f64>> {
    let first = still(cdt, wanted.corners)?;
    let (mut place, mut clear) = (wanted.centre, 0.86 * wanted.round);
    let is_low = |edge: &Edge<'_>, place: Point2<f64>, least: f64| {
        edge.is_constraint_edge() && height(edge.positions(), place) < least * edge.length_2().sqrt()
    };
    let mut end = walk(first, place)?;
    let low = match &end {
        End::At(edge) => Some(*edge),
        End::In(face) => face.adjacent_edges().into_iter().find(|edge| is_low(edge, place, HEIGHTS[0])),
    };
    if let Some(edge) = low {
        // Triangles are at the left of their edges.
        let [a, b] = edge.positions();
        let [x, y] = [b.x - a.x, b.y - a.y];
        place = Point2::new(0.5 * (a.x + b.x) - HEIGHTS[1] * y, 0.5 * (a.y + b.y) + HEIGHTS[1] * x);
        clear = 0.6 * squared(x, y).sqrt();
        end = walk(edge.face().as_inner()?, place)?;
    }
    let End::In(face) = end else { return None };
    let is_clear = face.positions().iter().all(|corner| squared(corner.x - place.x, corner.y - place.y) >= clear * clear);
    let is_above = !face.adjacent_edges().iter().any(|edge| is_low(edge, place, 0.9 * HEIGHTS[0]));
    (is_clear && is_above).then_some(place)
}

fn squared(x: f64, y: f64) -> f64 {
    x * x + y * y
}

fn height([a, b]: [Point2<f64>; 2], place: Point2<f64>) -> f64 {
    let [x, y] = [b.x - a.x, b.y - a.y];
    ((place.y - a.y) * x - (place.x - a.x) * y).abs() / squared(x, y).sqrt()
}

fn shoelace(ring: &[[f64; 2]]) -> f64 {
    let Some(&[x, y]) = ring.first() else { return 0.0 };
    0.5 * ring.windows(2).map(|pair| (pair[0][0] - x) * (pair[1][1] - y) - (pair[0][1] - y) * (pair[1][0] - x)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(side: f64, edges: usize) -> Vec<[f64; 2]> {
        let corners = [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side], [0.0, 0.0]];
        let edge = |pair: &[[f64; 2]]| {
            let (a, b) = (pair[0], pair[1]);
            (0..edges).map(move |at| [0, 1].map(|axis| a[axis] + (b[axis] - a[axis]) * at as f64 / edges as f64))
        };
        corners.windows(2).flat_map(edge).collect()
    }

    #[test]
    fn a_square_with_a_hole_is_divided_and_a_bow_tie_refused() {
        let hole = vec![[1.0, 1.0], [1.0, 2.0], [2.0, 2.0], [2.0, 1.0]];
        let flat = triangles(&[square(4.0, 4), hole], f64::INFINITY, 1000).unwrap();
        assert!(flat.places.len() >= 20 && flat.triangles.len() >= 20);
        assert_eq!(triangles(&[vec![[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]], 1.0, 9), None);
        // The hole is outside.
        let far = vec![[5.0, 5.0], [5.0, 6.0], [6.0, 6.0]];
        assert_eq!(triangles(&[square(4.0, 1), far], 1.0, 9), None);
    }

    /// Edges of 0.25 on a square of 4: about 2 · 16² · 2/√3 triangles, none of them flat.
    #[test]
    fn triangles_within_are_as_large_as_asked_for() {
        let flat = triangles(&[square(4.0, 16)], 0.25, 10_000).unwrap();
        assert!((400..1400).contains(&flat.triangles.len()), "{}", flat.triangles.len());
        let point = |number: u32| [flat.places[number as usize][0], flat.places[number as usize][1], 0.0];
        let worst =
            flat.triangles.iter().map(|triangle| triangle.map(point)).map(|[a, b, c]| super::super::mesh::of_triangle(a, b, c));
        let worst = worst.fold(1.0, f64::min);
        assert!(worst > 0.4, "{worst}");
    }
}
