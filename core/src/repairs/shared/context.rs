//! A file under repair: what every repair works on, what is known of it, and what one repair hands to a later one.

use std::path::Path;
use std::rc::Rc;

use crate::contract::error::Result;
use crate::contract::progress::Progress;
use crate::contract::report::RepairName;
use crate::contract::report::{Defects, LoopLeft};
use crate::contract::settings::{Limits, Profile};
use crate::detect::skin::DroppedBy;
use crate::diagnosis::Diagnosis;
use crate::geometry::position::Position;
use crate::repairs::shared::account::Account;
use crate::repairs::shared::overlay::{Overlay, Which};
use crate::repairs::shared::pieces;
use crate::repairs::shared::probes::Probes;
use crate::repairs::shared::region_report::Unsettled;
use crate::repairs::shared::work::Work;
use crate::submesh::components::{Components, Reversed};
use crate::submesh::near::Tolerance;
use crate::topology::survey::Survey;

/// A repair of one kind.
#[derive(Clone, Copy)]
pub(crate) struct Repair {
    /// Its name in the report.
    pub(crate) name: RepairName,
    /// The most that it changes.
    pub(crate) changes: Changes,
    /// Does it, as far as the profile allows and the file needs it.
    pub(crate) run: for<'c, 'r> fn(&mut Context<'c, 'r>) -> Result<Done>,
}

/// The parts of a mesh that a repair may change. That decides what is still known after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Changes {
    /// Vertices are merged, or triangles come, go, or are divided.
    Surface,
    /// Triangles are turned over, and stay where they are.
    Directions,
    /// Whole pieces of surface go; what stays is as it was.
    Pieces,
    /// Whole pieces of surface are turned, so that all enclose what they should.
    Outward,
}

/// How much a repair did, and the words for it.
pub(crate) struct Done {
    /// How much, in the unit that the note names.
    pub(crate) count: u64,
    /// The line of the report on it, if it did anything.
    pub(crate) note: String,
    /// Is the mesh another one now?
    pub(crate) changed: bool,
}

impl Done {
    /// So many of what the note names; the mesh has changed if there are any.
    pub(crate) fn count(count: u64, note: impl Into<String>) -> Self {
        Self { count, note: note.into(), changed: count > 0 }
    }
}

/// Pairs of triangles that cross or overlap.
pub(crate) type CrossingPairs = Rc<[[Which; 2]]>;

/// What repairs know of the mesh. It is found out when it is asked for, and forgotten when the mesh changes.
#[derive(Default)]
struct Known {
    /// The pieces that stand for themselves, and the version of the mesh that they are of.
    pieces: Option<(u64, Rc<Components>)>,
    /// All pairs that cross, if that could be told, and the version that they are of.
    crossing: Option<(u64, Option<CrossingPairs>)>,
    /// All pieces enclose what they should.
    is_outward: bool,
}

/// Findings that one repair hands to a later one.
#[derive(Default)]
pub(crate) struct Handed {
    /// Only the loop through this place is to be closed. Of the caller, for the filling.
    pub(crate) only_loop: Option<[f32; 3]>,
    /// By triangle of the submesh: it is settled which way it faces. Of facing, for the orientation.
    pub(crate) settled: Vec<bool>,
    /// Rims of open shapes were let down into what they stand on, or sheets made solid, so there may be something to be cut.
    pub(crate) has_skirts: bool,
    /// Rims of lone sheets, which no patch closes. Of the filling, for the dropping of sheets.
    pub(crate) sheets: Vec<SheetRim>,
    /// Points on dropped sheets, sheet by sheet, and where these begin in the account. Of the dropping, for whether they lie in material.
    pub(crate) on_sheets: (usize, Vec<Vec<[f64; 3]>>),
    /// A vertex of each loop that was left open on purpose. Of the filling, for the wrap.
    pub(crate) kept_open: Vec<[f32; 3]>,
    /// Those of them that are of rims of lone sheets. Of the filling, for the wrap.
    pub(crate) kept_sheets: Vec<[f32; 3]>,
    /// Patches that cross what is there, and are to be cut. Of the filling, for the resolution.
    pub(crate) across: Vec<PatchAcross>,
    /// The triangles of patches that nothing speaks against. Of the filling, for the skin.
    pub(crate) explained: Vec<u32>,
    /// The triangles of cavities that plainly poke out of what they are in. Of the orientation, for the skin.
    pub(crate) cavities: Vec<[[f32; 3]; 3]>,
    /// Points in the bodies, before any is cut or removed.
    pub(crate) probes: Option<Probes>,
    /// Bodies that cutting left and no printer can see, which are gone.
    pub(crate) dust: u64,
    /// Crossings that were left, as the report says it.
    pub(crate) intersections_left: Vec<String>,
    /// After the resolution there may be crossings: it was not done, or left some, or edges were taken apart.
    pub(crate) may_cross: bool,
    /// Regions that were left as they were, unless a wrap replaces them.
    pub(crate) unsettled: Vec<Unsettled>,
    /// The triangles of wraps, which are not in the submesh.
    pub(crate) wrapped: Vec<[[f32; 3]; 3]>,
    /// By region of regular surface, the repair that dropped it.
    pub(crate) dropped_by: DroppedBy,
    /// Where vertices were that wraps replaced, ascending.
    pub(crate) replaced: Vec<Position>,
}

impl Handed {
    /// Did a wrap replace this vertex?
    pub(crate) fn is_replaced(&self, at: [f32; 3]) -> bool {
        self.replaced.binary_search(&Position::of(at)).is_ok()
    }
}

/// The rim of a lone sheet, which stays open.
#[derive(Debug)]
pub(crate) struct SheetRim {
    /// A triangle along it.
    pub(crate) triangle: u32,
    pub(crate) edges: usize,
    /// Its place among the loops that are left, unless it comes after the last one listed.
    pub(crate) listed: Option<usize>,
}

/// The triangles of a patch that crosses other surface, and what to say of its loop if the patch is not cut along that.
pub(crate) type PatchAcross = (std::ops::Range<u32>, LoopLeft);

/// A file under repair.
pub(crate) struct Context<'c, 'r> {
    pub(crate) survey: &'c mut Survey<'r>,
    pub(crate) work: Work<'c>,
    /// How regions of regular surface, which are not in the submesh, are turned, and which of them go.
    pub(crate) reversed: Reversed,
    pub(crate) tolerance: &'c Tolerance,
    /// The defects of the file as it came.
    pub(crate) before: &'c Defects,
    pub(crate) profile: &'c Profile,
    pub(crate) limits: &'c Limits,
    pub(crate) path: &'c Path,
    pub(crate) progress: &'c dyn Progress,
    pub(crate) handed: Handed,
    pub(crate) account: Account,
    known: Known,
}

impl<'c, 'r> Context<'c, 'r> {
    /// Of a file whose submesh is as it was gathered.
    pub(crate) fn of(
        diagnosis: &'c mut Diagnosis<'r>,
        path: &'c Path,
        profile: &'c Profile,
        limits: &'c Limits,
        progress: &'c dyn Progress,
    ) -> Self {
        let reversed = Reversed::none(&diagnosis.survey);
        let Diagnosis { survey, submesh, tolerance, defects } = diagnosis;
        Self {
            survey,
            work: Work::new(submesh),
            reversed,
            tolerance,
            before: defects,
            profile,
            limits,
            path,
            progress,
            handed: Handed::default(),
            account: Account::default(),
            known: Known::default(),
        }
    }

    /// The pieces of surface that stand for themselves, as [`pieces::pieces`] finds them. O(regions + submesh) after a change, O(1) else.
    pub(crate) fn pieces(&mut self) -> Rc<Components> {
        let version = self.work.version();
        match &self.known.pieces {
            Some((of, pieces)) if *of == version => pieces.clone(),
            _ => {
                let pieces = Rc::new(pieces::pieces(self.survey, &mut self.work, &self.reversed));
                self.known.pieces = Some((version, pieces.clone()));
                pieces
            }
        }
    }

    /// All pairs of triangles that cross or overlap; `None` if that is too much work to tell. A look at what changed after a change, O(1) else.
    pub(crate) fn crossing(&mut self) -> Option<CrossingPairs> {
        let version = self.work.version();
        if let Some((of, known)) = &self.known.crossing
            && *of == version
        {
            return known.clone();
        }
        let overlay = Overlay::of(self.survey, &self.work, &self.reversed);
        let pairs = overlay.and_then(|overlay| overlay.crossing_triangles(self.survey, &self.work)).map(Rc::from);
        self.known.crossing = Some((version, pairs.clone()));
        pairs
    }

    /// All pieces are known to enclose what they should.
    pub(crate) fn is_outward(&self) -> bool {
        self.known.is_outward
    }

    /// Forgets what does not hold after a repair, and notes what it dropped.
    pub(crate) fn changed(&mut self, name: RepairName, changes: Changes) {
        let by = &mut self.handed.dropped_by;
        by.resize(self.reversed.dropped.len(), None);
        let dropped = by.iter_mut().zip(&self.reversed.dropped).filter(|(by, dropped)| **dropped && by.is_none());
        dropped.for_each(|(by, _)| *by = Some(name));
        (self.known.pieces, self.known.crossing) = (None, None);
        self.known.is_outward = match changes {
            Changes::Surface | Changes::Directions => false,
            Changes::Pieces => self.known.is_outward,
            Changes::Outward => true,
        };
    }

    /// All pieces enclose what they should.
    pub(crate) fn found_outward(&mut self) {
        self.known.is_outward = true;
    }
}
