//! Sums that do not depend on the order of their terms: bounding boxes, and exact accumulators of area and volume.

use crate::geometry::position::canonical;
use crate::io::record::Point;
use crate::util::each::Each;

/// Axis-parallel box of finite positions; −0.0 and 0.0 are one value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) lo: [f32; 3],
    pub(crate) hi: [f32; 3],
}

impl Default for Bounds {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Bounds {
    pub(crate) const EMPTY: Self = Self { lo: [f32::INFINITY; 3], hi: [f32::NEG_INFINITY; 3] };

    /// Around some points.
    #[inline(always)]
    pub(crate) fn of(points: &[[f32; 3]]) -> Self {
        let mut bounds = Self::EMPTY;
        bounds.include(points);
        bounds
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.lo[0] > self.hi[0]
    }

    #[inline]
    pub(crate) fn include(&mut self, points: &[[f32; 3]]) {
        for p in points {
            for ((lo, hi), x) in self.lo.iter_mut().zip(&mut self.hi).zip(p) {
                *lo = if x < lo { *x } else { *lo };
                *hi = if x > hi { *x } else { *hi };
            }
        }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        if !other.is_empty() {
            self.include(&[other.lo, other.hi]);
        }
    }

    pub(crate) fn contains(&self, other: &Self) -> bool {
        (0..3).all(|k| self.lo[k] <= other.lo[k] && self.hi[k] >= other.hi[k])
    }

    /// The box that two boxes have in common; `None` if they do not meet.
    pub(crate) fn overlap(&self, other: &Self) -> Option<Self> {
        let lo: [f32; 3] = std::array::from_fn(|k| self.lo[k].max(other.lo[k]));
        let hi: [f32; 3] = std::array::from_fn(|k| self.hi[k].min(other.hi[k]));
        (0..3).all(|k| lo[k] <= hi[k]).then_some(Self { lo, hi })
    }

    /// Length of the diagonal; 0 of an empty box.
    pub(crate) fn diagonal(&self) -> f64 {
        if self.is_empty() {
            return 0.0;
        }
        (0..3).map(|k| (f64::from(self.hi[k]) - f64::from(self.lo[k])).powi(2)).sum::<f64>().sqrt()
    }

    /// The largest coordinate by size; 0 of an empty box.
    pub(crate) fn largest_coordinate(&self) -> f32 {
        if self.is_empty() { 0.0 } else { (0..3).map(|k| self.lo[k].abs().max(self.hi[k].abs())).fold(0.0, f32::max) }
    }

    /// −0.0 becomes 0.0, so that the box does not tell which of the two came last.
    pub(crate) fn normalised(self) -> Self {
        Self { lo: canonical(self.lo), hi: canonical(self.hi) }
    }
}

/// What single precision can tell apart at a coordinate of this size. Always finite: beyond the largest number there is no next one, so the
/// step below it is taken.
pub(crate) fn step_at(coordinate: f32) -> f64 {
    let size = coordinate.abs().min(f32::MAX.next_down());
    f64::from(size.next_up()) - f64::from(size)
}

/// How area and volume are turned into integers: terms are taken relative to the middle of the model, in units of 2⁻⁸⁸ of the
/// cube of its size, so that 2³² of them cannot overflow 128 bits. The sums are exact, so their order does not matter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measure {
    middle: [f64; 3],
    /// To units of 2⁻⁴⁰; [`whole`] takes 48 more bits.
    to_area: f64,
    to_volume: f64,
}

/// Area and volume in units of a [`Measure`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Extent {
    /// Twice the area.
    pub(crate) area: i128,
    /// Six times the signed volume of the cone to the middle.
    pub(crate) volume: i128,
}

impl std::ops::SubAssign for Extent {
    fn sub_assign(&mut self, other: Self) {
        self.area -= other.area;
        self.volume -= other.volume;
    }
}

impl std::ops::AddAssign for Extent {
    fn add_assign(&mut self, other: Self) {
        self.area += other.area;
        self.volume += other.volume;
    }
}

impl Measure {
    pub(crate) fn new(bounds: &Bounds) -> Self {
        let middle = if bounds.is_empty() {
            [0.0; 3]
        } else {
            std::array::from_fn(|k| (f64::from(bounds.lo[k]) + f64::from(bounds.hi[k])) / 2.0)
        };
        // A power of two above the diagonal, so that scaling rounds nothing.
        let size = bounds.diagonal().max(f64::from(f32::MIN_POSITIVE));
        let exponent = (size.to_bits() >> 52) as i32 - 1022;
        Self { middle, to_area: power_of_two(40 - 2 * exponent), to_volume: power_of_two(40 - 3 * exponent) }
    }

    /// How much the volume of a surface changes when it is taken from the middle of `other` instead, by the surface's vector area.
    pub(crate) fn volume_seen_from(&self, other: &Self, vector_area: [f64; 3]) -> f64 {
        (0..3).map(|k| (self.middle[k] - other.middle[k]) * vector_area[k] / 3.0).sum()
    }

    /// Where volumes are measured from.
    pub(crate) fn middle(&self) -> glam::DVec3 {
        glam::DVec3::from_array(self.middle)
    }

    /// One triangle's terms.
    #[inline]
    pub(crate) fn triangle(&self, corners: &[[f32; 3]; 3]) -> Extent {
        let [a, b, c] = corners.each(|p| p.each(f64::from));
        let (area, volume) = self.terms(a, b, c);
        Extent { area: whole(area), volume: whole(volume) }
    }

    /// The sum of [`Measure::triangle`] over some triangles.
    #[inline]
    pub(crate) fn sum(&self, triangles: &[[Point; 3]]) -> Extent {
        let mut sum = Extent::default();
        for part in triangles.chunks(MOST_AT_ONCE) {
            #[cfg(target_arch = "x86_64")]
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has AVX2.
                sum += unsafe { self.sum_avx2(part) };
                continue;
            }
            part.iter().for_each(|corners| sum += self.triangle(corners));
        }
        sum
    }

    /// The same by lanes of four: whole and fractional parts are integers below 2⁴¹ and 2⁴⁸, so that f64 adds a lane of
    /// [`MOST_AT_ONCE`] exactly.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn sum_avx2(&self, triangles: &[[Point; 3]]) -> Extent {
        use std::arch::x86_64::_mm256_setzero_pd;
        let (groups, rest) = triangles.as_chunks::<LANES>();
        let mut sums = [_mm256_setzero_pd(); 4];
        for group in groups {
            self.add_lanes(group, &mut sums);
        }
        if !rest.is_empty() {
            let mut group = [[[0.0; 3]; 3]; LANES];
            group[..rest.len()].copy_from_slice(rest);
            self.add_lanes(&group, &mut sums);
        }
        let mut totals = [0i128; 4];
        for (total, lanes) in totals.iter_mut().zip(sums) {
            let mut of_lanes = [0f64; LANES];
            // SAFETY: there is room for four.
            unsafe { std::arch::x86_64::_mm256_storeu_pd(of_lanes.as_mut_ptr(), lanes) };
            *total = i128::from(of_lanes.iter().map(|x| *x as i64).sum::<i64>());
        }
        let [area, area_low, volume, volume_low] = totals;
        Extent { area: (area << 48) + area_low, volume: (volume << 48) + volume_low }
    }

    /// Adds the whole and the fractional parts of areas, then of volumes: [`Measure::terms`] and [`whole`], operation by operation.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    #[inline]
    fn add_lanes(&self, group: &[[Point; 3]; LANES], sums: &mut [std::arch::x86_64::__m256d; 4]) {
        use std::arch::x86_64::{
            __m256d, _MM_FROUND_NO_EXC, _MM_FROUND_TO_ZERO, _MM_TRANSPOSE4_PS, _mm_loadu_ps, _mm_set_ps, _mm256_add_pd,
            _mm256_cvtps_pd, _mm256_mul_pd, _mm256_round_pd, _mm256_set1_pd, _mm256_sqrt_pd, _mm256_sub_pd,
        };
        let add = |a, b| _mm256_add_pd(a, b);
        let sub = |a, b| _mm256_sub_pd(a, b);
        let mul = |a, b| _mm256_mul_pd(a, b);
        let trunc = |a| _mm256_round_pd::<{ _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC }>(a);
        let row = |l: usize, from: usize| {
            let four = &group[l].as_flattened()[from..from + 4];
            // SAFETY: it reads these four floats.
            unsafe { _mm_loadu_ps(four.as_ptr()) }
        };
        // Four and four of the nine coordinates of each triangle side by side, and the last one.
        let (mut ax, mut ay, mut az, mut bx) = (row(0, 0), row(1, 0), row(2, 0), row(3, 0));
        _MM_TRANSPOSE4_PS(&mut ax, &mut ay, &mut az, &mut bx);
        let (mut by, mut bz, mut cx, mut cy) = (row(0, 4), row(1, 4), row(2, 4), row(3, 4));
        _MM_TRANSPOSE4_PS(&mut by, &mut bz, &mut cx, &mut cy);
        let cz = _mm_set_ps(group[3][2][2], group[2][2][2], group[1][2][2], group[0][2][2]);
        let wide = |x| _mm256_cvtps_pd(x);
        let (ax, ay, az) = (wide(ax), wide(ay), wide(az));
        let (ux, uy, uz) = (sub(wide(bx), ax), sub(wide(by), ay), sub(wide(bz), az));
        let (vx, vy, vz) = (sub(wide(cx), ax), sub(wide(cy), ay), sub(wide(cz), az));
        let nx = sub(mul(uy, vz), mul(uz, vy));
        let ny = sub(mul(uz, vx), mul(ux, vz));
        let nz = sub(mul(ux, vy), mul(uy, vx));
        let area = _mm256_sqrt_pd(add(add(mul(nx, nx), mul(ny, ny)), mul(nz, nz)));
        let from = |x: __m256d, k: usize| sub(x, _mm256_set1_pd(self.middle[k]));
        let volume = add(add(mul(from(ax, 0), nx), mul(from(ay, 1), ny)), mul(from(az, 2), nz));
        let area = mul(area, _mm256_set1_pd(self.to_area));
        let volume = mul(volume, _mm256_set1_pd(self.to_volume));
        let (area_whole, volume_whole) = (trunc(area), trunc(volume));
        let fraction = _mm256_set1_pd(FRACTION);
        sums[0] = add(sums[0], area_whole);
        sums[1] = add(sums[1], trunc(mul(sub(area, area_whole), fraction)));
        sums[2] = add(sums[2], volume_whole);
        sums[3] = add(sums[3], trunc(mul(sub(volume, volume_whole), fraction)));
    }

    /// Twice the area, and six times the volume, in units of 1.
    #[inline(always)]
    fn terms(&self, a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> (f64, f64) {
        let u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
        let v = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
        let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let area = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        let m = self.middle;
        let volume = (a[0] - m[0]) * n[0] + (a[1] - m[1]) * n[1] + (a[2] - m[2]) * n[2];
        (area * self.to_area, volume * self.to_volume)
    }

    /// Area in the model's units squared.
    pub(crate) fn area(&self, sum: Extent) -> f64 {
        self.area_of(sum.area)
    }

    /// The same of [`Extent::area`] alone.
    pub(crate) fn area_of(&self, twice: i128) -> f64 {
        twice as f64 / FRACTION / self.to_area / 2.0
    }

    /// Signed volume in the model's units cubed.
    pub(crate) fn volume(&self, sum: Extent) -> f64 {
        sum.volume as f64 / FRACTION / self.to_volume / 6.0
    }
}

/// Triangles computed side by side.
const LANES: usize = 4;
/// 32 for each lane.
const MOST_AT_ONCE: usize = 32 * LANES;

/// Bits that [`whole`] keeps below the point.
const FRACTION: f64 = (1u64 << 48) as f64;

/// `x` in units of 2⁻⁴⁸, towards zero; exact but for what is below that. Two conversions to 64 bits are far cheaper than one to 128.
#[inline]
fn whole(x: f64) -> i128 {
    let high = x as i64;
    let low = ((x - high as f64) * FRACTION) as i64;
    (i128::from(high) << 48) + i128::from(low)
}

/// 2^e as f64, also where the exponent leaves the normal range of the intermediate steps.
fn power_of_two(e: i32) -> f64 {
    2f64.powi(e.clamp(-1000, 1000))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_unit_cube_has_volume_one_and_area_six_wherever_it_stands() {
        for offset in [0.0f32, 1000.0] {
            let p = |x: u8| std::array::from_fn(|k| offset + f32::from(x >> k & 1));
            // Corner numbers are bits x, y, z; each face as two triangles seen from outside.
            let quads = [[0u8, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
            let triangles: Vec<[[f32; 3]; 3]> =
                quads.iter().flat_map(|q| [[p(q[0]), p(q[1]), p(q[2])], [p(q[0]), p(q[2]), p(q[3])]]).collect();
            let mut bounds = Bounds::EMPTY;
            triangles.iter().for_each(|t| bounds.include(t));
            let measure = Measure::new(&bounds);
            let mut sum = Extent::default();
            triangles.iter().for_each(|t| sum += measure.triangle(t));
            assert!((measure.volume(sum) - 1.0).abs() < 1e-9, "{}", measure.volume(sum));
            assert!((measure.area(sum) - 6.0).abs() < 1e-9);
        }
    }

    #[test]
    fn the_step_at_the_largest_number_is_finite() {
        assert_eq!(step_at(1.0), 2f64.powi(-23));
        assert_eq!(step_at(0.0), f64::from(f32::from_bits(1)));
        for largest in [f32::MAX, -f32::MAX] {
            assert_eq!(step_at(largest), 2f64.powi(104), "24 bits of a number just below 2^128");
        }
    }

    proptest! {
        /// Many at once are the sum of each, to the last bit, for models of any size and place.
        #[test]
        fn many_are_the_sum_of_each(
            triangles in prop::collection::vec(prop::array::uniform3(prop::array::uniform3(-1f32..1.0)), 0..2 * MOST_AT_ONCE),
            exponent in -40i32..40,
            offset in -100f32..100.0,
        ) {
            let place = |p: Point| p.map(|x| (x + offset) * 2f32.powi(exponent));
            let triangles: Vec<[Point; 3]> = triangles.into_iter().map(|t| t.map(place)).collect();
            let mut bounds = Bounds::EMPTY;
            triangles.iter().for_each(|t| bounds.include(t));
            let measure = Measure::new(&bounds);
            let mut want = Extent::default();
            triangles.iter().for_each(|t| want += measure.triangle(t));
            prop_assert_eq!(measure.sum(&triangles), want);
            prop_assert!(want.area >= 0);
        }
    }
}
