//! The daemon: `suture watch`. One thread looks after the folders ([`crate::scan`]), as many as there are workers bring jobs
//! through ([`crate::attempt`]), one a folder answers `suture jobs` ([`crate::control`]).
//!
//! A *life* begins with the store's recovery and ends with a signal, with the end of all work (`--once`), or with an error of the
//! store; after the last the program begins anew ([`crate::again`]).

use std::mem::ManuallyDrop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{Builder, ScopedJoinHandle};
use std::time::{Duration, Instant};

use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, unbounded};
use notify::event::{EventKind, ModifyKind, RenameMode};
use notify::{RecursiveMode, Watcher};
use suture_store::job::{Area, Kind, Testimony};
use suture_store::{Control, JobStore, Query, SledStore, StoreError, crash_point};

use crate::again::Lives;
use crate::attempt::{Context, Event, IN_HAND, Slot, WITNESS, remove_work};
use crate::cli::WatchArgs;
use crate::config::{Config, default_state};
use crate::control::Door;
use crate::create;
use crate::exit::Exit;
use crate::folder::{Folder, FolderError, is_fading};
use crate::fsx;
use crate::say::complain;
use crate::scan::Reconciler;
use crate::schedule::{Schedule, Turn};
use crate::settle::Rest;
use crate::signals::Stop;
use crate::watchdog;

/// Full scans, where the system tells of changes and where it does not.
const RESCAN: Duration = Duration::from_secs(60);
const RESCAN_POLLED: Duration = Duration::from_secs(10);
/// Hints within this time are one.
const SCAN_AT_MOST_EVERY: Duration = Duration::from_millis(50);
/// How often the keeper looks about when nothing happens: for signals, and with `--once` for the end of all work.
const IDLE: Duration = Duration::from_millis(200);
const IDLE_ONCE: Duration = Duration::from_millis(20);
/// Free space is looked at this often.
const DISK_EVERY: Duration = Duration::from_secs(5);
/// With `--once`, a result that cannot be brought into place is tried so often before it is left for the next run.
const TRIES_ONCE: u32 = 4;

/// Runs the daemon to its end.
pub(crate) fn run(args: &WatchArgs) -> Exit {
    let config = match Config::from_args(args) {
        Ok(config) => config,
        Err(line) => {
            complain(&line);
            return Exit::Refused;
        }
    };
    let stop = match Stop::listen() {
        Ok(stop) => stop,
        Err(error) => {
            complain(&format_args!("cannot listen for signals: {error}"));
            return Exit::of_start(&error);
        }
    };
    serve(config, args.once, &stop, true)
}

/// The same for a configuration at hand. `may_begin_anew`: after an error of the store the program may begin anew, with the arguments it
/// was started with.
pub(crate) fn serve(config: Config, once: bool, stop: &Stop, may_begin_anew: bool) -> Exit {
    let mut folders = Vec::new();
    for folder in &config.folders {
        match Folder::open(folder) {
            Ok(folder) => folders.push(Arc::new(folder)),
            Err(error) => {
                complain(&error);
                return match &error {
                    FolderError::Owned { .. } => Exit::Owned,
                    FolderError::Io { source, .. } => Exit::of_start(source),
                };
            }
        }
    }
    let (lives, not_good) = (Lives::so_far(), Arc::<AtomicBool>::default());
    if may_begin_anew {
        watchdog::start(lives, Arc::clone(&not_good), stop.clone());
    }
    let asked = Instant::now();
    let store = loop {
        match SledStore::open(&config.state) {
            Ok(store) => break Arc::new(store),
            Err(StoreError::Locked { pid, .. }) if is_fading(pid, asked) => std::thread::sleep(Duration::from_millis(10)),
            Err(error) => return store_failed(&error),
        }
    };
    note_state(&config, &folders);
    let daemon = Daemon { config: Arc::new(config), folders, store, once, lives, not_good, stop: stop.clone(), may_begin_anew };
    daemon.run()
}

fn store_failed(error: &StoreError) -> Exit {
    complain(&error);
    match error.exit_code() {
        73 => Exit::Owned,
        _ => Exit::TryAgain,
    }
}

/// Tells `suture jobs` where the store is, if it is not where it would look.
fn note_state(config: &Config, folders: &[Arc<Folder>]) {
    for folder in folders {
        let note = folder.root.join(".suture").join("state-path");
        let state = std::path::absolute(&config.state).unwrap_or_else(|_| config.state.clone());
        let result = if state == default_state(&folder.root) {
            fsx::remove_if_there(&note)
        } else {
            create::replace(&note, state.as_os_str().as_encoded_bytes())
        };
        if let Err(error) = result {
            tracing::warn!(%error, file = %note.display(), "The place of the job store could not be noted.");
        }
    }
}

struct Daemon {
    config: Arc<Config>,
    folders: Vec<Arc<Folder>>,
    store: Arc<SledStore>,
    once: bool,
    lives: Lives,
    /// A job ended not good, in any life.
    not_good: Arc<AtomicBool>,
    stop: Stop,
    /// The process is the daemon and nothing else.
    may_begin_anew: bool,
}

/// How a life ended.
enum End {
    /// By a signal, or because all work is done.
    Rest,
    /// The store failed.
    Store(StoreError),
}

impl Daemon {
    fn run(&self) -> Exit {
        let (lives, born) = (self.lives, Instant::now());
        match self.live() {
            End::Rest if self.once && (lives.not_good || self.not_good.load(Ordering::Relaxed)) => Exit::NotGood,
            End::Rest => Exit::Good,
            End::Store(error) => {
                tracing::error!(%error, "The job store failed.");
                if self.may_begin_anew {
                    lives.begin_another(born.elapsed(), self.not_good.load(Ordering::Relaxed), &|| self.stop.asked());
                }
                store_failed(&error)
            }
        }
    }

    fn live(&self) -> End {
        let (events, inbox) = unbounded();
        let context = Context {
            store: Arc::clone(&self.store) as Arc<dyn JobStore>,
            folders: self.folders.clone(),
            config: Arc::clone(&self.config),
            schedule: Schedule::new(),
            events: events.clone(),
            once: self.once,
            halt: AtomicBool::new(false),
            not_good: Arc::clone(&self.not_good),
            failed: Mutex::new(None),
        };
        if let Err(error) = guarded(|| recover(&context)) {
            return End::Store(error);
        }
        let mut keeper = Keeper::new(&context, events, inbox, &self.stop);
        let ended = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let threads = self.start(scope, &context, &ended);
            let kept = threads.and_then(|slots| guarded(|| keeper.keep()).map(|()| slots));
            context.schedule.stop();
            match kept {
                Ok(slots) => self.drain(&context, &slots),
                Err(error) => context.fail(error),
            }
            ended.store(true, Ordering::Relaxed);
        });
        let failed = context.failed.lock().map_or_else(|poisoned| poisoned.into_inner().take(), |mut failed| failed.take());
        match failed {
            Some(error) => End::Store(error),
            None => End::Rest,
        }
    }
}

impl Daemon {
    /// Starts the threads that work on jobs, and one a folder that answers `suture jobs`.
    fn start<'s>(
        &'s self,
        scope: &'s std::thread::Scope<'s, '_>,
        context: &'s Context,
        ended: &'s AtomicBool,
    ) -> Result<Vec<ScopedJoinHandle<'s, ()>>, StoreError> {
        let thread = |name: &str| Builder::new().name(name.into());
        let failed = |source| StoreError::Io { path: "thread".into(), action: "starting one", source };
        for folder in &self.folders {
            match Door::open(&folder.root) {
                Ok(door) => {
                    let serve = move || {
                        let served = guarded(|| {
                            door.serve(context, &|| ended.load(Ordering::Relaxed));
                            Ok(())
                        });
                        served.unwrap_or_else(|error| context.fail(error));
                    };
                    thread("door").spawn_scoped(scope, serve).map(drop).map_err(failed)?;
                }
                Err(error) => tracing::warn!(%error, "`suture jobs` cannot reach this daemon."),
            }
        }
        let slot = || {
            let worked = guarded(|| {
                Slot::new(context).run();
                Ok(())
            });
            // The job in work is taken up by the next life.
            worked.unwrap_or_else(|error| context.fail(error));
        };
        (0..self.config.workers).map(|_| thread("slot").spawn_scoped(scope, slot).map_err(failed)).collect()
    }

    /// Lets running jobs finish, for as long as they are given.
    fn drain(&self, context: &Context, slots: &[ScopedJoinHandle<()>]) {
        let deadline = Instant::now() + self.config.drain;
        while slots.iter().any(|slot| !slot.is_finished()) {
            if Instant::now() >= deadline && !context.halt.swap(true, Ordering::Relaxed) {
                tracing::warn!("The time to finish running jobs is over; they go back into the queue.");
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

/// A thread that ends in a panic, for want of another thread or by a defect, must not leave the others waiting: the daemon ends with it,
/// and begins anew.
fn guarded(work: impl FnOnce() -> Result<(), StoreError>) -> Result<(), StoreError> {
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|_| Err(StoreError::Poisoned { reason: "a thread of the daemon ended in an internal error".into() }))
}

/// Takes up what an earlier life left, and clears its work folders away.
fn recover(context: &Context) -> Result<(), StoreError> {
    let folder = |name: &str| context.folders.iter().find(|folder| folder.name == name);
    let testimony = |job: &suture_store::Job| {
        let work = job.work.and_then(|work| Some(folder(&job.source.folder)?.work(work)));
        let there = |name: &str| work.as_ref().is_some_and(|work| fsx::exists(&work.join(name)).unwrap_or(false));
        match () {
            () if there(IN_HAND) => Testimony::InHand,
            () if there(WITNESS) => Testimony::Outlived,
            () => Testimony::None,
        }
    };
    let recovered = context.store.recover(&testimony)?;
    crash_point("daemon.recovered");
    if !recovered.is_empty() {
        tracing::info!(jobs = recovered.len(), "The daemon ended without finishing; its jobs go on.");
    }
    let mut slot = Slot::new(context);
    for found in recovered {
        if let Some(claim) = found.claim {
            slot.finish(&claim, found.job, Turn::Alone);
        }
        if context.failed.lock().is_ok_and(|failed| failed.is_some()) {
            return Ok(());
        }
    }
    let held: Vec<_> = context
        .store
        .list(&Query {
            kinds: Kind::ALL.into_iter().filter(|kind| kind.is_held() || *kind == Kind::Parked).collect(),
            ..Query::default()
        })?
        .iter()
        .filter_map(|job| job.work.map(|token| token.to_string()))
        .collect();
    for folder in &context.folders {
        // Without jobs under claim, every folder in there is a left-over.
        for entry in std::fs::read_dir(folder.work_root()).into_iter().flatten().flatten() {
            if !held.iter().any(|token| entry.file_name().to_str() == Some(token)) {
                remove_work(&entry.path());
            }
        }
    }
    Ok(())
}

/// The thread that looks after the folders.
struct Keeper<'a> {
    context: &'a Context,
    inbox: Receiver<Event>,
    stop: &'a Stop,
    folders: Vec<Kept>,
    /// Keeps telling of changes as long as it lives.
    _watchers: Vec<Watching>,
    disk_looked: Option<Instant>,
}

/// Tells of changes until the process ends.
type Watching = ManuallyDrop<notify::RecommendedWatcher>;

/// A folder under the keeper's eyes.
struct Kept {
    folder: Arc<Folder>,
    reconciler: Reconciler,
    rest: Rest,
    rescan: Duration,
    scanned: Option<Instant>,
    looked: Instant,
    dirty: bool,
    unavailable: bool,
    /// Files that were only noticed, and are gone.
    gone: Vec<suture_store::JobId>,
    /// Names that were renamed into place since the last scan.
    renamed: Vec<PathBuf>,
    scan_takes: Duration,
}

impl<'a> Keeper<'a> {
    fn new(context: &'a Context, events: Sender<Event>, inbox: Receiver<Event>, stop: &'a Stop) -> Self {
        let mut watchers = Vec::new();
        let mut folders = Vec::new();
        for folder in &context.folders {
            let mut polled = fsx::needs_polling(&folder.inbox());
            if !polled {
                match watcher(&folder.inbox(), events.clone()) {
                    Ok(watcher) => watchers.push(watcher),
                    Err(error) => {
                        tracing::warn!(folder = %folder.root.display(), %error, "The system does not tell of changes; polling.");
                        polled = true;
                    }
                }
            }
            let default = Rest::by_default(polled, context.once);
            let rest = context.config.settle.map_or(default, |settle| Rest { settle });
            let rescan = context.config.rescan.unwrap_or(if polled { RESCAN_POLLED } else { RESCAN });
            tracing::info!(folder = %folder.root.display(), polled, "Serving a hot folder.");
            folders.push(Kept {
                folder: Arc::clone(folder),
                reconciler: Reconciler::new(Arc::clone(folder), Arc::clone(&context.config), rest),
                rest,
                rescan,
                scanned: None,
                looked: Instant::now(),
                dirty: true,
                unavailable: false,
                gone: Vec::new(),
                renamed: Vec::new(),
                scan_takes: Duration::ZERO,
            });
        }
        Self { context, inbox, stop, folders, _watchers: watchers, disk_looked: None }
    }

    /// Keeps the folders until there is a reason to end.
    fn keep(&mut self) -> Result<(), StoreError> {
        self.remember_live()?;
        self.forget_noticed()?;
        loop {
            if self.stop.asked() {
                tracing::info!("Stopping: running jobs are finished, nothing new is taken.");
                return Ok(());
            }
            if self.context.failed.lock().is_ok_and(|failed| failed.is_some()) {
                return Ok(());
            }
            let now = Instant::now();
            self.look_at_disk(now)?;
            for kept in &mut self.folders {
                kept.turn(self.context, now)?;
            }
            if self.context.once && self.is_finished()? {
                return Ok(());
            }
            self.listen();
        }
    }

    /// Waits for the next thing to do, and takes in what was heard.
    fn listen(&mut self) {
        let settling = self.folders.iter().filter(|kept| kept.reconciler.is_settling());
        let looks = settling.map(|kept| kept.rest.look_every());
        let scan = self.folders.iter().filter(|kept| kept.dirty).map(Kept::scan_at_most_every);
        let idle = if self.context.once { IDLE_ONCE } else { IDLE };
        let wait = looks.chain(scan).min().unwrap_or(idle).min(idle);
        let mut next = self.inbox.recv_timeout(wait);
        loop {
            match next {
                Ok(Event::Hint { renamed }) => {
                    for kept in &mut self.folders {
                        kept.hint(&renamed);
                    }
                }
                Ok(Event::Ended { folder, path }) => {
                    if let Some(kept) = self.folders.iter_mut().find(|kept| kept.folder.name == folder) {
                        kept.reconciler.ended(&path);
                        kept.dirty = true;
                    }
                }
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => return,
            }
            next = self.inbox.try_recv().map_err(|_| RecvTimeoutError::Timeout);
        }
    }

    /// With `--once`: is everything that came to rest finished?
    fn is_finished(&self) -> Result<bool, StoreError> {
        let folders_rest = self.folders.iter().all(|kept| !kept.dirty && (kept.unavailable || !kept.reconciler.is_settling()));
        if !folders_rest || !self.inbox.is_empty() || self.context.schedule.busy() > 0 {
            return Ok(false);
        }
        let counts = self.context.store.counts()?;
        let of = |wanted: fn(Kind) -> bool| counts.iter().filter(|(kind, _)| wanted(*kind)).map(|(_, n)| n).sum::<u64>();
        if of(|kind| matches!(kind, Kind::Queued | Kind::Alone)) > 0 && !self.context.schedule.is_paused() {
            return Ok(false);
        }
        if of(|kind| kind == Kind::Parked) > 0 {
            let parked = self.context.store.list(&Query { kinds: vec![Kind::Parked], ..Query::default() })?;
            if parked.iter().any(|job| job.parked.is_some_and(|parked| parked.tries < TRIES_ONCE)) {
                return Ok(false);
            }
        }
        let waiting = of(Kind::is_live);
        if waiting > 0 || self.folders.iter().any(|kept| kept.unavailable) {
            tracing::warn!(
                jobs = waiting,
                "Some work is left for the next run: jobs that wait after errors, a full disk, or folders out of reach."
            );
            self.context.not_good.store(true, Ordering::Relaxed);
        }
        Ok(true)
    }

    /// Jobs of an earlier life whose files still wait in `in/`.
    fn remember_live(&mut self) -> Result<(), StoreError> {
        let kinds = Kind::ALL.into_iter().filter(|kind| kind.is_live()).collect();
        for job in self.context.store.list(&Query { kinds, ..Query::default() })? {
            if let Some(kept) = self.folders.iter_mut().find(|kept| kept.folder.name == job.source.folder)
                && job.original().0 == Area::In
            {
                kept.reconciler.known(&job.source, job.id);
            }
        }
        Ok(())
    }

    /// Files that were noticed in an earlier life and are gone now.
    fn forget_noticed(&self) -> Result<(), StoreError> {
        for job in self.context.store.list(&Query { kinds: vec![Kind::Noticed], ..Query::default() })? {
            if let Some(kept) = self.folders.iter().find(|kept| kept.folder.name == job.source.folder)
                && kept.folder.check().is_ok()
                && kept.folder.inbox().is_dir()
                && fsx::exists(&kept.folder.inbox().join(job.source.path.to_path())).is_ok_and(|there| !there)
            {
                forget(self.context, job.id)?;
            }
        }
        Ok(())
    }

    /// Takes nothing new while the disk is nearly full: a result needs room, and a half-full night is better than a broken one.
    fn look_at_disk(&mut self, now: Instant) -> Result<(), StoreError> {
        if self.disk_looked.is_some_and(|then| now.duration_since(then) < DISK_EVERY) {
            return Ok(());
        }
        let first = self.disk_looked.is_none();
        self.disk_looked = Some(now);
        self.context.store.check()?;
        let reserve = self.context.config.reserve;
        let full = self.folders.iter().find(|kept| fsx::free_space(&kept.folder.root, reserve) == 0);
        if self.context.schedule.pause(full.is_some()) != full.is_some() || (first && full.is_some()) {
            match full {
                Some(kept) => {
                    let folder = kept.folder.root.display();
                    tracing::warn!(%folder, "The disk is nearly full; nothing new is taken.");
                }
                None => tracing::info!("There is room on the disk again."),
            }
        }
        Ok(())
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

    fn scan(&mut self, now: Instant) {
        let found = self.folder.check().and_then(|()| self.reconciler.scan(now).map_err(|error| error.to_string()));
        match found {
            Ok(gone) => {
                if std::mem::take(&mut self.unavailable) {
                    tracing::info!(folder = %self.folder.root.display(), "The folder is back.");
                }
                self.gone.extend(gone);
            }
            Err(error) => {
                if !std::mem::replace(&mut self.unavailable, true) {
                    tracing::error!(folder = %self.folder.root.display(), error, "The folder cannot be served; the others go on.");
                }
            }
        }
    }

    /// Scans and looks, as far as either is due.
    fn turn(&mut self, context: &Context, now: Instant) -> Result<(), StoreError> {
        let since = self.scanned.map(|then| now.duration_since(then));
        let due = since.is_none_or(|since| since >= self.rescan || (self.dirty && since >= self.scan_at_most_every()));
        if due {
            self.scanned = Some(now);
            self.dirty = false;
            self.scan(now);
            self.scan_takes = now.elapsed();
            if !self.renamed.is_empty() {
                // Known now, so that it can count; and to be looked at at once.
                self.reconciler.came_whole(&std::mem::take(&mut self.renamed));
                self.looked = now.checked_sub(self.rest.look_every()).unwrap_or(self.looked);
            }
        }
        for id in self.gone.drain(..) {
            forget(context, id)?;
        }
        if now.duration_since(self.looked) < self.rest.look_every() {
            return Ok(());
        }
        self.looked = now;
        let ready = self.reconciler.look(now);
        if ready.is_empty() {
            return Ok(());
        }
        let (paths, found): (Vec<_>, Vec<_>) = ready.into_iter().unzip();
        match context.store.submit(&found) {
            Ok(submitted) => {
                crash_point("daemon.submitted");
                for ((path, submission), answer) in paths.iter().zip(&found).zip(submitted) {
                    if let (Some(what), true) = (&submission.foreign, answer.new) {
                        tracing::info!(job = answer.id.0, file = %submission.source.path, what, "Left where it is.");
                    }
                    self.reconciler.submitted(path, submission, answer.id);
                }
            }
            Err(StoreError::TooLong { .. }) => {
                // One by one, to find out which.
                for (path, submission) in paths.iter().zip(&found) {
                    match context.store.submit(std::slice::from_ref(submission)) {
                        Ok(answer) => {
                            for answer in answer {
                                self.reconciler.submitted(path, submission, answer.id);
                            }
                        }
                        Err(error) if error.is_callers() => self.reconciler.refused(path, &error.to_string()),
                        Err(error) => return Err(error),
                    }
                }
            }
            Err(error) => return Err(error),
        }
        context.schedule.news();
        Ok(())
    }
}

fn forget(context: &Context, id: suture_store::JobId) -> Result<(), StoreError> {
    match context.store.control(id, Control::Forget) {
        Err(error) if !error.is_callers() => Err(error),
        // An operator was faster.
        _ => Ok(()),
    }
}

/// Passes on that something happened, and which names were renamed into place.
fn watcher(inbox: &Path, events: Sender<Event>) -> notify::Result<Watching> {
    let mut watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
        let hint = match event {
            Ok(event) if matches!(event.kind, EventKind::Access(_)) => return,
            Ok(event) => match event.kind {
                EventKind::Modify(ModifyKind::Name(RenameMode::To)) => Event::Hint { renamed: event.paths },
                EventKind::Modify(ModifyKind::Name(RenameMode::Both)) => {
                    Event::Hint { renamed: event.paths.into_iter().skip(1).collect() }
                }
                _ => Event::Hint { renamed: Vec::new() },
            },
            // Lost events and the like: look for oneself.
            Err(_) => Event::Hint { renamed: Vec::new() },
        };
        // The daemon is ending.
        let _ = events.send(hint);
    })?;
    // notify 8.2 says nothing where its thread cannot start, and panics at the next word, and again when it is dropped: it is asked
    // something harmless first, and never dropped (the process ends with it).
    let watching = catch_unwind(AssertUnwindSafe(|| {
        watcher.configure(notify::Config::default())?;
        watcher.watch(inbox, RecursiveMode::Recursive)
    }));
    let watcher = ManuallyDrop::new(watcher);
    watching.unwrap_or_else(|_| Err(notify::Error::generic("its thread could not start"))).map(|()| watcher)
}
