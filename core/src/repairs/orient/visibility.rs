//! Which way surface faces where its neighbours do not tell: the way it is seen from outside.
//!
//! Neighbours that disagree tell that one of them is to be turned, and so for all that hang together what agrees with what, but neither which
//! side of it is out, nor if surface goes on there at all: bodies that were welded along an edge of each meet in it like halves of one surface. So
//! where much of a sheet would be turned, or sheets end at each other in non-manifold edges, it is looked at: of points on it, spread by area, rays
//! run along the axes, and those that meet nothing tell from which side it is seen (the idea of Takayama, Jacobson, Kavan & Sorkine-Hornung, "A
//! simple method for correcting facet orientations in polygon meshes based on ray casting", JCGT 3(4), 2014, who cast them in all directions).
//! `groups` weighs one against the other: a ray that escapes through a hole turns nothing that its neighbours hold. Edges between parts that
//! are both right, and disagree, stay: no surface goes on there, and they are balanced later.

use crate::contract::report::RepairName;
use crate::repairs::shared::context::{Changes, Done, Repair};
use std::cmp::Reverse;
use std::collections::BTreeMap;

use robust::Coord;

use crate::detect::bodies::{self, Direction, Source};
use crate::repairs::orient::directions::flip_node;
use crate::repairs::orient::groups::{self, Link, Part};
use crate::repairs::orient::points::first_points;
use crate::repairs::shared::work::Work;
use crate::submesh::Submesh;
use crate::submesh::components::{Component, Components, Reversed, Through};
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

/// A part is seen from one side if so many times as many points are seen from there as from the other.
const CLEARLY: usize = 2;

/// A ray begins so far from the surface, as a share of the largest coordinate: what rounding in f64 cannot do, and far less than f32 can tell.
const OFF: f64 = 1.0 / (1u64 << 40) as f64;

/// The triangles that were turned, and those that are settled.
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
    let by_neighbours = groups::turned(&surface.as_seen(&BTreeMap::new()), &surface.links);
    let looked_at = surface.worth_a_look(&by_neighbours);
    let is_asked = |p: u32| looked_at[surface.sheet_of[p as usize] as usize];
    let mut asked: Vec<u32> = (0..parts.len() as u32).filter(|p| is_asked(*p)).collect();
    if asked.is_empty() {
        return Faced::default();
    }
    asked.sort_by_key(|p| (Reverse(parts[*p as usize].extent.area), parts[*p as usize].sample));
    asked.truncate(MOST);
    let seen = seen(survey, submesh, reversed, &surface.parts, &asked);
    let mut turns = groups::turned(&surface.as_seen(&seen), &surface.links);
    (0..parts.len()).filter(|p| !is_asked(*p as u32)).for_each(|p| turns[p] = false);
    // Where hardly anything is seen otherwise than neighbours have it, they are to be followed everywhere.
    let all: i128 = parts.iter().map(|part| part.extent.area).sum();
    let is_contested = |p: &usize| is_asked(*p as u32) && turns[*p] != by_neighbours[*p];
    let contested: i128 = (0..parts.len()).filter(is_contested).map(|p| parts[p].extent.area).sum();
    if (contested as f64) < SMALL * all as f64 {
        return Faced::default();
    }
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
    /// Parts of one sheet that disagree where they meet.
    links: Vec<Link>,
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
        let area = |t: u32| survey.measure.triangle(&submesh.points(t)).area;
        let mut between: BTreeMap<[u32; 2], i128> = BTreeMap::new();
        let mut at_odds = vec![false; sheets.list.len()];
        for edge in edges.iter().filter(|edge| edge.is_unbalanced()) {
            match edge.uses {
                [_] => {}
                [a, b] => {
                    let beside = area(a.triangle()).min(area(b.triangle()));
                    let [a, b] = [a, b].map(|used| parts.of_triangle[used.triangle() as usize]);
                    *between.entry([a.min(b), a.max(b)]).or_insert(0) += beside;
                }
                uses => uses.iter().for_each(|used| at_odds[sheets.of_triangle[used.triangle() as usize] as usize] = true),
            }
        }
        let links = between.into_iter().filter(|([a, b], _)| a != b);
        let links = links.map(|(parts, area)| Link { parts, area: area as f64 }).collect();
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

    /// The parts with what is seen of them.
    fn as_seen(&self, seen: &BTreeMap<u32, Sightings>) -> Vec<Part> {
        let part = |(number, part): (u32, &Component)| {
            let area = part.extent.area as f64;
            let seen = seen.get(&number);
            Part {
                area,
                triangles: part.triangles,
                sample: part.sample,
                looked_at: seen.filter(|seen| !seen.is_ambiguous()).map_or(0.0, |_| area),
                front: seen.filter(|seen| !seen.is_ambiguous()).map_or(0.0, |seen| area * seen.seen_from_the_front()),
            }
        };
        (0..).zip(&self.parts.list).map(part).collect()
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
    /// Is the part seen from both sides, and from neither much more than from the other? A sheet is.
    fn is_ambiguous(&self) -> bool {
        let (less, more) = (self.front.min(self.back), self.front.max(self.back));
        more > 0 && more <= CLEARLY * less
    }

    /// The share of points seen from the front, less that of those seen from behind.
    fn seen_from_the_front(&self) -> f64 {
        (self.front as f64 - self.back as f64) / self.points as f64
    }
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
    // By direction: the points that are not seen edge-on, and whether each shows its back.
    let (mut towards, mut asked_of) = (Vec::new(), Vec::new());
    for direction in Direction::ALL {
        let Direction { axis, backward } = direction;
        let turns = |corners: &[[f32; 3]; 3]| {
            let [a, b, c] = corners.map(|p| {
                let [x, y, _] = direction.upright(p.map(f64::from));
                Coord { x, y }
            });
            robust::orient2d(a, b, c) * if backward { -1.0 } else { 1.0 }
        };
        let turned: Vec<(usize, f64)> =
            (0..all.len()).map(|i| (i, turns(&all[i].1.corners))).filter(|(_, turn)| *turn != 0.0).collect();
        let source = |(i, _): &(usize, f64)| {
            let mut from = bodies::inner_point(&all[*i].1.corners);
            from[axis] += if backward { -off } else { off };
            Source { from, component: NONE }
        };
        asked_of.push((direction, turned.iter().map(source).collect::<Vec<Source>>()));
        towards.push(turned);
    }
    let met = bodies::obstructed(survey, submesh, parts, &asked_of, |_| true);
    // By point: is it seen from the front, from behind?
    let mut sides = vec![[false; 2]; all.len()];
    for ((i, turn), _) in towards.into_iter().flatten().zip(met.into_iter().flatten()).filter(|(_, met)| !met) {
        sides[i][usize::from(turn < 0.0)] = true;
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
}
