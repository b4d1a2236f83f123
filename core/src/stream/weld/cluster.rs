//! What hangs together in one chunk, and where its corners go.

use std::collections::BTreeSet;

use glam::DVec3;

use super::reach::{WIDEST, cell_of, cells_near};
use crate::geometry::distance::{Tolerance, place};
use crate::geometry::position::Position;
use crate::geometry::sums::Bounds;
use crate::io::record::Point;
use crate::stream::plan::HomeBox;
use crate::stream::source::{Seen, Source, Triangle};
use crate::util::ids::NONE;
use crate::util::union_find::{find, unite};

/// More vertices in one cell are a crowd.
const CROWD: u32 = 256;

/// A corner of a triangle that goes elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Move {
    pub(super) triangle: u32,
    pub(super) corner: u8,
    pub(super) to: Point,
}

/// What was counted, by vertices at home, and edges whose smaller end is.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Counts {
    pub(crate) triangles: u64,
    pub(crate) vertices: u64,
    pub(crate) edges: u64,
    pub(crate) boundary_edges: u64,
    pub(crate) nonmanifold_edges: u64,
    pub(crate) inconsistent_edges: u64,
    pub(crate) unbalanced_edges: u64,
    /// Boundary vertices within reach of another one.
    pub(crate) weldable: u64,
    /// Vertices that became another one.
    pub(crate) moved: u64,
    pub(crate) farthest: f64,
    pub(crate) moved_triangles: u64,
}

impl Counts {
    pub(super) fn add(&mut self, more: &Self) {
        self.vertices += more.vertices;
        self.edges += more.edges;
        self.boundary_edges += more.boundary_edges;
        self.nonmanifold_edges += more.nonmanifold_edges;
        self.inconsistent_edges += more.inconsistent_edges;
        self.unbalanced_edges += more.unbalanced_edges;
        self.weldable += more.weldable;
        self.moved += more.moved;
        self.farthest = self.farthest.max(more.farthest);
    }
}

/// A corner that the chunk knows everything about.
#[derive(Clone, Copy)]
struct Corner {
    /// Of its position.
    key: u128,
    /// Place in the triangles that are seen, times three, and the corner.
    slot: u32,
}

/// A vertex: a range of corners, and how near others have to be.
#[derive(Clone, Copy)]
struct Vertex {
    at: Position,
    place: DVec3,
    first: u32,
    end: u32,
    /// Zero for one that is not on the boundary.
    reach: f64,
}

/// The tables of a chunk, used again for the next one.
#[derive(Default)]
pub(super) struct Chunk {
    triangles: Vec<(u32, [Position; 3])>,
    corners: Vec<Corner>,
    vertices: Vec<Vertex>,
    around: Vec<(Position, bool)>,
    heads: Vec<u32>,
    next: Vec<u32>,
    parents: Vec<u32>,
    near: Vec<bool>,
    moves: Vec<Move>,
}

impl Chunk {
    /// Where the corners at home in `cell` go, of triangles that are seen within `margin` of it.
    pub(super) fn solve(&mut self, seen: [&Seen<'_>; 2], cell: HomeBox, margin: f32, reach: Tolerance) -> (&[Move], Counts) {
        let mut counts = Counts::default();
        self.gather(seen, cell.grown(margin));
        self.measure(cell, reach, &mut counts);
        self.hang_together(reach.weld);
        self.move_home(cell, reach.weld, &mut counts);
        (&self.moves, counts)
    }

    fn at(&self, vertex: u32) -> Position {
        self.vertices[vertex as usize].at
    }

    fn place(&self, vertex: u32) -> DVec3 {
        self.vertices[vertex as usize].place
    }

    /// Takes in the triangles, and their corners within the margin in the order of their positions.
    fn gather(&mut self, seen: [&Seen<'_>; 2], known: HomeBox) {
        self.triangles.clear();
        self.corners.clear();
        for seen in seen {
            seen.for_each(|number, triangle| {
                let corners = triangle.corners();
                if !corners.iter().flatten().all(|x| x.is_finite()) {
                    return;
                }
                let slot = 3 * self.triangles.len() as u32;
                let corners = corners.map(Position::of);
                for (slot, corner) in (slot..).zip(&corners) {
                    if known.holds(corner.coordinates()) {
                        self.corners.push(Corner { key: corner.key(), slot });
                    }
                }
                self.triangles.push((number, corners));
            });
        }
        // Corners in one place in the order in which triangles are seen, which no result depends on.
        self.corners.sort_unstable_by_key(|corner| corner.key);
        self.vertices.clear();
        let mut first = 0;
        for group in self.corners.chunk_by(|a, b| a.key == b.key) {
            let end = first + group.len() as u32;
            let at = self.triangles[(group[0].slot / 3) as usize].1[(group[0].slot % 3) as usize];
            self.vertices.push(Vertex { at, place: place(at.coordinates()), first, end, reach: 0.0 });
            first = end;
        }
    }

    /// Measures how far each vertex reaches, and counts what is at home.
    fn measure(&mut self, cell: HomeBox, reach: Tolerance, counts: &mut Counts) {
        for i in 0..self.vertices.len() {
            let Vertex { at, place: here, first, end, .. } = self.vertices[i];
            let mut shortest = f64::INFINITY;
            self.around.clear();
            for corner in &self.corners[first as usize..end as usize] {
                let (_, p) = self.triangles[(corner.slot / 3) as usize];
                let k = (corner.slot % 3) as usize;
                let (after, before) = (p[(k + 1) % 3], p[(k + 2) % 3]);
                if after == at || before == at || after == before {
                    continue;
                }
                self.around.extend([(after, true), (before, false)]);
                for other in [after, before] {
                    shortest = shortest.min(here.distance_squared(place(other.coordinates())));
                }
            }
            let shortest = shortest.sqrt();
            self.around.sort_unstable_by_key(|(other, forward)| (other.key(), *forward));
            let is_home = cell.holds(at.coordinates());
            counts.vertices += u64::from(is_home);
            let mut is_on_boundary = false;
            for uses in self.around.chunk_by(|a, b| a.0 == b.0) {
                is_on_boundary |= uses.len() == 1;
                if is_home && at < uses[0].0 {
                    count_edge(uses, counts);
                }
            }
            if is_on_boundary {
                self.vertices[i].reach = reach.weld.min(shortest * reach.edge_share);
            }
        }
    }

    /// Unites vertices within reach of each other, and marks them.
    fn hang_together(&mut self, weld: f64) {
        let count = self.vertices.len();
        self.parents.clear();
        self.parents.extend(0..count as u32);
        self.near.clear();
        self.near.resize(count, false);
        self.next.clear();
        self.next.resize(count, NONE);
        let size = (2 * count).next_power_of_two().max(2);
        self.heads.clear();
        self.heads.resize(size, NONE);
        let crowds = self.crowds(weld);
        let bucket = |cell: [i64; 3]| hash(cell) as usize & (size - 1);
        for i in 0..count as u32 {
            let (here, reach) = (self.place(i), self.vertices[i as usize].reach);
            let own = cell_of(here, weld);
            if reach <= 0.0 || crowds.contains(&own) {
                continue;
            }
            for cell in cells_near(here, reach, weld) {
                let mut other = self.heads[bucket(cell)];
                while other != NONE {
                    let nearest = reach.min(self.vertices[other as usize].reach);
                    if here.distance_squared(self.place(other)) <= nearest * nearest {
                        unite(&mut self.parents, i, other);
                        (self.near[i as usize], self.near[other as usize]) = (true, true);
                    }
                    other = self.next[other as usize];
                }
            }
            let head = &mut self.heads[bucket(own)];
            self.next[i as usize] = *head;
            *head = i;
        }
    }

    /// Cells with too many vertices that reach anywhere.
    fn crowds(&self, weld: f64) -> BTreeSet<[i64; 3]> {
        if self.vertices.len() <= CROWD as usize {
            return BTreeSet::new();
        }
        let reaching = (0..self.vertices.len() as u32).filter(|i| self.vertices[*i as usize].reach > 0.0);
        let mut cells: Vec<[i64; 3]> = reaching.map(|i| cell_of(self.place(i), weld)).collect();
        cells.sort_unstable();
        cells.chunk_by(|a, b| a == b).filter(|group| group.len() > CROWD as usize).map(|group| group[0]).collect()
    }

    /// Finds where the corners at home go.
    fn move_home(&mut self, cell: HomeBox, weld: f64, counts: &mut Counts) {
        let mut moves = std::mem::take(&mut self.moves);
        moves.clear();
        let of: Vec<u32> = (0..self.vertices.len() as u32).map(|i| find(&mut self.parents, i)).collect();
        let mut members: Vec<(u32, u32)> =
            (0..).zip(&self.near).filter(|(_, near)| **near).map(|(i, _)| (of[i as usize], i)).collect();
        members.sort_unstable();
        let torn = self.with_two_corners(&of);
        for group in members.chunk_by(|a, b| a.0 == b.0) {
            let at_home = group.iter().filter(|(_, i)| cell.holds(self.at(*i).coordinates()));
            counts.weldable += at_home.clone().count() as u64;
            let mut bounds = Bounds::EMPTY;
            group.iter().for_each(|(_, i)| bounds.include(&[self.at(*i).coordinates()]));
            if torn.binary_search(&group[0].0).is_ok() || bounds.diagonal() > WIDEST * weld {
                continue;
            }
            let triangles = |i: u32| self.vertices[i as usize].end - self.vertices[i as usize].first;
            let Some(target) = group.iter().map(|(_, i)| *i).min_by_key(|i| (std::cmp::Reverse(triangles(*i)), self.at(*i)))
            else {
                continue;
            };
            let (to, there) = (self.at(target).coordinates(), self.place(target));
            for (_, i) in at_home.filter(|(_, i)| *i != target) {
                counts.moved += 1;
                counts.farthest = counts.farthest.max(there.distance(self.place(*i)));
                let Vertex { first, end, .. } = self.vertices[*i as usize];
                moves.extend(self.corners[first as usize..end as usize].iter().map(|corner| Move {
                    triangle: self.triangles[(corner.slot / 3) as usize].0,
                    corner: (corner.slot % 3) as u8,
                    to,
                }));
            }
        }
        self.moves = moves;
    }

    /// What hangs together and has two corners of one triangle, which would lose its area: ascending.
    fn with_two_corners(&self, of: &[u32]) -> Vec<u32> {
        let mut sets: Vec<(u32, u32, u32)> = Vec::new();
        for i in (0..self.vertices.len() as u32).filter(|i| self.near[*i as usize]) {
            let Vertex { first, end, .. } = self.vertices[i as usize];
            let corners = &self.corners[first as usize..end as usize];
            sets.extend(corners.iter().map(|corner| (corner.slot / 3, of[i as usize], i)));
        }
        sets.sort_unstable();
        sets.dedup();
        let mut torn: Vec<u32> = sets.windows(2).filter(|w| (w[0].0, w[0].1) == (w[1].0, w[1].1)).map(|w| w[0].1).collect();
        torn.sort_unstable();
        torn.dedup();
        torn
    }
}

/// Counts an edge, by its uses: along it, or against it.
fn count_edge(uses: &[(Position, bool)], counts: &mut Counts) {
    let forward = uses.iter().filter(|(_, forward)| *forward).count();
    counts.edges += 1;
    counts.boundary_edges += u64::from(uses.len() == 1);
    counts.nonmanifold_edges += u64::from(uses.len() > 2);
    counts.inconsistent_edges += u64::from(uses.len() == 2 && forward != 1);
    counts.unbalanced_edges += u64::from(2 * forward != uses.len());
}

fn hash([x, y, z]: [i64; 3]) -> u64 {
    let mix = |h: u64, x: i64| (h ^ x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29);
    [x, y, z].into_iter().fold(0, mix).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 20
}
