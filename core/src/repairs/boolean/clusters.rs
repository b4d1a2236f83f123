//! Pieces of surface that cross each other are solved together.

use crate::submesh::components::Components;
use crate::util::ids::NONE;
use std::collections::BTreeSet;

/// Which triangles are of surfaces that take part: closed before anything was cut, and not blocked.
#[derive(Default)]
pub(crate) struct Clusters {
    /// By triangle of the submesh and by region, the piece of surface that it was part of, or [`NONE`].
    pub(crate) of_triangle: Vec<u32>,
    pub(crate) of_region: Vec<u32>,
    pub(crate) takes_part: Vec<bool>,
    /// Pieces that cross each other are united.
    pub(crate) parents: Vec<u32>,
}

impl Clusters {
    pub(crate) fn of(pieces: &Components, blocked: &[bool]) -> Self {
        Self {
            of_triangle: pieces.of_triangle.clone(),
            of_region: pieces.of_region.clone(),
            takes_part: pieces.list.iter().zip(blocked).map(|(piece, blocked)| !piece.open && !blocked).collect(),
            parents: (0..pieces.list.len() as u32).collect(),
        }
    }

    pub(crate) fn takes_part(&self, piece: u32) -> bool {
        self.takes_part.get(piece as usize) == Some(&true)
    }

    pub(crate) fn holds(&self, triangle: u32) -> bool {
        self.takes_part(self.of_triangle[triangle as usize])
    }

    pub(crate) fn holds_region(&self, region: u32) -> bool {
        self.takes_part(self.of_region[region as usize])
    }

    /// All pieces that cross those of some triangles, and these, as far as they take part; ascending.
    pub(crate) fn pieces_of(&mut self, triangles: &[u32]) -> Vec<u32> {
        let pieces = triangles.iter().map(|t| self.of_triangle[*t as usize]).filter(|piece| *piece != NONE);
        let roots: BTreeSet<u32> =
            pieces.collect::<Vec<_>>().into_iter().map(|piece| crate::util::union_find::find(&mut self.parents, piece)).collect();
        let all = 0..self.parents.len() as u32;
        all.filter(|piece| self.takes_part(*piece) && roots.contains(&crate::util::union_find::find(&mut self.parents, *piece)))
            .collect()
    }
}
