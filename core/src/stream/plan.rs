//! The chunk plan: a kd tree over sampled triangles whose leaves are the chunks.
//!
//! A position is *at home* in exactly one leaf, found by comparing raw f32 coordinates with the tree's planes. A plane is chosen
//! among three axes and five quantiles where it cuts the fewest sampled triangles, so that flat sheets are not sliced along their
//! noise. Where the planes lie depends on the number of chunks asked for, and nothing else may depend on that.

use crate::geometry::sums::Bounds;
use crate::io::read_ahead::Guide;
use crate::io::record::{self, Record};

/// A chunk, numbered by its place among the leaves of the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct ChunkId(pub(crate) u32);

/// A closed box of positions; never holds NaN or infinite ones.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HomeBox {
    lo: [f32; 3],
    hi: [f32; 3],
}

impl HomeBox {
    pub(crate) const ALL: Self = Self { lo: [-f32::MAX; 3], hi: [f32::MAX; 3] };

    /// Is there a position in both boxes?
    /// Around a triangle, wider by `reach` on all sides.
    pub(crate) fn around(corners: &[[f32; 3]; 3], reach: f32) -> Self {
        let Bounds { lo, hi } = Bounds::of(corners);
        Self { lo, hi }.grown(reach)
    }

    /// The same as a half-open box: from the first corner, and before the second one.
    pub(crate) fn half_open(&self) -> [[f32; 3]; 2] {
        [self.lo, self.hi.map(f32::next_up)]
    }

    #[cfg(test)]
    pub(crate) fn meets(&self, other: &Bounds) -> bool {
        (0..3).all(|k| self.lo[k] <= other.hi[k] && self.hi[k] >= other.lo[k])
    }

    /// Lowest and highest position.
    pub(crate) fn ends(&self) -> ([f32; 3], [f32; 3]) {
        (self.lo, self.hi)
    }

    /// Comparisons written so that NaN is outside.
    /// The box with so much more on all sides, or less if that is negative; of what is infinitely wide nothing changes.
    pub(crate) fn grown(&self, by: f32) -> Self {
        let away = |x: f32, by: f32| if x.abs() == f32::MAX { x } else { (x + by).clamp(-f32::MAX, f32::MAX) };
        let out = |x: f32| if by > 0.0 { x.next_up() } else { x };
        Self { lo: self.lo.map(|x| -out(-away(x, -by))), hi: self.hi.map(|x| out(away(x, by))) }
    }

    #[inline]
    pub(crate) fn holds(&self, p: [f32; 3]) -> bool {
        (0..3).all(|k| (p[k] >= self.lo[k]) & (p[k] <= self.hi[k]))
    }
}

/// Samples a leaf should see; more do not make better planes. Where each is a page to be read from the disk, a quarter of them will do.
const SAMPLES_PER_CHUNK: u64 = 64;

/// Planes of nodes before this one are shifted, if any are: one along each way. Further ones part what these have shifted.
const SHIFTED: usize = 8;

/// Heap-ordered kd tree: node 1 is the root, node `i` has children `2i` and `2i + 1`.
#[derive(Debug)]
pub(crate) struct Plan {
    /// Plane of each inner node: axis and the smallest coordinate of the upper side.
    planes: Vec<(u8, f32)>,
    boxes: Vec<HomeBox>,
    depth: u32,
}

impl Plan {
    /// A plan of about `records.len() / chunk_triangles` chunks, a power of two. O(n / chunk_triangles) time and memory.
    pub(crate) fn new(records: &[Record], guide: &Guide<'_>, chunk_triangles: u32) -> Self {
        let samples = if guide.is_needed() { SAMPLES_PER_CHUNK / 4 } else { SAMPLES_PER_CHUNK };
        Self::of_samples((records, guide), chunk_triangles, (samples, 0.0))
    }

    /// The same for work whose result depends on where the planes lie: they do not depend on memory. `shift`: so much less or more of what is there lies
    /// below the first planes along each way, so that the planes of several plans lie apart.
    pub(crate) fn shifted(records: &[Record], guide: &Guide<'_>, chunk_triangles: u32, shift: f64) -> Self {
        Self::of_samples((records, guide), chunk_triangles, (SAMPLES_PER_CHUNK, shift))
    }

    fn of_samples(of: (&[Record], &Guide<'_>), chunk_triangles: u32, (samples, shift): (u64, f64)) -> Self {
        let wanted = of.0.len() as u64 / u64::from(chunk_triangles.max(1));
        let depth = (wanted.max(1) as f64).log2().round() as u32;
        let chunks = 1usize << depth;
        let mut plan = Self { planes: vec![(0, 0.0); chunks], boxes: vec![HomeBox::ALL; chunks], depth };
        if depth > 0 {
            let mut samples = sample(of, chunks as u64 * samples);
            plan.split(1, (&mut samples, shift), HomeBox::ALL);
        }
        plan
    }

    fn split(&mut self, node: usize, (samples, shift): (&mut [Sample], f64), cell: HomeBox) {
        let chunks = self.planes.len();
        if node >= chunks {
            self.boxes[node - chunks] = cell;
            return;
        }
        let (axis, at) = best_plane(samples, &cell, if node < SHIFTED { shift } else { 0.0 });
        self.planes[node] = (axis as u8, at);
        let (mut below, mut above) = (cell, cell);
        below.hi[axis] = at.next_down();
        above.lo[axis] = at;
        let middle = partition(samples, |s| s.middle(axis) < at);
        let (left, right) = samples.split_at_mut(middle);
        self.split(2 * node, (left, shift), below);
        self.split(2 * node + 1, (right, shift), above);
    }

    pub(crate) fn chunks(&self) -> usize {
        self.boxes.len()
    }

    /// The plane of a node of the tree, whose root is 1 and whose node `i` has the parts `2i` below the plane and `2i + 1`: its axis, and the smallest
    /// coordinate of the upper part. None of a chunk.
    pub(crate) fn plane(&self, node: usize) -> Option<(usize, f32)> {
        self.planes.get(node).map(|(axis, at)| (usize::from(*axis), *at))
    }

    /// Bytes held.
    pub(crate) fn heap_bytes(&self) -> u64 {
        (self.chunks() * (size_of::<(u8, f32)>() + size_of::<HomeBox>())) as u64
    }

    pub(crate) fn home_box(&self, chunk: ChunkId) -> HomeBox {
        self.boxes[chunk.0 as usize]
    }

    /// The chunk where a finite position is at home if it is one of the 2^`levels` chunks of the subtree with this number, counted among
    /// those of its size.
    #[inline]
    pub(crate) fn home_below(&self, levels: u32, subtree: usize, p: [f32; 3]) -> Option<ChunkId> {
        // The first leaf lies at all lower ends of the subtree's cell, the last one at all upper ends.
        let (first, last) = (subtree << levels, ((subtree + 1) << levels) - 1);
        let cell = HomeBox { lo: self.boxes[first].lo, hi: self.boxes[last].hi };
        if !cell.holds(p) {
            return None;
        }
        let mut node = (self.planes.len() >> levels) + subtree;
        for _ in 0..levels {
            let (axis, at) = self.planes[node];
            node = 2 * node + usize::from(p[usize::from(axis)] >= at);
        }
        Some(ChunkId((node - self.planes.len()) as u32))
    }

    /// Those of the 2^`levels` chunks of a subtree (as for [`Self::home_below`]) whose cells a closed box meets that meets one of
    /// them, in order.
    pub(crate) fn meeting_below(&self, levels: u32, subtree: usize, lo: [f32; 3], hi: [f32; 3], visit: &mut impl FnMut(ChunkId)) {
        self.descend((self.planes.len() >> levels) + subtree, lo, hi, visit);
    }

    /// All chunks whose cells the closed box from `lo` to `hi` meets, in order. O(log chunks) for each.
    pub(crate) fn meeting(&self, lo: [f32; 3], hi: [f32; 3], visit: &mut impl FnMut(ChunkId)) {
        self.descend(1, lo, hi, visit);
    }

    fn descend(&self, node: usize, lo: [f32; 3], hi: [f32; 3], visit: &mut impl FnMut(ChunkId)) {
        let Some((axis, at)) = self.planes.get(node) else {
            visit(ChunkId((node - self.planes.len()) as u32));
            return;
        };
        let axis = usize::from(*axis);
        if lo[axis] < *at {
            self.descend(2 * node, lo, hi, visit);
        }
        if hi[axis] >= *at {
            self.descend(2 * node + 1, lo, hi, visit);
        }
    }

    /// The chunk where a finite position is at home. O(log chunks).
    #[inline]
    pub(crate) fn home(&self, p: [f32; 3]) -> ChunkId {
        let mut node = 1usize;
        for _ in 0..self.depth {
            let (axis, at) = self.planes[node];
            node = 2 * node + usize::from(p[usize::from(axis)] >= at);
        }
        ChunkId((node - self.planes.len()) as u32)
    }

    /// The chunk in which all corners of a triangle lie, if they lie in one.
    #[inline]
    pub(crate) fn home_of_all(&self, corners: [[f32; 3]; 3]) -> Option<ChunkId> {
        let [a, b, c] = corners.map(|p| self.home(p));
        (a == b && b == c).then_some(a)
    }
}

/// The extent of one sampled triangle.
#[derive(Clone, Copy)]
struct Sample {
    lo: [f32; 3],
    hi: [f32; 3],
}

impl Sample {
    fn middle(&self, axis: usize) -> f32 {
        // Halved first: the sum of two large finite values is infinite.
        self.lo[axis] * 0.5 + self.hi[axis] * 0.5
    }
}

/// About so many finite triangles, evenly spread over the file.
fn sample((records, guide): (&[Record], &Guide<'_>), wanted: u64) -> Vec<Sample> {
    let n = records.len() as u64;
    let step = (n / wanted.max(1)).max(1);
    let numbers = guide.ahead((0..n).step_by(step as usize).map(|t| t as u32), |t| Some(*t));
    let samples = numbers.filter_map(|t| {
        let c = record::corners(&records[t as usize]);
        c.iter().flatten().all(|x| x.is_finite()).then(|| Sample {
            lo: std::array::from_fn(|k| c[0][k].min(c[1][k]).min(c[2][k])),
            hi: std::array::from_fn(|k| c[0][k].max(c[1][k]).max(c[2][k])),
        })
    });
    samples.collect()
}

/// The plane, inside `cell`, that cuts the fewest samples; slightly prefers the middle, or what lies so far from it by share. O(samples).
fn best_plane(samples: &[Sample], cell: &HomeBox, shift: f64) -> (usize, f32) {
    const QUANTILES: [f64; 5] = [0.42, 0.46, 0.5, 0.54, 0.58];
    let mut best: Option<(f64, usize, f32)> = None;
    let mut middles = vec![0f32; samples.len()];
    for axis in 0..3 {
        middles.iter_mut().zip(samples).for_each(|(m, s)| *m = s.middle(axis));
        // Each is looked for behind the one before it only.
        let (mut rest, mut passed) = (&mut middles[..], 0);
        let planes = QUANTILES.map(|q| {
            let rank = (samples.len() as f64 * (q + shift)) as usize - passed;
            if rank >= rest.len() {
                return f32::NAN;
            }
            let (_, at, _) = rest.select_nth_unstable_by(rank, f32::total_cmp);
            let at = *at;
            rest = &mut std::mem::take(&mut rest)[rank..];
            passed += rank;
            at
        });
        let (mut cut, mut below) = ([0u32; QUANTILES.len()], [0u32; QUANTILES.len()]);
        for s in samples {
            let (lo, hi, middle) = (s.lo[axis], s.hi[axis], s.middle(axis));
            for (k, at) in planes.iter().enumerate() {
                cut[k] += u32::from((lo < *at) & (hi >= *at));
                below[k] += u32::from(middle < *at);
            }
        }
        for ((at, cut), below) in planes.into_iter().zip(cut).zip(below) {
            if !(at > cell.lo[axis] && at <= cell.hi[axis]) {
                continue;
            }
            let share = |n: u32| f64::from(n) / samples.len() as f64;
            let cost = share(cut) + 0.4 * (share(below) - 0.5 - shift).abs().powf(1.5);
            if best.is_none_or(|(c, ..)| cost < c) {
                best = Some((cost, axis, at));
            }
        }
    }
    // Nothing to go by (no samples, or all in one place): the upper side stays empty.
    best.map_or((0, cell.hi[0]), |(_, axis, at)| (axis, at))
}

/// Moves what satisfies `first` to the front and returns how many that are.
pub(crate) fn partition<T>(items: &mut [T], first: impl Fn(&T) -> bool) -> usize {
    let mut n = 0;
    for i in 0..items.len() {
        if first(&items[i]) {
            items.swap(n, i);
            n += 1;
        }
    }
    n
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn soup(points: &[[f32; 9]]) -> Vec<Record> {
        points.iter().map(|p| record::encode([[p[0], p[1], p[2]], [p[3], p[4], p[5]], [p[6], p[7], p[8]]], 0)).collect()
    }

    proptest! {
        /// Home is a partition: the leaf that `home` names is the only one whose box holds the position.
        #[test]
        fn every_position_has_one_home(points in prop::collection::vec(prop::array::uniform9(-100f32..100.0), 1..200),
                                       probes in prop::collection::vec(prop::array::uniform3(-150f32..150.0), 20)) {
            let records = soup(&points);
            let plan = Plan::new(&records, &Guide::NONE, 4);
            let corners = points.iter().map(|p| [p[0], p[1], p[2]]);
            for p in probes.into_iter().chain(corners) {
                let homes: Vec<usize> = (0..plan.chunks()).filter(|c| plan.boxes[*c].holds(p)).collect();
                prop_assert_eq!(&homes, &vec![plan.home(p).0 as usize]);
                for levels in 0..=plan.depth {
                    let found: Vec<_> = (0..plan.chunks() >> levels).filter_map(|s| plan.home_below(levels, s, p)).collect();
                    prop_assert_eq!(found, vec![plan.home(p)], "through subtrees of {} levels", levels);
                }
            }
        }
    }

    proptest! {
        /// The cells that a box meets are those whose own boxes it meets.
        #[test]
        fn a_box_meets_the_cells_that_share_a_point_with_it(points in prop::collection::vec(prop::array::uniform9(-100f32..100.0), 1..200),
                                                             a in prop::array::uniform3(-150f32..150.0), b in prop::array::uniform3(-150f32..150.0)) {
            let plan = Plan::new(&soup(&points), &Guide::NONE, 4);
            let (lo, hi) = (std::array::from_fn(|k| a[k].min(b[k])), std::array::from_fn(|k| a[k].max(b[k])));
            let mut met = Vec::new();
            plan.meeting(lo, hi, &mut |c| met.push(c.0 as usize));
            let wanted: Vec<usize> = (0..plan.chunks()).filter(|c| plan.boxes[*c].meets(&Bounds { lo, hi })).collect();
            prop_assert_eq!(&met, &wanted);
            for levels in 0..=plan.depth {
                let mut subtrees: Vec<usize> = wanted.iter().map(|c| c >> levels).collect();
                subtrees.dedup();
                met.clear();
                subtrees.iter().for_each(|s| plan.meeting_below(levels, *s, lo, hi, &mut |c| met.push(c.0 as usize)));
                prop_assert_eq!(&met, &wanted, "in subtrees of {} levels", levels);
            }
        }
    }

    #[test]
    fn no_box_holds_what_is_not_finite() {
        let records = soup(&[[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]; 64]);
        let plan = Plan::new(&records, &Guide::NONE, 8);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert!(plan.boxes.iter().all(|b| !b.holds([0.0, bad, 0.0])));
        }
    }
}
