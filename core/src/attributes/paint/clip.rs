//! Convex polygons in a triangle. Places are weights of the triangle's corners, whose sum is 1.

/// A place, as weights of the corners.
pub(super) type Weights = [f64; 3];

/// The part of a convex polygon that lies in the triangle. O(n).
pub(super) fn within(mut polygon: Vec<Weights>) -> Vec<Weights> {
    for corner in 0..3 {
        if polygon.iter().any(|place| place[corner] < 0.0) {
            polygon = cut(&polygon, corner);
        }
    }
    polygon
}

/// The part where the weight of this corner is not negative.
fn cut(polygon: &[Weights], corner: usize) -> Vec<Weights> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    let before = polygon.iter().cycle().skip(polygon.len().saturating_sub(1));
    for (from, to) in before.zip(polygon) {
        if (from[corner] < 0.0) != (to[corner] < 0.0) {
            let along = from[corner] / (from[corner] - to[corner]);
            let mut crossing: Weights = std::array::from_fn(|k| from[k] + along * (to[k] - from[k]));
            crossing[corner] = 0.0;
            kept.push(crossing);
        }
        if to[corner] >= 0.0 {
            kept.push(*to);
        }
    }
    kept
}

/// A polygon's area, as a share of the triangle's. O(n).
pub(super) fn area(polygon: &[Weights]) -> f64 {
    let Some(first) = polygon.first() else { return 0.0 };
    polygon.windows(2).map(|pair| doubled(*first, pair[0], pair[1])).sum::<f64>().abs()
}

/// A triangle's area as a share of the triangle's whose corners weigh, with the sign of its direction in it.
pub(super) fn doubled(a: Weights, b: Weights, c: Weights) -> f64 {
    (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
}

/// The weights of these corners at a place, all given by weights of other ones. `None` for a triangle without area.
pub(super) fn weights_of([a, b, c]: [Weights; 3], place: Weights) -> Option<Weights> {
    let all = doubled(a, b, c);
    let (second, third) = (doubled(a, place, c) / all, doubled(a, b, place) / all);
    let found = [1.0 - second - third, second, third];
    found.iter().all(|weight| weight.is_finite()).then_some(found)
}
