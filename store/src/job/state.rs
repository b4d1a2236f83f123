//! A dropped file's job: its states, what its holder may report, and what it is owed.

use serde::{Deserialize, Serialize};

use super::blame::{Blame, Death};
use super::decision::{Decision, Verdict};
use super::hold::Hold;
use super::kind::Kind;
use super::pauses::BACKOFF_CAP_MS;
use super::priority::Priority;
use super::witness::Witness;
use super::words::one_line;
use crate::id::{Attempt, Hash, JobId, Recipe, Seq, Time, Token};
use crate::path::RelPath;

/// The dropped file, as it was when it came to rest.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// Name of the hot folder in the daemon's settings.
    pub folder: String,
    /// Below the folder's `in/`.
    pub path: RelPath,
    /// Device of the file.
    pub dev: u64,
    /// Inode of the file.
    pub ino: u64,
    /// Bytes.
    pub size: u64,
    /// Nanoseconds since 1970.
    pub mtime_ns: i64,
    /// Profile to repair it with.
    pub profile: String,
}

/// Part of a hot folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Area {
    /// Where files are dropped.
    In,
    /// Originals of what is in `out/`.
    Done,
    /// Originals of what could not be made good, or needs review.
    Failed,
    /// What crashes or hangs the repair.
    Quarantine,
}

/// Result of a job: it is on disk, and nothing more will be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// Good as it came.
    Clean,
    /// Repaired, and good.
    Repaired,
    /// Not repaired, since its result would have a name that is taken, and its folder wants no second one.
    Skipped,
    /// No mesh: a file that a mesh names, copied to where the result of that mesh is.
    Carried,
    /// Repaired, but a person must look.
    NeedsReview,
    /// Not good under the profile after all repairs.
    NotGood,
    /// No mesh we can read.
    Unreadable,
    /// Beyond a stated limit.
    Refused,
    /// Its result would have a name that is taken, and its folder wants a person to see to that.
    NameTaken,
    /// The world around the file failed too often.
    Environment,
    /// It killed its worker, or the daemon, too often.
    Quarantined,
}

impl Ending {
    /// Where the original goes.
    pub fn area(self) -> Area {
        match self {
            Self::Clean | Self::Repaired | Self::Skipped | Self::Carried => Area::Done,
            Self::NeedsReview | Self::NotGood | Self::Unreadable | Self::Refused | Self::NameTaken | Self::Environment => {
                Area::Failed
            }
            Self::Quarantined => Area::Quarantine,
        }
    }

    /// Does what it leaves belong into `out/`?
    pub fn is_good(self) -> bool {
        self.area() == Area::Done
    }

    /// Reached since the name of a result is taken: there is no result then.
    pub fn is_for_want_of_a_name(self) -> bool {
        matches!(self, Self::Skipped | Self::NameTaken)
    }

    /// Reached without a result of the engine: there is nothing that running again after lost files would bring back.
    pub(super) fn is_condemned(self) -> bool {
        matches!(self, Self::Quarantined | Self::Environment)
    }
}

/// The intent: which files a finished job leaves, under which names. Durable before the first of them is moved.
///
/// A good result stands in `out/`, any other (the best attempt) in the area of its ending. Report and receipt take their names
/// from the output's, or from the original's where there is no output.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Publication {
    /// How the job ends.
    pub ending: Ending,
    /// One line for people; empty when there is nothing to add. Cut to [`MAX_REASON`](super::MAX_REASON) bytes.
    pub reason: String,
    /// The repaired mesh.
    pub output: Option<RelPath>,
    /// Of the bytes of the repaired mesh; of a file that was carried, also where `out/` had those bytes before, and `output` is none.
    pub output_hash: Option<Hash>,
    /// Of the bytes of the report.
    pub report_hash: Option<Hash>,
    /// Of a good result: what it was made of, and with.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recipe: Option<Recipe>,
    /// The job whose result was copied, so that nothing was computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reused: Option<JobId>,
    /// Last change of the original's inode, in nanoseconds since 1970, when its result was found. If it still has it, its content is
    /// the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source_ctime_ns: Option<i64>,
    /// Name of the original in the area of the ending; `None` where it could not be moved.
    pub original: Option<RelPath>,
    /// The original stays where it was dropped: its name only stands for those of report and receipt.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub stays: bool,
    /// What a person has said of a result that needed review.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub decision: Option<Box<Decision>>,
}

impl Publication {
    /// The name that report and receipt are named after: the result's in `out/`, else the original's.
    pub fn base(&self) -> Option<&RelPath> {
        self.output.as_ref().filter(|_| self.ending.is_good()).or(self.original.as_ref())
    }

    /// Does it take the place of `earlier`, whose name was taken before anything of it was in place? What a person approved has no such end.
    pub(super) fn gives_way(&self, earlier: &Self) -> bool {
        let is_open = earlier.ending.is_good() && earlier.decision.is_none();
        is_open && self.ending.is_for_want_of_a_name() && self.output.is_none() && self.output_hash.is_none()
    }
}

/// Why a job was cancelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Withdrawal {
    /// An operator said so. The file stays where it is, and is not taken again until a retry.
    Operator,
    /// The file changed; what it became is a new drop with a job of its own.
    Changed,
    /// The file is gone.
    Vanished,
}

/// A result that could not be brought into place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Parked {
    /// End of the pause; `None` while someone tries again.
    pub until: Option<Time>,
    /// How often it was tried.
    pub tries: u32,
    /// A file of the result is in its place already, so that the job cannot be taken back any more.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub committed: bool,
}

/// Where a job stands.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs, reason = "each variant says what its fields are")]
pub enum State {
    /// A file of a format that is not repaired: left where it is, named once. `reason` says what it is.
    Noticed { reason: String },
    /// Waiting to be claimed; not before `not_before`, if there is one.
    Queued { not_before: Option<Time> },
    /// Claimed: a worker runs, or is about to, or has just ended. `cancel`: an operator wants it stopped.
    Running { hold: Hold, cancel: bool },
    /// The result is known and needs no worker; its names are not chosen yet.
    Concluded { hold: Hold, ending: Ending, reason: String },
    /// A person approved the best attempt, which `publication` says how to know; its names in `out/` are not chosen yet.
    Approved { hold: Hold, publication: Publication },
    /// The intent is durable; files are being put in place.
    Publishing { hold: Hold, publication: Publication },
    /// The result is in place; the original has still to be moved.
    Published { hold: Hold, publication: Publication },
    /// Result and original are in place.
    Ended { publication: Publication },
    /// Taken back.
    Cancelled { why: Withdrawal },
}

/// What the holder of a claim reports. Each is legal only in the state it belongs to, and only with the claim's token.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "each variant says what its fields are")]
pub enum Step {
    /// The worker died.
    Died(Death),
    /// The world around the file failed (I/O, space, permission): try again later.
    Environment { reason: String },
    /// Something that no try of this file changes (its folder is out of reach, no process or no room is to be had, a setting is wrong):
    /// wait a while; it does not count.
    Wait { reason: String },
    /// Its share of the memory was too small: try again alone, with all of it.
    NeedsAll,
    /// The result cannot be brought into place for now; the claim ends. `committed`: a file of it is in its place already.
    Park { reason: String, committed: bool },
    /// Stopping: the job goes back into the queue at no cost.
    HandBack,
    /// The first of two attempts made a good result: another attempt is to make it once more, and compare. It costs nothing.
    Sampled(Box<Witness>),
    /// It was sampled, and another host has a moment to claim it, so that not one host alone makes both results. It costs nothing.
    HandOn,
    /// The worker was stopped as the operator asked, and the file is back in its place.
    Cancelled,
    /// The file is not the one that was submitted any more.
    Withdrawn(Withdrawal),
    /// The names of the result; the files are durable under temporary ones. Said again while publishing, it replaces the
    /// earlier intent (a name was taken meanwhile).
    Intend(Publication),
    /// The files of the intent are in place, durably.
    Placed,
    /// The original will go to another name than intended, since that one was taken meanwhile.
    Redirect { original: RelPath },
    /// The original is in its place, durably.
    Finished,
    /// The intended files are neither in place nor under their temporary names: the work must be done again.
    Lost,
    /// What a person approved is not there any more as it was judged: it is not published.
    Unfit { reason: String },
}

/// What the outside world owes a job now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Duty {
    /// Nothing until it is claimed.
    Queue,
    /// Run a worker on it.
    Run,
    /// Stop its worker, put the file back, report [`Step::Cancelled`].
    Stop,
    /// Write the report, choose the names, report [`Step::Intend`].
    Intend,
    /// Put the files in place, report [`Step::Placed`] (or [`Step::Lost`]).
    Place,
    /// Move the original, report [`Step::Finished`].
    MoveOriginal,
    /// Nothing any more.
    Rest,
}

/// All that is known of one dropped file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Job {
    /// Its number.
    pub id: JobId,
    /// The dropped file.
    pub source: Source,
    /// Where the original is while no claim holds it, if it is not at its source (after a retry of a failed job).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moved_to: Option<(Area, RelPath)>,
    /// How soon it is wanted.
    #[serde(default, skip_serializing_if = "Priority::is_default")]
    pub priority: Priority,
    /// Where it stands.
    pub state: State,
    /// Attempts so far.
    pub attempts: Attempt,
    /// What it is suspected of.
    pub blame: Blame,
    /// It needs the whole memory.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub needs_all: bool,
    /// What an earlier attempt made, while another one is to make the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub witness: Option<Box<Witness>>,
    /// Set while its result cannot be brought into place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parked: Option<Parked>,
    /// Token of the last claim, whose work folder may still be there.
    pub work: Option<Token>,
    /// Why the last attempt came back; for people.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub note: String,
    /// When the file was found.
    pub submitted: Time,
    /// When an operator wanted it tried once more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub retried: Option<Time>,
    /// When its state changed last.
    pub changed: Time,
    /// The transition that made it what it is.
    pub seq: Seq,
}

impl Job {
    /// A file that was just found, to be repaired.
    pub fn queued(id: JobId, source: Source, now: Time) -> Self {
        Self::new(id, source, State::Queued { not_before: None }, now)
    }

    /// A file that was just found, of a format that is left alone.
    pub fn noticed(id: JobId, source: Source, reason: &str, now: Time) -> Self {
        Self::new(id, source, State::Noticed { reason: one_line(reason) }, now)
    }

    fn new(id: JobId, source: Source, state: State, now: Time) -> Self {
        Self {
            id,
            source,
            moved_to: None,
            priority: Priority::default(),
            state,
            attempts: Attempt(0),
            blame: Blame::default(),
            needs_all: false,
            witness: None,
            parked: None,
            work: None,
            note: String::new(),
            submitted: now,
            retried: None,
            changed: now,
            seq: Seq(0),
        }
    }

    /// The state without its data.
    pub fn kind(&self) -> Kind {
        match &self.state {
            _ if self.rests_parked() => Kind::Parked,
            State::Noticed { .. } => Kind::Noticed,
            State::Queued { not_before: Some(_) } => Kind::Waiting,
            State::Queued { not_before: None } if self.must_run_alone() => Kind::Alone,
            State::Queued { not_before: None } => Kind::Queued,
            State::Running { .. } => Kind::Running,
            State::Concluded { .. } | State::Approved { .. } => Kind::Concluded,
            State::Publishing { .. } => Kind::Publishing,
            State::Published { .. } => Kind::Published,
            State::Ended { publication } => match publication.ending {
                Ending::Clean | Ending::Repaired | Ending::Skipped => Kind::Done,
                Ending::Carried => Kind::Carried,
                Ending::NeedsReview if publication.decision.is_some() => Kind::Rejected,
                Ending::NeedsReview => Kind::NeedsReview,
                Ending::Quarantined => Kind::Quarantined,
                Ending::NotGood | Ending::Unreadable | Ending::Refused | Ending::NameTaken | Ending::Environment => Kind::Failed,
            },
            State::Cancelled { .. } => Kind::Cancelled,
        }
    }

    /// Must nothing else run beside it?
    pub fn must_run_alone(&self) -> bool {
        self.needs_all || self.blame.is_suspect()
    }

    /// Parked, and no one tries?
    pub(super) fn rests_parked(&self) -> bool {
        self.parked.is_some_and(|parked| parked.until.is_some())
    }

    /// The claim on it, if there is one.
    pub fn hold(&self) -> Option<&Hold> {
        match &self.state {
            _ if self.rests_parked() => None,
            State::Running { hold, .. }
            | State::Concluded { hold, .. }
            | State::Approved { hold, .. }
            | State::Publishing { hold, .. }
            | State::Published { hold, .. } => Some(hold),
            State::Noticed { .. } | State::Queued { .. } | State::Ended { .. } | State::Cancelled { .. } => None,
        }
    }

    /// What is to be done for it.
    pub fn duty(&self) -> Duty {
        match &self.state {
            _ if self.rests_parked() => Duty::Queue,
            State::Queued { .. } => Duty::Queue,
            State::Running { cancel: false, .. } => Duty::Run,
            State::Running { cancel: true, .. } => Duty::Stop,
            State::Concluded { .. } | State::Approved { .. } => Duty::Intend,
            State::Publishing { .. } => Duty::Place,
            State::Published { .. } => Duty::MoveOriginal,
            State::Noticed { .. } | State::Ended { .. } | State::Cancelled { .. } => Duty::Rest,
        }
    }

    /// Since when it waits for its turn: pauses and attempts in between do not make it younger.
    pub fn waits_since(&self) -> Time {
        self.retried.unwrap_or(self.submitted)
    }

    /// End of the pause it is in: queued after an error, or parked.
    pub fn pause(&self) -> Option<Time> {
        match self.state {
            State::Queued { not_before } => not_before,
            _ => self.parked.and_then(|parked| parked.until),
        }
    }

    /// What it is to leave, or has left, as far as that is known.
    pub fn publication(&self) -> Option<&Publication> {
        match &self.state {
            State::Publishing { publication, .. } | State::Published { publication, .. } | State::Ended { publication } => {
                Some(publication)
            }
            _ => None,
        }
    }

    /// What a person has said of its result.
    pub fn decision(&self) -> Option<&Decision> {
        match &self.state {
            State::Approved { publication, .. } => publication.decision.as_deref(),
            _ => self.publication()?.decision.as_deref(),
        }
    }

    /// Is its best attempt on its way into `out/`, since a person approved it?
    pub(super) fn is_being_approved(&self) -> bool {
        let approved = self.decision().is_some_and(|decision| decision.verdict == Verdict::Approved);
        approved && !matches!(self.state, State::Ended { .. })
    }

    /// What the result that it has left is made of, if others may have a copy of it: it is done, and has an output.
    pub fn offers(&self) -> Option<Recipe> {
        match &self.state {
            State::Ended { publication } if publication.ending.is_good() && publication.output_hash.is_some() => {
                publication.recipe
            }
            _ => None,
        }
    }

    /// The claim whose work folder holds its files; 0 before the first.
    pub fn work_token(&self) -> Token {
        self.work.unwrap_or_default()
    }

    /// May it be claimed at `now`? A pause that ends later than the longest pause from now was set by a clock that has jumped;
    /// it is over.
    pub fn is_due(&self, now: Time) -> bool {
        let waits = matches!(self.state, State::Queued { .. }) || self.rests_parked();
        waits && self.pause().is_none_or(|then| then <= now || then > now.plus_ms(BACKOFF_CAP_MS))
    }

    /// Where the original is while no claim holds it: area and path in it.
    pub fn original(&self) -> (Area, &RelPath) {
        match (&self.state, &self.moved_to) {
            (State::Ended { publication: Publication { ending, original: Some(original), stays: false, .. } }, _) => {
                (ending.area(), original)
            }
            (_, Some((area, path))) => (*area, path),
            (_, None) => (Area::In, &self.source.path),
        }
    }

    /// Is the same file, seen in `in/` again, this job's? Not when the job's own original was moved away (someone moved it
    /// back: a new drop), or when the job ended because the file went.
    pub fn answers_for_source(&self) -> bool {
        match &self.state {
            State::Ended { publication } => publication.original.is_none() || publication.stays,
            State::Cancelled { why } => *why == Withdrawal::Operator && self.moved_to.is_none(),
            _ => self.moved_to.is_none(),
        }
    }
}
