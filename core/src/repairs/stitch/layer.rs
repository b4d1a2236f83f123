//! What lies on a surface: near it, and facing the same way. Pieces of surface as a set of triangles with the edges where each piece ends.
//!
//! Decided in f64 with + − × ÷ √ only, within a reach: it says what is meant to be one surface, not what crosses.

use glam::DVec3;

use crate::geometry::boxes::BoxTree;
use crate::geometry::distance::{place, share_along, square_distance};
use crate::geometry::sums::Bounds;
use crate::geometry::tri_tri::Triangle as Corners;

/// Two surfaces face the same way if the cosine between their normals is at least this: up to about 25°.
const AGREE: f64 = 0.9;

/// Where on a piece of surface something lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Place {
    /// Within reach of where the piece ends.
    Rim,
    Inside,
}

/// How near is near.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// To a surface, so as to lie on it; 0: it is of no interest.
    pub(crate) on: f64,
    /// To where it ends, so as to lie at its rim.
    pub(crate) rim: f64,
}

/// A triangle of a piece, with its unit normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facet {
    pub(crate) corners: [DVec3; 3],
    pub(crate) normal: DVec3,
    pub(crate) piece: u32,
}

impl Facet {
    pub(crate) fn of(corners: &Corners, piece: u32) -> Self {
        let corners = corners.map(place);
        let [a, b, c] = corners;
        Self { corners, normal: (b - a).cross(c - a).normalize_or_zero(), piece }
    }

    pub(crate) fn centre(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (a + b + c) / 3.0
    }

    pub(crate) fn area(&self) -> f64 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a).length() / 2.0
    }

    /// The smallest of its heights.
    pub(crate) fn height(&self) -> f64 {
        let [a, b, c] = self.corners;
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a)).sqrt();
        if longest > 0.0 { (b - a).cross(c - a).length() / longest } else { 0.0 }
    }

    /// Does a segment run over its inside, farther than `rim` from its edges, and nowhere there farther than `reach` from its plane?
    fn is_crossed_by(&self, [from, to]: [DVec3; 2], Reach { on: reach, rim }: Reach) -> bool {
        let (mut start, mut end) = (0.0, 1.0);
        for k in 0..3 {
            let (a, b) = (self.corners[k], self.corners[(k + 1) % 3]);
            let inward = self.normal.cross(b - a).normalize_or_zero();
            let [at_start, at_end] = [from, to].map(|p| (p - a).dot(inward) - rim);
            if at_start <= 0.0 && at_end <= 0.0 {
                return false;
            }
            let cut = at_start / (at_start - at_end);
            if at_start < 0.0 {
                start = cut.max(start);
            } else if at_end < 0.0 {
                end = cut.min(end);
            }
        }
        start < end && [start, end].iter().all(|s| (from.lerp(to, *s) - self.corners[0]).dot(self.normal).abs() <= reach)
    }
}

/// An edge where a piece ends, with the normal of its triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RimEdge {
    pub(crate) ends: [DVec3; 2],
    pub(crate) normal: DVec3,
    pub(crate) piece: u32,
}

impl RimEdge {
    pub(crate) fn middle(&self) -> DVec3 {
        (self.ends[0] + self.ends[1]) / 2.0
    }

    /// Its point nearest to `p`.
    pub(crate) fn foot(&self, p: DVec3) -> DVec3 {
        let [a, b] = self.ends;
        a.lerp(b, share_along(p, a, b))
    }
}

/// Pieces of surface that may be asked what lies on them.
pub(crate) struct Layer {
    facets: Vec<Facet>,
    tree: Option<BoxTree>,
    pub(crate) rims: Vec<RimEdge>,
    rim_tree: Option<BoxTree>,
}

impl Layer {
    /// O(n log n).
    pub(crate) fn new(facets: Vec<Facet>, rims: Vec<RimEdge>) -> Self {
        let tree = |boxes: Vec<Bounds>| (!boxes.is_empty()).then(|| BoxTree::new(&boxes));
        Self {
            tree: tree(facets.iter().map(|f| around(&f.corners, 0.0)).collect()),
            rim_tree: tree(rims.iter().map(|r| around(&r.ends, 0.0)).collect()),
            facets,
            rims,
        }
    }

    /// On which pieces a point lies that faces along `normal`, and where on them; ascending, each once. `reach`: how near it must be to a
    /// piece, at most `most`.
    pub(crate) fn under(&self, p: DVec3, normal: DVec3, most: Reach, reach: impl Fn(u32) -> Reach) -> Vec<(u32, Place)> {
        let mut found = Vec::new();
        let mut pieces: Vec<u32> = Vec::new();
        if let Some(tree) = &self.tree {
            tree.meeting(&around(&[p], most.on), &mut found);
        }
        for facet in found.iter().map(|f| &self.facets[*f as usize]) {
            let reach = reach(facet.piece).on;
            if reach > 0.0
                && facet.normal.dot(normal) >= AGREE
                && !pieces.contains(&facet.piece)
                && square_distance(p, facet.corners) <= reach * reach
            {
                pieces.push(facet.piece);
            }
        }
        if pieces.is_empty() {
            return Vec::new();
        }
        pieces.sort_unstable();
        let near = self.rims_near(&around(&[p], most.rim));
        let is_rim = |piece: u32| {
            let reach = reach(piece).rim;
            near.iter().any(|r| r.piece == piece && p.distance_squared(r.foot(p)) <= reach * reach)
        };
        pieces.into_iter().map(|piece| (piece, if is_rim(piece) { Place::Rim } else { Place::Inside })).collect()
    }

    /// How far the nearest surface is, up to a limit.
    pub(crate) fn distance(&self, p: DVec3, most: f64) -> f64 {
        let mut found = Vec::new();
        if let Some(tree) = &self.tree {
            tree.meeting(&around(&[p], most), &mut found);
        }
        let squares = found.iter().map(|f| square_distance(p, self.facets[*f as usize].corners));
        squares.fold(most * most, f64::min).sqrt()
    }

    /// Does a rim run over the inside of a triangle, facing the same way?
    pub(crate) fn ends_over(&self, facet: &Facet, reach: Reach) -> bool {
        let near = self.rims_near(&around(&facet.corners, reach.on));
        near.iter().any(|r| r.normal.dot(facet.normal) >= AGREE && facet.is_crossed_by(r.ends, reach))
    }

    /// Rims in a box, in their order.
    pub(crate) fn rims_near(&self, wanted: &Bounds) -> Vec<&RimEdge> {
        let mut found = Vec::new();
        if let Some(tree) = &self.rim_tree {
            tree.meeting(wanted, &mut found);
        }
        found.iter().map(|r| &self.rims[*r as usize]).collect()
    }
}

/// The box around some points, wider by `by` on all sides, rounded outward.
pub(crate) fn around(points: &[DVec3], by: f64) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    for p in points {
        let lo = (*p - by).to_array().map(|x| (x as f32).next_down());
        let hi = (*p + by).to_array().map(|x| (x as f32).next_up());
        bounds.include(&[lo, hi]);
    }
    bounds
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEAR: Reach = Reach { on: 0.1, rim: 0.1 };

    /// The lower left half of the unit square, facing up, which ends at its long side.
    fn half() -> Layer {
        let facet = Facet::of(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], 7);
        let rim = RimEdge { ends: [facet.corners[1], facet.corners[2]], normal: DVec3::Z, piece: 7 };
        Layer::new(vec![facet], vec![rim])
    }

    #[test]
    fn a_point_lies_inside_at_the_rim_or_not_on_it() {
        let layer = half();
        let at = |x: f64, y: f64, z: f64, up: DVec3| layer.under(DVec3::new(x, y, z), up, NEAR, |_| NEAR);
        assert_eq!(at(0.2, 0.2, 0.1, DVec3::Z), [(7, Place::Inside)]);
        assert_eq!(at(0.5, 0.45, 0.0, DVec3::Z), [(7, Place::Rim)]);
        assert_eq!(at(0.2, 0.2, 0.11, DVec3::Z), [], "too high");
        assert_eq!(at(0.2, 0.2, 0.0, DVec3::NEG_Z), [], "it faces the other way");
        assert!(layer.under(DVec3::ZERO, DVec3::Z, NEAR, |_| Reach { on: 0.0, ..NEAR }).is_empty(), "of no interest");
    }

    #[test]
    fn a_rim_runs_over_a_triangle_or_along_it() {
        let layer = half();
        let over = |by: f64| {
            let corners = [[0.5, 0.5], [1.5, 0.5], [0.5, 1.5]].map(|[x, y]| [(x - by) as f32, (y - by) as f32, 0.05]);
            layer.ends_over(&Facet::of(&corners, 0), NEAR)
        };
        assert!(over(0.25));
        assert!(!over(0.0), "it only touches the corner");
        assert!(!over(-0.2), "it is beyond");
        let along = Facet::of(&[[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]], 0);
        assert!(!layer.ends_over(&along, NEAR), "its neighbour");
    }
}
