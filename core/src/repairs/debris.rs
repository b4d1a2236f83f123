//! Debris: specks of a few triangles that enclose nothing and hang on nothing.

use super::work::Work;
use crate::settings::Profile;
use crate::shop::components::{Components, Reversed, Through};
use crate::survey::Survey;

/// Drops open components of fewer triangles and less area than the profile says; returns how many triangles.
pub(super) fn drop(survey: &Survey<'_>, work: &mut Work<'_>, profile: &Profile) -> u64 {
    let (shop, edges) = work.edges();
    if !edges.iter().any(|e| e.is_boundary()) {
        return 0;
    }
    let components = Components::of(survey, shop, edges, &Reversed::none(survey), Through::EveryEdge);
    let total: i128 = components.list.iter().map(|c| c.extent.area).sum();
    let bound = total as f64 * profile.debris_area_share;
    let is_debris: Vec<bool> = components
        .list
        .iter()
        .map(|c| c.open && c.triangles < u64::from(profile.debris_triangles) && c.extent.area as f64 <= bound)
        .collect();
    let doomed: Vec<u32> = shop.living().filter(|t| is_debris[components.of_triangle[*t as usize] as usize]).collect();
    doomed.iter().for_each(|t| work.kill(*t));
    doomed.len() as u64
}

#[cfg(test)]
mod tests {
    use super::Work;
    use crate::settings::Profile;
    use crate::testing::{after, cube};

    #[test]
    fn a_speck_goes_but_not_a_large_triangle() {
        let dropped = |size: f32, profile: &Profile| {
            let speck = [[5.0, 0.0, 0.0], [5.0 + size, 0.0, 0.0], [5.0, size, 0.0]];
            after(&[cube(), vec![speck]].concat(), |d, _| super::drop(&d.survey, &mut Work::new(&mut d.shop), profile))
        };
        // The cube's area is 6, so the bound is 0.006 and a little; a speck has size² / 2.
        let got = dropped(0.1, &Profile::default());
        assert!(got.result == 1 && got.verdict.good && got.untouched == 12, "{:?}", got.verdict);
        assert_eq!(dropped(0.2, &Profile::default()).result, 0, "it has an area that counts");
        assert_eq!(dropped(0.1, &Profile { debris_triangles: 0, ..Profile::default() }).result, 0, "switched off");
    }
}
