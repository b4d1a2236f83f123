//! Is a triangle exactly flat? Decided without rounding.

/// `true` when three points lie exactly on one line (or coincide).
pub(super) fn collinear([a, b, c]: [[f32; 3]; 3]) -> bool {
    [(0, 1), (1, 2), (2, 0)].into_iter().all(|(u, v)| {
        let [ax, ay, bx, by, cx, cy] = [a[u], a[v], b[u], b[v], c[u], c[v]].map(f64::from);
        let (left, right) = ((bx - ax) * (cy - ay), (by - ay) * (cx - ax));
        // Each difference and product is rounded at most once: beyond this the sign is certain.
        if (left - right).abs() > 4.0 * f64::EPSILON * (left.abs() + right.abs()) {
            return false;
        }
        // The same determinant, multiplied out; products of two f32 are exact in f64.
        vanishes([bx * cy, -(bx * ay), -(ax * cy), -(by * cx), by * ax, ay * cx])
    })
}

/// `true` when the exact sum is zero: the sum is kept as parts that do not overlap (Shewchuk 1997, "Adaptive precision
/// floating-point arithmetic", theorem 10), so that it is zero only if every part is.
fn vanishes(terms: [f64; 6]) -> bool {
    let mut parts = [0.0; 6];
    for (count, mut carry) in terms.into_iter().enumerate() {
        for part in &mut parts[..count] {
            let sum = carry + *part;
            let of_part = sum - carry;
            *part = (carry - (sum - of_part)) + (*part - of_part);
            carry = sum;
        }
        parts[count] = carry;
    }
    parts.iter().all(|&part| part == 0.0)
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
    }
}
