//! Which entities a file has, in their order.

use crate::curves::curve::Spline;
use crate::curves::export::model::{Body, EdgeUse, Face, Rings};
use crate::curves::vector::distance;

/// An entity, its references as places in the plan.
pub(super) enum Item<'a> {
    /// The surface of a face.
    Surface(usize),
    /// The curve of an edge, in the direction of its loop.
    Curve { edge: usize, is_reversed: bool },
    /// A curve of parameters in the direction of its loop; with `u` and `v` exchanged, if its surface has them so.
    Parametric { curve: &'a Spline, is_reversed: bool, is_exchanged: bool },
    /// The straight way from the end of a curve of parameters to the next one, along a side that is a point in space.
    Bridge([[f64; 2]; 2]),
    /// Entities one behind the other.
    Composite { parts: Vec<usize>, is_parametric: bool },
    /// A loop: surface, curve of parameters, curve in space.
    OnSurface { surface: usize, parametric: Option<usize>, curve: usize },
    /// A face: surface, outer loop unless it is the surface's own boundary, holes.
    Trimmed { surface: usize, outer: Option<usize>, inner: Vec<usize> },
}

/// All entities; each has a single owner, as their status says.
pub(super) struct Plan<'a> {
    pub(super) items: Vec<Item<'a>>,
}

impl<'a> Plan<'a> {
    /// O(edges used).
    pub(super) fn of(body: &'a Body, rings: &'a [Rings<'a>]) -> Self {
        let mut plan = Self { items: Vec::new() };
        for (number, (face, rings)) in body.faces.iter().zip(rings).enumerate() {
            let surface = plan.push(Item::Surface(number));
            let mut rings = rings.iter();
            let outer = rings.next().filter(|ring| !ring.is_empty()).map(|ring| plan.ring(face, ring, surface));
            let inner = rings.map(|ring| plan.ring(face, ring, surface)).collect();
            plan.push(Item::Trimmed { surface, outer, inner });
        }
        plan
    }

    fn push(&mut self, item: Item<'a>) -> usize {
        self.items.push(item);
        self.items.len() - 1
    }

    fn ring(&mut self, face: &'a Face, uses: &'a [EdgeUse], surface: usize) -> usize {
        let parametric = self.parametric(face, uses);
        let curves = uses.iter().map(|one| Item::Curve { edge: one.edge, is_reversed: one.is_reversed }).collect();
        let curve = self.chain(curves, false);
        self.push(Item::OnSurface { surface, parametric, curve })
    }

    /// The loop in the space of parameters, if all of its edges have curves there; sides that are points in space are bridged.
    fn parametric(&mut self, face: &'a Face, uses: &'a [EdgeUse]) -> Option<usize> {
        let is_exchanged = !face.is_same_sense;
        let curves = uses.iter().map(|one| one.pcurve.as_ref()).collect::<Option<Vec<_>>>()?;
        let [[u0, u1], [v0, v1]] = face.surface.domain();
        let slack = 1e-9 * (u1 - u0).max(v1 - v0);
        let ends = |one: &EdgeUse, curve: &Spline| {
            let [start, end] = curve.domain().map(|t| curve.point_and_derivative(t).0);
            if one.is_reversed { [end, start] } else { [start, end] }
        };
        let mut items = Vec::with_capacity(curves.len());
        let all: Vec<_> = uses.iter().zip(curves).collect();
        for ((one, curve), (next, after)) in all.iter().zip(all.iter().cycle().skip(1)) {
            items.push(Item::Parametric { curve, is_reversed: one.is_reversed, is_exchanged });
            let ([_, from], [to, _]) = (ends(one, curve), ends(next, after));
            if distance(from, to) > slack {
                let plane = |[u, v, _]: [f64; 3]| if is_exchanged { [v, u] } else { [u, v] };
                items.push(Item::Bridge([plane(from), plane(to)]));
            }
        }
        Some(self.chain(items, true))
    }

    /// Curves one behind the other; a single one needs no composite.
    fn chain(&mut self, items: Vec<Item<'a>>, is_parametric: bool) -> usize {
        let parts: Vec<usize> = items.into_iter().map(|item| self.push(item)).collect();
        match parts.as_slice() {
            &[single] => single,
            _ => self.push(Item::Composite { parts, is_parametric }),
        }
    }
}
