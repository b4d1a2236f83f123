//! A first look at facets: which of them may be part of a round surface.

use super::super::surface::Surface;
use super::super::vector::{cross, unit};
use super::rounds::{Hope, Rounds};
use super::start;
use rayon::prelude::*;
use std::ops::Range;

/// What a search from each of some facets may find: most facets of scans are told apart by a look at their neighbours.
pub(super) fn hopes(rounds: &Rounds<'_>, seeds: Range<u32>) -> Vec<Hope> {
    seeds.into_par_iter().map(|seed| if rounds.is_free(seed) { hope(rounds, seed) } else { Hope::None }).collect()
}

fn hope(rounds: &Rounds<'_>, seed: u32) -> Hope {
    if rounds.facets.triangles(seed).len() > 200 {
        return Hope::None;
    }
    let near = rounds.neighbours(seed);
    let lies = |surface: &Surface, facet: u32, concave: bool| rounds.lies_on(surface, facet, concave, rounds.limit(surface));
    let cylinder = |other: u32| {
        let start = unit(cross(rounds.ray(seed).1, rounds.ray(other).1))
            .and_then(|axis| start::cylinder(axis, &rounds.points(&[seed, other])));
        start.is_some_and(|surface| {
            let concave = rounds.is_concave(&surface, seed);
            let third = |facet: &u32| *facet != seed && *facet != other && lies(&surface, *facet, concave);
            lies(&surface, seed, concave)
                && lies(&surface, other, concave)
                && (near.iter().any(third) || rounds.neighbours(other).iter().any(third))
        })
    };
    let cone = |one: u32, other: u32| {
        let start = start::cone([rounds.ray(one), rounds.ray(seed), rounds.ray(other)], &rounds.points(&[one, seed, other]));
        start.is_some_and(|surface| {
            let concave = rounds.is_concave(&surface, seed);
            [seed, one, other].iter().all(|facet| lies(&surface, *facet, concave))
        })
    };
    let sphere = || {
        let seeds: Vec<u32> = std::iter::once(seed).chain(near.iter().copied().take(3)).collect();
        start::sphere(&rounds.points(&seeds)).is_some_and(|surface| {
            let concave = rounds.is_concave(&surface, seed);
            seeds.iter().all(|facet| lies(&surface, *facet, concave))
        })
    };
    let cones =
        || near.iter().enumerate().take(4).any(|(k, one)| near.iter().skip(k + 1).take(3).any(|other| cone(*one, *other)));
    if near.is_empty() {
        Hope::None
    } else if near.iter().take(4).any(|other| cylinder(*other)) || sphere() || cones() {
        Hope::Any
    } else {
        Hope::Torus
    }
}
