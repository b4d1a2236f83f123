//! Edges and vertices of curves, shared by the outlines that have them.

use crate::curves::Use;
use crate::curves::curve::{Shape, Spline};
use crate::curves::export::{Edge, EdgeUse};
use crate::curves::vector::{Point, distance};

use super::super::entry::Filled;
use super::super::network;
use super::super::options::Outline;

/// Ends farther apart than this share of their curve do not meet.
const GAP: f64 = 1e-3;

/// Edges so far, and the vertices between them.
#[derive(Debug, Default)]
pub(super) struct Edges {
    pub(super) vertices: Vec<Point>,
    pub(super) edges: Vec<Edge>,
    /// How far curves and vertices are off each other.
    pub(super) tolerance: f64,
    /// The edges of each curve, in its direction: one, but where it had to be cut.
    pieces: Vec<Vec<usize>>,
}

impl Edges {
    /// Of all curves that outlines have: as they were fitted, where that was needed, else exact. O(control points).
    pub(super) fn new(shapes: &[&Shape], outlines: &[Outline], filled: &Filled) -> Self {
        let mut is_used = vec![false; shapes.len()];
        for one in outlines.iter().flat_map(Outline::rings).flatten() {
            is_used.iter_mut().skip(one.curve).take(1).for_each(|used| *used = true);
        }
        let roots = network::joined(shapes.len(), outlines);
        let mut known: Vec<Option<usize>> = vec![None; roots.len()];
        let mut edges = Self::default();
        for (number, (shape, is_used)) in shapes.iter().zip(is_used).enumerate() {
            let fitted = filled.curves.get(number).and_then(Option::as_ref);
            let spline = fitted.cloned().or_else(|| shape.to_spline().ok());
            let edge = spline.filter(|_| is_used).map(|spline| {
                let reach = GAP * distance_around(&spline);
                let mut side = 0;
                let ends = spline.domain().map(|t| {
                    let point = spline.point_and_derivative(t).0;
                    let root = roots.get(2 * number + side).copied().unwrap_or_default();
                    side += 1;
                    edges.vertex(&mut known, root, point, reach)
                });
                edges.add(spline, ends)
            });
            edges.pieces.push(edge.into_iter().collect());
        }
        let largest = edges.vertices.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        // What files keep of numbers, and what other kernels call the same.
        edges.tolerance = edges.tolerance.max(1e-9 * largest).max(f64::MIN_POSITIVE);
        edges
    }

    fn vertex(&mut self, known: &mut [Option<usize>], root: usize, point: Point, reach: f64) -> usize {
        let Some(entry) = known.get_mut(root) else { return 0 };
        let number = *entry.get_or_insert_with(|| {
            self.vertices.push(point);
            self.vertices.len() - 1
        });
        let vertex = self.vertices.get(number).copied().unwrap_or(point);
        if distance(vertex, point) > reach {
            return self.add_vertex(point);
        }
        self.tolerance = self.tolerance.max(distance(vertex, point));
        number
    }

    /// Adds a vertex.
    pub(super) fn add_vertex(&mut self, point: Point) -> usize {
        self.vertices.push(point);
        self.vertices.len() - 1
    }

    /// Adds an edge.
    pub(super) fn add(&mut self, curve: Spline, ends: [usize; 2]) -> usize {
        self.edges.push(Edge { curve, ends });
        self.edges.len() - 1
    }

    /// The curve of an edge.
    pub(super) fn curve(&self, one: &EdgeUse) -> Option<&Spline> {
        self.edges.get(one.edge).map(|edge| &edge.curve)
    }

    /// The vertices where an edge begins and ends in the direction of its loop.
    pub(super) fn ends(&self, one: &EdgeUse) -> Option<[usize; 2]> {
        let [start, end] = self.edges.get(one.edge)?.ends;
        Some(if one.is_reversed { [end, start] } else { [start, end] })
    }

    /// Whether each edge of a loop begins where the one before it ends.
    pub(super) fn is_closed(&self, ring: &[EdgeUse]) -> bool {
        let mut pairs = ring.iter().zip(ring.iter().cycle().skip(1));
        pairs.all(|(one, next)| self.ends(one).zip(self.ends(next)).is_some_and(|([_, end], [start, _])| end == start))
    }

    /// The edges of a curve in the direction of its use; `None` if it has none.
    pub(super) fn uses(&self, one: &Use) -> Option<Vec<EdgeUse>> {
        let edges = self.pieces.get(one.curve).filter(|edges| !edges.is_empty())?;
        let mut uses: Vec<EdgeUse> = edges.iter().map(|edge| EdgeUse { edge: *edge, is_reversed: false, pcurve: None }).collect();
        if one.is_reversed {
            turn(&mut uses);
        }
        Some(uses)
    }

    /// Cuts an edge at a parameter of its curve, for all outlines that have it.
    pub(super) fn split(&mut self, edge: usize, t: f64) -> Option<()> {
        let curve = self.edges.get(edge)?.curve.clone();
        let [low, high] = curve.domain();
        let parts = [[low, t], [t, high]].map(|part| curve.clone().on(part).and_then(|part| part.clamped()).ok());
        let [Some(first), Some(second)] = parts else { return None };
        let middle = self.add_vertex(curve.point_and_derivative(t).0);
        let old = self.edges.get_mut(edge)?;
        let end = old.ends[1];
        (old.curve, old.ends[1]) = (first, middle);
        let new = self.add(second, [middle, end]);
        let pieces = self.pieces.iter_mut().find(|pieces| pieces.contains(&edge))?;
        let at = pieces.iter().position(|piece| *piece == edge)?;
        pieces.insert(at + 1, new);
        Some(())
    }

    /// Loops of an outline, or those against its direction, without curves of parameters.
    pub(super) fn rings(&self, outline: &Outline, is_flipped: bool) -> Option<Vec<Vec<EdgeUse>>> {
        let ring = |uses: &Vec<Use>| -> Option<Vec<EdgeUse>> {
            let all: Vec<Vec<EdgeUse>> = uses.iter().map(|one| self.uses(one)).collect::<Option<_>>()?;
            Some(all.into_iter().flatten().collect())
        };
        let mut rings: Vec<Vec<EdgeUse>> = outline.rings().map(ring).collect::<Option<_>>()?;
        if is_flipped {
            rings.iter_mut().for_each(|ring| turn(ring));
        }
        Some(rings)
    }
}

/// The length of a curve's control polygon.
fn distance_around(spline: &Spline) -> f64 {
    spline.points().windows(2).map(|pair| distance(pair[0], pair[1])).sum()
}

/// A straight curve of parameters, with the parameter of an edge.
pub(super) fn straight(edge: &Spline, ends: [[f64; 2]; 2]) -> Option<Spline> {
    let [low, high] = edge.domain();
    Spline::new(1, vec![low, low, high, high], ends.map(|[u, v]| [u, v, 0.0]).to_vec(), None, None).ok()
}

/// A loop in the other direction.
pub(super) fn turn(ring: &mut [EdgeUse]) {
    ring.reverse();
    ring.iter_mut().for_each(|one| one.is_reversed = !one.is_reversed);
}
