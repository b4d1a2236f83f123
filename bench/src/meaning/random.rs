//! Chances of the generators.

use super::mesh::{V, times};
use crate::generate::{Random, turn};

/// A stream of random choices, the same on every platform.
pub(super) struct Chance(Random);

/// Cosine and sine of a part of a full turn.
pub(super) fn around(turns: f64) -> (f64, f64) {
    const WHOLE: u64 = 1 << 40;
    turn((turns.rem_euclid(1.0) * WHOLE as f64) as u64, WHOLE)
}

impl Chance {
    pub(super) fn new(seed: u64, key: u64) -> Self {
        Self(Random::new(seed, key))
    }

    /// Evenly from `low` to `high`.
    pub(super) fn from(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.unit()
    }

    /// Every power of ten as often.
    pub(super) fn scale(&mut self, low: f64, high: f64) -> f64 {
        let mut x = low;
        let steps = (high / low).log2() * self.0.unit();
        for _ in 0..steps as u32 {
            x *= 2.0;
        }
        x * (1.0 + steps.fract())
    }

    /// A whole number, both ends included.
    pub(super) fn count(&mut self, low: usize, high: usize) -> usize {
        self.0.within(low, high)
    }

    pub(super) fn is(&mut self, probability: f64) -> bool {
        self.0.unit() < probability
    }

    pub(super) fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.0.within(0, of.len() - 1)]
    }

    /// A direction; all are alike.
    pub(super) fn direction(&mut self) -> V {
        let z = self.from(-1.0, 1.0);
        let (c, s) = around(self.0.unit());
        let r = (1.0 - z * z).sqrt();
        [r * c, r * s, z]
    }

    /// A step of up to `most`.
    pub(super) fn step(&mut self, most: f64) -> V {
        let far = self.from(0.3 * most, most);
        times(self.direction(), far)
    }

    /// `items` in another order.
    pub(super) fn shuffle<T>(&mut self, items: &mut [T]) {
        for at in (1..items.len()).rev() {
            items.swap(at, self.0.within(0, at));
        }
    }
}
