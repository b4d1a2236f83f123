//! Is a place valid now?

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use super::regions::Cut;
use crate::algorithms::wrap::tree::{Corners, Tree};
use crate::geometry::distance::place;
use crate::geometry::position::{self, Position};
use crate::repairs::shared::context::Context;
use crate::repairs::shared::overlay::Overlay;
use crate::repairs::shared::work::Work;
use crate::submesh::components::nonmanifold_vertices;
use crate::submesh::{Submesh, Vertex};
use crate::util::union_find;

/// The place that a vertex or a new triangle belongs to.
pub(crate) struct Owners {
    of_vertex: HashMap<Vertex, u32>,
    first: u32,
    /// Vertices of patches that are of no rim.
    new: Vec<(Vertex, u32)>,
    /// By new triangle.
    of_new: Vec<Option<u32>>,
}

impl Owners {
    /// The vertices of what is cut out.
    pub(crate) fn of(submesh: &Submesh, cuts: &[Cut]) -> Self {
        let corners = |t: &u32| submesh.triangles[*t as usize].v;
        let of_vertex = cuts.iter().flat_map(|cut| cut.triangles.iter().flat_map(corners).map(|v| (v, cut.place))).collect();
        Self { of_vertex, first: 0, new: Vec::new(), of_new: Vec::new() }
    }

    pub(crate) fn of_vertex(&self, v: Vertex) -> Option<u32> {
        self.of_vertex.get(&v).copied()
    }

    /// Of a triangle that came with the patches.
    pub(crate) fn of_new(&self, t: u32) -> Option<u32> {
        self.of_new.get(t.checked_sub(self.first)? as usize).copied().flatten()
    }

    /// The triangles from `first` on are of the places that they hang together with, and so are their vertices.
    pub(crate) fn take_in(&mut self, submesh: &Submesh, first: u32) {
        let count = submesh.triangles.len() as u32 - first;
        let new = || first..first + count;
        let mut parents: Vec<u32> = (0..count).collect();
        let mut at: HashMap<Vertex, u32> = HashMap::new();
        for t in new().filter(|t| submesh.lives(*t)) {
            for v in submesh.triangles[t as usize].v {
                // Patches of two places are one only where they share a vertex of neither.
                if self.of_vertex(v).is_none() {
                    let known = *at.entry(v).or_insert(t - first);
                    union_find::unite(&mut parents, known, t - first);
                }
            }
        }
        let mut of_root: BTreeMap<u32, u32> = BTreeMap::new();
        for t in new().filter(|t| submesh.lives(*t)) {
            for owner in submesh.triangles[t as usize].v.into_iter().filter_map(|v| self.of_vertex(v)) {
                of_root.entry(union_find::find(&mut parents, t - first)).or_insert(owner);
            }
        }
        self.first = first;
        self.of_new = (0..count).map(|n| of_root.get(&union_find::find(&mut parents, n)).copied()).collect();
        for (v, n) in at.into_iter().collect::<BTreeMap<_, _>>() {
            if let Some(owner) = of_root.get(&union_find::find(&mut parents, n)) {
                self.of_vertex.insert(v, *owner);
                self.new.push((v, *owner));
            }
        }
    }
}

/// The verdict on some places.
#[derive(Default)]
pub(crate) struct Verdict {
    /// Where something is wrong still.
    pub(crate) blamed: BTreeSet<u32>,
    /// How far the surface of the others is from where it was.
    pub(crate) moved: BTreeMap<u32, f64>,
}

/// Looks at what was closed: the triangles from `first` on, and all around the vertices of the cuts. O(submesh), and a look at all boxes around
/// what is new.
pub(crate) fn verdict(cx: &mut Context<'_, '_>, cuts: &[Cut], owners: &Owners, first: u32) -> Verdict {
    let mut verdict = Verdict::default();
    if cuts.is_empty() {
        return verdict;
    }
    let there: BTreeSet<u32> = cuts.iter().map(|cut| cut.place).collect();
    let mut blamed = wrong(&mut cx.work, owners, first, cx.survey.threads());
    tracing::debug!(places = ?blamed, "Places where the surface is no manifold.");
    blamed.extend(taken(cx, owners));
    verdict.blamed = blamed.intersection(&there).copied().collect();
    if cx.profile.check_self_intersections {
        match crossing(cx, owners, first) {
            Some(crossing) => {
                tracing::debug!(places = ?crossing, "Places where something crosses.");
                verdict.blamed.extend(crossing.intersection(&there));
            }
            None => verdict.blamed = there,
        }
    }
    let mut come: BTreeMap<u32, Vec<Corners>> = BTreeMap::new();
    for t in (first..cx.work.triangles.len() as u32).filter(|t| cx.work.lives(*t)) {
        if let Some(owner) = owners.of_new(t) {
            come.entry(owner).or_default().push(cx.work.points(t));
        }
    }
    let farthest = cx.profile.wrap_max_move * cx.survey.bounds.diagonal();
    for cut in cuts.iter().filter(|cut| !verdict.blamed.contains(&cut.place)).collect::<Vec<_>>() {
        let moved = moved(&cx.work, cut, come.get(&cut.place).map_or(&[], |list| list));
        if moved > farthest {
            tracing::debug!(place = cut.place, moved, "A place would move too far.");
            verdict.blamed.insert(cut.place);
        }
        verdict.moved.insert(cut.place, moved);
    }
    verdict
}

/// Places with an edge that has not two coherent triangles, a vertex of several fans, or a triangle of no area.
fn wrong(work: &mut Work<'_>, owners: &Owners, first: u32, threads: usize) -> BTreeSet<u32> {
    let (submesh, edges) = work.edges();
    let mut wrong: BTreeSet<u32> = BTreeSet::new();
    for edge in edges.iter().filter(|e| e.uses.len() != 2 || e.is_inconsistent()) {
        // Edges between two of its vertices, and those of patches; others of its vertices are no worse than before.
        if let (Some(a), Some(b)) = (owners.of_vertex(edge.low), owners.of_vertex(edge.high)) {
            wrong.extend([a, b]);
        }
    }
    wrong.extend(nonmanifold_vertices(submesh, threads).into_iter().filter_map(|v| owners.of_vertex(v)));
    let new = (first..submesh.triangles.len() as u32).filter(|t| submesh.lives(*t));
    wrong.extend(new.filter(|t| submesh.is_collinear(*t)).filter_map(|t| owners.of_new(t)));
    wrong
}

/// Places with a new vertex where another one is: when the file is read they are one.
fn taken(cx: &Context<'_, '_>, owners: &Owners) -> BTreeSet<u32> {
    let new: Vec<(Position, u32)> =
        owners.new.iter().map(|(v, owner)| (Position::of(cx.work.positions[*v as usize]), *owner)).collect();
    let mut taken = BTreeSet::new();
    if new.is_empty() {
        return taken;
    }
    let at: HashMap<Position, u32> = new.iter().copied().collect();
    let is_new: HashSet<Vertex> = owners.new.iter().map(|(v, _)| *v).collect();
    let used: BTreeSet<Vertex> = cx.work.living().flat_map(|t| cx.work.triangles[t as usize].v).collect();
    let old = used.into_iter().filter(|v| !is_new.contains(v)).map(|v| cx.work.positions[v as usize]);
    taken.extend(old.filter_map(|p| at.get(&Position::of(p))));
    let mut places: Vec<(Position, u32)> = new;
    places.sort_unstable();
    taken.extend(places.windows(2).filter(|pair| pair[0].0 == pair[1].0).flat_map(|pair| [pair[0].1, pair[1].1]));
    let positions: Vec<[f32; 3]> = places.iter().map(|(p, _)| p.coordinates()).collect();
    for (irregular_triangle, _) in cx.survey.beyond_the_submesh(&positions) {
        let corners = position::corners(&cx.survey.records[irregular_triangle.triangle as usize]);
        taken.extend(corners.iter().filter_map(|p| at.get(&Position::of(*p))));
    }
    taken
}

/// Places whose new triangles cross anything. `None` if that is too much work to tell.
fn crossing(cx: &mut Context<'_, '_>, owners: &Owners, first: u32) -> Option<BTreeSet<u32>> {
    let overlay = Overlay::of(cx.survey, &cx.work, &cx.reversed)?;
    let pairs = overlay.met_by(cx.survey, &cx.work, |t| t >= first)?;
    let of_new = pairs.iter().flat_map(|pair| pair.triangles).filter_map(|number| overlay.changed_of(number));
    Some(of_new.filter_map(|t| owners.of_new(t)).collect())
}

/// The largest distance of what was cut out from what is there now, and back.
fn moved(submesh: &Submesh, cut: &Cut, come: &[Corners]) -> f64 {
    let gone: Vec<Corners> = cut.triangles.iter().map(|t| submesh.points(*t)).collect();
    let there: Vec<Corners> = come.iter().copied().chain(cut.stays.iter().map(|t| submesh.points(*t))).collect();
    let (before, after) = (Tree::new(&gone), Tree::new(&there));
    let farthest = |of: &[Corners], from: &Tree| {
        let points = of.iter().flat_map(|t| {
            let [a, b, c] = t.map(place);
            [a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0]
        });
        from.farthest(points)
    };
    farthest(&gone, &after).max(farthest(come, &before))
}
