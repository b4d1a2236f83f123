//! Which vertices of a chunk hang together.
//!
//! Three reasons: they are within reach of each other; they crowd in one small cell; or two triangles with edges too short for the tolerance go on across
//! an edge that each has of its own. Such an edge is a *spoke* at each of its ends. Spokes are near each other where both of their ends are. Two that
//! are nearest to each other are one edge that came apart: so vertices find together that lie nearer to others than their own corners do to each other,
//! since the far ends tell the edges apart.

use super::cluster::{Best, Chunk, Vertex};
use super::reach::CROWD;
use crate::geometry::distance::place;
use crate::geometry::position::Position;
use crate::util::union_find::unite;

/// A vertex stands in no crowd, in one, or is the one that stands for it.
const ALONE: u8 = 0;
const IN_CROWD: u8 = 1;
const STANDS_FOR_CROWD: u8 = 2;

/// The key that tells spokes apart, and puts them in order: the end it is seen from, the far end, and whether it leads there in its triangle.
type SpokePlace = (Position, Position, bool);

/// An edge of a triangle, seen from one of its ends.
struct Spoke {
    triangle: u32,
    place: SpokePlace,
    /// Is it the edge of a triangle with two corners in one place?
    is_void: bool,
}

impl Chunk {
    /// Unites vertices that hang together.
    pub(super) fn hang_together(&mut self, weld: f64) {
        let count = self.vertices.len();
        self.parents.clear();
        self.parents.extend(0..count as u32);
        self.next.clear();
        self.next.extend(0..count as u32);
        self.crowded.clear();
        self.crowded.resize(count, ALONE);
        self.crowds(weld);
        self.within_reach();
        self.along_edges(weld);
    }

    /// Does a vertex hang together with another one?
    #[inline]
    pub(super) fn hangs(&self, vertex: u32) -> bool {
        self.next[vertex as usize] != vertex
    }

    #[inline]
    fn link(&mut self, a: u32, b: u32) {
        if unite(&mut self.parents, a, b) {
            self.next.swap(a as usize, b as usize);
        }
    }

    /// Unites the boundary vertices of small cells that hold too many; the smallest stands for all, and takes whatever is within the tolerance of it.
    fn crowds(&mut self, weld: f64) {
        let (cells, fine) = (self.cells, self.cells.finer());
        let mut firsts = Vec::new();
        for bucket in 0..self.starts.len() - 1 {
            let within = self.starts[bucket]..self.starts[bucket + 1];
            if within.len() <= CROWD {
                continue;
            }
            let vertices = within.map(|i| (self.vertices[i as usize], i)).filter(|(vertex, _)| vertex.reach > 0.0);
            let mut all: Vec<([i64; 3], Position, u32)> = vertices.map(|(v, i)| (fine.of(v.place()), v.at, i)).collect();
            all.sort_unstable();
            for crowd in all.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > CROWD) {
                let first = crowd[0].2;
                firsts.push(first);
                for (_, _, i) in crowd {
                    self.crowded[*i as usize] = IN_CROWD;
                    self.link(first, *i);
                }
                self.crowded[first as usize] = STANDS_FOR_CROWD;
            }
        }
        for first in firsts {
            let here = self.place(first);
            cells.near(here, weld, |cell| {
                for other in self.in_cell(cell) {
                    let is_open = self.crowded[other as usize] != IN_CROWD && self.vertices[other as usize].reach > 0.0;
                    if is_open && here.distance_squared(self.place(other)) <= weld * weld {
                        self.link(first, other);
                    }
                }
            });
        }
    }

    /// Unites vertices within reach of each other.
    fn within_reach(&mut self) {
        let cells = self.cells;
        for i in 0..self.vertices.len() as u32 {
            let vertex = self.vertices[i as usize];
            if vertex.reach <= 0.0 || self.crowded[i as usize] != ALONE {
                continue;
            }
            let here = vertex.place();
            cells.near(here, vertex.reach, |cell| {
                // The other one of two finds this one, if it is later.
                let within = self.in_cell(cell);
                for other in within.start..within.end.min(i) {
                    let Vertex { at, reach, .. } = self.vertices[other as usize];
                    let nearest = vertex.reach.min(reach);
                    let is_near = here.distance_squared(place(at.coordinates())) <= nearest * nearest;
                    if is_near && reach > 0.0 && self.crowded[other as usize] == ALONE {
                        self.link(i, other);
                    }
                }
            });
        }
    }

    /// Unites vertices across edges that came apart, where edges are short.
    fn along_edges(&mut self, weld: f64) {
        let is_short = |vertex: &Vertex| vertex.reach > 0.0 && vertex.reach < weld;
        if !self.vertices.iter().any(is_short) {
            return;
        }
        let mut best = std::mem::take(&mut self.best);
        best.clear();
        best.resize(2 * self.corners.len(), Best::Unknown);
        for i in 0..self.vertices.len() as u32 {
            let vertex = self.vertices[i as usize];
            if !is_short(&vertex) || self.crowded[i as usize] != ALONE {
                continue;
            }
            for spoke in 2 * vertex.first..2 * vertex.end {
                let Best::Spoke { number: with, vertex: other } = self.best_of(&mut best, i, spoke, weld) else { continue };
                // By place: where triangles lie in one place, any of them will do.
                if let Best::Spoke { number: back, .. } = self.best_of(&mut best, other, with, weld)
                    && self.spoke(back).place == self.spoke(spoke).place
                {
                    self.link(i, other);
                }
            }
        }
        self.best = best;
    }

    /// The spoke with this number: twice its corner, and one more if it comes in.
    #[inline]
    fn spoke(&self, number: u32) -> Spoke {
        let corner = &self.corners[(number / 2) as usize];
        let leaves = number.is_multiple_of(2);
        let far = if leaves { corner.after } else { corner.before };
        Spoke { triangle: corner.triangle, place: (corner.at, far, leaves), is_void: corner.is_void() }
    }

    /// As [`Self::nearest_spoke`], found once.
    fn best_of(&self, best: &mut [Best], vertex: u32, spoke: u32, weld: f64) -> Best {
        let known = &mut best[spoke as usize];
        if matches!(known, Best::Unknown) {
            *known = self.nearest_spoke(vertex, spoke, weld);
        }
        *known
    }

    /// The spoke that is nearest to this one, of another vertex and triangle, with both ends within the tolerance. One in the same direction counts as
    /// farther away.
    fn nearest_spoke(&self, vertex: u32, number: u32, weld: f64) -> Best {
        let own = self.spoke(number);
        if own.is_void {
            return Best::Nothing;
        }
        let [here, there] = [own.place.0, own.place.1].map(|p| place(p.coordinates()));
        let (most, mut nearest, mut best) = (weld * weld, (f64::INFINITY, own.place), Best::Nothing);
        self.cells.near(here, weld, |cell| {
            for with in self.in_cell(cell) {
                let Vertex { at, first, end, reach } = self.vertices[with as usize];
                let near = here.distance_squared(place(at.coordinates()));
                if with == vertex || reach <= 0.0 || near > most || self.crowded[with as usize] != ALONE {
                    continue;
                }
                for number in 2 * first..2 * end {
                    let spoke = self.spoke(number);
                    let far = there.distance_squared(place(spoke.place.1.coordinates()));
                    let times = if spoke.place.2 == own.place.2 { 2.0 } else { 1.0 };
                    let found = (times * (near + far), spoke.place);
                    if far <= most && spoke.triangle != own.triangle && !spoke.is_void && found < nearest {
                        (nearest, best) = (found, Best::Spoke { number, vertex: with });
                    }
                }
            }
        });
        best
    }
}
