//! Triangles of no area on three distinct vertices: removed, and the T-junction they covered closed (METHODS A1, C3).
//!
//! Such a triangle lies along its longest edge, with the third vertex inside it. Every other triangle at the long edge is split at
//! that vertex, which closes the surface without moving anything; dropping the triangle alone would open it.

use super::work::{Pass, Work};

/// Removes collinear triangles; returns how many.
pub(super) fn remove(shop: &mut Work<'_>) -> u64 {
    // After a pass none is left, and only a new vertex makes one.
    let mut left: Vec<u32> = match shop.changed_for(Pass::Collinear) {
        None => shop.living().filter(|t| shop.is_collinear(*t)).collect(),
        Some(changed) => changed.into_iter().filter(|t| shop.lives(*t) && shop.is_collinear(*t)).collect(),
    };
    let mut removed = 0;
    // Each round takes those whose neighbours are not collinear themselves; a chain unravels from its end.
    while !left.is_empty() {
        let before = left.len();
        left.retain(|t| !try_remove(shop, *t, false));
        removed += (before - left.len()) as u64;
        if left.len() == before {
            // A knot of collinear triangles only. The longest goes first: what its neighbours there are split into is shorter than it, so that this ends.
            let extent = |t: &u32| longest(shop, *t).1;
            let Some(at) = (0..before).reduce(|a, b| if extent(&left[b]) > extent(&left[a]) { b } else { a }) else { break };
            let t = left.remove(at);
            let first = shop.triangles.len() as u32;
            try_remove(shop, t, true);
            left.extend((first..shop.triangles.len() as u32).filter(|t| shop.is_collinear(*t)));
            removed += 1;
        }
    }
    removed
}

/// Which edge of a triangle is its longest, from its corner of that number on, and how long it is.
fn longest(shop: &Work<'_>, t: u32) -> (usize, f64) {
    let v = shop.triangles[t as usize].v;
    let length = |k: usize| shop.distance(v[k], v[(k + 1) % 3]);
    (1..3).fold((0, length(0)), |best, k| if length(k) > best.1 { (k, length(k)) } else { best })
}

/// Removes `t` unless a triangle at its long edge is collinear, too, and `force` is off.
fn try_remove(shop: &mut Work<'_>, t: u32, force: bool) -> bool {
    if !shop.triangles[t as usize].alive {
        return true;
    }
    let v = shop.triangles[t as usize].v;
    let (long, _) = longest(shop, t);
    let (a, b, middle) = (v[long], v[(long + 1) % 3], v[(long + 2) % 3]);
    let others: Vec<u32> =
        shop.star(a).map(|(o, _)| o).filter(|o| *o != t && shop.triangles[*o as usize].v.contains(&b)).collect();
    // On the same three vertices: it goes, too, since nothing would be left for its long edge.
    let lies_on_it = |shop: &Work<'_>, o: u32| shop.triangles[o as usize].v.contains(&middle);
    if !force && others.iter().any(|o| !lies_on_it(shop, *o) && shop.is_collinear(*o)) {
        return false;
    }
    shop.kill(t);
    for o in others {
        if lies_on_it(shop, o) {
            shop.kill(o);
        } else {
            split(shop, o, [a, b], &[middle]);
        }
    }
    true
}

/// Splits triangle `t` at vertices on its edge between `ends`, given in order from `ends[0]` to `ends[1]`, into a fan from the
/// opposite corner. Vertices that are the opposite corner are left out.
pub(super) fn split(shop: &mut Work<'_>, t: u32, ends: [u32; 2], at: &[u32]) {
    let triangle = shop.triangles[t as usize];
    let Some(k) = (0..3).find(|k| !ends.contains(&triangle.v[*k])) else { return };
    let (apex, from, to) = (triangle.v[k], triangle.v[(k + 1) % 3], triangle.v[(k + 2) % 3]);
    let mut stops: Vec<u32> = at.iter().copied().filter(|v| *v != apex).collect();
    if from == ends[1] {
        stops.reverse();
    }
    if stops.is_empty() {
        return;
    }
    shop.kill(t);
    let mut last = from;
    for next in stops.into_iter().chain([to]) {
        shop.add([apex, last, next], triangle.origin.of_part(), triangle.patch);
        last = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{after, cube};

    #[test]
    fn a_knot_of_nothing_but_triangles_of_no_area_goes() {
        // A loop on one line closed twice, by different triangles: every edge is used once each way.
        let [a, b, c, d] = [0.0, 3.0, 1.0, 2.0].map(|x| [x, 0.0, 0.0]);
        let mesh = [[a, b, c], [a, c, d], [b, a, d], [b, d, c]];
        let got = after(&mesh, |d, _| remove(&mut Work::new(&mut d.shop)));
        assert_eq!(got.defects.triangles, 0);
    }

    #[test]
    fn two_caps_back_to_back_go_together() {
        // A cube all whose edges are used once each way, and two triangles of no area on one of its edges, which take nothing from that.
        let mut mesh = cube();
        let [a, b, _] = mesh[0];
        let m = [0, 1, 2].map(|k| (a[k] + b[k]) / 2.0);
        mesh.extend([[a, b, m], [b, a, m]]);
        let got = after(&mesh, |_, _| ());
        assert_eq!((got.defects.degenerate_area, got.defects.unbalanced_edges), (2, 0));
        let got = after(&mesh, |d, _| remove(&mut Work::new(&mut d.shop)));
        assert_eq!((got.result, got.defects.degenerate_area, got.defects.unbalanced_edges), (2, 0, 0));
        assert!(got.verdict.good && (got.defects.volume - 1.0).abs() < 1e-9, "{:?}", got.verdict);
    }

    #[test]
    fn a_cap_over_a_t_junction_goes_and_the_neighbour_is_split() {
        // The first triangle is split in the middle of its long edge, its neighbour is not, and a triangle of no area joins them.
        let mut mesh = cube();
        let [a, b, c] = mesh.remove(0);
        let m = [0, 1, 2].map(|k| (a[k] + c[k]) / 2.0);
        mesh.extend([[a, b, m], [m, b, c], [a, m, c]]);
        let got = after(&mesh, |d, _| {
            assert_eq!((d.defects.degenerate_area, d.defects.boundary_edges), (1, 0), "closed by the cap");
            remove(&mut Work::new(&mut d.shop))
        });
        // One goes, one becomes two.
        assert_eq!((got.result, got.defects.triangles), (1, 14));
        assert!(got.verdict.good && (got.defects.volume - 1.0).abs() < 1e-9, "{:?}", got.verdict);
    }
}
