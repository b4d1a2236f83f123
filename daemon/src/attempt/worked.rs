//! How an attempt went, and what the end of a worker means for the job.

use suture_core::{ErrorClass, Report};
use suture_store::job::{Death as StoreDeath, Withdrawal};
use suture_store::{Ending, Job, Step};

use crate::fsx::Identity;
use crate::receipt::ReusedFrom;
use crate::schedule::Turn;
use crate::supervise::{Cause, Death};

/// How an attempt went.
pub(super) enum Worked {
    Report {
        report: Box<Report>,
        written: Option<Identity>,
        /// Nothing was computed.
        reused: Option<ReusedFrom>,
    },
    None(Ending, String),
    Step(Step),
    /// The claim is void.
    Lost,
}

/// How the job goes on.
pub(super) enum Onward {
    /// The intent is durable.
    Job(Box<Job>),
    Step(Box<Step>),
    /// The claim is void.
    Lost,
}

impl Worked {
    /// The engine refused the file, or failed over it: what that means for the job.
    pub(super) fn failed(class: ErrorClass, message: &str, shown_input: &str, turn: Turn) -> Self {
        // Whoever reads it knows which file it is about.
        let reason = message.strip_prefix(&format!("{shown_input}: ")).unwrap_or(message).to_owned();
        match class {
            ErrorClass::Unreadable => Self::None(Ending::Unreadable, reason),
            ErrorClass::Starved if !turn.is_alone() => Self::Step(Step::NeedsAll),
            ErrorClass::Refused | ErrorClass::Starved => Self::None(Ending::Refused, reason),
            ErrorClass::Environment => Self::Step(Step::Environment { reason }),
            ErrorClass::Shortage => Self::Step(Step::Wait { reason }),
            ErrorClass::Changed => Self::Step(Step::Withdrawn(Withdrawal::Changed)),
        }
    }

    /// The worker died of it, or of something else.
    pub(super) fn died(death: &Death, turn: Turn) -> Self {
        tracing::warn!(reason = death.line(), blame = death.blames_file(), "A worker process died.");
        Self::Step(match death.cause {
            Cause::Fault(signal) => Step::Died(StoreDeath::Signal(signal)),
            Cause::Internal(code) => Step::Died(StoreDeath::Exit(code)),
            Cause::Memory if !turn.is_alone() => Step::NeedsAll,
            Cause::Memory => Step::Died(StoreDeath::MemoryLimit),
            Cause::Machine | Cause::Cut => Step::Environment { reason: death.line() },
            Cause::Time(_) => Step::Died(StoreDeath::TimeLimit),
            Cause::Killed(signal) => Step::Died(StoreDeath::Killed(signal)),
        })
    }
}
