//! Which triangles each chunk sees: every triangle with a corner at home there, as run-coded lists in ascending order.
//!
//! One pass over the records. A coherent file stays inside the current chunk's box for long stretches, so a list costs about
//! 0.02 bytes a triangle; a shuffled one costs up to 2.

use crate::plan::{ChunkId, Plan};
use crate::record::{self, Record};
use crate::sums::Bounds;

/// The member lists of all chunks, and what the same pass learns about the whole file.
#[derive(Debug)]
pub(crate) struct Members {
    /// `lists[chunk][piece]`: pieces are consecutive stretches of the file.
    lists: Vec<Vec<RunList>>,
    /// Runs of triangles with a NaN or infinite coordinate: first and count.
    pub(crate) nonfinite: Vec<(u32, u32)>,
    pub(crate) bounds: Bounds,
}

/// Ascending runs of triangle numbers, as variable-length integers: `distance from the end of the previous run << 1 | longer`,
/// followed by `length − 2` when the run is longer than one.
#[derive(Clone, Debug, Default)]
struct RunList {
    bytes: Vec<u8>,
    end: u32,
}

impl RunList {
    fn push(&mut self, first: u32, count: u32) {
        let gap = u64::from(first - self.end) << 1 | u64::from(count > 1);
        put_varint(&mut self.bytes, gap);
        if count > 1 {
            put_varint(&mut self.bytes, u64::from(count - 2));
        }
        self.end = first + count;
    }

    fn runs(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        let (mut rest, mut end) = (self.bytes.as_slice(), 0u32);
        std::iter::from_fn(move || {
            let gap = take_varint(&mut rest)?;
            let count = if gap & 1 == 1 { take_varint(&mut rest)? as u32 + 2 } else { 1 };
            let first = end + (gap >> 1) as u32;
            end = first + count;
            Some((first, count))
        })
    }
}

/// Appends `value` in groups of seven bits, least first.
pub(crate) fn put_varint(out: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

/// Takes one value written by [`put_varint`] off the front.
pub(crate) fn take_varint(bytes: &mut &[u8]) -> Option<u64> {
    let (mut value, mut shift) = (0u64, 0);
    loop {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        value |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(value);
        }
        shift += 7;
    }
}

/// What one piece of the file yields.
struct Piece {
    lists: Vec<RunList>,
    nonfinite: Vec<(u32, u32)>,
    bounds: Bounds,
}

impl Members {
    /// Reads all records once, on `threads` threads.
    pub(crate) fn gather(records: &[Record], plan: &Plan, threads: usize) -> Self {
        // More pieces than threads only even out the load: lists of all pieces together say the same for any number of pieces.
        let pieces = if records.len() < 1 << 16 { 1 } else { threads * 4 };
        let size = records.len().div_ceil(pieces).max(1);
        let results = crate::parallel::map(threads, records.len().div_ceil(size), |piece| {
            let from = piece * size;
            gather_piece(&records[from..records.len().min(from + size)], from as u32, plan)
        });
        let mut members = Self { lists: vec![Vec::new(); plan.chunks()], nonfinite: Vec::new(), bounds: Bounds::EMPTY };
        for piece in results {
            for (chunk, mut list) in piece.lists.into_iter().enumerate() {
                if !list.bytes.is_empty() {
                    list.bytes.shrink_to_fit();
                    members.lists[chunk].push(list);
                }
            }
            members.nonfinite.extend(piece.nonfinite);
            members.bounds.add(&piece.bounds);
        }
        members
    }

    /// Runs of the triangles that `chunk` sees: first and count, ascending.
    pub(crate) fn runs(&self, chunk: ChunkId) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.lists[chunk.0 as usize].iter().flat_map(RunList::runs)
    }

    /// Triangle numbers that `chunk` sees, ascending.
    pub(crate) fn triangles(&self, chunk: ChunkId) -> impl Iterator<Item = u32> + '_ {
        self.runs(chunk).flat_map(|(first, count)| first..first + count)
    }

    /// Bytes held.
    pub(crate) fn heap_bytes(&self) -> usize {
        let lists: usize = self.lists.iter().flatten().map(|l| l.bytes.capacity() + size_of::<RunList>()).sum();
        lists + self.nonfinite.capacity() * 8
    }
}

fn gather_piece(records: &[Record], offset: u32, plan: &Plan) -> Piece {
    let mut piece = Piece { lists: vec![RunList::default(); plan.chunks()], nonfinite: Vec::new(), bounds: Bounds::EMPTY };
    let mut current = ChunkId(0);
    let mut cell = plan.home_box(current);
    let mut run_start = 0;
    let close = |piece: &mut Piece, chunk: ChunkId, from: usize, to: usize| {
        if to > from {
            piece.lists[chunk.0 as usize].push(offset + from as u32, (to - from) as u32);
        }
    };
    for (i, record) in records.iter().enumerate() {
        let corners = record::corners(record);
        if cell.holds(corners[0]) && cell.holds(corners[1]) && cell.holds(corners[2]) {
            piece.bounds.include(&corners);
            continue;
        }
        close(&mut piece, current, run_start, i);
        run_start = i + 1;
        if !corners.iter().flatten().all(|x| x.is_finite()) {
            match piece.nonfinite.last_mut() {
                Some((first, count)) if *first + *count == offset + i as u32 => *count += 1,
                _ => piece.nonfinite.push((offset + i as u32, 1)),
            }
            continue;
        }
        piece.bounds.include(&corners);
        let homes = corners.map(|p| plan.home(p));
        if homes[0] == homes[1] && homes[0] == homes[2] {
            current = homes[0];
            cell = plan.home_box(current);
            run_start = i;
            continue;
        }
        for k in 0..3 {
            if !homes[..k].contains(&homes[k]) {
                piece.lists[homes[k].0 as usize].push(offset + i as u32, 1);
            }
        }
    }
    close(&mut piece, current, run_start, records.len());
    piece
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn runs_come_back_as_pushed(gaps in prop::collection::vec((0u32..1000, 1u32..1000), 0..50)) {
            let (mut list, mut end, mut want) = (RunList::default(), 0, Vec::new());
            for (gap, count) in gaps {
                list.push(end + gap, count);
                want.push((end + gap, count));
                end += gap + count;
            }
            prop_assert_eq!(list.runs().collect::<Vec<_>>(), want);
        }

        /// A chunk sees exactly the finite triangles with a corner at home there, whatever the chunk size.
        #[test]
        fn members_are_the_triangles_with_a_corner_at_home(
            points in prop::collection::vec(prop::array::uniform9(prop_oneof![9 => -4f32..4.0, 1 => Just(f32::NAN)]), 1..120),
            chunk in 1u32..40,
        ) {
            let records: Vec<Record> =
                points.iter().map(|p| record::encode([[p[0], p[1], p[2]], [p[3], p[4], p[5]], [p[6], p[7], p[8]]], 0)).collect();
            let plan = Plan::new(&records, chunk);
            let members = Members::gather(&records, &plan, 2);
            for c in 0..plan.chunks() {
                let c = ChunkId(c as u32);
                let want: Vec<u32> = (0..records.len() as u32)
                    .filter(|t| {
                        let corners = record::corners(&records[*t as usize]);
                        corners.iter().flatten().all(|x| x.is_finite()) && corners.iter().any(|p| plan.home(*p) == c)
                    })
                    .collect();
                prop_assert_eq!(members.triangles(c).collect::<Vec<_>>(), want);
            }
        }
    }
}
