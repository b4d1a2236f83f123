//! What a durable job queue must promise.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use crate::host::{Host, Station};
use crate::id::{Epoch, JobId, Recipe, Seq, Time, Token};
use crate::job::{Decision, Event, Illegal, Job, Kind, Past, Priority, Source, Step, Testimony};
use crate::news::{News, Notice};
use crate::share::Shares;

/// As many results alike are named as it makes sense to look at.
pub const MOST_RESULTS: usize = 8;
/// So many may hear of the ends of jobs.
pub const MOST_SUBSCRIBERS: usize = 32;

/// A durable job queue. A returned `Ok` means that the change survives a crash of process or machine; an `Err` that it did not
/// happen or, for [`StoreError::Backend`], [`StoreError::Away`], [`StoreError::Io`] and [`StoreError::Poisoned`] only, that this is unknown until the
/// store is opened again. Calls may come from any thread; calls at the same time share the cost of becoming durable.
pub trait JobStore: Send + Sync {
    /// Takes found files in, all of them in one durable step where possible. Idempotent: a file that a job answers for already
    /// gets that job's number. A file that was only noticed, and is no [`Submission::foreign`] one any more, is queued: its job
    /// counts as new. Answers in the order of `found`.
    ///
    /// # Errors
    /// [`StoreError::TooLong`] names a file whose path, folder or profile does not fit a record; nothing is taken in then.
    fn submit(&self, found: &[Submission]) -> Result<Vec<Submitted>, StoreError>;

    /// Claims the job that is next of those that `want` allows, counting the attempt: the one of the highest priority, as it counts
    /// after its wait ([`crate::job::AGEING_MS`]), of these one of the folder whose turn it is ([`crate::Share`]), and of its own the oldest. Folders that have as
    /// many jobs in work as they may are left out. `None` when there is none. With `want.alone` only jobs that
    /// must run alone are given; the caller sees to it that nothing else runs. A parked job whose pause is over is given to anyone,
    /// first: it needs no worker.
    ///
    /// # Errors
    /// Store errors only.
    fn claim(&self, want: &Filter) -> Result<Option<Claim>, StoreError>;

    /// Will the next claim give a parked job, or look for what a dead daemon held, whatever is wanted?
    ///
    /// # Errors
    /// Store errors only.
    fn has_parked(&self) -> Result<bool, StoreError>;

    /// How soon those jobs are wanted that a claim with `want` may give now, parked ones left out; `None` when there is none.
    ///
    /// # Errors
    /// Store errors only.
    fn waiting(&self, want: &Filter) -> Result<Option<Waiting>, StoreError>;

    /// Gives no job of these hot folders out until this is said again, without them. It is forgotten with the store's end.
    fn shut(&self, folders: &BTreeSet<String>);

    /// Has these hot folders share the work so, and all others as usual, until this is said again; see [`crate::Share`]. It is forgotten with the store's
    /// end.
    fn share(&self, shares: &Shares);

    /// Does the claim still hold, and does anyone want it stopped? Extends the claim where claims expire.
    ///
    /// # Errors
    /// Store errors only.
    fn heartbeat(&self, claim: &Claim) -> Result<Lease, StoreError>;

    /// Makes the next transition durable, and returns the job after it: its duty says what to do next, its hold whether the
    /// claim goes on.
    ///
    /// # Errors
    /// [`StoreError::Illegal`] when the claim is void ([`Illegal::Fenced`]) or the step does not belong to the state.
    fn advance(&self, claim: &Claim, step: Step) -> Result<Job, StoreError>;

    /// An operator's wish.
    ///
    /// # Errors
    /// [`StoreError::Unknown`], or [`StoreError::Illegal`] when it is too late for it.
    fn control(&self, id: JobId, wish: Control) -> Result<Job, StoreError>;

    /// Takes back the claims of a daemon that died. Running jobs are interrupted: each is afterwards queued, cancelled, or
    /// concluded (quarantined). Jobs whose result was on its way come with a new claim, and their duty is to be done; parked jobs
    /// may be claimed at once. `testimony` is asked once for each job that ran when the daemon, but not the machine, died.
    ///
    /// # Errors
    /// Store errors only.
    fn recover(&self, testimony: &dyn Fn(&Job) -> Testimony) -> Result<Vec<Recovered>, StoreError>;

    /// One job.
    ///
    /// # Errors
    /// Store errors only.
    fn get(&self, id: JobId) -> Result<Option<Job>, StoreError>;

    /// Jobs by number, ascending.
    ///
    /// # Errors
    /// Store errors only.
    fn list(&self, query: &Query) -> Result<Vec<Job>, StoreError>;

    /// Jobs, the latest first, a page at a time: however many there are, little is read for it.
    ///
    /// # Errors
    /// Store errors only.
    fn page(&self, look: &Look) -> Result<Page, StoreError>;

    /// The latest job of this very file, whether it still answers for it or not; `None` when there was none, or it was forgotten.
    ///
    /// # Errors
    /// Store errors only.
    fn find(&self, source: &Source) -> Result<Option<JobId>, StoreError>;

    /// Jobs with good results for sources of `size` bytes that others may have a copy of: those made by `recipe`, the latest first, at most
    /// [`MOST_RESULTS`]; without a recipe any one of them, if there is one.
    ///
    /// # Errors
    /// Store errors only.
    fn results(&self, size: u64, recipe: Option<Recipe>) -> Result<Vec<Job>, StoreError>;

    /// Is the store still where it was opened?
    ///
    /// # Errors
    /// [`StoreError::Unusable`] when it was moved or removed meanwhile: what is written to it, no one finds again.
    fn check(&self) -> Result<(), StoreError>;

    /// Removes the records of jobs that are at rest ([`Kind::is_at_rest`]), durably; any other stays. Returns how many were removed. The
    /// caller sees to it that none of them answers for a file that still lies where it was dropped: it would be taken for a new one.
    ///
    /// # Errors
    /// Store errors only.
    fn forget(&self, ids: &[JobId]) -> Result<u64, StoreError>;

    /// Was the store begun anew, so that what earlier ones knew may still lie in the hot folders? Until [`JobStore::set_filled`], over
    /// any number of lives.
    ///
    /// # Errors
    /// Store errors only.
    fn is_unfilled(&self) -> Result<bool, StoreError>;

    /// Takes jobs of an earlier store in, durably; each keeps its number if that is free. Their new numbers, in the order of `past`. The
    /// caller sees to it that none of them is here already.
    ///
    /// # Errors
    /// [`StoreError::TooLong`] when one does not fit a record; nothing is taken in then.
    fn restore(&self, past: &[Past]) -> Result<Vec<JobId>, StoreError>;

    /// Nothing of earlier stores is left to be read.
    ///
    /// # Errors
    /// Store errors only.
    fn set_filled(&self) -> Result<(), StoreError>;

    /// These, and no others, are to hear of every job that comes to its end from now on, and of news of the service, durably; at most [`MOST_SUBSCRIBERS`]. Who is one
    /// already keeps what was not acknowledged yet.
    ///
    /// # Errors
    /// [`StoreError::TooLong`] when there are too many, or a name does not fit a record.
    fn subscribe(&self, names: &[String]) -> Result<(), StoreError>;

    /// Notices that the subscriber of that name has not acknowledged, the oldest first, at most `most`: jobs as they stood when they came to their end, and
    /// news of the service. Each of them is durable. Later changes of a job, also the end of its record, change nothing here.
    ///
    /// # Errors
    /// Store errors only.
    fn notices(&self, name: &str, most: usize) -> Result<Vec<Notice>, StoreError>;

    /// That subscriber needs no notice up to this one any more, durably.
    ///
    /// # Errors
    /// Store errors only.
    fn acknowledge(&self, name: &str, seq: Seq) -> Result<(), StoreError>;

    /// How many notices that subscriber has not acknowledged.
    ///
    /// # Errors
    /// Store errors only.
    fn backlog(&self, name: &str) -> Result<u64, StoreError>;

    /// Has every subscriber hear these news, durably, unless it is known already that it is so: the folder is away, or is not, as the last word of
    /// it said, in whatever life of the daemon; or a night was told of that ended no earlier. Returns whether they were news.
    ///
    /// # Errors
    /// [`StoreError::TooLong`] when the folder's name does not fit a record.
    fn tell(&self, news: &News) -> Result<bool, StoreError>;

    /// The end of the night that was told last; `None`: nights are not counted yet.
    ///
    /// # Errors
    /// Store errors only.
    fn last_night(&self) -> Result<Option<Time>, StoreError>;

    /// The next night counts from here, and none before it is told any more, durably.
    ///
    /// # Errors
    /// Store errors only.
    fn begin_night(&self, at: Time) -> Result<(), StoreError>;

    /// How many jobs there are of each kind, in the order of [`Kind::ALL`].
    ///
    /// # Errors
    /// Store errors only.
    fn counts(&self) -> Result<Vec<(Kind, u64)>, StoreError>;

    /// Since when calls wait for a database that does not answer; `None`: it answers, as far as anyone knows. Waits for nothing.
    fn away(&self) -> Option<Time> {
        None
    }

    /// Has `news` be called whenever others may have brought something to claim, from a thread of the store's, until its end. Where no one else can, it
    /// never is. Someone has to look now and then all the same.
    fn hear(&self, news: Arc<dyn Fn() + Send + Sync>) {
        drop(news);
    }

    /// The daemons that share the store, by name, and have given a sign lately or were not heard to end; none where no other can.
    ///
    /// # Errors
    /// Store errors only.
    fn hosts(&self) -> Result<Vec<Host>, StoreError> {
        Ok(Vec::new())
    }

    /// This daemon tells this of itself from now on, or from its next sign of life on while nobody can be told.
    fn announce(&self, station: &Station) {
        let _ = station;
    }

    /// Has the daemons of this host, or the daemon of this name, claim nothing more, or claim again; durably, also over their restarts. `false`: no
    /// daemon of the store is called so.
    ///
    /// # Errors
    /// Store errors only.
    fn drain(&self, name: &str, drains: bool) -> Result<bool, StoreError> {
        let _ = (name, drains);
        Ok(false)
    }

    /// Is this daemon to claim nothing?
    ///
    /// # Errors
    /// Store errors only.
    fn is_draining(&self) -> Result<bool, StoreError> {
        Ok(false)
    }
}

/// A file that was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Submission {
    /// The file, as it came to rest.
    pub source: Source,
    /// `Some`: not a format that is repaired; what it is instead. It is recorded and left where it is.
    pub foreign: Option<String>,
    /// How soon it is wanted.
    pub priority: Priority,
    /// When it was looked at.
    pub seen: Seen,
}

/// When a drop was looked at, as far as others may have moved it since.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Seen {
    /// No one moves it before it is submitted.
    #[default]
    Now,
    /// After the job of that number had ended, of the very same file; without one, at any time.
    After(Option<JobId>),
}

impl Submission {
    /// May `latest`, the last job of the very same file, have moved it since it was looked at?
    pub(crate) fn may_be_gone(&self, latest: &Job) -> bool {
        !latest.answers_for_source() && matches!(self.seen, Seen::After(last) if last < Some(latest.id))
    }
}

/// What became of a submission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Submitted {
    /// Its job.
    pub id: JobId,
    /// `false`: the job was there already, and not only noticed.
    pub new: bool,
    /// The job has ended, and may have moved the file since it was looked at ([`Seen`]): nothing was done. Whoever finds the file there still submits it
    /// again.
    pub ended: bool,
}

/// Which jobs to claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Filter {
    /// Smallest and largest size of the source in bytes, both included.
    pub size: (u64, u64),
    /// `false`: only jobs that may run beside others. `true`: only jobs that must run alone.
    pub alone: bool,
}

impl Default for Filter {
    /// Any size, beside others.
    fn default() -> Self {
        Self { size: (0, u64::MAX), alone: false }
    }
}

/// The highest priorities among jobs that may be claimed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Waiting {
    /// Of those that someone asked for.
    pub highest: Priority,
    /// As they count after their wait.
    pub aged: Priority,
}

/// The right to work on a job, until it ends, is handed back, or the daemon dies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Claim {
    /// The job.
    pub id: JobId,
    /// Names this claim; the store knows no other one of the job.
    pub token: Token,
    /// The job as it was claimed.
    pub job: Job,
}

/// State of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lease {
    /// Go on.
    Held,
    /// An operator wants the job stopped.
    Cancel,
    /// Someone else has the job, or no one; stop and touch nothing.
    Lost,
}

/// An operator's wish.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Control {
    /// Try again: a job that ended without a good result, was cancelled, or waits. Its blame is forgotten.
    Retry,
    /// Stop: a queued job at once, a running one as soon as its worker is stopped.
    Cancel,
    /// Drop a noticed file that is gone.
    Forget,
    /// End the pause of a job that waits; its blame stays.
    Hasten,
    /// Take a job that is queued or waits sooner, or later.
    Rank(Priority),
    /// Publish the best attempt of a job that needs review, as it was judged, or say that it is not to be used.
    Decide(Decision),
}

impl From<Control> for Event {
    fn from(wish: Control) -> Self {
        match wish {
            Control::Retry => Self::Retry,
            Control::Cancel => Self::Cancel,
            Control::Forget => Self::Forget,
            Control::Hasten => Self::Hasten,
            Control::Rank(priority) => Self::Rank(priority),
            Control::Decide(decision) => Self::Decide(decision),
        }
    }
}

/// A job whose daemon died.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recovered {
    /// After recovery; [`Job::work`] still names the work folder of the claim that is void now.
    pub job: Job,
    /// The token of the claim that is void now.
    pub void: Token,
    /// The new claim, when there is something to finish.
    pub claim: Option<Claim>,
}

/// Which jobs to list.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Query {
    /// Of these kinds; empty: of any.
    pub kinds: Vec<Kind>,
    /// With a larger number than this.
    pub after: JobId,
    /// At most so many; 0: all.
    pub limit: usize,
}

/// Records that are read for one page, at most.
pub const PAGE_READS: usize = 1000;

/// Which jobs to show, the latest first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Look {
    /// Of these kinds; empty: of any.
    pub kinds: Vec<Kind>,
    /// Of this hot folder; `None`: of any.
    pub folder: Option<String>,
    /// With a smaller number than this; `None`: from the latest on.
    pub before: Option<JobId>,
    /// At most so many.
    pub limit: usize,
}

/// Jobs by number, descending.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Page {
    /// Fewer than were wanted, or none, where the search ended early: see `next`.
    pub jobs: Vec<Job>,
    /// There may be more before this one; `None`: there are none.
    pub next: Option<JobId>,
}

/// What can go wrong with a store.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each variant says what its fields are")]
pub enum StoreError {
    /// The database that daemons share does not answer.
    #[error("the job database does not answer, for {seconds} s now: {reason}; see that {place} runs, and is reached from here")]
    Away { place: String, seconds: u64, reason: String },

    /// Another daemon serves a hot folder of that name, on the same shared store.
    #[error(
        "the folder `{folder}` is served by another daemon already, {by}, with the same job database: give this one another name in a \
         configuration, or stop that daemon"
    )]
    Served { folder: String, by: String },

    /// Another daemon tells of the events of a hot folder, and serves other folders than this one.
    #[error(
        "the events of the folder `{folder}` are told by another daemon, {by}, which serves other folders than this one: have daemons with the \
         role `control` name the same folders, all of them in buckets or on shares, or folders of their own"
    )]
    Told { folder: String, by: String },

    /// Another daemon owns the state folder.
    #[error("{} is owned by another daemon{}", path.display(), pid.map(|pid| format!(" (process {pid})")).unwrap_or_default())]
    Locked { path: PathBuf, pid: Option<u32> },

    /// A file of the state folder could not be read or written.
    #[error("{}: {action} failed: {source}", path.display())]
    Io { path: PathBuf, action: &'static str, source: std::io::Error },

    /// The database failed.
    #[error("the job database failed: {0}")]
    Backend(#[source] Box<dyn std::error::Error + Send + Sync>),

    /// An earlier error left the database in doubt; it must be opened again.
    #[error("the job database must be opened again after an error: {reason}")]
    Poisoned { reason: String },

    /// A record is damaged: its checksum, its version or its content is wrong.
    #[error("the job database holds a damaged record ({what}): {reason}; `suture jobs rebuild` begins a new one from receipts")]
    Corrupt { what: String, reason: String },

    /// The database was written by a newer version of this program.
    #[error("the job database has version {found}; this program knows versions up to {known}")]
    Newer { found: u16, known: u16 },

    /// The database opens, but lacks transitions that were acknowledged.
    #[error(
        "{}: the job database went back in time: it ends at epoch {}, transition {}, but epoch {}, transition {} were reached; {advice}",
        path.display(), found.0, found.1, reached.0, reached.1
    )]
    RolledBack { path: PathBuf, found: (Epoch, Seq), reached: (Epoch, Seq), advice: String },

    /// The database does not open, and no older state of it would be the truth.
    #[error("{}: the job database is damaged: {reason}; {advice}", path.display())]
    Unusable { path: PathBuf, reason: String, advice: String },

    /// There is no such job.
    #[error("there is no job {0}")]
    Unknown(JobId),

    /// The transition is not possible.
    #[error("job {id}: {source}")]
    Illegal { id: JobId, source: Illegal },

    /// Does not fit a record.
    #[error("{what} is too long to be recorded")]
    TooLong { what: String },
}

impl StoreError {
    /// The process's exit code for it: 73 when another daemon owns the state folder or a hot folder, 75 when the store cannot be used (trying
    /// again may help), 2 for what only this call got wrong.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Locked { .. } | Self::Served { .. } | Self::Told { .. } => 73,
            Self::Unknown(_) | Self::Illegal { .. } | Self::TooLong { .. } => 2,
            _ => 75,
        }
    }

    /// Was only this call wrong, so that the store itself is sound?
    pub fn is_callers(&self) -> bool {
        self.exit_code() == 2
    }
}
