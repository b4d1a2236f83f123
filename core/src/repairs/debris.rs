//! Debris: specks of a few triangles that enclose nothing and hang on nothing.

use crate::settings::Profile;
use crate::shop::Shop;
use crate::shop::components::{Components, Reversed, Through};
use crate::shop::edges::Edges;
use crate::survey::Survey;

/// Drops open components of fewer triangles and less area than the profile says; returns how many triangles.
pub(super) fn drop(survey: &Survey<'_>, shop: &mut Shop, profile: &Profile) -> u64 {
    let edges = Edges::of(shop);
    if !edges.iter().any(|e| e.is_boundary()) {
        return 0;
    }
    let components = Components::of(survey, shop, &edges, &Reversed::none(survey), Through::EveryEdge);
    let total: i128 = components.list.iter().map(|c| c.extent.area).sum();
    let bound = total as f64 * profile.debris_area_share;
    let is_debris: Vec<bool> = components
        .list
        .iter()
        .map(|c| c.open && c.triangles < u64::from(profile.debris_triangles) && c.extent.area as f64 <= bound)
        .collect();
    let doomed: Vec<u32> = shop.living().filter(|t| is_debris[components.of_triangle[*t as usize] as usize]).collect();
    doomed.iter().for_each(|t| shop.kill(*t));
    doomed.len() as u64
}
