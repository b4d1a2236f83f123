//! Where the surface is no solid's.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use crate::detect::holes::loops;
use crate::geometry::position::{self, Position};
use crate::repairs::boolean::resolve::join_in;
use crate::repairs::shared::context::Context;
use crate::repairs::shared::overlay::Which;
use crate::repairs::shared::work::Work;
use crate::submesh::components::{Reversed, nonmanifold_vertices};
use crate::submesh::{Origin, Vertex};
use crate::topology::survey::Survey;
use crate::util::union_find;

/// Triangles that are in the way of a solid, and hang together.
pub(crate) struct Place {
    /// Ascending.
    pub(crate) seeds: Vec<u32>,
    /// Those triangles that cross something or have no area: they cannot stay.
    pub(crate) crossing: BTreeSet<u32>,
}

/// All places, by their first triangle. The stars of all their corners are in the submesh then. `None` if it is too much work to tell.
pub(crate) fn find(cx: &mut Context<'_, '_>) -> Option<Vec<Place>> {
    let pairs = match cx.profile.check_self_intersections && cx.handed.may_cross {
        true => pairs(cx)?,
        false => Vec::new(),
    };
    let kept: BTreeSet<Position> = cx.handed.kept_open.iter().copied().map(Position::of).collect();
    let (submesh, edges) = cx.work.edges();
    // The edges of loops that were left open on purpose stay open.
    let mut left_open: BTreeSet<[Vertex; 2]> = BTreeSet::new();
    for rim in if kept.is_empty() { Vec::new() } else { loops::find(submesh, edges) } {
        if rim.vertices.iter().any(|v| kept.contains(&Position::of(submesh.positions[*v as usize]))) {
            let next = rim.vertices.iter().cycle().skip(1);
            left_open.extend(rim.vertices.iter().zip(next).map(|(a, b)| [*a.min(b), *a.max(b)]));
        }
    }
    let wrong = edges.iter().filter(|e| e.uses.len() != 2 || e.is_inconsistent());
    let wrong = wrong.filter(|e| !left_open.contains(&[e.low, e.high]));
    let mut seeds: BTreeSet<u32> = wrong.flat_map(|e| e.uses).map(|used| used.triangle()).collect();
    let on_purpose: BTreeSet<Vertex> = left_open.iter().flatten().copied().collect();
    for v in nonmanifold_vertices(submesh, cx.survey.threads()) {
        if !on_purpose.contains(&v) {
            seeds.extend(submesh.star(v).map(|(t, _)| t));
        }
    }
    let mut crossing: BTreeSet<u32> = pairs.iter().flatten().copied().collect();
    crossing.extend(submesh.living().filter(|t| submesh.is_collinear(*t)));
    seeds.extend(&crossing);
    let seeds: Vec<u32> = seeds.into_iter().collect();
    let found = united(&seeds, &pairs, |t| submesh.triangles[t as usize].v);
    let place = |seeds: Vec<u32>| Place { crossing: seeds.iter().filter(|t| crossing.contains(t)).copied().collect(), seeds };
    Some(found.into_iter().map(place).collect())
}

/// The pairs that cross, all of whose triangles are in the submesh then.
fn pairs(cx: &mut Context<'_, '_>) -> Option<Vec<[u32; 2]>> {
    let all = cx.crossing()?;
    let records = || all.iter().flatten().filter_map(|which| which.record());
    complete(cx, records().flat_map(|record| position::corners(&cx.survey.records[record as usize])).collect());
    let wanted: BTreeSet<u32> = all.iter().flatten().filter_map(|which| which.record()).collect();
    let here = cx.work.living().filter_map(|t| match cx.work.triangles[t as usize].origin {
        Origin::Input(record) if wanted.contains(&record) => Some((record, t)),
        _ => None,
    });
    let here: HashMap<u32, u32> = here.collect();
    let in_submesh = |which: Which| match which {
        Which::Submesh(t) => Some(t),
        Which::Record(record) => here.get(&record).copied(),
    };
    Some(all.iter().filter_map(|[a, b]| Some([in_submesh(*a)?, in_submesh(*b)?])).collect())
}

/// Triangles that share vertices, or are a pair, together; each list ascending, and the lists by their first ones.
pub(crate) fn united(all: &[u32], pairs: &[[u32; 2]], corners: impl Fn(u32) -> [Vertex; 3]) -> Vec<Vec<u32>> {
    let mut parents: Vec<u32> = (0..all.len() as u32).collect();
    let mut at: HashMap<Vertex, u32> = HashMap::new();
    for (n, t) in (0..).zip(all) {
        for v in corners(*t) {
            let first = *at.entry(v).or_insert(n);
            union_find::unite(&mut parents, first, n);
        }
    }
    let number = |t: &u32| all.binary_search(t).ok().map(|n| n as u32);
    for [a, b] in pairs {
        if let (Some(a), Some(b)) = (number(a), number(b)) {
            union_find::unite(&mut parents, a, b);
        }
    }
    let mut lists: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (n, t) in (0..).zip(all) {
        lists.entry(union_find::find(&mut parents, n)).or_default().push(*t);
    }
    let mut lists: Vec<Vec<u32>> = lists.into_values().collect();
    lists.sort_unstable();
    lists
}

/// Fetches the stars of the vertices at these positions that are not in the submesh.
pub(crate) fn complete(cx: &mut Context<'_, '_>, positions: Vec<[f32; 3]>) {
    complete_in(cx.survey, &mut cx.work, &cx.reversed, positions);
}

fn complete_in(survey: &mut Survey<'_>, work: &mut Work<'_>, reversed: &Reversed, mut positions: Vec<[f32; 3]>) {
    positions.sort_unstable_by_key(|p| Position::of(*p));
    positions.dedup_by_key(|p| Position::of(*p));
    if positions.is_empty() {
        return;
    }
    work.forget_unused();
    let known = work.by_position();
    positions.retain(|p| known.get(&Position::of(*p)).is_none_or(|v| !work.complete[*v as usize]));
    if positions.is_empty() {
        return;
    }
    let new = survey.promote(&positions);
    let first = work.extend_at(survey, &new, &positions);
    (first..work.triangles.len() as u32).for_each(|t| join_in(work, reversed, t));
}
