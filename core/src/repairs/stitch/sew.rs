//! Rims sewn: boundary edges that run along each other as the two sides of a crack do become one edge, also where they lie farther apart than
//! the weld tolerance.
//!
//! How badly a file was sewn is not known, so the width grows tenfold at each step, up to the profile's widest. At each, the nearest edges are
//! matched first, each with one other; only the ends of matched edges move. So every step leaves fewer open edges, or is not taken; what was
//! closed by a narrower step is not touched by a wider one. Where the vertices of two rims differ, the edges are split first ([`splits`]), and
//! the splits that close nothing are taken back. What may be matched is said in [`rims`].

use std::rc::Rc;

use crate::contract::report::RepairName;
use crate::contract::settings::Profile;
use crate::repairs::shared::context::{Changes, Done, Repair};
use crate::repairs::shared::work::Work;
use crate::repairs::stitch::sew::rims::{Boundary, Rims, Width};
use crate::repairs::stitch::weld::{self, Welded};
use crate::repairs::stitch::zip;
use crate::submesh::near::{Tolerance, nearest_edge};
use crate::topology::survey::Survey;
use crate::util::words::{Count, Short};

mod clusters;
mod rims;
mod splits;

/// Rims that run along each other.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Sew,
    changes: Changes::Surface,
    run: |cx| {
        let sewn = sew(cx.survey, &mut cx.work, cx.tolerance, cx.profile);
        let note = format!(
            "vertices of rims that run along each other, joined beyond the weld tolerance, and edges split for that ({}); the farthest lay {} apart",
            Count(sewn.splits),
            Short(sewn.widest)
        );
        Ok(Done::count(sewn.vertices + sewn.splits, note))
    },
};

/// From one width to the next.
const STEP: f64 = 10.0;

/// How often what was of no use is taken out and the rest tried again.
const TRIES: usize = 8;

/// Counts of the seams that were sewn.
#[derive(Debug, Default)]
pub(crate) struct Sewn {
    /// Vertices that became another one.
    pub(crate) vertices: u64,
    /// Edges split for that at a vertex of the other rim.
    pub(crate) splits: u64,
    /// How far the ends of matched edges lay apart, at most.
    pub(crate) widest: f64,
}

/// Sews rims beyond the weld tolerance. O(n log n) in the boundary, and a few copies of the submesh if any is sewn.
pub(crate) fn sew(survey: &Survey<'_>, work: &mut Work<'_>, tolerance: &Tolerance, profile: &Profile) -> Sewn {
    let gap = if profile.max_gap_mm > 0.0 { profile.max_gap_mm } else { f64::INFINITY };
    let widest = (profile.sew_relative * survey.bounds.diagonal()).min(gap);
    let mut sewn = Sewn::default();
    // Below this width there is nothing to match and nothing to split; not known where the surface may have changed.
    let mut least = None;
    let mut sewing = Sewing { survey, work, profile, known: None };
    // A split leaves short edges, which bound what comes after it: so first whatever needs none, as wide as may be.
    for way in [Sewing::join, Sewing::split] {
        let mut width = tolerance.weld;
        // Whatever lies within the first step of each other is one thing to any printer.
        let mut is_crack = true;
        while width > 0.0 && width < widest && sewing.work.edges().1.iter().any(|e| e.is_boundary()) {
            width = (STEP * width).min(widest);
            let at = |weld| Tolerance { weld, edge_share: tolerance.edge_share };
            let (submesh, edges) = sewing.work.edges();
            if *least.get_or_insert_with(|| nearest_edge(submesh, edges, &at(widest), survey.threads())) <= width {
                let before = [sewn.vertices, sewn.splits];
                way(&mut sewing, &Width { tolerance: at(width), is_crack }, &mut sewn);
                least = least.filter(|_| before == [sewn.vertices, sewn.splits]);
            }
            is_crack = false;
        }
    }
    sewn
}

/// The mesh while it is sewn.
struct Sewing<'s, 'r, 'w> {
    survey: &'s Survey<'r>,
    work: &'s mut Work<'w>,
    profile: &'s Profile,
    /// The boundary, and the version of the mesh that it is of.
    known: Option<(u64, Rc<Boundary>)>,
}

impl Sewing<'_, '_, '_> {
    fn boundary(&mut self) -> Rc<Boundary> {
        match &self.known {
            Some((version, boundary)) if *version == self.work.version() => boundary.clone(),
            _ => self.known.insert((self.work.version(), Rc::new(Boundary::of(self.survey, self.work)))).1.clone(),
        }
    }

    /// Splits edges where the vertices of rims differ, and matches and joins then; as [`Self::join`].
    fn split(&mut self, width: &Width, sewn: &mut Sewn) -> Option<Vec<u32>> {
        let mut wanted = {
            let boundary = self.boundary();
            let (submesh, edges) = self.work.edges();
            splits::wanted(submesh, edges, &Rims::of(&boundary, submesh, width, &[]), self.survey.threads())
        };
        let before = self.work.snapshot();
        for _ in 0..TRIES {
            if wanted.is_empty() {
                break;
            }
            let made = splits::make(self.work, &wanted);
            let mut more = Sewn { widest: sewn.widest, ..Sewn::default() };
            let target = self.join(width, &mut more);
            let idle = splits::idle(self.work, &made, target.as_deref());
            if idle.is_empty() {
                sewn.vertices += more.vertices;
                sewn.splits += made.len() as u64;
                sewn.widest = more.widest.max(wanted.iter().map(|on| on.distance).fold(0.0, f64::max));
                return target;
            }
            self.work.restore(&before);
            wanted.retain(|on| idle.binary_search(&(on.edge, on.vertex)).is_err());
        }
        None
    }

    /// Matches edges and joins their ends. Returns where each vertex went, if any did.
    fn join(&mut self, width: &Width, sewn: &mut Sewn) -> Option<Vec<u32>> {
        let boundary = self.boundary();
        let (submesh, edges) = self.work.edges();
        let left_open = zip::left_open(submesh, edges, &width.tolerance, self.profile);
        let rims = Rims::of(&boundary, submesh, width, &left_open);
        let mut matches = rims.matches(submesh, self.survey.threads());
        if matches.is_empty() {
            return None;
        }
        let mut chosen = clusters::of(submesh, &rims, &matches);
        for _ in 0..TRIES {
            if !rims.drop_poor(submesh, &chosen.is_used, &mut matches) {
                break;
            }
            chosen = clusters::of(submesh, &rims, &matches);
        }
        let clusters::Chosen { clusters, widest, .. } = chosen;
        if !clusters.is_empty() {
            // It will be another one.
            drop((rims, matches));
            drop(boundary);
            self.known = None;
        }
        let (Welded { vertices, taken_back }, target) =
            weld::weld_clusters(self.survey, self.work, clusters, weld::Moves::Steady);
        if taken_back > 0 {
            tracing::info!(clusters = taken_back, "Joins of rims taken back, since they spoiled triangles around.");
        }
        sewn.vertices += vertices;
        if vertices > 0 {
            sewn.widest = sewn.widest.max(widest);
        }
        target
    }
}

#[cfg(test)]
mod tests;
