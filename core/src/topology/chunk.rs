//! The exact topology of one chunk: which vertices at home there have a regular star, and which regular surface hangs together.
//!
//! A chunk sees every triangle around each vertex at home in it, so it decides those vertices' stars exactly and alone. A vertex
//! is **regular** when its triangles form one closed fan, coherently oriented: every directed edge that leaves it comes back exactly
//! once, in one cycle of at least three. Anything else (boundary, non-manifold edge, disagreement, several fans, duplicates, a
//! collinear triangle) makes it **irregular**, and all its triangles are reported to the submesh, which sorts out what is wrong.
//! Regular vertices that share a triangle belong to one **region**: a coherent piece of surface.
//!
//! Tables are laid out to stay in an L2 cache at 32 k triangles a chunk; a worker keeps them from chunk to chunk.

use crate::geometry::sums::{Bounds, Extent, Measure};
use crate::io::record::Point;
use crate::stream::budget::{Budget, Loan, Purpose};
use crate::stream::plan::HomeBox;
use crate::stream::source::{Seen, Source, Triangle};
use crate::topology::crossings::Crossings;
use crate::topology::intersect::{self, CellView, Effort, Finder, Standing};
use crate::topology::labels::{LabelWriter, Labels};
use crate::topology::region_sums::{RegionSums, Sum};
use crate::topology::room::Room;
use crate::topology::star::{Hub, Ring, Stars};
use crate::topology::vertex_table::{self, Weld};
use crate::util::bits;
use crate::util::ids::NONE;

/// A triangle that goes to the submesh, and which of its corners are irregular here (bit k: corner k).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct IrregularTriangle {
    pub(crate) triangle: u32,
    pub(crate) irregular: u8,
}

/// A triangle that more than one chunk sees, or that is an irregular triangle, with the region of its regular corners at home here.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub(crate) triangle: u32,
    /// Number of the region, within the chunk or later the file, and in the highest bit whether the triangle is in the region's sums: it
    /// is in those of the chunk where its first corner is at home, if that knows nothing against it.
    region: u32,
}

/// The most regions that links can tell apart.
pub(crate) const MOST_REGIONS: u64 = 1 << 31;

impl Link {
    fn new(triangle: u32, region: u32, counted: bool) -> Self {
        Self { triangle, region: region | u32::from(counted) << 31 }
    }

    pub(crate) fn region(self) -> u32 {
        self.region & !(1 << 31)
    }

    pub(crate) fn is_counted(self) -> bool {
        self.region >> 31 == 1
    }

    /// The same with the region's number raised by `base`.
    pub(crate) fn raised(self, base: u32) -> Self {
        Self { region: self.region + base, ..self }
    }
}

/// The contribution of one chunk.
#[derive(Debug, Default)]
pub(crate) struct ChunkTopology {
    pub(crate) irregular_triangles: Vec<IrregularTriangle>,
    pub(crate) links: Vec<Link>,
    pub(crate) regions: Vec<RegionSums>,
    pub(crate) labels: Labels,
    /// The box of all triangles with a label that are no irregular triangles here.
    pub(crate) reach: Bounds,
    /// Positions at home here.
    pub(crate) vertices: u64,
    /// The vertices used by a triangle with three distinct vertices.
    pub(crate) vertices_used: u64,
    /// Positions at home here that irregular triangles use.
    pub(crate) irregular_triangle_vertices: u64,
    /// The largest hubs at home here.
    pub(crate) hubs: Vec<Hub>,
    /// Self-intersections that this chunk owns; empty if they were not looked for.
    pub(crate) crossings: Crossings,
}

/// Triangles that are welded at once.
const BATCH: usize = vertex_table::BATCH / 3;

/// Bytes that a region takes until the file is judged: here, merged, and as a component.
pub(crate) const BYTES_PER_REGION: u64 = 3 * size_of::<RegionSums>() as u64 + 160;

impl ChunkTopology {
    /// Counts what it takes now and will take once it is merged.
    pub(crate) fn take(&self, budget: &Budget) {
        let labels = self.labels.heap_bytes();
        let fixed = size_of::<Self>() as u64;
        budget.take(Purpose::Surface, fixed + labels + self.regions.capacity() as u64 * BYTES_PER_REGION);
        // Copied when they are merged; of irregular triangles, one more list is kept.
        let seams =
            size_of::<Link>() * self.links.capacity() + size_of::<IrregularTriangle>() * self.irregular_triangles.capacity();
        budget.take(Purpose::Seams, 2 * seams as u64 + self.crossings.seam_bytes());
        budget.take(
            Purpose::Defects,
            crate::stream::budget::submesh_bytes(self.irregular_triangles.len() as u64, self.irregular_triangle_vertices),
        );
    }

    /// Gives back what growing left over.
    fn shrink(&mut self) {
        self.irregular_triangles.shrink_to_fit();
        self.links.shrink_to_fit();
        self.regions.shrink_to_fit();
    }
}

/// The tables of one worker, used again from chunk to chunk.
#[derive(Default)]
pub(crate) struct Scratch {
    vertices: Weld,
    /// Members: record number and vertices; a triangle with a repeated vertex has `NONE` first.
    numbers: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    /// Members with three distinct, exactly collinear vertices.
    collinear: Vec<u32>,
    stars: Stars,
    /// RegionSums of a regular home vertex, [`IRREGULAR`] or [`AWAY`].
    states: Vec<u32>,
    parents: Vec<u32>,
    /// By vertex, for the search for self-intersections.
    standing: Vec<Standing>,
    finder: Finder,
    /// Members, then visitors, that are in a self-intersection, a bit each.
    hit: Vec<u64>,
    room: Room,
}

/// State of a vertex at home here whose star is not regular.
const IRREGULAR: u32 = NONE - 1;
/// State of a vertex at home elsewhere.
const AWAY: u32 = NONE - 2;
/// State of a regular vertex before regions are numbered. Smaller than the others, as the numbers are.
const SOUND: u32 = 0;

impl Scratch {
    /// Decides everything that can be decided inside the chunk of this cell; the vertices at the positions `cut` count as irregular.
    /// Nothing if there is no memory for its vertices. O(members).
    pub(crate) fn solve(
        &mut self,
        seen: &Seen<'_>,
        cell: HomeBox,
        measure: &Measure,
        cut: &[Point],
        loan: &Loan<'_>,
    ) -> ChunkTopology {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("bmi2") {
            // SAFETY: the processor has them.
            return unsafe { self.solve_avx2(seen, cell, measure, cut, loan) };
        }
        self.solve_by(seen, cell, measure, (cut, loan), Self::take, Ring::places)
    }

    /// The same code with wider vectors.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2")]
    fn solve_avx2(&mut self, seen: &Seen<'_>, cell: HomeBox, measure: &Measure, cut: &[Point], loan: &Loan<'_>) -> ChunkTopology {
        let take = |scratch: &mut Self, corners: &[[Point; 3]]| scratch.take_avx2(corners);
        self.solve_by(seen, cell, measure, (cut, loan), take, |ring, corner| ring.places_avx2(corner))
    }

    /// The same as [`Self::take`]: it is called from where the compiler does not see what the processor has.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2")]
    fn take_avx2(&mut self, corners: &[[Point; 3]]) {
        self.take(corners);
    }

    /// `take` takes members in, `places` tells where a corner stands in a ring.
    #[inline(always)]
    fn solve_by(
        &mut self,
        seen: &Seen<'_>,
        cell: HomeBox,
        measure: &Measure,
        (cut, loan): (&[Point], &Loan<'_>),
        take: impl Fn(&mut Self, &[[Point; 3]]),
        places: impl Fn(&Ring, u32) -> u32 + Copy,
    ) -> ChunkTopology {
        let total = match seen {
            Seen::Mapped(source) => self.weld(source, measure, loan, take),
            Seen::Spooled(source) => self.weld(source, measure, loan, take),
        };
        if self.room.is_starved() {
            return ChunkTopology::default();
        }
        self.judge_stars(cell, cut, places);
        let at_home = |v: usize| self.states[v] != AWAY;
        let hubs = self.stars.hubs(self.vertices.positions(), at_home);
        ChunkTopology { hubs, ..self.collect(measure, total) }
    }

    /// Finds the self-intersections that the chunk owns, after it was solved; counts little more pairs than `effort` allows. The
    /// `visitors` are added to its triangles.
    pub(crate) fn cross(&mut self, visitors: &Seen<'_>, cell: HomeBox, effort: Effort, loan: &Loan<'_>) -> Crossings {
        visitors.for_each(|number, triangle| {
            if !self.room.is_starved() {
                self.numbers.push(number);
                self.take(&[triangle.corners()]);
                self.room.count(self.vertices.positions().len(), loan);
            }
        });
        if self.room.is_starved() {
            return Crossings::default();
        }
        self.standing.clear();
        self.standing.extend(self.states.iter().map(|state| match *state {
            AWAY => Standing::Away,
            IRREGULAR => Standing::Irregular,
            _ => Standing::Regular,
        }));
        // No visitor has a corner at home here.
        self.standing.resize(self.vertices.positions().len(), Standing::Away);
        let view = CellView {
            positions: self.vertices.positions(),
            triangles: &self.triangles,
            left_out: &self.collinear,
            standing: &self.standing,
            cell,
        };
        self.hit.clear();
        self.hit.resize(self.triangles.len().div_ceil(64), 0);
        let mut crossings = Crossings::default();
        let tested = self.finder.pairs(&view, effort, |some, others, contact| {
            crossings.add(some, others, &self.numbers, contact);
            // Of those of the same vertices the first.
            for t in [some.first(), others.first()].into_iter().flatten() {
                bits::put(&mut self.hit, *t as usize);
            }
        });
        for same in self.finder.copies().groups() {
            if bits::holds(&self.hit, same[0] as usize) {
                same.iter().for_each(|t| bits::put(&mut self.hit, *t as usize));
            }
        }
        let (mut inner, mut across) = (0, Vec::new());
        for (word, hit) in self.hit.iter().enumerate() {
            for t in intersect::bits(*hit).map(|bit| word * 64 + bit) {
                if self.triangles[t].iter().all(|v| self.standing[*v as usize] != Standing::Away) {
                    inner += 1;
                } else {
                    across.push(self.numbers[t]);
                }
            }
        }
        crossings.close(tested, inner, across);
        crossings
    }

    /// Numbers the vertices of all members; returns the sum over them.
    #[inline(always)]
    fn weld(
        &mut self,
        source: &impl Source,
        measure: &Measure,
        loan: &Loan<'_>,
        take: impl Fn(&mut Self, &[[Point; 3]]),
    ) -> Extent {
        self.numbers.clear();
        self.triangles.clear();
        self.collinear.clear();
        let expected = source.count();
        self.room.expect(expected as u64);
        // Half a vertex a triangle is the rule; a soup has three, and grows the table.
        self.vertices.reset(expected / 2);
        self.numbers.reserve(expected);
        self.triangles.reserve(expected);
        let (mut corners, mut filled, mut total) = ([[[0f32; 3]; 3]; BATCH], 0, Extent::default());
        source.for_each(|number, triangle| {
            if self.room.is_starved() {
                return;
            }
            self.numbers.push(number);
            corners[filled] = triangle.corners();
            filled += 1;
            if filled == BATCH {
                take(self, &corners);
                total += measure.sum(&corners);
                filled = 0;
                self.room.count(self.vertices.positions().len(), loan);
            }
        });
        take(self, &corners[..filled]);
        total += measure.sum(&corners[..filled]);
        total
    }

    /// Takes in the next members, at most [`BATCH`].
    #[inline(always)]
    fn take(&mut self, corners: &[[Point; 3]]) {
        let mut triangles = [[NONE; 3]; BATCH];
        self.vertices.vertices(corners.as_flattened(), triangles.as_flattened_mut());
        for (t, [p, q, r]) in triangles.into_iter().zip(corners) {
            let [a, b, c] = t;
            let repeated = (a == b) | (b == c) | (c == a);
            if !repeated && crate::geometry::collinear::is_collinear(p, q, r) {
                self.collinear.push(self.triangles.len() as u32);
            }
            self.triangles.push(if repeated { [NONE, a, b] } else { t });
        }
    }

    /// Tests whether the triangles around each home vertex are one closed coherent fan, and puts those that are regular into regions.
    #[inline(always)]
    fn judge_stars(&mut self, cell: HomeBox, cut: &[Point], places: impl Fn(&Ring, u32) -> u32 + Copy) {
        let positions = self.vertices.positions();
        self.stars.gather(positions.len(), &self.triangles);
        self.states.clear();
        self.states.extend(positions.iter().map(|p| if cell.holds(*p) { SOUND } else { AWAY }));
        // The submesh must see the neighbours that a collinear triangle is to be closed with.
        let of_collinear = self.collinear.iter().flat_map(|i| self.triangles[*i as usize]);
        for v in of_collinear.chain(cut.iter().filter_map(|p| self.vertices.find(*p))) {
            let state = &mut self.states[v as usize];
            *state = if *state == SOUND { IRREGULAR } else { *state };
        }
        self.parents.clear();
        self.parents.extend(0..positions.len() as u32);
        let roots = self.judge(places);
        self.unite_regions(roots);
    }

    /// Tests stars by ascending vertex. A regular one is put with an older regular neighbour, one in its first triangle if that will do;
    /// what is left without makes a root, and mostly there is only one. Returns their number.
    #[inline(always)]
    fn judge(&mut self, places: impl Fn(&Ring, u32) -> u32 + Copy) -> usize {
        let (states, parents) = (&mut self.states[..], &mut self.parents[..]);
        let mut roots = 0;
        for v in 0..states.len().min(parents.len()) {
            if states[v] != SOUND {
                continue;
            }
            if !self.stars.is_closed_fan(v, places) {
                states[v] = IRREGULAR;
                continue;
            }
            let (next, previous) = self.stars.around(v);
            let older = |w: &&u32| **w < v as u32 && states[**w as usize] == SOUND;
            match previous.first().filter(older).or_else(|| next.iter().find(older)) {
                Some(w) => parents[v] = parents[*w as usize],
                None => roots += 1,
            }
        }
        roots
    }

    /// Unites the regions of regular home vertices that share a triangle, of which there are `roots` as yet.
    #[inline(always)]
    fn unite_regions(&mut self, mut roots: usize) {
        for t in self.triangles.iter().filter(|t| t[0] != NONE) {
            if roots <= 1 {
                return;
            }
            let parent = self.parents[t[0] as usize];
            if (self.parents[t[1] as usize] == parent) & (self.parents[t[2] as usize] == parent) {
                continue;
            }
            let regular = t.map(|v| self.states[v as usize] == SOUND);
            if regular[0] && regular[1] {
                roots -= usize::from(crate::util::union_find::unite(&mut self.parents, t[0], t[1]));
            }
            if regular[2] && (regular[0] || regular[1]) {
                roots -=
                    usize::from(crate::util::union_find::unite(&mut self.parents, t[2], if regular[0] { t[0] } else { t[1] }));
            }
        }
    }

    /// Vertices at home here that these irregular triangles use. O(members).
    fn count_irregular_triangle_vertices(&mut self, irregular_triangles: &[IrregularTriangle]) -> u64 {
        self.hit.clear();
        self.hit.resize(self.states.len().div_ceil(64), 0);
        let mut irregular_triangles = irregular_triangles.iter().map(|s| s.triangle).peekable();
        for (t, number) in self.triangles.iter().zip(&self.numbers) {
            if irregular_triangles.next_if_eq(number).is_none() {
                if irregular_triangles.peek().is_none() {
                    break;
                }
                continue;
            }
            for v in t.iter().map(|v| *v as usize).filter(|v| self.states.get(*v).is_some_and(|s| *s != AWAY)) {
                self.hit[v / 64] |= 1 << (v % 64);
            }
        }
        self.hit.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// `total` is the sum over all members.
    #[inline(always)]
    fn collect(&mut self, measure: &Measure, total: Extent) -> ChunkTopology {
        let home = || self.states.iter().enumerate().filter(|(_, state)| **state != AWAY);
        let mut out = ChunkTopology { reach: Bounds::EMPTY, ..ChunkTopology::default() };
        out.vertices = home().count() as u64;
        out.vertices_used = home().filter(|(v, _)| self.stars.count(*v) > 0).count() as u64;
        let largest = self.number_regions(&mut out.regions);
        let mut labels = LabelWriter::default();
        let mut sum = Sum::new(measure, self.vertices.positions(), largest);
        for (t, number) in self.triangles.iter().zip(&self.numbers) {
            let triangle = *number;
            if t[0] == NONE {
                // Of no area.
                out.irregular_triangles.push(IrregularTriangle { triangle, irregular: 0 });
                labels.push(NONE);
                continue;
            }
            let states = [self.states[t[0] as usize], self.states[t[1] as usize], self.states[t[2] as usize]];
            if states.iter().all(|s| *s < AWAY) {
                labels.push(states[0]);
                sum.add(states[0], triangle, *t, &mut out.regions);
                continue;
            }
            let irregular = (0..3).fold(0, |mask, k| mask | u8::from(states[k] == IRREGULAR) << k);
            let region = states.into_iter().rfind(|s| *s < AWAY).unwrap_or(NONE);
            labels.push(region);
            if irregular != 0 {
                out.irregular_triangles.push(IrregularTriangle { triangle, irregular });
            }
            let counted = region != NONE && irregular == 0 && states[0] != AWAY;
            if !counted {
                sum.leave(*t);
            }
            if region != NONE {
                if counted {
                    sum.add(region, triangle, *t, &mut out.regions);
                } else {
                    let first = &mut out.regions[region as usize].first;
                    *first = triangle.min(*first);
                }
                out.links.push(Link::new(triangle, region, counted));
                if irregular == 0 {
                    out.reach.include(&t.map(|v| self.vertices.positions()[v as usize]));
                }
            }
        }
        sum.finish(total, &mut out.regions);
        out.regions.iter().for_each(|p| out.reach.add(&p.bounds));
        out.irregular_triangle_vertices = self.count_irregular_triangle_vertices(&out.irregular_triangles);
        if out.regions.len() > 1 {
            out.labels = Labels::Runs(labels.finish());
        }
        out.shrink();
        out
    }

    /// Numbers the regions by their first vertices, and returns the one of most vertices.
    #[inline(always)]
    fn number_regions(&mut self, regions: &mut Vec<RegionSums>) -> u32 {
        let mut bounds = Bounds::EMPTY;
        let mut region = NONE;
        let (mut sizes, mut run): (Vec<usize>, usize) = (Vec::new(), 0);
        for (v, position) in self.vertices.positions().iter().enumerate() {
            if self.states[v] != SOUND {
                continue;
            }
            // Never younger than the vertex, so it has its number already.
            let parent = self.parents[v] as usize;
            self.states[v] = if parent == v { regions.len() as u32 } else { self.states[parent] };
            if parent == v {
                regions.push(RegionSums { triangles: 0, extent: Extent::default(), bounds: Bounds::EMPTY, first: NONE });
                sizes.push(0);
            }
            if self.states[v] != region {
                if region != NONE {
                    regions[region as usize].bounds.add(&bounds);
                    sizes[region as usize] += run;
                }
                (region, bounds, run) = (self.states[v], Bounds::EMPTY, 0);
            }
            bounds.include(&[*position]);
            run += 1;
        }
        if region != NONE {
            regions[region as usize].bounds.add(&bounds);
            sizes[region as usize] += run;
        }
        sizes.iter().zip(0..).max_by_key(|(size, _)| **size).map_or(NONE, |(_, region)| region)
    }
}
