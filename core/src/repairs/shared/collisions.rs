//! What a new patch crosses: another patch, or any other surface, wherever that is in the file.
//!
//! A patch was tested against itself and the triangles along its rim when it was made. Here all new triangles are held against everything
//! else in their boxes, chunk by chunk, exactly ([`crate::detect::fresh`]). Of two patches that cross, the later one is to blame.

use std::collections::{BTreeMap, HashSet};

use crate::detect::holes::owners;
use crate::geometry::position::Position;
use crate::geometry::sums::Extent;
use crate::geometry::tri_tri::Triangle as Corners;
use crate::repairs::shared::overlay::{Overlay, Standing, StandingPair, Which};
use crate::repairs::shared::pieces::components_of_records;
use crate::repairs::shared::work::Work;
use crate::submesh::Submesh;
use crate::submesh::components::{Component, Components, Reversed, Through};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::union_find;

/// A triangle that a patch crosses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Obstacle {
    pub(crate) corners: Corners,
    /// It belongs to a body that the one whose loop the patch closes runs into already.
    pub(crate) met_already: bool,
    /// It belongs to a body that neither that one nor what that one runs into has met, and both stand for themselves: with the patch, all of these
    /// become one.
    pub(crate) joins: bool,
    /// They do, and neither is a detail.
    pub(crate) joins_large: bool,
}

/// For each patch that crosses something what it crosses. `patch_of`: the patch that a triangle of the submesh belongs to; `is_new`: whether
/// a patch is to be tested against everything, and not only against such ones. `None` if that is too much work to tell, or the file holds
/// too many triangles to number them. O(boxes around new patches), and a look at the components if anything is crossed.
pub(crate) fn crossed(
    survey: &Survey<'_>,
    work: &mut Work<'_>,
    reversed: &Reversed,
    patch_of: &[Option<u32>],
    is_new: impl Fn(u32) -> bool,
) -> Option<BTreeMap<u32, Vec<Obstacle>>> {
    let (submesh, edges) = work.edges();
    let patch = |t: u32| patch_of[t as usize];
    let overlay = Overlay::of(survey, submesh, reversed)?;
    let pairs = overlay.met_by(survey, submesh, |t| patch(t).is_some_and(&is_new))?;
    let blamed = blamed(&pairs, |number| overlay.changed_of(number).and_then(patch));
    if blamed.is_empty() {
        return Some(BTreeMap::new());
    }
    let components = Components::of(survey, submesh, edges, reversed, Through::EveryEdge);
    let met = survey.crossing_pairs.as_deref().unwrap_or_default();
    let others = blamed.iter().filter_map(|(_, _, other)| overlay.record_of(*other));
    let of_record = components_of_records(survey, submesh, &components, others.chain(met.iter().flat_map(|pair| pair.triangles)));
    let mut met: Vec<[u32; 2]> = met
        .iter()
        .filter_map(|pair| Some([*of_record.get(&pair.triangles[0])?, *of_record.get(&pair.triangles[1])?]))
        .flat_map(|[a, b]| [[a, b], [b, a]])
        .filter(|[a, b]| a != b && *a != NONE && *b != NONE)
        .collect();
    met.sort_unstable();
    met.dedup();
    let mut groups: Vec<u32> = (0..components.list.len() as u32).collect();
    met.iter().for_each(|[a, b]| {
        union_find::unite(&mut groups, *a, *b);
    });
    let component = |number: Standing| match overlay.which(number) {
        Which::Submesh(t) => Some(components.of_triangle[t as usize]),
        Which::Record(record) => of_record.get(&record).copied(),
    };
    let stands = standing(survey, submesh, &components, patch_of);
    let is_detail = owners::are_details(components.list.iter().map(|c| survey.measure.area(c.extent)));
    let mut crossed: BTreeMap<u32, Vec<Obstacle>> = BTreeMap::new();
    let mut known = HashSet::new();
    for (patch, of_patch, other) in blamed {
        let corners = overlay.corners(survey, submesh, other);
        let of_both = component(of_patch).zip(component(other)).filter(|(a, b)| *a != NONE && *b != NONE);
        let joins = of_both.is_some_and(|(a, b)| {
            stands[a as usize] && stands[b as usize] && union_find::find(&mut groups, a) != union_find::find(&mut groups, b)
        });
        let obstacle = Obstacle {
            corners,
            met_already: of_both.is_some_and(|(a, b)| met.binary_search(&[a, b]).is_ok()),
            joins,
            joins_large: joins && of_both.is_some_and(|(a, b)| !is_detail[a as usize] && !is_detail[b as usize]),
        };
        if known.insert((patch, corners.map(Position::of), obstacle.met_already)) {
            crossed.entry(patch).or_default().push(obstacle);
        }
    }
    Some(crossed)
}

/// Of each pair with a patch in it, the patch to blame with one of its triangles, and what that crosses; ascending.
fn blamed(pairs: &[StandingPair], owner: impl Fn(Standing) -> Option<u32>) -> Vec<(u32, Standing, Standing)> {
    let of_pair = |pair: &StandingPair| {
        let [a, b] = pair.triangles;
        match (owner(a), owner(b)) {
            (Some(p), Some(q)) if p > q => Some((p, a, b)),
            (Some(p), Some(q)) if p < q => Some((q, b, a)),
            // What was accepted crosses neither itself nor its rim.
            (Some(_), Some(_)) | (None, None) => None,
            (Some(p), None) => Some((p, a, b)),
            (None, Some(q)) => Some((q, b, a)),
        }
    };
    let mut blamed: Vec<_> = pairs.iter().filter_map(of_pair).collect();
    blamed.sort_unstable();
    blamed
}

/// Which components stand for themselves, as far as they are no patches.
fn standing(survey: &Survey<'_>, submesh: &Submesh, components: &Components, patch_of: &[Option<u32>]) -> Vec<bool> {
    let mut patched = vec![0i128; components.list.len()];
    for t in submesh.living().filter(|t| patch_of[*t as usize].is_some()) {
        if let Some(sum) = patched.get_mut(components.of_triangle[t as usize] as usize) {
            *sum += survey.measure.triangle(&submesh.points(t)).area;
        }
    }
    let of = |(c, patched): (&Component, i128)| {
        let patched = survey.measure.area(Extent { area: patched, volume: 0 });
        owners::stands_for_itself(survey.measure.volume(c.extent), survey.measure.area(c.extent) - patched, patched)
    };
    components.list.iter().zip(patched).map(of).collect()
}
