//! Waves that a tool may have left, where no tool path is known.
//!
//! The surface is cut into patches: discs of neighbouring triangles whose smoothed normals lie around that of the first one, small enough for a few dozen waves, since in a
//! larger one a direction that is off by a degree would lose the wave. From the heights of a patch its form is taken away, as a parabolic surface, and then as the mean of
//! neighbours many times over, with which waves of thirty edges and more go. What is left is asked for a wave. Patches beside each other with the same wave are one place.

use super::found::Mesh;
use super::options::{Error, Options};
use super::regions::neighbours;
use super::spectrum::{Hint, axes, flatten, search, size};
use crate::curves::vector::{Point, add, cross, dot, plain_norm, plain_unit, scale, sub};
use rayon::prelude::*;
use std::collections::VecDeque;

/// Triangles of a patch, at most.
const MOST: usize = 6000;
/// Triangles of a patch, at least: fewer have no dozen of vertices on each of a few waves.
const LEAST: usize = 200;
/// Passes that smooth normals and heights: waves of eight edges are gone, of sixty nearly stay.
const PASSES: usize = 64;
/// Lengths of waves, in edges: shorter ones are no waves of a mesh, longer ones are its form.
const EDGES: [f64; 2] = [2.5, 24.0];
/// The height of a wave is less than this part of its pitch: steps at 45° have a half, balls less.
const STEEPEST: f64 = 0.55;
/// Waves of a patch, at least: fewer are its form.
const WAVES: f64 = 4.0;
/// A height that is so many times farther from the median than half of all is a sharp edge's.
const OUTLIER: f64 = 5.0;
/// Parts of a wave.
const FOLDS: usize = 8;
/// Vertices of a patch that are compared, at most.
const SAMPLES: usize = 2000;
/// Cosine of the angle between the smoothed normals of a patch and its first one, at least: 40°.
const TURN: f64 = 0.766;
/// Of the variance of a patch's height, a sine explains as much at least.
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
        let found = if patch.len() < LEAST { None } else { wave(mesh, patch) };
        Ok(found.filter(|hint| hint.share >= SHARE && hint.height > rounding && hint.height < STEEPEST * hint.pitch))
    };
    let hints: Vec<Option<Hint>> = patches.par_iter().map(ask).collect::<Result<_, Error>>()?;
    Ok(places(mesh, (&patches, &numbers, &hints), &neighbours))
}

/// The strongest wave of a patch.
fn wave(mesh: Mesh<'_>, patch: &[u32]) -> Option<Hint> {
    let faces = || patch.iter().filter_map(|face| mesh.faces.get(*face as usize));
    let normal = faces().map(|face| mesh.corners(face)).fold([0.0; 3], |sum, [a, b, c]| add(sum, cross(sub(b, a), sub(c, a))));
    let axes = axes(plain_unit(normal)?)?;
    let mut vertices: Vec<u32> = faces().flatten().copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    let place = |vertex: &u32| mesh.points.get(*vertex as usize).map_or([0.0; 3], |point| point.map(f64::from));
    let middle = scale(vertices.iter().map(place).fold([0.0; 3], add), 1.0 / vertices.len() as f64);
    let flat = |vertex: &u32| axes.map(|axis| dot(sub(place(vertex), middle), axis));
    let mut list: Vec<Point> = vertices.iter().map(flat).collect();
    let size = size(&list);
    flatten(&mut list, size)?;
    let local = |vertex: &u32| vertices.binary_search(vertex).unwrap_or_default() as u32;
    roughen(&mut list, &around(vertices.len(), faces().map(|face| [0, 1, 2].map(|k: usize| local(&face[k])))));
    let stride = list.len().div_ceil(SAMPLES).max(1);
    let mut list: Vec<Point> = list.into_iter().step_by(stride).collect();
    level(&mut list)?;
    let (edge, [shortest, longest]) = ((0.5 * plain_norm(normal) / vertices.len() as f64).sqrt(), EDGES);
    let hint = search(&list, axes, [shortest * edge, (longest * edge).min(2.0 * size / WAVES)])?;
    let height = folded(&list, axes, &hint)?;
    Some(Hint { height, ..hint })
}

/// Takes the smoothed height away from each height, twice over.
fn roughen(list: &mut [Point], around: &Around) {
    for _ in 0..2 {
        let mut form: Vec<f64> = list.iter().map(|[_, _, z]| *z).collect();
        for _ in 0..PASSES {
            let mean = |(vertex, own): (usize, &f64)| {
                let others = around.of(vertex);
                let sum: f64 = others.iter().filter_map(|other| form.get(*other as usize)).sum();
                if others.is_empty() { *own } else { 0.5 * (own + sum / others.len() as f64) }
            };
            form = form.iter().enumerate().map(mean).collect();
        }
        list.iter_mut().zip(&form).for_each(|([_, _, z], form)| *z -= form);
    }
}

/// Takes the mean from heights, and drops those that stand out, as a sharp edge does; none if these are many.
fn level(list: &mut Vec<Point>) -> Option<()> {
    let median = |list: &[Point], of: &dyn Fn(f64) -> f64| {
        let mut values: Vec<f64> = list.iter().map(|[_, _, z]| of(*z)).collect();
        values.sort_unstable_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    let middle = median(list, &|z| z)?;
    let most = OUTLIER * median(list, &|z| (z - middle).abs())?;
    let all = list.len();
    list.retain(|[_, _, z]| (z - middle).abs() <= most);
    let mean = list.iter().map(|[_, _, z]| z).sum::<f64>() / list.len().max(1) as f64;
    list.iter_mut().for_each(|[_, _, z]| *z -= mean);
    (4 * list.len() >= 3 * all).then_some(())
}

/// The height of the mean wave: all waves laid upon each other, the medians of parts of the wave. None if places lie on less than half of its parts, or on few waves, so
/// that a wave between them is not seen but guessed; a grid that fits the wave lies on four parts or more.
fn folded(list: &[Point], axes: [Point; 3], hint: &Hint) -> Option<f64> {
    let [across, along] = [0, 1].map(|axis| dot(hint.across, axes[axis]));
    let place = |[x, y, _]: &Point| (x * across + y * along) / hint.pitch;
    let (low, high) = list.iter().map(place).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    let mut parts = vec![Vec::new(); FOLDS];
    for point in list {
        let part = ((place(point) - low).fract() * FOLDS as f64) as usize;
        parts.get_mut(part)?.push(point[2]);
    }
    let least = (list.len() / FOLDS / 4).max(1);
    parts.retain(|part| part.len() >= least);
    if high - low < WAVES || 2 * parts.len() < FOLDS {
        return None;
    }
    let mut heights: Vec<f64> = Vec::with_capacity(FOLDS);
    for mut part in parts {
        part.sort_unstable_by(f64::total_cmp);
        heights.push(*part.get(part.len() / 2)?);
    }
    let (least, most) = heights.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), z| (least.min(*z), most.max(*z)));
    Some(most - least)
}

/// The neighbours of each vertex, once for each triangle that they share with it.
struct Around {
    starts: Vec<u32>,
    lists: Vec<u32>,
}

impl Around {
    fn of(&self, vertex: usize) -> &[u32] {
        let ends = self.starts.get(vertex).zip(self.starts.get(vertex + 1));
        ends.and_then(|(start, end)| self.lists.get(*start as usize..*end as usize)).unwrap_or_default()
    }
}

/// By counting: O(triangles).
fn around(points: usize, faces: impl Iterator<Item = [u32; 3]> + Clone) -> Around {
    let sides = || faces.clone().flat_map(|[a, b, c]| [(a, b), (b, c), (c, a), (b, a), (c, b), (a, c)]);
    let mut starts = vec![0u32; points + 1];
    sides().for_each(|(from, _)| starts[from as usize + 1] += 1);
    for vertex in 0..points {
        starts[vertex + 1] += starts[vertex];
    }
    let (mut next, mut lists) = (starts.clone(), vec![0; sides().count()]);
    for (from, to) in sides() {
        lists[next[from as usize] as usize] = to;
        next[from as usize] += 1;
    }
    Around { starts, lists }
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

/// Several patches as one: means by their triangles, and of the largest one the direction.
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

#[cfg(test)]
mod tests {
    use super::super::options::Corrections;
    use super::*;

    /// A grid of 120 by 120 cells, a quarter of a millimetre wide, at these heights.
    fn sheet(height: impl Fn(f64, f64) -> f64) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let count = 120u32;
        let place = |i: u32, j: u32| {
            let (x, y) = (f64::from(i) * 0.25, f64::from(j) * 0.25);
            [x, y, height(x, y)].map(|x| x as f32)
        };
        let points = (0..=count).flat_map(|j| (0..=count).map(move |i| (i, j))).map(|(i, j)| place(i, j)).collect();
        let at = |i: u32, j: u32| j * (count + 1) + i;
        let cells = (0..count).flat_map(|j| (0..count).map(move |i| (i, j)));
        let pair = |(i, j): (u32, u32)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
        (points, cells.flat_map(pair).collect())
    }

    /// Scallops of a ball of radius 3, a step of 1.5 apart, along X.
    fn scallop(x: f64) -> f64 {
        let off = x - (x / 1.5).round() * 1.5;
        3.0 - (9.0 - off * off).sqrt()
    }

    fn found(height: impl Fn(f64, f64) -> f64, options: &Options<'_>) -> Vec<Suspect> {
        let (points, faces) = sheet(height);
        suspects(Mesh { points: &points, faces: &faces }, options).expect("a mesh")
    }

    /// Half of a hilly sheet has scallops: one place is told, which is that half, with their pitch and direction.
    #[test]
    fn half_a_sheet_is_one_place() {
        let form = |x: f64, y: f64| (x / 6.0).sin() + (y / 5.0).cos();
        let all = found(|x, y| form(x, y) + if y < 15.0 { scallop(x) } else { 0.0 }, &Options::default());
        let [one] = &all[..] else { panic!("{all:?}") };
        let height = 3.0 - (9.0f64 - 0.5625).sqrt();
        assert!((one.pitch - 1.5).abs() < 0.03 && (0.8..1.1).contains(&(one.height / height)), "{} {}", one.pitch, one.height);
        assert!(one.across[1].abs() < 0.1 && one.confidence > 0.6, "{:?} {}", one.across, one.confidence);
        assert!(one.triangles.len() > 5000 && one.within[1][1] < 16.0, "{} {:?}", one.triangles.len(), one.within);
        assert!(found(form, &Options::default()).is_empty());
    }

    /// Steps of a wall by a flat tool, at 45°, are waves as well; noise is none, and a sharp edge is none.
    #[test]
    fn steps_are_waves_and_edges_are_none() {
        let steps = found(|x, _| (x / 1.5).floor() * 1.5, &Options::default());
        assert!(!steps.is_empty() && steps.iter().all(|one| (one.pitch - 1.5 * 2f64.sqrt()).abs() < 0.1), "{steps:?}");
        assert!(found(|x, _| (x - 15.0).abs(), &Options::default()).is_empty());
        assert!(found(|x, y| 0.01 * ((x * 91.7 + y * 57.3).sin() * 43758.5).fract(), &Options::default()).is_empty());
    }

    /// Nobody looks where the corrections forbid it.
    #[test]
    fn excluded_places_are_not_looked_at() {
        let exclude = [[[-1.0; 3], [31.0; 3]]];
        let corrections = Corrections { exclude: &exclude, ..Corrections::default() };
        assert!(found(|x, _| scallop(x), &Options { corrections, ..Options::default() }).is_empty());
        assert_eq!(found(|x, _| scallop(x), &Options::default()).len(), 1);
    }
}
