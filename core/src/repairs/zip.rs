//! Small gaps zipped: vertices that face each other across a narrow gap become one (METHODS C2, C4, basic).
//!
//! Two boundary vertices face each other when each is the other's nearest within a share of the edges around them, and the surfaces
//! they end point at each other. (The rims of a thin shell lie as near, but point the same way: they are left alone.) A merge that
//! would turn a triangle over, flatten it, or make an edge of more than two triangles is left out.

use glam::DVec3;

use super::work::Work;
use crate::report::LoopClass;
use crate::settings::Profile;
use crate::shop::edges::{Edge, Edges};
use crate::shop::{self, Shop, Vertex, near};

/// Facing: cosine between the directions in which the two surfaces end, at most.
const FACING: f64 = -0.5;
/// A moved triangle's normal keeps at least this cosine to what it was.
const STEADY: f64 = 0.7;

/// Zips gaps narrower than the profile's share of the shortest edges at their vertices; returns how many vertices were merged into another.
pub(super) fn zip(work: &mut Work<'_>, profile: &Profile) -> u64 {
    let share = profile.gap_edge_share;
    if share <= 0.0 || profile.leave_open.contains(&LoopClass::Gap) {
        return 0;
    }
    let widest = if profile.max_gap_mm > 0.0 { profile.max_gap_mm } else { f64::INFINITY };
    let (shop, edges) = work.edges();
    let vertices = near::boundary_vertices(edges);
    let outward = ends(shop, edges);
    let reach: Vec<f64> = vertices.iter().map(|v| (shop.shortest_edge(*v) * share).min(widest)).collect();
    let nearest = near::nearest_apart(shop, &vertices, &reach);
    let mut pairs: Vec<(f64, Vertex, Vertex)> = Vec::new();
    for (i, found) in nearest.iter().enumerate() {
        // Mutual, and each pair once.
        if let Some(j) = found.filter(|j| *j > i && nearest[*j] == Some(i)) {
            let (v, w) = (vertices[i], vertices[j]);
            if shop::cosine(outward[v as usize], outward[w as usize]) < FACING {
                pairs.push((shop.distance(v, w), v, w));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut merged = 0;
    for (_, v, w) in pairs {
        let (stay, go) = if work.star(w).count() > work.star(v).count() { (w, v) } else { (v, w) };
        if may_merge(work, stay, go) {
            work.merge(stay, go);
            merged += 1;
        }
    }
    merged
}

/// For each boundary vertex the direction in which its surface ends: away from the triangles, across their boundary edges.
fn ends(shop: &Shop, edges: &Edges) -> Vec<DVec3> {
    let mut all = vec![DVec3::ZERO; shop.positions.len()];
    for edge in edges.iter().filter(Edge::is_boundary) {
        let t = edge.uses[0].triangle;
        let Some(apex) = shop.triangles[t as usize].v.into_iter().find(|v| *v != edge.low && *v != edge.high) else { continue };
        let along = shop.vector(edge.low, edge.high);
        let from_apex = shop.vector(apex, edge.low);
        let part = from_apex.dot(along) / along.dot(along).max(f64::MIN_POSITIVE);
        for v in [edge.low, edge.high] {
            all[v as usize] += from_apex - part * along;
        }
    }
    all
}

/// Would the mesh stay as sound as it is?
fn may_merge(shop: &Shop, stay: Vertex, go: Vertex) -> bool {
    let corners = |t: u32| shop.triangles[t as usize].v;
    if shop.star(go).any(|(t, _)| corners(t).contains(&stay)) {
        return false;
    }
    let mut neighbours: Vec<Vertex> = shop.star(go).flat_map(|(t, _)| corners(t)).filter(|x| *x != go).collect();
    neighbours.sort_unstable();
    neighbours.dedup();
    let uses = |v: Vertex, x: Vertex| shop.star(v).filter(|(t, _)| corners(*t).contains(&x)).count();
    // An edge that both have becomes one.
    let manifold = neighbours.iter().all(|x| {
        let shared = uses(stay, *x);
        shared == 0 || shared + uses(go, *x) <= 2
    });
    manifold
        && shop.star(go).all(|(t, k)| {
            let before = shop.points(t);
            let mut after = before;
            after[k] = shop.positions[stay as usize];
            shop::cosine(normal(before), normal(after)) >= STEADY
        })
}

fn normal(corners: [[f32; 3]; 3]) -> DVec3 {
    let [a, b, c] = corners.map(shop::place);
    (b - a).cross(c - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Corners, after, plate, reversed, shifted};

    /// A plate cut along its middle line, where the right side stands this far off at three vertices.
    fn slit(gap: f32) -> Vec<Corners> {
        let open = |p: [f32; 3]| if p[0] == 2.0 && (1.0..=3.0).contains(&p[1]) { [2.0 + gap, p[1], p[2]] } else { p };
        let right = plate(4, |x, _| x >= 2).into_iter().map(|t| t.map(open));
        plate(4, |x, _| x < 2).into_iter().chain(right).collect()
    }

    #[test]
    fn rims_that_face_each_other_across_a_narrow_gap_are_joined() {
        let zipped = |gap: f32, share: f64| {
            let profile = Profile { gap_edge_share: share, ..Profile::default() };
            after(&slit(gap), |d, _| zip(&mut Work::new(&mut d.shop), &profile))
        };
        let got = zipped(0.125, 0.35);
        // Only the rim of the plate is left.
        assert_eq!((got.result, got.defects.boundary_loops, got.defects.boundary_edges), (3, 1, 16));
        assert_eq!(got.defects.nonmanifold_edges + got.defects.inconsistent_edges, 0);
        assert_eq!(zipped(0.5, 0.35).result, 0, "too wide");
        assert_eq!(zipped(0.125, 0.0).result, 0, "switched off");
    }

    #[test]
    fn the_rims_of_a_thin_shell_are_left_alone() {
        // As near as above, but both surfaces end in the same direction.
        let bottom = reversed(&plate(2, |_, _| true));
        let top = shifted(&plate(2, |_, _| true), [0.0, 0.0, 0.125]);
        assert_eq!(after(&[bottom, top].concat(), |d, _| zip(&mut Work::new(&mut d.shop), &Profile::default())).result, 0);
    }
}
