//! Sixteen triangles at a time: their corners laid out by coordinate, and their boxes compared with one.
//!
//! [`Lanes`] only compares, so that all kinds of vectors give the same answers; which kind is used is decided when the program runs.
//! With AVX-512 each comparison of sixteen is one instruction, and pairs that are found are appended without a branch.

use glam::Vec4;

/// Lanes of a node.
pub(super) const WIDTH: usize = 16;

/// A number for each lane, in one line of the cache.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(super) struct Line(pub(super) [f32; WIDTH]);

impl Line {
    #[inline(always)]
    fn quarters(&self) -> [Vec4; 4] {
        let [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p] = self.0;
        [Vec4::new(a, b, c, d), Vec4::new(e, f, g, h), Vec4::new(i, j, k, l), Vec4::new(m, n, o, p)]
    }
}

/// The smaller of two numbers.
#[inline(always)]
pub(super) fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger of two numbers.
#[inline(always)]
pub(super) fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The corners of sixteen triangles.
#[derive(Clone, Copy)]
pub(super) struct Triangles([[Line; 3]; 3]);

impl Triangles {
    pub(super) const NONE: Self = Self([[Line([0.0; WIDTH]); 3]; 3]);

    #[inline(always)]
    pub(super) fn set(&mut self, i: usize, corners: &[[f32; 3]; 3]) {
        for (lines, corner) in self.0.iter_mut().zip(corners) {
            for (line, c) in lines.iter_mut().zip(corner) {
                line.0[i] = *c;
            }
        }
    }

    /// One corner of one triangle.
    #[inline(always)]
    pub(super) fn corner(&self, corner: usize, i: usize) -> [f32; 3] {
        let [x, y, z] = &self.0[corner];
        [x.0[i], y.0[i], z.0[i]]
    }

    /// The ends of one triangle on one axis.
    #[inline(always)]
    pub(super) fn ends(&self, axis: usize, i: usize) -> (f32, f32) {
        let [a, b, c] = [self.0[0][axis].0[i], self.0[1][axis].0[i], self.0[2][axis].0[i]];
        (min(min(a, b), c), max(max(a, b), c))
    }
}

/// The ends of sixteen bodies along some directions; missing ones overlap nothing.
#[derive(Clone, Copy)]
pub(super) struct Ends<const N: usize> {
    pub(super) lo: [Line; N],
    pub(super) hi: [Line; N],
}

/// Sixteen boxes.
pub(super) type Boxes = Ends<3>;

impl<const N: usize> Ends<N> {
    pub(super) const EMPTY: Self = Self { lo: [Line([f32::INFINITY; WIDTH]); N], hi: [Line([f32::NEG_INFINITY; WIDTH]); N] };

    #[inline(always)]
    pub(super) fn set(&mut self, i: usize, lo: [f32; N], hi: [f32; N]) {
        for k in 0..N {
            self.lo[k].0[i] = lo[k];
            self.hi[k].0[i] = hi[k];
        }
    }

    #[inline(always)]
    pub(super) fn is_set(&self, i: usize) -> bool {
        self.lo[0].0[i] <= self.hi[0].0[i]
    }

    /// The ends of all lanes together.
    pub(super) fn bounds(&self) -> ([f32; N], [f32; N]) {
        let (mut lo, mut hi) = ([0.0; N], [0.0; N]);
        for k in 0..N {
            let ([a, b, c, d], [e, f, g, h]) = (self.lo[k].quarters(), self.hi[k].quarters());
            lo[k] = a.min(b).min(c.min(d)).min_element();
            hi[k] = e.max(f).max(g.max(h)).max_element();
        }
        (lo, hi)
    }
}

impl Boxes {
    /// Lowest corner of one box.
    #[inline(always)]
    pub(super) fn lo(&self, i: usize) -> [f32; 3] {
        [self.lo[0].0[i], self.lo[1].0[i], self.lo[2].0[i]]
    }

    /// Highest corner of one box.
    #[inline(always)]
    pub(super) fn hi(&self, i: usize) -> [f32; 3] {
        [self.hi[0].0[i], self.hi[1].0[i], self.hi[2].0[i]]
    }
}

/// The vertices of sixteen triangles, as floats that are equal when the vertices are.
#[derive(Clone, Copy)]
pub(super) struct Corners([Line; 3]);

impl Corners {
    pub(super) const NONE: Self = Self([Line([0.0; WIDTH]); 3]);

    /// A normal float for each vertex below 2³¹ − 2²⁴; 0 stands for none.
    #[inline(always)]
    pub(super) fn set(&mut self, i: usize, vertices: [u32; 3]) {
        for (line, v) in self.0.iter_mut().zip(vertices) {
            line.0[i] = f32::from_bits(v.wrapping_add(0x0080_0000));
        }
    }

    pub(super) fn clear(&mut self, i: usize) {
        for line in &mut self.0 {
            line.0[i] = 0.0;
        }
    }
}

/// Pairs of rows, and room for those that a row adds.
pub(super) struct Pairs {
    pairs: Box<[[u32; 2]; Self::FULL + WIDTH]>,
    len: usize,
}

impl Pairs {
    /// Pairs that are gathered before they are looked at; so few that what they name is still in the L1 cache.
    const FULL: usize = 128;

    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    /// No more may be added.
    #[inline(always)]
    pub(super) fn is_full(&self) -> bool {
        self.len >= Self::FULL
    }

    pub(super) fn as_mut_slice(&mut self) -> &mut [[u32; 2]] {
        &mut self.pairs[..self.len]
    }
}

impl Default for Pairs {
    fn default() -> Self {
        Self { pairs: Box::new([[0; 2]; Self::FULL + WIDTH]), len: 0 }
    }
}

/// How sixteen lanes are compared.
pub(super) trait Lanes: Copy {
    /// The lanes of `ends` that overlap lane `i` of `of`: along each direction each begins before the other ends.
    fn overlapping<const N: usize>(self, ends: &Ends<N>, of: &Ends<N>, i: usize) -> u32;

    /// The lanes of `corners` that have a vertex of lane `i` of `of`.
    fn sharing(self, corners: &Corners, of: &Corners, i: usize) -> u32;

    /// Appends the pair of `row` and `first` + i for each lane i of a mask; not to be called when `pairs` are full.
    fn append(self, pairs: &mut Pairs, row: u32, first: u32, lanes: u32);
}

/// Vectors of four, which every processor has.
#[derive(Clone, Copy)]
pub(super) struct Fours;

impl Lanes for Fours {
    #[inline(always)]
    fn overlapping<const N: usize>(self, ends: &Ends<N>, of: &Ends<N>, i: usize) -> u32 {
        let mut found = [!0_u32; 4];
        for k in 0..N {
            let (begins, ends) = (ends.lo[k].quarters(), ends.hi[k].quarters());
            let (lo, hi) = (Vec4::splat(of.lo[k].0[i]), Vec4::splat(of.hi[k].0[i]));
            for quarter in 0..4 {
                found[quarter] &= (begins[quarter].cmplt(hi) & ends[quarter].cmpgt(lo)).bitmask();
            }
        }
        found[0] | found[1] << 4 | found[2] << 8 | found[3] << 12
    }

    #[inline(always)]
    fn sharing(self, corners: &Corners, of: &Corners, i: usize) -> u32 {
        let mut found = [0_u32; 4];
        for mine in &of.0 {
            let mine = Vec4::splat(mine.0[i]);
            for theirs in &corners.0 {
                for (found, theirs) in found.iter_mut().zip(theirs.quarters()) {
                    *found |= mine.cmpeq(theirs).bitmask();
                }
            }
        }
        found[0] | found[1] << 4 | found[2] << 8 | found[3] << 12
    }

    #[inline(always)]
    fn append(self, pairs: &mut Pairs, row: u32, first: u32, lanes: u32) {
        for i in bits(lanes) {
            pairs.pairs[pairs.len] = [row, first + i as u32];
            pairs.len += 1;
        }
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use wide::{Eights, Sixteens};

#[cfg(target_arch = "x86_64")]
mod wide {
    use std::arch::x86_64::*;

    use super::{Corners, Ends, Fours, Lanes, Line, Pairs, WIDTH};

    /// Vectors of eight; there is one only where the processor has AVX2. To be used in functions compiled for it.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Eights(());

    impl Eights {
        pub(in super::super) fn detect() -> Option<Self> {
            (is_x86_feature_detected!("avx2") && is_x86_feature_detected!("bmi1")).then_some(Self(()))
        }

        #[inline(always)]
        fn halves(self, line: &Line) -> [__m256; 2] {
            // SAFETY: sixteen floats, and AVX, which `self` witnesses.
            unsafe { [_mm256_loadu_ps(line.0.as_ptr()), _mm256_loadu_ps(line.0.as_ptr().add(8))] }
        }
    }

    impl Lanes for Eights {
        #[inline(always)]
        fn overlapping<const N: usize>(self, ends: &Ends<N>, of: &Ends<N>, i: usize) -> u32 {
            let mut found = [0; 2];
            for (half, found) in found.iter_mut().enumerate() {
                // SAFETY: AVX is there.
                unsafe {
                    let mut all = _mm256_castsi256_ps(_mm256_set1_epi32(-1));
                    for k in 0..N {
                        let (begins, ends) = (self.halves(&ends.lo[k])[half], self.halves(&ends.hi[k])[half]);
                        let (lo, hi) = (_mm256_set1_ps(of.lo[k].0[i]), _mm256_set1_ps(of.hi[k].0[i]));
                        all = _mm256_and_ps(all, _mm256_cmp_ps::<_CMP_LT_OQ>(begins, hi));
                        all = _mm256_and_ps(all, _mm256_cmp_ps::<_CMP_GT_OQ>(ends, lo));
                    }
                    *found = _mm256_movemask_ps(all) as u32;
                }
            }
            found[0] | found[1] << 8
        }

        #[inline(always)]
        fn sharing(self, corners: &Corners, of: &Corners, i: usize) -> u32 {
            let mut found = [0; 2];
            for (half, found) in found.iter_mut().enumerate() {
                // SAFETY: AVX is there.
                unsafe {
                    let mut any = _mm256_setzero_ps();
                    for mine in &of.0 {
                        let mine = _mm256_set1_ps(mine.0[i]);
                        for theirs in &corners.0 {
                            any = _mm256_or_ps(any, _mm256_cmp_ps::<_CMP_EQ_OQ>(mine, self.halves(theirs)[half]));
                        }
                    }
                    *found = _mm256_movemask_ps(any) as u32;
                }
            }
            found[0] | found[1] << 8
        }

        #[inline(always)]
        fn append(self, pairs: &mut Pairs, row: u32, first: u32, lanes: u32) {
            Fours.append(pairs, row, first, lanes);
        }
    }

    /// Vectors of sixteen; there is one only where the processor has AVX-512. To be used in functions compiled for it.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Sixteens(());

    impl Sixteens {
        pub(in super::super) fn detect() -> Option<Self> {
            let has =
                is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512bw") && is_x86_feature_detected!("bmi1");
            (has && is_x86_feature_detected!("popcnt")).then_some(Self(()))
        }

        #[inline(always)]
        fn line(self, line: &Line) -> __m512 {
            // SAFETY: sixteen floats, and AVX-512, which `self` witnesses.
            unsafe { _mm512_loadu_ps(line.0.as_ptr()) }
        }
    }

    impl Lanes for Sixteens {
        #[inline(always)]
        fn overlapping<const N: usize>(self, ends: &Ends<N>, of: &Ends<N>, i: usize) -> u32 {
            let (mut below, mut above) = (!0, !0);
            for k in 0..N {
                // SAFETY: AVX-512 is there.
                unsafe {
                    let (lo, hi) = (_mm512_set1_ps(of.lo[k].0[i]), _mm512_set1_ps(of.hi[k].0[i]));
                    below = _mm512_mask_cmp_ps_mask::<_CMP_LT_OQ>(below, self.line(&ends.lo[k]), hi);
                    above = _mm512_mask_cmp_ps_mask::<_CMP_GT_OQ>(above, self.line(&ends.hi[k]), lo);
                }
            }
            u32::from(below & above)
        }

        #[inline(always)]
        fn sharing(self, corners: &Corners, of: &Corners, i: usize) -> u32 {
            let mut apart = !0;
            for mine in &of.0 {
                let mut from_this = !0;
                for theirs in &corners.0 {
                    // SAFETY: AVX-512 is there.
                    unsafe {
                        from_this =
                            _mm512_mask_cmp_ps_mask::<_CMP_NEQ_OQ>(from_this, self.line(theirs), _mm512_set1_ps(mine.0[i]));
                    }
                }
                apart &= from_this;
            }
            u32::from(!apart)
        }

        #[inline(always)]
        fn append(self, pairs: &mut Pairs, row: u32, first: u32, lanes: u32) {
            assert!(pairs.len <= pairs.pairs.len() - WIDTH);
            // SAFETY: AVX-512 is there. Sixteen pairs from `len` on are within the array, and no more are written.
            unsafe {
                let row = _mm512_set1_epi64(i64::from(row));
                for (half, numbers) in [(0, [0, 1, 2, 3, 4, 5, 6, 7]), (1, [8, 9, 10, 11, 12, 13, 14, 15])] {
                    let [a, b, c, d, e, f, g, h] = numbers;
                    let others = _mm512_add_epi64(_mm512_set1_epi64(i64::from(first)), _mm512_setr_epi64(a, b, c, d, e, f, g, h));
                    let both = _mm512_or_epi64(row, _mm512_slli_epi64::<32>(others));
                    let mask = (lanes >> (8 * half)) as u8;
                    let to = pairs.pairs.as_mut_ptr().add(pairs.len);
                    _mm512_storeu_epi64(to.cast(), _mm512_maskz_compress_epi64(mask, both));
                    pairs.len += mask.count_ones() as usize;
                }
            }
        }
    }
}

/// The numbers of the bits that are set, ascending.
#[inline(always)]
pub(crate) fn bits(mask: impl Into<u64>) -> impl Iterator<Item = usize> {
    let mut mask = mask.into();
    std::iter::from_fn(move || {
        let bit = (mask != 0).then(|| mask.trailing_zeros() as usize);
        mask &= mask.wrapping_sub(1);
        bit
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn check(lanes: impl Lanes, boxes: &Boxes, corners: &Corners) -> Vec<(u32, u32, Vec<[u32; 2]>)> {
        (0..WIDTH)
            .map(|i| {
                let mut pairs = Pairs::default();
                let (found, sharing) = (lanes.overlapping(boxes, boxes, i), lanes.sharing(corners, corners, i));
                lanes.append(&mut pairs, i as u32, 48, found);
                lanes.append(&mut pairs, 7, 16, sharing);
                (found, sharing, pairs.as_mut_slice().to_vec())
            })
            .collect()
    }

    proptest! {
        /// On small integers, where ends often coincide and vertices are often shared.
        #[test]
        fn all_kinds_of_vectors_say_what_the_definition_says(
            ends in prop::collection::vec(prop::array::uniform6(0..5_u8), WIDTH),
            vertices in prop::collection::vec(prop::array::uniform3(0..30_u32), WIDTH),
        ) {
            let (mut boxes, mut corners) = (Boxes::EMPTY, Corners::NONE);
            // The last lane stays empty.
            for i in 0..WIDTH - 1 {
                let end = |k: usize| (f32::from(ends[i][k]), f32::from(ends[i][k + 3]));
                boxes.set(i, [0, 1, 2].map(|k| end(k).0.min(end(k).1)), [0, 1, 2].map(|k| end(k).0.max(end(k).1)));
                corners.set(i, vertices[i]);
            }
            let fours = check(Fours, &boxes, &corners);
            for (i, (found, sharing, pairs)) in fours.iter().enumerate().take(WIDTH - 1) {
                for j in 0..WIDTH - 1 {
                    let overlap = (0..3).all(|k| boxes.lo(i)[k] < boxes.hi(j)[k] && boxes.lo(j)[k] < boxes.hi(i)[k]);
                    prop_assert_eq!(found >> j & 1 == 1, overlap);
                    prop_assert_eq!(sharing >> j & 1 == 1, vertices[i].iter().any(|v| vertices[j].contains(v)));
                }
                let expected = bits(*found).map(|j| [i as u32, 48 + j as u32]).chain(bits(*sharing).map(|j| [7, 16 + j as u32]));
                prop_assert_eq!(pairs, &expected.collect::<Vec<_>>());
            }
            prop_assert!(fours.iter().all(|(found, ..)| found >> (WIDTH - 1) == 0));
            #[cfg(target_arch = "x86_64")]
            {
                if let Some(lanes) = Eights::detect() {
                    prop_assert_eq!(&check(lanes, &boxes, &corners), &fours);
                }
                if let Some(lanes) = Sixteens::detect() {
                    prop_assert_eq!(&check(lanes, &boxes, &corners), &fours);
                }
            }
        }
    }
}
