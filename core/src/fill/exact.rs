//! Exact signs on f32 positions. Every f32 is a f64, and the adaptive predicates of `robust` (after Shewchuk 1997) neither
//! overflow nor underflow on f32 input (products of three differences stay within 2^±450), so these signs are exact.

use glam::DVec3;
use robust::{Coord, Coord3D, orient2d, orient3d};

/// A position as it stands in the file.
pub type Point = [f32; 3];

/// The position in f64, for what only ranks.
pub(super) fn at(p: &Point) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

/// Sign of det(b−a, c−a, d−a): +1 when d lies on the side that the normal of (a, b, c) points to, 0 when the four are coplanar.
pub fn side(a: &Point, b: &Point, c: &Point, d: &Point) -> i8 {
    let coord = |p: &Point| Coord3D { x: p[0], y: p[1], z: p[2] };
    // Neighbours have corners in common; the predicate would find out only in its last, slowest stage.
    if d == a || d == b || d == c || c == a || c == b {
        return 0;
    }
    // `robust` counts the other side as positive.
    -sign(orient3d(coord(a), coord(b), coord(c), coord(d)))
}

/// Sign of the component along `axis` of the normal of (a, b, c): how the triangle turns when one looks down that axis.
pub fn turn(a: &Point, b: &Point, c: &Point, axis: usize) -> i8 {
    let coord = |p: &Point| Coord { x: p[(axis + 1) % 3], y: p[(axis + 2) % 3] };
    sign(orient2d(coord(a), coord(b), coord(c)))
}

/// Do the three lie on one line (or coincide)?
pub fn collinear(a: &Point, b: &Point, c: &Point) -> bool {
    (0..3).all(|axis| turn(a, b, c, axis) == 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// m·2^(e−20) as an f32 and as an integer in units of 2^−20.
    fn exact(m: i32, e: u32) -> (f32, i128) {
        (m as f32 * (f64::from(1_u32 << e) / f64::from(1 << 20)) as f32, i128::from(m) << e)
    }

    proptest! {
        /// Against integer arithmetic, over many binades; `flat` puts the last point exactly into the plane of the others.
        #[test]
        fn signs_are_those_of_integer_determinants(
            v in prop::collection::vec((-4096_i32..4096, 0_u32..24), 12),
            flat in any::<bool>(),
        ) {
            let mut p: Vec<[(f32, i128); 3]> = v.chunks_exact(3).map(|c| [0, 1, 2].map(|k| exact(c[k].0, c[k].1))).collect();
            if flat {
                // a, b, c with one binade each for all coordinates, d = a + b − c.
                let small: Vec<[i32; 3]> = v.chunks_exact(3).map(|c| [c[0].0, c[1].0, c[2].0]).collect();
                let e = v[0].1;
                p = small.iter().map(|c| c.map(|m| exact(m, e))).collect();
                p[3] = [0, 1, 2].map(|k| exact(small[0][k] + small[1][k] - small[2][k], e));
            }
            let f: Vec<Point> = p.iter().map(|q| q.map(|c| c.0)).collect();
            let d = |i: usize, k: usize| p[i][k].1 - p[0][k].1;
            let normal: [i128; 3] = [0, 1, 2].map(|k| {
                let (u, v) = ((k + 1) % 3, (k + 2) % 3);
                d(1, u) * d(2, v) - d(1, v) * d(2, u)
            });
            for (axis, component) in normal.iter().enumerate() {
                prop_assert_eq!(i128::from(turn(&f[0], &f[1], &f[2], axis)), component.signum());
            }
            prop_assert_eq!(collinear(&f[0], &f[1], &f[2]), normal == [0; 3]);
            let det: i128 = (0..3).map(|k| normal[k] * d(3, k)).sum();
            prop_assert!(!flat || det == 0);
            prop_assert_eq!(i128::from(side(&f[0], &f[1], &f[2], &f[3])), det.signum());
        }
    }

    #[test]
    fn smallest_and_largest_coordinates_are_told_apart() {
        let tiny = f32::from_bits(1);
        assert_eq!(side(&[0.0; 3], &[tiny, 0.0, 0.0], &[0.0, tiny, 0.0], &[0.0, 0.0, tiny]), 1);
        assert_eq!(turn(&[0.0; 3], &[tiny, 0.0, 0.0], &[f32::MAX, tiny, 0.0], 2), 1);
        let big = f32::MAX;
        assert_eq!(side(&[-big; 3], &[big, -big, -big], &[-big, big, -big], &[-big, -big, big]), 1);
        assert!(collinear(&[-big; 3], &[big; 3], &[tiny; 3]));
    }
}
