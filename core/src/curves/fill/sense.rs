//! Directions of the curves of loops, where those that a file says do not let their ends meet.

use crate::curves::Use;
use crate::curves::curve::Shape;
use crate::curves::vector::{Point, distance};

/// Turns curves of loops so that the sum of the distances between ends that follow each other is the least one, if these ends are
/// within `near` then, in lengths of the loop, and were not before. Files that trim surfaces one by one may say directions of
/// curves that lead nowhere. O(uses).
pub(super) fn turn(shapes: &[&Shape], uses: &mut [Use], near: f64) {
    let ends = |one: &Use| shapes.get(one.curve).map(|shape| shape.ends());
    let Some(all) = uses.iter().map(ends).collect::<Option<Vec<[Point; 2]>>>() else { return };
    let size = all.iter().map(|[a, b]| distance(*a, *b)).sum::<f64>();
    let given: Vec<bool> = uses.iter().map(|one| one.is_reversed).collect();
    if largest(&all, &given) <= near * size {
        return;
    }
    let best = [false, true].map(|first| least(&all, &given, first)).into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, turned)) = best.filter(|(_, turned)| largest(&all, turned) <= near * size) else { return };
    uses.iter_mut().zip(turned).for_each(|(one, is_reversed)| one.is_reversed = is_reversed);
}

/// Start and end of a curve in a direction.
fn way([a, b]: [Point; 2], is_reversed: bool) -> [Point; 2] {
    if is_reversed { [b, a] } else { [a, b] }
}

/// The largest distance of ends that follow each other.
fn largest(ends: &[[Point; 2]], directions: &[bool]) -> f64 {
    let ways: Vec<[Point; 2]> = ends.iter().zip(directions).map(|(ends, is_reversed)| way(*ends, *is_reversed)).collect();
    ways.iter().zip(ways.iter().cycle().skip(1)).fold(0.0, |most, (one, next)| most.max(distance(one[1], next[0])))
}

/// The least sum of distances, where the first curve has a direction, and the directions that have it (R. Bellman, *Dynamic
/// programming*, 1957): of all ways to a curve, the best one for each of its directions is kept. Of equal sums, given directions win.
fn least(ends: &[[Point; 2]], given: &[bool], first: bool) -> (f64, Vec<bool>) {
    let mut sums = [if first { f64::INFINITY } else { 0.0 }, if first { 0.0 } else { f64::INFINITY }];
    // For each direction of each curve, that of the curve before.
    let mut from: Vec<[bool; 2]> = vec![[first; 2]];
    for (pair, is_given) in ends.windows(2).zip(given) {
        let &[before, own] = pair else { continue };
        let mut next = [(f64::INFINITY, *is_given); 2];
        for (entry, is_reversed) in next.iter_mut().zip([false, true]) {
            for was in [*is_given, !*is_given] {
                let sum = sums[usize::from(was)] + distance(way(before, was)[1], way(own, is_reversed)[0]);
                if sum < entry.0 {
                    *entry = (sum, was);
                }
            }
        }
        sums = next.map(|(sum, _)| sum);
        from.push(next.map(|(_, was)| was));
    }
    let (Some(start), Some(last)) = (ends.first(), ends.last()) else { return (f64::INFINITY, Vec::new()) };
    let closed = [false, true].map(|end| sums[usize::from(end)] + distance(way(*last, end)[1], way(*start, first)[0]));
    let mut own = match given.last() {
        Some(true) => closed[1] <= closed[0],
        _ => closed[1] < closed[0],
    };
    let sum = closed[usize::from(own)];
    let mut directions: Vec<bool> = Vec::with_capacity(ends.len());
    for from in from.iter().rev() {
        directions.push(own);
        own = from[usize::from(own)];
    }
    directions.reverse();
    (sum, directions)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn polygon(count: usize) -> Vec<Shape> {
        let point = |at: usize| [((at % count) as f64).cos(), ((at % count) as f64).sin(), (at % count) as f64];
        (0..count).map(|at| Shape::Line([point(at), point(at + 1)])).collect()
    }

    proptest! {
        /// The curves of a polygon follow each other afterwards, all one way or all the other, whatever directions are said.
        #[test]
        fn curves_of_a_loop_follow_each_other(said in prop::collection::vec(any::<bool>(), 3..9)) {
            let shapes = polygon(said.len());
            let shapes: Vec<&Shape> = shapes.iter().collect();
            let mut uses: Vec<Use> = said.iter().enumerate().map(|(curve, is_reversed)| Use { curve, is_reversed: *is_reversed }).collect();
            turn(&shapes, &mut uses, 1e-9);
            prop_assert!(uses.iter().all(|one| !one.is_reversed));
        }
    }

    /// With a curve missing, no directions are right, and those that were given stay.
    #[test]
    fn open_curves_stay() {
        let shapes = polygon(5);
        let shapes: Vec<&Shape> = shapes.iter().take(4).collect();
        let given: Vec<Use> = (0..4).map(|curve| Use { curve, is_reversed: curve == 2 }).collect();
        let mut uses = given.clone();
        turn(&shapes, &mut uses, 1e-9);
        assert_eq!(uses, given);
    }
}
