//! The worker of a slot: one process serves many small files, as long as it is well and nothing speaks for a new one.

use std::io;
use std::path::Path;

use suture_core::{ErrorClass, Limits};
use suture_store::Job;

use crate::fence::Fence;
use crate::folder::Folder;
use crate::schedule::Turn;
use crate::supervise::Ended;
use crate::world::{Hand, Share, World};

/// A worker process is replaced after so many files, so that nothing can pile up in it for months.
const FILES_PER_WORKER: u32 = 500;

/// A slot's worker, if it has one.
#[derive(Default)]
pub(super) struct Staff {
    worker: Option<Box<dyn Hand>>,
    /// Bytes that the worker may hold.
    memory: u64,
    served: u32,
    /// The worker reaches these folders.
    fence: Fence,
}

impl Staff {
    /// A worker for this job of this folder: the slot's own while it is in good shape, or a new one, as for a comparison. `is_away`: must nobody look
    /// below this folder of attempts now?
    ///
    /// # Errors
    /// When the machine has none to give.
    pub(super) fn worker(
        &mut self,
        world: &dyn World,
        limits: &Limits,
        turn: Turn,
        job: &Job,
        folder: &Folder,
        is_away: impl Fn(&Path) -> bool,
    ) -> io::Result<Box<dyn Hand>> {
        let is_outside = self.fence.take_in(&folder.work_root())?;
        let other = is_outside || self.memory != limits.memory_bytes;
        let fresh = turn.is_alone() || other || job.blame.charges > 0 || job.witness.is_some() || self.served >= FILES_PER_WORKER;
        if let Some(mut worker) = self.worker.take().filter(|_| !fresh)
            && worker.is_alive()
        {
            self.served += 1;
            return Ok(worker);
        }
        (self.served, self.memory) = (1, limits.memory_bytes);
        self.fence.leave_out(is_away);
        let share = Share { memory: limits.memory_bytes, threads: limits.threads, many: !turn.is_alone() };
        world.hire(share, &self.fence)
    }

    /// Takes the worker back for the next file, if it is well and was not hired for this one alone.
    pub(super) fn take_back(&mut self, worker: Box<dyn Hand>, ended: &Ended, turn: Turn) {
        // An error of the system may be the worker's own: its fence stands where a folder was that has gone.
        let is_well = match ended {
            Ended::Done { .. } => true,
            Ended::Failed { class, .. } => *class != ErrorClass::Environment,
            Ended::Died(_) | Ended::Stopped => false,
        };
        if is_well && !turn.is_alone() {
            self.worker = Some(worker);
        }
    }

    /// Lets the worker go, with its memory.
    pub(super) fn dismiss(&mut self) {
        self.worker = None;
    }
}
