//! Heights within outlines by mean values.
//!
//! Based on: K. Hormann, M. S. Floater, *Mean value coordinates for arbitrary planar polygons*, ACM Transactions on Graphics 25
//! (2006).

/// A ring of places, each with its height.
pub(super) type Ring = Vec<([f64; 2], f64)>;

/// The height at a place, of those of rings around it, which may be concave and have holes; rings are anticlockwise, those of
/// holes clockwise. O(points).
pub(super) fn height(rings: &[Ring], place: [f64; 2]) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for ring in rings {
        let next = ring.iter().cycle().skip(1);
        for ((a, low), (b, high)) in ring.iter().zip(next) {
            let [p, q] = [a, b].map(|point| [point[0] - place[0], point[1] - place[1]]);
            let (r, s) = (p[0].hypot(p[1]), q[0].hypot(q[1]));
            if r == 0.0 {
                return *low;
            }
            let (cross, dot) = (p[0] * q[1] - p[1] * q[0], p[0] * q[0] + p[1] * q[1]);
            // Tangent of half the angle under which the edge is seen.
            let tangent = if dot + r * s > 0.0 { cross / (r * s + dot) } else { (r * s - dot) / cross };
            if tangent.is_finite() && s > 0.0 {
                sum += tangent * (low / r + high / s);
                weight += tangent * (1.0 / r + 1.0 / s);
            }
        }
    }
    if weight == 0.0 { 0.0 } else { sum / weight }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Heights of a plane are those of the plane within, in a concave outline with a hole, too.
    #[test]
    fn planes_stay_planes() {
        let plane = |[x, y]: [f64; 2]| 1.0 + 2.0 * x - 3.0 * y;
        let outer = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]];
        let hole = [[0.5, 0.5], [0.5, 0.8], [0.8, 0.5]];
        let rings: Vec<Ring> =
            [&outer[..], &hole[..]].iter().map(|ring| ring.iter().map(|at| (*at, plane(*at))).collect()).collect();
        for place in [[1.0, 0.9], [3.0, 1.5], [0.3, 3.0]] {
            assert!((height(&rings, place) - plane(place)).abs() < 1e-12);
        }
    }
}
