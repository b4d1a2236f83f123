//! How the work on a file tells where it stands, and is told to end.

use std::sync::atomic::{AtomicBool, Ordering};

/// Where the work on one file stands; cheap to call, called from worker threads.
pub trait Progress: Sync {
    /// `stage` has `done` of `total` units (triangles unless the stage says otherwise) behind it.
    fn at(&self, stage: &'static str, done: u64, total: u64);
    /// `true` asks the work to end as soon as it can, without output: within a chunk of the survey, before the next repair,
    /// and within the long ones: in a round of cutting, or a block of a wrap's lattice. The error says so
    /// ([`Error::is_cancellation`](crate::Error::is_cancellation)).
    fn cancelled(&self) -> bool {
        false
    }
}

/// A progress that stays cancelled once it was: what was left undone since then is never taken for a result.
pub(crate) struct Latched<'a> {
    progress: &'a dyn Progress,
    ended: AtomicBool,
}

impl<'a> Latched<'a> {
    pub(crate) fn new(progress: &'a dyn Progress) -> Self {
        Self { progress, ended: AtomicBool::new(false) }
    }
}

impl Progress for Latched<'_> {
    fn at(&self, stage: &'static str, done: u64, total: u64) {
        self.progress.at(stage, done, total);
    }

    fn cancelled(&self) -> bool {
        if self.progress.cancelled() {
            self.ended.store(true, Ordering::Relaxed);
        }
        self.ended.load(Ordering::Relaxed)
    }
}

/// No one is watching.
pub struct Quiet;

impl Progress for Quiet {
    fn at(&self, _: &'static str, _: u64, _: u64) {}
}
