//! Triangles by the chunks whose cells they meet: a few bytes each, so that only those of a chunk are there with their corners at a time.

use crate::geometry::boxes::BoxTree;
use crate::geometry::sums::Bounds;
use crate::geometry::tri_tri::Triangle as Corners;
use crate::stream::plan::{ChunkId, Plan};

/// Triangles that their owner makes when asked for them: so many, each with a number that no other one has.
#[derive(Clone, Copy)]
pub(crate) struct Listed<'a> {
    pub(crate) count: usize,
    pub(crate) of: &'a (dyn Fn(usize) -> (u32, Corners) + Sync),
}

impl<'a> Listed<'a> {
    /// No triangles.
    pub(crate) const NONE: Listed<'static> = Listed { count: 0, of: &|_| unreachable!() };

    pub(super) fn bounds(self) -> impl Iterator<Item = Bounds> + Clone + use<'a> {
        (0..self.count).map(move |i| Bounds::of(&(self.of)(i).1))
    }
}

/// A triangle that meets more cells is found by its box.
const MOST_CELLS: usize = 8;

/// Which of some triangles meet the cell of which chunk, by their places in the list.
pub(super) struct Placed {
    /// By chunk the end of its part.
    ends: Vec<u32>,
    of_chunks: Vec<u32>,
    wide: Vec<u32>,
    tree: BoxTree,
}

impl Placed {
    /// Those of a list that are `wanted`. Two looks at each. O(n log chunks); 4 bytes a triangle and cell.
    pub(super) fn of(plan: &Plan, all: Listed<'_>, wanted: impl Fn(&Bounds) -> bool) -> Self {
        let mut ends = vec![0u32; plan.chunks()];
        let mut wide = Vec::new();
        let mut cells = Vec::new();
        let mut each = |visit: &mut dyn FnMut(u32, &[ChunkId])| {
            for (i, bounds) in all.bounds().enumerate().filter(|(_, bounds)| wanted(bounds)) {
                cells.clear();
                plan.meeting(bounds.lo, bounds.hi, &mut |chunk| cells.push(chunk));
                visit(i as u32, &cells);
            }
        };
        each(&mut |i, cells| match cells.len() {
            0..=MOST_CELLS => cells.iter().for_each(|chunk| ends[chunk.0 as usize] += 1),
            _ => wide.push(i),
        });
        let mut before = 0;
        for end in &mut ends {
            before += std::mem::replace(end, before);
        }
        let mut of_chunks = vec![0u32; before as usize];
        each(&mut |i, cells| {
            for chunk in cells.iter().filter(|_| cells.len() <= MOST_CELLS) {
                let end = &mut ends[chunk.0 as usize];
                of_chunks[*end as usize] = i;
                *end += 1;
            }
        });
        let boxes: Vec<Bounds> = wide.iter().map(|i| Bounds::of(&(all.of)(*i as usize).1)).collect();
        Self { ends, of_chunks, wide, tree: BoxTree::new(&boxes) }
    }

    /// Replaces `found` by the places of the triangles that meet a chunk's cell, ascending.
    pub(super) fn meeting(&self, chunk: ChunkId, cell: &Bounds, found: &mut Vec<u32>) {
        self.tree.meeting(cell, found);
        found.iter_mut().for_each(|i| *i = self.wide[*i as usize]);
        found.extend(self.part(chunk));
        found.sort_unstable();
    }

    /// False only if no triangle meets the cell of this chunk.
    pub(super) fn may_meet(&self, chunk: ChunkId) -> bool {
        !self.wide.is_empty() || !self.part(chunk).is_empty()
    }

    /// The triangles that meet few cells, one of them this chunk's.
    fn part(&self, chunk: ChunkId) -> &[u32] {
        let chunk = chunk.0 as usize;
        let first = chunk.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.of_chunks[first as usize..self.ends[chunk] as usize]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::io::read_ahead::Guide;
    use crate::testing::{records, soup};

    proptest! {
        /// A chunk is told of the triangles whose boxes meet its cell, be they few cells wide or many.
        #[test]
        fn a_chunk_is_told_of_all_that_meets_its_cell(triangles in soup(), leave in any::<u8>()) {
            let plan = Plan::new(&records(&triangles), &Guide::NONE, 1);
            let of = |i: usize| (i as u32, triangles[i]);
            // A triangle whose corners are no places meets nothing, and nobody asks for it.
            let is_somewhere = |b: &Bounds| (0..3).all(|k| b.lo[k] <= b.hi[k]);
            let kept = |b: &Bounds| is_somewhere(b) && b.lo[0] as i32 % 3 != i32::from(leave % 3);
            let placed = Placed::of(&plan, Listed { count: triangles.len(), of: &of }, kept);
            let mut found = Vec::new();
            for chunk in (0..plan.chunks() as u32).map(ChunkId) {
                let (lo, hi) = plan.home_box(chunk).ends();
                placed.meeting(chunk, &Bounds { lo, hi }, &mut found);
                let meets = |b: &Bounds| kept(b) && plan.home_box(chunk).meets(b);
                let wanted: Vec<u32> =
                    (0..triangles.len() as u32).filter(|i| meets(&Bounds::of(&triangles[*i as usize]))).collect();
                prop_assert_eq!(&found, &wanted);
                prop_assert!(placed.may_meet(chunk) || found.is_empty());
            }
        }
    }
}
