//! Signs of determinants of f32 coordinates, decided without rounding.

/// `true` when three points lie exactly on one line (or coincide).
pub(super) fn collinear([a, b, c]: [[f32; 3]; 3]) -> bool {
    [(0, 1), (1, 2), (2, 0)].into_iter().all(|(u, v)| turn([a, b, c].map(|p| [p[u], p[v]])) == 0)
}

/// The sign of the area of a triangle in the plane: 1 anticlockwise, −1 clockwise, 0 on one line.
pub(super) fn turn(triangle: [[f32; 2]; 3]) -> i8 {
    let [[ax, ay], [bx, by], [cx, cy]] = triangle.map(|p| p.map(f64::from));
    let (left, right) = ((bx - ax) * (cy - ay), (by - ay) * (cx - ax));
    // Each difference and product is rounded at most once: beyond this the sign is certain.
    if (left - right).abs() > 4.0 * f64::EPSILON * (left.abs() + right.abs()) {
        return sign(left - right);
    }
    // The same determinant, multiplied out; products of two f32 are exact in f64.
    sign_of_sum([bx * cy, -(bx * ay), -(ax * cy), -(by * cx), by * ax, ay * cx])
}

/// On which side of the plane through three points the fourth is: 1 where they are seen anticlockwise, −1 on the other, 0 in the plane.
pub(super) fn side(plane: [[f32; 3]; 3], point: [f32; 3]) -> i8 {
    let [a, b, c, d] = [plane[0], plane[1], plane[2], point].map(|p| p.map(f64::from));
    let [u, v, w] = [b, c, d].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    let (mut sum, mut size) = (0.0, 0.0);
    for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
        let (left, right) = (v[i] * w[j], v[j] * w[i]);
        sum += u[k] * (left - right);
        size += u[k].abs() * (left.abs() + right.abs());
    }
    // Seven roundings at most stand between a term and its true value.
    if sum.abs() > 8.0 * f64::EPSILON * size {
        return sign(sum);
    }
    // Most that are in the plane are one of the three points, or in a plane along two axes with them.
    let same = |k: usize| plane.iter().all(|p| p[k] == point[k]);
    if plane.contains(&point) || (0..3).any(same) {
        return 0;
    }
    // The same determinant, multiplied out: 24 products of three f32, each as two numbers that are exact together.
    let mut terms = [0.0; 48];
    let mut at = 0;
    for (positive, [p, q, r]) in [(true, [b, c, d]), (false, [a, c, d]), (true, [a, b, d]), (false, [a, b, c])] {
        for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            for (pair, positive) in [(q[i] * r[j], positive), (-(q[j] * r[i]), positive)] {
                let pair = if positive { pair } else { -pair };
                let product = pair * p[k];
                terms[at] = product;
                terms[at + 1] = pair.mul_add(p[k], -product);
                at += 2;
            }
        }
    }
    sign_of_sum(terms)
}

fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

/// The sign of an exact sum, which is kept as parts that do not overlap (Shewchuk 1997, "Adaptive precision floating-point arithmetic",
/// theorem 10), of rising size: the last one that is not zero has the sign.
fn sign_of_sum<const N: usize>(terms: [f64; N]) -> i8 {
    let mut parts = [0.0; N];
    for (count, mut carry) in terms.into_iter().enumerate() {
        for part in &mut parts[..count] {
            let sum = carry + *part;
            let of_part = sum - carry;
            *part = (carry - (sum - of_part)) + (*part - of_part);
            carry = sum;
        }
        parts[count] = carry;
    }
    parts.iter().rev().map(|&part| sign(part)).find(|&sign| sign != 0).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thirds_of_a_line_are_on_it() {
        assert!(collinear([[0.0; 3], [1.0, 2.0, 3.0], [3.0, 6.0, 9.0]]));
        assert!(collinear([[1e-30; 3], [1e-30; 3], [5.0, 6.0, 7.0]]));
    }

    #[test]
    fn one_ulp_off_the_line_is_not_on_it() {
        let next = f32::from_bits(1.0f32.to_bits() + 1);
        assert!(!collinear([[0.0; 3], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0 * next]]));
        // A difference that f64 itself rounds away: 1e30 + 1e-30.
        assert!(!collinear([[1e30, 0.0, 0.0], [-1e30, 0.0, 0.0], [0.0, 1e-30, 0.0]]));
        assert!(!collinear([[-1e30, -1e30, 0.0], [1e30, 1e30, 0.0], [1e-30, 0.0, 0.0]]));
        assert_eq!([1e-30, 0.0, -1e-30].map(|y| turn([[-1e30, 0.0], [1e30, 0.0], [0.0, y]])), [1, 0, -1]);
    }

    #[test]
    fn sides_of_a_plane() {
        let floor = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!([1.0, 0.0, -1.0].map(|z| side(floor, [5.0, 7.0, z])), [1, 0, -1]);
        // So far out that differences of coordinates are rounded, and off by the least f32 there is.
        let plane = [[-1e30, 0.0, 0.0], [1e30, 1e-30, 0.0], [1e-30, 1e30, 0.0]];
        let least = f32::from_bits(1);
        assert_eq!([least, 0.0, -least].map(|z| side(plane, [3e-30, 1.0, z])), [1, 0, -1]);
    }

    /// Against the determinant in integers, over many points of which a good part lies in the plane.
    #[test]
    fn agrees_with_integers() {
        let mut state = 1u64;
        let mut next = |bound: i128| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            i128::from(state >> 33) % (2 * bound + 1) - bound
        };
        let mut seen = [0; 3];
        for round in 0..20_000 {
            let bound = if round % 2 == 0 { 2 } else { 1 << 21 };
            let mut p: [[i128; 3]; 4] = std::array::from_fn(|_| std::array::from_fn(|_| next(bound)));
            if round % 4 == 1 {
                // In the plane, or one off it.
                p[3] = std::array::from_fn(|k| p[0][k] + p[1][k] - p[2][k]);
                p[3][0] += next(1);
            }
            let [u, v, w]: [[i128; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|k| p[i + 1][k] - p[0][k]));
            let determinant =
                u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) + u[2] * (v[0] * w[1] - v[1] * w[0]);
            let [a, b, c, d] = p.map(|p| p.map(|x| x as f32));
            assert_eq!(i128::from(side([a, b, c], d)), determinant.signum(), "{p:?}");
            seen[(determinant.signum() + 1) as usize] += 1;
        }
        assert!(seen.iter().all(|&count| count > 100), "{seen:?}");
    }
}
