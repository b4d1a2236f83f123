//! A file under repair: what every repair works on, what is known of it, and what one repair hands to a later one.

use std::path::Path;
use std::rc::Rc;

use super::account::{Account, RepairName};
use super::pieces;
use super::probes::Probes;
use super::regions::Unsettled;
use super::work::Work;
use crate::contract::error::Result;
use crate::contract::progress::Progress;
use crate::contract::report::{Defects, LoopLeft};
use crate::contract::settings::{Limits, Profile};
use crate::diagnosis::Diagnosis;
use crate::geometry::position::Position;
use crate::submesh::components::{Components, Reversed};
use crate::submesh::near::Tolerance;
use crate::topology::survey::Survey;

/// A repair of one kind.
#[derive(Clone, Copy)]
pub(super) struct Repair {
    /// Its name in the report.
    pub(super) name: RepairName,
    /// The most that it changes.
    pub(super) changes: Changes,
    /// Does it, as far as the profile allows and the file needs it.
    pub(super) run: for<'c, 'r> fn(&mut Context<'c, 'r>) -> Result<Done>,
}

/// What a repair may change. It decides what is still known after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Changes {
    /// Vertices are merged, or triangles come, go, or are divided.
    Surface,
    /// Triangles are turned over, and stay where they are.
    Directions,
    /// Whole pieces of surface go; what stays is as it was.
    Pieces,
    /// Whole pieces of surface are turned, so that all enclose what they should.
    Outward,
}

/// What a repair did.
pub(super) struct Done {
    /// How much, in the unit that the note names.
    pub(super) count: u64,
    /// The line of the report on it, if it did anything.
    pub(super) note: String,
    /// Is the mesh another one now?
    pub(super) changed: bool,
}

impl Done {
    /// So many of what the note names; the mesh has changed if there are any.
    pub(super) fn count(count: u64, note: impl Into<String>) -> Self {
        Self { count, note: note.into(), changed: count > 0 }
    }
}

/// What repairs know of the mesh. It is found out when it is asked for, and forgotten when the mesh changes.
#[derive(Default)]
struct Known {
    /// What stands for itself, and the version of the mesh that it is of.
    pieces: Option<(u64, Rc<Components>)>,
    /// All pieces enclose what they should.
    is_outward: bool,
}

/// What one repair hands to a later one.
#[derive(Default)]
pub(super) struct Handed {
    /// By triangle of the workshop: it is settled which way it faces. Of facing, for the orientation.
    pub(super) settled: Vec<bool>,
    /// Rims of open shapes were let down into what they stand on, so there is something to be cut.
    pub(super) has_skirts: bool,
    /// Rims of lone sheets, which no patch closes. Of the filling, for the dropping of sheets.
    pub(super) sheets: Vec<SheetRim>,
    /// A vertex of each loop that was left open on purpose. Of the filling, for the wrap.
    pub(super) kept_open: Vec<[f32; 3]>,
    /// Patches that cross what is there, and are to be cut. Of the filling, for the resolution.
    pub(super) across: Vec<PatchAcross>,
    /// Points in the bodies, before any is cut or removed.
    pub(super) probes: Option<Probes>,
    /// Bodies that cutting left and no printer can see, which are gone.
    pub(super) dust: u64,
    /// Crossings that were left, as the report says it.
    pub(super) crossings_left: Vec<String>,
    /// After the resolution there may be crossings: it was not done, or left some, or edges were taken apart.
    pub(super) may_cross: bool,
    /// Regions that were left as they were, unless a wrap replaces them.
    pub(super) unsettled: Vec<Unsettled>,
    /// The triangles of wraps, which are not in the workshop.
    pub(super) wrapped: Vec<[[f32; 3]; 3]>,
    /// Where vertices were that wraps replaced, ascending.
    pub(super) replaced: Vec<Position>,
}

impl Handed {
    /// Did a wrap replace this vertex?
    pub(super) fn is_replaced(&self, at: [f32; 3]) -> bool {
        self.replaced.binary_search(&Position::of(at)).is_ok()
    }
}

/// The rim of a lone sheet, which stays open.
#[derive(Debug)]
pub(super) struct SheetRim {
    /// A triangle along it.
    pub(super) triangle: u32,
    pub(super) edges: usize,
    /// Its place among the loops that are left, unless it comes after the last one listed.
    pub(super) listed: Option<usize>,
}

/// The triangles of a patch that crosses other surface, and what to say of its loop if the patch is not cut along that.
pub(super) type PatchAcross = (std::ops::Range<u32>, LoopLeft);

/// A file under repair.
pub(super) struct Context<'c, 'r> {
    pub(super) survey: &'c mut Survey<'r>,
    pub(super) work: Work<'c>,
    /// How patches of sound surface, which are not in the workshop, are turned, and which of them go.
    pub(super) reversed: Reversed,
    pub(super) tolerance: &'c Tolerance,
    /// The defects of the file as it came.
    pub(super) before: &'c Defects,
    pub(super) profile: &'c Profile,
    pub(super) limits: &'c Limits,
    pub(super) path: &'c Path,
    pub(super) progress: &'c dyn Progress,
    pub(super) handed: Handed,
    pub(super) account: Account,
    known: Known,
}

impl<'c, 'r> Context<'c, 'r> {
    /// Of a file whose workshop is as it was gathered.
    pub(super) fn of(
        diagnosis: &'c mut Diagnosis<'r>,
        path: &'c Path,
        profile: &'c Profile,
        limits: &'c Limits,
        progress: &'c dyn Progress,
    ) -> Self {
        let reversed = Reversed::none(&diagnosis.survey);
        let Diagnosis { survey, shop, tolerance, defects } = diagnosis;
        Self {
            survey,
            work: Work::new(shop),
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

    /// The pieces of surface that stand for themselves, as [`pieces::pieces`] finds them. O(patches + workshop) after a change, O(1) else.
    pub(super) fn pieces(&mut self) -> Rc<Components> {
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

    /// All pieces are known to enclose what they should.
    pub(super) fn is_outward(&self) -> bool {
        self.known.is_outward
    }

    /// Forgets what does not hold after a repair.
    pub(super) fn changed(&mut self, changes: Changes) {
        self.known.pieces = None;
        self.known.is_outward = match changes {
            Changes::Surface | Changes::Directions => false,
            Changes::Pieces => self.known.is_outward,
            Changes::Outward => true,
        };
    }

    /// All pieces enclose what they should.
    pub(super) fn found_outward(&mut self) {
        self.known.is_outward = true;
    }
}
