//! Sixteen pairs of triangles at once: what rounded arithmetic can tell of them for sure.
//!
//! The loops are written for one pair, without branches; compiled for a processor with wide vectors they take four, eight or sixteen
//! pairs in a step ([`Block`] lays them out for that). Nothing is fused, so they say the same everywhere.
//!
//! Two convex bodies are apart when, along some direction, one ends before the other begins. Directions are guessed and
//! the gap is computed in f32; any direction will do, so the guess need not be exact, only the gap must exceed its error.
//! Coordinates are taken from the first corner of the first triangle, with a relative error of ε = 2⁻²⁴ each; a product of three
//! terms with the direction w is then off by less than 4ε|w|₁ times the largest coordinate, and the gap by less than 9ε of that. 16ε
//! are asked for. Where something may have underflowed, the bound is no normal number, where something may have overflowed, it is
//! large; neither passes.

use glam::Vec3;

use super::lanes::{Triangles, WIDTH, max, min};
use super::view::CellView;
use crate::geometry::tri_tri::{Sure, sure, sure_of_neighbours};

/// 16ε.
const ERROR: f32 = 1.0 / (1 << 20) as f32;

/// A bound below this comes from sums of products below 2¹²⁷.
const LARGEST: f32 = (1_u128 << 107) as f32;

/// Pairs of triangles of one kind.
pub(super) trait Sort: Sized {
    /// As [`sort`], with whatever vectors the caller is compiled for; to be inlined there.
    fn sort(view: &CellView<'_>, pairs: &mut [Self]) -> [usize; 2];
}

/// Sorts pairs: to the front those that cross, then those of which nothing is sure; the rest are apart. Returns how many there are of the
/// first kind and of the second.
pub(super) fn sort<P: Sort>(view: &CellView<'_>, pairs: &mut [P]) -> [usize; 2] {
    #[cfg(target_arch = "x86_64")]
    {
        if has_avx512() {
            // SAFETY: the processor has what it is compiled for.
            return unsafe { sort_avx512(view, pairs) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: as above.
            return unsafe { sort_avx2(view, pairs) };
        }
    }
    P::sort(view, pairs)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512bw")]
fn sort_avx512<P: Sort>(view: &CellView<'_>, pairs: &mut [P]) -> [usize; 2] {
    P::sort(view, pairs)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn sort_avx2<P: Sort>(view: &CellView<'_>, pairs: &mut [P]) -> [usize; 2] {
    P::sort(view, pairs)
}

/// Without a common vertex.
impl Sort for [u32; 2] {
    #[inline(always)]
    fn sort(view: &CellView<'_>, pairs: &mut [Self]) -> [usize; 2] {
        let mut block = Block::EMPTY;
        let mut left = 0;
        for start in (0..pairs.len()).step_by(WIDTH) {
            let count = block.fill(view, &pairs[start..]);
            for (i, apart) in block.apart_by_planes().into_iter().enumerate().take(count) {
                pairs[left] = pairs[start + i];
                left += usize::from(!apart);
            }
        }
        let end = std::mem::take(&mut left);
        for start in (0..end).step_by(WIDTH) {
            let count = block.fill(view, &pairs[start..end]);
            for (i, apart) in block.apart_by_edges().into_iter().enumerate().take(count) {
                pairs[left] = pairs[start + i];
                left += usize::from(!apart);
            }
        }
        let end = std::mem::take(&mut left);
        let mut crossing = 0;
        for start in (0..end).step_by(WIDTH) {
            let count = block.fill(view, &pairs[start..end]);
            for (i, sure) in block.sure().into_iter().enumerate().take(count) {
                pairs[left] = pairs[start + i];
                if sure == Sure::Cross {
                    pairs.swap(left, crossing);
                    crossing += 1;
                }
                left += usize::from(sure != Sure::Apart);
            }
        }
        [crossing, left - crossing]
    }
}

/// A pair of triangles with one or two common vertices.
#[derive(Clone, Copy)]
pub(super) struct Neighbours {
    pub(super) triangles: [u32; 2],
    /// Of the first triangle its vertices, a common one first, of the second that common one and the others that are not common: with
    /// two common ones, the same twice.
    pub(super) vertices: [[u32; 3]; 2],
}

impl Sort for Neighbours {
    #[inline(always)]
    fn sort(view: &CellView<'_>, pairs: &mut [Self]) -> [usize; 2] {
        let mut block = Block::EMPTY;
        let (mut left, mut crossing) = (0, 0);
        for start in (0..pairs.len()).step_by(WIDTH) {
            let count = (pairs.len() - start).min(WIDTH);
            for (i, pair) in pairs[start..start + count].iter().enumerate() {
                block.set(i, pair.vertices.map(|t| view.corners(t)));
            }
            for (i, sure) in block.sure_of_neighbours().into_iter().enumerate().take(count) {
                pairs[left] = pairs[start + i];
                if sure == Sure::Cross {
                    pairs.swap(left, crossing);
                    crossing += 1;
                }
                left += usize::from(sure != Sure::Apart);
            }
        }
        [crossing, left - crossing]
    }
}

/// Leaves out of some triangles those that are clearly apart from one; the others keep their order.
pub(crate) fn leave_out_apart(one: &[[f32; 3]; 3], others: &mut Vec<u32>, corners: impl Fn(u32) -> [[f32; 3]; 3]) {
    // Fewer are decided sooner one by one.
    const WORTHWHILE: usize = 4;
    if others.len() < WORTHWHILE {
        return;
    }
    #[cfg(target_arch = "x86_64")]
    {
        if has_avx512() {
            // SAFETY: the processor has what it is compiled for.
            return unsafe { leave_out_apart_avx512(one, others, corners) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: as above.
            return unsafe { leave_out_apart_avx2(one, others, corners) };
        }
    }
    leave_out(one, others, corners);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512bw")]
fn leave_out_apart_avx512(one: &[[f32; 3]; 3], others: &mut Vec<u32>, corners: impl Fn(u32) -> [[f32; 3]; 3]) {
    leave_out(one, others, corners);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn leave_out_apart_avx2(one: &[[f32; 3]; 3], others: &mut Vec<u32>, corners: impl Fn(u32) -> [[f32; 3]; 3]) {
    leave_out(one, others, corners);
}

#[inline(always)]
fn leave_out(one: &[[f32; 3]; 3], others: &mut Vec<u32>, corners: impl Fn(u32) -> [[f32; 3]; 3]) {
    let mut block = Block::EMPTY;
    (0..WIDTH).for_each(|i| block.a.set(i, one));
    for by_edges in [false, true] {
        let mut left = 0;
        for start in (0..others.len()).step_by(WIDTH) {
            let count = (others.len() - start).min(WIDTH);
            for (i, other) in others[start..start + count].iter().enumerate() {
                block.b.set(i, &corners(*other));
            }
            let apart = if by_edges { block.apart_by_edges() } else { block.apart_by_planes() };
            for (i, apart) in apart.into_iter().enumerate().take(count) {
                others[left] = others[start + i];
                left += usize::from(!apart);
            }
        }
        others.truncate(left);
    }
}

#[cfg(target_arch = "x86_64")]
fn has_avx512() -> bool {
    is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") && is_x86_feature_detected!("avx512bw")
}

/// Sixteen pairs; those after the last one are of any kind.
struct Block {
    a: Triangles,
    b: Triangles,
}

/// A pair of triangles, from the first corner of the first, which is left out.
struct Pair {
    a: [Vec3; 2],
    b: [Vec3; 3],
    /// Largest coordinate times 16ε.
    error: f32,
}

impl Pair {
    #[inline(always)]
    fn new(block: &Block, i: usize) -> Self {
        let a = |k: usize| Vec3::from_array(block.a.corner(k, i));
        let b = |k: usize| Vec3::from_array(block.b.corner(k, i));
        let origin = a(0);
        let (a, b) = ([a(1) - origin, a(2) - origin], [b(0) - origin, b(1) - origin, b(2) - origin]);
        let largest = max(max(max(far(a[0]), far(a[1])), max(far(b[0]), far(b[1]))), far(b[2]));
        Self { a, b, error: largest * ERROR }
    }

    /// Does this direction separate them?
    #[inline(always)]
    fn separated(&self, w: Vec3) -> bool {
        let (p, q) = (self.a[0].dot(w), self.a[1].dot(w));
        let (r, s, t) = (self.b[0].dot(w), self.b[1].dot(w), self.b[2].dot(w));
        let (a_low, a_high) = (min(min(p, q), 0.0), max(max(p, q), 0.0));
        let (b_low, b_high) = (min(min(r, s), t), max(max(r, s), t));
        let gap = max(b_low - a_high, a_low - b_high);
        let bound = (w.x.abs() + w.y.abs() + w.z.abs()) * self.error;
        (gap > bound) & (bound < LARGEST) & (bound > f32::MIN_POSITIVE)
    }
}

/// Largest coordinate.
#[inline(always)]
fn far(p: Vec3) -> f32 {
    max(max(p.x.abs(), p.y.abs()), p.z.abs())
}

impl Block {
    const EMPTY: Self = Self { a: Triangles::NONE, b: Triangles::NONE };

    #[inline(always)]
    fn set(&mut self, i: usize, [a, b]: [[[f32; 3]; 3]; 2]) {
        self.a.set(i, &a);
        self.b.set(i, &b);
    }

    /// Takes up to sixteen of `pairs` and returns how many.
    #[inline(always)]
    fn fill(&mut self, view: &CellView<'_>, pairs: &[[u32; 2]]) -> usize {
        let count = pairs.len().min(WIDTH);
        for (i, pair) in pairs[..count].iter().enumerate() {
            self.set(i, pair.map(|t| view.corners(view.triangles[t as usize])));
        }
        count
    }

    /// Which are apart along the direction from one middle to the other or upright on either triangle: enough for nearly all
    /// pairs of a surface that bends.
    #[inline(always)]
    fn apart_by_planes(&self) -> [bool; WIDTH] {
        let mut apart = [false; WIDTH];
        for (i, apart) in apart.iter_mut().enumerate() {
            let pair = Pair::new(self, i);
            let ([u, v], [r, s, t]) = (pair.a, pair.b);
            let (m, n) = (u.cross(v), (s - r).cross(t - r));
            *apart = pair.separated(r + s + t - u - v) | pair.separated(m) | pair.separated(n);
        }
        apart
    }

    /// Which are apart along a direction that is in the plane of either triangle and upright on one of its edges: for triangles that
    /// lie nearly in one plane.
    #[inline(always)]
    fn apart_by_edges(&self) -> [bool; WIDTH] {
        let mut apart = [false; WIDTH];
        for (i, apart) in apart.iter_mut().enumerate() {
            let pair = Pair::new(self, i);
            let ([u, v], [r, s, t]) = (pair.a, pair.b);
            let (e, f) = (s - r, t - r);
            let (m, n) = (u.cross(v), e.cross(f));
            *apart = pair.separated(u.cross(m))
                | pair.separated(v.cross(m))
                | pair.separated((v - u).cross(m))
                | pair.separated(e.cross(n))
                | pair.separated(f.cross(n))
                | pair.separated((f - e).cross(n));
        }
        apart
    }

    /// How they meet, where that is sure without exact arithmetic.
    #[inline(always)]
    fn sure(&self) -> [Sure; WIDTH] {
        let mut all = [Sure::No; WIDTH];
        for (i, sure_of_this) in all.iter_mut().enumerate() {
            let [a, b] = [&self.a, &self.b].map(|t| [t.corner(0, i), t.corner(1, i), t.corner(2, i)]);
            *sure_of_this = sure(&a, &b);
        }
        all
    }

    /// The same for triangles whose first corner is a common one.
    #[inline(always)]
    fn sure_of_neighbours(&self) -> [Sure; WIDTH] {
        let mut all = [Sure::No; WIDTH];
        for (i, sure_of_this) in all.iter_mut().enumerate() {
            let [a, b] = [&self.a, &self.b].map(|t| [t.corner(0, i), t.corner(1, i), t.corner(2, i)]);
            *sure_of_this = sure_of_neighbours(&a, &b);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::tri_tri::{Contact, triangles_cross};
    use crate::stream::plan::HomeBox;
    use crate::topology::intersect::Standing;

    proptest! {
        /// On small integers, where much touches: what is dropped is apart, what is brought to the front crosses, and each kind of
        /// vectors says the same.
        #[test]
        fn pairs_are_sorted_into_what_they_are(
            triangles in prop::collection::vec(prop::array::uniform3(prop::array::uniform3(-6..6_i8)), 2..60),
        ) {
            let positions: Vec<[f32; 3]> = triangles.iter().flatten().map(|p| p.map(f32::from)).collect();
            let numbers: Vec<[u32; 3]> = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            let standing = vec![Standing::Away; positions.len()];
            let view =
                CellView { positions: &positions, triangles: &numbers, left_out: &[], standing: &standing, cell: HomeBox::ALL };
            let contact = |[i, j]: [u32; 2]| {
                let [a, b] = [i, j].map(|t| view.corners(numbers[t as usize]));
                triangles_cross(&a, &b)
            };
            let all: Vec<[u32; 2]> = (1..numbers.len() as u32).flat_map(|j| (0..j).map(move |i| [i, j])).take(140).collect();
            let mut pairs = all.clone();
            let [crossing, unsure] = sort(&view, &mut pairs);
            pairs.truncate(crossing + unsure);
            for (k, pair) in pairs.iter().enumerate() {
                prop_assert!(k >= crossing || contact(*pair) == Contact::Cross);
            }
            for pair in all.iter().filter(|pair| !pairs.contains(pair)) {
                prop_assert!(!contact(*pair).is_crossing());
            }
            for i in 0..numbers.len() as u32 {
                let one = view.corners(numbers[i as usize]);
                let all: Vec<u32> = (0..numbers.len() as u32).filter(|j| *j != i).collect();
                let mut left = all.clone();
                leave_out_apart(&one, &mut left, |j| view.corners(numbers[j as usize]));
                prop_assert!(left.is_sorted());
                for j in all.into_iter().filter(|j| left.binary_search(j).is_err()) {
                    prop_assert_eq!(contact([i, j]), Contact::Apart);
                }
            }
            let mut narrow = all.clone();
            prop_assert_eq!(<[u32; 2]>::sort(&view, &mut narrow), [crossing, unsure]);
            prop_assert_eq!(&narrow[..crossing + unsure], &pairs[..]);
            #[cfg(target_arch = "x86_64")]
            if is_x86_feature_detected!("avx2") {
                let mut wider = all.clone();
                // SAFETY: the processor has what it is compiled for.
                prop_assert_eq!(unsafe { sort_avx2(&view, &mut wider) }, [crossing, unsure]);
                prop_assert_eq!(&wider[..crossing + unsure], &pairs[..]);
            }
        }
    }
}
