//! Creases that run into a hole, and their way through it.
//!
//! Curvature does not go across a crease. One that ends at the rim and faces another such end is carried on to that along a cubic curve, with
//! vertices that stay where they are; the patch's two sides are then made smooth each for itself. Anything else that ends at the rim
//! is not guessed at.

use glam::DVec3;

use super::coarse::{CoarsePatch, Unshaped};
use super::sheet::{Sheet, edges, sorted};
use crate::algorithms::triangulate::{FillSettings, Rim, triangulate};
use crate::geometry::exact::Point;
use crate::util::ids::NONE;

/// Below this cosine between normals, about 40°, an edge is a crease.
const CREASE: f64 = 0.766;
/// And below this, 60°, a coarse patch does not continue what is across the rim.
pub(super) const TURN: f64 = 0.5;
/// A crease that bends less than [`TURN`] is a line only if it goes on within this cosine, 45°, beyond its first edge: rough surfaces have
/// single edges as sharp.
const ON: f64 = 0.7;
/// Two ends face each other when both point along the line between them within this cosine, 45°.
const FACING: f64 = 0.7;

/// What is sharp.
pub(super) struct Creases {
    /// For each vertex: does curvature not go across it?
    pub(super) sharp: Vec<bool>,
    /// The rim's two vertices between which a crease goes on, with the directions in which it comes in.
    pub(super) through: Option<[(u32, DVec3); 2]>,
}

/// Finds edges that are sharp. `Err` where the patch would not continue what is around, or creases end at the rim that cannot be carried on.
pub(super) fn find(sheet: &Sheet<'_>) -> Result<Creases, Unshaped> {
    let mut sharp = vec![false; sheet.fixed];
    let all: Vec<[u32; 3]> = sheet.all().collect();
    let patch = sheet.triangles.len();
    let mut sides: Vec<([u32; 2], usize)> = Vec::with_capacity(3 * all.len());
    for (i, t) in all.iter().enumerate() {
        sides.extend(edges(*t).map(|e| (sorted(e), i)));
    }
    sides.sort_unstable();
    let normals: Vec<DVec3> = all.iter().map(|t| sheet.normal(*t).normalize_or_zero()).collect();
    let (mut turn, mut length) = (0.0, 0.0);
    // Creases in both directions, by their ends, and whether they are sharp enough to count for themselves.
    let mut lines: Vec<([u32; 2], bool)> = Vec::new();
    for same in sides.chunk_by(|a, b| a.0 == b.0) {
        let [(edge, i), (_, j)] = *same else { continue };
        let cosine = normals[i].dot(normals[j]);
        let [a, b] = edge.map(|v| sheet.points[v as usize]);
        let known = normals[i] != DVec3::ZERO && normals[j] != DVec3::ZERO;
        match (i < patch, j < patch) {
            // The coarse patch bends as it has to.
            (true, true) => {}
            (false, false) => {
                if known && cosine < CREASE {
                    let [v, w] = edge;
                    lines.extend([([v, w], cosine < TURN), ([w, v], cosine < TURN)]);
                    (sharp[v as usize], sharp[w as usize]) = (true, true);
                }
            }
            _ => {
                turn += cosine * a.distance(b);
                length += a.distance(b);
                if cosine < TURN {
                    for v in edge {
                        sharp[v as usize] = true;
                    }
                }
            }
        }
    }
    if turn < TURN * length {
        return Err(Unshaped::RimIsEdge);
    }
    lines.sort_unstable();
    Ok(Creases { sharp, through: through(sheet, &lines)? })
}

/// Where a crease goes through the patch. `lines`: sharp edges in both directions, ascending, and whether they count for themselves.
fn through(sheet: &Sheet<'_>, lines: &[([u32; 2], bool)]) -> Result<Option<[(u32, DVec3); 2]>, Unshaped> {
    let way = |[v, w]: [u32; 2]| (sheet.points[w as usize] - sheet.points[v as usize]).normalize_or_zero();
    let goes_on = |[v, w]: [u32; 2]| {
        let from = lines.partition_point(|(line, _)| line[0] < w);
        lines[from..]
            .iter()
            .take_while(|(line, _)| line[0] == w)
            .any(|(line, _)| line[1] != v && way(*line).dot(way([v, w])) > ON)
    };
    let ends: Vec<(u32, DVec3)> = lines
        .iter()
        .filter(|(line, strong)| sheet.on_rim[line[0] as usize] && (*strong || goes_on(*line)))
        .map(|([v, w], _)| (*v, way([*w, *v])))
        .collect();
    match *ends {
        [] => Ok(None),
        [a, b] if a.0 != b.0 => {
            let along = (sheet.points[b.0 as usize] - sheet.points[a.0 as usize]).normalize_or_zero();
            if a.1.dot(along) < FACING || -b.1.dot(along) < FACING {
                return Err(Unshaped::Creased);
            }
            Ok(Some([a, b]))
        }
        _ => Err(Unshaped::Creased),
    }
}

/// A coarse patch with an edge between two vertices of the rim: the given one, or, if it is a disc, one made anew of its two parts.
pub(super) fn with_edge(coarse: &CoarsePatch<'_>, sheet: &Sheet<'_>, [a, b]: [u32; 2]) -> Option<Vec<[u32; 3]>> {
    let has_edge = |triangles: &[[u32; 3]]| triangles.iter().flat_map(|t| edges(*t)).any(|e| sorted(e) == sorted([a, b]));
    if has_edge(coarse.patch) {
        return Some(coarse.patch.to_vec());
    }
    if has_edge(coarse.around) {
        return None;
    }
    let rim = sheet.rim()?;
    let (i, j) = (rim.iter().position(|&v| v == a)?, rim.iter().position(|&v| v == b)?);
    let turned = |from: usize, to: usize| -> Vec<u32> {
        let count = (to + rim.len() - from) % rim.len();
        (0..=count).map(|k| rim[(from + k) % rim.len()]).collect()
    };
    let mut patch = Vec::new();
    for part in [turned(i, j), turned(j, i)] {
        let points: Vec<Point> = part.iter().map(|&v| coarse.positions[v as usize]).collect();
        let apexes: Vec<Option<Point>> = (0..part.len() - 1)
            .map(|k| {
                let beyond = coarse.around.iter().find(|t| edges(**t).contains(&[part[k + 1], part[k]]))?;
                let apex = beyond.iter().find(|&&v| v != part[k] && v != part[k + 1])?;
                Some(coarse.positions[*apex as usize])
            })
            .collect();
        let forbidden = |x: u32, y: u32| sheet.is_taken(part[x as usize], part[y as usize]);
        let made = triangulate(
            &Rim { points: &points, apexes: &apexes, obstacles: &[], forbidden: &forbidden },
            &FillSettings::default(),
        )
        .ok()?;
        patch.extend(made.triangles.iter().map(|t| t.map(|v| part[v as usize])));
    }
    Some(patch)
}

/// Divides the edge between the two ends along a cubic curve that goes on in their directions. Its vertices are held.
pub(super) fn carry_on(sheet: &mut Sheet<'_>, [(a, from), (b, to)]: [(u32, DVec3); 2]) -> bool {
    let (start, end) = (sheet.points[a as usize], sheet.points[b as usize]);
    let length = start.distance(end);
    let scale = 0.5 * (sheet.scale[a as usize] + sheet.scale[b as usize]);
    let parts = (length / scale).round().clamp(1.0, 1000.0) as u32;
    let mut last = a;
    for k in 1..parts {
        let t = f64::from(k) / f64::from(parts);
        let s = 1.0 - t;
        // Bézier's points are a third of the length along the directions.
        let (p, q) = (start + from * (length / 3.0), end + to * (length / 3.0));
        let point = start * (s * s * s) + p * (3.0 * s * s * t) + q * (3.0 * s * t * t) + end * (t * t * t);
        let Some((i, side)) = sheet.find_edge([last, b]) else { return false };
        let v = sheet.add_point(point, scale);
        if !sheet.split_edge(i, side, v) {
            return false;
        }
        sheet.creases.push(sorted([last, v]));
        last = v;
    }
    sheet.creases.push(sorted([last, b]));
    sheet.creases.sort_unstable();
    sheet.held = sheet.points.len();
    true
}

impl Sheet<'_> {
    /// The rim in the patch's direction, if it is one loop.
    fn rim(&self) -> Option<Vec<u32>> {
        let mut next: Vec<[u32; 2]> = Vec::new();
        for (t, across) in self.triangles.iter().zip(self.across()) {
            next.extend(edges(*t).iter().zip(across).filter(|(_, there)| **there == NONE).map(|(e, _)| *e));
        }
        next.sort_unstable();
        let mut loop_ = vec![next.first()?[0]];
        while loop_.len() <= next.len() {
            let at = next.binary_search_by_key(loop_.last()?, |e| e[0]).ok()?;
            if next[at][1] == loop_[0] {
                break;
            }
            loop_.push(next[at][1]);
        }
        (loop_.len() == next.len()).then_some(loop_)
    }

    fn find_edge(&self, edge: [u32; 2]) -> Option<(usize, usize)> {
        let at = |(i, t): (usize, &[u32; 3])| edges(*t).iter().position(|e| *e == edge).map(|k| (i, k));
        self.triangles.iter().enumerate().find_map(at)
    }
}
