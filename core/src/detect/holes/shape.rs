//! The shape of a loop as a whole: its plane, its extents, its area.

use glam::DVec3;

/// A closed polyline, measured by length, so that it does not matter how densely it is sampled.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    pub(super) points: Vec<DVec3>,
    pub(super) perimeter: f64,
    pub(super) centre: DVec3,
    /// Unit normal of the plane that fits best, turned to the side of the vector area.
    pub(super) normal: DVec3,
    /// Root mean square distances from the centre along the principal axes, largest first.
    pub(super) extents: [f64; 3],
    /// Half the sum of the edges' cross products: the normal of a patch, as long as its projected area.
    pub(super) vector_area: DVec3,
    /// Largest distance of a vertex from the plane.
    pub(super) off_plane: f64,
    /// Whether a flat patch would continue the surface (towards 1: the loop is a hole in it) or lie on it (towards −1: the loop is the rim of
    /// a piece). Near 0, it would stand on it.
    pub(super) continues: f64,
    /// Whether the surface along the loop faces away from the loop's axis (towards 1) or to it (towards −1).
    pub(super) outwards: f64,
}

impl Shape {
    /// Of the vertices in order; `normals` are those of the triangle beside each edge. O(vertices).
    pub(super) fn of(points: &[DVec3], normals: impl Iterator<Item = DVec3>) -> Self {
        let edges = || (0..points.len()).map(|i| (points[i], points[(i + 1) % points.len()]));
        let perimeter: f64 = edges().map(|(a, b)| a.distance(b)).sum();
        let length = perimeter.max(f64::MIN_POSITIVE);
        let centre = edges().map(|(a, b)| (a + b) * (0.5 * a.distance(b))).sum::<DVec3>() / length;
        let mut moments = [[0.0; 3]; 3];
        let mut vector_area = DVec3::ZERO;
        for (a, b) in edges() {
            // Of an edge around the centre: its middle's, and what it spreads around that.
            let (middle, along, weight) = ((a + b) * 0.5 - centre, b - a, a.distance(b) / length);
            for (i, row) in moments.iter_mut().enumerate() {
                for (j, moment) in row.iter_mut().enumerate() {
                    *moment += weight * (middle[i] * middle[j] + along[i] * along[j] / 12.0);
                }
            }
            vector_area += (a - centre).cross(b - centre) * 0.5;
        }
        let axes = principal_axes(moments);
        let normal = if axes[2].1.dot(vector_area) < 0.0 { -axes[2].1 } else { axes[2].1 };
        let off_plane = points.iter().map(|p| (*p - centre).dot(normal).abs()).fold(0.0, f64::max);
        let extents = axes.map(|(moment, _)| moment.max(0.0).sqrt());
        let axis = vector_area.normalize_or_zero();
        let (mut continues, mut outwards) = (0.0, 0.0);
        for ((a, b), beside) in edges().zip(normals) {
            let beside = beside.normalize_or_zero() * (a.distance(b) / length);
            let from_centre = (a + b) * 0.5 - centre;
            continues += beside.dot(axis);
            outwards += beside.dot((from_centre - axis * from_centre.dot(axis)).normalize_or_zero());
        }
        Self { points: points.to_vec(), perimeter, centre, normal, extents, vector_area, off_plane, continues, outwards }
    }

    /// Area of the loop as projected to where it is largest.
    pub(super) fn area(&self) -> f64 {
        self.vector_area.length()
    }

    /// Radius of a circle of the same spread.
    pub(super) fn radius(&self) -> f64 {
        let [a, b, _] = self.extents;
        (a * a + b * b).sqrt()
    }

    /// Does a point, projected to the plane, lie inside the loop? By the winding number of the projected loop around it.
    pub(super) fn surrounds(&self, point: DVec3) -> bool {
        let u = self.normal.any_orthonormal_vector();
        let v = self.normal.cross(u);
        let flat = |p: DVec3| ((p - point).dot(u), (p - point).dot(v));
        let mut winding = 0;
        for i in 0..self.points.len() {
            let ((ax, ay), (bx, by)) = (flat(self.points[i]), flat(self.points[(i + 1) % self.points.len()]));
            let left = ax * by - ay * bx;
            if ay <= 0.0 && by > 0.0 && left > 0.0 {
                winding += 1;
            } else if ay > 0.0 && by <= 0.0 && left < 0.0 {
                winding -= 1;
            }
        }
        winding != 0
    }
}

/// Eigenvalues of a symmetric matrix with their unit eigenvectors, largest first: Jacobi's rotations, which take + − × ÷ √ only.
fn principal_axes(mut a: [[f64; 3]; 3]) -> [(f64, DVec3); 3] {
    let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    // Converges quadratically; after so many sweeps nothing is left to turn.
    for _ in 0..12 {
        let mut turned = false;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q].abs() <= f64::EPSILON * 0.25 * (a[p][p].abs() + a[q][q].abs()) {
                continue;
            }
            turned = true;
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for row in &mut a {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            let [of_p, of_q] = [a[p], a[q]];
            a[p] = std::array::from_fn(|k| c * of_p[k] - s * of_q[k]);
            a[q] = std::array::from_fn(|k| s * of_p[k] + c * of_q[k]);
            for row in &mut axes {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
        }
        if !turned {
            break;
        }
    }
    let mut all = [0, 1, 2].map(|k| (a[k][k], DVec3::new(axes[0][k], axes[1][k], axes[2][k])));
    all.sort_by(|x, y| y.0.total_cmp(&x.0));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An ellipse in a plane that leans, sampled by `count` points that crowd on one side.
    fn ellipse(count: u32, half_axes: [f64; 2]) -> (Vec<DVec3>, DVec3) {
        let (u, v) = (DVec3::new(0.6, 0.0, 0.8), DVec3::Y);
        let at = |i: u32| {
            let x = f64::from(i) / f64::from(count);
            let turn = std::f64::consts::TAU * x * x;
            DVec3::new(5.0, 6.0, 7.0) + u * (half_axes[0] * turn.cos()) + v * (half_axes[1] * turn.sin())
        };
        ((0..count).map(at).collect(), u.cross(v))
    }

    #[test]
    fn the_plane_of_a_flat_loop_is_found_however_it_is_sampled() {
        let (points, normal) = ellipse(400, [2.0, 1.0]);
        let shape = Shape::of(&points, std::iter::repeat(normal));
        assert!((shape.continues - 1.0).abs() < 1e-9);
        assert!(shape.normal.dot(normal) > 1.0 - 1e-9, "{:?}", shape.normal);
        assert!(shape.centre.distance(DVec3::new(5.0, 6.0, 7.0)) < 1e-3, "{:?}", shape.centre);
        assert!(shape.off_plane < 1e-9);
        // π a b, and Ramanujan's perimeter.
        assert!((shape.area() - 2.0 * std::f64::consts::PI).abs() < 1e-2);
        assert!((shape.perimeter - 9.688).abs() < 1e-2, "{}", shape.perimeter);
        assert!(shape.extents[0] > shape.extents[1] && shape.extents[2] < 1e-6);
    }

    #[test]
    fn inside_is_inside_the_projection() {
        let (points, normal) = ellipse(50, [2.0, 1.0]);
        let shape = Shape::of(&points, std::iter::empty());
        assert!(shape.surrounds(shape.centre + normal * 9.0));
        assert!(!shape.surrounds(shape.centre + DVec3::Y * 1.1));
    }

    #[test]
    fn principal_axes_of_a_diagonal_matrix_are_its_own() {
        let axes = principal_axes([[1.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 2.0]]);
        assert_eq!(axes, [(3.0, DVec3::Y), (2.0, DVec3::Z), (1.0, DVec3::X)]);
    }
}
