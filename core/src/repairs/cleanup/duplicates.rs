//! Triangles with a repeated vertex, and several triangles on the same three vertices.
//!
//! Of closed surfaces that are drawn again one drawing stays ([`drawn_again`]). Of other copies in one direction the first stays, unless the surface is closed
//! only with all of them. Of triangles in both directions [`back_to_back`] says which go.

use crate::contract::report::RepairName;
use crate::contract::settings::Bodies;
use crate::detect::defects::{by_vertex_set, by_vertex_set_of, same_direction};
use crate::repairs::cleanup::back_to_back::{self, Pair};
use crate::repairs::cleanup::{drawn_again, walls};
use crate::repairs::shared::context::{Changes, Done, Repair};
use crate::repairs::shared::work::{Pass, Work};
use crate::submesh::edges::Edges;
use crate::submesh::{Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::words::Count;

/// Walls that may have been surface that is drawn twice are told of from this share of all area.
const SPECK: f64 = 1e-3;

/// What the report says of copies that are gone.
pub(crate) const NOTE: &str = "triangles on the vertices of another one";

/// Copies of triangles.
pub(crate) const DUPLICATE: Repair = Repair {
    name: RepairName::Duplicate,
    changes: Changes::Surface,
    run: |cx| {
        let dropped = drop_duplicates(cx.survey, &mut cx.work, cx.profile.bodies);
        let note = "triangles of walls that bodies had in common removed: these bodies are one body now";
        cx.account.add(RepairName::CommonWall, dropped.walls, note.into(), 0.0);
        if dropped.unsure > 0 {
            cx.account.doubts.push(format!(
                "{} triangles of walls in common were removed, many of which face the same way: they may have been the wall of a cavity, drawn twice",
                Count(dropped.unsure)
            ));
        }
        Ok(Done { changed: dropped.all > 0, ..Done::count(dropped.all - dropped.walls, NOTE) })
    },
};

/// Removes triangles with a repeated vertex. Their edges cancel out, so nothing opens.
pub(crate) fn drop_repeated(work: &mut Work<'_>) -> u64 {
    let changed = work.changed_for(Pass::Repeated);
    let is_repeated = |t: &u32| work.triangles[*t as usize].alive && !work.lives(*t);
    let doomed: Vec<u32> = match changed {
        None => (0..work.triangles.len() as u32).filter(is_repeated).collect(),
        Some(changed) => changed.into_iter().filter(is_repeated).collect(),
    };
    doomed.iter().for_each(|t| work.kill(*t));
    doomed.len() as u64
}

/// How many triangles were removed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Dropped {
    pub(crate) all: u64,
    /// Of these, walls that two bodies had in common: the bodies are one now.
    pub(crate) walls: u64,
    /// Of these, such as may have been surface that is drawn twice, if they are a considerable part of the surface.
    pub(crate) unsure: u64,
}

/// Removes surplus triangles on the same three vertices. `bodies`: whether walls that bodies have in common may go.
pub(crate) fn drop_duplicates(survey: &Survey<'_>, work: &mut Work<'_>, bodies: Bodies) -> Dropped {
    // Afterwards no two are on the same vertices, and only a new vertex makes another copy.
    let changed = work.changed_for(Pass::Copies);
    let (candidates, again) = match &changed {
        None => {
            let mut all = by_vertex_set(work);
            let again = drop_drawn_again(work, &mut all);
            (all, again)
        }
        Some(changed) => (by_vertex_set_of(work, changed), 0),
    };
    let dropped = drop_others(survey, work, &candidates, changed.as_deref(), bodies);
    Dropped { all: dropped.all + again, ..dropped }
}

/// Removes what is drawn again of closed surfaces, and takes it out of all triangles by vertex set.
fn drop_drawn_again(work: &mut Work<'_>, all: &mut Vec<([Vertex; 3], u32)>) -> u64 {
    let (submesh, edges) = work.edges();
    let again = drawn_again::surplus(submesh, edges, all);
    if !again.is_empty() {
        work.is_changed_by(RepairName::Duplicate);
        again.iter().for_each(|t| work.kill(*t));
        all.retain(|(_, t)| work.lives(*t));
    }
    again.len() as u64
}

/// Removes other triangles on the vertices of another one, of those by vertex set. `changed`: all that have, if not all may be in walls.
fn drop_others(
    survey: &Survey<'_>,
    work: &mut Work<'_>,
    candidates: &[([Vertex; 3], u32)],
    changed: Option<&[u32]>,
    bodies: Bodies,
) -> Dropped {
    let mut copies = Vec::new();
    let mut pairs: Vec<Pair> = Vec::new();
    for group in candidates.chunk_by(|a, b| a.0 == b.0).filter(|g| g.len() > 1) {
        let first = work.triangles[group[0].1 as usize].v;
        let (forward, backward): (Vec<u32>, Vec<u32>) =
            group.iter().map(|g| g.1).partition(|t| same_direction(first, work.triangles[*t as usize].v));
        if backward.is_empty() && forward.len() > 2 {
            copies.extend(&forward[1..]);
        } else {
            pairs.push(Pair { forward, backward, rim: Box::default() });
        }
    }
    let (submesh, edges) = work.edges();
    pairs.extend(walls::between(submesh, edges, changed, survey.bounds.diagonal()));
    if pairs.is_empty() && copies.is_empty() {
        return Dropped::default();
    }
    let (submesh, edges) = work.edges();
    let apart = Pair::set_apart(submesh, edges, &mut pairs);
    copies.extend(apart.iter().map(|pair| pair.forward[1]));
    copies.sort_unstable();
    let mut doomed = spare(submesh, edges, &copies);
    let surplus = back_to_back::surplus(survey, submesh, edges, &pairs, &doomed);
    doomed.extend(&surplus.sides);
    let unsure = if bodies == Bodies::Keep || is_speck(survey, work, &surplus.unsure) { 0 } else { surplus.unsure.len() as u64 };
    work.is_changed_by(RepairName::Duplicate);
    doomed.iter().for_each(|t| work.kill(*t));
    // Bodies that are kept keep their walls, whole or not.
    let (walls, halves) = if bodies == Bodies::Keep { (&[][..], &[][..]) } else { (&surplus.common[..], &surplus.halves[..]) };
    work.is_changed_by(RepairName::CommonWall);
    walls.iter().chain(halves).for_each(|t| work.kill(*t));
    Dropped { all: (doomed.len() + walls.len() + halves.len()) as u64, walls: walls.len() as u64, unsure }
}

/// Are these triangles together no more than a speck of the surface? O(submesh), if there are any.
fn is_speck(survey: &Survey<'_>, work: &mut Work<'_>, triangles: &[u32]) -> bool {
    if triangles.is_empty() {
        return true;
    }
    let all: i128 = work.components(survey).list.iter().map(|piece| piece.extent.area).sum();
    let part: i128 = triangles.iter().map(|t| survey.measure.triangle(&work.points(*t)).area).sum();
    part as f64 <= SPECK * all as f64
}

/// Those of the copies without which the surface is no farther from closed. Where two bodies have part of their surface in common, each needs
/// its own.
pub(crate) fn spare(submesh: &Submesh, edges: &Edges, copies: &[u32]) -> Vec<u32> {
    let mut uses: Vec<(u32, u32, i64)> = Vec::with_capacity(3 * copies.len());
    for (i, t) in (0..).zip(copies) {
        let v = submesh.triangles[*t as usize].v;
        for k in 0..3 {
            let (a, b) = (v[k], v[(k + 1) % 3]);
            uses.extend(edges.number(a, b).map(|edge| (edge, i, if a < b { 1 } else { -1 })));
        }
    }
    uses.sort_unstable();
    let mut parents: Vec<u32> = (0..copies.len() as u32).collect();
    for around in uses.chunk_by(|a, b| a.0 == b.0) {
        around.iter().for_each(|(_, i, _)| {
            crate::util::union_find::unite(&mut parents, around[0].1, *i);
        });
    }
    // By set of copies that hang together: by how much more often its edges are used one way than the other without it, against now.
    let mut worse = vec![0i64; copies.len()];
    for around in uses.chunk_by(|a, b| a.0 == b.0) {
        let now: i64 = edges.get(around[0].0 as usize).uses.iter().map(|u| if u.forward() { 1 } else { -1 }).sum();
        let without = now - around.iter().map(|(_, _, way)| way).sum::<i64>();
        worse[crate::util::union_find::find(&mut parents, around[0].1) as usize] += without.abs() - now.abs();
    }
    (0..)
        .zip(copies)
        .filter(|(i, _)| worse[crate::util::union_find::find(&mut parents, *i) as usize] <= 0)
        .map(|(_, t)| *t)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::Diagnosis;
    use crate::testing::{after, cube, cuboid, reversed};

    fn dropped(d: &mut Diagnosis<'_>) -> u64 {
        drop_duplicates(&d.survey, &mut Work::new(&mut d.submesh), Bodies::Union).all
    }

    #[test]
    fn of_a_reversed_copy_the_one_that_fits_stays() {
        // The wrong one comes first: the order in the file does not decide.
        let doubled = [reversed(&cube()[..1]), cube()].concat();
        let got = after(&doubled, |d, _| dropped(d));
        assert_eq!((got.result, got.untouched), (1, 12));
        assert!(got.verdict.good, "{:?}", got.verdict);
    }

    #[test]
    fn a_wall_of_no_thickness_inside_a_body_goes() {
        // Two cubes that touch: both have the face between them, in opposite directions.
        let cubes = [cube(), cuboid([1.0, 0.0, 0.0], [2.0, 1.0, 1.0])].concat();
        let got = after(&cubes, |d, _| dropped(d));
        assert_eq!(got.result, 4);
        assert!(got.verdict.good && (got.defects.volume - 2.0).abs() < 1e-9, "{:?}", got.defects);
    }

    #[test]
    fn of_a_surface_with_both_sides_one_stays() {
        let both = [cube(), reversed(&cube())].concat();
        let got = after(&both, |d, _| dropped(d));
        assert_eq!(got.result, 12);
        assert!(got.verdict.good, "{:?}", got.verdict);
    }

    #[test]
    fn two_triangles_on_their_own_enclose_nothing() {
        let alone = [&cube()[..1], &reversed(&cube()[..1])].concat();
        let got = after(&alone, |d, _| dropped(d));
        assert_eq!((got.result, got.defects.triangles), (2, 0));
    }

    #[test]
    fn what_two_bodies_have_in_common_stays_with_both() {
        // Two boxes with the same bottom, one of them higher.
        let both = [cube(), cuboid([0.0; 3], [1.0, 1.0, 2.0])].concat();
        let got = after(&both, |d, _| dropped(d));
        assert_eq!((got.result, got.defects.boundary_edges, got.defects.unbalanced_edges), (0, 0, 0));
        // A triangle that stands there twice stays once.
        let got = after(&[&both[..], &both[2..3]].concat(), |d, _| dropped(d));
        assert_eq!((got.result, got.defects.unbalanced_edges), (1, 0));
    }

    #[test]
    fn of_equal_copies_the_first_stays() {
        let twice = [cube(), cube()].concat();
        let got = after(&twice, |d, _| dropped(d));
        assert_eq!((got.result, got.untouched), (12, 12));
        assert!(got.verdict.good);
    }
}
