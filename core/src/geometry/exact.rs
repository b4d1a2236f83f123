//! Exact signs on f32 positions. Every f32 is a f64, in which no product of three differences over- or underflows (they stay within
//! 2^±450). A sign is taken from floating point where the rounding error cannot change it, from 128-bit integers where the
//! differences span few enough bits (nearly always, and then a zero costs little more than another sign), and from the adaptive
//! predicates of `robust` otherwise. Error bounds and predicates after Shewchuk, "Adaptive Precision Floating-Point Arithmetic and
//! Fast Robust Geometric Predicates", Discrete & Computational Geometry 18 (1997).

use std::cell::OnceCell;

use glam::{DVec3, Vec3Swizzles};
use robust::{Coord, Coord3D, orient2d, orient3d};

/// A position as it stands in the file.
pub(crate) type Point = [f32; 3];

/// The position in f64, for what only ranks.
#[inline(always)]
pub(crate) fn at(p: &Point) -> DVec3 {
    DVec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]))
}

/// +1, 0 or −1.
pub(crate) fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

/// Sign of det(b−a, c−a, d−a): +1 when d lies on the side that the normal of (a, b, c) points to, 0 when the four are coplanar.
pub(crate) fn side(a: &Point, b: &Point, c: &Point, d: &Point) -> i8 {
    Plane::new(a, b, c).side(d)
}

/// The plane of three positions, prepared for asking about several others. Has no sides when the three are collinear.
pub(crate) struct Plane<'a> {
    corners: [&'a Point; 3],
    /// Twice the triangle's area along its normal, rounded.
    normal: DVec3,
    /// The same with all products positive: what the rounding errors are measured by.
    magnitude: DVec3,
    /// The normal as integers, in any unit; `None` if they do not fit. Three corners of one triangle often need it.
    integer_normal: OnceCell<Option<[i128; 3]>>,
}

impl<'a> Plane<'a> {
    #[inline(always)]
    pub(crate) fn new(a: &'a Point, b: &'a Point, c: &'a Point) -> Self {
        let (u, v) = (at(b) - at(a), at(c) - at(a));
        let (p, q) = (u.yzx() * v.zxy(), u.zxy() * v.yzx());
        Self { corners: [a, b, c], normal: p - q, magnitude: p.abs() + q.abs(), integer_normal: OnceCell::new() }
    }

    /// The side on which `d` lies, as [`side`] says it.
    #[inline]
    pub(crate) fn side(&self, d: &Point) -> i8 {
        let (value, error) = self.rounded(d);
        // Nothing underflows: without magnitude, all three products are zero.
        if value.abs() > error || error == 0.0 { sign(value) } else { self.side_exact(d) }
    }

    /// The determinant whose sign is the side of `d`, rounded: if it is larger than the second number, its sign is right. No branches.
    #[inline(always)]
    pub(crate) fn rounded(&self, d: &Point) -> (f64, f64) {
        let w = at(d) - at(self.corners[0]);
        // (7 + 56ε)ε of the magnitude with ε = 2⁻⁵³ (Shewchuk's bound A for orient3d, of which this is the order of operations), which
        // is less than 7.8e-16; the product below is rounded by far less than what is left.
        (self.normal.dot(w), 8e-16 * self.magnitude.dot(w.abs()))
    }

    /// Do all of these lie on one side of it for certain? What is in doubt does not.
    #[inline]
    pub(crate) fn has_on_one_side(&self, points: &[Point]) -> bool {
        let (mut above, mut below) = (true, true);
        for point in points {
            let (value, error) = self.rounded(point);
            above &= value > error;
            below &= value < -error;
        }
        above | below
    }

    #[cold]
    fn side_exact(&self, d: &Point) -> i8 {
        let [a, b, c] = self.corners;
        // Neighbours have corners in common; the predicate would find out only in its last, slowest stage.
        if d == a || d == b || d == c {
            return 0;
        }
        // 41 bits each: products of three and the sum of six such fit 127. Units need not be the same to tell the sign.
        let from_a = |p: &Point| [0, 1, 2].map(|k| (p[k], a[k]));
        let normal = self.integer_normal.get_or_init(|| {
            let [[ux, uy, uz], [vx, vy, vz]] = integers([from_a(b), from_a(c)], 41)?;
            let minor = |a: i64, b: i64, c: i64, d: i64| i128::from(a) * i128::from(d) - i128::from(b) * i128::from(c);
            Some([minor(uy, uz, vy, vz), minor(uz, ux, vz, vx), minor(ux, uy, vx, vy)])
        });
        if let Some(([x, y, z], [[wx, wy, wz]])) = normal.zip(integers([from_a(d)], 41)) {
            return (x * i128::from(wx) + y * i128::from(wy) + z * i128::from(wz)).signum() as i8;
        }
        let coord = |p: &Point| Coord3D { x: p[0], y: p[1], z: p[2] };
        // `robust` counts the other side as positive.
        -sign(orient3d(coord(a), coord(b), coord(c), coord(d)))
    }
}

/// Differences of pairs as integers of at most `bits` bits and a sign, in a common unit that is a power of two; `None` where they
/// do not fit, or where f64 does not hold a difference exactly.
fn integers<const M: usize, const N: usize>(pairs: [[(f32, f32); M]; N], bits: u64) -> Option<[[i64; M]; N]> {
    let differences = pairs.map(|row| row.map(|(x, y)| f64::from(x) - f64::from(y)));
    let largest = differences.as_flattened().iter().fold(0.0_f64, |m, d| m.max(d.abs()));
    // Its leading bit becomes bit `bits − 1`. A difference of f32 is zero or a normal f64, and so is the unit.
    let unit = f64::from_bits((2 * 1023 + bits - 1).saturating_sub(largest.to_bits() >> 52) << 52);
    let mut out = [[0_i64; M]; N];
    let mut fits = true;
    for ((out, pair), difference) in out.as_flattened_mut().iter_mut().zip(pairs.as_flattened()).zip(differences.as_flattened()) {
        let (x, y) = (f64::from(pair.0), f64::from(pair.1));
        // What rounding took from the difference (Knuth's two-sum).
        let y_seen = x - difference;
        let lost = (x - (difference + y_seen)) + (y_seen - y);
        let scaled = difference * unit;
        *out = scaled as i64;
        fits &= (lost == 0.0) & (*out as f64 == scaled);
    }
    fits.then_some(out)
}

/// Sign of the component along `axis` of the normal of (a, b, c): how the triangle turns when one looks down that axis.
pub(crate) fn orientation_along(a: &Point, b: &Point, c: &Point, axis: usize) -> i8 {
    let (x, y) = ((axis + 1) % 3, (axis + 2) % 3);
    let d = |p: &Point, k: usize| f64::from(p[k]) - f64::from(a[k]);
    let (p, q) = (d(b, x) * d(c, y), d(b, y) * d(c, x));
    let (value, magnitude) = (p - q, p.abs() + q.abs());
    if value.abs() > 4e-16 * magnitude || magnitude == 0.0 { sign(value) } else { orientation_along_exactly([a, b, c], x, y) }
}

#[cold]
fn orientation_along_exactly([a, b, c]: [&Point; 3], x: usize, y: usize) -> i8 {
    if let Some([[ux, uy], [vx, vy]]) = integers([b, c].map(|p| [(p[x], a[x]), (p[y], a[y])]), 60) {
        return (i128::from(ux) * i128::from(vy) - i128::from(uy) * i128::from(vx)).signum() as i8;
    }
    let coord = |p: &Point| Coord { x: p[x], y: p[y] };
    sign(orient2d(coord(a), coord(b), coord(c)))
}

/// Do the three lie on one line (or coincide)?
pub(crate) fn collinear(a: &Point, b: &Point, c: &Point) -> bool {
    (0..3).all(|axis| orientation_along(a, b, c, axis) == 0)
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
                prop_assert_eq!(i128::from(orientation_along(&f[0], &f[1], &f[2], axis)), component.signum());
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
        assert_eq!(orientation_along(&[0.0; 3], &[tiny, 0.0, 0.0], &[f32::MAX, tiny, 0.0], 2), 1);
        let big = f32::MAX;
        assert_eq!(side(&[-big; 3], &[big, -big, -big], &[-big, big, -big], &[-big, -big, big]), 1);
        assert!(collinear(&[-big; 3], &[big; 3], &[tiny; 3]));
    }
}
