//! Lapping regions: a surface that ends on another one, within a tolerance by the size of the two, facing the same way.
//!
//! Where each of two pieces ends on the other, they overlap like shingles: the overlapping triangles of the smaller one go, so that the two
//! ends face each other across a gap, which is closed later. A piece that lies on another one as a whole goes as a whole: what was meant is
//! one surface, drawn twice. A piece on a surface that does not end there is left alone: nothing says that it was to be joined.

pub(crate) mod copies;
mod pieces;

use std::collections::BTreeMap;

use crate::contract::report::RepairName;
use crate::geometry::boxes::BoxTree;
use crate::geometry::position::Position;
use crate::geometry::sums::Bounds;
use crate::repairs::shared::context::{Changes, Done, Repair};
use crate::repairs::shared::work::Work;
use crate::repairs::stitch::layer::{Facet, Layer, Place, Reach, RimEdge, around};
use crate::repairs::stitch::weld;
use crate::submesh::edges::Edges;
use crate::submesh::near::{Tolerance, boundary_vertices};
use crate::submesh::{ByPosition, Origin, Submesh, Vertex};
use crate::topology::survey::Survey;

use pieces::{Member, Pieces, widened};

/// Surface that lies on other surface.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Overlap,
    changes: Changes::Surface,
    run: |cx| {
        let cut = cut_back(cx.survey, &mut cx.work, cx.tolerance);
        Ok(Done::count(cut, "triangles of surface that lay on another one, which faces the same way"))
    },
};

/// A piece may lap over several others: each takes part in one cut a round, so many times.
const ROUNDS: usize = 4;

/// Pairs of pieces that are looked at in a round, at most: each is a pass over the surface where their boxes meet.
const MOST_PAIRS: usize = 256;

/// What is cut off must lie on the other piece with this share of its area: surfaces that only cross at a small angle, or large triangles that
/// lap by little, do not.
const OVERLAP: f64 = 0.5;

/// Most triangles that a cut may take; they are worked on in memory.
const MOST_CUT: usize = 1 << 17;

/// Cuts back what laps over another surface; returns how many triangles went. O(n log n) in the boundary and the surface near it, which is
/// read if pieces end in each other's boxes.
pub(crate) fn cut_back(survey: &mut Survey<'_>, work: &mut Work<'_>, tolerance: &Tolerance) -> u64 {
    let mut removed = 0;
    for _ in 0..ROUNDS {
        let cuts = cuts(survey, work, tolerance);
        if cuts.is_empty() {
            break;
        }
        for cut in cuts {
            removed += cut.triangles.len() as u64;
            cut.make(survey, work, tolerance);
        }
    }
    removed
}

/// Two pieces, the smaller one first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Pair {
    pieces: [u32; 2],
    /// Each ends on the other; else one may lie on the other as a whole.
    lap: bool,
}

/// The triangles to be cut off.
struct Cut {
    triangles: Vec<Member>,
    /// Boundary vertices of the piece that is cut and of the other one, if they are to be joined, and within which distance.
    join: Option<([Vec<Vertex>; 2], f64)>,
}

/// Cuts that can be made side by side: no piece takes part in two of them.
fn cuts(survey: &Survey<'_>, work: &mut Work<'_>, tolerance: &Tolerance) -> Vec<Cut> {
    if tolerance.edge_share <= 0.0 || !work.edges().1.iter().any(|e| e.is_boundary()) {
        return Vec::new();
    }
    let pieces = Pieces::of(survey, work, tolerance);
    let (submesh, edges) = work.edges();
    let pairs = lapping(survey, submesh, &pieces);
    let mut taken = vec![false; pieces.list().len()];
    let mut cuts = Vec::new();
    for pair in pairs.into_iter().take(MOST_PAIRS) {
        if pair.pieces.iter().any(|piece| taken[*piece as usize]) {
            continue;
        }
        if let Some(cut) = cut(survey, submesh, edges, &pieces, pair, tolerance) {
            pair.pieces.iter().for_each(|piece| taken[*piece as usize] = true);
            cuts.push(cut);
        }
    }
    cuts
}

/// Pairs of pieces of which each ends on the other, or one lies on the other with all of its ends; the smaller one first.
fn lapping(survey: &Survey<'_>, submesh: &Submesh, pieces: &Pieces) -> Vec<Pair> {
    let neighbours = pieces.neighbours();
    let largest = pieces.sizes.iter().copied().fold(0.0, f64::max);
    let mut is_wanted = vec![false; neighbours.len()];
    neighbours.iter().flatten().for_each(|b| is_wanted[*b as usize] = true);
    let most = |(rim, share): &(RimEdge, f64)| pieces.reach_of(pieces.sizes[rim.piece as usize] + largest, *share);
    let ends: Vec<&(RimEdge, f64)> = pieces.rims.iter().filter(|(r, _)| !neighbours[r.piece as usize].is_empty()).collect();
    if ends.is_empty() {
        return Vec::new();
    }
    let boxes: Vec<Bounds> = ends.iter().map(|end| around(&[end.0.middle()], most(end).on)).collect();
    let Some(near) = pieces.gather(survey, submesh, |piece| is_wanted[piece as usize], &boxes) else { return Vec::new() };
    let facets = near.iter().map(|m| Facet::of(&m.corners, m.piece)).collect();
    let layer = Layer::new(facets, pieces.rims.iter().map(|(r, _)| *r).collect());
    // By piece and the one that it ends on: how many of its edges lie inside that one, and on it at all.
    let mut counts: BTreeMap<[u32; 2], [usize; 2]> = BTreeMap::new();
    let mut edges = vec![0; neighbours.len()];
    for end in ends {
        let (rim, share) = end;
        edges[rim.piece as usize] += 1;
        let is_neighbour = |piece: u32| neighbours[rim.piece as usize].binary_search(&piece).is_ok();
        let reach = |piece: u32| pieces.reach(rim.piece, piece, if is_neighbour(piece) { *share } else { 0.0 });
        for (piece, place) in layer.under(rim.middle(), rim.normal, most(end), reach) {
            let [inside, on] = counts.entry([rim.piece, piece]).or_default();
            *inside += usize::from(place == Place::Inside);
            *on += 1;
        }
    }
    let ends_inside = |a: u32, b: u32| counts.get(&[a, b]).is_some_and(|[inside, _]| *inside > 0);
    let mut pairs: Vec<Pair> = Vec::new();
    for ([a, b], [_, on]) in &counts {
        let is_covered = *on == edges[*a as usize];
        let lap = ends_inside(*a, *b) && ends_inside(*b, *a);
        if is_covered || lap {
            // Of equal ones the first stays.
            let order = |piece: u32| (pieces.list()[piece as usize].extent.area, std::cmp::Reverse(piece));
            pairs.push(Pair { pieces: if order(*a) < order(*b) { [*a, *b] } else { [*b, *a] }, lap });
        }
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// What is to be cut off of a pair: a piece that lies on the other one as a whole, or what laps, of the first one if something would be left of
/// it.
fn cut(survey: &Survey<'_>, submesh: &Submesh, edges: &Edges, pieces: &Pieces, pair: Pair, tolerance: &Tolerance) -> Option<Cut> {
    let Pair { pieces: pair, lap } = pair;
    let [a, b] = pair;
    let reach = pieces.reach(a, b, f64::INFINITY).rim;
    let [box_a, box_b] = pair.map(|piece| widened(&pieces.list()[piece as usize].bounds, reach));
    let both = box_a.overlap(&box_b)?;
    let members = pieces.gather(survey, submesh, |piece| pair.contains(&piece), &[both])?;
    let layers = pair.map(|piece| {
        let facets = members.iter().filter(|m| m.piece == piece).map(|m| Facet::of(&m.corners, piece)).collect();
        Layer::new(facets, pieces.rims_of(piece))
    });
    for [cut, stays] in [[0, 1], [1, 0]] {
        let on = On { layer: &layers[stays], reach, share: tolerance.edge_share };
        let mine: Vec<&Member> = members.iter().filter(|m| m.piece == pair[cut]).collect();
        let facets: Vec<Facet> = mine.iter().map(|m| Facet::of(&m.corners, m.piece)).collect();
        let is_whole = mine.len() as u64 == pieces.list()[pair[cut] as usize].triangles;
        if is_whole && mine.len() <= MOST_CUT && facets.iter().all(|f| on.covers(f)) && facets.iter().any(|f| on.meets(f)) {
            return Some(Cut { triangles: mine.into_iter().copied().collect(), join: None });
        }
        let met: Vec<(&Member, &Facet)> = mine.into_iter().zip(&facets).filter(|(_, f)| on.meets(f)).collect();
        let leaves_some = (met.len() as u64) < pieces.list()[pair[cut] as usize].triangles;
        let area: f64 = met.iter().map(|(_, f)| f.area()).sum();
        let overlapping: f64 = met.iter().map(|(_, f)| f.area() * on.share(f)).sum();
        if lap && !met.is_empty() && met.len() <= MOST_CUT && leaves_some && overlapping >= OVERLAP * area {
            let doomed = met.into_iter().map(|(member, _)| *member).collect();
            let boundary = boundary_vertices(edges);
            let of_piece = |piece: u32| {
                let is_of = |v: &Vertex| submesh.star(*v).any(|(t, _)| pieces.components.of_triangle[t as usize] == piece);
                boundary.iter().copied().filter(is_of).collect()
            };
            return Some(Cut { triangles: doomed, join: Some(([pair[cut], pair[stays]].map(of_piece), reach)) });
        }
    }
    None
}

/// A surface that triangles may lie on.
struct On<'l> {
    layer: &'l Layer,
    reach: f64,
    /// The reach is at most this share of a triangle's height.
    share: f64,
}

impl On<'_> {
    fn reach(&self, facet: &Facet) -> Reach {
        Reach { on: self.reach.min(self.share * facet.height()), rim: self.reach }
    }

    fn places(&self, facet: &Facet) -> impl Iterator<Item = Option<Place>> {
        let reach = self.reach(facet);
        let [a, b, c] = facet.corners;
        [facet.centre(), a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0]
            .into_iter()
            .map(move |p| self.layer.under(p, facet.normal, reach, |_| reach).first().map(|(_, place)| *place))
    }

    /// Does all of a triangle lie on it?
    fn covers(&self, facet: &Facet) -> bool {
        self.places(facet).all(|place| place.is_some())
    }

    /// How much of a triangle lies on it, about.
    fn share(&self, facet: &Facet) -> f64 {
        let (mut on, mut all) = (0.0, 0.0);
        self.places(facet).for_each(|place| {
            all += 1.0;
            on += if place.is_some() { 1.0 } else { 0.0 };
        });
        on / all
    }

    /// Does a part of a triangle lie on it, more than its edges on its rim?
    fn meets(&self, facet: &Facet) -> bool {
        self.places(facet).any(|place| place == Some(Place::Inside)) || self.layer.ends_over(facet, self.reach(facet))
    }
}

impl Cut {
    /// Fetches what is not in the submesh, removes it, and joins what is left to the other piece where both end.
    fn make(&self, survey: &mut Survey<'_>, work: &mut Work<'_>, tolerance: &Tolerance) {
        let by_position = work.by_position();
        let mut wanted: Vec<Position> = self.triangles.iter().flat_map(|m| m.corners.map(Position::of)).collect();
        wanted.retain(|p| by_position.get(p).is_none_or(|v| !work.complete[*v as usize]));
        wanted.sort_unstable();
        wanted.dedup();
        let wanted: Vec<[f32; 3]> = wanted.into_iter().map(Position::coordinates).collect();
        let mut doomed: Vec<u32> = self.triangles.iter().filter_map(|m| m.number.submesh()).collect();
        if !wanted.is_empty() {
            let new = survey.promote(&wanted);
            work.extend_at(survey, &new, &wanted);
            let mut records: Vec<u32> = self.triangles.iter().filter_map(|m| m.number.record()).collect();
            records.sort_unstable();
            doomed.extend((0..).zip(&work.triangles).filter_map(|(t, triangle)| match triangle.origin {
                Origin::Input(record) => records.binary_search(&record).is_ok().then_some(t),
                Origin::Part(_) | Origin::Added(_) => None,
            }));
        }
        doomed.iter().for_each(|t| work.kill(*t));
        if let Some(([moving, staying], reach)) = &self.join {
            // What is cut ends elsewhere now.
            let mut moving: Vec<Vertex> =
                doomed.iter().flat_map(|t| work.triangles[*t as usize].v).chain(moving.iter().copied()).collect();
            moving.sort_unstable();
            moving.dedup();
            join(survey, work, [&moving, staying], &Tolerance { weld: *reach, edge_share: tolerance.edge_share }, tolerance);
        }
    }
}

/// Brings boundary vertices of one piece that lie within reach of where the other one ends, but farther than the weld and the splitting of
/// edges would see, to a vertex there, or onto the edge.
fn join(survey: &Survey<'_>, work: &mut Work<'_>, [moving, staying]: [&[Vertex]; 2], reach: &Tolerance, seen: &Tolerance) {
    let (submesh, edges) = work.edges();
    let still: Vec<Vertex> = boundary_vertices(edges);
    let is_still = |v: &&Vertex| still.binary_search(v).is_ok();
    let staying: Vec<Vertex> = staying.iter().filter(is_still).copied().collect();
    let moving: Vec<Vertex> = moving.iter().filter(is_still).copied().collect();
    let is_in = |list: &[Vertex], v: Vertex| list.binary_search(&v).is_ok();
    let rims: Vec<RimEdge> = edges
        .iter()
        .filter(|e| e.is_boundary() && is_in(&staying, e.low) && is_in(&staying, e.high))
        .map(|e| RimEdge { ends: [submesh.place(e.low), submesh.place(e.high)], normal: glam::DVec3::ZERO, piece: 0 })
        .collect();
    let layer = Layer::new(Vec::new(), rims);
    let points = BoxTree::new(&staying.iter().map(|v| around(&[submesh.place(*v)], 0.0)).collect::<Vec<_>>());
    let (mut pairs, mut feet, mut found) = (Vec::new(), Vec::new(), Vec::new());
    for v in moving {
        let (p, most) = (submesh.place(v), reach.at(submesh, v));
        let wanted = around(&[p], most);
        if !staying.is_empty() {
            points.meeting(&wanted, &mut found);
        } else {
            found.clear();
        }
        let near = |w: Vertex| submesh.distance(v, w) <= most.min(reach.at(submesh, w));
        let nearest = found
            .iter()
            .map(|w| staying[*w as usize])
            .filter(|w| near(*w))
            .min_by(|a, b| submesh.distance(v, *a).total_cmp(&submesh.distance(v, *b)).then(a.cmp(b)));
        if let Some(w) = nearest {
            pairs.push((v.min(w), v.max(w)));
            continue;
        }
        let foot = layer
            .rims_near(&wanted)
            .into_iter()
            .map(|r| r.foot(p))
            .min_by(|a, b| p.distance_squared(*a).total_cmp(&p.distance_squared(*b)))
            .filter(|foot| (seen.at(submesh, v)..=most).contains(&p.distance(*foot)));
        feet.extend(foot.map(|foot| (v, Position::nearest(foot))));
    }
    let mut known = if feet.is_empty() { ByPosition::default() } else { work.by_position() };
    for (v, foot) in feet {
        // Where a vertex is already, the two would be one when the file is read.
        known.entry(foot).or_insert_with(|| {
            let there = work.add_vertex(foot);
            work.merge(there, v);
            there
        });
    }
    pairs.sort_unstable();
    weld::weld_pairs(survey, work, &pairs, reach.weld);
}

#[cfg(test)]
mod tests;
