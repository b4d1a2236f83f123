//! Components: regions of regular surface and triangles of the submesh that hang together through edges.

use super::edges::{Edge, Edges};
use super::sheets::Sheets;
use super::{Submesh, Vertex};
use crate::geometry::sums::{Bounds, Extent};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::parallel;
use crate::util::union_find::{self, unite};

/// Which regions of regular surface are reversed, against how they stand in the file, and which go. Triangles of the submesh are turned, or die, in
/// place.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reversed {
    pub(crate) regions: Vec<bool>,
    pub(crate) dropped: Vec<bool>,
}

impl Reversed {
    pub(crate) fn none(survey: &Survey<'_>) -> Self {
        Self { regions: vec![false; survey.regions.len()], dropped: vec![false; survey.regions.len()] }
    }
}

/// One connected piece of surface.
#[derive(Clone, Debug)]
pub(crate) struct Component {
    pub(crate) triangles: u64,
    /// With its pieces turned as [`Reversed`] says.
    pub(crate) extent: Extent,
    pub(crate) bounds: Bounds,
    /// It has an edge that it does not itself use equally often in both directions; a boundary edge above all.
    pub(crate) open: bool,
    /// Its smallest triangle in the file's order, new ones last.
    pub(crate) sample: Sample,
}

/// A triangle of a component: its place in the file (past the end for a new one) and, if it is in the submesh, its number there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Sample {
    pub(crate) record: u32,
    pub(crate) in_submesh: Option<u32>,
}

/// All components, and who belongs to which.
pub(crate) struct Components {
    pub(crate) list: Vec<Component>,
    pub(crate) of_region: Vec<u32>,
    /// [`NONE`] for what is dead or degenerate.
    pub(crate) of_triangle: Vec<u32>,
}

/// How far a component reaches.
#[derive(Clone, Copy)]
pub(crate) enum Through {
    /// Through every edge, as the report counts.
    EveryEdge,
    /// Not through non-manifold edges: the sheets between them.
    ManifoldEdges,
    /// Nor through edges whose two triangles disagree on their directions.
    CoherentEdges,
}

impl Through {
    /// Does a component reach through this edge to all of its triangles, whatever they belong to?
    pub(crate) fn reaches(self, edge: &Edge<'_>) -> bool {
        match self {
            Self::EveryEdge => true,
            Self::ManifoldEdges => !edge.is_nonmanifold(),
            Self::CoherentEdges => !edge.is_nonmanifold() && !edge.is_inconsistent(),
        }
    }
}

impl Components {
    /// O(regions + submesh). Components are numbered by their first region, then by their first triangle in the submesh.
    pub(crate) fn of(survey: &Survey<'_>, submesh: &Submesh, edges: &Edges, reversed: &Reversed, through: Through) -> Self {
        let regions = survey.regions.len() as u32;
        let mut parents: Vec<u32> = (0..regions + submesh.triangles.len() as u32).collect();
        for t in submesh.living() {
            let region = submesh.triangles[t as usize].region;
            if region != NONE {
                unite(&mut parents, region, regions + t);
            }
        }
        for edge in edges.iter().filter(|edge| through.reaches(edge)) {
            for other in &edge.uses[1..] {
                unite(&mut parents, regions + edge.uses[0].triangle(), regions + other.triangle());
            }
        }
        let mut all =
            Self { list: Vec::new(), of_region: vec![NONE; regions as usize], of_triangle: vec![NONE; submesh.triangles.len()] };
        let roots = union_find::roots(parents);
        let mut numbers = vec![NONE; roots.len()];
        // After a second look, there may be nothing left of a region.
        for p in (0..regions).filter(|p| survey.regions[*p as usize].first != NONE && !reversed.dropped[*p as usize]) {
            let sum = &survey.regions[p as usize];
            let c = all.number(&mut numbers, roots[p as usize], Sample { record: sum.first, in_submesh: None });
            all.of_region[p as usize] = c;
            let into = &mut all.list[c as usize];
            into.triangles += sum.triangles;
            into.bounds.add(&sum.bounds);
            into.extent += turned(sum.extent, reversed.regions[p as usize]);
        }
        for run in runs(survey, submesh, &roots[regions as usize..]) {
            let c = all.number(&mut numbers, run.root, run.sample);
            let into = &mut all.list[c as usize];
            into.triangles += run.triangles;
            into.bounds.add(&run.bounds);
            into.extent += run.extent;
        }
        for t in submesh.living() {
            all.of_triangle[t as usize] = numbers[roots[(regions + t) as usize] as usize];
        }
        all.note_open(edges);
        all
    }

    /// Notes which ones are open.
    fn note_open(&mut self, edges: &Edges) {
        for edge in edges.iter().filter(|e| e.is_nonmanifold() || e.is_unbalanced()) {
            // Each component's own uses, forward less backward.
            let mut own: Vec<(u32, i64)> =
                edge.uses.iter().map(|u| (self.of_triangle[u.triangle() as usize], if u.forward() { 1 } else { -1 })).collect();
            own.sort_unstable();
            for group in own.chunk_by(|a, b| a.0 == b.0) {
                self.list[group[0].0 as usize].open |= group.iter().map(|g| g.1).sum::<i64>() != 0;
            }
        }
    }

    /// Of components between non-manifold edges: as they hang together where they are open by themselves, so that bodies that touch along an edge stay
    /// apart, and what is closed only together stays together. O(components + edges + submesh), without another look at the geometry.
    pub(crate) fn joined_where_open(self, edges: &Edges) -> Self {
        let Self { list, of_region, of_triangle } = self;
        let sheets = Sheets::of(&of_triangle, list.iter().map(|c| c.open).collect(), edges);
        let mut parents: Vec<u32> = (0..list.len() as u32).collect();
        for edge in edges.iter().filter(|edge| edge.is_nonmanifold()) {
            sheets.join_open(&edge, |a, b| {
                unite(&mut parents, of_triangle[a as usize], of_triangle[b as usize]);
            });
        }
        let roots = union_find::roots(parents);
        let mut numbers = vec![NONE; list.len()];
        let mut all = Self { list: Vec::new(), of_region, of_triangle };
        for (component, root) in list.into_iter().zip(&roots) {
            let into = all.number(&mut numbers, *root, component.sample);
            let into = &mut all.list[into as usize];
            into.triangles += component.triangles;
            into.bounds.add(&component.bounds);
            into.extent += component.extent;
        }
        let now = |c: u32| roots.get(c as usize).map_or(NONE, |root| numbers[*root as usize]);
        all.of_region.iter_mut().chain(&mut all.of_triangle).for_each(|c| *c = now(*c));
        all.note_open(edges);
        all
    }

    fn number(&mut self, numbers: &mut [u32], root: u32, sample: Sample) -> u32 {
        let number = &mut numbers[root as usize];
        if *number == NONE {
            *number = self.list.len() as u32;
            self.list.push(Component { triangles: 0, extent: Extent::default(), bounds: Bounds::EMPTY, open: false, sample });
        }
        let component = &mut self.list[*number as usize];
        component.sample = component.sample.min(sample);
        *number
    }
}

/// Triangles of one component that follow each other, together.
struct Run {
    root: u32,
    triangles: u64,
    extent: Extent,
    bounds: Bounds,
    /// The smallest.
    sample: Sample,
}

/// All living triangles, by their `roots`, in order.
fn runs(survey: &Survey<'_>, submesh: &Submesh, roots: &[u32]) -> Vec<Run> {
    const BLOCK: usize = 1 << 14;
    let of_block = |block: usize| {
        let mut runs: Vec<Run> = Vec::new();
        let end = submesh.triangles.len().min((block + 1) * BLOCK);
        for t in (block * BLOCK..end).map(|t| t as u32).filter(|t| submesh.lives(*t)) {
            let (root, points) = (roots[t as usize], submesh.points(t));
            let sample = Sample { record: submesh.record(t), in_submesh: Some(t) };
            if runs.last().is_none_or(|run| run.root != root) {
                runs.push(Run { root, triangles: 0, extent: Extent::default(), bounds: Bounds::EMPTY, sample });
            }
            if let Some(run) = runs.last_mut() {
                run.triangles += 1;
                run.extent += survey.measure.triangle(&points);
                run.bounds.include(&points);
                run.sample = run.sample.min(sample);
            }
        }
        runs
    };
    parallel::map(survey.threads(), submesh.triangles.len().div_ceil(BLOCK), of_block).into_iter().flatten().collect()
}

fn turned(extent: Extent, reversed: bool) -> Extent {
    if reversed { Extent { volume: -extent.volume, ..extent } } else { extent }
}

/// Connected sets of boundary edges.
pub(crate) fn boundary_loops(submesh: &Submesh, edges: &Edges) -> u64 {
    let mut parents: Vec<Vertex> = (0..submesh.positions.len() as u32).collect();
    let mut on_boundary = vec![false; submesh.positions.len()];
    for edge in edges.iter().filter(|e| e.is_boundary()) {
        on_boundary[edge.low as usize] = true;
        on_boundary[edge.high as usize] = true;
        unite(&mut parents, edge.low, edge.high);
    }
    (0..parents.len()).filter(|v| on_boundary[*v] && parents[*v] == *v as u32).count() as u64
}

/// Vertices on a non-manifold edge, or with more than one fan, ascending. A fan hangs together through two-triangle edges. O(stars).
pub(crate) fn nonmanifold_vertices(submesh: &Submesh, threads: usize) -> Vec<Vertex> {
    const BLOCK: usize = 1 << 12;
    let count = submesh.positions.len();
    let of_block = |around: &mut Around, block: usize| {
        let own = (block * BLOCK..count.min((block + 1) * BLOCK)).map(|v| v as Vertex);
        own.filter(|v| submesh.complete[*v as usize] && around.is_nonmanifold(submesh, *v)).collect::<Vec<_>>()
    };
    let blocks = parallel::map_with(threads, count.div_ceil(BLOCK), Around::default, of_block);
    blocks.into_iter().flatten().collect()
}

/// The edges and triangles around a vertex; their space is used again for the next.
#[derive(Default)]
struct Around {
    /// The other ends of the edges there, each with a triangle by its place in the star.
    ends: Vec<(Vertex, u32)>,
    /// Triangles that hang together.
    parents: Vec<u32>,
}

impl Around {
    fn is_nonmanifold(&mut self, submesh: &Submesh, vertex: Vertex) -> bool {
        self.ends.clear();
        for (place, (t, k)) in (0..).zip(submesh.star(vertex)) {
            let v = submesh.triangles[t as usize].v;
            self.ends.extend([(v[(k + 1) % 3], place), (v[(k + 2) % 3], place)]);
        }
        self.ends.sort_unstable();
        let mut fans = self.ends.len() / 2;
        self.parents.clear();
        self.parents.extend(0..fans as u32);
        for edge in self.ends.chunk_by(|a, b| a.0 == b.0) {
            match edge {
                [_] => {}
                [a, b] => fans -= usize::from(unite(&mut self.parents, a.1, b.1)),
                _ => return true,
            }
        }
        fans > 1
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{Corners, cube, cuboid, diagnose, plate, records, soup};

    /// Components through every edge, between sheets, and joined where these are open: how many, and how many of them open.
    fn counted(triangles: &[Corners]) -> [(usize, usize); 3] {
        let records = records(triangles);
        let d = diagnose(&records);
        let edges = Edges::of(&d.submesh);
        let of = |through| Components::of(&d.survey, &d.submesh, &edges, &Reversed::none(&d.survey), through);
        let all = [of(Through::EveryEdge), of(Through::ManifoldEdges), of(Through::ManifoldEdges).joined_where_open(&edges)];
        all.map(|c| (c.list.len(), c.list.iter().filter(|c| c.open).count()))
    }

    proptest! {
        /// As all edges tell it: on one that has not one or two triangles, or between triangles that no such edges lead from one to the other.
        #[test]
        fn nonmanifold_vertices_are_those_that_edges_tell(mesh in soup()) {
            let records = records(&mesh);
            let d = diagnose(&records);
            let edges = Edges::of(&d.submesh);
            let is_nonmanifold = |v: &Vertex| {
                let star: Vec<u32> = d.submesh.star(*v).map(|(t, _)| t).collect();
                let at_vertex = || edges.iter().filter(|e| e.low == *v || e.high == *v);
                let mut reached: Vec<u32> = star.first().copied().into_iter().collect();
                while let Some(next) = at_vertex().filter(|e| e.uses.len() == 2).find_map(|e| {
                    let [a, b] = [e.uses[0].triangle(), e.uses[1].triangle()];
                    [(a, b), (b, a)].into_iter().find(|(a, b)| reached.contains(a) && !reached.contains(b)).map(|(_, b)| b)
                }) {
                    reached.push(next);
                }
                at_vertex().any(|e| e.is_nonmanifold()) || reached.len() < star.len()
            };
            let all = 0..d.submesh.positions.len() as Vertex;
            let want: Vec<Vertex> = all.filter(|v| d.submesh.complete[*v as usize]).filter(is_nonmanifold).collect();
            prop_assert_eq!(nonmanifold_vertices(&d.submesh, 1), want);
        }
    }

    #[test]
    fn cubes_that_share_an_edge_are_apart_but_for_the_report() {
        let cubes = [cube(), cuboid([1.0, 1.0, 0.0], [2.0, 2.0, 1.0])].concat();
        assert_eq!(counted(&cubes), [(1, 0), (2, 0), (2, 0)]);
    }

    #[test]
    fn what_is_closed_only_together_stays_together() {
        // A double box: the two shells are open at the wall between them, and only one of them has the wall.
        let (left, right) = (cube(), cuboid([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]));
        let double = [&left[..], &right[..8], &right[10..]].concat();
        assert_eq!(counted(&double), [(1, 1), (3, 3), (1, 1)]);
    }

    #[test]
    fn a_ring_has_two_boundary_loops_and_a_pinched_plate_one_bad_vertex() {
        let ring = records(&plate(3, |x, y| (x, y) != (1, 1)));
        let d = diagnose(&ring);
        assert_eq!(boundary_loops(&d.submesh, &Edges::of(&d.submesh)), 2);
        assert!(nonmanifold_vertices(&d.submesh, 2).is_empty());
        // Two squares that touch in one corner: two fans there.
        let pinched = records(&plate(2, |x, y| x == y));
        let d = diagnose(&pinched);
        let bad: Vec<[f32; 3]> = nonmanifold_vertices(&d.submesh, 2).iter().map(|v| d.submesh.positions[*v as usize]).collect();
        assert_eq!(bad, [[1.0, 1.0, 0.0]]);
    }
}
