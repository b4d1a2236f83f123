//! Pieces on top of each other are made one.

use crate::geometry::arrange::cells;
use crate::geometry::arrange::piece::{Arrangement, Piece, agree};
use crate::util::parallel;

/// Pieces before they are compared.
pub(crate) struct Raw<'p> {
    pub(crate) points: Vec<[f64; 3]>,
    pub(crate) exact: Vec<bool>,
    /// By source.
    pub(crate) pieces: &'p [(u32, [u32; 3])],
}

impl Raw<'_> {
    /// `side` of a point by the plane of a triangle.
    pub(crate) fn finish(
        self,
        triangles: &[[[f32; 3]; 3]],
        side: &(dyn Fn(u32, u32) -> i8 + Sync),
        threads: usize,
    ) -> Arrangement {
        let (mut pieces, covered) = flatten(self.points.len(), self.pieces, triangles, threads);
        let cells = cells::number(triangles, &mut pieces, side, threads);
        let fits = |(p, exact): (&[f64; 3], &bool)| *exact && p.iter().all(|x| f64::from(*x as f32) == *x);
        let exact = self.points.iter().zip(&self.exact).map(fits).collect();
        Arrangement { points: self.points, exact, covered, pieces, cells }
    }
}

/// The pieces with those on top of each other made one, of the first source; and which sources have lost any by that.
///
/// Two sources that lie in one plane and overlap have the same points and constraints where they do, but perhaps not the same triangles. A
/// piece lies in another source if all its corners are points of that one, since it is convex and in its plane then.
fn flatten(points: usize, all: &[(u32, [u32; 3])], triangles: &[[[f32; 3]; 3]], threads: usize) -> (Vec<Piece>, Vec<bool>) {
    let mut sources: Vec<Vec<u32>> = vec![Vec::new(); points];
    for (source, v) in all {
        for v in v {
            // By source, as the pieces are.
            if sources[*v as usize].last() != Some(source) {
                sources[*v as usize].push(*source);
            }
        }
    }
    // None: an earlier source has the same.
    let step = |(source, v): &(u32, [u32; 3])| -> Option<i32> {
        let mut lists = v.map(|v| &sources[v as usize]);
        lists.sort_unstable_by_key(|list| list.len());
        let [a, b, c] = lists;
        let others = || a.iter().filter(|s| *s != source && b.binary_search(s).is_ok() && c.binary_search(s).is_ok());
        if others().next().is_some_and(|first| first < source) {
            return None;
        }
        let agrees = |other: &u32| agree(&triangles[*source as usize], &triangles[*other as usize]);
        Some(1 + others().map(|other| if agrees(other) { 1 } else { -1 }).sum::<i32>())
    };
    let steps = parallel::map(threads, all.len(), |i| step(&all[i]));
    let mut covered = vec![false; triangles.len()];
    let mut pieces = Vec::with_capacity(all.len());
    for ((source, v), step) in all.iter().zip(steps) {
        match step {
            Some(step) => pieces.push(Piece { source: *source, v: *v, step, cells: [0; 2] }),
            None => covered[*source as usize] = true,
        }
    }
    (pieces, covered)
}
