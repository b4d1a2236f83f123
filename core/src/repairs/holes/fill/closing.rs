//! The loops of a submesh while they are closed: patches that are in, and loops that are open, with the reason.

use super::known::{self, Around, Known};
use crate::algorithms::extend::{self, Extended};
use crate::algorithms::triangulate::{self, FillSettings, Rim, Unfillable, strip};
use crate::contract::report::{LoopLeft, MOST_LISTED};
use crate::contract::settings::{PatchShape, Profile};
use crate::detect::holes::{self, loops::Loop};
use crate::geometry::position::Position;
use crate::geometry::sums::Bounds;
use crate::geometry::tri_tri;
use crate::repairs::holes::patches::{EXTENDED, Placed, Planes, of_submesh};
use crate::repairs::shared::admission::{Admission, NotAdmitted};
use crate::repairs::shared::context::{PatchAcross, SheetRim};
use crate::repairs::shared::work::Work;
use crate::submesh::{Origin, Submesh, Vertex};
use std::collections::{BTreeMap, BTreeSet};

/// What was closed, by method, and what was not.
#[derive(Debug, Default)]
pub(crate) struct Closed {
    pub(crate) loops: u64,
    pub(crate) by_method: BTreeMap<String, u64>,
    pub(crate) left: Vec<LoopLeft>,
    /// Of what was not closed, the rims of lone sheets.
    pub(crate) sheets: Vec<SheetRim>,
    /// A vertex of each loop that was left open on purpose: it was not admitted.
    pub(crate) kept_open: Vec<[f32; 3]>,
    /// What is to be said of the guesses.
    pub(crate) judged: Judged,
    /// Those of these that are rims of lone sheets.
    pub(crate) kept_sheets: Vec<[f32; 3]>,
    /// Loops that nothing closes which crosses nothing: the triangles of patches that are to be cut along what they cross, and what to say of the
    /// loops if that does not come about.
    pub(crate) across: Vec<PatchAcross>,
    /// What was guessed, and a person should look at.
    pub(crate) doubts: Vec<String>,
    /// What caps over the loops would enclose beside what is meant.
    pub(crate) not_meant: f64,
}

/// What is to be said of patches.
#[derive(Debug, Default)]
pub(crate) struct Judged {
    /// Guesses that may be wrong, each a line for people.
    pub(crate) doubts: Vec<String>,
    /// Area of the patches that nothing speaks against.
    pub(crate) area: f64,
    /// The area of the largest of them, and the box around it; of several as large, the first.
    pub(crate) largest: Option<(f64, Bounds)>,
    /// Their triangles.
    pub(crate) explained: Vec<u32>,
    /// Around those of them that reach beyond their loops.
    pub(crate) reached: Bounds,
    /// What these enclose more than cones over their loops.
    pub(crate) volume: f64,
}

/// The loops of a submesh while they are closed.
pub(crate) struct Closing<'p> {
    pub(crate) admission: Admission<'p>,
    pub(crate) max_edges: usize,
    /// Patches may have vertices of their own.
    pub(crate) may_add: bool,
    pub(crate) rims: Vec<Loop>,
    pub(crate) placed: Vec<Placed>,
    pub(crate) known: Known,
    /// Loops, by number, and why they are not closed.
    pub(crate) open: Vec<(u32, NotFilled)>,
    /// Triangles that join the rims of islands to those of their holes, ascending.
    pub(crate) joints: Vec<u32>,
    /// What was guessed, and a person should look at.
    pub(crate) doubts: Vec<String>,
    /// What caps over its loops would enclose that no surface is meant to: there is a way through. In the file's units, cubed.
    pub(crate) not_meant: f64,
}

/// Why a loop stays open.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NotFilled {
    #[error(transparent)]
    NotAdmitted(#[from] NotAdmitted),
    #[error("every patch tried crosses the surface around")]
    Crosses,
    #[error(transparent)]
    Method(#[from] Unfillable),
}

/// Whether a patch must not lie on the triangles around its loop.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Neighbours {
    Heeded,
    Ignored,
}

pub(crate) fn left(submesh: &Submesh, from: Vertex, edges: usize, perimeter: f64, reason: &dyn std::fmt::Display) -> LoopLeft {
    LoopLeft { at: submesh.positions[from as usize], edges: edges as u64, perimeter, reason: reason.to_string() }
}

/// Name of the method that closes a loop on one line.
pub(crate) const SLIT: &str = "slit";

/// Name of the method that closes a small loop on the triangles around it.
pub(crate) const FLAT: &str = "flat on its neighbours";

/// A chord of the patch is an edge of the mesh by now.
pub(crate) fn meets_new_edge(submesh: &Submesh, rim: &Loop, triangles: &[[u32; 3]]) -> bool {
    let n = rim.vertices.len() as u32;
    triangles.iter().any(|t| {
        (0..3).any(|k| {
            let (i, j) = (t[k], t[(k + 1) % 3]);
            i < n && j < n && j != (i + 1) % n && submesh.has_edge(rim.vertices[i as usize], rim.vertices[j as usize])
        })
    })
}

/// What closes loops of fewer vertices is not kept.
const KEPT: usize = 8;

/// Vertices of a small one, at most.
pub(crate) const SMALL: usize = 64;

impl<'p> Closing<'p> {
    pub(crate) fn of(admission: Admission<'p>, profile: &Profile) -> Self {
        let max_edges = profile.max_hole_edges as usize;
        let may_add = profile.patch_shape != PatchShape::Flat;
        Self {
            admission,
            max_edges,
            may_add,
            rims: Vec::new(),
            placed: Vec::new(),
            known: Known::default(),
            open: Vec::new(),
            joints: Vec::new(),
            doubts: Vec::new(),
            not_meant: 0.0,
        }
    }
}

impl Closing<'_> {
    pub(crate) fn rim(&self, rim: u32) -> &Loop {
        &self.rims[rim as usize]
    }

    pub(crate) fn put_in(&mut self, work: &mut Work<'_>, rim: u32, patch: &triangulate::Patch, method: &'static str) {
        let triangles = of_submesh(self.rim(rim), patch);
        self.admission.joined(&[&self.rims[rim as usize]]);
        self.placed.push(Placed::put_in(work, vec![rim], &triangles, method));
    }

    /// A triangulation of a loop that crosses none of the `obstacles`.
    pub(crate) fn fill(
        &self,
        submesh: &Submesh,
        number: u32,
        neighbours: Neighbours,
        obstacles: &[tri_tri::Triangle],
    ) -> Result<triangulate::Patch, NotFilled> {
        self.admission.check(submesh, self.rim(number))?;
        let around = self.around(submesh, number, neighbours);
        let close = |around: &Around| self.close(around, obstacles);
        if obstacles.is_empty() && around.points.len() >= KEPT {
            return Ok(self.known.closed(number, around, close)?);
        }
        Ok(close(&around)?)
    }

    fn around(&self, submesh: &Submesh, rim: u32, neighbours: Neighbours) -> Around {
        let rim = self.rim(rim);
        let heeded = neighbours == Neighbours::Heeded;
        Around {
            points: rim.points(submesh),
            apexes: if heeded { rim.apexes(submesh) } else { Vec::new() },
            folds: if heeded { holes::folds(submesh, rim) } else { None },
            joined: known::joined(submesh, &rim.vertices),
            max_vertices: self.max_edges,
        }
    }

    fn close(&self, around: &Around, obstacles: &[tri_tri::Triangle]) -> Result<triangulate::Patch, Unfillable> {
        let forbidden = |i: u32, j: u32| around.joined.binary_search(&(i, j)).is_ok();
        let settings = FillSettings { max_vertices: around.max_vertices, ..FillSettings::default() };
        let of_patch = Rim { points: &around.points, apexes: &around.apexes, obstacles, forbidden: &forbidden };
        if let Some(patch) = around.folds.and_then(|folds| strip::zip(&of_patch, folds).ok())
            && !patch.triangles.iter().any(|t| of_patch.meets_obstacle(&of_patch.corners(*t)))
        {
            return Ok(patch);
        }
        triangulate::triangulate(&of_patch, &settings)
    }

    /// A patch of planes that meet where the loop's surface is missing, if the loop tells them.
    pub(crate) fn extend(&self, submesh: &Submesh, rim: u32) -> Option<Extended> {
        let rim = self.rim(rim);
        self.admission.check(submesh, rim).ok()?;
        let points = rim.points(submesh);
        let apexes = rim.apexes(submesh);
        let forbidden = |i: u32, j: u32| submesh.has_edge(rim.vertices[i as usize], rim.vertices[j as usize]);
        let of_patch = Rim { points: &points, apexes: &apexes, obstacles: &[], forbidden: &forbidden };
        extend::extend(&of_patch, self.may_add)
    }

    pub(crate) fn put_in_extended(&mut self, work: &mut Work<'_>, rim: u32, patch: &Extended) {
        let mut vertices = self.rim(rim).vertices.clone();
        vertices.extend(patch.added.iter().map(|p| work.add_vertex(Position::of(*p))));
        let triangles: Vec<[Vertex; 3]> = patch.triangles.iter().map(|t| t.map(|i| vertices[i as usize])).collect();
        let mut placed = Placed::put_in(work, vec![rim], &triangles, EXTENDED);
        let reaches = !patch.added.is_empty();
        self.admission.joined(&[&self.rims[rim as usize]]);
        placed.planes = Some(Planes { assumed: patch.assumed, volume: patch.volume, in_doubt: patch.in_doubt, reaches });
        self.placed.push(placed);
    }

    /// What came of it, after what is `closed` already.
    pub(crate) fn finish(mut self, work: &mut Work<'_>, mut closed: Closed) -> Closed {
        closed.doubts.append(&mut self.doubts);
        closed.not_meant += self.not_meant;
        for patch in self.placed.iter().filter(|p| p.count > 0) {
            let loops = patch.rims.len() as u64;
            closed.loops += loops;
            let shaped = match patch {
                _ if !patch.coarse.is_empty() => " (shaped like what is around)",
                _ if patch.across => " (across a body met already)",
                _ if patch.to_be_cut => " (to be cut along what it crosses)",
                _ => "",
            };
            *closed.by_method.entry(format!("{}{shaped}", patch.method)).or_default() += loops;
        }
        self.drop_idle_joints(work);
        self.open.sort_by_key(|(rim, _)| *rim);
        let kept = self.open.iter().filter(|(_, reason)| matches!(reason, NotFilled::NotAdmitted(_)));
        closed.kept_open.extend(kept.map(|(rim, _)| work.positions[self.rim(*rim).vertices[0] as usize]));
        let sheets = self.open.iter().filter(|(_, reason)| matches!(reason, NotFilled::NotAdmitted(NotAdmitted::Sheet)));
        closed.kept_sheets.extend(sheets.map(|(rim, _)| work.positions[self.rim(*rim).vertices[0] as usize]));
        for (i, (rim, reason)) in (closed.left.len()..).zip(&self.open) {
            let rim = self.rim(*rim);
            if matches!(reason, NotFilled::NotAdmitted(NotAdmitted::Sheet)) {
                let listed = (i < MOST_LISTED).then_some(i);
                // Of an island's rim and its hole's together, some are joints, which are gone.
                if let Some(triangle) = rim.triangles.iter().copied().find(|t| work.lives(*t)) {
                    closed.sheets.push(SheetRim { triangle, edges: rim.vertices.len(), listed });
                }
            }
            if i >= MOST_LISTED {
                continue;
            }
            closed.left.push(left(work, rim.vertices[0], rim.vertices.len(), rim.perimeter(work), reason));
        }
        closed
    }

    /// What joined an island to a rim that stays open leads nowhere, unless a patch was closed along it.
    pub(crate) fn drop_idle_joints(&self, work: &mut Work<'_>) {
        let of_open = self.open.iter().flat_map(|(rim, _)| &self.rim(*rim).triangles).copied();
        let mut idle: BTreeSet<u32> = of_open.filter(|t| self.joints.binary_search(t).is_ok()).collect();
        // The two triangles of a joint stay or go together.
        loop {
            let is_needed = |t: &u32| {
                let v = work.triangles[*t as usize].v;
                (0..3).any(|k| {
                    work.at_edge(v[k], v[(k + 1) % 3])
                        .any(|other| matches!(work.triangles[other as usize].origin, Origin::Added(_)) && !idle.contains(&other))
                })
            };
            let needed: Vec<u32> = idle.iter().copied().filter(is_needed).collect();
            if needed.is_empty() {
                break;
            }
            needed.iter().for_each(|t| {
                idle.remove(t);
            });
        }
        idle.into_iter().for_each(|t| work.kill(t));
    }
}
