//! Which pieces of surface are replaced together.

use crate::geometry::position::Position;
use crate::repairs::shared::overlay::Which;
use crate::repairs::shared::pieces::components_of_records;
use crate::repairs::shared::work::Work;
use crate::submesh::Submesh;
use crate::submesh::components::{self, Components};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use std::collections::{BTreeMap, BTreeSet};

/// A soup has so many open pieces at least, and none of them is more than four times their mean if there are no more.
const SOUP_PIECES: usize = 16;

/// Loops that were left open on purpose, each by a vertex.
#[derive(Clone, Copy)]
pub(crate) struct Kept<'a> {
    pub(crate) open: &'a [[f32; 3]],
    /// Those of them that are rims of lone sheets, and may go with what they run into.
    pub(crate) sheets: &'a [[f32; 3]],
}

/// Which pieces are to be replaced together.
pub(crate) struct Groups {
    pub(crate) parents: Vec<u32>,
    /// Pieces that are no solid, or run into one.
    pub(crate) broken: Vec<bool>,
    /// Pieces with a loop that was left open on purpose.
    pub(crate) kept: Vec<bool>,
    /// Those pieces that are lone sheets.
    pub(crate) sheets: Vec<bool>,
}

impl Groups {
    pub(crate) fn of(
        survey: &Survey<'_>,
        work: &mut Work<'_>,
        pieces: &Components,
        pairs: Option<&[[Which; 2]]>,
        kept: Kept<'_>,
    ) -> Self {
        let (submesh, edges) = work.edges();
        let count = pieces.list.len();
        let mut groups = Self {
            parents: (0..count as u32).collect(),
            broken: pieces.list.iter().map(|piece| piece.open).collect(),
            kept: vec![false; count],
            sheets: vec![false; count],
        };
        let of = |t: u32| pieces.of_triangle[t as usize];
        for edge in edges.iter().filter(|e| e.uses.len() != 2 || e.is_inconsistent()) {
            edge.uses.windows(2).for_each(|pair| groups.unite(of(pair[0].triangle()), of(pair[1].triangle())));
            edge.uses.iter().for_each(|u| groups.broken[of(u.triangle()) as usize] = true);
        }
        for v in components::nonmanifold_vertices(submesh, survey.threads()) {
            let around: Vec<u32> = submesh.star(v).map(|(t, _)| of(t)).collect();
            around.iter().for_each(|piece| groups.broken[*piece as usize] = true);
            around.windows(2).for_each(|pair| groups.unite(pair[0], pair[1]));
        }
        for t in submesh.living().filter(|t| submesh.is_collinear(*t)) {
            groups.broken[of(t) as usize] = true;
        }
        match pairs {
            Some(pairs) => {
                let old = pairs.iter().flatten().filter_map(|triangle| triangle.record());
                let of_record = components_of_records(survey, submesh, pieces, old);
                let piece = |triangle: Which| match triangle {
                    Which::Submesh(t) => Some(of(t)),
                    Which::Record(record) => of_record.get(&record).copied(),
                };
                for pair in pairs {
                    if let [Some(a), Some(b)] = pair.map(|triangle| piece(triangle).filter(|piece| *piece != NONE)) {
                        groups.unite(a, b);
                        groups.broken[a as usize] = true;
                        groups.broken[b as usize] = true;
                    }
                }
            }
            // Anything may run into anything.
            None => {
                (1..count as u32).for_each(|piece| groups.unite(0, piece));
                groups.broken.fill(true);
            }
        }
        groups.mark_kept(submesh, pieces, kept);
        groups
    }

    /// Marks the pieces that have a loop which was left open on purpose.
    fn mark_kept(&mut self, submesh: &Submesh, pieces: &Components, kept: Kept<'_>) {
        if kept.open.is_empty() {
            return;
        }
        let positions = |places: &[[f32; 3]]| places.iter().map(|p| Position::of(*p)).collect::<BTreeSet<_>>();
        let [open, sheets] = [kept.open, kept.sheets].map(positions);
        for t in submesh.living() {
            for p in submesh.points(t).map(Position::of).iter().filter(|p| open.contains(p)) {
                let (piece, is_sheet) = (pieces.of_triangle[t as usize] as usize, sheets.contains(p));
                self.sheets[piece] |= is_sheet;
                self.kept[piece] |= !is_sheet;
            }
        }
    }

    /// Must these pieces stay as they are? Something of them was left open on purpose, or they are lone sheets above all.
    pub(crate) fn stay(&self, group: &[u32], pieces: &Components) -> bool {
        let area = |is_counted: &dyn Fn(usize) -> bool| -> i128 {
            let counted = group.iter().map(|piece| *piece as usize).filter(|piece| is_counted(*piece));
            counted.map(|piece| pieces.list[piece].extent.area).sum()
        };
        group.iter().any(|piece| self.kept[*piece as usize]) || 2 * area(&|piece| self.sheets[piece]) > area(&|_| true)
    }

    /// Makes one group of all open pieces if the surface is a soup of them: many, none of them much of it, and together most of all surface. Each
    /// for itself bounds nothing, as a sheet does; whether they do together is seen when they are wrapped. Returns whether it is one.
    pub(crate) fn unite_soup(&mut self, pieces: &Components) -> bool {
        let area = |piece: &u32| pieces.list[*piece as usize].extent.area;
        let open: Vec<u32> = (0..pieces.list.len() as u32).filter(|piece| pieces.list[*piece as usize].open).collect();
        let all: i128 = pieces.list.iter().map(|piece| piece.extent.area).sum();
        let of_open: i128 = open.iter().map(area).sum();
        let largest = open.iter().map(area).max().unwrap_or(0);
        if open.len() < SOUP_PIECES || of_open * 2 <= all || largest * SOUP_PIECES as i128 > of_open * 4 {
            return false;
        }
        open.windows(2).for_each(|pair| self.unite(pair[0], pair[1]));
        open.iter().for_each(|piece| self.sheets[*piece as usize] = false);
        true
    }

    pub(crate) fn unite(&mut self, a: u32, b: u32) {
        if a != NONE && b != NONE {
            crate::util::union_find::unite(&mut self.parents, a, b);
        }
    }

    /// The groups that are to be replaced, each by its pieces, ascending.
    pub(crate) fn list(&mut self) -> Vec<Vec<u32>> {
        let mut all: BTreeMap<u32, (Vec<u32>, bool)> = BTreeMap::new();
        for piece in 0..self.parents.len() as u32 {
            let (list, is_broken) = all.entry(crate::util::union_find::find(&mut self.parents, piece)).or_default();
            list.push(piece);
            *is_broken |= self.broken[piece as usize];
        }
        all.into_values().filter(|(_, is_broken)| *is_broken).map(|(list, _)| list).collect()
    }
}
