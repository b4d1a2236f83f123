//! What a new patch crosses: another patch, or any other surface, wherever that is in the file.
//!
//! A patch was tested against itself and the triangles along its rim when it was made. Here all new triangles are held against everything
//! else in their boxes, chunk by chunk, exactly ([`crate::fresh`]). Of two patches that cross, the later one is to blame.

use std::collections::BTreeMap;

use super::work::Work;
use crate::fill::cross::Triangle as Corners;
use crate::fresh;
use crate::record;
use crate::shop::{Origin, Shop};
use crate::survey::Survey;

/// For each patch that crosses something what it crosses. `patch_of`: the patch that a triangle of the workshop belongs to; `is_new`: whether
/// a patch is to be tested against everything, and not only against such ones. `None` if that is too much work to tell, or the file holds
/// too many triangles to number them. O(boxes around new patches).
pub(super) fn crossed(
    survey: &Survey<'_>,
    work: &Work<'_>,
    patch_of: &[Option<u32>],
    is_new: impl Fn(u32) -> bool,
) -> Option<BTreeMap<u32, Vec<Corners>>> {
    let shop: &Shop = work;
    let records = survey.records.len() as u32;
    records.checked_add(shop.triangles.len() as u32)?;
    let patch = |t: u32| patch_of[t as usize];
    let fresh = |t: &u32| patch(*t).is_some_and(&is_new);
    let (mut gone, mut changed) = (Vec::new(), Vec::new());
    for t in 0..shop.triangles.len() as u32 {
        let (triangle, lives) = (&shop.triangles[t as usize], shop.lives(t));
        let stays = match triangle.origin {
            Origin::Input(place) => {
                let stays = lives && same_corners(record::corners(&survey.records[place as usize]), shop.points(t));
                if !stays {
                    gone.push(place);
                }
                stays
            }
            Origin::Part(_) | Origin::Patch => false,
        };
        if lives && !stays {
            changed.push(t);
        }
    }
    gone.sort_unstable();
    let numbered = |t: &u32| (records + t, shop.points(*t));
    let pairs = fresh::met_by(
        survey,
        changed.iter().filter(|t| fresh(t)).map(numbered),
        changed.iter().filter(|t| !fresh(t)).map(numbered),
        |place| gone.binary_search(&place).is_ok(),
        u64::from(records) + shop.triangles.len() as u64,
    )?;
    let corners = |number: u32| match number.checked_sub(records) {
        Some(t) => shop.points(t),
        None => record::corners(&survey.records[number as usize]),
    };
    let mut crossed: BTreeMap<u32, Vec<Corners>> = BTreeMap::new();
    for pair in pairs {
        let [a, b] = pair.triangles;
        let owner = |number: u32| number.checked_sub(records).and_then(patch);
        match (owner(a), owner(b)) {
            (Some(p), Some(q)) if p > q => crossed.entry(p).or_default().push(corners(b)),
            (Some(p), Some(q)) if p < q => crossed.entry(q).or_default().push(corners(a)),
            // What was accepted crosses neither itself nor its rim.
            (Some(_), Some(_)) | (None, None) => {}
            (Some(p), None) => crossed.entry(p).or_default().push(corners(b)),
            (None, Some(q)) => crossed.entry(q).or_default().push(corners(a)),
        }
    }
    for obstacles in crossed.values_mut() {
        obstacles.sort_by(|a, b| {
            a.as_flattened().iter().zip(b.as_flattened()).fold(std::cmp::Ordering::Equal, |o, (x, y)| o.then(x.total_cmp(y)))
        });
        obstacles.dedup();
    }
    Some(crossed)
}

/// Comparing as numbers, whichever way round.
fn same_corners(a: Corners, b: Corners) -> bool {
    a == b || [a[0], a[2], a[1]] == b
}
