//! Which triangles of a mesh cross or overlap others.
//!
//! Two triangles *cross* where they have a segment in common that is not an edge of both; they *overlap* where they lie in one plane
//! and have an area in common. A point, and edge along edge, as at a hinge, are no more than touching. All signs are exact.

use super::boxes::Tree;
use super::exact::{collinear, side, turn};
use super::judgement::Triangle;

/// How many triangles cross or overlap another one. Triangles without area are left out.
///
/// O(n log n + pairs of touching boxes) time.
pub(super) fn meeting(triangles: &[Triangle]) -> u64 {
    let flat: Vec<Triangle> = triangles.iter().copied().filter(|&t| !collinear(t)).collect();
    let mut meets = vec![false; flat.len()];
    Tree::new(&flat).pairs(&mut |a, b| {
        let (a, b) = (a as usize, b as usize);
        // Of two that are counted already, nothing is to be learnt.
        if !(meets[a] && meets[b]) && meet(flat[a], flat[b]) {
            meets[a] = true;
            meets[b] = true;
        }
    });
    meets.into_iter().filter(|&meets| meets).count() as u64
}

/// Do two triangles cross or overlap? Both must have an area.
fn meet(a: Triangle, b: Triangle) -> bool {
    let of_b = b.map(|p| side(a, p));
    if of_b == [0; 3] {
        return overlap(a, b);
    }
    let Some(apex_b) = apex(of_b) else { return false };
    let of_a = a.map(|p| side(b, p));
    let Some(apex_a) = apex(of_a) else { return false };
    let edge = |sides: [i8; 3]| sides.iter().filter(|&&side| side == 0).count() == 2;
    if edge(of_a) && edge(of_b) {
        return false;
    }
    // Seen from its apex, a triangle cuts the line where the planes meet in two edges. With each apex in front of the other's plane,
    // these follow each other along the line in the order of the triangle's corners, so that two signs compare their places.
    let (mut a, mut b) = (a, b);
    a.rotate_left(apex_a);
    b.rotate_left(apex_b);
    if of_a[apex_a] < 0 {
        b.swap(1, 2);
    }
    if of_b[apex_b] < 0 {
        a.swap(1, 2);
    }
    side([a[0], a[1], b[0]], b[1]) < 0 && side([a[0], a[2], b[0]], b[2]) > 0
}

/// The corner that is alone on its side of a plane which the triangle passes through or has an edge in. `None`: it is on one side, or
/// touches the plane in one corner.
fn apex(sides: [i8; 3]) -> Option<usize> {
    (0..3).find(|&k| sides[k] != 0 && (0..3).all(|other| other == k || sides[other] != sides[k]))
}

/// Do two triangles of one plane have an area in common? Not if an edge of one has all of the other beyond it.
fn overlap(a: Triangle, b: Triangle) -> bool {
    // Onto two axes on which they have an area.
    let onto = |t: Triangle, (u, v): (usize, usize)| t.map(|p| [p[u], p[v]]);
    let Some(axes) = [(0, 1), (1, 2), (2, 0)].into_iter().find(|&axes| turn(onto(a, axes)) != 0) else { return false };
    let [a, b] = [onto(a, axes), onto(b, axes)];
    [(a, b), (b, a)].into_iter().all(|(t, other)| {
        let inside = turn(t);
        (0..3).all(|k| other.iter().any(|&p| turn([t[k], t[(k + 1) % 3], p]) == inside))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLOOR: Triangle = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

    /// In every order of corners, and either way round.
    fn both(a: Triangle, b: Triangle) -> bool {
        let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
        let found = meet(a, b);
        for i in orders {
            for j in orders {
                let (a, b) = (i.map(|k| a[k]), j.map(|k| b[k]));
                assert_eq!((meet(a, b), meet(b, a)), (found, found), "{a:?} {b:?}");
            }
        }
        found
    }

    #[test]
    fn a_segment_counts_and_a_point_does_not() {
        // Through the middle; through an edge; standing on the floor with an edge; with a corner.
        assert!(both(FLOOR, [[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0]]));
        assert!(both(FLOOR, [[-1.0, 1.0, -1.0], [2.0, 1.0, 1.0], [-1.0, 1.0, 1.0]]));
        assert!(both(FLOOR, [[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [1.0, 1.0, 1.0]]));
        assert!(!both(FLOOR, [[1.0, 1.0, 0.0], [2.0, 1.0, 1.0], [1.0, 1.0, 1.0]]));
        // Beside it, above it, and cutting its plane elsewhere.
        assert!(!both(FLOOR, [[9.0, 0.0, -1.0], [9.0, 1.0, 1.0], [9.0, 0.0, 1.0]]));
        assert!(!both(FLOOR, [[0.0, 0.0, 1.0], [1.0, 1.0, 2.0], [2.0, 0.0, 1.0]]));
        assert!(!both(FLOOR, [[3.0, 3.0, -1.0], [3.0, 3.0, 1.0], [4.0, 3.0, 1.0]]));
    }

    #[test]
    fn neighbours_meet_only_where_they_fold_into_each_other() {
        let [a, b, c] = FLOOR;
        // A hinge, shut and half shut; edge along a longer edge; a fan's neighbour, and one that dips through.
        assert!(!both(FLOOR, [b, a, [1.0, 1.0, 1.0]]));
        assert!(both(FLOOR, [b, a, [1.0, 1.0, 0.0]]));
        assert!(!both(FLOOR, [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 1.0]]));
        assert!(!both(FLOOR, [a, c, [0.0, 0.0, 3.0]]));
        assert!(!both(FLOOR, [a, [-1.0, -1.0, 1.0], [-1.0, -1.0, -1.0]]));
        assert!(both(FLOOR, [a, [1.0, 1.0, 1.0], [1.0, 1.0, -1.0]]));
    }

    #[test]
    fn in_one_plane_an_area_counts_and_an_edge_does_not() {
        let [a, b, c] = FLOOR;
        assert!(both(FLOOR, FLOOR));
        assert!(both(FLOOR, [[1.0, 1.0, 0.0], [9.0, 1.0, 0.0], [1.0, 9.0, 0.0]]));
        // Inside; a star that no corner of either is inside of; beside each other; apart.
        assert!(both(FLOOR, [[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [1.0, 2.0, 0.0]]));
        assert!(both(FLOOR, [[3.0, 3.0, 0.0], [-1.0, 3.0, 0.0], [3.0, -1.0, 0.0]]));
        assert!(!both(FLOOR, [b, c, [4.0, 4.0, 0.0]]));
        assert!(!both(FLOOR, [a, b, [0.0, -4.0, 0.0]]));
        assert!(!both(FLOOR, [[9.0, 0.0, 0.0], [10.0, 0.0, 0.0], [9.0, 1.0, 0.0]]));
    }

    /// Against rational arithmetic: the common part of two triangles on the line where their planes meet, in numerators over a common
    /// denominator. Corners are small integers, so that every kind of contact occurs.
    #[test]
    fn agrees_with_fractions() {
        type P = [i128; 3];
        let minus = |a: P, b: P| -> P { std::array::from_fn(|k| a[k] - b[k]) };
        let cross = |a: P, b: P| -> P { [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]] };
        let dot = |a: P, b: P| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let normal = |t: [P; 3]| cross(minus(t[1], t[0]), minus(t[2], t[0]));
        let heights = |t: [P; 3], of: [P; 3]| of.map(|p| dot(normal(t), minus(p, t[0])));
        // Where the plane cuts a triangle: from and to along the line, as fractions of positive denominator.
        let span = |t: [P; 3], h: [i128; 3], along: P| {
            let mut found = Vec::new();
            for i in 0..3 {
                let j = (i + 1) % 3;
                if h[i] == 0 {
                    found.push((dot(along, t[i]), 1));
                }
                if h[i] * h[j] < 0 {
                    let (n, d) = (dot(along, t[i]) * h[j] - dot(along, t[j]) * h[i], h[j] - h[i]);
                    found.push(if d > 0 { (n, d) } else { (-n, -d) });
                }
            }
            found.sort_by(|a, b| (a.0 * b.1).cmp(&(b.0 * a.1)));
            Some((*found.first()?, *found.last()?))
        };
        let less = |a: (i128, i128), b: (i128, i128)| a.0 * b.1 < b.0 * a.1;
        let mut state = 7u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            i128::from(state >> 33) % 4
        };
        let (mut crossing, mut apart) = (0, 0);
        for _ in 0..60_000 {
            let mut triangle = || -> [P; 3] { std::array::from_fn(|_| std::array::from_fn(|_| next())) };
            let (a, b) = (triangle(), triangle());
            let (in_a, in_b) = (heights(b, a), heights(a, b));
            if normal(a) == [0; 3] || normal(b) == [0; 3] || in_b == [0; 3] {
                continue;
            }
            let along = cross(normal(a), normal(b));
            let edges = [in_a, in_b].iter().all(|h| h.iter().filter(|h| **h == 0).count() == 2);
            let expected = match (span(a, in_a, along), span(b, in_b, along)) {
                (Some(s), Some(t)) => {
                    let low = if less(s.0, t.0) { t.0 } else { s.0 };
                    let high = if less(s.1, t.1) { s.1 } else { t.1 };
                    less(low, high) && !edges
                }
                _ => false,
            };
            let [a, b] = [a, b].map(|t| t.map(|p| p.map(|x| x as f32)));
            assert_eq!((meet(a, b), meet(b, a)), (expected, expected), "{a:?} {b:?}");
            if expected { crossing += 1 } else { apart += 1 }
        }
        assert!(crossing > 3_000 && apart > 3_000, "{crossing} {apart}");
    }

    #[test]
    fn each_triangle_is_counted_once() {
        let wall = [[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0]];
        let away = FLOOR.map(|[x, y, z]| [x + 9.0, y, z]);
        assert_eq!(meeting(&[FLOOR, wall, wall, away]), 3);
        assert_eq!(meeting(&[FLOOR, [[1.0; 3]; 3], [[0.0; 3], [1.0, 1.0, 0.0], [2.0, 2.0, 0.0]]]), 0);
    }
}
