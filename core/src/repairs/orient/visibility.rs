//! Which way surface faces where its neighbours do not tell: the way it is seen from outside.
//!
//! Neighbours that disagree tell that something is to be turned, but not what. Of a small patch and much around it that is plain, and
//! [`crate::repairs::orient::directions`] turns the smaller part. Where the parts are both large, as bodies that were welded along an edge of each, or surfaces that end at each
//! other in non-manifold edges, each is looked at: of points on it, spread by area, rays run along the axes, and those that meet nothing tell from
//! which side it is seen (the idea of Takayama, Jacobson, Kavan & Sorkine-Hornung, "A simple method for correcting facet orientations in polygon
//! meshes based on ray casting", JCGT 3(4), 2014, who cast them in all directions). What is seen from both sides alike, or from none, follows its
//! neighbours. Edges between parts that are both right, and disagree, stay: no surface goes on there, and they are balanced later.

use crate::contract::report::RepairName;
use crate::repairs::shared::context::{Changes, Done, Repair};
use std::cmp::{Ordering, Reverse};
use std::collections::{BTreeMap, HashMap, HashSet};

use robust::Coord;

use crate::detect::bodies::{self, Direction, Source};
use crate::geometry::distance::place;
use crate::geometry::position::Position;
use crate::io::record;
use crate::repairs::orient::directions::{Parity, flip_node};
use crate::repairs::shared::work::Work;
use crate::submesh::Submesh;
use crate::submesh::components::{Components, Reversed, Sample, Through};
use crate::submesh::edges::Edges;
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// Parts that are seen from behind, where crossings are known. Hands over what is settled by that.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Visibility,
    changes: Changes::Directions,
    run: |cx| {
        if cx.profile.resolve_crossings && cx.survey.crossing_pairs.is_some() {
            let faced = face_outward(cx.survey, &mut cx.work, &mut cx.reversed);
            cx.handed.settled = faced.settled;
            return Ok(Done::count(faced.triangles, "triangles turned that are seen from behind, or whose neighbours are"));
        }
        Ok(Done::count(0, ""))
    },
};

/// The smaller part of a sheet that disagrees with itself is just turned if it has no more triangles than this, or than this share of all. So is it
/// everywhere if what is seen to be otherwise is less than this share of all surface.
const FEW: u64 = 16;
const SMALL: f64 = 0.01;

/// Parts that are looked at, at most: the largest.
const MOST: usize = 4096;

/// Points of each.
const POINTS: usize = 32;

/// A part is seen from one side if so many times as many points are seen from there as from the other, and no fewer than one of so many.
const CLEARLY: usize = 2;
const ENOUGH: usize = 8;

/// A ray begins so far from the surface, as a share of the largest coordinate: what rounding in f64 cannot do, and far less than f32 can tell.
const OFF: f64 = 1.0 / (1u64 << 40) as f64;

/// What was looked at.
#[derive(Debug, Default)]
pub(crate) struct Faced {
    /// Triangles that were turned.
    pub(crate) triangles: u64,
    /// By triangle of the submesh: it is settled how it faces. Empty: of none.
    pub(crate) settled: Vec<bool>,
}

/// Turns large parts that are seen from behind, and what follows them. O(regions + submesh), and if there are any, a pass over the chunks
/// that they are in, and one for each direction over those that rays may meet.
pub(crate) fn face_outward(survey: &Survey<'_>, work: &mut Work<'_>, reversed: &mut Reversed) -> Faced {
    let (submesh, edges) = work.edges();
    if !edges.iter().any(|edge| edge.is_unbalanced() && edge.uses.len() > 1) {
        return Faced::default();
    }
    let surface = Surface::of(survey, submesh, edges, reversed);
    let parts = &surface.parts.list;
    // What would be turned of each sheet if only neighbours counted.
    let by_neighbours = surface.follow(&vec![None; parts.len()]);
    let looked_at = surface.worth_a_look(&by_neighbours);
    let is_asked = |p: u32| looked_at[surface.sheet_of[p as usize] as usize];
    let mut asked: Vec<u32> = (0..parts.len() as u32).filter(|p| is_asked(*p)).collect();
    if asked.is_empty() {
        return Faced::default();
    }
    asked.sort_by_key(|p| (Reverse(parts[*p as usize].extent.area), parts[*p as usize].sample));
    asked.truncate(MOST);
    let seen = seen(survey, submesh, reversed, &surface.parts, &asked);
    // Where hardly anything is seen otherwise than neighbours have it, they are to be followed everywhere.
    let all: i128 = parts.iter().map(|part| part.extent.area).sum();
    let is_contested =
        |(part, sides): &(&u32, &Sightings)| sides.is_behind().is_some_and(|behind| behind != by_neighbours[**part as usize]);
    let contested = seen.iter().filter(is_contested).map(|(part, _)| parts[*part as usize].extent.area);
    if (contested.sum::<i128>() as f64) < SMALL * all as f64 {
        return Faced::default();
    }
    let mut known = vec![None; parts.len()];
    seen.iter().for_each(|(part, sides)| known[*part as usize] = sides.is_behind());
    let mut turns = surface.follow(&known);
    (0..parts.len()).filter(|p| !is_asked(*p as u32)).for_each(|p| turns[p] = false);
    let is_settled = |sheet: &u32| looked_at.get(*sheet as usize) == Some(&true);
    let settled = surface.sheets.of_triangle.iter().map(is_settled).collect();
    let triangles = parts.iter().zip(&turns).filter(|(_, turns)| **turns).map(|(part, _)| part.triangles).sum();
    let nodes = surface.parts.of_region.iter().chain(&surface.parts.of_triangle).zip(0..);
    let turned = nodes.filter(|(part, _)| turns.get(**part as usize) == Some(&true)).map(|(_, node)| node);
    turned.for_each(|node| flip_node(survey, work, reversed, node));
    Faced { triangles, settled }
}

/// The surface as parts that agree with themselves, and the sheets that they make up.
struct Surface {
    parts: Components,
    sheets: Components,
    /// By part.
    sheet_of: Vec<u32>,
    /// Parts of one sheet that disagree where they meet, those with the most such edges first.
    links: Vec<[u32; 2]>,
    /// By sheet: another one ends at it, or goes on from it, and faces the wrong way for that.
    at_odds: Vec<bool>,
}

impl Surface {
    fn of(survey: &Survey<'_>, submesh: &Submesh, edges: &Edges, reversed: &Reversed) -> Self {
        let parts = Components::of(survey, submesh, edges, reversed, Through::CoherentEdges);
        let sheets = Components::of(survey, submesh, edges, reversed, Through::ManifoldEdges);
        let mut sheet_of = vec![NONE; parts.list.len()];
        let nodes = parts.of_region.iter().zip(&sheets.of_region).chain(parts.of_triangle.iter().zip(&sheets.of_triangle));
        nodes.filter(|(part, _)| **part != NONE).for_each(|(part, sheet)| sheet_of[*part as usize] = *sheet);
        let mut between: HashMap<[u32; 2], u64> = HashMap::new();
        let mut at_odds = vec![false; sheets.list.len()];
        for edge in edges.iter().filter(|edge| edge.is_unbalanced()) {
            match edge.uses {
                [_] => {}
                [a, b] => {
                    let [a, b] = [a, b].map(|used| parts.of_triangle[used.triangle as usize]);
                    *between.entry([a.min(b), a.max(b)]).or_insert(0) += 1;
                }
                uses => uses.iter().for_each(|used| at_odds[sheets.of_triangle[used.triangle as usize] as usize] = true),
            }
        }
        let mut links: Vec<([u32; 2], u64)> = between.into_iter().filter(|([a, b], _)| a != b).collect();
        // Of as many edges, what comes first in the file.
        links.sort_by_key(|(pair, count)| {
            let [a, b] = pair.map(|p| parts.list[p as usize].sample);
            (Reverse(*count), a.min(b), a.max(b))
        });
        let links = links.into_iter().map(|(pair, _)| pair).collect();
        Self { parts, sheets, sheet_of, links, at_odds }
    }

    /// By sheet: is it to be looked at? Those at odds with others, and those of which following neighbours turns much.
    fn worth_a_look(&self, by_neighbours: &[bool]) -> Vec<bool> {
        let mut turned = vec![0; self.sheets.list.len()];
        let parts = self.parts.list.iter().zip(&self.sheet_of).zip(by_neighbours);
        for ((part, sheet), _) in parts.filter(|(_, turns)| **turns) {
            turned[*sheet as usize] += part.triangles;
        }
        let is_much = |count: u64, of: u64| count > FEW && count as f64 > SMALL * of as f64;
        let sheets = self.sheets.list.iter().zip(&self.at_odds).zip(turned);
        sheets.map(|((sheet, at_odds), count)| *at_odds || is_much(count, sheet.triangles)).collect()
    }

    /// By part: is it to be turned? So that what is known to be behind is, and what is not known agrees with its neighbours; between groups of
    /// parts with nothing known, the smaller side is turned.
    fn follow(&self, known: &[Option<bool>]) -> Vec<bool> {
        let count = self.parts.list.len() as u32;
        let mut parity = Parity::new(self.parts.list.len());
        // By root of a group: is the root behind?
        let mut behind = known.to_vec();
        for [a, b] in &self.links {
            let (ra, rb) = (parity.find(*a).0, parity.find(*b).0);
            let (from, is_behind) = match [ra, rb].map(|root| behind[root as usize]) {
                // No two that are known depend on each other.
                [Some(_), Some(_)] => continue,
                [Some(is_behind), None] => (ra, Some(is_behind)),
                [None, is_behind] => (rb, is_behind),
            };
            parity.relate(*a, *b, true);
            let (root, odd) = parity.find(from);
            behind[root as usize] = is_behind.map(|is_behind| is_behind ^ odd);
        }
        let smaller = self.smaller_sides(&mut parity);
        let is_turned = |p: u32| {
            let (root, odd) = parity.find(p);
            behind[root as usize].map_or(smaller[p as usize], |is_behind| is_behind ^ odd)
        };
        (0..count).map(is_turned).collect()
    }

    /// Which parts are on the smaller side of what they are related to, of equal sides on that with the later triangle.
    fn smaller_sides(&self, parity: &mut Parity) -> Vec<bool> {
        let of: Vec<(u32, bool)> = (0..self.parts.list.len() as u32).map(|p| parity.find(p)).collect();
        let mut sides = vec![[(0, None::<Reverse<Sample>>); 2]; of.len()];
        for (part, (root, odd)) in self.parts.list.iter().zip(&of) {
            let (triangles, first) = &mut sides[*root as usize][usize::from(*odd)];
            *triangles += part.triangles;
            *first = (*first).max(Some(Reverse(part.sample)));
        }
        of.iter()
            .map(|(root, odd)| {
                let [even_side, odd_side] = sides[*root as usize];
                *odd != (odd_side > even_side)
            })
            .collect()
    }
}

/// Of how many points each side of a part is seen.
#[derive(Clone, Copy, Default)]
struct Sightings {
    points: usize,
    front: usize,
    back: usize,
}

impl Sightings {
    /// Is the part seen from behind? `None` if that is not clear.
    fn is_behind(&self) -> Option<bool> {
        let Self { points, front, back } = *self;
        let clearly = |more: usize, less: usize| more > CLEARLY * less && more * ENOUGH >= points;
        match (clearly(front, back), clearly(back, front)) {
            (true, _) => Some(false),
            (_, true) => Some(true),
            _ => None,
        }
    }
}

/// A triangle that one of the points is in.
#[derive(Clone, Copy, PartialEq)]
struct Point {
    /// Area over a number between 0 and 1 of its own: the points with the largest are spread evenly over the area (Duffield, Lund & Thorup,
    /// "Priority sampling for estimation of arbitrary subset sums", JACM 54(6), 2007).
    priority: f64,
    record: u32,
    corners: [[f32; 3]; 3],
}

impl Point {
    fn of(corners: [[f32; 3]; 3], record: u32) -> Self {
        let [a, b, c] = corners.map(place);
        let x = (u64::from(record) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let x = (x ^ x >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93);
        let share = ((x >> 11) as f64 + 1.0) / (1u64 << 53) as f64;
        Self { priority: (b - a).cross(c - a).length() / share, record, corners }
    }

    fn is_before(&self, other: &Self) -> bool {
        let by_place = || self.corners.map(Position::of) < other.corners.map(Position::of);
        match self.priority.total_cmp(&other.priority).then(other.record.cmp(&self.record)) {
            Ordering::Equal => by_place(),
            order => order.is_gt(),
        }
    }
}

/// Takes a point in, if it is among the first.
fn note(points: &mut Vec<Point>, point: Point) {
    let at = points.partition_point(|other| other.is_before(&point));
    if at < POINTS {
        points.truncate(POINTS - 1);
        points.insert(at, point);
    }
}

/// The first points of the parts that are asked about, by part.
fn first_points(
    survey: &Survey<'_>,
    submesh: &Submesh,
    reversed: &Reversed,
    parts: &Components,
    asked: &[u32],
) -> Vec<(u32, Point)> {
    let wanted: HashSet<u32> = asked.iter().copied().collect();
    let found = survey.visit_regular(
        |region| wanted.contains(&parts.of_region[region as usize]),
        |_| Some(HashMap::<u32, Vec<Point>>::new()),
        |_, _| true,
        |found, triangle, region| {
            let [a, b, c] = record::corners(&survey.records[triangle as usize]);
            let corners = if reversed.regions[region as usize] { [a, c, b] } else { [a, b, c] };
            note(found.entry(parts.of_region[region as usize]).or_default(), Point::of(corners, triangle));
        },
    );
    let mut points: BTreeMap<u32, Vec<Point>> = BTreeMap::new();
    // Which points are the first does not depend on the order that they come in.
    for (part, found) in found.into_iter().flatten() {
        let own = points.entry(part).or_default();
        found.into_iter().for_each(|point| note(own, point));
    }
    for t in submesh.living().filter(|t| wanted.contains(&parts.of_triangle[*t as usize])) {
        note(points.entry(parts.of_triangle[t as usize]).or_default(), Point::of(submesh.points(t), submesh.record(t)));
    }
    points.into_iter().flat_map(|(part, points)| points.into_iter().map(move |p| (part, p))).collect()
}

/// From where the parts that are asked about are seen.
fn seen(
    survey: &Survey<'_>,
    submesh: &Submesh,
    reversed: &Reversed,
    parts: &Components,
    asked: &[u32],
) -> BTreeMap<u32, Sightings> {
    let all = first_points(survey, submesh, reversed, parts, asked);
    let off = OFF * f64::from(survey.bounds.largest_coordinate());
    // By point: is it seen from the front, from behind?
    let mut sides = vec![[false; 2]; all.len()];
    for (axis, backward) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
        let direction = Direction { axis, backward };
        let turns = |corners: &[[f32; 3]; 3]| {
            let [a, b, c] = corners.map(|p| {
                let [x, y, _] = direction.upright(p.map(f64::from));
                Coord { x, y }
            });
            robust::orient2d(a, b, c) * if backward { -1.0 } else { 1.0 }
        };
        let towards: Vec<(usize, bool)> = (0..all.len())
            .map(|i| (i, turns(&all[i].1.corners)))
            .filter(|(_, turn)| *turn != 0.0)
            .map(|(i, turn)| (i, turn < 0.0))
            .collect();
        let source = |(i, _): &(usize, bool)| {
            let mut from = bodies::inner_point(&all[*i].1.corners);
            from[axis] += if backward { -off } else { off };
            Source { from, component: NONE }
        };
        let sources: Vec<Source> = towards.iter().map(source).collect();
        let met = bodies::obstructed(survey, submesh, parts, direction, &sources, |_| true);
        for ((i, is_behind), _) in towards.iter().zip(met).filter(|(_, met)| !met) {
            sides[*i][usize::from(*is_behind)] = true;
        }
    }
    let mut seen: BTreeMap<u32, Sightings> = BTreeMap::new();
    for ((part, _), [front, back]) in all.iter().zip(sides) {
        let own = seen.entry(*part).or_default();
        own.points += 1;
        own.front += usize::from(front);
        own.back += usize::from(back);
    }
    seen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{After, Corners, after, cuboid, reversed};

    fn faced(mesh: &[Corners]) -> After<u64> {
        after(mesh, |d, turned| face_outward(&d.survey, &mut Work::new(&mut d.submesh), turned).triangles)
    }

    /// A box whose faces are divided in squares of one unit, without the face `without` (x low, x high, y low, …).
    fn fine_box(lo: [i32; 3], hi: [i32; 3], without: Option<usize>) -> Vec<Corners> {
        let mut mesh = Vec::new();
        for (side, (axis, up)) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]).enumerate() {
            if without == Some(side) {
                continue;
            }
            let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
            for (i, j) in (lo[b]..hi[b]).flat_map(|i| (lo[c]..hi[c]).map(move |j| (i, j))) {
                let at = |i: i32, j: i32| {
                    let mut p = [0.0; 3];
                    (p[axis], p[b], p[c]) = (if up { hi[axis] } else { lo[axis] } as f32, i as f32, j as f32);
                    p
                };
                let [p, q, r, s] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                mesh.extend(if up { [[p, q, r], [p, r, s]] } else { [[p, r, q], [p, s, r]] });
            }
        }
        mesh
    }

    #[test]
    fn open_boxes_that_were_welded_along_a_rim_are_both_left_as_they_are() {
        // In the plane between them, the wall of the one goes on as that of the other, which faces the other way.
        let left = fine_box([0, 0, 0], [4, 4, 4], Some(3));
        let right = fine_box([4, 4, 0], [8, 8, 4], Some(2));
        let mesh = [left, right].concat();
        let got = faced(&mesh);
        assert_eq!((got.defects.inconsistent_edges, got.result), (4, 0));
    }

    #[test]
    fn a_large_part_that_is_seen_from_behind_is_turned() {
        // Two faces of six: neighbours alone say so, too. Four of six: they would turn the others.
        let all = fine_box([0, 0, 0], [4, 4, 4], None);
        let with_turned = |faces: usize| {
            let (a, b) = all.split_at(faces * 32);
            faced(&[reversed(a), b.to_vec()].concat())
        };
        assert_eq!(with_turned(2).result, 0);
        let got = with_turned(4);
        assert_eq!((got.result, got.defects.inconsistent_edges), (128, 0));
        assert!(got.verdict.good && got.defects.volume > 0.0, "{:?}", got.verdict);
    }

    #[test]
    fn a_small_patch_is_left_to_its_neighbours() {
        let mut mesh = fine_box([0, 0, 0], [4, 4, 4], None);
        mesh[7] = reversed(&mesh[7..8])[0];
        assert_eq!(faced(&mesh).result, 0);
        assert_eq!(faced(&cuboid([0.0; 3], [1.0; 3])).result, 0);
    }

    #[test]
    fn the_points_spread_by_area_do_not_depend_on_their_order() {
        let all: Vec<Point> =
            (0..200u32).map(|n| Point::of([[0.0; 3], [1.0 + n as f32, 0.0, 0.0], [0.0, 1.0, 0.0]], n)).collect();
        let mut forward = Vec::new();
        all.iter().for_each(|p| note(&mut forward, *p));
        let mut backward = Vec::new();
        all.iter().rev().for_each(|p| note(&mut backward, *p));
        assert_eq!(forward.len(), POINTS);
        assert!(forward == backward);
    }
}
