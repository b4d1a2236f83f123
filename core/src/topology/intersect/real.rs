//! Arithmetic of two precisions.

use std::ops::{Add, Mul, Sub};

/// A float.
pub(super) trait Real: Copy + PartialOrd + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    const ZERO: Self;
    const INFINITY: Self;
    /// The smallest normal number, and the largest.
    const SMALLEST: Self;
    const LARGEST: Self;
    /// 16ε.
    const ERROR: Self;
    /// Products of what is longer with differences of coordinates do not underflow.
    const SHORTEST: Self;
    /// Turns a view's line away from directions that meshes like: multiples of the axes, of diagonals, of a regular fan.
    const LINE: [Self; 3];

    /// The number without its sign.
    fn size(self) -> Self;
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const INFINITY: Self = Self::INFINITY;
    const SMALLEST: Self = Self::MIN_POSITIVE;
    const LARGEST: Self = Self::MAX;
    const ERROR: Self = 1.0 / (1 << 20) as Self;
    const SHORTEST: Self = 1e-30;
    const LINE: [Self; 3] = [0.3247, 1.0, -0.7713];

    #[inline(always)]
    fn size(self) -> Self {
        self.abs()
    }
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const INFINITY: Self = Self::INFINITY;
    const SMALLEST: Self = Self::MIN_POSITIVE;
    const LARGEST: Self = Self::MAX;
    const ERROR: Self = 1.0 / (1_u64 << 49) as Self;
    const SHORTEST: Self = 1e-30;
    const LINE: [Self; 3] = [0.3247, 1.0, -0.7713];

    #[inline(always)]
    fn size(self) -> Self {
        self.abs()
    }
}

#[inline(always)]
pub(super) fn minus<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(super) fn cross<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
pub(super) fn dot<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
