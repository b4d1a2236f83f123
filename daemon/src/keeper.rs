//! The thread that looks after the hot folders: it scans them when something happened or it is time, tells the store of files that came to
//! rest ([`crate::scan`]), and sees to it that there is room on the disk.

use std::collections::BTreeSet;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use crossbeam::channel::{Receiver, RecvTimeoutError};
use suture_store::{Control, Job, JobId, Role, Seen, StoreError, Submission, Submitted, crash_point};

use crate::attempt::{Context, Event};
use crate::event::Happening;
use crate::folder::Folder;
use crate::handed::{Handed, Untaken};
use crate::hints::{Watching, watcher};
use crate::orders::Orders;
use crate::past::each_job;
use crate::publish_error::PublishError;
use crate::scan::Reconciler;
use crate::sentinel::Answer;
use crate::settle::Rest;
use crate::signals::Stop;
use crate::taking::take;

mod farm;
pub(crate) mod intake;
mod news;
mod once;
mod reload;
mod room;
mod shared;

use news::{Nights, Told};

/// Full scans, where the system tells of changes and where it does not.
const RESCAN: Duration = Duration::from_secs(60);
const RESCAN_POLLED: Duration = Duration::from_secs(10);
/// A folder that is away is looked for this often.
const LOOK_FOR: Duration = Duration::from_secs(2);
/// Hints within this time are one.
const SCAN_AT_MOST_EVERY: Duration = Duration::from_millis(50);
/// How often the keeper looks about when nothing happens: for signals, and with `--once` for the end of all work.
const IDLE: Duration = Duration::from_millis(200);
const IDLE_ONCE: Duration = Duration::from_millis(20);

/// The thread that looks after the folders.
pub(crate) struct Keeper {
    context: Arc<Context>,
    inbox: Receiver<Event>,
    stop: Stop,
    folders: Vec<Kept>,
    handed: Vec<Handed>,
    disk_looked: Option<Instant>,
    farm_looked: Option<Instant>,
    /// The folders of which it told last that it looks for drops there.
    announced: Option<Vec<String>>,
    /// When it was asked which jobs of shared folders have ended, and how long that took.
    heard: Option<Instant>,
    hearing_takes: Duration,
    nights: Nights,
    /// It was within the hours of work at the last look.
    is_open: bool,
}

/// Has the daemon be ready for so many workers.
pub(crate) type Raise<'a> = &'a dyn Fn(usize) -> Result<(), StoreError>;

/// A folder under the keeper's eyes.
struct Kept {
    folder: Arc<Folder>,
    reconciler: Reconciler,
    orders: Orders,
    /// The system does not tell of changes.
    polled: bool,
    /// Keeps telling of changes, as long as it lives, of what `in/` stood for then.
    watching: Option<Watching>,
    watched: Option<(u64, u64, Option<SystemTime>)>,
    rescan: Duration,
    scanned: Option<Instant>,
    looked: Instant,
    dirty: bool,
    unavailable: bool,
    /// This daemon keeps it: it looks for drops, and does what one has to do alone.
    is_kept: bool,
    /// Of a shared one: when its lock was asked for last, and when it was cleared.
    asked: Option<Instant>,
    cleared: Option<Instant>,
    /// Ended jobs that answer for files which stay in `in/`.
    answering: BTreeSet<JobId>,
    /// It was said that another daemon keeps it.
    is_told: bool,
    told: Told,
    /// Files that were only noticed, and are gone.
    gone: Vec<JobId>,
    /// Names that were renamed into place since the last scan.
    renamed: Vec<PathBuf>,
    scan_takes: Duration,
}

impl Keeper {
    /// Begins to listen; `inbox` receives what the context's events are told.
    pub(crate) fn new(context: &Arc<Context>, inbox: Receiver<Event>, stop: &Stop) -> Self {
        let (mut folders, now) = (Vec::new(), context.world.steady());
        for folder in context.folders.iter().filter(|folder| folder.bucket.is_none()) {
            let (rest, rescan) = pace(context, false);
            let mut kept = Kept {
                folder: Arc::clone(folder),
                reconciler: Reconciler::new(Arc::clone(folder), Arc::clone(&context.settings), rest),
                orders: Orders::new(Arc::clone(folder), Arc::clone(&context.settings)),
                polled: false,
                watching: None,
                watched: None,
                rescan,
                scanned: None,
                looked: now,
                dirty: true,
                unavailable: false,
                is_kept: false,
                asked: None,
                cleared: None,
                answering: BTreeSet::new(),
                is_told: false,
                told: Told::default(),
                gone: Vec::new(),
                renamed: Vec::new(),
                scan_takes: Duration::ZERO,
            };
            if folder.check().is_ok() {
                kept.watch(context);
                tracing::info!(folder = %folder.root.display(), polled = kept.polled, "Serving a hot folder.");
            }
            folders.push(kept);
        }
        let (nights, context, stop) = (Nights::new(context), Arc::clone(context), stop.clone());
        Self {
            context,
            inbox,
            stop,
            folders,
            handed: Vec::new(),
            disk_looked: None,
            farm_looked: None,
            announced: None,
            heard: None,
            hearing_takes: Duration::ZERO,
            nights,
            is_open: true,
        }
    }

    /// Keeps the folders until there is a reason to end.
    ///
    /// # Errors
    /// When the store failed.
    pub(crate) fn keep(&mut self, raise: Raise) -> Result<(), StoreError> {
        self.begin(raise)?;
        while !self.is_over() && !self.pass(raise)? {
            self.listen(self.pause());
        }
        Ok(())
    }

    /// Takes up what an earlier life left in the folders.
    ///
    /// # Errors
    /// When the store failed.
    pub(crate) fn begin(&mut self, raise: Raise) -> Result<(), StoreError> {
        self.look_at_clock();
        raise(self.context.settings.now().workers)?;
        self.take_up(self.context.world.steady())?;
        if self.context.once {
            self.hasten_waiting()?;
        }
        Ok(())
    }

    /// Is there a reason to end?
    fn is_over(&self) -> bool {
        let stopped = self.stop.asked();
        if stopped {
            tracing::info!("Stopping: running jobs are finished, nothing new is taken.");
        }
        stopped || self.context.has_failed()
    }

    /// Looks at everything once. Returns whether nothing comes any more, with `--once`.
    ///
    /// # Errors
    /// When the store failed.
    pub(crate) fn pass(&mut self, raise: Raise) -> Result<bool, StoreError> {
        if let Some(reload) = self.context.settings.renew() {
            self.go_by(reload)?;
            raise(self.context.settings.now().workers)?;
            self.context.pulse.reloaded();
        }
        for handed in std::mem::take(&mut self.handed) {
            let Some(kept) = self.folders.iter_mut().find(|kept| kept.folder.name == handed.folder) else { continue };
            if !kept.is_kept {
                handed.answer(Err(Untaken::Unavailable("another daemon looks for drops in this folder".into())));
            } else if kept.folder.answers() != Answer::Yes {
                let why = kept.folder.silence().unwrap_or_else(|| "the folder is slow to answer; try again".into());
                handed.answer(Err(Untaken::Unavailable(why)));
            } else {
                take(&self.context, &mut kept.reconciler, &mut kept.orders, handed)?;
            }
        }
        let now = self.context.world.steady();
        self.context.pulse.beat();
        self.look_at_disk(now)?;
        self.look_at_clock();
        self.look_at_farm(now)?;
        if self.context.has(Role::Control) {
            self.nights.look(&self.context, now)?;
        }
        self.take_up(now)?;
        for kept in &mut self.folders {
            kept.turn(&self.context, now)?;
        }
        let finished = self.context.once && self.is_finished()?;
        if finished {
            self.folders.iter_mut().try_for_each(|kept| kept.sum_up(&self.context, now, Duration::ZERO))?;
        }
        Ok(finished)
    }

    /// How long it may wait for the next thing to do.
    fn pause(&self) -> Duration {
        let settling = self.folders.iter().filter(|kept| kept.reconciler.is_settling());
        let looks = settling.map(|kept| kept.reconciler.rest.look_every());
        let scan = self.folders.iter().filter(|kept| kept.dirty).map(Kept::scan_at_most_every);
        let idle = if self.context.once { IDLE_ONCE } else { IDLE };
        looks.chain(scan).min().unwrap_or(idle).min(idle)
    }

    /// Waits for the next thing to do, at most so long, and takes in what was heard.
    pub(crate) fn listen(&mut self, wait: Duration) {
        let mut next = self.inbox.recv_timeout(wait);
        loop {
            match next {
                Ok(Event::Hint { renamed }) => {
                    for kept in &mut self.folders {
                        kept.hint(&renamed);
                    }
                }
                Ok(Event::Ended { folder, path, id }) => {
                    if let Some(kept) = self.folders.iter_mut().find(|kept| kept.folder.name == folder && kept.is_kept) {
                        kept.reconciler.ended(&path);
                        kept.orders.ended(&path, id, self.context.world.steady());
                        kept.dirty = true;
                    }
                }
                Ok(Event::Handed(handed)) => self.handed.push(handed),
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => return,
            }
            next = self.inbox.try_recv().map_err(|_| RecvTimeoutError::Timeout);
        }
    }

    /// As many slots work as there are to be workers; outside of the hours of work few, or none.
    fn look_at_clock(&mut self) {
        let config = self.context.settings.now();
        let is_open = config.run_window.is_open(&|| self.context.world.local());
        let workers = if is_open { config.workers } else { config.workers_outside };
        self.context.schedule.limit(workers);
        if std::mem::replace(&mut self.is_open, is_open) != is_open {
            let run_window = config.run_window.to_string();
            tracing::info!(run_window, workers, "The hours of work begin or end; jobs in work are finished.");
        }
    }
}

impl Kept {
    fn hint(&mut self, renamed: &[PathBuf]) {
        self.dirty = true;
        let inbox = self.folder.inbox();
        self.renamed.extend(renamed.iter().filter(|path| path.starts_with(&inbox)).cloned());
    }

    /// The shortest time between two scans: ten times what one takes, so that a full folder in which much happens is not read
    /// again and again.
    fn scan_at_most_every(&self) -> Duration {
        SCAN_AT_MOST_EVERY.max(self.scan_takes * 10)
    }

    /// Has the system tell of changes in `in/`, as it is now, and of another one that takes its place.
    fn watch(&mut self, context: &Context) {
        let inbox = self.folder.inbox();
        // A number of an inode is soon given again.
        let there = std::fs::metadata(&inbox).ok().map(|found| (found.dev(), found.ino(), found.created().ok()));
        if self.watched.is_some() && self.watched == there {
            return;
        }
        (self.watched, self.watching, self.polled) = (there, None, !context.world.tells_of(&inbox));
        if !self.polled {
            match watcher(&self.folder, context.events.clone()) {
                Ok(watching) => self.watching = Some(watching),
                Err(error) => {
                    tracing::warn!(folder = %self.folder.root.display(), %error, "The system does not tell of changes; polling.");
                    self.polled = true;
                }
            }
        }
        (self.reconciler.rest, self.rescan) = pace(context, self.polled);
    }

    /// A job of an earlier life, if it is of this folder.
    fn remember(&mut self, job: &Job, now: Instant) {
        if job.source.folder == self.folder.name {
            self.orders.remember(job, now);
            if job.kind().is_at_rest() && job.answers_for_source() {
                self.reconciler.known(&job.source, job.id, None);
            }
        }
    }

    /// Reads what earlier stores left, in a folder that was away when the daemon began.
    fn recall(&mut self, context: &Context, now: Instant) -> Result<(), PublishError> {
        if context.unread.read(&*context.store, &self.folder, &context.bus)? > 0 {
            each_job(&*context.store, &mut |job| self.remember(job, now))?;
            context.schedule.news();
        }
        Ok(())
    }

    fn scan(&mut self, context: &Context, now: Instant) -> Result<(), StoreError> {
        let mut here = self.folder.check().or_else(|_| self.folder.regain());
        if !self.is_kept {
            return self.visit(context, now, here);
        }
        if here.is_ok() {
            here = match self.recall(context, now) {
                Err(PublishError::Store(error)) => return Err(error),
                read => read.map_err(|error| error.to_string()),
            };
        }
        let found = here.and_then(|()| self.reconciler.scan(now).map_err(|error| self.unreadable(&error)));
        let gone = match found {
            Ok(gone) => gone,
            Err(error) => return self.tell_away(context, now, error),
        };
        self.looked_at(context, now, self.reconciler.left_out());
        self.is_back(context);
        self.gone.extend(gone);
        self.watch(context);
        self.told.tell(context, &self.folder.name, None)
    }

    fn is_back(&mut self, context: &Context) {
        if std::mem::take(&mut self.unavailable) {
            let (name, root) = (&self.folder.name, &self.folder.root);
            context.bus.tell(&Happening::FolderBack { name, root });
        }
    }

    /// The folder is out of reach for this reason.
    fn tell_away(&mut self, context: &Context, now: Instant, why: String) -> Result<(), StoreError> {
        self.watched = None;
        if !std::mem::replace(&mut self.unavailable, true) {
            let (name, root) = (&self.folder.name, &self.folder.root);
            context.bus.tell(&Happening::FolderAway { name, root, why: &why });
        }
        if self.is_kept {
            self.told.tell(context, &self.folder.name, Some(&why))?;
        }
        self.looked_at(context, now, vec![why]);
        Ok(())
    }

    /// It was looked at from `now` on; `away` of it is out of reach.
    fn looked_at(&self, context: &Context, now: Instant, away: Vec<String>) {
        self.show_away(context, away);
        context.pulse.scanned(&self.folder.name, context.world.steady().duration_since(now));
    }

    /// `away` of it is out of reach, or waits.
    fn show_away(&self, context: &Context, away: Vec<String>) {
        context.away.lock().unwrap_or_else(PoisonError::into_inner).insert(self.folder.name.clone(), away);
    }

    fn unreadable(&self, error: &io::Error) -> String {
        format!("{}: cannot be read: {error}", self.folder.inbox().display())
    }

    /// Sums up the orders that are done, and of which nothing changed for `rest`.
    fn sum_up(&mut self, context: &Context, now: Instant, rest: Duration) -> Result<(), StoreError> {
        let reconciler = &self.reconciler;
        self.orders.sum_up(&*context.store, now, rest, &|order| reconciler.is_settling_below(order))
    }

    /// Scans and looks, as far as either is due.
    fn turn(&mut self, context: &Context, now: Instant) -> Result<(), StoreError> {
        match self.folder.answers() {
            Answer::Yes => {}
            // The other folders wait for no slow one.
            Answer::NotYet => return Ok(()),
            Answer::Silent => {
                // Looked at in full once it answers.
                self.dirty = true;
                let why = self.folder.silent();
                return self.tell_away(context, now, why);
            }
        }
        let since = self.scanned.map(|then| now.duration_since(then));
        let rescan = if self.unavailable { self.rescan.min(LOOK_FOR) } else { self.rescan };
        let due = since.is_none_or(|since| since >= rescan || (self.dirty && since >= self.scan_at_most_every()));
        if due {
            self.scanned = Some(now);
            self.dirty = false;
            self.scan(context, now)?;
            self.scan_takes = context.world.steady().duration_since(now);
            if !self.renamed.is_empty() {
                // Known now, so that it can count; and to be looked at at once.
                self.reconciler.came_whole(&std::mem::take(&mut self.renamed));
                self.looked = now.checked_sub(self.reconciler.rest.look_every()).unwrap_or(self.looked);
            }
        }
        for id in self.gone.drain(..) {
            control(context, id, Control::Forget)?;
        }
        self.sum_up(context, now, self.reconciler.rest.settle)?;
        if now.duration_since(self.looked) < self.reconciler.rest.look_every() {
            return Ok(());
        }
        self.looked = now;
        let ready = self.reconciler.look(now);
        if self.reconciler.have_waits_changed() {
            self.show_away(context, self.reconciler.left_out());
        }
        if ready.is_empty() { Ok(()) } else { self.submit(context, now, ready) }
    }

    /// Has jobs made of files that came to rest.
    fn submit(&mut self, context: &Context, now: Instant, ready: Vec<(PathBuf, Submission)>) -> Result<(), StoreError> {
        let (paths, found): (Vec<_>, Vec<_>) = ready.into_iter().unzip();
        match context.store.submit(&found) {
            Ok(submitted) => {
                crash_point("daemon.submitted");
                self.answered(context, now, paths, found, submitted)?;
            }
            Err(StoreError::TooLong { .. }) => {
                // One by one, to find out which.
                for (path, submission) in paths.into_iter().zip(found) {
                    match context.store.submit(std::slice::from_ref(&submission)) {
                        Ok(answer) => self.answered(context, now, vec![path], vec![submission], answer)?,
                        Err(error) if error.is_callers() => self.reconciler.refused(&path, &error.to_string()),
                        Err(error) => return Err(error),
                    }
                }
            }
            Err(error) => return Err(error),
        }
        context.schedule.news();
        Ok(())
    }

    /// Of a file that a worker on another machine moved while it was looked at no second job is made: it is new only if it is still there.
    fn answered(
        &mut self,
        context: &Context,
        now: Instant,
        paths: Vec<PathBuf>,
        found: Vec<Submission>,
        answers: Vec<Submitted>,
    ) -> Result<(), StoreError> {
        let mut again = Vec::new();
        for ((path, submission), answer) in paths.into_iter().zip(found).zip(answers) {
            if answer.ended {
                again.push((path, Submission { seen: Seen::After(Some(answer.id)), ..submission }));
            } else {
                self.orders.came(&submission.source.path, answer.id, now);
                self.reconciler.submitted(&path, &submission, answer);
            }
        }
        let again = self.reconciler.there_still(again);
        if again.is_empty() { Ok(()) } else { self.submit(context, now, again) }
    }
}

/// How long a file must rest in a folder, and the time between full scans.
fn pace(context: &Context, polled: bool) -> (Rest, Duration) {
    let config = context.settings.now();
    let rest = config.settle.map_or(Rest::by_default(polled, context.once), |settle| Rest { settle });
    (rest, config.rescan.unwrap_or(if polled { RESCAN_POLLED } else { RESCAN }))
}

fn control(context: &Context, id: JobId, wish: Control) -> Result<(), StoreError> {
    match context.store.control(id, wish) {
        Err(error) if !error.is_callers() => Err(error),
        // An operator was faster.
        _ => Ok(()),
    }
}
