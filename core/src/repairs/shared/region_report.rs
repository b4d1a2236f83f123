//! What happened where: every region that was cut, snapped, taken apart, dropped, rebuilt, wrapped or left, for the report.

use crate::contract::report::{MOST_LISTED, Region, RegionMethod, Regions, SheetDropped, Wrap};
use crate::geometry::sums::Bounds;

/// A region that was left as it was, for now: a wrap may replace it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Unsettled {
    pub(crate) region: Region,
    /// A vertex of its.
    pub(crate) at: [f32; 3],
}

/// As they stand in the report: the largest first, of equal ones the less intrusive, then the one with the smaller coordinates, so that the order
/// in which they were found does not show.
pub(crate) fn summarise(mut all: Vec<Region>) -> Regions {
    let size = |region: &Region| {
        let [lo, hi] = region.bounds;
        Bounds { lo, hi }.diagonal()
    };
    let place = |region: &Region| region.bounds.as_flattened().iter().map(|x| f64::from(*x)).collect::<Vec<_>>();
    all.sort_by(|a, b| {
        let by_place = || place(a).into_iter().zip(place(b)).map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne());
        let order = size(b).total_cmp(&size(a)).then(a.method.cmp(&b.method));
        order.then_with(|| by_place().unwrap_or(std::cmp::Ordering::Equal)).then(b.count.cmp(&a.count))
    });
    let total = all.len() as u64;
    all.truncate(MOST_LISTED);
    Regions { total, listed: all }
}

impl From<&SheetDropped> for Region {
    fn from(sheet: &SheetDropped) -> Self {
        Self { method: RegionMethod::Dropped, bounds: sheet.bounds, count: sheet.triangles, rounds: 0, moved: 0.0, reason: None }
    }
}

impl From<&Wrap> for Region {
    fn from(wrap: &Wrap) -> Self {
        let (method, moved) = if wrap.left.is_some() { (RegionMethod::Left, 0.0) } else { (RegionMethod::Wrapped, wrap.moved) };
        Self { method, bounds: wrap.bounds, count: wrap.replaced, rounds: 0, moved, reason: wrap.left.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_come_first_in_whatever_order_they_were_found() {
        let region = |side: f32, at: f32, method| Region {
            method,
            bounds: [[at; 3], [at + side; 3]],
            count: 1,
            rounds: 0,
            moved: 0.0,
            reason: None,
        };
        let sorted = [
            region(4.0, 1.0, RegionMethod::Wrapped),
            region(2.0, 8.0, RegionMethod::Cut),
            region(2.0, 0.0, RegionMethod::Left),
            region(2.0, 4.0, RegionMethod::Left),
        ];
        let found = [2, 0, 3, 1].map(|i| sorted[i].clone());
        assert_eq!(summarise(found.to_vec()), Regions { total: 4, listed: sorted.to_vec() });
        let many = summarise(vec![sorted[0].clone(); MOST_LISTED + 7]);
        assert_eq!((many.total, many.listed.len()), (MOST_LISTED as u64 + 7, MOST_LISTED));
        assert!(summarise(Vec::new()).is_empty());
    }
}
