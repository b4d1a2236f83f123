//! Random paint and places, for tests.

use super::clip::Weights;
use super::split::Way;
use super::tree::Paint;
use proptest::prelude::*;

/// States as slicers have them, and a few of more digits.
fn leaf() -> impl Strategy<Value = Paint> {
    prop_oneof![8 => 0_u32..5, 1 => 5_u32..60].prop_map(Paint::uniform)
}

/// Trees as slicers write them: three cuts have no special corner. At most 8 splits deep, so that areas are above the smallest share.
pub(super) fn paint() -> impl Strategy<Value = Paint> {
    leaf().prop_recursive(8, 200, 4, |inner| {
        (1_u8..4, 0_u8..3, prop::collection::vec(inner, 4)).prop_map(|(sides, first, mut children)| {
            let way = Way::from_sides(sides).expect("1 to 3");
            children.truncate(way.points().len());
            Paint::split(way, if way == Way::Three { 0 } else { first }, children)
        })
    })
}

/// A place in a triangle. Hardly one of 2³⁰ is on a cut, where two states meet.
pub(super) fn place() -> impl Strategy<Value = Weights> {
    (1_u32..1 << 30, 1_u32..1 << 30, 1_u32..1 << 30).prop_map(|weights| {
        let weights: [u32; 3] = weights.into();
        let all: f64 = weights.iter().map(|w| f64::from(*w)).sum();
        weights.map(|w| f64::from(w) / all)
    })
}

/// A place in the triangle of these corners.
pub(super) fn mix(corners: [Weights; 3], weights: Weights) -> Weights {
    std::array::from_fn(|k| (0..3).map(|corner| corners[corner][k] * weights[corner]).sum())
}
