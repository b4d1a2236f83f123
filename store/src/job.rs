//! The job state machine: what may happen to a dropped file, in which order, and who is to blame. Pure: no I/O, no clock.
//!
//! ```text
//!  Noticed ──want (a mesh names it)──► Queued     (a format that is not ours: left where it is)
//!
//!  Queued ──claim──► Running ──intend──► Publishing ──placed──► Published ──finished──► Ended
//!    ▲ ▲                │ │                 ▲  │
//!    │ └──died, back────┘ └─condemned─► Concluded (result known, no worker needed, names not yet chosen)
//!    └───retry (operator)── Ended (not good), Cancelled
//!
//!  Ended (needs review) ──approve (a person)──► Approved ──intend──► Publishing …
//! ```
//! A job that is Concluded, Publishing or Published and cannot go on (a folder that may not be written, a foreign mount) is *parked*
//! in its state: no one holds it, its reason is in its note, and it is claimed again after a pause.
//!
//! What the outside world owes a job follows from its state alone ([`Job::duty`]), so that recovery after a crash is the same
//! code as normal work.
//!
//! **Witness.** A job may be *sampled*: a first attempt that made a good result leaves a [`Witness`] of it, and the job goes back into the queue, so that a
//! second attempt, on another host if there is one, makes the result once more. What comes of the comparison is the caller's business; the witness stays with
//! the job until it is at rest or an operator retries it.
//!
//! **Blame.** An attempt is counted when it is claimed, before its worker starts, and is never taken back. It is *charged* to
//! the file when the worker died of the file: a signal of its own making, the time limit, the memory limit. The second charge
//! quarantines. A kill from outside is never charged, and a death of the machine (another boot id) never is.
//! When the daemon dies, its running jobs are interrupted; after the second such death, or one of the machine, a job must run alone. Only
//! a death of the daemon while it reads what the file's worker has to say is the file's ([`Testimony::InHand`]): after the first a job runs
//! alone, and [`DEATHS_IN_HAND`] of them, charges included, quarantine, if [`DEATHS_ALONE`] of them were without company. So a file that
//! kills the daemon has three attempts, and one that only ran beside it is cleared by its own next run. A witness that the file was innocent (its worker outlived the daemon)
//! leaves no mark.

mod blame;
mod decision;
mod hold;
mod kind;
mod past;
mod pauses;
mod priority;
mod state;
mod step;
#[cfg(test)]
mod tests;
mod witness;
mod words;

pub use blame::{Blame, CHARGES, DEATHS_ALONE, DEATHS_IN_HAND, DEATHS_TO_SUSPECT, Death, KILLS_FREE, Testimony};
pub use decision::{Decision, MAX_BY, NoDecision, Verdict};
pub use hold::Hold;
pub use kind::Kind;
pub use past::{Past, Reached};
pub use pauses::{BACKOFF_CAP_MS, BACKOFF_MS, ENVIRONMENT_RETRIES, HAND_ON_MS, PARK_CAP_MS, PARK_MS, WAIT_MS};
pub use priority::{AGEING_MS, NoPriority, Priority};
pub use state::{Area, Duty, Ending, Job, Parked, Publication, Source, State, Step, Withdrawal};
pub use step::{Event, Illegal};
pub use witness::{MAX_DAEMON, Witness};
pub use words::{MAX_REASON, one_line};
