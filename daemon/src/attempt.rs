//! One slot of the daemon: claims jobs, one after the other, and brings each as far as it goes. It owns a worker process, which
//! serves many small files; a crash then costs the file that was being worked on, and a new process.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crossbeam::channel::Sender;
use suture_core::{ErrorClass, Profile};
use suture_store::Lease;
use suture_store::job::{Duty, Kind, Withdrawal};
use suture_store::patience::brief;
use suture_store::{Claim, Job, JobId, JobStore, Role, State, Step, StoreError, crash_point};

use crate::beside;
use crate::carry::is_carried;
use crate::choice;
use crate::claim::{CLAIMED, Claimed, Unclaimed, claim, let_go};
use crate::config::Config;
use crate::create;
use crate::event_bus::Bus;
use crate::folder::Folder;
use crate::force::is_forced;
use crate::fsx;
use crate::handed::Handed;
use crate::past::Unread;
use crate::publish::{Conclusion, Desk, OUTPUT, discard, litter};
use crate::publish_error::PublishError;
use crate::pulse::Pulse;
use crate::reuse::Sought;
use crate::schedule::{Schedule, Sizes, Turn, Waits};
use crate::settings::Settings;
use crate::settle::Rest;
use crate::supervise::{Cause, Ended};
use crate::world::World;

mod carry;
pub(crate) mod clear;
mod conclude;
mod request;
mod staff;
mod worked;

pub(crate) use request::{IN_HAND, WITNESS};
use request::{limits, request};
use staff::Staff;
use worked::{Onward, Worked};

/// How often a running job asks whether anyone wants it stopped.
const ASK_EVERY: Duration = Duration::from_millis(500);
/// What happened, for the thread that looks after the folders.
#[derive(Debug)]
pub(crate) enum Event {
    /// The system noticed changes; these names were renamed into place.
    Hint { renamed: Vec<PathBuf> },
    /// A job came to its end, and answers for its name no longer.
    Ended { folder: String, path: PathBuf, id: JobId },
    /// Someone hands a file over, and waits for its job.
    Handed(Handed),
}

/// What all threads of the daemon share.
pub(crate) struct Context {
    pub world: Arc<dyn World>,
    pub store: Arc<dyn JobStore>,
    pub folders: Vec<Arc<Folder>>,
    pub settings: Arc<Settings>,
    pub schedule: Schedule,
    pub events: Sender<Event>,
    pub once: bool,
    /// Running jobs are to be handed back now.
    pub halt: AtomicBool,
    /// A job ended not good, or could not be ended.
    pub not_good: Arc<AtomicBool>,
    /// By hot folder: what of it is out of reach, and why.
    pub away: Mutex<BTreeMap<String, Vec<String>>>,
    /// Names of hot folders of which nothing new is taken for want of room.
    pub full: Mutex<BTreeSet<String>>,
    /// Folders in which earlier stores left something that was not read yet.
    pub unread: Unread,
    /// The store failed; every thread ends.
    pub failed: Mutex<Option<StoreError>>,
    /// For who asks from outside.
    pub pulse: Pulse,
    /// Where everything that happens is told.
    pub bus: Arc<Bus>,
}

impl Context {
    fn folder(&self, job: &Job) -> Option<&Arc<Folder>> {
        self.folders.iter().find(|folder| folder.name == job.source.folder)
    }

    /// Is that part of the work this daemon's?
    pub(crate) fn has(&self, role: Role) -> bool {
        self.settings.now().roles.has(role)
    }

    /// Bytes that results of a hot folder may still fill, on its disk and on that of its results; boundless where they do not say.
    pub(crate) fn room(&self, folder: &Folder) -> u64 {
        if folder.silence().is_some() {
            return u64::MAX;
        }
        let reserve = self.settings.now().reserve;
        self.world.room(&folder.root, reserve).min(self.world.room(&folder.out(), reserve))
    }

    /// The store failed: everything stops, so that it can be opened again.
    pub(crate) fn fail(&self, error: StoreError) {
        self.schedule.stop();
        self.halt.store(true, Ordering::Relaxed);
        if let Ok(mut failed) = self.failed.lock() {
            failed.get_or_insert(error);
        }
    }

    /// Clears away what a parked job that was just given up had ready; `job` is the job as it was before.
    pub(crate) fn sweep(&self, job: &Job) {
        // Another daemon may have the folder, and a work folder of that name in it.
        if let (Kind::Parked, Some(folder)) = (job.kind(), self.folder(job).filter(|folder| folder.check().is_ok())) {
            match &folder.bucket {
                None => discard(folder, job),
                Some(shelf) => litter::discard(shelf, folder, job),
            }
            remove_work(&folder.work(job.work_token()));
        }
    }

    /// Has the store failed?
    pub(crate) fn has_failed(&self) -> bool {
        self.failed.lock().is_ok_and(|failed| failed.is_some())
    }

    /// Is the hot folder out of reach whose attempts are below `work_root`?
    fn is_away(&self, work_root: &Path) -> bool {
        self.folders.iter().any(|folder| folder.work_root() == work_root && folder.check().is_err())
    }

    fn waits(&self) -> Result<Waits, StoreError> {
        // Whoever asks has the schedule, which others need; and an idle slot has nothing to lose by a database that is away.
        match brief(|| Waits::of(&*self.store, Sizes::of(&self.settings.now()))) {
            Err(StoreError::Away { .. }) => Ok(Waits::default()),
            waits => waits,
        }
    }

    fn halted(&self) -> bool {
        self.halt.load(Ordering::Relaxed)
    }
}

/// A thread that works on jobs.
pub(crate) struct Slot {
    context: Arc<Context>,
    staff: Staff,
    /// A file of the result in work is in its place.
    committed: Cell<bool>,
    /// It has a turn, and its file is not computed yet.
    computes: Cell<bool>,
}

impl Slot {
    pub(crate) fn new(context: &Arc<Context>) -> Self {
        Self { context: Arc::clone(context), staff: Staff::default(), committed: Cell::new(false), computes: Cell::new(false) }
    }

    /// Works until the schedule says stop.
    pub(crate) fn run(&mut self) {
        loop {
            match self.context.schedule.next(&|| self.context.waits()) {
                Ok(Turn::Stop) => return,
                Ok(turn) => self.take(turn),
                Err(error) => return self.context.fail(error),
            }
        }
    }

    /// Works on one job, if it has a turn now. Returns whether it had one.
    #[cfg(test)]
    pub(crate) fn try_turn(&mut self) -> bool {
        match self.context.schedule.try_next(&|| self.context.waits()) {
            Ok(None | Some(Turn::Stop)) => return false,
            Ok(Some(turn)) => self.take(turn),
            Err(error) => self.context.fail(error),
        }
        true
    }

    /// Takes its turn: the job that is next.
    fn take(&mut self, turn: Turn) {
        self.computes.set(true);
        if turn.is_alone() {
            // Its memory belongs to the large file now.
            self.staff.dismiss();
        }
        match self.context.store.claim(&turn.filter(Sizes::of(&self.context.settings.now()))) {
            Ok(Some(claim)) => {
                crash_point("daemon.claimed");
                let job = claim.job.clone();
                self.finish(&claim, job, turn);
            }
            // Another slot was faster.
            Ok(None) => {}
            Err(error) => self.context.fail(error),
        }
        self.computed();
        self.context.schedule.done(turn);
    }

    /// The rest of its turn is waiting for the disk: another slot may compute.
    fn computed(&self) {
        if self.computes.take() {
            self.context.schedule.computed();
        }
    }

    /// Does what the job is owed until nothing is owed under this claim; the same after a crash as in normal work. Nothing is tried
    /// twice under one claim: what the world does not allow now is parked, or put back into the queue, with its reason.
    pub(crate) fn finish(&mut self, claim: &Claim, mut job: Job, turn: Turn) {
        let span = tracing::info_span!("job", job = job.id.0, file = %job.source.path);
        let _in_span = span.enter();
        let work = job.work.unwrap_or(claim.token);
        if let Some(folder) = self.context.folder(&job).filter(|_| work != claim.token) {
            look_anew(folder, &job);
        }
        while !matches!(job.duty(), Duty::Queue | Duty::Rest) {
            let next = match self.step(claim, &job, turn) {
                Err(PublishError::Store(error)) => Err(error),
                Err(error) => self.put_off(claim, &job, &error),
                Ok(next) => Ok(next),
            };
            match next {
                Ok(Some(next)) => job = next,
                // The claim is lost: someone else's job now.
                Ok(None) => return,
                Err(StoreError::Illegal { source, .. }) => {
                    tracing::warn!(reason = %source, "The job went another way meanwhile.");
                    return;
                }
                Err(error) => return self.context.fail(error),
            }
        }
        self.close(&job, work);
    }

    /// The world does not allow the next step. A job whose result is known keeps it and is parked; any other goes back into the queue.
    fn put_off(&self, claim: &Claim, job: &Job, error: &PublishError) -> Result<Option<Job>, StoreError> {
        let reason = error.to_string();
        let step = match (&job.state, error) {
            (State::Running { .. }, PublishError::Folder(_)) => Step::Wait { reason },
            // A name that could not be looked at, since its bucket does not answer.
            (State::Running { .. }, _) if self.context.folder(job).is_some_and(|folder| folder.bucket.is_some()) => {
                Step::Wait { reason }
            }
            (State::Running { .. }, PublishError::Io { source, .. }) if ErrorClass::of(source) == ErrorClass::Shortage => {
                Step::Wait { reason }
            }
            (State::Running { .. }, _) => Step::Environment { reason },
            (state, _) => Step::Park { reason, committed: self.committed.take() || matches!(state, State::Published { .. }) },
        };
        if let (State::Running { .. }, Some(folder)) = (&job.state, self.context.folder(job)) {
            let_go(folder, claim.token);
        }
        self.context.store.advance(claim, step).map(Some)
    }

    fn close(&self, job: &Job, work: suture_store::Token) {
        let Some(folder) = self.context.folder(job) else { return };
        if job.kind() == Kind::Parked {
            // Its result is in there.
            return;
        }
        if folder.check().is_ok() {
            remove_work(&folder.work(work));
        }
        crash_point("daemon.swept");
        match &job.state {
            State::Ended { publication } if !publication.ending.is_good() => self.context.not_good.store(true, Ordering::Relaxed),
            State::Queued { .. } => return self.context.schedule.news(),
            _ => {}
        }
        // The receiver outlives the slots; if not, no one needs to know.
        let (folder, path, id) = (job.source.folder.clone(), job.source.path.to_path(), job.id);
        let _ = self.context.events.send(Event::Ended { folder, path, id });
    }

    /// The next step; `None` when the claim is lost.
    fn step(&mut self, claim: &Claim, job: &Job, turn: Turn) -> Result<Option<Job>, PublishError> {
        let context = Arc::clone(&self.context);
        let Some(folder) = context.folder(job) else {
            return Err(PublishError::Folder(format!("the hot folder `{}` is not in the configuration", job.source.folder)));
        };
        // What is there, and what is missing, is believed of the right folder only.
        folder.check().map_err(PublishError::Folder)?;
        if job.duty() == Duty::Run {
            return self.attempt(folder, claim, job, turn);
        }
        self.computed();
        let desk = Desk::new(&*context.store, folder, claim, &self.committed);
        let next = match (job.duty(), &job.state) {
            (Duty::Stop, _) => context.store.advance(claim, Step::Cancelled)?,
            (Duty::Intend, State::Concluded { ending, reason, .. }) => {
                desk.intend(job, &Conclusion::None { ending: *ending, reason: reason.clone() })?
            }
            (Duty::Intend, State::Approved { publication, .. }) => desk.intend_approved(job, publication)?,
            (Duty::Place, _) => match &folder.bucket {
                None => desk.place(job)?,
                Some(shelf) => desk.place_in(shelf, job)?,
            },
            (Duty::MoveOriginal, _) => match &folder.bucket {
                None => desk.move_original(job)?,
                Some(shelf) => desk.move_in(shelf, job)?,
            },
            _ => return Ok(None),
        };
        Ok(Some(next))
    }

    /// Lets a worker loose on the file, and says what came of it.
    fn attempt(&mut self, folder: &Folder, token: &Claim, job: &Job, turn: Turn) -> Result<Option<Job>, PublishError> {
        let context = Arc::clone(&self.context);
        if self.is_for_another(job) {
            let began = context.world.steady();
            let next = context.store.advance(token, Step::HandOn)?;
            context.schedule.hand_on(began);
            return Ok(Some(next));
        }
        let work = folder.work(token.token);
        // The token is new: a folder of that name was left by the daemon of another store, which had the hot folder before.
        remove_work(&work);
        let step = match claim(folder, job, &work, context.world.room(&folder.root, 0)) {
            Err(Unclaimed::Withdrawn(why)) => Step::Withdrawn(why),
            Err(Unclaimed::Environment(reason)) => Step::Environment { reason },
            Err(Unclaimed::Shortage(reason)) => Step::Wait { reason },
            Ok(claimed) if is_carried(&job.source.path) => {
                crash_point("daemon.linked");
                match self.carry(folder, token, &claimed) {
                    Ok(content) => {
                        let desk = Desk::new(&*context.store, folder, token, &self.committed);
                        return desk.intend_carried(job, content, claimed.ctime_ns()).map(Some);
                    }
                    Err(step) => *step,
                }
            }
            Ok(claimed) => {
                crash_point("daemon.linked");
                let desk = Desk::new(&*context.store, folder, token, &self.committed);
                if let Some(barred) = desk.barred(job, None)? {
                    return desk.intend(job, &barred).map(Some);
                }
                let worked = self.work(folder, token, job, &claimed, turn);
                self.computed();
                match self.conclude(folder, token, job, claimed.ctime_ns(), worked)? {
                    Onward::Job(job) => return Ok(Some(*job)),
                    Onward::Step(step) => *step,
                    Onward::Lost => return Ok(None),
                }
            }
        };
        if matches!(step, Step::Withdrawn(_)) {
            // Of the right folder: where a mount is gone, the file is not to be seen, and has not changed.
            folder.check().map_err(PublishError::Folder)?;
        }
        let_go(folder, token.token);
        let next = context.store.advance(token, step)?;
        crash_point("daemon.given_back");
        self.tell_condemned(job, &next);
        Ok(Some(next))
    }

    fn work(&mut self, folder: &Folder, claim: &Claim, job: &Job, claimed: &Claimed, turn: Turn) -> Worked {
        let context = Arc::clone(&self.context);
        // This attempt's to its end, whatever is read meanwhile.
        let config = context.settings.now();
        // A setting that a person has to mend, or a machine that has no process to give, is no try of the file's.
        let profile = match choice::profile(&config, folder, job) {
            Ok(profile) => profile,
            Err(reason) => return Worked::Step(Step::Wait { reason }),
        };
        let settle = config.settle.unwrap_or(Rest::by_default(false, context.once).settle);
        let companions = match beside::of_job(&profile, (folder, job), &folder.work(claim.token), (context.world.wall(), settle))
        {
            Ok(companions) => companions,
            Err(reason) => return Worked::Step(Step::Wait { reason }),
        };
        if let Some(copied) = self.copied(&config, folder, claim, job, claimed, &profile) {
            return copied;
        }
        let limits = limits(&config, turn);
        let mut worker =
            match self.staff.worker(&*context.world, &limits, turn, job, folder, |work_root| context.is_away(work_root)) {
                Ok(worker) => worker,
                Err(error) => return Worked::Step(Step::Wait { reason: format!("a worker process cannot be started: {error}") }),
            };
        let request = request(folder, claim, job, (profile, companions), limits);
        let asked = Cell::new(context.world.steady());
        let lease = Cell::new(Lease::Held);
        let stop = || {
            let now = context.world.steady();
            if now.duration_since(asked.get()) >= ASK_EVERY {
                asked.set(now);
                // A store that fails here fails at the next step too, and is dealt with there.
                lease.set(brief(|| context.store.heartbeat(claim)).unwrap_or(Lease::Held));
            }
            lease.get() != Lease::Held || context.halted()
        };
        let limit = config.time_limit.of(job.source.size);
        tracing::debug!(worker = worker.pid(), attempt = job.attempts.0, "Work begins.");
        let ended = worker.run(&request, limit, &stop, &mut |course| context.bus.progress(job.id, course));
        crash_point("daemon.worked");
        self.staff.take_back(worker, &ended, turn);
        let changed = match claimed.is_unchanged() {
            Ok(unchanged) => !unchanged,
            Err(error) => {
                let reason = format!("the file cannot be looked at: {error}");
                return if lease.get() == Lease::Lost { Worked::Lost } else { Worked::Step(Step::Environment { reason }) };
            }
        };
        match ended {
            Ended::Stopped => self.stopped(folder, claim, lease.get()),
            Ended::Died(death) if !changed || !matches!(death.cause, Cause::Fault(_)) => Worked::died(&death, turn),
            _ if changed => Worked::Step(Step::Withdrawn(Withdrawal::Changed)),
            Ended::Done { report, written } => Worked::Report { report, written, reused: None },
            // The engine saw the time of the inode alone, which another machine changes that gives its second name of the file up.
            Ended::Failed { class: ErrorClass::Changed, .. } if folder.is_shared => Worked::Step(Step::HandBack),
            Ended::Failed { class, message } => Worked::failed(class, &message, &request.shown_input, turn),
            Ended::Died(death) => Worked::died(&death, turn),
        }
    }

    /// Has a copy of an earlier result instead, where there is one for this file; after a person's retry, for a comparison, or where it is forced, it is
    /// worked on in any case.
    fn copied(
        &self,
        config: &Config,
        folder: &Folder,
        claim: &Claim,
        job: &Job,
        claimed: &Claimed,
        profile: &Profile,
    ) -> Option<Worked> {
        let is_asked_for = job.retried.is_some() || job.witness.is_some() || is_forced(&job.source.path);
        if beside::has_any(profile) || !config.reuse || is_asked_for {
            return None;
        }
        let (context, work) = (&self.context, folder.work(claim.token));
        let sought = Sought { store: &*context.store, folders: &context.folders, job, profile };
        // A store that fails here fails at the next step too, and is dealt with there.
        let copied = sought.copy(&work.join(CLAIMED), &work.join(OUTPUT), &|| context.halted()).ok()??;
        Some(match claimed.is_unchanged() {
            Ok(true) => Worked::Report { report: copied.report, written: Some(copied.written), reused: Some(copied.from) },
            Ok(false) => Worked::Step(Step::Withdrawn(Withdrawal::Changed)),
            Err(error) => Worked::Step(Step::Environment { reason: format!("the file cannot be looked at: {error}") }),
        })
    }

    /// The worker was stopped: what that means for the job.
    fn stopped(&self, folder: &Folder, claim: &Claim, lease: Lease) -> Worked {
        if self.context.has_failed() {
            // The daemon ends for reasons of its own: the next one is not to suspect the file. Without the mark it runs alone.
            let _ = create::mark(&folder.work(claim.token).join(WITNESS));
            return Worked::Lost;
        }
        match lease {
            Lease::Cancel => Worked::Step(Step::Cancelled),
            Lease::Lost => Worked::Lost,
            Lease::Held => Worked::Step(Step::HandBack),
        }
    }
}

/// Another machine may have begun what this one goes on with.
fn look_anew(folder: &Folder, job: &Job) {
    for there in [&folder.work_root(), &folder.work(job.work_token()), fsx::folder_of(&folder.original(job))] {
        folder.look_anew(there);
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
