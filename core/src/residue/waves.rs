//! Waves that a tool may have left, where no tool path is known: the surface is cut into patches, and each is asked for a wave ([`hint`]).
//!
//! A patch is a disc of neighbouring triangles whose smoothed normals lie around that of its first one, small enough for a dozen waves: in a
//! larger one, a direction that is off by a degree would lose the wave. Patches beside each other with the same wave are one place.

use super::found::Mesh;
use super::options::{Error, Options};
use super::regions::neighbours;
use super::spectrum::{Hint, hint};
use crate::curves::vector::{Point, add, cross, dot, plain_norm, plain_unit, scale, sub};
use rayon::prelude::*;
use std::collections::VecDeque;

/// Triangles of a patch, at most.
const MOST: usize = 6000;
/// Triangles of a patch, at least: fewer have no dozen of vertices on each of a few waves.
const LEAST: usize = 200;
/// Passes that smooth normals: about four rings of triangles, so that the flanks of a step have the normal of the wall.
const PASSES: usize = 64;
/// Cosine of the angle between the smoothed normals of a patch and its first one, at least: 40°.
const TURN: f64 = 0.766;
/// Of the variance of a patch's height, a sine explains as much at least: scallops of balls have more than 0.8, forms less than 0.4.
const SHARE: f64 = 0.6;
/// Waves of patches beside each other are one if their pitch differs by less than this part, and their direction by less than 15°.
const PITCH: f64 = 0.1;
/// Cosine of 15°.
const DIRECTION: f64 = 0.966;

/// A place where waves may be what a tool left. Someone has to look at it.
#[derive(Clone, Debug, PartialEq)]
pub struct Suspect {
    /// Direction across the crests, of length 1.
    pub across: [f64; 3],
    /// Distance of the crests, in millimetres.
    pub pitch: f64,
    /// Height from trough to crest, in millimetres.
    pub height: f64,
    /// The part of the variance of height that a sine of this pitch explains, between 0 and 1.
    pub confidence: f64,
    /// In square millimetres.
    pub area: f64,
    /// The box that it lies in.
    pub within: [[f64; 3]; 2],
    /// Its triangles, ascending.
    pub triangles: Vec<u32>,
}

/// Looks for waves without a tool path: places in the order of their first patches. Corrections of the options say where may be looked
/// (`exclude`, `mask`). O(triangles); each patch is compared with waves of 60 directions and 240 periods.
///
/// # Errors
/// [`Error::Vertex`], [`Error::Mask`], [`Error::Stopped`].
pub fn suspects(mesh: Mesh<'_>, options: &Options<'_>) -> Result<Vec<Suspect>, Error> {
    super::find::check(mesh, options)?;
    let neighbours = neighbours(mesh.points.len(), mesh.faces);
    let normals = smoothed(mesh, &neighbours, options)?;
    let (patches, numbers) = patches(mesh, (&neighbours, &normals), options);
    let rounding = rounding(mesh);
    let ask = |patch: &Vec<u32>| {
        if !(options.go_on)() {
            return Err(Error::Stopped);
        }
        let found = if patch.len() < LEAST { None } else { hint(mesh, patch)? };
        Ok(found.filter(|hint| hint.share >= SHARE && hint.height > rounding))
    };
    let hints: Vec<Option<Hint>> = patches.par_iter().map(ask).collect::<Result<_, Error>>()?;
    Ok(places(mesh, (&patches, &numbers, &hints), &neighbours))
}

/// Heights that rounding of coordinates alone can make.
fn rounding(mesh: Mesh<'_>) -> f64 {
    let greatest = mesh.points.iter().flatten().fold(0.0f32, |most, x| most.max(x.abs()));
    16.0 * f64::from(greatest) * f64::from(f32::EPSILON)
}

/// Normals of triangles, each many times the mean of itself and its neighbours'.
fn smoothed(mesh: Mesh<'_>, neighbours: &[[u32; 3]], options: &Options<'_>) -> Result<Vec<Point>, Error> {
    let normal = |face: &[u32; 3]| {
        let [a, b, c] = mesh.corners(face);
        cross(sub(b, a), sub(c, a))
    };
    // By area, so that slivers count little.
    let mut normals: Vec<Point> = mesh.faces.par_iter().map(normal).collect();
    for _ in 0..PASSES {
        if !(options.go_on)() {
            return Err(Error::Stopped);
        }
        let mean = |(sides, own): (&[u32; 3], &Point)| {
            let others = sides.iter().filter_map(|next| normals.get(*next as usize));
            let sum = others.fold(*own, |sum, normal| add(sum, *normal));
            scale(sum, 0.25)
        };
        normals = neighbours.par_iter().zip(&normals).map(mean).collect();
    }
    Ok(normals.par_iter().map(|normal| plain_unit(*normal).unwrap_or_default()).collect())
}

/// Discs of triangles, and for each triangle the number of its own; `u32::MAX` where none may be.
fn patches(mesh: Mesh<'_>, (neighbours, normals): (&[[u32; 3]], &[Point]), options: &Options<'_>) -> (Vec<Vec<u32>>, Vec<u32>) {
    let may: Vec<bool> = super::find::allowed(mesh, options);
    let mut numbers = vec![u32::MAX; mesh.faces.len()];
    let mut patches: Vec<Vec<u32>> = Vec::new();
    let mut queue = VecDeque::new();
    for first in 0..mesh.faces.len() {
        let (u32::MAX, true, Some(normal)) = (numbers[first], may[first], normals.get(first).copied()) else { continue };
        let number = patches.len() as u32;
        let mut patch = vec![first as u32];
        numbers[first] = number;
        queue.clear();
        queue.push_back(first);
        while let Some(face) = queue.pop_front() {
            for next in neighbours[face].into_iter().filter(|next| *next != u32::MAX).map(|next| next as usize) {
                let is_like = numbers[next] == u32::MAX && may[next] && dot(normals[next], normal) >= TURN;
                if is_like && patch.len() < MOST {
                    numbers[next] = number;
                    patch.push(next as u32);
                    queue.push_back(next);
                }
            }
        }
        patches.push(patch);
    }
    (patches, numbers)
}

/// Patches beside each other with the same wave, as one.
fn places(
    mesh: Mesh<'_>,
    (patches, numbers, hints): (&[Vec<u32>], &[u32], &[Option<Hint>]),
    neighbours: &[[u32; 3]],
) -> Vec<Suspect> {
    let of = |face: u32| numbers.get(face as usize).copied().filter(|patch| *patch != u32::MAX);
    let mut done = vec![false; patches.len()];
    let mut all = Vec::new();
    for first in 0..patches.len() {
        if done[first] || hints[first].is_none() {
            continue;
        }
        done[first] = true;
        let (mut members, mut at) = (vec![first], 0);
        while let Some(patch) = members.get(at).copied() {
            at += 1;
            for next in patches[patch].iter().flat_map(|face| neighbours[*face as usize]).filter_map(of).map(|next| next as usize)
            {
                if !done[next] && is_same(hints[patch], hints[next]) {
                    done[next] = true;
                    members.push(next);
                }
            }
        }
        all.extend(suspect(mesh, &members, patches, hints));
    }
    all
}

fn is_same(one: Option<Hint>, other: Option<Hint>) -> bool {
    let (Some(one), Some(other)) = (one, other) else { return false };
    (one.pitch - other.pitch).abs() < PITCH * one.pitch.max(other.pitch) && dot(one.across, other.across).abs() > DIRECTION
}

/// What several patches say together: means by their triangles, and of the largest one the direction.
fn suspect(mesh: Mesh<'_>, members: &[usize], patches: &[Vec<u32>], hints: &[Option<Hint>]) -> Option<Suspect> {
    let said: Vec<(f64, Hint)> =
        members.iter().filter_map(|patch| Some((patches[*patch].len() as f64, hints[*patch]?))).collect();
    let all: f64 = said.iter().map(|(size, _)| size).sum();
    let mean = |value: fn(&Hint) -> f64| said.iter().map(|(size, hint)| size * value(hint)).sum::<f64>() / all;
    let largest = said.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let mut triangles: Vec<u32> = members.iter().flat_map(|patch| patches[*patch].iter().copied()).collect();
    triangles.sort_unstable();
    let (mut area, mut within) = (0.0, [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]]);
    for face in triangles.iter().filter_map(|face| mesh.faces.get(*face as usize)) {
        let corners = mesh.corners(face);
        let [a, b, c] = corners;
        area += 0.5 * plain_norm(cross(sub(b, a), sub(c, a)));
        for (corner, axis) in corners.iter().flat_map(|corner| (0..3).map(move |axis| (corner, axis))) {
            within[0][axis] = within[0][axis].min(corner[axis]);
            within[1][axis] = within[1][axis].max(corner[axis]);
        }
    }
    let (pitch, height, confidence) = (mean(|hint| hint.pitch), mean(|hint| hint.height), mean(|hint| hint.share));
    Some(Suspect { across: largest.1.across, pitch, height, confidence, area, within, triangles })
}
