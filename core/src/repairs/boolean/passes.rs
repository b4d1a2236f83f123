//! How often a pass may follow a pass.
//!
//! Each pass looks at the whole submesh, so that passes which take out one pair after the other would cost the square of the pairs. Most have to
//! leave no more than seven of eight pairs, and only some may leave more: so there are no more than 8 · ln(pairs) + [`SLOW`] of them, and all
//! together look at pairs in proportion to those of the first. (Of fewer than nine pairs, one less is enough.)

/// Passes that may leave more.
const SLOW: u32 = 16;

/// The passes so far that left too many pairs.
#[derive(Default)]
pub(crate) struct Passes {
    slow: u32,
}

impl Passes {
    /// May another pass follow one that has left so many pairs of so many?
    pub(crate) fn may_go_on(&mut self, before: usize, left: usize) -> bool {
        self.slow += u32::from(8 * left > 7 * before);
        self.slow < SLOW
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::util::steps;

    #[test]
    fn passes_that_take_out_one_pair_each_look_at_pairs_in_proportion() {
        steps::assert_near_linear(1000, |n| {
            let mut passes = Passes::default();
            let one_by_one = (1..=n).rev().take_while(|pairs| {
                steps::count(*pairs);
                passes.may_go_on(*pairs, pairs - 1)
            });
            steps::of(|| one_by_one.count()).0
        });
    }

    #[test]
    fn passes_that_help_go_on_to_the_end() {
        let mut passes = Passes::default();
        let mut pairs = 1 << 18;
        while pairs > 0 {
            let left = (pairs - 1).min(pairs * 7 / 8);
            assert!(passes.may_go_on(pairs, left));
            pairs = left;
        }
    }
}
