//! The vertices of one chunk: what is at each, how far it reaches, and what there is to count.

use std::ops::Range;

use glam::DVec3;

use super::reach::{Cells, hash};
use crate::geometry::distance::{Tolerance, place};
use crate::geometry::position::Position;
use crate::io::record::Point;
use crate::stream::plan::HomeBox;
use crate::stream::source::{Seen, Source, Triangle};
use crate::util::ids::NONE;

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
    /// Boundary vertices that hang together with another one.
    pub(crate) weldable: u64,
    /// Vertices that became another one.
    pub(crate) moved: u64,
    pub(crate) farthest: f64,
    pub(crate) moved_triangles: u64,
    /// Triangles, small all over, that lost their area.
    pub(crate) crushed: u64,
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

/// A corner that the chunk knows everything about, with the others of its triangle.
#[derive(Clone, Copy)]
pub(super) struct Corner {
    pub(super) at: Position,
    pub(super) after: Position,
    pub(super) before: Position,
    pub(super) triangle: u32,
    pub(super) number: u8,
}

impl Corner {
    const NONE: Self = {
        let nowhere = Position::ORIGIN;
        Self { at: nowhere, after: nowhere, before: nowhere, triangle: NONE, number: 0 }
    };

    /// Has the triangle two corners in one place?
    #[inline]
    pub(super) fn is_void(&self) -> bool {
        self.at == self.after || self.after == self.before || self.before == self.at
    }
}

/// A vertex: a range of corners, and how near others have to be.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    pub(super) at: Position,
    pub(super) first: u32,
    pub(super) end: u32,
    /// Zero for one that is not on the boundary.
    pub(super) reach: f64,
}

impl Vertex {
    #[inline]
    pub(super) fn place(&self) -> DVec3 {
        place(self.at.coordinates())
    }
}

/// The spoke (an edge seen from one of its ends) that is nearest to one.
#[derive(Clone, Copy)]
pub(super) enum Best {
    Unknown,
    Nothing,
    Spoke { number: u32, vertex: u32 },
}

/// The tables of a chunk, used again for the next one.
#[derive(Default)]
pub(super) struct Chunk {
    pub(super) cells: Cells,
    /// Of the cells of corners, in the order in which they are seen.
    hashes: Vec<u32>,
    /// In the order of the buckets of their cells.
    pub(super) corners: Vec<Corner>,
    pub(super) vertices: Vec<Vertex>,
    /// The first vertex of each bucket, and where the last one ends.
    pub(super) starts: Vec<u32>,
    around: Vec<(Position, bool)>,
    /// Sets of vertices that hang together, and the next one of each set, in a ring.
    pub(super) parents: Vec<u32>,
    pub(super) next: Vec<u32>,
    /// Is a vertex one of a crowd, or stands for one?
    pub(super) crowded: Vec<u8>,
    /// For each spoke the one that continues it best.
    pub(super) best: Vec<Best>,
    pub(super) moves: Vec<Move>,
}

impl Chunk {
    /// Where the corners at home in `cell` go, of triangles that are seen within `margin` of it.
    pub(super) fn solve(&mut self, seen: [&Seen<'_>; 2], cell: HomeBox, margin: f32, reach: Tolerance) -> (&[Move], Counts) {
        let mut counts = Counts::default();
        self.cells = Cells::new(reach.weld);
        self.gather(seen, cell.grown(margin));
        self.unite_by_position();
        self.measure(cell, reach, &mut counts);
        self.hang_together(reach.weld);
        self.move_home(cell, reach.weld, &mut counts);
        (&self.moves, counts)
    }

    #[inline]
    pub(super) fn place(&self, vertex: u32) -> DVec3 {
        self.vertices[vertex as usize].place()
    }

    /// Vertices in the bucket of a cell, and maybe others.
    #[inline]
    pub(super) fn in_cell(&self, cell: [i64; 3]) -> Range<u32> {
        let bucket = hash(cell) as usize & (self.starts.len() - 2);
        self.starts[bucket]..self.starts[bucket + 1]
    }

    /// Takes in the corners within the margin, sorted into the buckets of their cells.
    fn gather(&mut self, seen: [&Seen<'_>; 2], known: HomeBox) {
        let cells = self.cells;
        self.hashes.clear();
        each_triangle(seen, |_, corners| {
            let known = corners.into_iter().filter(|at| known.holds(at.coordinates()));
            self.hashes.extend(known.map(|at| hash(cells.of(place(at.coordinates())))));
        });
        let buckets = (self.hashes.len() / 2).next_power_of_two();
        let mask = buckets - 1;
        // One more than is needed, so that sorting leaves the ends where the starts of the next are wanted.
        self.starts.clear();
        self.starts.resize(buckets + 2, 0);
        self.hashes.iter().for_each(|hash| self.starts[(*hash as usize & mask) + 2] += 1);
        for bucket in 2..buckets + 2 {
            self.starts[bucket] += self.starts[bucket - 1];
        }
        self.corners.clear();
        self.corners.resize(self.hashes.len(), Corner::NONE);
        let mut hashes = self.hashes.iter();
        each_triangle(seen, |triangle, [a, b, c]| {
            for (number, at, after, before) in [(0, a, b, c), (1, b, c, a), (2, c, a, b)] {
                if known.holds(at.coordinates())
                    && let Some(hash) = hashes.next()
                {
                    let place = &mut self.starts[(*hash as usize & mask) + 1];
                    self.corners[*place as usize] = Corner { at, after, before, triangle, number };
                    *place += 1;
                }
            }
        });
        self.starts.pop();
    }

    /// Makes vertices of corners in one place; from here on buckets hold vertices.
    fn unite_by_position(&mut self) {
        self.vertices.clear();
        let mut first = 0;
        for bucket in 0..self.starts.len() - 1 {
            let end = self.starts[bucket + 1];
            self.starts[bucket] = self.vertices.len() as u32;
            let corners = &mut self.corners[first as usize..end as usize];
            // Corners in one place in the order in which triangles are seen, which no result depends on.
            corners.sort_unstable_by_key(|corner| corner.at);
            for group in corners.chunk_by(|a, b| a.at == b.at) {
                let next = first + group.len() as u32;
                self.vertices.push(Vertex { at: group[0].at, first, end: next, reach: 0.0 });
                first = next;
            }
        }
        if let Some(end) = self.starts.last_mut() {
            *end = self.vertices.len() as u32;
        }
    }

    /// Measures how far each vertex reaches, and counts what is at home.
    fn measure(&mut self, cell: HomeBox, reach: Tolerance, counts: &mut Counts) {
        for i in 0..self.vertices.len() {
            let Vertex { at, first, end, .. } = self.vertices[i];
            let here = place(at.coordinates());
            let mut shortest = f64::INFINITY;
            self.around.clear();
            for corner in &self.corners[first as usize..end as usize] {
                if corner.is_void() {
                    continue;
                }
                let Corner { after, before, .. } = *corner;
                self.around.extend([(after, true), (before, false)]);
                // The edge across, too: there is a triangle beyond it, which may have a corner here.
                let [after, before] = [after, before].map(|p| place(p.coordinates()));
                let edges = [here.distance_squared(after), here.distance_squared(before), after.distance_squared(before)];
                shortest = edges.into_iter().fold(shortest, f64::min);
            }
            if self.around.len() > 2 {
                self.around.sort_unstable();
            }
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
                self.vertices[i].reach = reach.weld.min(shortest.sqrt() * reach.edge_share);
            }
        }
    }
}

/// Visits the triangles that are finite.
fn each_triangle(seen: [&Seen<'_>; 2], mut visit: impl FnMut(u32, [Position; 3])) {
    for seen in seen {
        seen.for_each(|number, triangle| {
            let [a, b, c] = triangle.corners();
            if [a, b, c].iter().flatten().all(|x| x.is_finite()) {
                visit(number, [Position::of(a), Position::of(b), Position::of(c)]);
            }
        });
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
