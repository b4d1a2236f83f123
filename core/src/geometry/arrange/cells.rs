//! The cells of space between pieces. Around an edge, the space between two neighbouring pieces is one cell.

use std::cmp::Ordering;

use crate::geometry::arrange::piece::{Piece, agree};
use crate::util::ids::NONE;
use crate::util::parallel;
use crate::util::radix::sort_by_number;
use crate::util::union_find::{find, unite};

/// A piece at an edge from a point to a higher one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Use {
    edge: [u32; 2],
    piece: u32,
    /// Does it run with the edge?
    forward: bool,
    /// The corner that is not on the edge.
    apex: u32,
}

/// Where a piece lies as seen from the first one around an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Half {
    Same,
    Left,
    Opposite,
    Right,
}

/// Signs are those of whole triangles: a piece has its source's plane, and lies to the left of an edge that it runs with.
struct Around<'a> {
    triangles: &'a [[[f32; 3]; 3]],
    pieces: &'a [Piece],
    side: &'a (dyn Fn(u32, u32) -> i8 + Sync),
}

impl Around<'_> {
    fn half(&self, a: &Use, b: &Use) -> Half {
        let [source, other] = [a, b].map(|u| self.pieces[u.piece as usize].source);
        let same_way = a.forward == b.forward;
        if source == other {
            return if same_way { Half::Same } else { Half::Opposite };
        }
        match (self.side)(source, b.apex) * if a.forward { 1 } else { -1 } {
            1 => Half::Left,
            -1 => Half::Right,
            _ => {
                let agrees = agree(&self.triangles[source as usize], &self.triangles[other as usize]);
                if agrees == same_way { Half::Same } else { Half::Opposite }
            }
        }
    }

    /// All around an edge, to the left from the first on, with where they lie.
    fn sorted(&self, uses: &[Use]) -> Vec<(Half, Use)> {
        let mut fan: Vec<(Half, Use)> = uses.iter().map(|u| (self.half(&uses[0], u), *u)).collect();
        fan.sort_by(|a, b| {
            let within = || if matches!(a.0, Half::Left | Half::Right) { self.order(&a.1, &b.1) } else { Ordering::Equal };
            a.0.cmp(&b.0).then_with(within).then(a.1.piece.cmp(&b.1.piece))
        });
        fan
    }

    /// Of two that lie within half a turn.
    fn order(&self, a: &Use, b: &Use) -> Ordering {
        match self.half(a, b) {
            Half::Left => Ordering::Less,
            Half::Right => Ordering::Greater,
            Half::Same | Half::Opposite => Ordering::Equal,
        }
    }
}

/// The number of the space to the left of a piece at an edge, as seen along that, and to the right. Each piece has two, in front of it and behind: one that
/// runs with the edge has its front on the left.
fn left(u: &Use) -> u32 {
    2 * u.piece + u32::from(!u.forward)
}

fn right(u: &Use) -> u32 {
    2 * u.piece + u32::from(u.forward)
}

impl Around<'_> {
    /// Adds which spaces around an edge are one.
    fn joins(&self, uses: &[Use], joins: &mut Vec<[u32; 2]>) {
        // Two alone are neighbours on both sides, wherever they lie, if not at one place.
        if let [one, other] = uses
            && self.half(one, other) != Half::Same
        {
            joins.extend([[left(one), right(other)], [left(other), right(one)]]);
            return;
        }
        let fan = if uses.len() == 2 { uses.iter().map(|u| (Half::Same, *u)).collect() } else { self.sorted(uses) };
        let alike = |a: &(Half, Use), b: &(Half, Use)| {
            a.0 == b.0 && (matches!(a.0, Half::Same | Half::Opposite) || self.order(&a.1, &b.1).is_eq())
        };
        let groups: Vec<&[(Half, Use)]> = fan.chunk_by(alike).collect();
        for (group, next) in groups.iter().zip(groups.iter().cycle().skip(1)) {
            let one = &group[0].1;
            for (_, other) in &group[1..] {
                joins.extend([[left(one), left(other)], [right(one), right(other)]]);
            }
            if groups.len() > 1 {
                joins.push([left(one), right(&next[0].1)]);
            }
        }
    }
}

/// Edges are looked at by so many uses at once.
const BLOCK: usize = 1 << 12;

/// Numbers the cells in front of and behind each piece. `side` of a point by the plane of a source. Returns how many numbers there are.
pub(crate) fn number(
    triangles: &[[[f32; 3]; 3]],
    pieces: &mut [Piece],
    side: &(dyn Fn(u32, u32) -> i8 + Sync),
    threads: usize,
) -> u32 {
    let mut uses: Vec<Use> = Vec::with_capacity(3 * pieces.len());
    for (piece, i) in pieces.iter().zip(0..) {
        for k in 0..3 {
            let (a, b) = (piece.v[k], piece.v[(k + 1) % 3]);
            uses.push(Use { edge: [a.min(b), a.max(b)], piece: i, forward: a < b, apex: piece.v[(k + 2) % 3] });
        }
    }
    // Stably, so that of an edge they stay in the order of the pieces.
    sort_by_number(&mut uses, |used| used.edge[1]);
    sort_by_number(&mut uses, |used| used.edge[0]);
    let around = Around { triangles, pieces, side };
    let joins = parallel::map(threads, uses.len().div_ceil(BLOCK), |block| {
        // The edges that begin in the block.
        let begins = |at: usize| at == 0 || uses[at - 1].edge != uses[at].edge;
        let first = |from: usize| (from..uses.len()).find(|at| begins(*at)).unwrap_or(uses.len());
        let (from, to) = (first(block * BLOCK), first(((block + 1) * BLOCK).min(uses.len())));
        let mut joins = Vec::new();
        let edges = uses[from..to.max(from)].chunk_by(|a, b| a.edge == b.edge);
        edges.filter(|uses| uses.len() > 1).for_each(|uses| around.joins(uses, &mut joins));
        joins
    });
    let mut parents: Vec<u32> = (0..2 * pieces.len() as u32).collect();
    for [a, b] in joins.into_iter().flatten() {
        unite(&mut parents, a, b);
    }
    let mut numbers = vec![NONE; parents.len()];
    let mut count = 0;
    for (piece, i) in pieces.iter_mut().zip(0..) {
        for behind in 0..2 {
            let root = find(&mut parents, 2 * i + behind) as usize;
            if numbers[root] == NONE {
                numbers[root] = count;
                count += 1;
            }
            piece.cells[behind as usize] = numbers[root];
        }
    }
    count
}
