//! What keeps crossing is taken out, with what is around it, and the holes are closed.
//!
//! Slivers around a place where f32 has no room cross each other however they are cut. They are few, and small: a surface over the
//! loops around them, which has none of their vertices, is as near to them as they are wide (as in Attene, "A lightweight approach to repairing
//! digitized polygon meshes", The Visual Computer 26, 2010, but where it moves the surface by no more than a limit only). Every directed edge
//! stays balanced: a patch has the edges of the loop in the directions in which what it replaces had them.
//!
//! What does not leave fewer pairs that cross is taken back.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use crate::algorithms::triangulate::{self, Rim};
use crate::contract::report::RepairName;
use crate::contract::settings::Profile;
use crate::geometry::distance::nearest_of_triangle;
use crate::repairs::boolean::passes::Passes;
use crate::repairs::boolean::state::{Met, State, Tried};
use crate::submesh::{Origin, Submesh, Vertex};
use crate::util::ids::NONE;

/// Rings of triangles around those that cross that are taken out with them, at most.
const RINGS: usize = 3;

/// Triangles that are taken out and what comes in their place.
pub(crate) struct Refill {
    pub(crate) triangles: Vec<u32>,
    pub(crate) patches: Vec<[Vertex; 3]>,
    /// How far the surface was from its patches.
    pub(crate) moved: f64,
}

impl State<'_, '_, '_> {
    /// Takes out what crosses, with more and more rings around it, while there are fewer pairs after it, as often as
    /// [`Passes`] allows; nothing that moves the surface
    /// farther than a limit. Returns what crosses then, and how far anything was moved.
    pub(crate) fn refill(&mut self, mut met: Met, limit: f64, profile: &Profile) -> Tried<(Met, f64)> {
        let (mut displaced, mut rings, mut passes) = (0f64, 0, Passes::default());
        while !met.crossing.is_empty() && rings <= RINGS {
            let refills = self.refills(&met.crossing, rings, limit);
            if refills.is_empty() {
                rings += 1;
                continue;
            }
            self.work.mark();
            let first_new = self.work.triangles.len() as u32;
            let (mut farthest, mut refilled) = (0f64, Vec::new());
            for Refill { triangles, patches, moved } in refills {
                farthest = farthest.max(moved);
                let piece = self.clusters.of_triangle[triangles[0] as usize];
                refilled.extend(triangles.iter().map(|t| (*t, moved)));
                triangles.iter().for_each(|t| self.work.kill(*t));
                for v in patches {
                    self.work.add(v, Origin::Added(RepairName::SelfIntersection), NONE);
                    self.clusters.of_triangle.push(piece);
                }
            }
            let added: Vec<u32> = (first_new..self.work.triangles.len() as u32).collect();
            self.clean(&added);
            let now = self.met(met.crossing.clone(), profile, |t| t >= first_new)?;
            if now.crossing.len() < met.crossing.len() {
                displaced = displaced.max(farthest);
                refilled.iter().for_each(|(t, moved)| self.track.refilled(&self.clusters, *t, *moved));
                let goes_on = passes.may_go_on(met.crossing.len(), now.crossing.len());
                (met, rings) = (self.keep(now), 0);
                if !goes_on {
                    break;
                }
            } else {
                self.take_back();
                rings += 1;
            }
        }
        Ok((met, displaced))
    }

    /// The parts of surface around these pairs that can be replaced within the limit.
    fn refills(&mut self, pairs: &[[u32; 2]], rings: usize, limit: f64) -> Vec<Refill> {
        let mut region: BTreeSet<u32> = pairs.iter().flatten().copied().collect();
        self.complete(region.iter().flat_map(|t| self.work.points(*t)).collect());
        for _ in 0..rings {
            let corners: BTreeSet<Vertex> = region.iter().flat_map(|t| self.work.triangles[*t as usize].v).collect();
            let stars = corners.iter().flat_map(|v| self.work.star(*v)).map(|(t, _)| t);
            region.extend(stars.filter(|t| self.clusters.holds(*t)).collect::<Vec<_>>());
            self.complete(region.iter().flat_map(|t| self.work.points(*t)).collect());
        }
        let region: Vec<u32> = region.into_iter().collect();
        let parts = parts(self.work, &region);
        parts.into_iter().filter_map(|part| refill_of(self.work, part, &[], limit)).collect()
    }
}

/// Parts of a region that hang together in edges, each in ascending order.
fn parts(submesh: &Submesh, region: &[u32]) -> Vec<Vec<u32>> {
    let mut at_edge: BTreeMap<[Vertex; 2], u32> = BTreeMap::new();
    let mut parents: Vec<u32> = (0..region.len() as u32).collect();
    for (n, t) in (0..).zip(region) {
        for [a, b] in directed_edges(submesh.triangles[*t as usize].v) {
            let first = *at_edge.entry([a.min(b), a.max(b)]).or_insert(n);
            crate::util::union_find::unite(&mut parents, first, n);
        }
    }
    let mut parts: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (n, t) in (0..).zip(region) {
        parts.entry(crate::util::union_find::find(&mut parents, n)).or_default().push(*t);
    }
    parts.into_values().collect()
}

fn directed_edges([a, b, c]: [Vertex; 3]) -> [[Vertex; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// Patches over the loops around a part of the surface, if every point of it is near to one, or to one of the triangles that stay `beside` it.
/// O(triangles²).
pub(crate) fn refill_of(submesh: &Submesh, part: Vec<u32>, beside: &[u32], limit: f64) -> Option<Refill> {
    let mut patches = Vec::new();
    for rim in loops(part.iter().map(|t| submesh.triangles[*t as usize].v)) {
        let points: Vec<[f32; 3]> = rim.iter().map(|v| submesh.positions[*v as usize]).collect();
        let patch = triangulate::unchecked(&Rim { points: &points, apexes: &[], obstacles: &[], forbidden: &|_, _| false });
        // What is on one line comes to nothing, however it is divided.
        let fan = || (1..rim.len() as u32 - 1).map(|n| [0, n, n + 1]).collect();
        let triangles: Vec<[u32; 3]> = patch.map_or_else(fan, |patch| patch.triangles);
        patches.extend(triangles.into_iter().map(|t| t.map(|n| rim[n as usize])));
    }
    let stays = patches.iter().copied().chain(beside.iter().map(|t| submesh.triangles[*t as usize].v));
    let stays: Vec<[DVec3; 3]> = stays.map(|t| t.map(|v| submesh.place(v))).collect();
    let mut moved = 0f64;
    for t in &part {
        let [a, b, c] = submesh.triangles[*t as usize].v.map(|v| submesh.place(v));
        for p in [a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0] {
            let away = stays.iter().map(|t| nearest_of_triangle(t, p).distance(p)).fold(f64::INFINITY, f64::min);
            moved = moved.max(away);
            if moved > limit {
                return None;
            }
        }
    }
    Some(Refill { triangles: part, patches, moved })
}

/// The loops of directed edges that triangles have more often than their opposites; none passes a vertex twice.
fn loops(triangles: impl Iterator<Item = [Vertex; 3]>) -> Vec<Vec<Vertex>> {
    let mut balance: BTreeMap<[Vertex; 2], i32> = BTreeMap::new();
    for [a, b] in triangles.flat_map(directed_edges) {
        *balance.entry([a.min(b), a.max(b)]).or_insert(0) += if a < b { 1 } else { -1 };
    }
    let mut onward: BTreeMap<Vertex, Vec<Vertex>> = BTreeMap::new();
    for ([low, high], times) in balance {
        let [from, to] = if times > 0 { [low, high] } else { [high, low] };
        (0..times.unsigned_abs()).for_each(|_| onward.entry(from).or_default().push(to));
    }
    let mut loops = Vec::new();
    // As many edges come to a vertex as leave it, so that a walk ends where it was before.
    while let Some((start, _)) = onward.first_key_value() {
        let mut path = vec![*start];
        while let Some(v) = path.last().copied() {
            let Some(ways) = onward.get_mut(&v) else { break };
            let next = ways.pop();
            if ways.is_empty() {
                onward.remove(&v);
            }
            let Some(next) = next else { break };
            match path.iter().position(|w| *w == next) {
                Some(at) => {
                    loops.push(path.split_off(at));
                    if at == 0 {
                        break;
                    }
                    path.push(next);
                }
                None => path.push(next),
            }
        }
    }
    loops
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_that_touches_itself_is_two() {
        // Two triangles at a vertex, which run the same way.
        let found = loops([[0, 1, 2], [0, 3, 4]].into_iter());
        assert_eq!(found.len(), 2);
        assert!(found.iter().all(|l| l.len() == 3 && l.contains(&0)));
    }

    #[test]
    fn edges_inside_are_in_no_loop() {
        let fan = [[0, 1, 2], [0, 2, 3], [0, 3, 1]];
        let [rim] = &loops(fan.into_iter())[..] else { panic!("one loop") };
        assert_eq!((rim.len(), rim.contains(&0)), (3, false));
        // In the direction in which the triangles have its edges.
        let at = rim.iter().position(|v| *v == 1).unwrap();
        assert_eq!(rim[(at + 1) % 3], 2);
        // A closed surface has none.
        assert!(loops([[0, 1, 2], [0, 2, 3], [0, 3, 1], [3, 2, 1]].into_iter()).is_empty());
    }

    #[test]
    fn an_edge_that_two_triangles_use_alike_is_walked_twice() {
        let found = loops([[0, 1, 2], [0, 1, 3]].into_iter());
        assert_eq!(found.iter().map(Vec::len).sum::<usize>(), 6);
    }
}
