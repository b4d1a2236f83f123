//! Debris: specks of a few triangles that enclose nothing and hang on nothing.
//!
//! All of them go or none: many specks that together are much of the surface are no debris but what is left of it, whose holes are to be
//! closed, and which of them to keep nobody could say.

use crate::contract::report::RepairName;
use crate::contract::settings::Profile;
use crate::geometry::sums::Bounds;
use crate::repairs::shared::context::{Changes, Done, Repair};
use crate::repairs::shared::work::Work;
use crate::submesh::components::{Components, Reversed, Through};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// Open specks.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Debris,
    changes: Changes::Surface,
    run: |cx| {
        let dropped = drop(cx.survey, &mut cx.work, cx.profile);
        if dropped > 0 {
            let mut left = Bounds::EMPTY;
            cx.work.living().for_each(|t| left.include(&cx.work.points(t)));
            let regions =
                cx.survey.regions.iter().zip(&cx.reversed.dropped).filter(|(region, dropped)| region.first != NONE && !**dropped);
            regions.for_each(|(region, _)| left.add(&region.bounds));
            cx.account.explained.without_specks = Some(left);
        }
        Ok(Done::count(dropped, "triangles of open specks dropped, which together are next to nothing of the surface"))
    },
};

/// So many times the area that a single speck may have is what all specks together may have, at most: 1 % of the model's, by default.
const TOGETHER: f64 = 10.0;

/// Drops open components of fewer triangles and less area than the profile says, unless they are much of the surface together; returns how many
/// triangles. O(submesh).
pub(crate) fn drop(survey: &Survey<'_>, work: &mut Work<'_>, profile: &Profile) -> u64 {
    let (submesh, edges) = work.edges();
    if !edges.iter().any(|e| e.is_boundary()) {
        return 0;
    }
    let components = Components::of(survey, submesh, edges, &Reversed::none(survey), Through::EveryEdge);
    let total: i128 = components.list.iter().map(|c| c.extent.area).sum();
    let bound = total as f64 * profile.debris_area_share;
    let is_debris: Vec<bool> = components
        .list
        .iter()
        .map(|c| c.open && c.triangles < u64::from(profile.debris_triangles) && c.extent.area as f64 <= bound)
        .collect();
    let together: i128 =
        components.list.iter().zip(&is_debris).filter(|(_, is_debris)| **is_debris).map(|(c, _)| c.extent.area).sum();
    if together as f64 > TOGETHER * bound {
        tracing::info!(
            specks = is_debris.iter().filter(|is_debris| **is_debris).count(),
            share = together as f64 / total as f64,
            "Specks kept: together they are too much of the surface to be debris."
        );
        return 0;
    }
    let doomed: Vec<u32> = submesh.living().filter(|t| is_debris[components.of_triangle[*t as usize] as usize]).collect();
    doomed.iter().for_each(|t| work.kill(*t));
    doomed.len() as u64
}

#[cfg(test)]
mod tests {
    use super::Work;
    use crate::contract::settings::Profile;
    use crate::testing::{after, cube};

    #[test]
    fn a_speck_goes_but_not_a_large_triangle() {
        let dropped = |size: f32, profile: &Profile| {
            let speck = [[5.0, 0.0, 0.0], [5.0 + size, 0.0, 0.0], [5.0, size, 0.0]];
            after(&[cube(), vec![speck]].concat(), |d, _| super::drop(&d.survey, &mut Work::new(&mut d.submesh), profile))
        };
        // The cube's area is 6, so the bound is 0.006 and a little; a speck has size² / 2.
        let got = dropped(0.1, &Profile::default());
        assert!(got.result == 1 && got.verdict.good && got.untouched == 12, "{:?}", got.verdict);
        assert_eq!(dropped(0.2, &Profile::default()).result, 0, "it has an area that counts");
        assert_eq!(dropped(0.1, &Profile { debris_triangles: 0, ..Profile::default() }).result, 0, "switched off");
    }

    #[test]
    fn specks_that_are_much_of_the_surface_together_stay() {
        let dropped = |count: u8| {
            let specks = (0..count).map(|i| {
                let x = 5.0 + f32::from(i);
                [[x, 0.0, 0.0], [x + 0.1, 0.0, 0.0], [x, 0.1, 0.0]]
            });
            let triangles = cube().into_iter().chain(specks).collect::<Vec<_>>();
            after(&triangles, |d, _| super::drop(&d.survey, &mut Work::new(&mut d.submesh), &Profile::default())).result
        };
        // Of an area of 0.005 each; the bound is 0.06 and a little.
        assert_eq!([1, 12, 13].map(dropped), [1, 12, 0]);
    }
}
