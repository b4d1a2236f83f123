//! The cells of space around what is cut, and the winding numbers there.

use crate::repairs::shared::pieces;
use crate::util::union_find;
use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use crate::detect::bodies::{self, INNER_POINT};
use crate::repairs::boolean::clusters::Clusters;
use crate::repairs::boolean::cut::Cut;
use crate::repairs::shared::work::Work;
use crate::submesh::Submesh;
use crate::submesh::components::Reversed;
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::radix::sort_by_number;

/// The cells of space in front of and behind everything closed.
///
/// Nodes: those of the arrangement, then two for each region, then two for each triangle of the submesh, front and back.
pub(crate) struct SpaceCells {
    parents: Vec<u32>,
    cells: u32,
    pub(crate) regions: u32,
    /// Front, back, and by how much the winding number is larger there.
    steps: Vec<(u32, u32, i32)>,
}

impl SpaceCells {
    pub(crate) fn of(survey: &Survey<'_>, work: &mut Work<'_>, cut: &Cut, clusters: &Clusters) -> Self {
        let (submesh, edges) = work.edges();
        let (cells, regions) = (cut.arrangement.cells, survey.regions.len() as u32);
        let nodes = cells + 2 * regions + 2 * submesh.triangles.len() as u32;
        let mut sides = Self { parents: (0..nodes).collect(), cells, regions, steps: Vec::new() };
        for p in (0..regions).filter(|p| clusters.holds_region(*p)) {
            let [front, back] = sides.of_region(p);
            sides.steps.push((front, back, 1));
        }
        let source_of = |t: u32| cut.sources.binary_search(&t).ok();
        for t in submesh.living().filter(|t| clusters.holds(*t)) {
            let triangle = &submesh.triangles[t as usize];
            let source = source_of(t);
            let own = sides.of_triangle(t);
            if source.is_none() {
                sides.steps.push((own[0], own[1], 1));
            }
            // A regular corner's star was not cut.
            if triangle.region == NONE || triangle.v.iter().all(|v| submesh.complete[*v as usize]) {
                continue;
            }
            let region = sides.of_region(triangle.region);
            match source {
                None => sides.join(own, region),
                Some(s) => cut.pieces(s).iter().for_each(|piece| sides.join(piece.cells, region)),
            }
        }
        for piece in &cut.arrangement.pieces {
            sides.steps.push((piece.cells[0], piece.cells[1], piece.step));
        }
        'edges: for edge in edges.iter() {
            let [a, b] = edge.uses else { continue };
            let sources = [source_of(a.triangle), source_of(b.triangle)];
            if sources.iter().all(Option::is_some) || !clusters.holds(a.triangle) || !clusters.holds(b.triangle) {
                continue;
            }
            let mut of = [[0; 2]; 2];
            for (i, used) in [a, b].into_iter().enumerate() {
                let v = submesh.triangles[used.triangle as usize].v;
                let (from, _) = edge.directed(used);
                let k = v.iter().position(|w| *w == from).unwrap_or(0);
                match sources[i] {
                    None => of[i] = sides.of_triangle(used.triangle),
                    Some(s) => match cut.whole_edge(submesh, s, k) {
                        Some(piece) => of[i] = piece.cells,
                        // Covered by another one.
                        None => continue 'edges,
                    },
                }
            }
            if edge.is_inconsistent() {
                of[1].swap(0, 1);
            }
            sides.join(of[0], of[1]);
        }
        sides
    }

    pub(crate) fn of_region(&self, region: u32) -> [u32; 2] {
        [self.cells + 2 * region, self.cells + 2 * region + 1]
    }

    pub(crate) fn of_triangle(&self, t: u32) -> [u32; 2] {
        let first = self.cells + 2 * self.regions + 2 * t;
        [first, first + 1]
    }

    fn join(&mut self, a: [u32; 2], b: [u32; 2]) {
        union_find::unite(&mut self.parents, a[0], b[0]);
        union_find::unite(&mut self.parents, a[1], b[1]);
    }

    /// The winding number at each node whose cell the cut surface tells of; `None` at others, and where that contradicts itself.
    pub(crate) fn windings(
        &self,
        survey: &Survey<'_>,
        work: &mut Work<'_>,
        reversed: &Reversed,
        cut: &Cut,
        crossing: &BTreeSet<u32>,
        clusters: &Clusters,
    ) -> Vec<Option<i32>> {
        let pieces = pieces::pieces(survey, work, reversed);
        let submesh: &Submesh = work;
        let surfaces = CutSurfaces::of(self, cut);
        let samples = self.samples(submesh, cut, crossing, clusters, |node| surfaces.at(node));
        let points: Vec<[f64; 3]> = samples.iter().map(|sample| sample.point).collect();
        let found = bodies::windings(survey, submesh, &pieces, reversed, &points);
        let mut bases: Vec<Option<i32>> = vec![None; surfaces.consistent.len()];
        for (sample, winding) in samples.iter().zip(found) {
            if let Some(surface) = surfaces.at(sample.node).filter(|surface| surfaces.consistent[*surface]) {
                bases[surface] = Some(winding - surfaces.winding(sample.node));
            }
        }
        // What lies in the material of others would go: it is resolved for itself, and it is asked later if it is to go.
        let mut least: Vec<i32> = vec![i32::MAX; bases.len()];
        let absolute = |node: u32| {
            let surface = surfaces.at(node)?;
            Some((surface, bases[surface]? + surfaces.winding(node)))
        };
        let nodes = || 0..surfaces.roots.len() as u32;
        for (surface, winding) in nodes().filter_map(absolute) {
            least[surface] = least[surface].min(winding);
        }
        let own = |node: u32| absolute(node).map(|(surface, winding)| winding - least[surface].max(0));
        nodes().map(own).collect()
    }

    /// For each surface that was cut one of its triangles: one that crosses nothing if there is any, of the largest, of the first.
    fn samples(
        &self,
        submesh: &Submesh,
        cut: &Cut,
        crossing: &BTreeSet<u32>,
        clusters: &Clusters,
        surface_of: impl Fn(u32) -> Option<usize>,
    ) -> Vec<Sample> {
        let mut best: BTreeMap<usize, Sample> = BTreeMap::new();
        let mut offer = |clear: bool, node: u32, corners: [DVec3; 3]| {
            let Some(surface) = surface_of(node) else { return };
            let (area, point) = in_front(corners);
            let sample = Sample { clear, area, node, point };
            best.entry(surface)
                .and_modify(|best| {
                    if (clear, area) > (best.clear, best.area) {
                        *best = sample;
                    }
                })
                .or_insert(sample);
        };
        for t in submesh.living().filter(|t| !crossing.contains(t) && clusters.holds(*t)) {
            let corners = submesh.triangles[t as usize].v.map(|v| submesh.place(v));
            match cut.sources.binary_search(&t) {
                Err(_) => offer(true, self.of_triangle(t)[0], corners),
                // What lies on it, or it on, is no clear case.
                Ok(s) => {
                    if let [piece] = cut.pieces(s)
                        && piece.step == 1
                    {
                        offer(true, piece.cells[0], corners);
                    }
                }
            }
        }
        for piece in &cut.arrangement.pieces {
            offer(false, piece.cells[0], piece.v.map(|v| DVec3::from_array(cut.arrangement.points[v as usize])));
        }
        best.into_values().collect()
    }
}

/// A triangle of a surface that was cut.
#[derive(Clone, Copy)]
struct Sample {
    /// It crosses nothing.
    clear: bool,
    /// Twice its area.
    area: f64,
    /// Where it looks, and a point there.
    node: u32,
    point: [f64; 3],
}

/// Twice the area of a triangle, and a point in front of it, by so little that f32 knows nothing between.
fn in_front(corners: [DVec3; 3]) -> (f64, [f64; 3]) {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let area = normal.length();
    let point = a * INNER_POINT[0] + b * INNER_POINT[1] + c * INNER_POINT[2];
    let largest = corners.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    // 2⁻⁴⁰: far above what f64 rounds, far below what f32 can tell.
    (area, (point + normal / area.max(f64::MIN_POSITIVE) * (largest * 9.1e-13)).to_array())
}

/// Surfaces that were cut and hang together, each with the winding numbers of the cells along it against that of its first one.
struct CutSurfaces {
    /// By node: the node that stands for its cell.
    roots: Vec<u32>,
    /// By root.
    surface_of: Vec<u32>,
    relative: Vec<i32>,
    /// By surface: all ways to a cell say the same of it.
    consistent: Vec<bool>,
}

impl CutSurfaces {
    fn of(sides: &SpaceCells, cut: &Cut) -> Self {
        let mut parents = sides.parents.clone();
        let roots: Vec<u32> = (0..parents.len() as u32).map(|node| union_find::find(&mut parents, node)).collect();
        let mut steps: Vec<(u32, u32, i32)> = Vec::with_capacity(2 * sides.steps.len());
        for (front, back, step) in &sides.steps {
            let (front, back) = (roots[*front as usize], roots[*back as usize]);
            steps.push((front, back, *step));
            steps.push((back, front, -step));
        }
        sort_by_number(&mut steps, |(_, back, _)| *back);
        sort_by_number(&mut steps, |(front, ..)| *front);
        steps.dedup();
        let (surface_of, relative) = (vec![NONE; roots.len()], vec![0; roots.len()]);
        let mut all = Self { roots, surface_of, relative, consistent: Vec::new() };
        for piece in &cut.arrangement.pieces {
            all.follow(all.roots[piece.cells[0] as usize], &steps);
        }
        all
    }

    /// Goes along a surface from one of its cells, unless it is known already.
    fn follow(&mut self, start: u32, steps: &[(u32, u32, i32)]) {
        if self.surface_of[start as usize] != NONE {
            return;
        }
        let surface = self.consistent.len();
        self.consistent.push(true);
        self.surface_of[start as usize] = surface as u32;
        let mut waiting = vec![start];
        while let Some(at) = waiting.pop() {
            let first = steps.partition_point(|s| s.0 < at);
            for (_, to, step) in steps[first..].iter().take_while(|s| s.0 == at) {
                let (to, winding) = (*to as usize, self.relative[at as usize] + step);
                if self.surface_of[to] == NONE {
                    self.surface_of[to] = surface as u32;
                    self.relative[to] = winding;
                    waiting.push(to as u32);
                } else if self.relative[to] != winding {
                    self.consistent[surface] = false;
                }
            }
        }
    }

    /// The surface along which a node's cell lies.
    fn at(&self, node: u32) -> Option<usize> {
        self.surface_of.get(self.roots[node as usize] as usize).filter(|s| **s != NONE).map(|s| *s as usize)
    }

    /// Of a node's cell, against the first one along its surface.
    fn winding(&self, node: u32) -> i32 {
        self.relative[self.roots[node as usize] as usize]
    }
}
