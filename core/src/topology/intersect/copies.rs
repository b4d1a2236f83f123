//! Triangles of the same three vertices, either way round: all of them meet what one of them meets, so that only the first is looked at.
//!
//! A vertex of two such triangles is not regular, so triangles with a regular corner are none. All of them are members of
//! a chunk or visitors or neither, so that every chunk that sees one finds the same ones, and what is counted stays a property
//! of the mesh.

use std::ops::Range;

use super::view::{CellView, Standing};
use crate::util::ids::NONE;

/// Groups of triangles of the same vertices.
#[derive(Default)]
pub(crate) struct Copies {
    /// One group after the other, each ascending.
    triangles: Vec<u32>,
    /// By their first triangles.
    groups: Vec<Range<u32>>,
}

/// Bytes that [`Copies`] take for each triangle, at most: its number, and half a group.
pub(super) const BYTES_PER_TRIANGLE: u64 = 8;

/// In place of a key that was taken out; no triangle has it.
const TAKEN: u64 = u64::MAX;

impl Copies {
    /// Finds the groups among the triangles of these keys, which are in the order of their places (the upper half): triangles of
    /// the same vertices have the same. Leaves only the first of each group. O(n log n) in the triangles without regular corner at one place.
    pub(super) fn take_out(&mut self, view: &CellView<'_>, keys: &mut Vec<u64>) {
        self.triangles.clear();
        self.groups.clear();
        let of = |key: u64| view.triangles[key as u32 as usize];
        let may_be = |key: u64| of(key).iter().all(|v| view.standing[*v as usize] != Standing::Regular);
        let corners = |key: u64| {
            let mut t = if may_be(key) { of(key) } else { [NONE; 3] };
            t.sort_unstable();
            t
        };
        let mut start = 0;
        while start < keys.len() {
            let place = keys[start] >> 32;
            let end = start + keys[start..].iter().take_while(|key| **key >> 32 == place).count();
            let run = &mut keys[start..end];
            start = end;
            if run.len() == 1 || run.iter().filter(|key| may_be(**key)).count() < 2 {
                continue;
            }
            run.sort_unstable_by_key(|key| (corners(*key), *key));
            for same in run.chunk_by_mut(|a, b| corners(*a) == corners(*b)).filter(|same| same.len() > 1 && may_be(same[0])) {
                let first = self.triangles.len() as u32;
                self.triangles.extend(same.iter().map(|key| *key as u32));
                self.groups.push(first..self.triangles.len() as u32);
                same[1..].fill(TAKEN);
            }
        }
        if !self.groups.is_empty() {
            keys.retain(|key| *key != TAKEN);
            let triangles = &self.triangles;
            self.groups.sort_unstable_by_key(|group| triangles[group.start as usize]);
        }
    }

    fn at(&self, group: &Range<u32>) -> &[u32] {
        &self.triangles[group.start as usize..group.end as usize]
    }

    /// All groups, each ascending.
    pub(crate) fn groups(&self) -> impl Iterator<Item = &[u32]> {
        self.groups.iter().map(|group| self.at(group))
    }

    /// The group of which this triangle is the first, if there is one.
    #[inline]
    pub(super) fn of(&self, first: u32) -> Option<&[u32]> {
        if self.groups.is_empty() {
            return None;
        }
        let found = self.groups.binary_search_by_key(&first, |group| self.triangles[group.start as usize]);
        found.ok().map(|i| self.at(&self.groups[i]))
    }
}
