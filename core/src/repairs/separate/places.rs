//! Where a copy of a vertex may stand: directions, in their order.

use glam::DVec3;

/// Ways to go from a vertex of surface with these unit normals, turned inward: first to the middle of the smallest ball around their ends, which
/// leads away from all planes alike if any way leads into the material behind each of them; then the opposite way, along the axes, and between
/// them. Of each the largest component is 1.
pub(crate) fn directions(inward: impl Iterator<Item = DVec3>) -> Vec<DVec3> {
    let inward: Vec<DVec3> = inward.collect();
    let mut middle = inward.first().copied().unwrap_or(DVec3::ZERO);
    // Bădoiu & Clarkson, "Smaller core-sets for balls", SODA 2003.
    for k in 2..=64 {
        let far = inward.iter().fold((0.0, middle), |far, n| {
            let distance = (*n - middle).length_squared();
            if distance > far.0 { (distance, *n) } else { far }
        });
        middle += (far.1 - middle) / f64::from(k);
    }
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|d| [d, -d]);
    let between = (0..8).map(|k| DVec3::from_array([0, 1, 2].map(|bit| if k >> bit & 1 == 1 { 1.0 } else { -1.0 })));
    let largest = middle.abs().max_element();
    let own = (largest > 1e-6).then(|| middle / largest).into_iter().flat_map(|d| [d, -d]);
    own.chain(axes).chain(between).collect()
}

/// More ways to go, where all of these are blocked: along the edges that end there, and between two axes. Of each the largest component is 1.
pub(crate) fn sideways(edges: &[DVec3]) -> Vec<DVec3> {
    let along = edges.iter().map(|edge| *edge / edge.abs().max_element());
    let signs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let between = (0..3).flat_map(|k| {
        signs.map(|(x, y)| {
            let mut way = [0.0; 3];
            (way[k], way[(k + 1) % 3]) = (x, y);
            DVec3::from_array(way)
        })
    });
    along.chain(between).collect()
}
