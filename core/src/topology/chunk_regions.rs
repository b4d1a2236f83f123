//! From the patches of chunks, here parts, to those of the file: parts that share a triangle are united.
//!
//! The parts are kept, and which of them are neighbours, so that chunks can be solved again without the others: where vertices divide the
//! surface, only the chunks where these are at home say something new, and those that share triangles with them say it again.

use crate::geometry::sums::Measure;
use crate::io::record::{self, Record};
use crate::stream::budget::{Budget, Purpose};
use crate::stream::plan::ChunkId;
use crate::topology::chunk::{self, ChunkTopology, Link, Suspect};
use crate::topology::labels::Labels;
use crate::topology::patch_sums::Patch;
use crate::util::radix;
use crate::util::union_find::NONE;

/// What the chunks said, before it is united.
#[derive(Debug)]
pub(crate) struct Parts {
    /// The first part of each chunk, and one past the last.
    bases: Vec<u32>,
    /// Sums leave the suspects out.
    sums: Vec<Patch>,
    /// Parts that share a triangle, each pair once, ascending.
    neighbours: Vec<[u32; 2]>,
    /// A part of each suspect that has sound corners, by ascending suspect.
    of_suspects: Vec<(u32, u32)>,
}

impl Parts {
    pub(crate) fn none(chunks: usize) -> Self {
        Self { bases: vec![0; chunks + 1], sums: Vec::new(), neighbours: Vec::new(), of_suspects: Vec::new() }
    }

    /// Numbers of the parts of a chunk.
    pub(crate) fn of_chunk(&self, chunk: ChunkId) -> std::ops::Range<usize> {
        let c = chunk.0 as usize;
        self.bases[c] as usize..self.bases[c + 1] as usize
    }

    fn chunk_of(&self, part: u32) -> usize {
        self.bases.partition_point(|base| *base <= part) - 1
    }

    /// By chunk: is it among these, or does it share a triangle with a sound corner on each side with one of these?
    pub(crate) fn with_neighbours(&self, chunks: &[bool]) -> Vec<bool> {
        let mut all = chunks.to_vec();
        for pair in &self.neighbours {
            let [a, b] = pair.map(|part| self.chunk_of(part));
            all[a] |= chunks[b];
            all[b] |= chunks[a];
        }
        all
    }

    /// The parts with what chunks say that were solved again, ascending, and all suspects, with those that were known. `is_changed`: vertices at home in
    /// that chunk became unsound, so that its parts are others; the other chunks solved share triangles with such ones, and say what they said.
    /// O(parts + seams + suspects), sorted.
    pub(crate) fn renewed(
        &self,
        (records, measure): (&[Record], &Measure),
        mut suspects: Vec<Suspect>,
        fresh: &mut [(ChunkId, &mut ChunkTopology)],
        is_changed: impl Fn(usize) -> bool,
    ) -> (Self, Vec<Suspect>) {
        let mut links: Vec<Link> = Vec::with_capacity(fresh.iter().map(|(_, c)| c.links.len()).sum());
        suspects.reserve_exact(fresh.iter().map(|(_, c)| c.suspects.len()).sum());
        let chunks = self.bases.len() - 1;
        let mut new = Self::none(chunks);
        let mut fresh = fresh.iter_mut().peekable();
        for c in 0..chunks {
            let base = new.bases[c];
            match fresh.next_if(|(chunk, _)| chunk.0 as usize == c) {
                Some((_, chunk)) => {
                    new.sums.append(&mut chunk.patches);
                    links.extend(std::mem::take(&mut chunk.links).into_iter().map(|l| l.raised(base)));
                    suspects.append(&mut std::mem::take(&mut chunk.suspects));
                }
                None => new.sums.extend_from_slice(&self.sums[self.of_chunk(ChunkId(c as u32))]),
            }
            new.bases[c + 1] = new.sums.len() as u32;
        }
        radix::sort_by_number(&mut suspects, |s| s.triangle);
        suspects.dedup_by(|b, a| {
            let same = a.triangle == b.triangle;
            a.unsound |= if same { b.unsound } else { 0 };
            same
        });
        radix::sort_by_number(&mut links, |l| l.triangle);
        let renumbered = |part: u32| {
            let c = self.chunk_of(part);
            (!is_changed(c)).then(|| part - self.bases[c] + new.bases[c])
        };
        let kept = self.neighbours.iter().filter_map(|[a, b]| Some([renumbered(*a)?, renumbered(*b)?]));
        // A triangle is seen by three chunks at most.
        let sharing = |k: usize| {
            let pairs = links.windows(k + 1).filter(move |of| of[0].triangle == of[k].triangle);
            pairs.map(move |of| [of[0].patch(), of[k].patch()])
        };
        let all = kept.chain(sharing(1)).chain(sharing(2)).filter(|[a, b]| a != b);
        new.neighbours = all.map(|[a, b]| [a.min(b), a.max(b)]).collect();
        new.neighbours.sort_unstable();
        new.neighbours.dedup();
        new.neighbours.shrink_to_fit();
        let mut known = self.of_suspects.iter().peekable();
        let of_links = take_out_suspects(records, measure, &links, &suspects, &mut new.sums);
        for (suspect, part) in suspects.iter().zip(of_links) {
            let before = known.next_if(|(triangle, _)| *triangle == suspect.triangle).and_then(|(_, part)| renumbered(*part));
            new.of_suspects.extend(part.or(before).map(|part| (suspect.triangle, part)));
        }
        (new, suspects)
    }

    /// The patches of the file by their smallest triangle, and for each part which one it is of.
    pub(crate) fn united(&self) -> (Vec<Patch>, Vec<u32>) {
        let mut parents: Vec<u32> = (0..self.sums.len() as u32).collect();
        for [a, b] in &self.neighbours {
            crate::util::union_find::unite(&mut parents, *a, *b);
        }
        number(&mut parents, &self.sums)
    }

    /// The patch of each suspect's sound corners, or [`NONE`].
    pub(crate) fn patches_of(&self, suspects: &[Suspect], merged: &[u32]) -> Vec<u32> {
        let mut known = self.of_suspects.iter().peekable();
        let part = |s: &Suspect| known.next_if(|(triangle, _)| *triangle == s.triangle);
        suspects.iter().map(part).map(|known| known.map_or(NONE, |(_, part)| merged[*part as usize])).collect()
    }

    /// Counts what is kept, with the labels of the chunks that are.
    pub(crate) fn take<'l>(&self, budget: &Budget, labels: impl Iterator<Item = &'l Labels>, suspects: u64) {
        let labels: u64 = labels.map(Labels::heap_bytes).sum();
        budget.take(Purpose::Surface, labels + self.sums.len() as u64 * chunk::BYTES_PER_PATCH);
        let seams = size_of_val(&*self.neighbours) + size_of_val(&*self.of_suspects);
        budget.take(Purpose::Seams, 2 * seams as u64);
        budget.take(Purpose::Defects, crate::stream::budget::workshop_bytes(suspects, suspects));
    }
}

/// Takes suspects out of the sums of chunks that knew nothing against them; returns a part of each suspect.
fn take_out_suspects(
    records: &[Record],
    measure: &Measure,
    links: &[Link],
    suspects: &[Suspect],
    sums: &mut [Patch],
) -> Vec<Option<u32>> {
    let mut parts = vec![None; suspects.len()];
    let mut s = 0;
    for link in links {
        while s < suspects.len() && suspects[s].triangle < link.triangle {
            s += 1;
        }
        if s < suspects.len() && suspects[s].triangle == link.triangle {
            parts[s] = Some(link.patch());
            if link.is_counted() {
                let sum = &mut sums[link.patch() as usize];
                sum.triangles -= 1;
                sum.extent -= measure.triangle(&record::corners(&records[link.triangle as usize]));
            }
        }
    }
    parts
}

/// Folds united parts into one patch each and numbers them by their smallest triangle.
fn number(parents: &mut [u32], sums: &[Patch]) -> (Vec<Patch>, Vec<u32>) {
    let mut merged = vec![NONE; sums.len()];
    let mut patches: Vec<Patch> = Vec::new();
    for (raw, sum) in sums.iter().enumerate() {
        // The root is the smallest of its union, so it comes first.
        let root = crate::util::union_find::find(parents, raw as u32) as usize;
        if root == raw {
            merged[raw] = patches.len() as u32;
            patches.push(*sum);
        } else {
            merged[raw] = merged[root];
            let into = &mut patches[merged[root] as usize];
            into.triangles += sum.triangles;
            into.extent += sum.extent;
            into.bounds.add(&sum.bounds);
            into.first = into.first.min(sum.first);
        }
    }
    let mut order: Vec<u32> = (0..patches.len() as u32).collect();
    order.sort_unstable_by_key(|p| patches[*p as usize].first);
    let mut rank = vec![0; order.len()];
    order.iter().enumerate().for_each(|(r, p)| rank[*p as usize] = r as u32);
    merged.iter_mut().for_each(|m| *m = rank[*m as usize]);
    (order.into_iter().map(|p| patches[p as usize]).collect(), merged)
}
