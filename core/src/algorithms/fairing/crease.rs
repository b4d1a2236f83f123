//! Creases that run into a hole, and their way through it.
//!
//! Curvature does not go across a crease. One that ends at the rim and faces another such end is carried on to that along a cubic curve, with
//! vertices that stay where they are; the patch's parts beside are then made smooth each for itself. There may be several, none across
//! another. Anything else that ends at the rim is not guessed at.

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
/// Two ends face each other when both point along the line between them within this cosine, 53°: those of a quarter of a circle do.
const FACING: f64 = 0.6;

/// Creases that end at the rim, at most: every two of them may be one.
const MOST_ENDS: usize = 12;

/// Where a crease ends at the rim: the vertex, and the direction in which it comes in.
type End = (u32, DVec3);

/// Sharp edges and corners.
pub(super) struct Creases {
    /// For each vertex: does curvature not go across it?
    pub(super) sharp: Vec<bool>,
    /// The creases that go on through the patch, each between two vertices of the rim.
    pub(super) through: Vec<[End; 2]>,
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

/// Where creases go through the patch. `lines`: sharp edges in both directions, ascending, and whether they count for themselves.
fn through(sheet: &Sheet<'_>, lines: &[([u32; 2], bool)]) -> Result<Vec<[End; 2]>, Unshaped> {
    let way = |[v, w]: [u32; 2]| (sheet.points[w as usize] - sheet.points[v as usize]).normalize_or_zero();
    // The line that goes on straightest beyond a line's second end.
    let onward = |[v, w]: [u32; 2]| {
        let from = lines.partition_point(|(line, _)| line[0] < w);
        let on = lines[from..].iter().map(|(line, _)| *line).take_while(|line| line[0] == w).filter(|line| line[1] != v);
        let straight = on.map(|line| (way(line).dot(way([v, w])), line)).filter(|(cosine, _)| *cosine > ON);
        straight.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, line)| line)
    };
    let ends: Vec<End> = lines
        .iter()
        .filter(|(line, strong)| sheet.on_rim[line[0] as usize] && (*strong || onward(*line).is_some()))
        .map(|(line, _)| {
            let [v, w] = *line;
            // At a vertex of a polyline the curve turns half of what it turns from edge to edge.
            let before = onward(*line).map_or(way([w, v]), |[w, x]| way([x, w]));
            (v, (1.5 * way([w, v]) - 0.5 * before).normalize_or_zero())
        })
        .collect();
    // Where several end in one vertex is a corner, at which another one may begin.
    let (mut single, mut corners) = (Vec::new(), Vec::new());
    for same in ends.chunk_by(|a, b| a.0 == b.0) {
        match same {
            [end] => single.push(*end),
            [(v, _), ..] => corners.push(*v),
            [] => {}
        }
    }
    if single.is_empty() && !corners.is_empty() || ends.len() > MOST_ENDS {
        return Err(Unshaped::Creased);
    }
    matched(sheet, &single, &corners).ok_or(Unshaped::Creased)
}

/// The ends by twos that face each other, or each with a corner that it faces, best first; `None` if one is left over.
fn matched(sheet: &Sheet<'_>, ends: &[End], corners: &[u32]) -> Option<Vec<[End; 2]>> {
    let along = |from: u32, to: u32| (sheet.points[to as usize] - sheet.points[from as usize]).normalize_or_zero();
    let mut pairs: Vec<(f64, [usize; 2], [End; 2])> = Vec::new();
    for (i, a) in ends.iter().enumerate() {
        for (j, b) in ends.iter().enumerate().skip(i + 1) {
            let along = along(a.0, b.0);
            let [from, to] = [a.1.dot(along), -b.1.dot(along)];
            if from >= FACING && to >= FACING {
                pairs.push((from + to, [i, j], [*a, *b]));
            }
        }
        for (j, corner) in (ends.len()..).zip(corners) {
            let along = along(a.0, *corner);
            let from = a.1.dot(along);
            if from >= FACING {
                // It arrives as it set out, mirrored: on an arc of a circle.
                pairs.push((from + FACING, [i, j], [*a, (*corner, a.1 - 2.0 * from * along)]));
            }
        }
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut free = vec![true; ends.len() + corners.len()];
    let mut all = Vec::new();
    for (_, [i, j], pair) in pairs {
        if free[i] && free[j] {
            (free[i], free[j]) = (false, false);
            all.push(pair);
        }
    }
    free[..ends.len()].iter().all(|free| !free).then_some(all)
}

/// A coarse patch with an edge between every two of these vertices of the rim: the given one, or, if it is a disc, one made anew of its parts.
pub(super) fn with_edges(coarse: &CoarsePatch<'_>, sheet: &Sheet<'_>, creases: &[[End; 2]]) -> Option<Vec<[u32; 3]>> {
    let wanted: Vec<[u32; 2]> = creases.iter().map(|ends| sorted(ends.map(|end| end.0))).collect();
    let missing = |triangles: &[[u32; 3]]| {
        let mut there: Vec<[u32; 2]> = triangles.iter().flat_map(|t| edges(*t)).map(sorted).collect();
        there.sort_unstable();
        wanted.iter().filter(|edge| there.binary_search(edge).is_err()).count()
    };
    if missing(coarse.patch) == 0 {
        return Some(coarse.patch.to_vec());
    }
    if missing(coarse.around) < wanted.len() {
        return None;
    }
    let mut parts = vec![sheet.rim()?];
    for [a, b] in wanted {
        // Creases that cross would have no part with both ends.
        let (at, i, j) = parts
            .iter()
            .enumerate()
            .find_map(|(at, part)| Some((at, part.iter().position(|v| *v == a)?, part.iter().position(|v| *v == b)?)))?;
        let part = parts.swap_remove(at);
        for (from, to) in [(i, j), (j, i)] {
            let count = (to + part.len() - from) % part.len();
            parts.push((0..=count).map(|k| part[(from + k) % part.len()]).collect());
        }
    }
    let mut patch = Vec::new();
    for part in &parts {
        patch.extend(triangulated(coarse, sheet, part)?);
    }
    Some(patch)
}

/// A part of a patch, made anew.
fn triangulated(coarse: &CoarsePatch<'_>, sheet: &Sheet<'_>, part: &[u32]) -> Option<Vec<[u32; 3]>> {
    let points: Vec<Point> = part.iter().map(|&v| coarse.positions[v as usize]).collect();
    let apexes: Vec<Option<Point>> = (0..part.len())
        .map(|k| {
            let next = part[(k + 1) % part.len()];
            let beyond = coarse.around.iter().find(|t| edges(**t).contains(&[next, part[k]]))?;
            let apex = beyond.iter().find(|&&v| v != part[k] && v != next)?;
            Some(coarse.positions[*apex as usize])
        })
        .collect();
    let forbidden = |x: u32, y: u32| sheet.is_taken(part[x as usize], part[y as usize]);
    let made =
        triangulate(&Rim { points: &points, apexes: &apexes, obstacles: &[], forbidden: &forbidden }, &FillSettings::default())
            .ok()?;
    Some(made.triangles.iter().map(|t| t.map(|v| part[v as usize])).collect())
}

/// Divides the edge between the two ends along a cubic curve that goes on in their directions. Its vertices are held.
pub(super) fn carry_on(sheet: &mut Sheet<'_>, [(a, from), (b, to)]: [End; 2]) -> bool {
    let (start, end) = (sheet.points[a as usize], sheet.points[b as usize]);
    let length = start.distance(end);
    let scale = 0.5 * (sheet.scale[a as usize] + sheet.scale[b as usize]);
    let chord = (end - start) / length.max(f64::MIN_POSITIVE);
    // Bézier's points: on a straight line a third of the length along it; such that the curve is nearly an arc where it was one.
    let reach = |way: DVec3, chord: DVec3| length * 2.0 / 3.0 / (1.0 + way.dot(chord).max(0.0));
    let parts = (length / scale).round().clamp(1.0, 1000.0) as u32;
    let mut last = a;
    for k in 1..parts {
        let t = f64::from(k) / f64::from(parts);
        let s = 1.0 - t;
        let (p, q) = (start + from * reach(from, chord), end + to * reach(to, -chord));
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
