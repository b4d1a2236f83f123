//! What stays of the pieces, in f32.

use std::collections::{BTreeSet, HashMap};

use glam::DVec3;

use super::super::work::Work;
use super::super::{collinear, duplicates};
use super::cut::Cut;
use super::sides::Sides;
use super::{Failure, State, Stuck, Tried, vertices};
use crate::chunk::NONE;
use crate::defects;
use crate::shop::{Shop, Vertex, bits};

/// What becomes of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    Stays,
    Turns,
    Goes,
    /// Nobody knows.
    Unknown,
}

fn fate(front: Option<i32>, back: Option<i32>) -> Fate {
    match (front, back) {
        (Some(front), Some(back)) => match (front > 0, back > 0) {
            (false, true) => Fate::Stays,
            (true, false) => Fate::Turns,
            _ => Fate::Goes,
        },
        _ => Fate::Unknown,
    }
}

impl State<'_, '_, '_> {
    /// Makes of the workshop what the windings say. Returns how far new vertices were moved.
    pub(super) fn apply(&mut self, cut: &Cut, sides: &Sides, windings: &[Option<i32>]) -> Tried<f64> {
        let of = |[front, back]: [u32; 2]| fate(windings[front as usize], windings[back as usize]);
        let fates: Vec<Fate> = cut.arrangement.pieces.iter().map(|piece| of(piece.cells)).collect();
        let unknown = cut.arrangement.pieces.iter().zip(&fates).filter(|(_, fate)| **fate == Fate::Unknown);
        let triangles: Vec<u32> = unknown.map(|(piece, _)| cut.sources[piece.source as usize]).collect();
        if !triangles.is_empty() {
            return Err(Stuck { failure: Failure::Contradiction, triangles }.into());
        }
        let (work, reversed) = (&mut *self.work, &mut *self.reversed);
        for p in (0..sides.patches).filter(|p| self.clusters.holds_patch(*p)) {
            match of(sides.of_patch(p)) {
                Fate::Goes => reversed.dropped[p as usize] = true,
                Fate::Turns => reversed.patches[p as usize] ^= true,
                Fate::Stays | Fate::Unknown => {}
            }
        }
        let living: Vec<u32> = work.living().filter(|t| cut.sources.binary_search(t).is_err()).collect();
        for t in living {
            match of(sides.of_triangle(t)) {
                Fate::Goes => work.kill(t),
                Fate::Turns => work.turn(t),
                Fate::Stays | Fate::Unknown => {}
            }
        }
        let whole = whole_sources(work, cut, &fates);
        let mut new = Vec::new();
        for (s, (t, whole)) in cut.sources.iter().zip(whole).enumerate() {
            match whole {
                Some(Fate::Stays | Fate::Unknown) => {}
                Some(Fate::Turns) => work.turn(*t),
                Some(Fate::Goes) => work.kill(*t),
                None => {
                    work.kill(*t);
                    for (piece, fate) in cut.pieces(s).iter().zip(&fates[cut.range(s)]) {
                        let [a, b, c] = piece.v;
                        match fate {
                            Fate::Stays => new.push((*t, [a, b, c])),
                            Fate::Turns => new.push((*t, [a, c, b])),
                            Fate::Goes | Fate::Unknown => {}
                        }
                    }
                }
            }
        }
        Ok(self.put_in(cut, &new))
    }

    /// Puts pieces of triangles into the workshop, their points rounded to f32, and takes out what comes to nothing by that. Returns how far
    /// a point was moved.
    fn put_in(&mut self, cut: &Cut, new: &[(u32, [u32; 3])]) -> f64 {
        let mut displaced = 0f64;
        let points: BTreeSet<u32> = new.iter().flat_map(|(_, v)| *v).filter(|point| !cut.vertices.contains_key(point)).collect();
        let cut_from: HashMap<u32, u32> = new.iter().flat_map(|(t, v)| v.map(|point| (point, *t))).collect();
        let step = self.step;
        let rounded = |point: u32| cut.arrangement.points[point as usize].map(|x| place_of(x, step));
        // There may be a vertex already, here or elsewhere in the file.
        self.complete(points.iter().map(|point| rounded(*point)).collect());
        let mut known = vertices(self.work);
        let mut vertex_of: HashMap<u32, Vertex> = cut.vertices.clone();
        for point in points {
            let position = rounded(point);
            let exact = DVec3::from_array(cut.arrangement.points[point as usize]);
            let by = exact.distance(DVec3::from_array(position.map(f64::from)));
            displaced = displaced.max(by);
            self.track.moved(&self.clusters, cut_from[&point], by);
            let v = *known.entry(bits(position)).or_insert_with(|| self.work.add_vertex(position));
            vertex_of.insert(point, v);
        }
        let first = self.work.triangles.len() as u32;
        for (t, points) in new {
            let v = points.map(|point| vertex_of[&point]);
            let origin = self.work.triangles[*t as usize].origin.of_part();
            if v[0] != v[1] && v[1] != v[2] && v[2] != v[0] {
                self.work.add(v, origin, NONE);
                self.clusters.of_triangle.push(self.clusters.of_triangle[*t as usize]);
            }
        }
        let added: Vec<u32> = (first..self.work.triangles.len() as u32).collect();
        self.clean(&added);
        displaced
    }

    /// Takes out what came to nothing: these triangles have new vertices.
    pub(super) fn clean(&mut self, changed: &[u32]) {
        duplicates::drop_repeated(self.work);
        cancel(self.work, changed);
        let first = self.work.triangles.len() as u32;
        collinear::remove(self.work);
        duplicates::drop_repeated(self.work);
        let split: Vec<u32> = (first..self.work.triangles.len() as u32).collect();
        cancel(self.work, &split);
        self.follow();
    }
}

/// A coordinate in f32: what it is, if it has a place there, as in a plane along the axes, else the nearest on the grid.
fn place_of(x: f64, step: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) == x { nearest + 0.0 } else { on_grid(x, step) }
}

/// The nearest multiple of a power of two, which is not too small for f32 to have them.
fn on_grid(x: f64, step: f64) -> f32 {
    ((x / step).round() * step) as f32 + 0.0
}

/// What becomes of each source that need not be cut: all of it alike, nothing else that stays has an edge in its middle, as a body that stands on it
/// with an edge, and nobody cut otherwise ends at a point in its middle or on its edges.
fn whole_sources(shop: &Shop, cut: &Cut, fates: &[Fate]) -> Vec<Option<Fate>> {
    let count = cut.sources.len();
    let range = |s: usize| cut.range(s);
    let corners = |s: usize| shop.triangles[cut.sources[s] as usize].v;
    let is_corner = |s: usize, point: &u32| cut.vertices.get(point).is_some_and(|v| corners(s).contains(v));
    let mut whole: Vec<Option<Fate>> = (0..count)
        .map(|s| {
            let fates = &fates[range(s)];
            let Some(first) = fates.first() else { return Some(Fate::Goes) };
            if fates.contains(&Fate::Unknown) {
                return Some(Fate::Unknown);
            }
            if !fates.iter().all(|f| f == first) {
                return None;
            }
            if *first == Fate::Goes {
                return Some(Fate::Goes);
            }
            (!cut.arrangement.covered[s]).then_some(*first)
        })
        .collect();
    let edge = |v: [u32; 3], k: usize| (v[k].min(v[(k + 1) % 3]), v[k].max(v[(k + 1) % 3]));
    let mut staying: Vec<((u32, u32), u32)> = Vec::new();
    for s in 0..count {
        for (piece, _) in cut.pieces(s).iter().zip(&fates[range(s)]).filter(|(_, f)| **f != Fate::Goes) {
            staying.extend((0..3).map(|k| (edge(piece.v, k), s as u32)));
        }
    }
    staying.sort_unstable();
    for around in staying.chunk_by(|a, b| a.0 == b.0).filter(|around| around.len() > 2) {
        // In the middle of a source, two of its pieces have the edge.
        for own in around.chunk_by(|a, b| a.1 == b.1).filter(|own| own.len() == 2) {
            whole[own[0].1 as usize] = None;
        }
    }
    // Sources with a piece at each point that is not theirs alone.
    let mut at: HashMap<u32, Vec<u32>> = HashMap::new();
    for s in 0..count {
        for piece in cut.pieces(s).iter().zip(&fates[range(s)]).filter(|(_, f)| **f != Fate::Goes).map(|(p, _)| p) {
            for point in piece.v {
                let sources = at.entry(point).or_default();
                if sources.last() != Some(&(s as u32)) {
                    sources.push(s as u32);
                }
            }
        }
    }
    loop {
        let mut changed = false;
        for s in 0..count {
            if !matches!(whole[s], Some(Fate::Stays | Fate::Turns)) || cut.pieces(s).len() == 1 {
                continue;
            }
            let needed = |point: &u32| {
                !is_corner(s, point)
                    && at[point].iter().any(|o| {
                        let o = *o as usize;
                        is_corner(o, point) || !matches!(whole[o], Some(Fate::Stays | Fate::Turns))
                    })
            };
            if cut.pieces(s).iter().flat_map(|piece| &piece.v).any(needed) {
                whole[s] = None;
                changed = true;
            }
        }
        if !changed {
            return whole;
        }
    }
}

/// Takes out triangles on the same three vertices that run against each other, two by two, and all but one of those that do not.
fn cancel(work: &mut Work<'_>, added: &[u32]) {
    for t in added {
        if !work.lives(*t) {
            continue;
        }
        let v = work.triangles[*t as usize].v;
        let mut same: Vec<(u32, bool)> = work
            .star(v[0])
            .map(|(o, _)| o)
            .filter(|o| work.triangles[*o as usize].v.iter().all(|w| v.contains(w)))
            .map(|o| (o, defects::same_direction(v, work.triangles[o as usize].v)))
            .collect();
        same.sort_unstable();
        let with = same.iter().filter(|(_, with)| *with).count();
        let against = same.len() - with;
        // Of those in the majority, the first ones stay.
        let (majority, stay) = (with > against, with.abs_diff(against));
        let mut left = stay;
        for (o, with) in same {
            if with == majority && left > 0 {
                left -= 1;
            } else {
                work.kill(o);
            }
        }
    }
}
