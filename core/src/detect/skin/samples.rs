//! Points on triangles, as many as their area asks for.

use glam::DVec3;

use crate::contract::report::RepairName;
use crate::geometry::distance::place;
use crate::geometry::spread;

use super::surfaces::{Corners, Surfaces};

/// No more points than about this many are taken on a surface.
const MOST: f64 = 65_536.0;
/// Otherwise one is taken on a square of this share of the reach.
const SPACING: f64 = 0.5;

/// Points, each of which stands for the same area.
#[derive(Default)]
pub(super) struct Samples {
    pub(super) points: Vec<[f64; 3]>,
    /// Where the surface faces at each of them, if it counts from there only.
    pub(super) fronts: Vec<Option<DVec3>>,
    /// The repair that changed the surface there.
    pub(super) causes: Vec<Option<RepairName>>,
    pub(super) area_of_each: f64,
}

/// From where a surface counts.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Front,
    Both,
}

/// Points of one triangle, by the triangle's number.
type Taken = (u32, (Option<RepairName>, Option<DVec3>), Vec<[f64; 3]>);

impl Samples {
    /// On what is not there any more.
    pub(super) fn gone(surfaces: &Surfaces<'_>, reach: f64) -> Self {
        let measure = &surfaces.survey.measure;
        let mut twice = 0i128;
        surfaces.each_gone(|_, corners, _| twice += measure.triangle(corners).area);
        let regions = surfaces.survey.regions.iter().zip(&surfaces.reversed.dropped);
        let dropped = regions.filter(|(_, dropped)| **dropped).map(|(region, _)| region.extent.area);
        let drops = surfaces.reversed.dropped.contains(&true);
        let each = area_of_each(measure.area_of(twice + dropped.sum::<i128>()), reach);
        let mut taken = Vec::new();
        let side = |corners: &Corners| if surfaces.is_of_cavity(corners) { Side::Front } else { Side::Both };
        surfaces.each_gone(|number, corners, by| take(&mut taken, number, (corners, side(corners)), by, each));
        if drops {
            let of_chunks = surfaces.each_dropped(|into: &mut Vec<Taken>, number, corners, by| {
                take(into, number, (corners, side(corners)), by, each);
            });
            taken.extend(of_chunks.into_iter().flatten());
            taken.sort_unstable_by_key(|(number, ..)| *number);
        }
        Self::of(taken, each)
    }

    /// On all that was there, one for each such area.
    pub(super) fn all(surfaces: &Surfaces<'_>, each: f64) -> Self {
        let mut taken = Vec::new();
        surfaces.each_irregular(|number, corners| take(&mut taken, number, (corners, Side::Both), None, each));
        let of_chunks = surfaces.each_regular(|into: &mut Vec<Taken>, number, corners| {
            take(into, number, (corners, Side::Both), None, each);
        });
        taken.extend(of_chunks.into_iter().flatten());
        taken.sort_unstable_by_key(|(number, ..)| *number);
        Self::of(taken, each)
    }

    /// On what was not there before. `but`: triangles of the submesh that none are taken on, ascending.
    pub(super) fn added(surfaces: &Surfaces<'_>, but: &[u32], reach: f64) -> Self {
        let measure = &surfaces.survey.measure;
        let counts = |number: u32| but.binary_search(&number).is_err();
        let mut twice = 0i128;
        surfaces.each_added(|number, corners, _| twice += if counts(number) { measure.triangle(corners).area } else { 0 });
        let each = area_of_each(measure.area_of(twice), reach);
        let mut taken = Vec::new();
        surfaces.each_added(|number, corners, by| {
            if counts(number) {
                take(&mut taken, number, (corners, Side::Front), by, each);
            }
        });
        Self::of(taken, each)
    }

    fn of(taken: Vec<Taken>, area_of_each: f64) -> Self {
        let mut samples = Self { area_of_each, ..Self::default() };
        for (_, (by, front), points) in taken {
            samples.fronts.extend(points.iter().map(|_| front));
            samples.causes.extend(points.iter().map(|_| by));
            samples.points.extend(points);
        }
        samples
    }
}

fn area_of_each(area: f64, reach: f64) -> f64 {
    (area / MOST).max((reach * SPACING) * (reach * SPACING))
}

/// Points on a triangle, on average one for each such area.
fn take(taken: &mut Vec<Taken>, number: u32, (corners, side): (&Corners, Side), by: Option<RepairName>, each: f64) {
    let points: Vec<[f64; 3]> = spread::points(corners, number, each).map(|p| p.to_array()).collect();
    if points.is_empty() {
        return;
    }
    let [a, b, c] = corners.map(place);
    let front = (side == Side::Front).then_some((b - a).cross(c - a));
    taken.push((number, (by, front), points));
}
