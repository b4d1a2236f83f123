//! Loops that no patch closes without crossing anything: slits, patches that are to be cut, and edges that lack a side.

use super::closing::{Closed, Closing, Neighbours, NotFilled, SLIT, left};
use crate::algorithms::triangulate::{self, Rim, Unfillable};
use crate::contract::report::RepairName;
use crate::contract::report::{LoopLeft, MOST_LISTED};
use crate::detect::holes::unbalanced::unbalanced;
use crate::geometry::exact::{self, Point};
use crate::repairs::cleanup::degenerate;
use crate::repairs::shared::admission::NotAdmitted;
use crate::repairs::shared::context::{PatchAcross, SheetRim};
use crate::repairs::shared::work::Work;
use crate::submesh::{Origin, Submesh, Vertex};
use crate::util::ids::NONE;

/// Triangles around the first vertex of a loop.
pub(crate) fn fan(vertices: usize) -> Vec<[u32; 3]> {
    (2..vertices as u32).map(|n| [0, n - 1, n]).collect()
}

pub(crate) fn is_on_one_line(submesh: &Submesh, way: &[Vertex]) -> bool {
    let [a, b] = [way[0], way[1]].map(|v| submesh.positions[v as usize]);
    way[2..].iter().all(|v| exact::collinear(&a, &b, &submesh.positions[*v as usize]))
}

/// And why a loop does along which edges are not used equally often in both directions.
pub(crate) const UNBALANCED: &str = "along its edges, the triangles around disagree on their directions, or three surfaces meet";

impl Closing<'_> {
    /// Closes loops on one line by triangles of no area: they go, and the triangles along them are split at the vertices that they lack. Returns
    /// how many of these were no loops, but edges that lack a side, if they are to be balanced.
    pub(crate) fn close_slits(&mut self, work: &mut Work<'_>, balances: bool) -> u64 {
        let is_slit = |reason: &NotFilled| matches!(reason, NotFilled::Method(Unfillable::Collinear));
        let (slits, open): (Vec<_>, Vec<_>) = std::mem::take(&mut self.open).into_iter().partition(|(_, reason)| is_slit(reason));
        self.open = open;
        for (rim, _) in slits {
            let triangles = fan(self.rim(rim).vertices.len());
            self.put_in(work, rim, &triangulate::Patch { triangles, method: triangulate::Method::Triangle }, SLIT);
        }
        let mut balanced = 0;
        if balances {
            for way in self.unbalanced(work) {
                if is_on_one_line(work, &way) {
                    balanced += 1;
                    fan(way.len()).into_iter().for_each(|t| {
                        work.add(t.map(|i| way[i as usize]), Origin::Added(RepairName::Fill), NONE);
                    });
                }
            }
        }
        degenerate::remove(work);
        balanced
    }

    /// Loops of edges that lack a side, but for those that were left open.
    pub(crate) fn unbalanced(&self, work: &mut Work<'_>) -> Vec<Vec<Vertex>> {
        let open = self.open.iter().map(|(rim, _)| self.rim(*rim));
        let (submesh, edges) = work.edges();
        let mut ways = unbalanced(submesh, edges, open);
        // What passes through a vertex of such a sheet runs along it.
        ways.retain(|way| !submesh.star(way[0]).any(|(t, _)| self.admission.is_one_sided(t)));
        ways
    }

    /// Chains of boundary edges of lone sheets that have one side only: what is left of their rims where these are no loops. Takes them out of
    /// the others.
    pub(crate) fn keep_open(&self, submesh: &Submesh, chains: &mut Vec<Vec<Vertex>>, closed: &mut Closed) {
        chains.retain(|chain| {
            let Some(triangle) = submesh.at_edge(chain[0], chain[1]).min().filter(|t| self.admission.is_one_sided(*t)) else {
                return true;
            };
            let edges = chain.len() - 1;
            let listed = (closed.left.len() < MOST_LISTED).then_some(closed.left.len());
            closed.sheets.push(SheetRim { triangle, edges, listed });
            closed.kept_open.push(submesh.positions[chain[0] as usize]);
            closed.kept_sheets.push(submesh.positions[chain[0] as usize]);
            if listed.is_some() {
                let length = chain.windows(2).map(|w| submesh.distance(w[0], w[1])).sum();
                closed.left.push(left(submesh, chain[0], edges, length, &NotAdmitted::Sheet));
            }
            false
        });
    }

    /// Closes what is left as if nothing were in the way, each by a patch that may cross anything, itself included. Returns the triangles
    /// of each.
    pub(crate) fn close_across(&mut self, work: &mut Work<'_>) -> Vec<PatchAcross> {
        let mut across = Vec::new();
        for (rim, reason) in std::mem::take(&mut self.open) {
            // The rim of a lone sheet may have been joined to something since.
            let patch = match reason {
                NotFilled::NotAdmitted(_) if self.admission.check(work, self.rim(rim)).is_err() => None,
                _ => self.patch_across(work, rim),
            };
            let Some(patch) = patch else {
                self.open.push((rim, reason));
                continue;
            };
            let loop_ = self.rim(rim);
            let left = left(work, loop_.vertices[0], loop_.vertices.len(), loop_.perimeter(work), &reason);
            self.put_in(work, rim, &patch, patch.method.name());
            if let Some(placed) = self.placed.last_mut() {
                placed.to_be_cut = true;
                across.push((placed.first..placed.first + placed.count, left));
                self.doubt_across(work, rim);
            }
        }
        across
    }

    /// Closes whatever still lacks triangles on one side, as along an edge that three surfaces share: one that the patch then lies on, or that it
    /// parts from the others, goes when all is cut along what it crosses. Loops that were left open stay open. Returns those that nothing closes.
    pub(crate) fn balance(&self, work: &mut Work<'_>, across: &mut Vec<PatchAcross>) -> Vec<LoopLeft> {
        let mut unclosed = Vec::new();
        for way in self.unbalanced(work) {
            let points: Vec<Point> = way.iter().map(|v| work.positions[*v as usize]).collect();
            let n = way.len();
            let perimeter = (0..n).map(|i| work.distance(way[i], way[(i + 1) % n])).sum();
            let left = left(work, way[0], n, perimeter, &UNBALANCED);
            let rim = Rim { points: &points, apexes: &[], obstacles: &[], forbidden: &|_, _| false };
            let Some(patch) = triangulate::unchecked(&rim) else {
                unclosed.push(left);
                continue;
            };
            let first = work.triangles.len() as u32;
            for triangle in &patch.triangles {
                work.add(triangle.map(|i| way[i as usize]), Origin::Added(RepairName::Fill), NONE);
            }
            across.push((first..work.triangles.len() as u32, left));
        }
        unclosed
    }

    /// A patch that does not cross itself, if there is one, else any.
    pub(crate) fn patch_across(&self, submesh: &Submesh, rim: u32) -> Option<triangulate::Patch> {
        let valid =
            self.fill(submesh, rim, Neighbours::Heeded, &[]).or_else(|_| self.fill(submesh, rim, Neighbours::Ignored, &[]));
        if let Ok(patch) = valid {
            return Some(patch);
        }
        let loop_ = self.rim(rim);
        let points = loop_.points(submesh);
        let joined = |i: u32, j: u32| submesh.has_edge(loop_.vertices[i as usize], loop_.vertices[j as usize]);
        let any = |forbidden: &dyn Fn(u32, u32) -> bool| {
            triangulate::unchecked(&Rim { points: &points, apexes: &[], obstacles: &[], forbidden })
        };
        any(&joined).or_else(|| any(&|_, _| false))
    }
}
