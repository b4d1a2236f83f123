//! The request of a job to a worker: files of the attempt's own folder, settings, bounds.

use suture_core::report::Task;
use suture_core::{Limits, Profile};
use suture_store::{Claim, Job};

use crate::beside::Companion;
use crate::claim::CLAIMED;
use crate::config::Config;
use crate::folder::Folder;
use crate::protocol::Request;
use crate::publish::OUTPUT;
use crate::schedule::Turn;

/// Left by a worker that outlived the daemon: the file it worked on did not kill it.
pub(crate) const WITNESS: &str = "outlived";
/// There while the daemon reads a worker's answer.
pub(crate) const IN_HAND: &str = "in-hand";

/// The request of a job to a worker.
pub(super) fn request(
    folder: &Folder,
    claim: &Claim,
    job: &Job,
    (profile, companions): (Profile, Vec<Companion>),
    limits: Limits,
) -> Request {
    let work = folder.work(claim.token);
    Request {
        task: Task::Repair,
        input: work.join(CLAIMED),
        output: Some(work.join(OUTPUT)),
        report: None,
        witness: Some(work.join(WITNESS)),
        mark: Some(work.join(IN_HAND)),
        shown_input: folder.shown(&folder.inbox().join(job.source.path.to_path())),
        shown_output: None,
        profile,
        companions,
        limits,
    }
}

/// A small file gets one thread and its slot's share of the memory; a file alone gets everything.
pub(super) fn limits(config: &Config, turn: Turn) -> Limits {
    let alone = turn.is_alone();
    let memory = if alone { config.memory } else { config.memory / config.workers.max(1) as u64 };
    Limits::default().with_memory(memory).with_threads(if alone { config.threads } else { 1 })
}
