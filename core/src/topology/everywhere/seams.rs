//! From the pieces of chunks to those of the file, and what is to be done with each.

use crate::topology::everywhere::chunk::{Piece, Pieces};
use crate::util::ids::NONE;
use crate::util::parity::Parity;
use crate::util::radix;

/// What becomes of the triangles of a piece.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fate {
    /// Copies go: the whole piece is drawn several times.
    pub(super) drops_copies: bool,
    /// Triangles of this side turn.
    pub(super) turns: Option<bool>,
}

/// The fates of all pieces, chunk by chunk.
#[derive(Default)]
pub(super) struct Fates {
    fates: Vec<Fate>,
    /// The first piece of each chunk.
    bases: Vec<u32>,
}

impl Fates {
    /// Unites the pieces of chunks that share a triangle. `turns`: triangles are to be turned where they disagree. O(seams + pieces), sorted.
    pub(super) fn of(chunks: &mut [Pieces], turns: bool) -> Self {
        let mut bases = Vec::with_capacity(chunks.len());
        let (mut pieces, mut seams) = (Vec::<Piece>::new(), Vec::with_capacity(chunks.iter().map(|c| c.seams.len()).sum()));
        for chunk in chunks {
            let base = pieces.len() as u32;
            bases.push(base);
            pieces.append(&mut chunk.pieces);
            seams
                .extend(std::mem::take(&mut chunk.seams).into_iter().map(|(triangle, piece, odd)| (triangle, base + piece, odd)));
        }
        radix::sort_by_number(&mut seams, |seam| seam.0);
        let mut parity = Parity::new(pieces.len());
        for shared in seams.chunk_by(|a, b| a.0 == b.0) {
            for other in &shared[1..] {
                if !parity.relate(shared[0].1, other.1, shared[0].2 != other.2) {
                    pieces[other.1 as usize].one_sided = true;
                }
            }
        }
        let mut whole = vec![Piece::NONE; pieces.len()];
        for (number, piece) in (0..).zip(&pieces) {
            let (root, odd) = parity.find(number);
            let whole = &mut whole[root as usize];
            for side in 0..2 {
                let into = &mut whole.sides[side ^ usize::from(odd)];
                *into = (into.0 + piece.sides[side].0, into.1.min(piece.sides[side].1));
            }
            whole.copied |= piece.copied;
            whole.uneven |= piece.uneven;
            whole.one_sided |= piece.one_sided;
        }
        let fates = (0..pieces.len() as u32).map(|number| {
            let (root, odd) = parity.find(number);
            let Fate { drops_copies, turns: side } = fate(&whole[root as usize]);
            Fate { drops_copies, turns: side.filter(|_| turns).map(|side| side != odd) }
        });
        Self { fates: fates.collect(), bases }
    }

    /// What becomes of a piece of a chunk, by the chunk's own number; nothing of none.
    pub(super) fn get(&self, chunk: usize, piece: u32) -> Fate {
        if piece == NONE { Fate::default() } else { self.fates[(self.bases[chunk] + piece) as usize] }
    }
}

/// As the repairs decide it: copies go where the surface is closed as well without them, and the smaller side is turned, of equal sides the one that begins later.
fn fate(piece: &Piece) -> Fate {
    let [even, odd] = piece.sides;
    let is_drawn_once = !piece.copied || !piece.uneven;
    let odd_wins = odd.0 > even.0 || odd.0 == even.0 && odd.1 < even.1;
    let is_turned = is_drawn_once && !piece.one_sided && even.0 > 0 && odd.0 > 0;
    Fate { drops_copies: piece.copied && !piece.uneven, turns: is_turned.then_some(!odd_wins) }
}
