//! The surface of one chunk, however often it is drawn and whichever way its triangles face.
//!
//! Triangles on the same three vertices are **copies**; the first of them stands for all. A **piece** is what hangs together through edges of two such
//! triangles. Along an edge where all triangles have as many copies, in one direction each, the surface is drawn so many times; elsewhere the piece is
//! **uneven**. A chunk sees all triangles at an edge with an end at home there, and all copies of a triangle with a corner there.

use crate::geometry::position::Position;
use crate::io::record::Point;
use crate::stream::plan::HomeBox;
use crate::stream::source::{Seen, Source, Triangle};
use crate::topology::labels::{LabelWriter, Labels};
use crate::topology::vertex_table::{BATCH, Weld};
use crate::util::ids::NONE;
use crate::util::parity::Parity;

/// What is known of a piece, in one chunk or in the file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Triangles on its even and its odd side, copies left out, and the smallest record of each.
    pub(super) sides: [(u64, u32); 2],
    /// Triangles in it are drawn more than once.
    pub(super) copied: bool,
    /// Not everywhere equally often.
    pub(super) uneven: bool,
    /// No directions of its triangles satisfy all edges.
    pub(super) one_sided: bool,
}

impl Piece {
    pub(super) const NONE: Self = Self { sides: [(0, NONE); 2], copied: false, uneven: false, one_sided: false };
}

/// What a chunk says of its triangles.
#[derive(Default)]
pub(super) struct Pieces {
    pub(super) pieces: Vec<Piece>,
    /// Triangles that other chunks see, too: record, and piece and side of the triangle that stands for it.
    pub(super) seams: Vec<(u32, u32, bool)>,
    /// By triangle in the order in which they are seen: its piece (none for a triangle that has a vertex twice), whether it lies on the odd side, and
    /// whether it is a copy of an earlier one.
    pub(super) labels: Labels,
    pub(super) odd: Vec<u64>,
    pub(super) copies: Vec<u64>,
    /// Edges of two triangles that disagree; each counted in one chunk.
    pub(super) contradictions: u64,
}

/// A triangle at an edge, kept with the smaller vertex of the edge.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Use {
    other: u32,
    apex: u32,
    triangle: u32,
    forward: bool,
}

/// The tables of a chunk, used again for the next one.
#[derive(Default)]
pub(super) struct Chunk {
    vertices: Weld,
    home: Vec<bool>,
    numbers: Vec<u32>,
    /// [`NONE`] where a vertex is there twice.
    triangles: Vec<[u32; 3]>,
    /// The uses of edges by the smaller vertex, and where those of each begin.
    uses: Vec<Use>,
    starts: Vec<u32>,
    /// The triangle that stands for each.
    first: Vec<u32>,
    uneven: Vec<bool>,
    one_sided: Vec<bool>,
    parity: Parity,
    /// The piece of a root.
    piece_of: Vec<u32>,
}

impl Chunk {
    /// O(n log n) at one vertex, O(n) where vertices have few edges.
    pub(super) fn solve(&mut self, seen: &Seen<'_>, cell: HomeBox) -> Pieces {
        self.take(seen, cell);
        self.gather_uses();
        let contradictions = self.relate();
        self.told(contradictions)
    }

    /// Numbers the vertices.
    fn take(&mut self, seen: &Seen<'_>, cell: HomeBox) {
        self.numbers.clear();
        self.triangles.clear();
        self.vertices.reset(seen.count() / 2);
        let mut corners: Vec<[Point; 3]> = Vec::with_capacity(BATCH / 3);
        seen.for_each(|number, triangle| {
            self.numbers.push(number);
            corners.push(triangle.corners());
            if corners.len() == BATCH / 3 {
                number_corners(&mut self.vertices, &mut corners, &mut self.triangles);
            }
        });
        number_corners(&mut self.vertices, &mut corners, &mut self.triangles);
        self.home.clear();
        self.home.extend(self.vertices.positions().iter().map(|p| cell.holds(*p)));
    }

    /// The edges with an end at home, each with its triangles, by vertices.
    fn gather_uses(&mut self) {
        let home = &self.home;
        let uses = |triangles: &[[u32; 3]], visit: &mut dyn FnMut(usize, Use)| {
            for (t, v) in (0..).zip(triangles).filter(|(_, v)| v[0] != NONE) {
                for k in 0..3 {
                    let (a, b, apex) = (v[k], v[(k + 1) % 3], v[(k + 2) % 3]);
                    if home[a as usize] || home[b as usize] {
                        visit(a.min(b) as usize, Use { other: a.max(b), apex, triangle: t, forward: a < b });
                    }
                }
            }
        };
        // One more than is needed, so that filling leaves the ends where the starts of the next are wanted.
        self.starts.clear();
        self.starts.resize(home.len() + 2, 0);
        uses(&self.triangles, &mut |vertex, _| self.starts[vertex + 2] += 1);
        for v in 2..self.starts.len() {
            self.starts[v] += self.starts[v - 1];
        }
        self.uses.clear();
        self.uses.resize(self.starts[home.len() + 1] as usize, Use::default());
        uses(&self.triangles, &mut |vertex, one| {
            let place = &mut self.starts[vertex + 1];
            self.uses[*place as usize] = one;
            *place += 1;
        });
        for vertex in self.starts.windows(2).take(home.len()) {
            self.uses[vertex[0] as usize..vertex[1] as usize].sort_unstable();
        }
    }

    /// Finds copies and puts pieces together; counts the edges whose smaller end is at home and whose two triangles disagree.
    fn relate(&mut self) -> u64 {
        let count = self.triangles.len();
        self.first.clear();
        self.first.extend(0..count as u32);
        for flags in [&mut self.uneven, &mut self.one_sided] {
            flags.clear();
            flags.resize(count, false);
        }
        self.parity.reset(count);
        let mut contradictions = 0;
        for vertex in 0..self.home.len() {
            let uses = &self.uses[self.starts[vertex] as usize..self.starts[vertex + 1] as usize];
            for edge in uses.chunk_by(|a, b| a.other == b.other) {
                let (mut faces, mut is_even) = (0, true);
                let often = edge.iter().take_while(|one| one.apex == edge[0].apex).count();
                for copies in edge.chunk_by(|a, b| a.apex == b.apex) {
                    copies[1..].iter().for_each(|copy| self.first[copy.triangle as usize] = copies[0].triangle);
                    is_even &= copies.len() == often && copies.iter().all(|copy| copy.forward == copies[0].forward);
                    faces += 1;
                }
                if !is_even || faces > 2 && often > 1 {
                    edge.iter().for_each(|one| self.uneven[one.triangle as usize] = true);
                } else if faces == 2 {
                    let [a, b] = [edge[0], edge[often]];
                    let disagree = a.forward == b.forward;
                    if !self.parity.relate(a.triangle, b.triangle, disagree) {
                        self.one_sided[a.triangle as usize] = true;
                    }
                    if disagree {
                        let [p, q] = [vertex, a.other as usize].map(|v| Position::of(self.vertices.positions()[v]));
                        contradictions += u64::from(self.home[if p < q { vertex } else { a.other as usize }]);
                    }
                }
            }
        }
        contradictions
    }

    /// What was found, by pieces in the order in which they are seen.
    fn told(&mut self, contradictions: u64) -> Pieces {
        let count = self.triangles.len();
        let mut told =
            Pieces { odd: vec![0; count.div_ceil(64)], copies: vec![0; count.div_ceil(64)], contradictions, ..Pieces::default() };
        let mut labels = LabelWriter::default();
        self.piece_of.clear();
        self.piece_of.resize(count, NONE);
        for t in 0..count {
            let v = self.triangles[t];
            if v[0] == NONE {
                labels.push(NONE);
                continue;
            }
            let first = self.first[t];
            let (root, odd) = self.parity.find(first);
            let number = &mut self.piece_of[root as usize];
            if *number == NONE {
                *number = told.pieces.len() as u32;
                told.pieces.push(Piece::NONE);
            }
            let piece = &mut told.pieces[*number as usize];
            labels.push(*number);
            piece.uneven |= self.uneven[t];
            piece.one_sided |= self.one_sided[t];
            told.odd[t / 64] |= u64::from(odd) << (t % 64);
            if first as usize != t {
                piece.copied = true;
                told.copies[t / 64] |= 1 << (t % 64);
                continue;
            }
            if self.home[v[0] as usize] {
                let side = &mut piece.sides[usize::from(odd)];
                *side = (side.0 + 1, side.1.min(self.numbers[t]));
            }
            if v.iter().any(|v| !self.home[*v as usize]) {
                told.seams.push((self.numbers[t], *number, odd));
            }
        }
        told.labels = Labels::Runs(labels.finish());
        told
    }
}

/// The vertices of some triangles.
fn number_corners(vertices: &mut Weld, corners: &mut Vec<[Point; 3]>, triangles: &mut Vec<[u32; 3]>) {
    let mut numbers = [[NONE; 3]; BATCH / 3];
    vertices.vertices(corners.as_flattened(), numbers.as_flattened_mut());
    let is_void = |[a, b, c]: [u32; 3]| a == b || b == c || c == a;
    triangles.extend(numbers[..corners.len()].iter().map(|v| if is_void(*v) { [NONE; 3] } else { *v }));
    corners.clear();
}
