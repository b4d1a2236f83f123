//! One slot of the daemon: claims jobs, one after the other, and brings each as far as it goes. It owns a worker process, which
//! serves many small files; a crash then costs the file that was being worked on, and a new process.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossbeam::channel::Sender;
use suture_core::report::Task;
use suture_core::{ErrorClass, Limits, Profile, Report};
use suture_store::Lease;
use suture_store::job::{Death as StoreDeath, Duty, Withdrawal};
use suture_store::{Claim, Ending, Job, JobStore, State, Step, StoreError, crash_point};

use crate::config::Config;
use crate::folder::Folder;
use crate::fsx::{self, Identity};
use crate::profiles;
use crate::protocol::Request;
use crate::publish::{CLAIMED, Conclusion, Desk, OUTPUT, PublishError, is_source};
use crate::schedule::{Schedule, Turn};
use crate::supervise::{Cause, Death, Ended, Worker};
use crate::units::show_size;

/// Left by a worker that outlived the daemon: the file it worked on did not kill it.
pub(crate) const WITNESS: &str = "outlived";
/// How often a running job asks whether anyone wants it stopped.
const ASK_EVERY: Duration = Duration::from_millis(500);
/// A worker process is replaced after so many files, so that nothing can pile up in it for months.
const FILES_PER_WORKER: u32 = 500;
/// Pauses between tries to bring a result into place while the folders cannot be written.
const RETRY_FIRST: Duration = Duration::from_millis(200);
const RETRY_LAST: Duration = Duration::from_secs(30);
/// With `--once`, so many tries.
const TRIES_ONCE: u32 = 5;

/// What happened, for the thread that looks after the folders.
#[derive(Debug)]
pub(crate) enum Event {
    /// The system noticed changes; these names were renamed into place.
    Hint { renamed: Vec<PathBuf> },
    /// A job came to its end, and answers for its name no longer.
    Ended { folder: String, path: PathBuf },
}

/// What all threads of the daemon share.
pub(crate) struct Context {
    pub store: Arc<dyn JobStore>,
    pub folders: Vec<Arc<Folder>>,
    pub config: Arc<Config>,
    pub schedule: Schedule,
    pub events: Sender<Event>,
    pub once: bool,
    /// Running jobs are to be handed back now.
    pub halt: AtomicBool,
    /// A job ended not good, or could not be ended.
    pub not_good: AtomicBool,
    /// The store failed; every thread ends.
    pub failed: Mutex<Option<StoreError>>,
}

impl Context {
    fn folder(&self, job: &Job) -> Option<&Arc<Folder>> {
        self.folders.iter().find(|folder| folder.name == job.source.folder)
    }

    /// The store failed: everything stops, so that it can be opened again.
    pub(crate) fn fail(&self, error: StoreError) {
        self.schedule.stop();
        self.halt.store(true, Ordering::Relaxed);
        if let Ok(mut failed) = self.failed.lock() {
            failed.get_or_insert(error);
        }
    }

    fn halted(&self) -> bool {
        self.halt.load(Ordering::Relaxed)
    }
}

/// A thread that works on jobs.
pub(crate) struct Slot<'a> {
    context: &'a Context,
    worker: Option<Worker>,
    served: u32,
}

impl<'a> Slot<'a> {
    pub(crate) fn new(context: &'a Context) -> Self {
        Self { context, worker: None, served: 0 }
    }

    /// Works until the schedule says stop.
    pub(crate) fn run(&mut self) {
        loop {
            let given = self.context.schedule.next();
            if given.turn == Turn::Stop {
                return;
            }
            if given.turn.is_alone() {
                // Its memory belongs to the large file now.
                self.worker = None;
            }
            let claim = self.context.store.claim(&given.turn.filter(self.context.config.large));
            let found = match claim {
                Ok(Some(claim)) => {
                    crash_point("daemon.claimed");
                    let job = claim.job.clone();
                    self.finish(&claim, job, given.turn);
                    true
                }
                Ok(None) => false,
                Err(error) => {
                    self.context.fail(error);
                    false
                }
            };
            self.context.schedule.done(given, found);
        }
    }

    /// Does what the job is owed until nothing is owed under this claim; the same after a crash as in normal work.
    pub(crate) fn finish(&mut self, claim: &Claim, mut job: Job, turn: Turn) {
        let span = tracing::info_span!("job", job = job.id.0, file = %job.source.path);
        let _in_span = span.enter();
        let work = job.work.unwrap_or(claim.token);
        let mut pause = RETRY_FIRST;
        let mut tries = 0;
        loop {
            let next = match job.duty() {
                Duty::Queue | Duty::Rest => break,
                _ => self.step(claim, &job, turn),
            };
            match next {
                Ok(Some(next)) => job = next,
                // The claim is lost: someone else's job now.
                Ok(None) => return,
                Err(PublishError::Store(StoreError::Illegal { source, .. })) => {
                    tracing::warn!(reason = %source, "The job went another way meanwhile.");
                    return;
                }
                Err(PublishError::Store(error)) => return self.context.fail(error),
                Err(error) => {
                    tries += 1;
                    if tries == 1 {
                        tracing::error!(%error, "A result cannot be brought into place; trying until it can.");
                    }
                    if self.context.halted() || (self.context.once && tries >= TRIES_ONCE) {
                        // Its state says what is to be done; the next start does it.
                        tracing::error!(%error, "A result waits to be brought into place at the next start.");
                        self.context.not_good.store(true, Ordering::Relaxed);
                        return;
                    }
                    std::thread::sleep(pause);
                    pause = (pause * 2).min(RETRY_LAST);
                }
            }
        }
        self.close(&job, work);
    }

    fn close(&self, job: &Job, work: suture_store::Token) {
        tell(job);
        let Some(folder) = self.context.folder(job) else { return };
        remove_work(&folder.work(work));
        crash_point("daemon.swept");
        match &job.state {
            State::Ended { publication } if !publication.ending.is_good() => self.context.not_good.store(true, Ordering::Relaxed),
            State::Queued { .. } => return self.context.schedule.news(),
            _ => {}
        }
        // The receiver outlives the slots; if not, no one needs to know.
        let _ = self.context.events.send(Event::Ended { folder: job.source.folder.clone(), path: job.source.path.to_path() });
    }

    /// The next step; `None` when the claim is lost.
    fn step(&mut self, claim: &Claim, job: &Job, turn: Turn) -> Result<Option<Job>, PublishError> {
        let context = self.context;
        let Some(folder) = context.folder(job) else {
            let reason = format!("the hot folder `{}` is not in the configuration", job.source.folder);
            return match job.duty() {
                Duty::Run | Duty::Stop => Ok(Some(context.store.advance(claim, Step::Environment { reason })?)),
                _ => Ok(None),
            };
        };
        let desk = Desk { store: &*context.store, folder, claim };
        let next = match (job.duty(), &job.state) {
            (Duty::Run, _) => return self.attempt(&desk, job, turn),
            (Duty::Stop, _) => context.store.advance(claim, Step::Cancelled)?,
            (Duty::Intend, State::Concluded { ending, reason, .. }) => {
                desk.intend(job, &Conclusion::None { ending: *ending, reason: reason.clone() })?
            }
            (Duty::Place, _) => desk.place(job)?,
            (Duty::MoveOriginal, _) => desk.move_original(job)?,
            _ => return Ok(None),
        };
        Ok(Some(next))
    }

    /// Lets a worker loose on the file, and says what came of it.
    fn attempt(&mut self, desk: &Desk, job: &Job, turn: Turn) -> Result<Option<Job>, PublishError> {
        let context = self.context;
        let work = desk.folder.work(desk.claim.token);
        let step = match claim_file(desk.folder, job, &work) {
            Err(why) => why.into(),
            Ok(claimed) => {
                crash_point("daemon.linked");
                match self.work(desk, job, &work, &claimed, turn) {
                    Worked::Report(report) => match verify(&report, &work) {
                        Ok(()) => return desk.intend(job, &Conclusion::Report(report)).map(Some),
                        Err(reason) => Step::Environment { reason },
                    },
                    Worked::None(ending, reason) => return desk.intend(job, &Conclusion::None { ending, reason }).map(Some),
                    Worked::Step(step) => step,
                    Worked::Lost => return Ok(None),
                }
            }
        };
        Ok(Some(context.store.advance(desk.claim, step)?))
    }

    fn work(&mut self, desk: &Desk, job: &Job, work: &Path, claimed: &Claimed, turn: Turn) -> Worked {
        let context = self.context;
        let profile = match find_profile(&context.config, desk.folder, job) {
            Ok(profile) => profile,
            Err(reason) => return Worked::Step(Step::Environment { reason }),
        };
        let limits = limits(&context.config, turn);
        let mut worker = match self.worker(&limits, turn, job) {
            Ok(worker) => worker,
            Err(error) => {
                return Worked::Step(Step::Environment { reason: format!("a worker process cannot be started: {error}") });
            }
        };
        let request = Request {
            task: Task::Repair,
            input: work.join(CLAIMED),
            output: Some(work.join(OUTPUT)),
            report: None,
            witness: Some(work.join(WITNESS)),
            shown_input: desk.folder.inbox().join(job.source.path.to_path()).display().to_string(),
            shown_output: None,
            profile,
            limits,
        };
        let asked = std::cell::Cell::new(Instant::now());
        let lease = std::cell::Cell::new(Lease::Held);
        let stop = || {
            if asked.get().elapsed() >= ASK_EVERY {
                asked.set(Instant::now());
                // A store that fails here fails at the next step too, and is dealt with there.
                lease.set(context.store.heartbeat(desk.claim).unwrap_or(Lease::Held));
            }
            lease.get() != Lease::Held || context.halted()
        };
        let limit = context.config.time_limit.of(job.source.size);
        tracing::debug!(worker = worker.pid(), attempt = job.attempts.0, "Work begins.");
        let ended = worker.run(&request, Some(limit), &stop, &mut |_, _, _| {});
        crash_point("daemon.worked");
        if matches!(ended, Ended::Done(_) | Ended::Failed { .. }) && !turn.is_alone() {
            self.worker = Some(worker);
        }
        let changed = !claimed.is_unchanged();
        match ended {
            Ended::Stopped => match lease.get() {
                Lease::Cancel => Worked::Step(Step::Cancelled),
                Lease::Lost => Worked::Lost,
                Lease::Held => Worked::Step(Step::HandBack),
            },
            Ended::Died(death) if !changed || !matches!(death.cause, Cause::Fault(_)) => died(&death),
            _ if changed => Worked::Step(Step::Withdrawn(Withdrawal::Changed)),
            Ended::Done(report) => Worked::Report(report),
            Ended::Failed { class, message } => {
                // Whoever reads it knows which file it is about.
                let named = format!("{}: ", request.shown_input);
                let reason = message.strip_prefix(&named).map_or(message.clone(), str::to_owned);
                match class {
                    ErrorClass::Unreadable => Worked::None(Ending::Unreadable, reason),
                    ErrorClass::Refused => Worked::None(Ending::Refused, reason),
                    ErrorClass::Environment => Worked::Step(Step::Environment { reason }),
                    ErrorClass::Changed => Worked::Step(Step::Withdrawn(Withdrawal::Changed)),
                }
            }
            Ended::Died(death) => died(&death),
        }
    }

    /// A worker for this job: the slot's own while it is in good shape, or a new one.
    fn worker(&mut self, limits: &Limits, turn: Turn, job: &Job) -> std::io::Result<Worker> {
        let fresh = turn.is_alone() || job.blame.charges > 0 || self.served >= FILES_PER_WORKER;
        if let Some(mut worker) = self.worker.take().filter(|_| !fresh)
            && worker.is_alive()
        {
            self.served += 1;
            return Ok(worker);
        }
        self.served = 1;
        Worker::spawn(limits.memory_bytes, limits.threads, !turn.is_alone())
    }
}

/// How an attempt went.
enum Worked {
    Report(Box<Report>),
    None(Ending, String),
    Step(Step),
    /// The claim is void.
    Lost,
}

fn died(death: &Death) -> Worked {
    tracing::warn!(reason = death.line(), blame = death.blames_file(), "A worker process died.");
    Worked::Step(Step::Died(match death.cause {
        Cause::Fault(signal) => StoreDeath::Signal(signal),
        Cause::Internal(code) => StoreDeath::Exit(code),
        Cause::Memory => StoreDeath::MemoryLimit,
        Cause::Time(_) => StoreDeath::TimeLimit,
        Cause::Killed(signal) => StoreDeath::Killed(signal),
    }))
}

/// A small file gets one thread and its slot's share of the memory; a file alone gets everything.
fn limits(config: &Config, turn: Turn) -> Limits {
    let alone = turn.is_alone();
    Limits {
        memory_bytes: if alone { config.memory } else { config.memory / config.workers.max(1) as u64 },
        threads: if alone { config.threads } else { 1 },
        ..Limits::default()
    }
}

/// The claimed file, and what tells whether it changed since.
struct Claimed {
    watched: PathBuf,
    identity: Identity,
}

impl Claimed {
    fn is_unchanged(&self) -> bool {
        Identity::of(&self.watched).is_ok_and(|now| now == self.identity)
    }
}

/// Why a file could not be claimed.
enum Unclaimed {
    Withdrawn(Withdrawal),
    Environment(String),
}

impl From<Unclaimed> for Step {
    fn from(why: Unclaimed) -> Self {
        match why {
            Unclaimed::Withdrawn(why) => Self::Withdrawn(why),
            Unclaimed::Environment(reason) => Self::Environment { reason },
        }
    }
}

/// Puts the dropped file into the attempt's folder: a hard link, which keeps it even if its name goes meanwhile; where that
/// cannot be, a copy. The dropped name stays, so that whatever happens to the attempt's folder, the file is where it was.
fn claim_file(folder: &Folder, job: &Job, work: &Path) -> Result<Claimed, Unclaimed> {
    let (area, path) = job.original();
    let source = folder.area(area).join(path.to_path());
    let environment = |what: &str, error: &std::io::Error| Unclaimed::Environment(format!("{what}: {error}"));
    let look = |path: &Path| match Identity::of(path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Err(Unclaimed::Withdrawn(Withdrawal::Vanished)),
        Err(e) => Err(environment("the file cannot be looked at", &e)),
        Ok(found) if is_source(&found, job) => Ok(found),
        Ok(_) => Err(Unclaimed::Withdrawn(Withdrawal::Changed)),
    };
    let size = look(&source)?.size;
    // Room for the result and for what the engine puts aside: a large file must not fill the disk half way.
    let (needed, free) = (size.saturating_mul(3), fsx::free_space(&folder.root, 0));
    if free < needed {
        let (needed, free) = (show_size(needed), show_size(free));
        return Err(Unclaimed::Environment(format!("the disk has room for {free} more; this file may need {needed}")));
    }
    std::fs::create_dir_all(work).map_err(|e| environment("the work folder cannot be made", &e))?;
    let claimed = work.join(CLAIMED);
    if std::fs::hard_link(&source, &claimed).is_ok() {
        // Linking changed ctime: from here on it must stay.
        let identity = look(&claimed)?;
        return Ok(Claimed { watched: claimed, identity });
    }
    // No hard links here, or not of other people's files.
    let before = look(&source)?;
    std::fs::copy(&source, &claimed).map_err(|e| environment("the file cannot be copied", &e))?;
    if look(&source)? != before {
        return Err(Unclaimed::Withdrawn(Withdrawal::Changed));
    }
    Ok(Claimed { watched: source, identity: before })
}

/// The settings for a file: of its folder or one above it, else by name.
fn find_profile(config: &Config, folder: &Folder, job: &Job) -> Result<Profile, String> {
    let inbox = folder.inbox();
    let path = inbox.join(job.source.path.to_path());
    for above in path.ancestors().skip(1).take_while(|above| above.starts_with(&inbox)) {
        let own = above.join(profiles::FOLDER_FILE);
        if own.is_file() {
            return profiles::from_file(&own);
        }
    }
    config.profile(&job.source.profile).ok_or_else(|| format!("there is no profile `{}` any more", job.source.profile))
}

/// Does the written file read back as the engine wrote it?
fn verify(report: &Report, work: &Path) -> Result<(), String> {
    let path = work.join(OUTPUT);
    match &report.output {
        None if report.outcome.is_good() => Err("the engine reports a result, but there is none".into()),
        None => Ok(()),
        Some(facts) => match fsx::hash(&path) {
            Ok(hash) if hash == facts.blake3 => Ok(()),
            Ok(_) => Err("the result does not read back as it was written".into()),
            Err(error) => Err(format!("the result cannot be read back: {error}")),
        },
    }
}

/// Removes an attempt's folder. The claimed file in it is a second name (or a copy) of a file that has its own place.
pub(crate) fn remove_work(work: &Path) {
    match std::fs::remove_dir_all(work) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            tracing::warn!(%error, folder = %work.display(), "A work folder could not be removed; the next start does it.");
        }
        _ => {}
    }
}

fn tell(job: &Job) {
    match &job.state {
        State::Ended { publication } if publication.ending.is_good() => {
            tracing::info!(ending = ?publication.ending, output = publication.output.as_ref().map(tracing::field::display), "Done.");
        }
        State::Ended { publication } => {
            tracing::warn!(ending = ?publication.ending, reason = publication.reason, "Ended without a good result.");
        }
        State::Cancelled { why } => tracing::info!(?why, "Taken back."),
        State::Queued { .. } => tracing::info!(reason = job.note, "Back in the queue."),
        _ => {}
    }
}
