//! The edges of a loop and the triangles beyond, laid out so that many are held against a triangle at a time.

use super::boxes::{Box3, around, join};
use super::rim::Rim;
use crate::geometry::exact::{Plane, Point};

/// Edges that are looked at together.
const WIDTH: usize = 16;

/// A coordinate of each.
type Lanes = [f32; WIDTH];

/// Some edges of a rim, one after the other, and the mesh's triangles beyond.
struct Block {
    /// The box of an edge with the triangle beyond it; of nothing beyond the last one.
    lo: [Lanes; 3],
    hi: [Lanes; 3],
    /// Where the edges begin, and where the last of them ends.
    from: [Lanes; 3],
    end: Point,
    /// The third corners of the triangles beyond, and a bit for each that there is.
    apexes: [Lanes; 3],
    has_apex: u32,
}

/// The edges of a rim with the mesh's triangles beyond.
pub(super) struct Beside {
    blocks: Vec<Block>,
    /// Sets of edges, 16 to a word: those that may pierce what is asked for, and those whose triangles may meet it.
    found: [Vec<u32>; 2],
}

/// The numbers in a set of [`Beside::near`].
pub(super) fn each_bit(set: &[u32]) -> impl Iterator<Item = usize> {
    let of_word = |(first, word): (usize, &u32)| {
        let mut left = *word;
        std::iter::from_fn(move || {
            let bit = (left != 0).then(|| left.trailing_zeros() as usize)?;
            left &= left - 1;
            Some(first + bit)
        })
    };
    (0..).step_by(WIDTH).zip(set).flat_map(of_word)
}

impl Beside {
    pub(super) fn of(rim: &Rim<'_>) -> Self {
        let n = rim.len();
        let blocks: Vec<Block> = (0..n).step_by(WIDTH).map(|first| Block::of(rim, first..n.min(first + WIDTH))).collect();
        let found = [vec![0; blocks.len()], vec![0; blocks.len()]];
        Self { blocks, found }
    }

    /// The edges that may pierce a triangle, and those whose triangles may meet it: all whose boxes meet its box and that are not clearly on one side of
    /// its plane.
    pub(super) fn near(&mut self, bounds: &Box3, plane: &Plane<'_>) -> [&[u32]; 2] {
        let Self { blocks, found } = self;
        sift(blocks, bounds, plane, found);
        found.each_ref().map(Vec::as_slice)
    }
}

impl Block {
    fn of(rim: &Rim<'_>, edges: std::ops::Range<usize>) -> Self {
        let next = |i: usize| (i + 1) % rim.len();
        let end = rim.points[next(edges.end - 1)];
        // The last edge ends where what is beyond it begins, which is nowhere near.
        let mut block = Self {
            lo: [[f32::INFINITY; WIDTH]; 3],
            hi: [[f32::NEG_INFINITY; WIDTH]; 3],
            from: end.map(|x| [x; WIDTH]),
            end,
            apexes: [[0.0; WIDTH]; 3],
            has_apex: 0,
        };
        for (lane, i) in edges.enumerate() {
            let edge = around(&[rim.points[i], rim.points[next(i)]]);
            let beyond = rim.neighbour(i);
            let (lo, hi) = beyond.map_or(edge, |t| join(&edge, &around(&t)));
            let apex = beyond.map_or(rim.points[i], |t| t[2]);
            block.has_apex |= u32::from(beyond.is_some()) << lane;
            for k in 0..3 {
                (block.lo[k][lane], block.hi[k][lane]) = (lo[k], hi[k]);
                (block.from[k][lane], block.apexes[k][lane]) = (rim.points[i][k], apex[k]);
            }
        }
        block
    }

    /// Those whose boxes meet this box, a bit each.
    #[inline(always)]
    fn meeting(&self, (lo, hi): &Box3) -> u32 {
        let mut meeting = 0;
        for l in 0..WIDTH {
            let along = |k: usize| (self.lo[k][l] <= hi[k]) & (lo[k] <= self.hi[k][l]);
            meeting |= u32::from(along(0) & along(1) & along(2)) << l;
        }
        meeting
    }
}

/// The points that are clearly above a plane, and clearly below it, a bit each.
#[inline(always)]
fn sides(plane: &Plane<'_>, points: &[Lanes; 3]) -> [u32; 2] {
    let point = |l: usize| [points[0][l], points[1][l], points[2][l]];
    let (mut above, mut below) = (0, 0);
    for l in 0..WIDTH {
        let (value, error) = plane.rounded(&point(l));
        above |= u32::from(value > error) << l;
        below |= u32::from(value < -error) << l;
    }
    [above, below]
}

fn sift(blocks: &[Block], bounds: &Box3, plane: &Plane<'_>, found: &mut [Vec<u32>; 2]) {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") && is_x86_feature_detected!("avx512dq") {
            // SAFETY: the processor has what it is compiled for.
            return unsafe { sift_avx512(blocks, bounds, plane, found) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: as above.
            return unsafe { sift_avx2(blocks, bounds, plane, found) };
        }
    }
    sift_all(blocks, bounds, plane, found);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq")]
fn sift_avx512(blocks: &[Block], bounds: &Box3, plane: &Plane<'_>, found: &mut [Vec<u32>; 2]) {
    sift_all(blocks, bounds, plane, found);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn sift_avx2(blocks: &[Block], bounds: &Box3, plane: &Plane<'_>, found: &mut [Vec<u32>; 2]) {
    sift_all(blocks, bounds, plane, found);
}

#[inline(always)]
fn sift_all(blocks: &[Block], bounds: &Box3, plane: &Plane<'_>, [may_pierce, may_meet]: &mut [Vec<u32>; 2]) {
    for ((block, may_pierce), may_meet) in blocks.iter().zip(may_pierce).zip(may_meet) {
        let near = block.meeting(bounds);
        (*may_pierce, *may_meet) = (0, 0);
        if near == 0 {
            continue;
        }
        let ends = sides(plane, &block.from);
        let (value, error) = plane.rounded(&block.end);
        let last = [value > error, value < -error].map(|is| u32::from(is) << (WIDTH - 1));
        let apexes = sides(plane, &block.apexes);
        // Edges with both ends on one side, and those of them whose triangles' third corners are there, too.
        let edges = [0, 1].map(|side| ends[side] & (ends[side] >> 1 | last[side]));
        let triangles = [0, 1].map(|side| edges[side] & apexes[side]);
        *may_pierce = near & !(edges[0] | edges[1]);
        *may_meet = near & block.has_apex & !(triangles[0] | triangles[1]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::tri_tri::Triangle;
    use proptest::prelude::*;

    proptest! {
        /// Loops of one block and of several, full and not.
        #[test]
        fn what_is_near_is_found_whatever_block_it_is_in(
            points in prop::collection::vec(prop::array::uniform3(-9i8..9), 3..50),
            apexes in prop::collection::vec(prop::option::of(prop::array::uniform3(-9i8..9)), 50),
            asked in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 1..20),
        ) {
            let points: Vec<Point> = points.iter().map(|p| p.map(f32::from)).collect();
            let apexes: Vec<Option<Point>> = apexes[..points.len()].iter().map(|p| p.map(|p| p.map(f32::from))).collect();
            let rim = Rim { points: &points, apexes: &apexes, obstacles: &[], forbidden: &|_, _| false };
            let mut beside = Beside::of(&rim);
            for corners in asked {
                let corners: Triangle = corners.map(|i| points[i.index(points.len())]);
                let plane = Plane::new(&corners[0], &corners[1], &corners[2]);
                let (lo, hi) = around(&corners);
                let is_near = |t: &[Point]| {
                    let (from, to) = around(t);
                    (0..3).all(|k| lo[k] <= to[k] && from[k] <= hi[k])
                };
                let (mut may_pierce, mut may_meet) = (Vec::new(), Vec::new());
                for i in 0..points.len() {
                    let edge = [points[i], points[(i + 1) % points.len()]];
                    let beyond = rim.neighbour(i);
                    let near = beyond.map_or(is_near(&edge), |t| is_near(&t));
                    may_pierce.extend((near && !plane.has_on_one_side(&edge)).then_some(i));
                    may_meet.extend((near && beyond.is_some_and(|t| !plane.has_on_one_side(&t))).then_some(i));
                }
                let found = beside.near(&(lo, hi), &plane).map(|set| each_bit(set).collect::<Vec<_>>());
                prop_assert_eq!(&found, &[may_pierce.clone(), may_meet.clone()]);
                // As any processor tells it.
                let mut sets = [vec![0; beside.blocks.len()], vec![0; beside.blocks.len()]];
                sift_all(&beside.blocks, &(lo, hi), &plane, &mut sets);
                prop_assert_eq!(sets.map(|set| each_bit(&set).collect::<Vec<_>>()), [may_pierce, may_meet]);
            }
        }
    }
}
