//! What closes loops as their surroundings were: a loop is asked for again and again, while little around it changes.

use std::collections::HashMap;
use std::sync::Mutex;

use crate::algorithms::triangulate::{Patch, Unfillable};
use crate::geometry::exact::Point;
use crate::submesh::{Submesh, Vertex};

/// All that a loop's patch depends on.
#[derive(Clone, PartialEq)]
pub(crate) struct Around {
    pub(crate) points: Vec<Point>,
    pub(crate) apexes: Vec<Option<Point>>,
    /// Where its two sides meet, if it is narrow.
    pub(crate) folds: Option<[usize; 2]>,
    /// As [`joined`].
    pub(crate) joined: Vec<(u32, u32)>,
    pub(crate) max_vertices: usize,
}

/// What came of loops, by number.
#[derive(Default)]
pub(crate) struct Known(Mutex<HashMap<u32, Vec<(Around, Made)>>>);

type Made = Result<Patch, Unfillable>;

/// Surroundings that are kept of a loop, at most.
const KEPT: usize = 4;

impl Known {
    /// What closes a loop, made anew if it never was with these surroundings.
    pub(crate) fn closed(&self, rim: u32, around: Around, make: impl FnOnce(&Around) -> Made) -> Made {
        if let Some(made) = self.find(rim, &around) {
            return made;
        }
        let made = make(&around);
        if let Ok(mut known) = self.0.lock() {
            let of_rim = known.entry(rim).or_default();
            if of_rim.len() < KEPT {
                of_rim.push((around, made.clone()));
            }
        }
        made
    }

    fn find(&self, rim: u32, around: &Around) -> Option<Made> {
        let known = self.0.lock().ok()?;
        known.get(&rim)?.iter().find(|(before, _)| before == around).map(|(_, made)| made.clone())
    }
}

/// The pairs of a loop's vertices with an edge of the mesh between them, by their numbers on the loop, the smaller one first; ascending. Exactly those of
/// which [`Submesh::has_edge`] says so.
pub(crate) fn joined(submesh: &Submesh, vertices: &[Vertex]) -> Vec<(u32, u32)> {
    let mut numbers: Vec<(Vertex, u32)> = vertices.iter().copied().zip(0..).collect();
    numbers.sort_unstable();
    let mut joined = Vec::new();
    for (i, v) in (0..).zip(vertices) {
        for other in submesh.star(*v).flat_map(|(t, _)| submesh.triangles[t as usize].v) {
            let first = numbers.partition_point(|(w, _)| *w < other);
            for (_, j) in numbers[first..].iter().take_while(|(w, _)| *w == other) {
                // The star of the smaller one tells, if all of it is here.
                let smaller = vertices[i.min(*j) as usize];
                if i != *j && submesh.complete[smaller as usize] == (i < *j) {
                    joined.push((i.min(*j), i.max(*j)));
                }
            }
        }
    }
    joined.sort_unstable();
    joined.dedup();
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_is_not_made_again() {
        let known = Known::default();
        let around = |x: f32| Around { points: vec![[x; 3]], apexes: vec![None], folds: None, joined: vec![], max_vertices: 9 };
        let never = |_: &Around| -> Made { panic!("made again") };
        assert_eq!(known.closed(7, around(1.0), |_| Err(Unfillable::Blocked)), Err(Unfillable::Blocked));
        assert_eq!(known.closed(7, around(1.0), never), Err(Unfillable::Blocked));
        assert_eq!(known.closed(7, around(2.0), |_| Err(Unfillable::TooLarge)), Err(Unfillable::TooLarge), "something moved");
        assert_eq!(known.closed(8, around(1.0), |_| Err(Unfillable::TooLarge)), Err(Unfillable::TooLarge), "another loop");
        assert_eq!(known.closed(7, around(2.0), never), Err(Unfillable::TooLarge));
    }
}
