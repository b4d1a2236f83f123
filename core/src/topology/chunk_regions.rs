//! From the regions of chunks, here parts, to those of the file: parts that share a triangle are united.
//!
//! The parts are kept, and which of them are neighbours, so that chunks can be solved again without the others: where vertices divide the
//! surface, only the chunks where these are at home say something new, and those that share triangles with them say it again.

use crate::geometry::sums::Measure;
use crate::io::record::{self, Record};
use crate::stream::budget::{Budget, Purpose};
use crate::stream::plan::ChunkId;
use crate::topology::chunk::{self, ChunkTopology, IrregularTriangle, Link};
use crate::topology::labels::Labels;
use crate::topology::region_sums::RegionSums;
use crate::util::ids::NONE;
use crate::util::radix;

/// Regions as the chunks told them, before they are united.
#[derive(Debug)]
pub(crate) struct Parts {
    /// The first part of each chunk, and one past the last.
    bases: Vec<u32>,
    /// Sums leave the irregular triangles out.
    sums: Vec<RegionSums>,
    /// Parts that share a triangle, each pair once, ascending.
    neighbours: Vec<[u32; 2]>,
    /// A part of each irregular triangle that has regular corners, by ascending irregular triangle.
    of_irregular_triangles: Vec<(u32, u32)>,
}

impl Parts {
    pub(crate) fn none(chunks: usize) -> Self {
        Self { bases: vec![0; chunks + 1], sums: Vec::new(), neighbours: Vec::new(), of_irregular_triangles: Vec::new() }
    }

    /// Numbers of the parts of a chunk.
    pub(crate) fn of_chunk(&self, chunk: ChunkId) -> std::ops::Range<usize> {
        let c = chunk.0 as usize;
        self.bases[c] as usize..self.bases[c + 1] as usize
    }

    fn chunk_of(&self, part: u32) -> usize {
        self.bases.partition_point(|base| *base <= part) - 1
    }

    /// By chunk: is it among these, or does it share a triangle with a regular corner on each side with one of these?
    pub(crate) fn with_neighbours(&self, chunks: &[bool]) -> Vec<bool> {
        let mut all = chunks.to_vec();
        for pair in &self.neighbours {
            let [a, b] = pair.map(|part| self.chunk_of(part));
            all[a] |= chunks[b];
            all[b] |= chunks[a];
        }
        all
    }

    /// Merges the chunks that were solved again, ascending, with the cached ones. `is_changed(c)`: vertices of chunk `c` itself became irregular, so
    /// its parts are others; the other chunks that were solved again only border such a chunk. `irregular_triangles`: all of them.
    /// O(parts + seams + irregular triangles), sorted.
    pub(crate) fn renewed(
        &self,
        (records, measure): (&[Record], &Measure),
        mut irregular_triangles: Vec<IrregularTriangle>,
        fresh: &mut [(ChunkId, &mut ChunkTopology)],
        is_changed: impl Fn(usize) -> bool,
    ) -> (Self, Vec<IrregularTriangle>) {
        let mut links: Vec<Link> = Vec::with_capacity(fresh.iter().map(|(_, c)| c.links.len()).sum());
        irregular_triangles.reserve_exact(fresh.iter().map(|(_, c)| c.irregular_triangles.len()).sum());
        let chunks = self.bases.len() - 1;
        let mut new = Self::none(chunks);
        let mut fresh = fresh.iter_mut().peekable();
        for c in 0..chunks {
            let base = new.bases[c];
            match fresh.next_if(|(chunk, _)| chunk.0 as usize == c) {
                Some((_, chunk)) => {
                    new.sums.append(&mut chunk.regions);
                    links.extend(std::mem::take(&mut chunk.links).into_iter().map(|l| l.raised(base)));
                    irregular_triangles.append(&mut std::mem::take(&mut chunk.irregular_triangles));
                }
                None => new.sums.extend_from_slice(&self.sums[self.of_chunk(ChunkId(c as u32))]),
            }
            new.bases[c + 1] = new.sums.len() as u32;
        }
        radix::sort_by_number(&mut irregular_triangles, |s| s.triangle);
        irregular_triangles.dedup_by(|b, a| {
            let same = a.triangle == b.triangle;
            a.irregular |= if same { b.irregular } else { 0 };
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
            pairs.map(move |of| [of[0].region(), of[k].region()])
        };
        let all = kept.chain(sharing(1)).chain(sharing(2)).filter(|[a, b]| a != b);
        new.neighbours = all.map(|[a, b]| [a.min(b), a.max(b)]).collect();
        new.neighbours.sort_unstable();
        new.neighbours.dedup();
        new.neighbours.shrink_to_fit();
        let mut known = self.of_irregular_triangles.iter().peekable();
        let of_links = take_out_irregular_triangles(records, measure, &links, &irregular_triangles, &mut new.sums);
        for (irregular_triangle, part) in irregular_triangles.iter().zip(of_links) {
            let before =
                known.next_if(|(triangle, _)| *triangle == irregular_triangle.triangle).and_then(|(_, part)| renumbered(*part));
            new.of_irregular_triangles.extend(part.or(before).map(|part| (irregular_triangle.triangle, part)));
        }
        (new, irregular_triangles)
    }

    /// The regions of the file by their smallest triangle, and for each part which one it is of.
    pub(crate) fn united(&self) -> (Vec<RegionSums>, Vec<u32>) {
        let mut parents: Vec<u32> = (0..self.sums.len() as u32).collect();
        for [a, b] in &self.neighbours {
            crate::util::union_find::unite(&mut parents, *a, *b);
        }
        number(&mut parents, &self.sums)
    }

    /// The region of each irregular triangle's regular corners, or [`NONE`].
    pub(crate) fn regions_of(&self, irregular_triangles: &[IrregularTriangle], merged: &[u32]) -> Vec<u32> {
        let mut known = self.of_irregular_triangles.iter().peekable();
        let part = |s: &IrregularTriangle| known.next_if(|(triangle, _)| *triangle == s.triangle);
        irregular_triangles.iter().map(part).map(|known| known.map_or(NONE, |(_, part)| merged[*part as usize])).collect()
    }

    /// Bytes held.
    pub(crate) fn heap_bytes(&self) -> u64 {
        self.seam_bytes() + (size_of_val(&*self.bases) + size_of_val(&*self.sums)) as u64
    }

    fn seam_bytes(&self) -> u64 {
        (size_of_val(&*self.neighbours) + size_of_val(&*self.of_irregular_triangles)) as u64
    }

    /// Counts what is kept, with the labels of the chunks that are.
    pub(crate) fn take<'l>(&self, budget: &Budget, labels: impl Iterator<Item = &'l Labels>, irregular_triangles: u64) {
        let labels: u64 = labels.map(Labels::heap_bytes).sum();
        budget.take(Purpose::Surface, labels + self.sums.len() as u64 * chunk::BYTES_PER_REGION);
        budget.take(Purpose::Seams, 2 * self.seam_bytes());
        budget.take(Purpose::Defects, crate::stream::budget::submesh_bytes(irregular_triangles, irregular_triangles));
    }
}

/// Takes irregular triangles out of the sums of chunks that knew nothing against them; returns a part of each irregular triangle.
fn take_out_irregular_triangles(
    records: &[Record],
    measure: &Measure,
    links: &[Link],
    irregular_triangles: &[IrregularTriangle],
    sums: &mut [RegionSums],
) -> Vec<Option<u32>> {
    let mut parts = vec![None; irregular_triangles.len()];
    let mut s = 0;
    for link in links {
        while s < irregular_triangles.len() && irregular_triangles[s].triangle < link.triangle {
            s += 1;
        }
        if s < irregular_triangles.len() && irregular_triangles[s].triangle == link.triangle {
            parts[s] = Some(link.region());
            if link.is_counted() {
                let sum = &mut sums[link.region() as usize];
                sum.triangles -= 1;
                sum.extent -= measure.triangle(&record::corners(&records[link.triangle as usize]));
            }
        }
    }
    parts
}

/// Folds united parts into one region each and numbers them by their smallest triangle.
fn number(parents: &mut [u32], sums: &[RegionSums]) -> (Vec<RegionSums>, Vec<u32>) {
    let mut merged = vec![NONE; sums.len()];
    let mut regions: Vec<RegionSums> = Vec::new();
    for (raw, sum) in sums.iter().enumerate() {
        // The root is the smallest of its union, so it comes first.
        let root = crate::util::union_find::find(parents, raw as u32) as usize;
        if root == raw {
            merged[raw] = regions.len() as u32;
            regions.push(*sum);
        } else {
            merged[raw] = merged[root];
            let into = &mut regions[merged[root] as usize];
            into.triangles += sum.triangles;
            into.extent += sum.extent;
            into.bounds.add(&sum.bounds);
            into.first = into.first.min(sum.first);
        }
    }
    let mut order: Vec<u32> = (0..regions.len() as u32).collect();
    order.sort_unstable_by_key(|p| regions[*p as usize].first);
    let mut rank = vec![0; order.len()];
    order.iter().enumerate().for_each(|(r, p)| rank[*p as usize] = r as u32);
    merged.iter_mut().for_each(|m| *m = rank[*m as usize]);
    (order.into_iter().map(|p| regions[p as usize]).collect(), merged)
}
