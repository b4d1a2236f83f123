//! Curves of a loop joined into at most four sides.
//!
//! Based on: paper S2 (curves joined by the cosine between their tangents, split where it is smallest).

use crate::curves::curve::{CurveError, Spline};
use crate::curves::vector::Point;

/// A side: so many curves from the one of a number on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Side {
    pub(super) first: usize,
    pub(super) count: usize,
}

/// Corners of a loop: numbers of curves that begin at one, for the cosines between the tangents where each curve begins. Those
/// above `smooth` are none; of more than four, the four smallest are kept. In order; empty if all is smooth. O(n).
pub(super) fn corners(cosines: &[f64], smooth: f64) -> Vec<usize> {
    let mut corners: Vec<usize> =
        (0..cosines.len()).filter(|at| cosines.get(*at).is_some_and(|cosine| *cosine <= smooth)).collect();
    if corners.len() > 4 {
        let key = |at: &usize| cosines.get(*at).copied().unwrap_or(1.0);
        corners.select_nth_unstable_by(3, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
        corners.truncate(4);
        corners.sort_unstable();
    }
    corners
}

/// Sets of corners in the order in which they are tried. Four curves that meet in two corners at least are four sides, even where two of
/// them go on smoothly: an outline of four curves is most often that of a patch of four sides. Then the corners of [`corners`], if there
/// are two. O(n).
pub(super) fn choices(cosines: &[f64], smooth: f64) -> Vec<Vec<usize>> {
    let sharp = corners(cosines, smooth);
    let mut choices = Vec::with_capacity(2);
    if cosines.len() == 4 && (2..4).contains(&sharp.len()) {
        choices.push(vec![0, 1, 2, 3]);
    }
    if sharp.len() > 1 {
        choices.push(sharp);
    }
    choices
}

/// Sides between corners. Of three, the corner that becomes the degenerate side, the sharpest one, is between the second and the
/// third.
pub(super) fn sides(corners: &[usize], cosines: &[f64]) -> Vec<Side> {
    let all = cosines.len();
    let mut sides: Vec<Side> = Vec::with_capacity(corners.len());
    for (number, first) in corners.iter().enumerate() {
        let next = corners.get((number + 1) % corners.len()).copied().unwrap_or(0);
        let count = if next > *first { next - first } else { next + all - first };
        sides.push(Side { first: *first, count });
    }
    if let [a, b, c] = *sides {
        let key = |side: &Side| cosines.get(side.first).copied().unwrap_or(1.0);
        // The sharpest corner, where the third side begins.
        let turned = [[a, b, c], [b, c, a], [c, a, b]].into_iter().min_by(|x, y| key(&x[2]).total_cmp(&key(&y[2])));
        return turned.map(|sides| sides.to_vec()).unwrap_or(sides);
    }
    sides
}

/// Cubic B-splines on 0 to 1, one behind the other, as one: each has a share of the parameter in proportion to its length.
/// O(points).
pub(super) fn join(parts: &[(Spline, f64)]) -> Result<(Spline, Vec<f64>), CurveError> {
    let whole: f64 = parts.iter().map(|(_, length)| length).sum();
    let mut knots = vec![0.0; 4];
    let mut points: Vec<Point> = Vec::new();
    let mut ends = vec![0.0];
    let mut low = 0.0;
    for (number, (spline, length)) in parts.iter().enumerate() {
        let high = if number + 1 == parts.len() { 1.0 } else { low + length / whole };
        let count = spline.points().len();
        knots.extend(spline.knots().get(4..count).unwrap_or_default().iter().map(|knot| low + (high - low) * knot));
        knots.extend([high; 3]);
        points.extend(spline.points().iter().skip(usize::from(number > 0)));
        ends.push(high);
        low = high;
    }
    knots.push(1.0);
    Ok((Spline::new(3, knots, points, None, None)?, ends))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_four_sharpest_corners_stay() {
        let cosines = [0.99, 0.1, -0.5, 0.95, 0.2, 0.3, 0.0];
        assert_eq!(corners(&cosines, 0.9), [1, 2, 4, 6]);
        let sides_ = sides(&[1, 2, 4, 6], &cosines);
        let pairs: Vec<_> = sides_.iter().map(|side| (side.first, side.count)).collect();
        assert_eq!(pairs, [(1, 1), (2, 2), (4, 2), (6, 2)]);
        assert_eq!(corners(&[0.95, 0.99], 0.9), [] as [usize; 0]);
    }

    /// Four curves are four sides before their two corners are looked at; one corner makes no sides.
    #[test]
    fn four_curves_are_four_sides_first() {
        assert_eq!(choices(&[0.1, 0.99, 0.2, 0.95], 0.9), [vec![0, 1, 2, 3], vec![0, 2]]);
        assert_eq!(choices(&[0.1, 0.2, 0.3, 0.4], 0.9), [vec![0, 1, 2, 3]]);
        assert_eq!(choices(&[0.1, 0.99, 0.2], 0.9), [vec![0, 2]]);
        assert_eq!(choices(&[0.99, 0.95, 0.7], 0.9), [] as [Vec<usize>; 0]);
    }

    #[test]
    fn the_sharpest_corner_of_three_is_the_point() {
        let sides = sides(&[0, 1, 2], &[-0.9, 0.0, 0.0]);
        assert_eq!(sides.iter().map(|side| side.first).collect::<Vec<_>>(), [1, 2, 0]);
    }
}
