//! The exact weld: a vertex is a position, −0.0 and 0.0 being one.

/// Vertices by position, numbered from 0 by first appearance. An open-addressing table of 16-byte slots, since the position is
/// compared far more often than it is inserted.
#[derive(Default)]
pub(crate) struct Weld {
    slots: Vec<Slot>,
    positions: Vec<[f32; 3]>,
}

#[derive(Clone, Copy)]
struct Slot {
    position: [f32; 3],
    vertex: u32,
}

const FREE: Slot = Slot { position: [0.0; 3], vertex: u32::MAX };

impl Weld {
    /// Forgets everything and makes room for about `vertices` (it grows when there are more). Keeps its memory.
    pub(crate) fn reset(&mut self, vertices: usize) {
        self.positions.clear();
        self.slots.clear();
        self.slots.resize((vertices.max(64) * 3 / 2).next_power_of_two(), FREE);
    }

    /// The vertex at a finite position.
    #[inline]
    pub(crate) fn vertex(&mut self, p: [f32; 3]) -> u32 {
        let position = normalised(p);
        self.probe(position).unwrap_or_else(|free| self.insert(free, position))
    }

    /// The vertex at a position, if there is one.
    #[inline]
    pub(crate) fn find(&self, p: [f32; 3]) -> Option<u32> {
        self.probe(normalised(p)).ok()
    }

    /// The vertex at a normalised position, or the slot where it would go.
    #[inline]
    fn probe(&self, position: [f32; 3]) -> Result<u32, usize> {
        let mask = self.slots.len() - 1;
        let mut at = slot_of(position, self.slots.len());
        loop {
            let slot = self.slots[at];
            if slot.vertex == u32::MAX {
                return Err(at);
            }
            if slot.position == position {
                return Ok(slot.vertex);
            }
            at = (at + 1) & mask;
        }
    }

    #[inline]
    fn insert(&mut self, at: usize, position: [f32; 3]) -> u32 {
        let vertex = self.positions.len() as u32;
        self.slots[at] = Slot { position, vertex };
        self.positions.push(position);
        if self.positions.len() * 3 > self.slots.len() * 2 {
            self.grow();
        }
        vertex
    }

    #[cold]
    fn grow(&mut self) {
        let size = self.slots.len() * 2;
        self.slots.clear();
        self.slots.resize(size, FREE);
        for (vertex, position) in self.positions.iter().enumerate() {
            let mut at = slot_of(*position, size);
            while self.slots[at].vertex != u32::MAX {
                at = (at + 1) & (size - 1);
            }
            self.slots[at] = Slot { position: *position, vertex: vertex as u32 };
        }
    }

    /// Positions by vertex number.
    pub(crate) fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// Gives the positions away.
    pub(crate) fn into_positions(self) -> Vec<[f32; 3]> {
        self.positions
    }
}

/// −0.0 becomes 0.0.
#[inline]
fn normalised(p: [f32; 3]) -> [f32; 3] {
    [p[0] + 0.0, p[1] + 0.0, p[2] + 0.0]
}

/// Place of a position in a table of `size` slots, a power of two of at least 2.
#[inline]
fn slot_of(p: [f32; 3], size: usize) -> usize {
    let [x, y, z] = p.map(|c| u64::from(c.to_bits()));
    let h = (x | y << 32).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ z.wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
    let h = (h ^ h >> 32).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    (h >> (64 - size.trailing_zeros())) as usize
}
