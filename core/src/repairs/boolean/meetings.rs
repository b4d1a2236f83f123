//! How much work the cuts of crossing pairs are, before they are made.

use crate::geometry::boxes;
use crate::geometry::sums::Bounds;
use crate::util::ids::NONE;
use std::collections::BTreeMap;

/// Two triangles that cross a third one, where boxes around the cuts meet, of all triangles together: so many points may the cuts have in common, at
/// some hundred bytes each.
pub(crate) const MOST_MEETINGS: u64 = 1 << 24;

/// How many points the cuts of these pairs may have in common, at most; if they are too many, the triangle on which most others come close to
/// each other.
pub(crate) fn meetings(bounds: impl Fn(u32) -> Bounds, crossing: &[[u32; 2]]) -> Result<u64, u32> {
    let mut cuts: BTreeMap<u32, Vec<Bounds>> = BTreeMap::new();
    for [a, b] in crossing {
        let common = bounds(*a).overlap(&bounds(*b));
        common.into_iter().for_each(|common| [a, b].iter().for_each(|t| cuts.entry(**t).or_default().push(common)));
    }
    let (mut all, mut worst) = (0, (0, NONE));
    for (t, boxes) in cuts {
        let meetings = boxes::meetings(boxes, MOST_MEETINGS);
        worst = worst.max((meetings, t));
        all += meetings;
        if all > MOST_MEETINGS {
            return Err(worst.1);
        }
    }
    Ok(all)
}
