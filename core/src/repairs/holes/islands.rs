//! Islands: a loose piece of surface inside a hole is joined to the hole's rim, so that one patch closes both.
//!
//! Filled each for itself, the hole would be closed underneath the island and the island become a body of nearly no thickness. One patch is
//! laid between the hole's rim and those of all its islands; one that touches the rim in a vertex is walked around with it. Where that is not to be had, two triangles between the nearest vertices of two
//! rims make one simple loop of them, which is then filled like any other.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use crate::algorithms::triangulate::{self, Rim};
use crate::contract::report::RepairName;
use crate::detect::holes::loops::Loop;
use crate::geometry::boxes::BoxTree;
use crate::geometry::exact::Point;
use crate::geometry::sums::Bounds;
use crate::repairs::holes::patches::concatenated;
use crate::repairs::shared::work::Work;
use crate::submesh::{Origin, Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// Holes, each with its islands: some pairs of loops look like one and the other; a lone sheet that none of them holds lies in the smallest
/// hole whose box holds its middle. O(submesh) if there are any.
pub(crate) fn groups(
    survey: &Survey<'_>,
    work: &mut Work<'_>,
    rims: &[Loop],
    pairs: &[[usize; 2]],
    is_sheet: impl Fn(&Loop) -> bool,
) -> Vec<Vec<usize>> {
    let sheets: Vec<usize> = (0..rims.len()).filter(|i| is_sheet(&rims[*i])).collect();
    if pairs.is_empty() && sheets.is_empty() {
        return Vec::new();
    }
    let components = work.components(survey);
    let submesh: &Submesh = work;
    let component = |rim: usize| components.of_triangle[rims[rim].triangles[0] as usize];
    let mut loops_of = vec![0u32; components.list.len()];
    (0..rims.len()).for_each(|rim| loops_of[component(rim) as usize] += 1);
    let mut inside: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    let bounds: Vec<Bounds> = rims.iter().map(|rim| Bounds::of(&rim.points(submesh))).collect();
    let tree = BoxTree::new(&bounds);
    let mut found = Vec::new();
    let known: BTreeSet<usize> = pairs.iter().map(|[_, island]| *island).collect();
    let mut pairs = pairs.to_vec();
    for sheet in sheets.into_iter().filter(|sheet| !known.contains(sheet)) {
        let Bounds { lo, hi } = bounds[sheet];
        let middle: [f32; 3] = std::array::from_fn(|k| 0.5 * lo[k] + 0.5 * hi[k]);
        tree.meeting(&Bounds { lo: middle, hi: middle }, &mut found);
        let length = rims[sheet].perimeter(submesh);
        let around = found.iter().map(|hole| *hole as usize).filter(|hole| !is_sheet(&rims[*hole]));
        let around = around.map(|hole| (rims[hole].perimeter(submesh), hole)).filter(|(perimeter, _)| *perimeter > length);
        pairs.extend(around.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|(_, hole)| [hole, sheet]));
    }
    for [hole, island] in pairs {
        let [of_hole, of_island] = [hole, island].map(|rim| component(rim) as usize);
        let area = components.list[of_island].extent.area;
        // An island has no other rim, and is smaller than the rest of what it belongs to. (A hole's component may be an island no more.)
        if loops_of[of_island] == 1 && of_hole != of_island && area < components.list[of_hole].extent.area {
            inside.entry(hole).or_insert_with(|| vec![hole]).push(island);
        }
    }
    inside.into_values().collect()
}

/// Holes with islands that touch their rims, or each other, in one vertex: the numbers of the loops, the hole's first, and the way around
/// all of them. Of the loops that one way was cut into, the largest is the hole's, and those that turn against it are islands'.
/// O(loops), and the square of what one way was cut into.
pub(crate) fn touching(submesh: &Submesh, rims: &[Loop]) -> Vec<(Vec<usize>, Loop)> {
    let mut of_way: Vec<usize> = (0..rims.len()).collect();
    of_way.sort_by_key(|i| rims[*i].way);
    let mut groups = Vec::new();
    for same in of_way.chunk_by(|a, b| rims[*a].way == rims[*b].way).filter(|same| (2..=MAX_TOUCHING).contains(&same.len())) {
        let mut areas: Vec<(DVec3, usize)> =
            same.iter().map(|i| (triangulate::directed_area(&rims[*i].points(submesh)), *i)).collect();
        areas.sort_by(|a, b| b.0.length().total_cmp(&a.0.length()).then(a.1.cmp(&b.1)));
        let (of_hole, hole) = areas[0];
        let mut left: Vec<usize> = areas[1..].iter().filter(|(area, _)| area.dot(of_hole) < 0.0).map(|(_, i)| *i).collect();
        let (mut group, mut way) = (vec![hole], rims[hole].clone());
        while let Some((at, longer)) = left.iter().enumerate().find_map(|(at, i)| Some((at, way.with(&rims[*i])?))) {
            group.push(left.remove(at));
            way = longer;
        }
        if group.len() > 1 {
            groups.push((group, way));
        }
    }
    groups
}

/// No way that was cut into more loops than this is looked at.
const MAX_TOUCHING: usize = 64;

/// One patch for a hole and the islands that touch its rim.
pub(crate) fn patch_touching(submesh: &Submesh, way: &Loop) -> Option<Vec<[Vertex; 3]>> {
    let (points, apexes) = (way.points(submesh), way.apexes(submesh));
    let forbidden = |i: u32, j: u32| submesh.has_edge(way.vertices[i as usize], way.vertices[j as usize]);
    let patch = triangulate::pinched(&Rim { points: &points, apexes: &apexes, obstacles: &[], forbidden: &forbidden }).ok()?;
    Some(patch.into_iter().map(|t| t.map(|i| way.vertices[i as usize])).collect())
}

/// Joins the rims of islands to that of their hole, the first of a group, by two triangles each, which are put in; returns them.
pub(crate) fn join_all(work: &mut Work<'_>, group: &[&Loop]) -> Vec<u32> {
    let mut outer = group[0].vertices.clone();
    let mut joints = Vec::new();
    for island in &group[1..] {
        if let Some((joined, triangles)) = join(work, &outer, &island.vertices) {
            outer = joined;
            joints.extend(triangles.map(|t| work.add(t, Origin::Added(RepairName::Fill), NONE)));
        }
    }
    joints
}

/// One patch between a hole's rim and those of its islands.
pub(crate) fn patch(submesh: &Submesh, group: &[&Loop]) -> Option<Vec<[Vertex; 3]>> {
    let vertices = concatenated(group);
    let shapes: Vec<(Vec<Point>, Vec<Option<Point>>)> =
        group.iter().map(|rim| (rim.points(submesh), rim.apexes(submesh))).collect();
    let chords: Vec<_> = group
        .iter()
        .map(|rim| move |i: u32, j: u32| submesh.has_edge(rim.vertices[i as usize], rim.vertices[j as usize]))
        .collect();
    let rims: Vec<Rim<'_>> = shapes
        .iter()
        .zip(&chords)
        .map(|((points, apexes), forbidden)| Rim { points, apexes, obstacles: &[], forbidden })
        .collect();
    let joined = |i: u32, j: u32| submesh.has_edge(vertices[i as usize], vertices[j as usize]);
    let patch = triangulate::around_islands(&rims.iter().collect::<Vec<_>>(), &joined).ok()?;
    Some(patch.into_iter().map(|t| t.map(|i| vertices[i as usize])).collect())
}

/// Joins two rims at their nearest vertices: the loop that is left, and the two triangles.
fn join(submesh: &Submesh, outer: &[Vertex], inner: &[Vertex]) -> Option<(Vec<Vertex>, [[Vertex; 3]; 2])> {
    let (n, m) = (outer.len(), inner.len());
    let mut best: Option<(f64, usize, usize)> = None;
    for (i, v) in outer.iter().enumerate() {
        for (j, w) in inner.iter().enumerate() {
            let away = submesh.distance(*v, *w);
            if best.is_none_or(|(d, ..)| away < d) {
                best = Some((away, i, j));
            }
        }
    }
    let (_, i, j) = best?;
    let (a, a_next) = (outer[i], outer[(i + 1) % n]);
    let (b, b_last) = (inner[j], inner[(j + m - 1) % m]);
    let triangles = [[a, a_next, b], [b_last, b, a_next]];
    let flat = |t: &[Vertex; 3]| {
        let [p, q, r] = t.map(|v| &submesh.positions[v as usize]);
        crate::geometry::collinear::is_collinear(p, q, r)
    };
    let new_edges = [(a, b), (a_next, b), (a_next, b_last)];
    if triangles.iter().any(flat) || new_edges.iter().any(|(p, q)| submesh.has_edge(*p, *q)) {
        return None;
    }
    let way = (0..n).map(|k| outer[(i + 1 + k) % n]).chain((0..m).map(|k| inner[(j + k) % m]));
    Some((way.collect(), triangles))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::settings::Profile;
    use crate::detect::holes::{self, loops, owners::Owners};
    use crate::repairs::holes::fill;
    use crate::testing::{Corners, after, plate, shifted};

    /// Loops closed together with islands, and components and loops that are left, if those up to this length are closed.
    fn bridged(triangles: &[Corners], longest: f64) -> (u64, u64, u64) {
        let rim_stays = Profile { max_hole_perimeter_mm: longest, ..Profile::default() };
        let got = after(triangles, |d, _| fill::fill(d, &rim_stays));
        assert_eq!((got.defects.nonmanifold_edges, got.defects.inconsistent_edges), (0, 0));
        let islands = got.result.by_method.iter().filter(|(name, _)| name.starts_with("islands")).map(|(_, n)| n).sum();
        (islands, got.defects.components, got.defects.boundary_loops)
    }

    #[test]
    fn an_island_is_joined_to_the_hole_around_it() {
        let ring = plate(8, |x, y| !(1..7).contains(&x) || !(1..7).contains(&y));
        let island = plate(8, |x, y| (3..5).contains(&x) && (3..5).contains(&y));
        // The plate's own rim is left.
        assert_eq!(bridged(&[ring.clone(), island.clone()].concat(), 31.0), (2, 1, 1));
        // Beside the ring it is in no hole, but a sheet of its own.
        assert_eq!(bridged(&[ring, shifted(&island, [20.0, 0.0, 0.0])].concat(), 31.0), (0, 2, 2));
    }

    #[test]
    fn several_islands_in_a_domed_hole_are_closed_by_one_patch() {
        let keep = |x: u8, y: u8| x.min(y) < 2 || x.max(y) > 13 || [(4, 4), (5, 4), (10, 9), (5, 9)].contains(&(x, y));
        let dome = |[x, y, _]: [f32; 3]| [x, y, 10.0 - 0.15 * ((x - 8.0) * (x - 8.0) + (y - 8.0) * (y - 8.0))];
        let open: Vec<Corners> = plate(16, keep).iter().map(|t| t.map(dome)).collect();
        assert_eq!(bridged(&open, 90.0), (4, 1, 1));
    }

    #[test]
    fn an_island_that_touches_its_hole_in_a_vertex_is_closed_with_it() {
        // A cell stands out into the hole; the next one along the diagonal is an island that touches it, and is touched by another.
        let ring = |x: u8, y: u8| !(1..7).contains(&x) || !(1..7).contains(&y) || (x, y) == (1, 1);
        let with = |islands: &[(u8, u8)]| plate(8, |x, y| ring(x, y) || islands.contains(&(x, y)));
        assert_eq!(bridged(&with(&[(2, 2)]), 31.0), (2, 1, 1));
        assert_eq!(bridged(&with(&[(2, 2), (3, 3)]), 31.0), (3, 1, 1));
    }

    #[test]
    fn rims_are_joined_at_their_nearest_vertices() {
        let open = plate(6, |x, y| !(1..5).contains(&x) || !(1..5).contains(&y) || ((2..4).contains(&x) && (2..4).contains(&y)));
        let got = after(&open, |d, _| {
            let mut work = Work::new(&mut d.submesh);
            let (submesh, edges) = work.edges();
            let rims = loops::find(submesh, edges);
            let holes::Partners { rings, islands, .. } = holes::Shapes::of(submesh, &rims, 1).partners(&Owners::one(rims.len()));
            let pairs = [rings, islands].concat();
            let [hole, island] = pairs[0].map(|i| rims[i].vertices.clone());
            let (joined, triangles) = join(&work, &hole, &island).unwrap();
            triangles.into_iter().for_each(|t| {
                work.add(t, Origin::Added(RepairName::Fill), NONE);
            });
            joined.len()
        });
        // Outer rim, and one loop of hole and island.
        assert_eq!((got.result, got.defects.components, got.defects.boundary_loops), (24, 1, 2));
    }
}
