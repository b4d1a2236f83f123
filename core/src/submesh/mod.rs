//! The submesh: all triangles around irregular vertices, as a small mesh in memory that repairs can change.
//!
//! **In:** the triangles around irregular vertices, by their numbers, and the records they stand in.
//! **Out:** a [`Submesh`] of vertices and triangles; its edges ([`edges`]), the wedges of material around an edge ([`radial`]), its components
//! ([`components`]), vertices near a place ([`near`]).
//! **Promise:** everything that a repair decides on is here: the star of each complete vertex is whole.
//!
//! Its **complete** vertices have their whole star here (the irregular ones, and what was fetched on request); the others are its
//! frontier and stay as they are. An edge with a complete end therefore has all its triangles here. Vertices and triangles are
//! numbered by the input's order, so nothing that is done here depends on how the file was cut into chunks.

pub(crate) mod components;
mod crowds;
pub(crate) mod edges;
pub(crate) mod near;
pub(crate) mod radial;
pub(crate) mod sheets;

use std::collections::HashMap;

use glam::DVec3;

use crate::contract::repair_name::RepairName;
use crate::geometry::distance::{distance, place};
use crate::geometry::position::{self, Position};
use crate::io::record::{self, Record};
use crate::topology::chunk::IrregularTriangle;
use crate::topology::survey::Survey;
use crate::topology::vertex_table::Weld;
use crate::util::each::Each;
use crate::util::ids::NONE;
use crate::util::lean;
use crate::util::scatter::Hashing;
use crate::util::steps;

/// A vertex of the submesh.
pub(crate) type Vertex = u32;

/// Vertices by position.
pub(crate) type ByPosition = HashMap<Position, Vertex, Hashing>;

/// Where a triangle comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Origin {
    /// This record of the input.
    Input(u32),
    /// A part of this record; takes its attribute.
    Part(u32),
    /// Made by this repair, as a part of no record; its attribute is that of most of its rim.
    Added(RepairName),
}

impl Origin {
    /// Where a part of the triangle comes from.
    pub(crate) fn of_part(self) -> Self {
        match self {
            Self::Input(record) | Self::Part(record) => Self::Part(record),
            Self::Added(repair) => Self::Added(repair),
        }
    }
}

/// How a triangle differs from the record it was gathered from: so that nobody has to read that again to find out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Since {
    Same,
    Turned,
    /// It has had another vertex, or is no triangle of the file.
    Other,
}

/// A triangle of the submesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    pub(crate) v: [Vertex; 3],
    pub(crate) since: Since,
    pub(crate) origin: Origin,
    /// The region of regular surface it continues coherently, or [`NONE`].
    pub(crate) region: u32,
    pub(crate) alive: bool,
    /// The repair that changed it last, or removed it.
    pub(crate) by: Option<RepairName>,
}

impl Triangle {
    fn of_record(v: [Vertex; 3], record: u32, region: u32) -> Self {
        Self { v, since: Since::Same, origin: Origin::Input(record), region, alive: true, by: None }
    }

    /// Turns it over.
    pub(crate) fn turn(&mut self) {
        self.v.swap(1, 2);
        self.since = match self.since {
            Since::Same => Since::Turned,
            Since::Turned => Since::Same,
            Since::Other => Since::Other,
        };
    }

    /// The record it comes from; past all records for a new one.
    pub(crate) fn record(&self) -> u32 {
        match self.origin {
            Origin::Input(record) | Origin::Part(record) => record,
            Origin::Added(_) => NONE,
        }
    }
}

/// A submesh that is being made.
pub(crate) struct Gathering {
    weld: Weld,
    complete: Vec<bool>,
    triangles: Vec<Triangle>,
}

impl Gathering {
    /// Of about so many triangles.
    pub(crate) fn of(triangles: usize) -> Self {
        let mut weld = Weld::default();
        weld.reset(triangles);
        Self { weld, complete: Vec::new(), triangles: Vec::with_capacity(triangles) }
    }

    /// Adds the triangle that is or stands in for the record at `place`, of whose vertices some have their whole star here (bit k of
    /// `complete`: corner k), and the others belong to `region`, or [`NONE`].
    pub(crate) fn add(&mut self, place: u32, corners: [[f32; 3]; 3], complete: u8, region: u32) {
        let v = corners.each(|p| self.weld.vertex(p));
        self.complete.resize(self.weld.positions().len(), false);
        for (k, vertex) in v.iter().enumerate() {
            self.complete[*vertex as usize] |= complete >> k & 1 == 1;
        }
        self.triangles.push(Triangle::of_record(v, place, region));
    }

    pub(crate) fn finish(self) -> Submesh {
        let Self { weld, complete, triangles } = self;
        let mut submesh = Submesh { heads: Vec::new(), nexts: Vec::new(), positions: weld.into_positions(), complete, triangles };
        submesh.relink();
        submesh
    }
}

/// The mesh under repair.
pub(crate) struct Submesh {
    /// The coordinates of [`Position`]s: without −0.0. No vertex moves: a corner that moves gets another vertex, and [`Since`] says so.
    pub(crate) positions: Vec<[f32; 3]>,
    /// The whole star is here.
    pub(crate) complete: Vec<bool>,
    pub(crate) triangles: Vec<Triangle>,
    /// First corner (3 · triangle + k) of each vertex, and the next one of the same vertex: a list for each star. A triangle that was turned over
    /// since has the vertex at another corner.
    heads: Vec<u32>,
    nexts: Vec<u32>,
}

/// Which corner of a triangle is `vertex`, of which a star list says that it was `corner` when the list was made.
fn corner_of(triangle: &[Vertex; 3], vertex: Vertex, corner: usize) -> usize {
    triangle.iter().position(|v| *v == vertex).unwrap_or(corner % 3)
}

impl Submesh {
    /// Gathers the irregular triangles of `survey`. O(irregular triangles).
    pub(crate) fn gather(survey: &Survey<'_>) -> Self {
        let mut gathering = Gathering::of(survey.irregular_triangles.len());
        for ((irregular_triangle, corners), region) in survey.irregular_corners().zip(&survey.irregular_triangle_regions) {
            gathering.add(irregular_triangle.triangle, corners, irregular_triangle.irregular, *region);
        }
        gathering.finish()
    }

    /// The numbers of all triangles; the disk is asked beforehand for the records of those that have had another vertex than theirs.
    pub(crate) fn beside_records(&self, survey: &Survey<'_>) -> impl Iterator<Item = u32> {
        survey.ahead(0..self.triangles.len() as u32, |t| {
            let triangle = &self.triangles[*t as usize];
            let has_record = triangle.since == Since::Other && !matches!(triangle.origin, Origin::Added(_));
            has_record.then(|| triangle.record())
        })
    }

    /// Vertices by position: of several there, the one that is used last.
    pub(crate) fn by_position(&self) -> ByPosition {
        let mut known = ByPosition::with_capacity_and_hasher(self.positions.len(), Hashing::default());
        self.name_positions(|v, p, last_use| {
            let there = known.entry(p).or_insert(v);
            if last_use[v as usize] >= last_use[*there as usize] {
                *there = v;
            }
        });
        known
    }

    /// The same of these positions alone.
    pub(crate) fn by_position_of(&self, wanted: impl Iterator<Item = Position>) -> ByPosition {
        let mut known: ByPosition = wanted.map(|p| (p, NONE)).collect();
        if !known.is_empty() {
            self.name_positions(|v, p, last_use| match known.get_mut(&p) {
                Some(there) if *there == NONE || last_use[v as usize] >= last_use[*there as usize] => *there = v,
                _ => {}
            });
            known.retain(|_, v| *v != NONE);
        }
        known
    }

    /// Visits all vertices with their positions, and when each was last used.
    fn name_positions(&self, mut visit: impl FnMut(Vertex, Position, &[u64])) {
        steps::count(self.positions.len());
        let mut last_use = vec![0; self.positions.len()];
        for t in self.living() {
            (1..).zip(self.triangles[t as usize].v).for_each(|(k, v)| last_use[v as usize] = 3 * u64::from(t) + k);
        }
        (0..).zip(&self.positions).for_each(|(v, p)| visit(v, Position::of(*p), &last_use));
    }

    /// Takes in what [`Survey::promote`] has found for some of its incomplete vertices, which become complete: those that `completed`
    /// names, which is told of all vertices by position.
    pub(crate) fn extend(
        &mut self,
        survey: &Survey<'_>,
        new: &[(IrregularTriangle, u32)],
        completed: impl FnOnce(&ByPosition) -> Vec<Vertex>,
    ) {
        let mut known = self.by_position();
        self.triangles.reserve_exact(new.len());
        for (irregular_triangle, region) in new {
            let v = corners(survey.records, irregular_triangle.triangle).map(|p| {
                let position = Position::of(p);
                *known.entry(position).or_insert_with(|| {
                    lean::push(&mut self.positions, position.coordinates());
                    self.complete.push(false);
                    self.positions.len() as Vertex - 1
                })
            });
            self.triangles.push(Triangle::of_record(v, irregular_triangle.triangle, *region));
        }
        completed(&known).into_iter().for_each(|v| self.complete[v as usize] = true);
        self.relink();
    }

    /// Builds the star lists anew, dropping what is dead. Lists run from the last triangle to the first.
    pub(crate) fn relink(&mut self) {
        self.heads.clear();
        self.heads.resize(self.positions.len(), NONE);
        self.nexts.clear();
        self.nexts.reserve_exact(self.triangles.len() * 3);
        self.nexts.resize(self.triangles.len() * 3, NONE);
        steps::count(self.triangles.len());
        for t in 0..self.triangles.len() {
            if self.triangles[t].alive {
                self.link(t);
            }
        }
    }

    fn link(&mut self, t: usize) {
        for (k, v) in self.triangles[t].v.iter().enumerate() {
            let corner = t * 3 + k;
            self.nexts[corner] = self.heads[*v as usize];
            self.heads[*v as usize] = corner as u32;
        }
    }

    /// Adds a triangle and returns its number.
    pub(crate) fn add(&mut self, v: [Vertex; 3], origin: Origin, region: u32) -> u32 {
        let t = self.triangles.len();
        lean::push(&mut self.triangles, Triangle { v, since: Since::Other, origin, region, alive: true, by: None });
        (0..3).for_each(|_| lean::push(&mut self.nexts, NONE));
        self.link(t);
        t as u32
    }

    /// Adds a vertex where none is, and returns its number. Its star is what will be added to it.
    pub(crate) fn add_vertex(&mut self, position: Position) -> Vertex {
        self.positions.push(position.coordinates());
        self.complete.push(true);
        self.heads.push(NONE);
        self.positions.len() as Vertex - 1
    }

    pub(crate) fn kill(&mut self, t: u32) {
        self.triangles[t as usize].alive = false;
    }

    /// Lets all triangles of `go` use `stay` instead.
    pub(crate) fn merge(&mut self, stay: Vertex, go: Vertex) {
        let mut corner = std::mem::replace(&mut self.heads[go as usize], NONE);
        while corner != NONE {
            let at = corner as usize;
            corner = self.nexts[at];
            let triangle = &mut self.triangles[at / 3];
            triangle.v[corner_of(&triangle.v, go, at)] = stay;
            triangle.since = Since::Other;
            self.nexts[at] = self.heads[stay as usize];
            self.heads[stay as usize] = at as u32;
        }
    }

    /// A triangle of the file as its record has it, which is read only if it has had another vertex since; `None` if it is none.
    pub(crate) fn as_read(&self, records: &[Record], t: u32) -> Option<[[f32; 3]; 3]> {
        let triangle = &self.triangles[t as usize];
        let Origin::Input(record) = triangle.origin else { return None };
        let [a, b, c] = self.points(t);
        Some(match triangle.since {
            Since::Same => [a, b, c],
            Since::Turned => [a, c, b],
            Since::Other => corners(records, record).map(position::canonical),
        })
    }

    /// Is it a living triangle of the file with the corners of its record, whichever way round? Reads that as [`Self::as_read`] does.
    pub(crate) fn stands(&self, records: &[Record], t: u32) -> bool {
        let now = self.points(t);
        self.lives(t) && self.as_read(records, t).is_some_and(|[a, b, c]| [a, b, c] == now || [a, c, b] == now)
    }

    pub(crate) fn points(&self, t: u32) -> [[f32; 3]; 3] {
        self.triangles[t as usize].v.each(|v| self.positions[v as usize])
    }

    /// Exactly collinear corners.
    pub(crate) fn is_collinear(&self, t: u32) -> bool {
        let [a, b, c] = self.points(t);
        crate::geometry::collinear::is_collinear(&a, &b, &c)
    }

    /// The record `t` comes from; past all records for a new triangle.
    pub(crate) fn record(&self, t: u32) -> u32 {
        self.triangles[t as usize].record()
    }

    /// Living triangles with three distinct vertices, by number.
    pub(crate) fn living(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.triangles.len() as u32).filter(|t| self.lives(*t))
    }

    /// A living triangle with three distinct vertices.
    pub(crate) fn lives(&self, t: u32) -> bool {
        let t = &self.triangles[t as usize];
        t.alive && !has_repeated(t.v)
    }

    /// Living triangles around `v`, each with the number of `v`'s corner.
    pub(crate) fn star(&self, v: Vertex) -> impl Iterator<Item = (u32, usize)> + '_ {
        let mut corner = self.heads[v as usize];
        std::iter::from_fn(move || {
            while corner != NONE {
                steps::count(1);
                let at = corner;
                corner = self.nexts[at as usize];
                let triangle = &self.triangles[(at / 3) as usize];
                if triangle.alive && !has_repeated(triangle.v) {
                    return Some((at / 3, corner_of(&triangle.v, v, at as usize)));
                }
            }
            None
        })
    }

    /// All triangles in the star list of `v`, dead ones too.
    pub(crate) fn linked(&self, v: Vertex) -> impl Iterator<Item = u32> + '_ {
        let mut corner = self.heads[v as usize];
        std::iter::from_fn(move || {
            let at = (corner != NONE).then_some(corner)?;
            corner = self.nexts[at as usize];
            Some(at / 3)
        })
    }

    /// Living triangles that have both corners, in the order of a star: O(the smaller star). Of two stars it cannot be known beforehand which one
    /// that is, so both are gone along until one ends.
    pub(crate) fn at_edge(&self, a: Vertex, b: Vertex) -> impl Iterator<Item = u32> + '_ {
        let (mut left, mut right) = (self.star(a), self.star(b));
        let (of, end) = loop {
            match (left.next(), right.next()) {
                (None, _) => break (a, b),
                (_, None) => break (b, a),
                _ => {}
            }
        };
        self.star(of).map(|(t, _)| t).filter(move |t| self.triangles[*t as usize].v.contains(&end))
    }

    /// Whether a living triangle holds the edge `a`–`b`. One of the ends must be complete to be sure.
    pub(crate) fn has_edge(&self, a: Vertex, b: Vertex) -> bool {
        self.at_edge(a, b).next().is_some()
    }

    /// Shortest edge around `v`.
    pub(crate) fn shortest_edge(&self, v: Vertex) -> f64 {
        let ends = self.star(v).flat_map(|(t, k)| {
            let corners = self.triangles[t as usize].v;
            [corners[(k + 1) % 3], corners[(k + 2) % 3]]
        });
        ends.map(|w| self.distance(v, w)).fold(f64::INFINITY, f64::min)
    }

    /// A position in f64.
    pub(crate) fn place(&self, v: Vertex) -> DVec3 {
        place(self.positions[v as usize])
    }

    /// The way from one vertex to another.
    pub(crate) fn vector(&self, from: Vertex, to: Vertex) -> DVec3 {
        self.place(to) - self.place(from)
    }

    /// Normal of a triangle, twice its area long.
    pub(crate) fn normal(&self, t: u32) -> DVec3 {
        let [a, b, c] = self.triangles[t as usize].v;
        self.vector(a, b).cross(self.vector(a, c))
    }

    pub(crate) fn distance(&self, a: Vertex, b: Vertex) -> f64 {
        distance(self.positions[a as usize], self.positions[b as usize])
    }
}

pub(crate) fn has_repeated(v: [Vertex; 3]) -> bool {
    v[0] == v[1] || v[1] == v[2] || v[2] == v[0]
}

pub(crate) fn corners(records: &[Record], t: u32) -> [[f32; 3]; 3] {
    record::corners(&records[t as usize])
}
