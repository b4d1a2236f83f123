//! How the work on a file tells where it stands, and is told to end.

/// Where the work on one file stands; cheap to call, called from worker threads.
pub trait Progress: Sync {
    /// `stage` has `done` of `total` units (triangles unless the stage says otherwise) behind it.
    fn at(&self, stage: &'static str, done: u64, total: u64);
    /// `true` asks the work to end as soon as it can, without output: within a chunk of the survey, or before the next repair. The error says so
    /// ([`Error::is_cancellation`](crate::Error::is_cancellation)).
    fn cancelled(&self) -> bool {
        false
    }
}

/// No one is watching.
pub struct Quiet;

impl Progress for Quiet {
    fn at(&self, _: &'static str, _: u64, _: u64) {}
}
