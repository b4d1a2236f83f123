//! Sheets between non-manifold edges, and how they hang together.
//!
//! A sheet that uses an edge equally often both ways is there for itself. Others are closed only together. Where four are and two of them are
//! *twins*, with the same rim and on the same side of it, a body stands beside one that is inside out, and each has the wall between them for
//! itself: one twin belongs to one body, and one to the other. Of bodies that face the same way the two walls face each other.

use super::edges::{Edge, Edges, Use};

/// Sheets, and which of them are twins.
pub(crate) struct Sheets<'t> {
    of_triangle: &'t [u32],
    /// By sheet: it does not use some edge equally often both ways.
    open: Vec<bool>,
    /// By sheet: the first one that has the same rim, directions included.
    twins: Vec<u32>,
}

impl<'t> Sheets<'t> {
    /// Of components between non-manifold edges: by triangle, which it belongs to, and by component, whether it is open. O(non-manifold
    /// edges × log).
    pub(crate) fn of(of_triangle: &'t [u32], open: Vec<bool>, edges: &Edges) -> Self {
        let mut rims: Vec<(u32, u32, bool)> = Vec::new();
        for (edge, number) in edges.iter().zip(0..).filter(|(edge, _)| edge.uses.len() != 2) {
            rims.extend(edge.uses.iter().map(|u| (of_triangle[u.triangle() as usize], number, u.forward())));
        }
        rims.sort_unstable();
        let mut of_sheets: Vec<&[(u32, u32, bool)]> = rims.chunk_by(|a, b| a.0 == b.0).collect();
        let rim = |uses: &[(u32, u32, bool)]| uses.iter().map(|(_, edge, forward)| (*edge, *forward)).collect::<Vec<_>>();
        // Sheets of one rim stay in their order.
        of_sheets.sort_by_cached_key(|uses| (rim(uses), uses[0].0));
        let mut twins: Vec<u32> = (0..open.len() as u32).collect();
        for same in of_sheets.chunk_by(|a, b| a.iter().map(|u| (u.1, u.2)).eq(b.iter().map(|u| (u.1, u.2)))) {
            same.iter().for_each(|uses| twins[uses[0].0 as usize] = same[0][0].0);
        }
        Self { of_triangle, open, twins }
    }

    /// Visits the triangles at an edge that hang together through it, by twos.
    pub(crate) fn join_open(&self, edge: &Edge<'_>, mut join: impl FnMut(u32, u32)) {
        let sheet = |u: &Use| self.of_triangle[u.triangle() as usize];
        let balance =
            |of: u32| edge.uses.iter().filter(|u| sheet(u) == of).map(|u| if u.forward() { 1 } else { -1 }).sum::<i32>();
        let needs_others = |u: &&Use| self.open[sheet(u) as usize] && balance(sheet(u)) != 0;
        let uses: Vec<Use> = edge.uses.iter().filter(needs_others).copied().collect();
        if let Some(pairs) = self.by_twins(&uses) {
            pairs.into_iter().for_each(|[a, b]| join(a, b));
        } else if let Some((first, others)) = uses.split_first() {
            others.iter().for_each(|u| join(first.triangle(), u.triangle()));
        }
    }

    /// How four triangles hang together, by twos, if two of them are of twins: the first twin with the first one of the others, wherever that
    /// leads.
    fn by_twins(&self, uses: &[Use]) -> Option<[[u32; 2]; 2]> {
        let [_, _, _, _] = uses else { return None };
        let sheet = |t: u32| self.of_triangle[t as usize];
        let side = |forward: bool| -> Option<[u32; 2]> {
            let mut side = uses.iter().filter(|u| u.forward() == forward).map(|u| u.triangle());
            let mut pair = [side.next()?, side.next()?];
            pair.sort_by_key(|t| sheet(*t));
            Some(pair)
        };
        let ([a, b], [c, d]) = (side(true)?, side(false)?);
        let are_twins = |s: u32, t: u32| sheet(s) != sheet(t) && self.twins[sheet(s) as usize] == self.twins[sheet(t) as usize];
        (are_twins(a, b) || are_twins(c, d)).then_some([[a, c], [b, d]])
    }
}
