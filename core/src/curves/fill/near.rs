//! The nearest of many points to a straight edge.

use crate::curves::vector::{Point, distance, dot, scale, sub};
use crate::util::each::Each;

/// Points of a leaf, at most.
const LEAF: usize = 8;

/// Points in a kd tree without links: the middle one of each part divides it (J. L. Bentley 1975).
#[derive(Clone, Debug)]
pub(super) struct Near {
    /// Points in the order of the tree, each with its number.
    points: Vec<(Point, usize)>,
    /// Of each inner node, by the place of its middle point: the axis that divides it.
    axes: Vec<u8>,
}

impl Near {
    /// O(n log n).
    pub(super) fn new(points: &[Point]) -> Self {
        let mut points: Vec<(Point, usize)> = points.iter().copied().enumerate().map(|(number, point)| (point, number)).collect();
        let mut axes = vec![0; points.len()];
        let mut parts = vec![(0, points.len())];
        while let Some((from, to)) = parts.pop() {
            let Some(part) = points.get_mut(from..to).filter(|part| part.len() > LEAF) else { continue };
            let spread = |axis: usize| {
                let [low, high] = part.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (point, _)| {
                    [low.min(point[axis]), high.max(point[axis])]
                });
                high - low
            };
            let spreads = [0, 1, 2].each(spread);
            let axis = (0..3).fold(0, |best, axis| if spreads[axis] > spreads[best] { axis } else { best });
            let middle = part.len() / 2;
            part.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
            axes.iter_mut().skip(from + middle).take(1).for_each(|known| *known = axis as u8);
            parts.extend([(from, from + middle), (from + middle + 1, to)]);
        }
        Self { points, axes }
    }

    /// The distance of the nearest point with a property from an edge, or `most` if none is nearer. Near O(log n) where few points
    /// are that near.
    pub(super) fn nearest(&self, edge: [Point; 2], most: f64, is_wanted: &impl Fn(usize) -> bool) -> f64 {
        let mut best = most;
        let mut parts = vec![(0, self.points.len())];
        while let Some((from, to)) = parts.pop() {
            let Some(part) = self.points.get(from..to) else { continue };
            let mut look = |&(point, number): &(Point, usize)| {
                let far = off(edge, point);
                if far < best && is_wanted(number) {
                    best = far;
                }
            };
            if part.len() <= LEAF {
                part.iter().for_each(look);
                continue;
            }
            let middle = part.len() / 2;
            let (Some(entry), Some(axis)) = (part.get(middle), self.axes.get(from + middle)) else { continue };
            look(entry);
            let axis = usize::from(*axis);
            let (cut, [a, b]) = (entry.0[axis], edge.each(|end| end[axis]));
            if a.min(b) - cut < best {
                parts.push((from, from + middle));
            }
            if cut - a.max(b) < best {
                parts.push((from + middle + 1, to));
            }
        }
        best
    }
}

/// How far a point is from an edge.
fn off([a, b]: [Point; 2], point: Point) -> f64 {
    let (along, to) = (sub(b, a), sub(point, a));
    let squared = dot(along, along);
    let share = if squared > 0.0 { (dot(to, along) / squared).clamp(0.0, 1.0) } else { 0.0 };
    distance(to, scale(along, share))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// As by looking at all points.
        #[test]
        fn the_nearest_is_found(points in prop::collection::vec(prop::array::uniform3(-3.0..3.0_f64), 0..60),
            edge in prop::array::uniform2(prop::array::uniform3(-3.0..3.0_f64)), most in 0.1..5.0_f64) {
            let is_wanted = |number: usize| !number.is_multiple_of(3);
            let all = points.iter().enumerate().filter(|(number, _)| is_wanted(*number)).map(|(_, point)| off(edge, *point));
            prop_assert_eq!(Near::new(&points).nearest(edge, most, &is_wanted), all.fold(most, f64::min));
        }
    }
}
