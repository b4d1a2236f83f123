//! The proof: vertices go to near spots, triangles with them, and what the map says nothing about is searched.

use std::sync::atomic::{AtomicI64, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use crate::geometry::distance::place;
use crate::proof::map::{BLOCK, Found, Map, covers};
use crate::proof::pairing::Pairing;
use crate::proof::rim::{self, Rims};
use crate::proof::search;
use crate::proof::surface::{Spot, Surface, WALK};
use crate::util::ids::NONE;

/// Rounding adds so much to a distance, as a share of the largest coordinate: a hundred times the error of the few sums of f64 that it is made of.
const ROUNDING: f64 = 1e-13;

/// Rounding may make a distance less by this share.
const SHARE: f64 = 1e-9;

/// A bound may be larger than the distance of the farthest vertex by this share before it is worth a search.
const SLACK: f64 = 1.02;

/// Each so many distances stand for all, and one of so many of these vertices is looked at again, so many rings of faces wide.
const SAMPLE: usize = 8;
const FARTHEST: usize = 500;
const RINGS: usize = 3;

/// The spot for a vertex, and how far that is.
type Image = Option<(Spot, f64)>;

/// Bounds of distances, in the unit of the points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Proved {
    /// No place of the first surface is farther from the second.
    pub forward: f64,
    /// No place of the second surface is farther from the first.
    pub backward: f64,
    /// Triangles and faces that needed a search.
    pub searched: usize,
}

/// The outcome of a proof.
#[derive(Clone, Debug, Default)]
pub(crate) struct Verdict {
    pub(crate) proved: Proved,
    /// Triangles of the first mesh that are, or may be, farther than is wanted, or near to what is, with the bounds there, by number.
    pub(crate) far: Vec<(u32, f64)>,
    /// Faces of the second mesh that are, or may be, farther than is wanted.
    pub(crate) under: Vec<u32>,
    /// Bounds for all but those that are farther than is wanted.
    pub(super) within: [f64; 2],
}

/// Triangles of the first mesh and faces of the second that are asked about.
pub(super) struct Asked<'a> {
    pub(super) first: &'a [bool],
    pub(super) second: &'a [bool],
}

/// Proves bounds, and names what is, or may be, farther than `most`. O(n) where the meshes are alike. Bounds need not be lower
/// than what is `enough`.
pub(crate) fn prove(pairing: &Pairing<'_>, most: f64, enough: f64) -> Verdict {
    prove_of(pairing, None, (most, enough))
}

/// Proves bounds of all, or of those that are asked about.
pub(super) fn prove_of(pairing: &Pairing<'_>, asked: Option<&Asked<'_>>, (most, enough): (f64, f64)) -> Verdict {
    let surface = Surface::new(pairing.new_points, pairing.new_faces);
    let images: Vec<Image> =
        (0..pairing.points.len()).into_par_iter().with_min_len(BLOCK).map(|v| image(&surface, pairing, v)).collect();
    let mut images = with_better_ones(&surface, pairing, images);
    let rim = Rims::new(pairing);
    for v in rim.vertices() {
        images[v] = rim::image(&surface, pairing, v).or(images[v]);
    }
    let covered: Vec<AtomicI64> = (0..pairing.new_faces.len()).map(|_| AtomicI64::new(0)).collect();
    let size = pairing.points.iter().chain(pairing.new_points).flatten().fold(0.0_f32, |m, x| m.max(x.abs()));
    // Distances that are found are made larger in the end.
    let rounding = f64::from(size) * ROUNDING;
    let most = ((most - rounding) / (1.0 + SHARE)).max(0.0);
    // As vertices are about so far, no bound can be much better; where a bound is wanted, no better one is needed.
    let farthest_vertex = images.par_iter().flatten().map(|image| image.1).reduce(|| 0.0, f64::max);
    let least = (farthest_vertex * SLACK).max(rounding);
    let aim = least.max(enough).min(most);
    let map = Map {
        surface: &surface,
        pairing,
        images: &images,
        rim: &rim,
        covered: &covered,
        aim,
        asked: asked.map(|asked| asked.first),
    };
    let blocks = pairing.faces.len().div_ceil(BLOCK);
    let found: Vec<Found> = (0..blocks).into_par_iter().with_max_len(1).map(|block| map.block(block)).collect();
    let farthest = found.iter().map(|f| f.farthest).fold(0.0, f64::max);
    let failed: Vec<u32> = found.iter().flat_map(|f| f.failed.iter().copied()).collect();
    let mut is_sure: Vec<bool> = covered.par_iter().map(|sum| covers(sum.load(Ordering::Relaxed))).collect();
    found.iter().flat_map(|f| &f.rims).for_each(|face| is_sure[*face as usize] = false);
    let bare = (0..is_sure.len() as u32).filter(|f| !is_sure[*f as usize]);
    let bare: Vec<u32> = bare.filter(|f| asked.is_none_or(|asked| asked.second[*f as usize])).collect();
    let forward = search::forward(&surface, pairing, &images, &failed, (aim, most));
    let backward = search::backward(&surface, pairing, &images, &bare, (aim, most));
    let mut far = [forward.far, backward.far].concat();
    far.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
    far.dedup_by_key(|one| one.0);
    let sure = |d: f64| if d > 0.0 { d * (1.0 + SHARE) + rounding } else { 0.0 };
    let proved = Proved {
        forward: sure(farthest.max(forward.largest)),
        backward: sure(farthest.max(backward.largest)),
        searched: failed.len() + bare.len(),
    };
    let within = [forward.within, backward.within].map(|within| sure(farthest.max(within)));
    Verdict { proved, far, under: backward.under, within }
}

/// The spot for a vertex: itself if it is still there, else the nearest one of those around what it became, and from there on.
fn image(surface: &Surface<'_>, pairing: &Pairing<'_>, v: usize) -> Image {
    let became = *pairing.became.get(v)?;
    if became == NONE {
        return None;
    }
    if pairing.points[v] == pairing.new_points[became as usize] {
        return Some((surface.at_vertex(became)?, 0.0));
    }
    let p = place(pairing.points[v]);
    let mut best: Option<(Spot, f64)> = None;
    for face in surface.around(became) {
        let other = surface.nearest(*face, p);
        if best.is_none_or(|best| other.1 < best.1) {
            best = Some(other);
        }
    }
    Some(walk(surface, p, best?)).map(|(spot, square)| (spot, square.sqrt()))
}

/// Looks wider for the farthest vertices: a walk may have ended where all around is farther, and not what is behind it.
fn with_better_ones(surface: &Surface<'_>, pairing: &Pairing<'_>, mut images: Vec<Image>) -> Vec<Image> {
    let mut distances: Vec<f64> = images.iter().flatten().step_by(SAMPLE).map(|image| image.1).collect();
    let rank = distances.len() - distances.len() / FARTHEST;
    if rank >= distances.len() {
        return images;
    }
    let bound = *distances.select_nth_unstable_by(rank, f64::total_cmp).1;
    images.par_iter_mut().enumerate().with_min_len(BLOCK).for_each(|(v, image)| {
        let Some((spot, distance)) = image else { return };
        if *distance <= bound {
            return;
        }
        let p = place(pairing.points[v]);
        let mut faces = vec![spot.face];
        for _ in 0..RINGS {
            faces =
                faces.iter().flat_map(|f| surface.faces[*f as usize]).flat_map(|v| surface.around(v).iter().copied()).collect();
            faces.sort_unstable();
            faces.dedup();
        }
        for face in faces {
            let other = surface.nearest(face, p);
            if other.1.sqrt() < *distance {
                (*spot, *distance) = (other.0, other.1.sqrt());
            }
        }
        let (better, square) = walk(surface, p, (*spot, distance.powi(2)));
        if square.sqrt() < *distance {
            (*spot, *distance) = (better, square.sqrt());
        }
    });
    images
}

/// Goes from a spot to nearer ones while there are any around; with squares of distances.
fn walk(surface: &Surface<'_>, p: DVec3, mut best: (Spot, f64)) -> (Spot, f64) {
    for _ in 0..WALK {
        if best.0.shares.iter().all(|s| *s > 0.0) {
            break;
        }
        let mut next = best;
        let mut look = |face: u32| {
            let other = surface.nearest(face, p);
            if other.1 < next.1 {
                next = other;
            }
        };
        if let Some(k) = best.0.shares.iter().position(|s| *s == 1.0) {
            surface.around(surface.faces[best.0.face as usize][k]).iter().for_each(|face| look(*face));
        } else {
            (0..3).filter(|k| best.0.shares[(k + 2) % 3] == 0.0).filter_map(|k| surface.beyond(best.0.face, k)).for_each(look);
        }
        if next.0 == best.0 {
            break;
        }
        best = next;
    }
    best
}
