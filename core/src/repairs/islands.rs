//! Islands: a loose piece of surface inside a hole is joined to the hole's rim, so that one patch closes both (METHODS C1).
//!
//! Filled each for itself, the hole would be closed underneath the island and the island become a body of nearly no thickness. Two
//! triangles between the nearest vertices of both rims make one simple loop of them, which is then filled like any other.

use glam::DVec3;

use super::work::Work;
use crate::boxes::BoxTree;
use crate::holes::loops::{self, Loop};
use crate::shop::components::{Components, Reversed, Through};
use crate::shop::{Origin, Shop, Vertex};
use crate::sums::Bounds;
use crate::survey::Survey;

/// Rims run opposite ways round when seen from outside: cosine between their normals, at most.
const OPPOSITE: f64 = -0.5;
/// An island's vertices lie no farther from the plane of the hole than this share of the hole's size (the root of its area).
const MAX_OFF_PLANE: f64 = 0.5;

/// A loop with its plane.
struct Rim {
    vertices: Vec<Vertex>,
    component: u32,
    bounds: Bounds,
    centre: DVec3,
    /// Newell's normal: twice the enclosed area long.
    normal: DVec3,
}

/// Joins every island to the smallest hole around it; returns the new triangles.
pub(super) fn bridge(survey: &Survey<'_>, work: &mut Work<'_>) -> Vec<u32> {
    let (shop, edges) = work.edges();
    let components = Components::of(survey, shop, edges, &Reversed::none(survey), Through::EveryEdge);
    let mut rims: Vec<Rim> = loops::find(shop, edges).iter().map(|l| Rim::new(shop, &components, l)).collect();
    let mut loops_of = vec![0u32; components.list.len()];
    rims.iter().for_each(|r| loops_of[r.component as usize] += 1);
    let tree = BoxTree::new(&rims.iter().map(|r| r.bounds).collect::<Vec<_>>());
    let mut found = Vec::new();
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for (i, island) in rims.iter().enumerate().filter(|(_, r)| loops_of[r.component as usize] == 1) {
        tree.meeting(&island.bounds, &mut found);
        let area = components.list[island.component as usize].extent.area;
        let around = found.iter().map(|j| *j as usize).filter(|j| {
            let hole = &rims[*j];
            hole.component != island.component
                // An island is smaller than the rest of what it belongs to, and than the hole.
                && area < components.list[hole.component as usize].extent.area
                && survey.measure.area_of(area) < hole.normal.length() / 2.0
                && hole.surrounds(island, shop)
        });
        if let Some(hole) = around.min_by(|a, b| rims[*a].normal.length().total_cmp(&rims[*b].normal.length())) {
            pairs.push((hole, i));
        }
    }
    let mut bridges = Vec::new();
    for (hole, island) in pairs {
        let inner = std::mem::take(&mut rims[island].vertices);
        // An island in a hole that is an island's own is for another day: its rim has gone into another one.
        if let Some((joined, triangles)) = join(work, &rims[hole].vertices, &inner) {
            rims[hole].vertices = joined;
            bridges.extend(triangles.map(|t| work.add(t, Origin::Patch, crate::chunk::NONE)));
        }
    }
    bridges
}

impl Rim {
    fn new(shop: &Shop, components: &Components, rim: &Loop) -> Self {
        let points: Vec<DVec3> = rim.vertices.iter().map(|v| shop.place(*v)).collect();
        let mut bounds = Bounds::EMPTY;
        bounds.include(&rim.points(shop));
        let n = points.len();
        let centre = points.iter().sum::<DVec3>() / n as f64;
        let normal = (0..n).map(|i| (points[i] - centre).cross(points[(i + 1) % n] - centre)).sum();
        let component = components.of_triangle[rim.triangles[0] as usize];
        Self { vertices: rim.vertices.clone(), component, bounds, centre, normal }
    }

    /// Does the other rim run the other way round, near this one's plane and inside it?
    fn surrounds(&self, other: &Self, shop: &Shop) -> bool {
        let size = self.normal.length();
        if size == 0.0 || self.normal.dot(other.normal) > OPPOSITE * size * other.normal.length() {
            return false;
        }
        let off_plane = MAX_OFF_PLANE * (size / 2.0).sqrt();
        // Seen along the axis nearest to the normal.
        let axis = (1..3).fold(0, |best, k| if self.normal[k].abs() > self.normal[best].abs() { k } else { best });
        let flat = |v: Vertex| {
            let p = shop.place(v);
            [p[(axis + 1) % 3], p[(axis + 2) % 3]]
        };
        let polygon: Vec<[f64; 2]> = self.vertices.iter().map(|v| flat(*v)).collect();
        other.vertices.iter().all(|v| {
            let away = (shop.place(*v) - self.centre).dot(self.normal).abs() / size;
            away <= off_plane && is_inside(&polygon, flat(*v))
        })
    }
}

/// Joins two rims at their nearest vertices: the loop that is left, and the two triangles.
fn join(shop: &Shop, outer: &[Vertex], inner: &[Vertex]) -> Option<(Vec<Vertex>, [[Vertex; 3]; 2])> {
    let (n, m) = (outer.len(), inner.len());
    let mut best: Option<(f64, usize, usize)> = None;
    for (i, v) in outer.iter().enumerate() {
        for (j, w) in inner.iter().enumerate() {
            let away = shop.distance(*v, *w);
            if best.is_none_or(|(d, ..)| away < d) {
                best = Some((away, i, j));
            }
        }
    }
    let (_, i, j) = best?;
    let (a, a_next) = (outer[i], outer[(i + 1) % n]);
    let (b, b_last) = (inner[j], inner[(j + m - 1) % m]);
    let triangles = [[a, a_next, b], [b_last, b, a_next]];
    let flat = |t: &[Vertex; 3]| {
        let [p, q, r] = t.map(|v| &shop.positions[v as usize]);
        crate::chunk::is_collinear(p, q, r)
    };
    let new_edges = [(a, b), (a_next, b), (a_next, b_last)];
    if triangles.iter().any(flat) || new_edges.iter().any(|(p, q)| shop.has_edge(*p, *q)) {
        return None;
    }
    let way = (0..n).map(|k| outer[(i + 1 + k) % n]).chain((0..m).map(|k| inner[(j + k) % m]));
    Some((way.collect(), triangles))
}

/// Whether a point lies in a polygon, by crossings of a ray; half-open, so that a vertex counts once.
fn is_inside(polygon: &[[f64; 2]], p: [f64; 2]) -> bool {
    let n = polygon.len();
    (0..n).fold(false, |inside, i| {
        let (a, b) = (polygon[i], polygon[(i + 1) % n]);
        let crosses = (a[1] > p[1]) != (b[1] > p[1]) && p[0] < (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]) + a[0];
        inside ^ crosses
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{after, plate, shifted};

    #[test]
    fn an_island_is_joined_to_the_hole_around_it() {
        let ring = plate(6, |x, y| !(1..5).contains(&x) || !(1..5).contains(&y));
        let island = plate(6, |x, y| (2..4).contains(&x) && (2..4).contains(&y));
        let got = after(&[ring.clone(), island.clone()].concat(), |d, _| bridge(&d.survey, &mut Work::new(&mut d.shop)).len());
        // Outer rim, and one loop of hole and island.
        assert_eq!((got.result, got.defects.components, got.defects.boundary_loops), (2, 1, 2));
        assert_eq!((got.defects.nonmanifold_edges, got.defects.inconsistent_edges), (0, 0));
        // Beside the ring it is in no hole.
        let apart = [ring, shifted(&island, [10.0, 0.0, 0.0])].concat();
        assert_eq!(after(&apart, |d, _| bridge(&d.survey, &mut Work::new(&mut d.shop)).len()).result, 0);
    }
}
