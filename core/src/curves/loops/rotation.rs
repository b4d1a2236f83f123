//! The order of edges around a node, as seen along the normal of the surface that they lie on.

use crate::curves::vector::{Point, add, cross, dot, norm, scale, sub, unit};

/// The order of a list of edges around their node.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Order {
    /// The normal of the plane in which they are sorted; its sign is any.
    pub(super) normal: Point,
    /// For each place, that of the next one anticlockwise about the normal, and clockwise.
    pub(super) next: Vec<[usize; 2]>,
}

/// Sorts edges by the angles of their tangents in the plane that is nearest to the tips of these; each comes with where it is a little later.
/// Nothing where that plane is not clear: of tips on a line, or all around.
pub(super) fn order(tangents: &[[Point; 2]]) -> Option<Order> {
    let count = tangents.len();
    let directions: Vec<Point> = tangents.iter().map(|[tangent, _]| unit(*tangent)).collect::<Option<_>>()?;
    if let Some(order) = crease(&directions) {
        return Some(order);
    }
    let centre = scale(directions.iter().fold([0.0; 3], |sum, one| add(sum, *one)), 1.0 / count.max(1) as f64);
    let normal = normal(directions.iter().map(|one| sub(*one, centre)))?;
    let across = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| cross(normal, axis));
    let x = unit(across.into_iter().max_by(|a, b| dot(*a, *a).total_cmp(&dot(*b, *b)))?)?;
    let y = cross(normal, x);
    let angle = |vector: Point| dot(vector, y).atan2(dot(vector, x));
    let mut order: Vec<(i64, i64, usize)> = Vec::with_capacity(count);
    for (number, (direction, [_, chord])) in directions.iter().zip(tangents).enumerate() {
        // Curves that leave in the same direction are told apart by where they are a little later, from the side of that direction.
        let direction = sub(*direction, centre);
        let first = angle(direction);
        let later = angle(sub(unit(*chord)?, centre)) - first;
        let later = (later + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        order.push(((first * 1e4).round() as i64, (later * 1e6).round() as i64, number));
    }
    order.sort_unstable();
    let mut next = vec![[0; 2]; count];
    for (place, (.., number)) in order.iter().enumerate() {
        let other = |step: usize| order.get((place + step) % count).map_or(0, |(.., number)| *number);
        next.iter_mut().skip(*number).take(1).for_each(|both| *both = [other(1), other(count - 1)]);
    }
    Some(Order { normal, next })
}

/// The order of four edges of which two go straight on, along a ridge or a groove, and the other two leave across them: these are on both
/// sides of the straight pair, whatever plane the tips suggest.
fn crease(directions: &[Point]) -> Option<Order> {
    let &[a, b, c, d] = directions else { return None };
    for ([one, other], [left, right], [i, j, k, l]) in
        [([a, b], [c, d], [0, 1, 2, 3]), ([a, c], [b, d], [0, 2, 1, 3]), ([a, d], [b, c], [0, 3, 1, 2])]
            .into_iter()
            .flat_map(|(pair, rest, [i, j, k, l])| [(pair, rest, [i, j, k, l]), (rest, pair, [k, l, i, j])])
    {
        let bend = cross(left, right);
        // Both in the plane of the pair are a fork, on one side of it.
        let is_fork = norm(bend) > 0.02 && dot(one, bend).abs() < 0.5 * norm(bend);
        if dot(one, other) > -0.99 || dot(left, right) < -0.9 || is_fork {
            continue;
        }
        let middle = add(left, right);
        let normal = unit(sub(middle, scale(one, dot(one, middle))))?;
        let across = cross(normal, one);
        // Whichever is farther to the left comes first, anticlockwise.
        let [k, l] = if dot(left, across) >= dot(right, across) { [k, l] } else { [l, k] };
        let around = [i, k, j, l];
        let mut next = vec![[0; 2]; 4];
        for (place, number) in around.iter().enumerate() {
            let both = [around.get((place + 1) % 4).copied()?, around.get((place + 3) % 4).copied()?];
            next.iter_mut().skip(*number).take(1).for_each(|to| *to = both);
        }
        return Some(Order { normal, next });
    }
    None
}

/// Turns a vector as one direction turns to another; nothing if that is the opposite one.
pub(super) fn transported(vector: Point, from: Point, to: Point) -> Option<Point> {
    let cosine = dot(from, to);
    let sum = add(from, to);
    (cosine > -0.999).then(|| add(sub(vector, scale(sum, dot(sum, vector) / (1.0 + cosine))), scale(to, 2.0 * dot(from, vector))))
}

/// The cosine of the angle between two vectors as seen along a direction; 0 where one of them has nearly that direction. Corners that are sharp have normals
/// that lean along their edges: only what is across an edge tells its sides.
pub(super) fn cosine_about(along: Point, a: Point, b: Point) -> f64 {
    let across = |vector: Point| sub(vector, scale(along, dot(vector, along)));
    let (a, b) = (across(a), across(b));
    if norm(a).min(norm(b)) < 0.1 { 0.0 } else { dot(a, b) / (norm(a) * norm(b)) }
}

/// The direction in which vectors differ least: of the smallest eigenvalue of the sum of their squares, by Jacobi's rotations. Nothing if the
/// next eigenvalue is not well above it, and well above nothing.
fn normal(vectors: impl Iterator<Item = Point>) -> Option<Point> {
    let mut matrix = [[0.0_f64; 3]; 3];
    for vector in vectors {
        for (row, x) in matrix.iter_mut().zip(vector) {
            row.iter_mut().zip(vector).for_each(|(entry, y)| *entry += x * y);
        }
    }
    let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            turn(&mut matrix, &mut axes, p, q);
        }
    }
    let [[a, ..], [_, b, _], [.., c]] = matrix;
    let mut values: Vec<(f64, Point)> = [a, b, c].into_iter().zip(axes).collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let &[(lowest, normal), (middle, _), (highest, _)] = values.as_slice() else { return None };
    (middle > 1e-6 * highest && lowest < 0.25 * middle).then_some(normal)
}

/// One of Jacobi's rotations: takes the entry of a row and a column away. Rows and columns are those of the three pairs above.
fn turn(matrix: &mut [[f64; 3]; 3], axes: &mut [Point; 3], p: usize, q: usize) {
    if matrix[p][q] == 0.0 {
        return;
    }
    let theta = 0.5 * (2.0 * matrix[p][q]).atan2(matrix[q][q] - matrix[p][p]);
    let (sin, cos) = theta.sin_cos();
    for row in matrix.iter_mut() {
        (row[p], row[q]) = (cos * row[p] - sin * row[q], sin * row[p] + cos * row[q]);
    }
    let (a, b) = (matrix[p], matrix[q]);
    matrix[p] = sub(scale(a, cos), scale(b, sin));
    matrix[q] = add(scale(a, sin), scale(b, cos));
    let (a, b) = (axes[p], axes[q]);
    axes[p] = sub(scale(a, cos), scale(b, sin));
    axes[q] = add(scale(a, sin), scale(b, cos));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn opposite(directions: &[Point]) -> Vec<bool> {
        let tangents: Vec<[Point; 2]> = directions.iter().map(|one| [*one, *one]).collect();
        let order = order(&tangents).unwrap();
        (1..directions.len()).map(|other| !order.next[0].contains(&other)).collect()
    }

    const X: Point = [1.0, 0.0, 0.0];
    const BACK: Point = [-1.0, 0.0, 0.0];

    /// Which edge is not next to the first one.
    #[test]
    fn edges_are_sorted_around_their_node() {
        // A crossing, in any order; the same on a ridge, where one goes down and one away; a sharp groove.
        assert_eq!(opposite(&[X, [0.0, 1.0, 0.0], BACK, [0.0, -1.0, 0.1]]), [false, true, false]);
        assert_eq!(opposite(&[X, BACK, [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]), [true, false, false]);
        assert_eq!(opposite(&[X, [0.0, 1.0, 0.01], [0.0, 1.0, -0.01], BACK]), [false, false, true]);
        // A fork on one side of a straight pair: its outer edge is not next to the other end of the pair.
        assert_eq!(opposite(&[X, BACK, [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]), [false, false, true]);
        // All around a point, there is no order.
        let axes = [X, BACK, [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
        assert_eq!(order(&axes.map(|one| [one, one])), None);
    }

    #[test]
    fn a_vector_turns_with_a_direction() {
        assert_eq!(transported(X, X, [0.0, 1.0, 0.0]), Some([0.0, 1.0, 0.0]));
        assert_eq!(transported([0.0, 0.0, 1.0], X, [0.0, 1.0, 0.0]), Some([0.0, 0.0, 1.0]));
        assert_eq!(transported(X, X, BACK), None);
    }
}
