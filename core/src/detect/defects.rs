//! Counts the defects of a mesh from its survey and its untouched submesh. Definitions: `core/DEFECTS.md`.

use crate::contract::report::Defects;
use crate::detect::bodies;
use crate::geometry::sums::Extent;
use crate::submesh::Submesh;
use crate::submesh::components::{self, Components, Reversed, Through};
use crate::submesh::edges::Edges;
use crate::submesh::near::{self, Tolerance};
use crate::topology::survey::Survey;
use crate::util::bits;
use crate::util::parallel;
use crate::util::radix;
use crate::util::scatter::Hashing;
use std::hash::BuildHasher;

/// Submeshs of fewer triangles are counted by one thread: starting another would take longer.
const COUNTED_BY_ONE: usize = 4096;

/// All counts of one file. The submesh must be as gathered.
pub(crate) fn count(survey: &Survey<'_>, submesh: &Submesh, edges: &Edges, tolerance: &Tolerance) -> Defects {
    let reversed = Reversed::none(survey);
    let threads = if submesh.triangles.len() < COUNTED_BY_ONE { 1 } else { survey.threads() };
    let (components, by_edges) = parallel::both(
        threads,
        || Components::of(survey, submesh, edges, &reversed, Through::EveryEdge),
        || count_by_edges(submesh, edges, tolerance, threads),
    );
    let degenerate_index = submesh.triangles.len() as u64 - submesh.living().count() as u64;
    let uses: usize = edges.iter().map(|e| e.uses.len()).sum();
    let topology = survey.triangles - degenerate_index;
    let total = survey
        .regions
        .iter()
        .map(|p| p.extent)
        .chain(submesh.living().map(|t| survey.measure.triangle(&submesh.points(t))))
        .fold(Extent::default(), |mut sum, e| {
            sum += e;
            sum
        });
    let mut defects = Defects {
        triangles: survey.triangles,
        nonfinite: survey.nonfinite.iter().map(|run| u64::from(run.1)).sum(),
        vertices: survey.vertices,
        vertices_used: survey.vertices_used,
        // Edges without a complete end have two triangles each.
        edges: edges.len() as u64 + (3 * topology - uses as u64) / 2,
        degenerate_index,
        components: components.list.len() as u64,
        self_intersections: survey.self_intersections.clone(),
        bounds: (!survey.bounds.is_empty()).then_some([survey.bounds.lo, survey.bounds.hi]),
        area: survey.measure.area(total),
        volume: survey.measure.volume(total) + survey.volume_beside,
        ..by_edges
    };
    if defects.boundary_edges + defects.nonmanifold_edges + defects.nonmanifold_vertices == 0 {
        defects.euler = Some(defects.vertices_used as i64 - defects.edges as i64 + topology as i64);
    }
    count_bodies(survey, submesh, &components, &reversed, &mut defects);
    defects
}

/// What the submesh's edges and triangles tell without what hangs together beyond it.
fn count_by_edges(submesh: &Submesh, edges: &Edges, tolerance: &Tolerance, threads: usize) -> Defects {
    let (duplicates_same, duplicates_opposite) = duplicates(submesh);
    Defects {
        degenerate_area: submesh.living().filter(|t| submesh.is_collinear(*t)).count() as u64,
        duplicates_same,
        duplicates_opposite,
        boundary_edges: edges.iter().filter(|e| e.is_boundary()).count() as u64,
        boundary_loops: components::boundary_loops(submesh, edges),
        nonmanifold_edges: edges.iter().filter(|e| e.is_nonmanifold()).count() as u64,
        nonmanifold_vertices: components::nonmanifold_vertices(submesh, threads).len() as u64,
        inconsistent_edges: edges.iter().filter(|e| e.is_inconsistent()).count() as u64,
        unbalanced_edges: edges.iter().filter(|e| e.is_unbalanced()).count() as u64,
        noncommon_vertices: near::noncommon_vertices(submesh, edges, tolerance, threads).len() as u64,
        weldable_vertices: near::weldable_vertices(submesh, edges, tolerance, threads).len() as u64,
        ..Defects::default()
    }
}

fn count_bodies(survey: &Survey<'_>, submesh: &Submesh, components: &Components, reversed: &Reversed, defects: &mut Defects) {
    let around = bodies::surroundings(survey, submesh, components, reversed, |c| !c.open);
    for (component, around) in components.list.iter().zip(&around).filter(|(c, _)| !c.open) {
        let inside = around.winding() > 0;
        match component.extent.volume.signum() {
            1 if inside => defects.nested_positive += 1,
            1 => defects.bodies += 1,
            -1 if inside => defects.cavities += 1,
            -1 => defects.inverted_components += 1,
            _ => {}
        }
    }
}

/// The vertices of a triangle, ascending: the same for all triangles on them.
pub(crate) fn vertex_set(submesh: &Submesh, t: u32) -> [u32; 3] {
    let mut v = submesh.triangles[t as usize].v;
    v.sort_unstable();
    v
}

/// Living triangles by vertex set: (sorted vertices, number), sorted.
pub(crate) fn by_vertex_set(submesh: &Submesh) -> Vec<([u32; 3], u32)> {
    let mut keys: Vec<([u32; 3], u32)> = submesh.living().map(|t| (vertex_set(submesh, t), t)).collect();
    radix::sort_by_number(&mut keys, |(v, _)| v[0]);
    keys.chunk_by_mut(|a, b| a.0[0] == b.0[0]).for_each(<[_]>::sort_unstable);
    keys
}

/// As [`by_vertex_set`], without nearly all triangles that are alone on their vertices.
pub(crate) fn shared_vertex_sets(submesh: &Submesh) -> Vec<([u32; 3], u32)> {
    let sets = || submesh.living().map(|t| (vertex_set(submesh, t), t));
    let slots = (8 * submesh.triangles.len()).next_power_of_two().max(64);
    let slot = |v: &[u32; 3]| Hashing::default().hash_one(v) as usize & (slots - 1);
    let mut once = vec![0u64; slots / 64];
    let mut again = once.clone();
    for at in sets().map(|(v, _)| slot(&v)) {
        let known = if bits::holds(&once, at) { &mut again } else { &mut once };
        bits::put(known, at);
    }
    let mut keys: Vec<([u32; 3], u32)> = sets().filter(|(v, _)| bits::holds(&again, slot(v))).collect();
    keys.sort_unstable();
    keys
}

/// As [`by_vertex_set`], of all triangles on the vertices of a changed one. O(stars of the changed ones); of a triangle's three stars
/// only as much is looked at as the smallest has.
pub(crate) fn by_vertex_set_of(submesh: &Submesh, changed: &[u32]) -> Vec<([u32; 3], u32)> {
    let mut sets: Vec<[u32; 3]> = changed.iter().filter(|t| submesh.lives(**t)).map(|t| vertex_set(submesh, *t)).collect();
    sets.sort_unstable();
    sets.dedup();
    let mut all = Vec::new();
    for set in sets {
        let mut stars = set.map(|v| submesh.star(v));
        let smallest = (0..3).cycle().find(|k| stars[*k].next().is_none()).unwrap_or(0);
        let first = all.len();
        all.extend(submesh.star(set[smallest]).map(|(t, _)| (set, t)).filter(|(_, t)| vertex_set(submesh, *t) == set));
        all[first..].sort_unstable();
    }
    all
}

/// Whether two triangles on one vertex set run the same way round.
pub(crate) fn same_direction(a: [u32; 3], b: [u32; 3]) -> bool {
    let k = b.iter().position(|v| *v == a[0]).unwrap_or(0);
    b[(k + 1) % 3] == a[1]
}

/// Triangles whose vertex set stands earlier: (with that direction, only in the other one).
fn duplicates(submesh: &Submesh) -> (u64, u64) {
    let (mut same, mut opposite) = (0, 0);
    for group in shared_vertex_sets(submesh).chunk_by(|a, b| a.0 == b.0) {
        let corners = |g: &([u32; 3], u32)| submesh.triangles[g.1 as usize].v;
        for (i, later) in group.iter().enumerate().skip(1) {
            if group[..i].iter().any(|earlier| same_direction(corners(earlier), corners(later))) {
                same += 1;
            } else {
                opposite += 1;
            }
        }
    }
    (same, opposite)
}
