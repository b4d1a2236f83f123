//! Distance from a mesh to another one.

use suture_bench::judge::Near;

use crate::mesh::{Triangle, wide};

/// Largest distance from the corners and middles of a mesh to another mesh; 0 of an empty one.
pub(crate) fn farthest(from: &[Triangle], to: &Near) -> f64 {
    let middle = |t: &Triangle| std::array::from_fn(|k| t.iter().map(|p| f64::from(p[k])).sum::<f64>() / 3.0);
    let corners = from.as_flattened().iter().map(|&p| wide(p));
    let points: Vec<_> = corners.chain(from.iter().map(middle)).collect();
    // A few from everywhere first: beside what is as far as these, the others need not be looked at closely.
    points.iter().step_by(61).chain(&points).fold(0.0, |far, &p| to.distance_above(p, far).max(far))
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: Triangle = [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

    #[test]
    fn the_farthest_point_decides() {
        assert_eq!(farthest(&[T], &Near::new(&[T])), 0.0);
        assert_eq!(farthest(&[T, T.map(|[x, y, z]| [x, y, z - 5.0])], &Near::new(&[T])), 5.0);
    }
}
