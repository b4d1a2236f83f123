//! What is cut: the triangles that cross something, and as much around them as tells what is inside.

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;

use crate::geometry::arrange::{Arrange, Arrangement, Piece};
use crate::geometry::position::Position;
use crate::repairs::shared::work::Work;
use crate::submesh::{ByPosition, Submesh, Vertex};
use crate::util::ids::NONE;
use crate::util::radix::sort_by_number;
use crate::util::scatter::Hashing;

/// Times that the triangles to be cut are added to because a neighbour was cut at its edge.
const GROWTHS: usize = 16;

/// An edge of a piece, by its points, and the piece.
pub(crate) type EdgeOfPiece = ((u32, u32), u32);

/// The triangles that are cut.
pub(crate) struct Cut {
    /// Ascending; the arrangement's sources are places in here.
    pub(crate) sources: Vec<u32>,
    pub(crate) arrangement: Arrangement,
    /// By source: where its pieces begin.
    starts: Vec<u32>,
    /// By point of the arrangement: the corner of sources that is there, or [`NONE`].
    pub(crate) vertices: Vec<Vertex>,
    points: HashMap<Vertex, u32, Hashing>,
    /// Edges of pieces, by their points, with these pieces, ascending.
    uses: Vec<EdgeOfPiece>,
}

impl Cut {
    /// Takes in what lies along edges that are cut, until the rim of what was taken is whole, and the closed surfaces around non-manifold
    /// edges.
    pub(crate) fn of(
        engine: &dyn Arrange,
        work: &mut Work<'_>,
        crossing: &BTreeSet<u32>,
        in_play: impl Fn(u32) -> bool,
        threads: usize,
    ) -> Option<Self> {
        let (_, edges) = work.edges();
        let in_play = |t: &u32| in_play(*t);
        let mut sources = crossing.clone();
        for edge in edges.iter().filter(|edge| edge.is_nonmanifold()) {
            sources.extend(edge.uses.iter().map(|u| u.triangle()).filter(in_play));
        }
        // Arranging takes much itself.
        work.forget_edges();
        let submesh: &Submesh = work;
        crossing.iter().for_each(|t| sources.extend((0..3).flat_map(|k| beside(submesh, *t, k)).filter(in_play)));
        for _ in 0..GROWTHS {
            let list: Vec<u32> = sources.iter().copied().collect();
            let corners: Vec<_> = list.iter().map(|t| submesh.points(*t)).collect();
            let cut = Self::new(submesh, list, engine.arrange(&corners, threads)?);
            let before = sources.len();
            for s in 0..cut.sources.len() {
                let t = cut.sources[s];
                for k in (0..3).filter(|k| !cut.is_alone(submesh, s, *k)) {
                    sources.extend(beside(submesh, t, k).filter(in_play));
                }
            }
            if sources.len() == before {
                return Some(cut);
            }
        }
        None
    }

    fn new(submesh: &Submesh, sources: Vec<u32>, arrangement: Arrangement) -> Self {
        let mut starts: Vec<u32> = vec![0; sources.len() + 1];
        arrangement.pieces.iter().for_each(|piece| starts[piece.source as usize + 1] += 1);
        (0..sources.len()).for_each(|s| starts[s + 1] += starts[s]);
        let corners = sources.iter().flat_map(|t| submesh.triangles[*t as usize].v);
        let by_position: ByPosition = corners.map(|v| (Position::of(submesh.positions[v as usize]), v)).collect();
        let at = |p: &[f64; 3]| by_position.get(&Position::exactly(*p)?).copied();
        let corner = |(p, exact): (&[f64; 3], &bool)| exact.then(|| at(p)).flatten().unwrap_or(NONE);
        let vertices: Vec<Vertex> = arrangement.points.iter().zip(&arrangement.exact).map(corner).collect();
        let points = (0..).zip(&vertices).filter(|(_, v)| **v != NONE).map(|(point, v)| (*v, point)).collect();
        let edges = |(number, piece): (u32, &Piece)| {
            let v = piece.v;
            [(v[0], v[1]), (v[1], v[2]), (v[2], v[0])].map(|(a, b)| ((a.min(b), a.max(b)), number))
        };
        let mut uses: Vec<EdgeOfPiece> = (0..).zip(&arrangement.pieces).flat_map(edges).collect();
        // Stably, so that of an edge they stay in the order of the pieces.
        sort_by_number(&mut uses, |((_, b), _)| *b);
        sort_by_number(&mut uses, |((a, _), _)| *a);
        Self { sources, arrangement, starts, vertices, points, uses }
    }

    /// Where the pieces of a source are.
    pub(crate) fn range(&self, source: usize) -> Range<usize> {
        self.starts[source] as usize..self.starts[source + 1] as usize
    }

    /// The pieces at each edge.
    pub(crate) fn at_edges(&self) -> impl Iterator<Item = &[EdgeOfPiece]> {
        self.uses.chunk_by(|a, b| a.0 == b.0)
    }

    /// The pieces of a source.
    pub(crate) fn pieces(&self, source: usize) -> &[Piece] {
        &self.arrangement.pieces[self.range(source)]
    }

    /// The piece of a source that has its edge from corner `k` on as it was.
    pub(crate) fn whole_edge(&self, submesh: &Submesh, source: usize, k: usize) -> Option<&Piece> {
        let v = submesh.triangles[self.sources[source] as usize].v;
        let (a, b) = (*self.points.get(&v[k])?, *self.points.get(&v[(k + 1) % 3])?);
        self.pieces(source).iter().find(|piece| (0..3).any(|k| (piece.v[k], piece.v[(k + 1) % 3]) == (a, b)))
    }

    /// Is a source's edge from corner `k` on as it was, with no pieces there but those of triangles that have the same edge? Else all of these have
    /// to be cut along: of the space around the edge nothing can be told without them.
    fn is_alone(&self, submesh: &Submesh, source: usize, k: usize) -> bool {
        let v = submesh.triangles[self.sources[source] as usize].v;
        let ends = [v[k], v[(k + 1) % 3]];
        let [Some(a), Some(b)] = ends.map(|v| self.points.get(&v).copied()) else { return false };
        let key = (a.min(b), a.max(b));
        let first = self.uses.partition_point(|(edge, _)| *edge < key);
        let here = || self.uses[first..].iter().take_while(|(edge, _)| *edge == key);
        let around = || here().map(|(_, piece)| self.arrangement.pieces[*piece as usize].source as usize);
        around().any(|s| s == source)
            && around().all(|s| ends.iter().all(|end| submesh.triangles[self.sources[s] as usize].v.contains(end)))
    }
}

/// Other triangles at the edge of `t` from its corner `k` on.
fn beside(submesh: &Submesh, t: u32, k: usize) -> impl Iterator<Item = u32> {
    let v = submesh.triangles[t as usize].v;
    submesh.at_edge(v[k], v[(k + 1) % 3]).filter(move |o| *o != t)
}
