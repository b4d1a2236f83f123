//! Memory for the tables of a chunk, counted before it is solved, but for the vertices of a very large one, which are counted as they come.

use crate::stream::budget::Loan;
use crate::topology::{intersect, star};

/// Up to so many members, a chunk may have three vertices a triangle.
const USUAL: u64 = 1 << 18;

/// Vertices of a chunk of `members` triangles that its tables are counted for beforehand. A large one lies around vertices of very many
/// triangles: more vertices than closed surface has are counted as they come.
fn expected_vertices(members: u64) -> u64 {
    if members <= USUAL { 3 * members } else { (members / 2 + members / 16).max(3 * USUAL) }
}

/// Bytes for each vertex of a chunk: slots 16, doubled when full, positions 12, states 4, parents 4.
const BYTES_PER_VERTEX: u64 = 96 + 12 + 4 + 4 + star::BYTES_PER_VERTEX + intersect::BYTES_PER_VERTEX;

/// Bytes that one worker needs for a chunk of `members` triangles, but for the vertices that are counted as they come.
pub(crate) fn scratch_bytes(members: u64) -> u64 {
    // Numbers 4, triangles 12.
    members * (4 + 12 + star::BYTES_PER_TRIANGLE + intersect::BYTES_PER_TRIANGLE) + expected_vertices(members) * BYTES_PER_VERTEX
}

/// Bytes that it needs beside these for slabs, where boxes select badly.
pub(crate) fn askew_bytes(members: u64) -> u64 {
    members * intersect::SLAB_BYTES_PER_TRIANGLE
}

/// Vertices that memory was counted for, by one worker.
#[derive(Default)]
pub(crate) struct Room {
    vertices: u64,
    is_starved: bool,
}

impl Room {
    /// Begins a chunk of so many members, for which [`scratch_bytes`] were taken.
    pub(crate) fn expect(&mut self, members: u64) {
        self.vertices = self.vertices.max(expected_vertices(members));
    }

    /// Counts so many vertices, and room for a quarter more if they are more than before.
    #[inline(always)]
    pub(crate) fn count(&mut self, vertices: usize, loan: &Loan<'_>) {
        while vertices as u64 > self.vertices {
            let more = (self.vertices / 4).max(64);
            self.is_starved |= !loan.take(more * BYTES_PER_VERTEX);
            self.vertices += more;
        }
    }

    /// There was no memory for what was counted.
    pub(crate) fn is_starved(&self) -> bool {
        self.is_starved
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::budget::Budget;

    #[test]
    fn vertices_beyond_those_expected_are_counted_and_given_back() {
        let members = 4 * USUAL;
        let budget = Budget::new(expected_vertices(members) * BYTES_PER_VERTEX);
        let loan = Loan::of(&budget);
        let mut room = Room::default();
        room.expect(members);
        room.count(expected_vertices(members) as usize, &loan);
        assert!(!room.is_starved() && !budget.is_exceeded(), "as many as expected");
        room.count(expected_vertices(members) as usize + 1, &loan);
        assert!(!room.is_starved(), "a quarter more is there");
        room.count(3 * members as usize, &loan);
        assert!(room.is_starved() && budget.is_exceeded());
        drop(loan);
        assert!(!budget.is_exceeded());
    }

    #[test]
    fn closed_surface_of_two_million_triangles_in_one_chunk_takes_half_a_gibibyte() {
        assert!(scratch_bytes(2_000_000) < 1 << 29, "{}", scratch_bytes(2_000_000));
        assert!(scratch_bytes(USUAL) <= scratch_bytes(USUAL + 1));
    }
}
