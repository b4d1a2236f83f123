//! Surfaces that share an edge or a vertex, taken apart: what is read again is welded by position, so that each needs positions of its own.
//!
//! The triangles of an edge are paired by wedges of material ([`RadialPairs`]), so that the star of a vertex falls into fans, each the skin of one
//! surface there. All fans of a vertex but one get a copy of it, as near as single precision and validity allow, first into their own material:
//! along a chain of edges that two bodies share, one of them draws back. Where the two wedges of an edge have the same fans at both of its
//! ends (a bridge that narrows to an edge and widens again), one of them gets a vertex in the middle of the edge, which draws back alone.
//!
//! A copy goes no farther than a share of the shortest edge at it; only where there is no place so near, as at the slivers that cutting in single
//! precision leaves, may it go farther than these are wide. Its place is valid if none of its triangles loses its area or comes to meet another
//! one more than before, touching included. That is tested exactly, for the triangles around while places are tried, and for everything else
//! once all copies have theirs; those that meet anything are tried anew from their next place on. Vertices with an edge that is open, incoherent
//! or lies between triangles in one direction, and those whose fans cross each other, are left alone.

use crate::repairs::separate::places::{directions, sideways};
use crate::repairs::separate::separated::{Separated, regions};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use glam::DVec3;

use crate::contract::settings::Profile;
use crate::geometry::exact::{Point, at};
use crate::geometry::position::{self, Position};
use crate::geometry::sums::step_at;
use crate::geometry::tri_tri::{Contact, Triangle as Corners, triangles_cross};
use crate::repairs::shared::overlay::{Overlay, Which};
use crate::repairs::shared::snapshot::Snapshot;
use crate::repairs::shared::work::Work;
use crate::submesh::components::{Reversed, nonmanifold_vertices};
use crate::submesh::edges::Edge;
use crate::submesh::radial::{Half, RadialPairs};
use crate::submesh::{Submesh, Triangle, Vertex};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// A copy moves by no more than this share of the shortest edge at it, if there is a place for it then, so that no triangle comes near to turning
/// over.
const EDGE_SHARE: f64 = 0.125;

/// A copy may always move by so many steps of the largest coordinate there, however small the profile's bound: what is far from the origin has
/// no finer ones.
const LEAST_STEPS: f64 = 4.0;

/// Where there is no place so near, a copy may move by so many steps however short the edges are, if the profile lets it: cutting in single
/// precision leaves edges of a single step.
const FREE_STEPS: f64 = 64.0;

/// Then finer steps are tried, too, since smaller coordinates have them: down to this share of a step of the largest.
const FINEST: f64 = 1.0 / 64.0;

/// How often copies that meet something are tried from their next place on, and then how often such are given up.
const TRIED: usize = 4;
const GIVEN_UP: usize = 10;

/// Rounds of opening edges: a triangle with several such edges is divided at one of them in each.
const OPENINGS: usize = 8;

/// Pairs of triangles that are compared for one copy, at all places that are tried for it together, or around one vertex. Where it takes more,
/// the vertex is left alone.
const MOST_PAIRS: usize = 1 << 20;

/// Takes surfaces apart at all vertices where that is possible. O(submesh) and a look at all boxes around what moves, if anything does.
pub(crate) fn separate(survey: &Survey<'_>, work: &mut Work<'_>, reversed: &Reversed, profile: &Profile) -> Separated {
    let vertices = if profile.separate { nonmanifold_vertices(work, survey.threads()) } else { Vec::new() };
    if vertices.is_empty() {
        return Separated::default();
    }
    let before = Before {
        triangles: work.snapshot(),
        taken: work.positions.iter().copied().map(Position::of).collect(),
        farthest: profile.max_separation_relative * survey.bounds.diagonal(),
    };
    let mut from = BTreeMap::new();
    for round in 0..TRIED + GIVEN_UP {
        let mut apart = Apart::new(work, &before, &from);
        apart.part_vertices(survey, &vertices);
        apart.open_edges();
        let Some(blamed) = apart.blamed(survey, reversed) else { break };
        let copies = std::mem::take(&mut apart.copies);
        let first = apart.first;
        if blamed.is_empty() {
            let mut done = Separated::default().but(work, &nonmanifold_vertices(work, survey.threads()));
            let away: Vec<f64> = copies.iter().map(|copy| copy.away).collect();
            done.regions = regions(work, first, &away);
            for copy in copies {
                *if copy.of.is_edge() { &mut done.edges } else { &mut done.vertices } += 1;
                done.farthest = done.farthest.max(copy.away);
            }
            return done;
        }
        tracing::debug!(round, copies = blamed.len(), "Copies of vertices meet something.");
        for copy in blamed {
            let Copy { of, place, .. } = copies[copy];
            from.insert(of, if round < TRIED { place + 1 } else { usize::MAX });
        }
        work.restore(&before.triangles);
    }
    work.restore(&before.triangles);
    Separated::default().but(work, &vertices)
}

/// The submesh as it was.
struct Before {
    triangles: Snapshot,
    /// Positions of its vertices.
    taken: HashSet<Position>,
    /// How far the profile lets a copy go.
    farthest: f64,
}

/// What a copy is made of, by numbers from before, so that they mean the same whatever else is copied: a vertex (twice) with the first triangle of
/// a fan, or the ends of an edge with the two triangles of a wedge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Of {
    ends: [Vertex; 2],
    triangles: [u32; 2],
}

impl Of {
    fn is_edge(&self) -> bool {
        self.ends[0] != self.ends[1]
    }
}

/// A new vertex.
#[derive(Clone, Copy)]
struct Copy {
    of: Of,
    /// The place of those tried that it has.
    place: usize,
    away: f64,
}

/// One way of taking everything apart.
struct Apart<'w, 's, 'b> {
    work: &'w mut Work<'s>,
    before: &'b Before,
    /// The first place to try for a copy, where it is not the first of all.
    from: &'b BTreeMap<Of, usize>,
    /// By number of the vertex, less `first`.
    copies: Vec<Copy>,
    first: Vertex,
    /// Positions of the copies.
    taken: HashSet<Position>,
    /// For each vertex from before its copies.
    family: HashMap<Vertex, Vec<Vertex>>,
    /// For each triangle that was added the one from before of which it is a part.
    whole: Vec<u32>,
}

/// A triangle with a copy for a corner, and the triangle from before of which it is a part.
type Moved = (u32, Corners);

impl<'w, 's, 'b> Apart<'w, 's, 'b> {
    fn new(work: &'w mut Work<'s>, before: &'b Before, from: &'b BTreeMap<Of, usize>) -> Self {
        let first = work.positions.len() as Vertex;
        let (taken, family) = (HashSet::new(), HashMap::new());
        Self { work, before, from, copies: Vec::new(), first, taken, family, whole: Vec::new() }
    }

    /// Gives every fan of each of these vertices but one a vertex of its own, if there is a place for it. What stays is the surface that comes first
    /// in the file, so that along an edge it is the same at both ends.
    fn part_vertices(&mut self, survey: &Survey<'_>, vertices: &[Vertex]) {
        let (submesh, edges) = self.work.edges();
        let radial = RadialPairs::of(submesh, edges);
        let surfaces = surfaces(survey, submesh, &radial);
        for v in vertices {
            let Some(mut fans) = radial.fans(self.work, *v) else { continue };
            if self.fans_cross(&fans) {
                continue;
            }
            let rank = |fan: &Vec<Half>| {
                fan.iter().map(|h| (surfaces[h.triangle as usize], self.work.record(h.triangle), h.triangle)).min()
            };
            fans.sort_by_cached_key(rank);
            let mut there = fans.len();
            for fan in fans.iter().skip(1).chain(fans.first()) {
                if there > 1 && self.part(*v, fan) {
                    there -= 1;
                }
            }
        }
        self.work.relink();
    }

    /// Do triangles of different fans cross (or are there too many to tell)? What runs into each other there cannot be parted by moving the vertex;
    /// what only lies on each other may be.
    fn fans_cross(&self, fans: &[Vec<Half>]) -> bool {
        let points = |h: &Half| self.points_before(h.triangle);
        let meet = |a: &[Half], b: &[Half]| {
            a.iter().any(|a| b.iter().any(|b| triangles_cross(&points(a), &points(b)) == Contact::Cross))
        };
        let all: usize = fans.iter().map(Vec::len).sum();
        all * all > MOST_PAIRS || (1..fans.len()).any(|i| fans[..i].iter().any(|other| meet(other, &fans[i])))
    }

    /// Gives a fan of `v` a vertex of its own; `false` if there is no place for it. Star lists stay as they were.
    fn part(&mut self, v: Vertex, fan: &[Half]) -> bool {
        let submesh: &Submesh = self.work;
        let first = fan.iter().map(|h| h.triangle).min().unwrap_or(NONE);
        let of = Of { ends: [v; 2], triangles: [first, NONE] };
        let corners: Vec<Vertex> = fan.iter().flat_map(|h| submesh.triangles[h.triangle as usize].v).collect();
        let own: Vec<u32> = fan.iter().map(|h| h.triangle).collect();
        let moved = |p: Point| -> Vec<Moved> {
            let one = |h: &Half| {
                let mut corners = submesh.points(h.triangle);
                corners[h.corner] = p;
                (h.triangle, corners)
            };
            fan.iter().map(one).collect()
        };
        let Some((copy, position)) = self.place(of, submesh.place(v), &corners, &own, moved) else { return false };
        let new = self.add(copy, position);
        self.family.entry(v).or_default().push(new);
        fan.iter().for_each(|h| self.work.assign(h.triangle, h.corner, new));
        true
    }

    /// Gives every wedge but one of each edge that still has several a vertex of its own in the middle, if there is a place for it.
    fn open_edges(&mut self) {
        for _ in 0..OPENINGS {
            let crowded = self.crowded_edges();
            let (mut again, made) = (false, self.copies.len());
            for (ends, wedges) in crowded {
                // Divided along another edge: its triangles are others now.
                if wedges.iter().flatten().any(|h| !self.work.lives(h.triangle)) {
                    again = true;
                    continue;
                }
                let mut there = wedges.len();
                for wedge in wedges.iter().skip(1).chain(wedges.first()) {
                    if there > 1 && self.open(ends, wedge) {
                        there -= 1;
                    }
                }
            }
            if !again || self.copies.len() == made {
                return;
            }
        }
    }

    /// The edges of more than two triangles between vertices all of whose fans are closed, with their wedges in the file's order.
    fn crowded_edges(&mut self) -> Vec<([Vertex; 2], Vec<[Half; 2]>)> {
        let (submesh, edges) = self.work.edges();
        if !edges.any_nonmanifold() {
            return Vec::new();
        }
        let radial = RadialPairs::of(submesh, edges);
        let crowded =
            edges.iter().filter(|e| e.is_nonmanifold() && [e.low, e.high].iter().all(|v| radial.fans(submesh, *v).is_some()));
        let in_order = |edge: Edge<'_>| {
            let forward = edge.uses.iter().filter(|u| u.forward());
            let mut pairs: Vec<[Half; 2]> = forward
                .filter_map(|u| {
                    let half = Half::of(submesh, &edge, u);
                    Some([half, radial.mate(half)?])
                })
                .collect();
            pairs.sort_by_key(|pair| pair.map(|h| (submesh.record(h.triangle), h.triangle)).into_iter().min());
            ([edge.low, edge.high], pairs)
        };
        crowded.map(in_order).collect()
    }

    /// Divides the two triangles of a wedge at a new vertex; `false` if there is no place for it.
    fn open(&mut self, ends: [Vertex; 2], wedge: &[Half; 2]) -> bool {
        let submesh: &Submesh = self.work;
        let mut wholes = wedge.map(|h| self.whole(h.triangle));
        wholes.sort_unstable();
        let mut from = ends.map(|v| self.original(v));
        from.sort_unstable();
        let of = Of { ends: from, triangles: wholes };
        // The halves of each triangle, as places among its corners, 3 being the new vertex.
        let parts = |h: &Half| {
            let [a, b, c] = [0, 1, 2].map(|k| (h.corner + k) % 3);
            [[a, 3, c], [3, b, c]]
        };
        let corners: Vec<Vertex> = wedge.iter().flat_map(|h| submesh.triangles[h.triangle as usize].v).collect();
        let own = wedge.map(|h| h.triangle);
        let moved = |p: Point| -> Vec<Moved> {
            let both = |h: &Half| {
                let [a, b, c] = submesh.points(h.triangle);
                let whole = self.whole(h.triangle);
                parts(h).map(|part| (whole, part.map(|k| [a, b, c, p][k])))
            };
            wedge.iter().flat_map(both).collect()
        };
        let middle = (submesh.place(ends[0]) + submesh.place(ends[1])) / 2.0;
        let Some((copy, position)) = self.place(of, middle, &corners, &own, moved) else { return false };
        let new = self.add(copy, position);
        for h in wedge {
            let Triangle { v: [a, b, c], origin, region, .. } = self.work.triangles[h.triangle as usize];
            let whole = self.whole(h.triangle);
            self.work.kill(h.triangle);
            for part in parts(h) {
                self.work.add(part.map(|k| [a, b, c, new][k]), origin.of_part(), region);
                self.whole.push(whole);
            }
        }
        true
    }

    /// The nearest valid place of a copy that is made at `middle`, of whose triangles these are all `corners`. It takes the place of its `own`
    /// triangles; `moved`: what comes instead, where the copy has a certain position.
    fn place(
        &self,
        of: Of,
        middle: DVec3,
        corners: &[Vertex],
        own: &[u32],
        moved: impl Fn(Point) -> Vec<Moved>,
    ) -> Option<(Copy, Point)> {
        let submesh: &Submesh = self.work;
        let mut corners = corners.to_vec();
        corners.sort_unstable();
        corners.dedup();
        let mut near: Vec<u32> = Vec::new();
        for v in &corners {
            let original = self.original(*v);
            let copies = self.family.get(&original).into_iter().flatten();
            near.extend(copies.chain([&original]).flat_map(|v| submesh.star(*v)).map(|(t, _)| t));
        }
        near.sort_unstable();
        near.dedup();
        near.retain(|t| !own.contains(t));
        let most_places = MOST_PAIRS / ((near.len() + own.len()) * own.len());
        let points = || corners.iter().map(|v| submesh.positions[*v as usize]);
        let largest = points().flatten().map(f32::abs).fold(0.0, f32::max);
        let step = step_at(largest);
        let rays: Vec<DVec3> = points().map(|p| at(&p) - middle).filter(|ray| *ray != DVec3::ZERO).collect();
        let room = EDGE_SHARE * rays.iter().map(|ray| ray.length()).fold(f64::INFINITY, f64::min);
        let most = self.before.farthest.max(LEAST_STEPS * step);
        let mut ways = directions(own.iter().map(|t| -submesh.normal(*t).normalize_or_zero()));
        let usual = ways.len();
        ways.extend(sideways(&rays));
        let all = &ways;
        let places = |first: f64, most: f64, ways: usize| {
            let steps = (0..30).map(move |k| first * f64::from(1_u32 << k)).take_while(move |step| *step <= most);
            let ways = &all[..ways];
            steps.flat_map(move |step| ways.iter().map(move |d| Position::nearest(middle + *d * step)))
        };
        let near_by = places(step, most.min(room), usual);
        let farther = places(step * FINEST, most.min(room.max(FREE_STEPS * step)), ways.len());
        let tried = near_by.chain(farther).enumerate().skip(self.from.get(&of).copied().unwrap_or(0));
        let mut seen = HashSet::new();
        for (place, position) in tried.take(most_places) {
            if !seen.insert(position) || self.before.taken.contains(&position) || self.taken.contains(&position) {
                continue;
            }
            let position = position.coordinates();
            let (moved, away) = (moved(position), (at(&position) - middle).length());
            if (away <= room || self.keep_facing(&moved)) && self.accepts(&moved, &near) {
                return Some((Copy { of, place, away }, position));
            }
        }
        None
    }

    /// Do triangles that move farther than their edges are long face the way they did, taken together?
    fn keep_facing(&self, moved: &[Moved]) -> bool {
        let normal = |[a, b, c]: &Corners| (at(b) - at(a)).cross(at(c) - at(a));
        moved.iter().map(|(whole, now)| normal(now).dot(normal(&self.points_before(*whole)))).sum::<f64>() > 0.0
    }

    /// Do these triangles all have an area, and meet neither each other nor those `near` more than before?
    fn accepts(&self, moved: &[Moved], near: &[u32]) -> bool {
        let submesh: &Submesh = self.work;
        moved.iter().enumerate().all(|(i, one)| {
            let (_, [a, b, c]) = one;
            !crate::geometry::collinear::is_collinear(a, b, c)
                && moved[..i].iter().all(|other| !self.meets(one, other))
                && near.iter().all(|t| !self.meets(one, &(self.whole(*t), submesh.points(*t))))
        })
    }

    /// Do two triangles meet more than those from before did of which they are parts? Where these lay on each other they may cross for the time being,
    /// until all vertices between them have moved.
    fn meets(&self, a: &Moved, b: &Moved) -> bool {
        let now = triangles_cross(&a.1, &b.1);
        if now == Contact::Apart || a.0 == b.0 {
            return now != Contact::Apart;
        }
        let before = triangles_cross(&self.points_before(a.0), &self.points_before(b.0));
        badness(now) > badness(before) && !before.is_crossing()
    }

    fn points_before(&self, t: u32) -> Corners {
        self.before.triangles.corners(t).map(|v| self.work.positions[v as usize])
    }

    fn add(&mut self, copy: Copy, position: Point) -> Vertex {
        self.copies.push(copy);
        let position = Position::of(position);
        self.taken.insert(position);
        self.work.add_vertex(position)
    }

    /// The vertex from before of which `v` is a copy; itself in the middle of an edge.
    fn original(&self, v: Vertex) -> Vertex {
        match v.checked_sub(self.first).map(|copy| self.copies[copy as usize].of) {
            Some(of) if !of.is_edge() => of.ends[0],
            _ => v,
        }
    }

    /// The triangle from before of which `t` is a part, or that it is.
    fn whole(&self, t: u32) -> u32 {
        t.checked_sub(self.before.triangles.len() as u32).map_or(t, |part| self.whole[part as usize])
    }

    /// The copies that cannot stay: a triangle of theirs crosses another one that it did not cross before, or another vertex of the file has their
    /// position. `None` if that is too much work to tell.
    fn blamed(&self, survey: &Survey<'_>, reversed: &Reversed) -> Option<BTreeSet<usize>> {
        let mut blamed = BTreeSet::new();
        if self.copies.is_empty() {
            return Some(blamed);
        }
        let submesh: &Submesh = self.work;
        let positions = &submesh.positions[self.first as usize..];
        let copy_at: HashMap<Position, usize> = positions.iter().copied().map(Position::of).zip(0..).collect();
        for (irregular_triangle, _) in survey.beyond_the_submesh(positions) {
            let corners = position::corners(&survey.records[irregular_triangle.triangle as usize]);
            blamed.extend(corners.iter().filter_map(|p| copy_at.get(&Position::of(*p))));
        }
        let overlay = Overlay::of(survey, submesh, reversed)?;
        let copies = |t: u32| submesh.triangles[t as usize].v.into_iter().filter_map(|v| v.checked_sub(self.first));
        let pairs = overlay.met_by(survey, submesh, |t| copies(t).next().is_some())?;
        for pair in pairs {
            let in_submesh = pair.triangles.map(|number| overlay.changed_of(number));
            let before = pair.triangles.map(|number| match overlay.which(number) {
                Which::Submesh(t) => self.points_before(self.whole(t)),
                Which::Record(record) => position::corners(&survey.records[record as usize]),
            });
            let of_one = matches!(in_submesh, [Some(a), Some(b)] if self.whole(a) == self.whole(b));
            if of_one || badness(pair.contact) > badness(triangles_cross(&before[0], &before[1])) {
                blamed.extend(in_submesh.into_iter().flatten().flat_map(copies).map(|copy| copy as usize));
            }
        }
        Some(blamed)
    }
}

/// For each triangle the first record of the surface that it is a part of, as surfaces go on through wedges. O(regions + submesh).
fn surfaces(survey: &Survey<'_>, submesh: &Submesh, radial: &RadialPairs) -> Vec<u32> {
    let regions = survey.regions.len() as u32;
    let mut parents: Vec<u32> = (0..regions + submesh.triangles.len() as u32).collect();
    for t in submesh.living() {
        let region = submesh.triangles[t as usize].region;
        if region != NONE {
            crate::util::union_find::unite(&mut parents, region, regions + t);
        }
        for mate in (0..3).filter_map(|corner| radial.mate(Half { triangle: t, corner })) {
            crate::util::union_find::unite(&mut parents, regions + t, regions + mate.triangle);
        }
    }
    let mut first = vec![NONE; parents.len()];
    let records =
        survey.regions.iter().map(|p| p.first).zip(0..).chain(submesh.living().map(|t| (submesh.record(t), regions + t)));
    for (record, node) in records {
        let root = crate::util::union_find::find(&mut parents, node) as usize;
        first[root] = first[root].min(record);
    }
    (0..submesh.triangles.len() as u32)
        .map(|t| first[crate::util::union_find::find(&mut parents, regions + t) as usize])
        .collect()
}

/// What lies on something can be lifted off it; what crosses it cannot.
fn badness(contact: Contact) -> u8 {
    match contact {
        Contact::Apart => 0,
        Contact::Touch => 1,
        Contact::Overlap => 2,
        Contact::Cross => 3,
    }
}

#[cfg(test)]
mod tests;
