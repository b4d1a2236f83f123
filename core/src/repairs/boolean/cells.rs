//! The cells of space around what is cut, and the winding numbers there.

use crate::repairs::shared::pieces;
use crate::util::union_find;
use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::DVec3;

use crate::detect::bodies::{self, INNER_POINT};
use crate::repairs::boolean::clusters::Clusters;
use crate::repairs::boolean::cut::Cut;
use crate::repairs::shared::work::Work;
use crate::submesh::Submesh;
use crate::submesh::components::Reversed;
use crate::submesh::edges::Edges;
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::lean;
use crate::util::scatter::Hashing;

/// The cells of space in front of and behind everything closed.
///
/// Nodes: those of the arrangement, then two for each region, then two for each triangle of the submesh, front and back.
pub(crate) struct SpaceCells {
    /// By node: the node that stands for its cell.
    roots: Vec<u32>,
    cells: u32,
    pub(crate) regions: u32,
    /// Nodes in front of what was not cut: the next one is behind, where the winding number is larger by one.
    fronts: Vec<u32>,
}

impl SpaceCells {
    pub(crate) fn of(survey: &Survey<'_>, work: &mut Work<'_>, cut: &Cut, clusters: &Clusters) -> Self {
        let (submesh, edges) = work.edges();
        let (cells, regions) = (cut.arrangement.cells, survey.regions.len() as u32);
        let nodes = cells + 2 * regions + 2 * submesh.triangles.len() as u32;
        let mut sides = Self { roots: (0..nodes).collect(), cells, regions, fronts: Vec::new() };
        for p in (0..regions).filter(|p| clusters.holds_region(*p)) {
            sides.fronts.push(sides.of_region(p)[0]);
        }
        let source_of = |t: u32| cut.sources.binary_search(&t).ok();
        for t in submesh.living().filter(|t| clusters.holds(*t)) {
            let triangle = &submesh.triangles[t as usize];
            let source = source_of(t);
            let own = sides.of_triangle(t);
            if source.is_none() {
                lean::push(&mut sides.fronts, own[0]);
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
        sides.join_along(submesh, edges, cut, clusters);
        for node in 0..nodes {
            sides.roots[node as usize] = union_find::find(&mut sides.roots, node);
        }
        sides
    }

    /// Joins the sides of what shares an edge and was not cut there.
    fn join_along(&mut self, submesh: &Submesh, edges: &Edges, cut: &Cut, clusters: &Clusters) {
        let source_of = |t: u32| cut.sources.binary_search(&t).ok();
        'edges: for edge in edges.iter() {
            let [a, b] = edge.uses else { continue };
            let sources = [source_of(a.triangle()), source_of(b.triangle())];
            if sources.iter().all(Option::is_some) || !clusters.holds(a.triangle()) || !clusters.holds(b.triangle()) {
                continue;
            }
            let mut of = [[0; 2]; 2];
            for (i, used) in [a, b].into_iter().enumerate() {
                let v = submesh.triangles[used.triangle() as usize].v;
                let (from, _) = edge.directed(used);
                let k = v.iter().position(|w| *w == from).unwrap_or(0);
                match sources[i] {
                    None => of[i] = self.of_triangle(used.triangle()),
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
            self.join(of[0], of[1]);
        }
    }

    pub(crate) fn of_region(&self, region: u32) -> [u32; 2] {
        [self.cells + 2 * region, self.cells + 2 * region + 1]
    }

    pub(crate) fn of_triangle(&self, t: u32) -> [u32; 2] {
        let first = self.cells + 2 * self.regions + 2 * t;
        [first, first + 1]
    }

    fn join(&mut self, a: [u32; 2], b: [u32; 2]) {
        union_find::unite(&mut self.roots, a[0], b[0]);
        union_find::unite(&mut self.roots, a[1], b[1]);
    }

    /// The steps of the winding number, each in both directions and once: from the cell of a root to that of another one, and how much larger it is there.
    fn steps(&self, cut: &Cut) -> Vec<(u32, u32, i32)> {
        // Very many are between the same two cells.
        let mut steps = Vec::new();
        let mut most = 1 << 16;
        let whole = self.fronts.iter().map(|front| ([*front, front + 1], 1));
        for ([front, back], step) in whole.chain(cut.arrangement.pieces.iter().map(|piece| (piece.cells, piece.step))) {
            let [front, back] = [front, back].map(|node| self.roots[node as usize]);
            steps.extend([(front, back, step), (back, front, -step)]);
            if steps.len() >= most {
                steps.sort_unstable();
                steps.dedup();
                most = most.max(2 * steps.len());
            }
        }
        steps.sort_unstable();
        steps.dedup();
        steps
    }

    /// The winding numbers of the cells that the cut surface tells of, but for those where that contradicts itself.
    pub(crate) fn windings(
        &self,
        survey: &Survey<'_>,
        work: &mut Work<'_>,
        reversed: &Reversed,
        cut: &Cut,
        crossing: &BTreeSet<u32>,
        clusters: &Clusters,
    ) -> Windings<'_> {
        let pieces = pieces::pieces(survey, work, reversed);
        let submesh: &Submesh = work;
        let surfaces = CutSurfaces::of(self, cut);
        let samples = self.samples(submesh, cut, crossing, clusters, |node| surfaces.at(node));
        let points: Vec<[f64; 3]> = samples.iter().map(|sample| sample.point).collect();
        let found = bodies::windings(survey, submesh, &pieces, reversed, &points);
        let mut bases: Vec<Option<i32>> = vec![None; surfaces.consistent.len()];
        for (sample, winding) in samples.iter().zip(found) {
            if let Some(cell) = surfaces.cell(sample.node).filter(|cell| surfaces.consistent[cell.surface]) {
                bases[cell.surface] = Some(winding - cell.relative);
            }
        }
        // What lies in the material of others would go: it is resolved for itself, and it is asked later if it is to go.
        let mut least: Vec<i32> = vec![i32::MAX; bases.len()];
        let absolute = |cell: &Cell| Some((cell.surface, bases[cell.surface]? + cell.relative));
        for (surface, winding) in surfaces.cells.iter().filter_map(absolute) {
            least[surface] = least[surface].min(winding);
        }
        let own = |cell: &Cell| absolute(cell).map(|(surface, winding)| winding - least[surface].max(0));
        let of_cells = surfaces.cells.iter().map(own).collect();
        Windings { roots: &self.roots, of_root: surfaces.of_root, of_cells }
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

/// Winding numbers by cell.
pub(crate) struct Windings<'c> {
    roots: &'c [u32],
    of_root: HashMap<u32, u32, Hashing>,
    of_cells: Vec<Option<i32>>,
}

impl Windings<'_> {
    /// In the cell of a node, if it is known.
    pub(crate) fn at(&self, node: u32) -> Option<i32> {
        self.of_cells[*self.of_root.get(&self.roots[node as usize])? as usize]
    }
}

/// A cell along a surface that was cut.
#[derive(Clone, Copy)]
struct Cell {
    surface: usize,
    /// Its winding number against that of the first cell along the surface.
    relative: i32,
}

/// Surfaces that were cut and hang together, each with the winding numbers of the cells along it against that of its first one.
struct CutSurfaces<'c> {
    roots: &'c [u32],
    /// By root the place in the list.
    of_root: HashMap<u32, u32, Hashing>,
    cells: Vec<Cell>,
    /// By surface: all ways to a cell say the same of it.
    consistent: Vec<bool>,
}

impl<'c> CutSurfaces<'c> {
    fn of(sides: &'c SpaceCells, cut: &Cut) -> Self {
        let steps = sides.steps(cut);
        let mut all = Self { roots: &sides.roots, of_root: HashMap::default(), cells: Vec::new(), consistent: Vec::new() };
        for piece in &cut.arrangement.pieces {
            all.follow(all.roots[piece.cells[0] as usize], &steps);
        }
        all
    }

    /// Goes along a surface from one of its cells, unless it is known already.
    fn follow(&mut self, start: u32, steps: &[(u32, u32, i32)]) {
        if self.of_root.contains_key(&start) {
            return;
        }
        let surface = self.consistent.len();
        self.consistent.push(true);
        self.of_root.insert(start, self.cells.len() as u32);
        self.cells.push(Cell { surface, relative: 0 });
        let mut waiting = vec![(start, 0)];
        while let Some((at, winding)) = waiting.pop() {
            let first = steps.partition_point(|s| s.0 < at);
            for (_, to, step) in steps[first..].iter().take_while(|s| s.0 == at) {
                let relative = winding + step;
                let place = *self.of_root.entry(*to).or_insert(self.cells.len() as u32) as usize;
                if place == self.cells.len() {
                    self.cells.push(Cell { surface, relative });
                    waiting.push((*to, relative));
                } else if self.cells[place].relative != relative {
                    self.consistent[surface] = false;
                }
            }
        }
    }

    fn cell(&self, node: u32) -> Option<&Cell> {
        self.of_root.get(&self.roots[node as usize]).map(|place| &self.cells[*place as usize])
    }

    /// The surface along which a node's cell lies.
    fn at(&self, node: u32) -> Option<usize> {
        self.cell(node).map(|cell| cell.surface)
    }
}
