//! How much of a triangle has which state, and the state at a place.

use super::split::Share;
use super::tree::Paint;
use std::collections::BTreeMap;

impl Paint {
    /// Each state with its share of the triangle's area, by state. The shares are exact, and their sum is 1.
    ///
    /// O(n log s) in nodes and states.
    pub(crate) fn state_areas(&self) -> Vec<(u32, f64)> {
        let mut units = BTreeMap::new();
        add(self, Share::WHOLE, &mut units);
        units.into_iter().map(|(state, n)| (state, n as f64 / Share::UNITS as f64)).collect()
    }

    /// The state at a place, which is given by weights of the triangle's corners. On a cut, it is that of one of the sides.
    ///
    /// O(depth).
    pub(crate) fn state_at(&self, weights: [f64; 3]) -> u32 {
        let (mut node, mut weights) = (self, weights);
        loop {
            match node {
                Paint::Uniform(state) => return *state,
                Paint::Split(split) => {
                    weights.rotate_left(usize::from(split.first));
                    let (child, inside) = split.way.child_at(weights);
                    let Some(next) = split.children.get(child) else { return 0 };
                    (node, weights) = (next, inside);
                }
            }
        }
    }
}

fn add(paint: &Paint, share: Share, units: &mut BTreeMap<u32, u64>) {
    match paint {
        Paint::Uniform(state) => *units.entry(*state).or_default() += share.units(),
        Paint::Split(split) => {
            for (child, halvings) in split.children.iter().zip(split.way.halvings()) {
                add(child, share.halved(*halvings), units);
            }
        }
    }
}
