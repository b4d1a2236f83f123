//! What is nearly one is made one, where surfaces cross each other after rounding.
//!
//! Rounding turns slivers over, and surfaces that lie on each other but for a step of f32 pass through each other again and again; cutting them
//! makes more slivers, and narrower ones. So before they are cut again, features that are nearer to each other than a width become one: a triangle
//! with a short edge goes by merging its ends; one with a vertex close to its longest edge, by leading the neighbour there through that vertex; of
//! two triangles that cross, a vertex of the one that is close to the other becomes a vertex of that, and edges that pass each other closely
//! get one in common. What lies on each other then has the same triangles, which cancel. All of this leaves directed edges balanced. (After
//! the separation of features before rounding in Milenkovic & Sacks 2019, and vertex and edge snapping in snap rounding.)
//!
//! A pass that does not leave fewer pairs that cross is taken back.

use std::collections::BTreeSet;

use glam::DVec3;

use crate::contract::settings::Profile;
use crate::geometry::distance::{nearest_of_segment, nearest_of_segments, nearest_of_triangle};
use crate::geometry::position::Position;
use crate::repairs::boolean::passes::Passes;
use crate::repairs::boolean::state::{Met, State, Tried};
use crate::submesh::Vertex;
use crate::util::ids::NONE;

/// Changes of a pass.
#[derive(Default)]
struct Changed {
    /// Triangles that have other corners than before, or are new.
    triangles: BTreeSet<u32>,
    /// How far a surface was moved.
    farthest: f64,
    /// Triangles whose surface was made one with another one, and how far that was away: for the track, if the pass is kept.
    snapped: Vec<(u32, f64)>,
}

impl State<'_, '_, '_> {
    /// Passes while there are fewer pairs after each, as often as [`Passes`] allows. Returns what crosses then, and how far anything was moved.
    pub(crate) fn draw_near(&mut self, mut met: Met, width: f64, profile: &Profile) -> Tried<(Met, f64)> {
        let (mut displaced, mut imprints, mut passes) = (0f64, true, Passes::default());
        while !met.crossing.is_empty() {
            let region = self.around(&met.crossing);
            self.work.mark();
            let first_new = self.work.triangles.len() as u32;
            let mut changed = Changed::default();
            self.thin(&region, width, &mut changed);
            if imprints {
                self.imprint(&met.crossing, width, &mut changed);
            }
            let Changed { triangles, farthest, snapped } = changed;
            self.clean(&triangles.iter().copied().collect::<Vec<_>>());
            let mut is_changed = vec![false; first_new as usize];
            triangles.iter().filter(|t| **t < first_new).for_each(|t| is_changed[*t as usize] = true);
            let now = self.met(met.crossing.clone(), profile, |t| is_changed.get(t as usize) != Some(&false))?;
            tracing::debug!(imprints, pairs = now.crossing.len(), "Drawn near.");
            if now.crossing.len() < met.crossing.len() {
                displaced = displaced.max(farthest);
                snapped.iter().for_each(|(t, by)| self.track.snapped(&self.clusters, *t, *by));
                let goes_on = passes.may_go_on(met.crossing.len(), now.crossing.len());
                met = self.keep(now);
                if goes_on {
                    continue;
                }
                break;
            }
            self.take_back();
            if !imprints {
                break;
            }
            imprints = false;
        }
        Ok((met, displaced))
    }

    /// The triangles around these pairs, all of whose neighbours are in the submesh then.
    fn around(&mut self, pairs: &[[u32; 2]]) -> BTreeSet<u32> {
        let corners: BTreeSet<Vertex> = pairs.iter().flatten().flat_map(|t| self.work.triangles[*t as usize].v).collect();
        let stars = corners.iter().flat_map(|v| self.work.star(*v)).map(|(t, _)| t);
        let around: BTreeSet<u32> = stars.filter(|t| self.clusters.holds(*t)).collect();
        let corners = around.iter().flat_map(|t| self.work.triangles[*t as usize].v);
        let missing = corners.filter(|v| !self.work.complete[*v as usize]);
        self.complete(missing.map(|v| self.work.positions[v as usize]).collect());
        around
    }

    /// All changes of a pass since the submesh was marked stay.
    pub(crate) fn keep(&mut self, now: Met) -> Met {
        self.work.keep();
        self.unite(&now.crossing);
        now
    }

    /// Takes back what a pass has changed since the submesh was marked. What was fetched meanwhile stays.
    pub(crate) fn take_back(&mut self) {
        let (count, fetched) = self.work.take_back();
        let pieces: Vec<u32> = fetched.iter().map(|t| self.clusters.of_triangle[*t as usize]).collect();
        self.clusters.of_triangle.truncate(count);
        self.clusters.of_triangle.extend(pieces);
    }

    /// Takes out triangles of these that are less than `width` across, as far as new vertices are what makes them so.
    fn thin(&mut self, triangles: &BTreeSet<u32>, width: f64, changed: &mut Changed) {
        for t in triangles {
            if !self.work.lives(*t) {
                continue;
            }
            let v = self.work.triangles[*t as usize].v;
            let length = |k: &usize| self.work.distance(v[*k], v[(*k + 1) % 3]);
            let by_length = |a: &usize, b: &usize| length(a).total_cmp(&length(b));
            let (Some(short), Some(long)) = ((0..3).min_by(by_length), (0..3).max_by(by_length)) else { continue };
            let height = self.work.normal(*t).length() / length(&long);
            if height >= width || v.iter().all(|v| *v < self.first_vertex) {
                continue;
            }
            if length(&short) < width {
                self.merge_into_one([v[short], v[(short + 1) % 3]], changed);
            } else {
                let [a, b, apex] = [0, 1, 2].map(|k| v[(long + k) % 3]);
                self.lead_through([a, b], apex, height, changed);
            }
        }
    }

    /// Of each pair that crosses, lets what is closest become one.
    fn imprint(&mut self, pairs: &[[u32; 2]], width: f64, changed: &mut Changed) {
        let mut known = self.work.by_position();
        for pair in pairs {
            if pair.iter().any(|t| !self.work.lives(*t)) {
                continue;
            }
            let corners = pair.map(|t| self.work.triangles[t as usize].v);
            let places = corners.map(|v| v.map(|v| self.work.place(v)));
            let Some(closest) = closest(&corners, &places, width) else { continue };
            match closest {
                Closest { by: Nearness::Vertices(ends), .. } => self.merge_into_one(ends, changed),
                Closest { by: Nearness::VertexAndEdge(p, edge), away } => self.lead_through(edge, p, away, changed),
                Closest { by: Nearness::VertexAndFace(p, side), away } => {
                    let [a, b, c] = corners[side];
                    self.work.kill(pair[side]);
                    self.put(&[[a, b, p], [b, c, p], [c, a, p]], pair[side], away, changed);
                }
                Closest { by: Nearness::Edges(edges, at), away } => {
                    let position = Position::nearest(at);
                    let p = *known.entry(position).or_insert_with(|| self.work.add_vertex(position));
                    if edges.iter().flatten().all(|v| *v != p) {
                        edges.into_iter().for_each(|edge| self.lead_through(edge, p, away, changed));
                    }
                }
            }
        }
    }

    /// Merges two vertices, if one of them is new. Which stays is the older.
    fn merge_into_one(&mut self, ends: [Vertex; 2], changed: &mut Changed) {
        let (stay, go) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        if go < self.first_vertex || !self.work.complete[go as usize] {
            return;
        }
        let by = self.work.distance(stay, go);
        changed.farthest = changed.farthest.max(by);
        for (t, _) in self.work.star(go) {
            changed.triangles.insert(t);
            changed.snapped.push((t, by));
        }
        self.work.merge(stay, go);
    }

    /// Leads the two triangles of an edge through a vertex that is so far away from it; one that has the vertex for a corner goes. An edge of more
    /// triangles stays as it is.
    fn lead_through(&mut self, [a, b]: [Vertex; 2], p: Vertex, away: f64, changed: &mut Changed) {
        let at_edge = self.work.star(a).map(|(t, _)| t).filter(|t| self.work.triangles[*t as usize].v.contains(&b));
        let at_edge: Vec<u32> = at_edge.collect();
        if at_edge.len() != 2 || at_edge.iter().any(|t| !self.clusters.holds(*t)) {
            return;
        }
        for t in at_edge {
            let v = self.work.triangles[t as usize].v;
            self.work.kill(t);
            if !v.contains(&p) {
                self.put(&[a, b].map(|end| v.map(|w| if w == end { p } else { w })), t, away, changed);
            }
        }
    }

    /// Puts parts in the place of a triangle.
    fn put(&mut self, parts: &[[Vertex; 3]], t: u32, away: f64, changed: &mut Changed) {
        changed.farthest = changed.farthest.max(away);
        changed.snapped.push((t, away));
        let (origin, piece) = (self.work.triangles[t as usize].origin, self.clusters.of_triangle[t as usize]);
        for v in parts {
            changed.triangles.insert(self.work.add(*v, origin.of_part(), NONE));
            self.clusters.of_triangle.push(piece);
        }
    }
}

/// Which features of two triangles are near to each other.
enum Nearness {
    Vertices([Vertex; 2]),
    VertexAndEdge(Vertex, [Vertex; 2]),
    /// A vertex of the one triangle, and which of the two the other one is.
    VertexAndFace(Vertex, usize),
    /// Two edges, and where they pass each other.
    Edges([[Vertex; 2]; 2], DVec3),
}

struct Closest {
    by: Nearness,
    away: f64,
}

/// The features of two triangles that are nearest to each other, if that is less than `width`: of vertices with what the other triangle has first,
/// of edges else. Of features that hold others (a face its edges, an edge its ends) the smallest one that is near enough counts.
fn closest(corners: &[[Vertex; 3]; 2], places: &[[DVec3; 3]; 2], width: f64) -> Option<Closest> {
    let mut all: Vec<Closest> = Vec::new();
    for [side, other] in [[0, 1], [1, 0]] {
        let (v, points) = (corners[other], &places[other]);
        for (p, place) in corners[side].into_iter().zip(places[side]).filter(|(p, _)| !v.contains(p)) {
            let away = nearest_of_triangle(points, place).distance(place);
            if away >= width {
                continue;
            }
            let vertex = (0..3).find(|k| points[*k].distance(place) < width);
            let edge = (0..3).find(|k| nearest_of_segment(points[*k], points[(*k + 1) % 3], place).distance(place) < width);
            all.push(match (vertex, edge) {
                (Some(k), _) => Closest { by: Nearness::Vertices([p, v[k]]), away: points[k].distance(place) },
                (None, Some(k)) => Closest { by: Nearness::VertexAndEdge(p, [v[k], v[(k + 1) % 3]]), away },
                (None, None) => Closest { by: Nearness::VertexAndFace(p, other), away },
            });
        }
    }
    if all.is_empty() {
        for (k, l) in (0..3).flat_map(|k| (0..3).map(move |l| (k, l))) {
            let edge = |side: usize, k: usize| [corners[side][k], corners[side][(k + 1) % 3]];
            let ends = |side: usize, k: usize| [places[side][k], places[side][(k + 1) % 3]];
            let edges = [edge(0, k), edge(1, l)];
            if edges[0].iter().any(|v| edges[1].contains(v)) {
                continue;
            }
            let (x, y) = nearest_of_segments(ends(0, k), ends(1, l));
            all.push(Closest { by: Nearness::Edges(edges, (x + y) / 2.0), away: x.distance(y) });
        }
    }
    let near = all.into_iter().filter(|closest| closest.away < width);
    near.min_by(|a, b| a.away.total_cmp(&b.away))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is closest of the triangle (0, 0, 0), (4, 0, 0), (0, 4, 0), whose vertices are 0, 1, 2, and another one, whose are 3, 4, 5.
    fn closest_to(other: [[f64; 3]; 3]) -> Option<(Nearness, f64)> {
        let one = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
        let places = [one, other].map(|t| t.map(DVec3::from_array));
        closest(&[[0, 1, 2], [3, 4, 5]], &places, 0.25).map(|closest| (closest.by, closest.away))
    }

    #[test]
    fn the_smallest_feature_that_is_near_counts() {
        let rest = [[1.0, 1.0, 5.0], [2.0, 1.0, 5.0]];
        let with = |p: [f64; 3]| closest_to([p, rest[0], rest[1]]);
        assert!(matches!(with([1.0, 1.0, 0.125]), Some((Nearness::VertexAndFace(3, 0), away)) if away == 0.125));
        assert!(matches!(with([1.0, 0.125, 0.125]), Some((Nearness::VertexAndEdge(3, [0, 1]), away)) if away == 0.125));
        assert!(matches!(with([0.125, 0.0, 0.0]), Some((Nearness::Vertices([0, 3]), away)) if away == 0.125));
        assert!(with([1.0, 1.0, 0.5]).is_none(), "too far");
    }

    #[test]
    fn edges_count_where_no_vertex_is_near() {
        // In the plane x = 2, past the first edge at y = 0.
        let Some((Nearness::Edges(edges, at), away)) = closest_to([[2.0, -3.0, -3.75], [2.0, 3.0, 4.25], [2.0, -3.0, 9.0]])
        else {
            panic!("two edges pass each other");
        };
        // A line of slope 4/3 that is 1/4 above the origin is 3/5 of that away from it.
        assert_eq!((edges, at.x), ([[0, 1], [3, 4]], 2.0));
        assert!((away - 0.15).abs() < 1e-12);
    }
}
