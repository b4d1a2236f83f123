//! What is cut out around places.

use std::collections::{BTreeMap, BTreeSet};

use super::places::{Place, complete};
use crate::repairs::shared::context::Context;
use crate::submesh::radial::{Half, RadialPairs};
use crate::submesh::{Submesh, Vertex};
use crate::util::union_find;

/// Triangles that are cut out at one place, at most: what is more is not local.
const MOST_TRIANGLES: usize = 1 << 16;

/// And this share of all surface.
const MOST_SHARE: f64 = 0.25;

/// The surfaces in a region that are not cut out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stays {
    /// The largest one, if it crosses nothing: the others draw back from it.
    Largest,
    /// Surfaces that are wholly in it: they are bodies.
    Closed,
}

/// The triangles that are cut out at a place.
pub(crate) struct Cut {
    /// Its number.
    pub(crate) place: u32,
    /// Ascending.
    pub(crate) triangles: Vec<u32>,
    /// Triangles that could have been cut out, and are not.
    pub(crate) stays: Vec<u32>,
    pub(crate) area: f64,
}

/// What is to be cut out at each place, with so many rings of triangles around. Places whose regions come to share vertices become one. The stars
/// of all vertices of what is cut out are in the submesh then.
pub(crate) fn cut_out(cx: &mut Context<'_, '_>, places: &mut Vec<Place>, (rings, stays): (usize, Stays), whole: f64) -> Vec<Cut> {
    let mut regions: Vec<BTreeSet<u32>> = places.iter().map(|place| place.seeds.iter().copied().collect()).collect();
    for ring in 0..=rings {
        let corners: BTreeSet<Vertex> = regions.iter().flatten().flat_map(|t| cx.work.triangles[*t as usize].v).collect();
        complete(
            cx,
            corners.iter().filter(|v| !cx.work.complete[**v as usize]).map(|v| cx.work.positions[*v as usize]).collect(),
        );
        if ring < rings {
            regions.iter_mut().filter(|region| region.len() <= MOST_TRIANGLES).for_each(|region| grow(&cx.work, region));
        }
    }
    let regions = unite(&cx.work, places, regions);
    let (submesh, edges) = cx.work.edges();
    let radial = RadialPairs::of(submesh, edges);
    let mut cuts = Vec::new();
    for (number, region) in (0..).zip(regions) {
        if region.len() > MOST_TRIANGLES {
            continue;
        }
        let Some((triangles, stays)) = divided(submesh, &radial, &region, &places[number as usize], stays) else { continue };
        let area = triangles.iter().map(|t| submesh.normal(*t).length() / 2.0).sum();
        if area <= MOST_SHARE * whole {
            cuts.push(Cut { place: number, triangles, stays, area });
        }
    }
    cuts
}

/// Takes in the triangles around all vertices of a region.
fn grow(submesh: &Submesh, region: &mut BTreeSet<u32>) {
    let corners: BTreeSet<Vertex> = region.iter().flat_map(|t| submesh.triangles[*t as usize].v).collect();
    region.extend(corners.into_iter().flat_map(|v| submesh.star(v)).map(|(t, _)| t));
}

/// Makes one of places whose regions share vertices.
fn unite(submesh: &Submesh, places: &mut Vec<Place>, regions: Vec<BTreeSet<u32>>) -> Vec<BTreeSet<u32>> {
    let mut parents: Vec<u32> = (0..regions.len() as u32).collect();
    let mut at: BTreeMap<Vertex, u32> = BTreeMap::new();
    for (number, region) in (0..).zip(&regions) {
        for v in region.iter().flat_map(|t| submesh.triangles[*t as usize].v) {
            let first = *at.entry(v).or_insert(number);
            union_find::unite(&mut parents, first, number);
        }
    }
    let mut all: BTreeMap<u32, (Place, BTreeSet<u32>)> = BTreeMap::new();
    for ((number, place), mut region) in (0..).zip(std::mem::take(places)).zip(regions) {
        let root = union_find::find(&mut parents, number);
        match all.get_mut(&root) {
            Some((into, united)) => {
                into.seeds.extend(place.seeds);
                into.crossing.extend(place.crossing);
                united.append(&mut region);
            }
            None => {
                all.insert(root, (place, region));
            }
        }
    }
    let (mut united, regions): (Vec<Place>, Vec<_>) = all.into_values().unzip();
    united.iter_mut().for_each(|place| place.seeds.sort_unstable());
    *places = united;
    regions
}

/// The triangles of a region that go, and those that stay. `None`: none can go.
fn divided(
    submesh: &Submesh,
    radial: &RadialPairs,
    region: &BTreeSet<u32>,
    place: &Place,
    stays: Stays,
) -> Option<(Vec<u32>, Vec<u32>)> {
    let surfaces = surfaces(radial, region);
    let crosses = |surface: &[u32]| surface.iter().any(|t| place.crossing.contains(t));
    let area = |surface: &[u32]| surface.iter().map(|t| submesh.normal(*t).length()).sum::<f64>();
    let is_closed = |surface: &[u32]| {
        let halves = surface.iter().flat_map(|t| (0..3).map(|corner| Half { triangle: *t, corner }));
        halves.into_iter().all(|half| radial.mate(half).is_some_and(|mate| region.contains(&mate.triangle)))
    };
    let is_kept: Vec<bool> = match stays {
        Stays::Largest => {
            let largest = (0..surfaces.len()).filter(|n| !crosses(&surfaces[*n]));
            let largest = largest.max_by(|a, b| area(&surfaces[*a]).total_cmp(&area(&surfaces[*b])).then(b.cmp(a)))?;
            (0..surfaces.len()).map(|n| n == largest).collect()
        }
        Stays::Closed => surfaces.iter().map(|surface| is_closed(surface)).collect(),
    };
    let part = |kept: bool| {
        let some = surfaces.iter().zip(&is_kept).filter(|(_, is_kept)| **is_kept == kept);
        let mut part: Vec<u32> = some.flat_map(|(surface, _)| surface).copied().collect();
        part.sort_unstable();
        part
    };
    let (goes, stays) = (part(false), part(true));
    let stays_crossing = stays.iter().any(|t| place.crossing.contains(t));
    // A body would be lost.
    let loses = surfaces.iter().zip(&is_kept).any(|(surface, is_kept)| !is_kept && is_closed(surface));
    (!goes.is_empty() && !stays_crossing && !loses).then_some((goes, stays))
}

/// What of a region hangs together through its edges, as the skin of what it encloses; by first triangles.
fn surfaces(radial: &RadialPairs, region: &BTreeSet<u32>) -> Vec<Vec<u32>> {
    let all: Vec<u32> = region.iter().copied().collect();
    let mut parents: Vec<u32> = (0..all.len() as u32).collect();
    for (n, t) in (0..).zip(&all) {
        for mate in (0..3).filter_map(|corner| radial.mate(Half { triangle: *t, corner })) {
            if let Ok(other) = all.binary_search(&mate.triangle) {
                union_find::unite(&mut parents, n, other as u32);
            }
        }
    }
    let mut lists: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (n, t) in (0..).zip(&all) {
        lists.entry(union_find::find(&mut parents, n)).or_default().push(*t);
    }
    lists.into_values().collect()
}
