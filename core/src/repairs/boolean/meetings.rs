//! How much work the cuts of crossing pairs are, before they are made.

use crate::geometry::boxes;
use crate::geometry::sums::Bounds;
use crate::util::ids::NONE;

/// Two triangles that cross a third one, where boxes around the cuts meet, of all triangles together: so many points may the cuts have in common, at
/// some hundred bytes each.
pub(crate) const MOST_MEETINGS: u64 = 1 << 24;

/// How many points the cuts of these pairs may have in common, at most; if they are too many, the triangle on which most others come close to
/// each other.
pub(crate) fn meetings(bounds: impl Fn(u32) -> Bounds, crossing: &[[u32; 2]]) -> Result<u64, u32> {
    let mut cuts: Vec<(u32, Bounds)> = Vec::with_capacity(2 * crossing.len());
    for [a, b] in crossing {
        let common = bounds(*a).overlap(&bounds(*b));
        common.into_iter().for_each(|common| cuts.extend([(*a, common), (*b, common)]));
    }
    cuts.sort_unstable_by_key(|(t, _)| *t);
    let (mut all, mut worst) = (0, (0, NONE));
    for cuts in cuts.chunk_by(|a, b| a.0 == b.0) {
        let (t, boxes) = (cuts[0].0, cuts.iter().map(|(_, common)| *common).collect());
        let meetings = boxes::meetings(boxes, MOST_MEETINGS);
        worst = worst.max((meetings, t));
        all += meetings;
        if all > MOST_MEETINGS {
            return Err(worst.1);
        }
    }
    Ok(all)
}
