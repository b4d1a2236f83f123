//! Where the corners of what hangs together go.

use glam::DVec3;

use super::cluster::{Chunk, Counts, Move};
use super::reach::WIDEST;
use crate::geometry::position::Position;
use crate::geometry::sums::Bounds;
use crate::stream::plan::HomeBox;
use crate::util::union_find::find;

impl Chunk {
    /// Finds where the corners at home go.
    pub(super) fn move_home(&mut self, cell: HomeBox, weld: f64, counts: &mut Counts) {
        self.moves.clear();
        let (mut group, mut wide) = (Vec::new(), Vec::new());
        for root in 0..self.vertices.len() as u32 {
            if !self.hangs(root) || find(&mut self.parents, root) != root {
                continue;
            }
            group.clear();
            let mut bounds = Bounds::EMPTY;
            let (mut i, mut at_home) = (root, 0);
            loop {
                let at = self.at(i);
                bounds.include(&[at.coordinates()]);
                at_home += u64::from(cell.holds(at.coordinates()));
                group.push(i);
                i = self.next[i as usize];
                if i == root {
                    break;
                }
            }
            counts.weldable += at_home;
            if bounds.diagonal() > WIDEST * weld {
                wide.extend(group.iter().map(|i| (self.cells.of(self.place(*i)), *i)));
            } else if at_home > 0 {
                let triangles = |i: u32| self.vertices[i as usize].end - self.vertices[i as usize].first;
                let target = group.iter().min_by_key(|i| (std::cmp::Reverse(triangles(**i)), self.at(**i)));
                self.move_to(*target.unwrap_or(&root), group.iter().copied(), cell, counts);
            }
        }
        self.move_wide(&mut wide, cell, counts);
    }

    #[inline]
    fn at(&self, vertex: u32) -> Position {
        self.vertices[vertex as usize].at
    }

    /// A group that is too wide becomes one vertex in each cell: the one nearest to its middle, the smallest of equals.
    fn move_wide(&mut self, wide: &mut [([i64; 3], u32)], cell: HomeBox, counts: &mut Counts) {
        wide.sort_unstable();
        for group in wide.chunk_by(|a, b| a.0 == b.0) {
            let middle: DVec3 = self.cells.middle(group[0].0);
            let order = |i: u32| (self.place(i).distance_squared(middle), self.at(i));
            let nearest =
                group.iter().map(|(_, i)| (order(*i), *i)).min_by(|a, b| a.0.0.total_cmp(&b.0.0).then(a.0.1.cmp(&b.0.1)));
            if let Some((_, target)) = nearest {
                self.move_to(target, group.iter().map(|(_, i)| *i), cell, counts);
            }
        }
    }

    /// Moves vertices at home to another one.
    fn move_to(&mut self, target: u32, group: impl Iterator<Item = u32>, cell: HomeBox, counts: &mut Counts) {
        let (to, there) = (self.at(target).coordinates(), self.place(target));
        for i in group.filter(|i| *i != target) {
            let vertex = self.vertices[i as usize];
            if !cell.holds(vertex.at.coordinates()) {
                continue;
            }
            counts.moved += 1;
            counts.farthest = counts.farthest.max(there.distance(vertex.place()));
            let corners = &self.corners[vertex.first as usize..vertex.end as usize];
            self.moves.extend(corners.iter().map(|corner| Move { triangle: corner.triangle, corner: corner.number, to }));
        }
    }
}
