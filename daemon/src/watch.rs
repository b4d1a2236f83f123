//! The daemon: `suture watch`. One thread looks after the folders ([`crate::keeper`]), as many as there are workers bring jobs
//! through ([`crate::attempt`]), one a folder answers `suture jobs` ([`crate::control`]).
//!
//! A *life* begins with the store's recovery and ends with a signal, with the end of all work (`--once`), or with an error of the
//! store; after the last the program begins anew ([`crate::again`]).

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crossbeam::channel::unbounded;
use suture_store::patience::hurry_when;
use suture_store::{Opening, Role, StoreError};

use crate::again::Lives;
use crate::attempt::Context;
use crate::cli::WatchArgs;
use crate::config::{Config, real};
use crate::control::Door;
use crate::event::{Happening, Recovery};
use crate::event_bus::Bus;
use crate::event_store::Heard;
use crate::exit::Exit;
use crate::folder::{Folder, FolderError, is_fading, must_answer};
use crate::fsx;
use crate::glance::away;
use crate::ground::read_traces;
use crate::keeper::Keeper;
use crate::keeper::intake::tend;
use crate::manager::Manager;
use crate::past::Unread;
use crate::pulse::Pulse;
use crate::retention::sweep::Sweeper;
use crate::retention::turns::Moment;
use crate::say::complain;
use crate::schedule::{Hold, Schedule};
use crate::settings::Settings;
use crate::shared::{self, Opened};
use crate::signals::{Hangup, Stop};
use crate::web::Web;
use crate::window::RunWindow;
use crate::world::{Machine, World};
use crate::{deliver, rebuilt, standstill, watchdog};

mod notes;
mod recover;
mod threads;

use notes::{note_folders, note_state};
pub(crate) use recover::recover;
use threads::{Slots, guarded, no_thread, thread};

/// How often what is gone is looked for.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// Bytes that must be free for the store to be opened again.
const ROOM: u64 = 256 << 10;

/// Runs the daemon to its end.
pub(crate) fn run(args: &WatchArgs) -> Exit {
    // First of all: where no one listens, a signal ends the process.
    let (stop, hangup) = match Stop::listen().and_then(|stop| Ok((stop, Hangup::listen()?))) {
        Ok(signals) => signals,
        Err(error) => {
            complain(&format_args!("cannot listen for signals: {error}"));
            return Exit::of_start(&error);
        }
    };
    match Settings::of(args, hangup) {
        Ok(settings) => serve(settings, args.once, &stop, true),
        Err(line) => {
            complain(&line);
            Exit::Refused
        }
    }
}

/// The same for settings at hand. `may_begin_anew`: after an error of the store the program may begin anew, with the arguments it
/// was started with.
pub(crate) fn serve(settings: Settings, once: bool, stop: &Stop, may_begin_anew: bool) -> Exit {
    let config = settings.now();
    let folders = match open_folders(&config) {
        Ok(folders) => folders,
        Err(error) => {
            complain(&error);
            return match &error {
                FolderError::Owned { .. } | FolderError::Shared { .. } => Exit::Owned,
                FolderError::Within { .. }
                | FolderError::Mixed { .. }
                | FolderError::Bucket(_)
                | FolderError::Numbers { .. }
                | FolderError::Called { .. } => Exit::Refused,
                FolderError::Silent { .. } => Exit::TryAgain,
                FolderError::Io { source, .. } => Exit::of_start(source),
            };
        }
    };
    let web = match config.api.as_ref().map(Web::bind).transpose() {
        Ok(web) => web,
        Err((line, error)) => {
            complain(&line);
            return Exit::of_start(&error);
        }
    };
    let (lives, not_good) = (Lives::so_far(), Arc::<AtomicBool>::default());
    if let Err(error) = watch_store(lives, &not_good, stop, may_begin_anew) {
        complain(&format_args!("no thread can be started: {error}; try again, or raise the limit of processes"));
        return Exit::TryAgain;
    }
    let asked = Instant::now();
    let hurried = stop.clone();
    hurry_when(move || hurried.asked());
    let opened = loop {
        match shared::open(&config) {
            Ok(opened) => break opened,
            Err(StoreError::Locked { pid, .. }) if is_fading(pid, asked) => std::thread::sleep(Duration::from_millis(10)),
            Err(error) => return store_failed(&error),
        }
    };
    tracing::info!(roles = %config.roles, "Beginning.");
    warn_of_hours(&config);
    note_state(&config, &folders);
    note_folders(&config, &folders);
    let settings = Arc::new(settings);
    let manager = Manager::of_environment();
    let daemon = Daemon { settings, folders, opened, web, manager, once, lives, not_good, stop: stop.clone(), may_begin_anew };
    daemon.run()
}

/// Hours are those of a time zone, which a bare container does not have, or under a name that it does not know.
fn warn_of_hours(config: &Config) {
    if config.run_window != RunWindow::default() && Machine.local().time_zone().is_unknown() {
        let run_window = config.run_window.to_string();
        tracing::warn!(run_window, "The time zone cannot be told, by TZ or by the system: the hours of work are those of UTC.");
    }
}

/// Takes the folders that are to be served. One that another daemon serves is away, as long as there is one that is not.
fn open_folders(config: &Config) -> Result<Vec<Arc<Folder>>, FolderError> {
    // Before anything is read there: the job store may lie in a folder that answers nothing.
    if let Some(folder) = config.folders.iter().find(|folder| config.state.starts_with(&folder.path)) {
        must_answer(&folder.path)?;
    }
    let (mut folders, mut away, known) = (Vec::new(), None, read_traces(&config.state)?);
    let mut served = 0;
    for folder in &config.folders {
        let opened = match Folder::open_guarded(folder, known.get(&folder.name)) {
            Err(error) if error.passes() => {
                away.get_or_insert(error);
                Folder::of_other(folder)?
            }
            opened => {
                let opened = opened?;
                if opened.silence().is_none() {
                    served += 1;
                } else {
                    let silent = FolderError::Silent { root: opened.root.clone() };
                    // The job store cannot be opened there.
                    if config.state.starts_with(&opened.root) {
                        return Err(silent);
                    }
                    away.get_or_insert(silent);
                }
                opened
            }
        };
        folders.push(Arc::new(opened));
    }
    match away {
        Some(error) if served == 0 => Err(error),
        _ => Ok(folders),
    }
}

/// When a call into the job database hangs, the program begins anew, if it may, or ends.
fn watch_store(lives: Lives, not_good: &Arc<AtomicBool>, stop: &Stop, may_begin_anew: bool) -> std::io::Result<()> {
    let (born, not_good, stop) = (Instant::now(), Arc::clone(not_good), stop.clone());
    watchdog::start(move || {
        if may_begin_anew {
            lives.begin_another(born.elapsed(), not_good.load(Ordering::Relaxed), &|| stop.asked());
        }
        end_hanging();
    })
}

/// Ends a process in which nothing that could be waited for ends any more.
pub(crate) fn end_hanging() -> ! {
    complain(&"the job database does not answer after an error of its disk; try again");
    std::process::exit(i32::from(Exit::TryAgain.code()))
}

fn store_failed(error: &StoreError) -> Exit {
    complain(&error);
    match error.exit_code() {
        73 => Exit::Owned,
        _ => Exit::TryAgain,
    }
}

struct Daemon {
    settings: Arc<Settings>,
    folders: Vec<Arc<Folder>>,
    opened: Opened,
    web: Option<Web>,
    manager: Manager,
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
                self.wait_for_store();
                if self.may_begin_anew {
                    lives.begin_another(born.elapsed(), self.not_good.load(Ordering::Relaxed), &|| self.stop.asked());
                }
                store_failed(&error)
            }
        }
    }

    /// Waits until its database answers, and there is room for the store, and the mount that its folder lies on: a new life could do nothing on a full disk, and would
    /// take the bare folder under a mount for an empty one.
    fn wait_for_store(&self) {
        let state = real(&self.settings.now().state);
        let folder = self.folders.iter().find(|folder| state.starts_with(real(&folder.root)));
        let store = &self.opened.store;
        let full = || (fsx::free_space(&state, 0) < ROOM).then(|| format!("the disk of {} is full", state.display()));
        let why = || folder.and_then(|folder| folder.missing()).or_else(|| away(&**store)).or_else(full);
        let mut told = false;
        while let Some(reason) = why().filter(|_| !self.once && !self.stop.asked()) {
            if !std::mem::replace(&mut told, true) {
                tracing::error!(reason, "The job store waits; nothing is done until it can be opened again.");
                self.manager.wait(&reason);
            }
            self.manager.beat(Instant::now());
            std::thread::sleep(LOOK_EVERY);
        }
    }

    fn live(&self) -> End {
        let (events, inbox) = unbounded();
        let unread = match Unread::of(&*self.opened.store, &self.folders) {
            Ok(unread) => unread,
            Err(error) => return End::Store(error),
        };
        let bus = Arc::new(Bus::new(self.web.is_some()));
        tell_opening(&bus, &self.opened.opening);
        rebuilt::tell(&self.settings.now().state, &bus);
        let world: Arc<dyn World> = Arc::new(Machine);
        let context = Arc::new(Context {
            schedule: Schedule::new(Arc::clone(&world)),
            world,
            store: Arc::new(Heard::new(Arc::clone(&self.opened.store), Arc::clone(&bus))),
            folders: self.folders.clone(),
            settings: Arc::clone(&self.settings),
            events,
            once: self.once,
            halt: AtomicBool::new(false),
            not_good: Arc::clone(&self.not_good),
            away: Mutex::default(),
            full: Mutex::default(),
            unread,
            failed: Mutex::new(None),
            pulse: Pulse::new(),
            bus,
        });
        // Before anything can come to its end.
        if let Err(error) = guarded(|| begin(&context)) {
            return End::Store(error);
        }
        let web = match self.web.as_ref().map(|web| web.start(&context)).transpose() {
            Ok(web) => web,
            Err(error) => return End::Store(no_thread(error)),
        };
        let mut keeper = Keeper::new(&context, inbox, &self.stop);
        let ended = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let slots = Slots::new(scope, &context);
            let threads = self.start(scope, &context, &ended);
            let kept = threads.and_then(|()| guarded(|| keeper.keep(&|workers| slots.raise(workers))));
            context.schedule.stop();
            context.pulse.end();
            match kept {
                Ok(()) => {
                    self.drain(&context, &slots);
                    self.sweep_once(&context);
                    self.tell_once(&context);
                }
                Err(error) => context.fail(error),
            }
            ended.store(true, Ordering::Relaxed);
        });
        if let Some(web) = web {
            web.stop();
        }
        let failed = context.failed.lock().map_or_else(|poisoned| poisoned.into_inner().take(), |mut failed| failed.take());
        failed.map_or(End::Rest, End::Store)
    }
}

impl Daemon {
    /// Starts the thread that lets go what is to go, and one a folder that answers `suture jobs`.
    fn start<'s>(
        &'s self,
        scope: &'s std::thread::Scope<'s, '_>,
        context: &'s Context,
        ended: &'s AtomicBool,
    ) -> Result<(), StoreError> {
        for folder in &self.folders {
            let serve = move || {
                let served = guarded(|| {
                    answer_at(folder, context, &|| ended.load(Ordering::Relaxed));
                    Ok(())
                });
                served.unwrap_or_else(|error| context.fail(error));
            };
            thread("door").spawn_scoped(scope, serve).map(drop).map_err(no_thread)?;
        }
        for folder in self.folders.iter().filter(|folder| folder.bucket.is_some()) {
            let look = move || {
                let looked = guarded(|| tend(folder, context, &|| ended.load(Ordering::Relaxed) || context.has_failed()));
                looked.unwrap_or_else(|error| context.fail(error));
            };
            thread("bucket").spawn_scoped(scope, look).map(drop).map_err(no_thread)?;
        }
        // Before anything is taken, whether a door opens or not.
        look_for_pause(context);
        let sweep = move || {
            let swept =
                guarded(|| sweeper(context).tend(&|| moment(context), &|| ended.load(Ordering::Relaxed) || context.has_failed()));
            swept.unwrap_or_else(|error| context.fail(error));
        };
        let manage = move || self.manager.tell(context, &|| ended.load(Ordering::Relaxed) || context.has_failed());
        thread("manager").spawn_scoped(scope, manage).map(drop).map_err(no_thread)?;
        let tell = move || {
            let told = guarded(|| {
                deliver::serve(context, ended);
                Ok(())
            });
            told.unwrap_or_else(|error| context.fail(error));
        };
        if context.has(Role::Control) {
            thread("deliver").spawn_scoped(scope, tell).map(drop).map_err(no_thread)?;
        }
        let may_keep = context.has(Role::Intake) && self.folders.iter().any(|folder| folder.is_shared);
        if !self.once && (context.has(Role::Control) || may_keep) {
            thread("sweeper").spawn_scoped(scope, sweep).map(drop).map_err(no_thread)?;
        }
        Ok(())
    }

    /// With `--once`, who is to hear of ends of jobs does at the end, as far as they can be reached.
    fn tell_once(&self, context: &Context) {
        let stop = || self.stop.asked() || context.has_failed();
        if self.once {
            guarded(|| deliver::settle(context, &stop)).unwrap_or_else(|error| context.fail(error));
        }
    }

    /// With `--once`, what is to go goes at the end, if all came to it.
    fn sweep_once(&self, context: &Context) {
        let stop = || self.stop.asked() || context.has_failed();
        if self.once && !stop() {
            let swept = guarded(|| sweeper(context).sweep(context.world.wall(), &stop).map(drop));
            swept.unwrap_or_else(|error| context.fail(error));
        }
    }

    /// Lets running jobs and a running command finish, for as long as they are given.
    fn drain(&self, context: &Context, slots: &Slots) {
        let deadline = Instant::now().checked_add(self.settings.now().drain);
        let waits = || slots.are_at_work() || (context.pulse.has_command() && !context.halt.load(Ordering::Relaxed));
        while waits() {
            let is_over = deadline.is_some_and(|deadline| Instant::now() >= deadline);
            if is_over && !context.halt.swap(true, Ordering::Relaxed) {
                tracing::warn!("The time to finish running jobs is over; they go back into the queue.");
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

/// Has the store keep what is to be told, and takes up what an earlier life left, each where that is this daemon's part.
fn begin(context: &Arc<Context>) -> Result<(), StoreError> {
    context.store.share(&context.settings.now().shares());
    if context.has(Role::Control) {
        deliver::subscribe(context)?;
    }
    if context.has(Role::Worker) { recover(context) } else { Ok(()) }
}

/// Tells what the store met when it was opened.
fn tell_opening(bus: &Bus, opening: &Opening) {
    let torn = (opening.torn_snapshots > 0).then_some(Recovery::TornSnapshot);
    let damage = opening.set_aside.is_some().then_some(Recovery::Damage);
    torn.into_iter().chain(damage).for_each(|how| bus.tell(&Happening::StoreRecovered(how)));
}

/// Takes nothing new where an operator has noted that for the next daemon.
pub(crate) fn look_for_pause(context: &Context) {
    let is_set = standstill::is_set(&context.settings.now().state).unwrap_or_else(|error| {
        tracing::error!(%error, "Whether an operator paused the work cannot be told; it counts as paused: `suture jobs resume` ends that.");
        true
    });
    if is_set && context.schedule.hold(Hold::Operator, Some(standstill::WORDS.into())) {
        tracing::warn!("Nothing new is taken: {}.", standstill::WORDS);
    }
}

/// Answers `suture jobs` at one folder, until `ended`. A folder that was away gets a new door.
fn answer_at(folder: &Folder, context: &Context, ended: &dyn Fn() -> bool) {
    let mut told = false;
    while !ended() {
        let door = folder.check().ok().filter(|()| folder.keeps()).map(|()| Door::open(&folder.root));
        match door {
            Some(Ok(door)) => {
                // Again: whoever found no door has noted the pause before this look, or is answered.
                look_for_pause(context);
                door.serve(context, &|| ended() || (door.is_lost() && folder.check().is_ok()));
            }
            Some(Err(error)) if !std::mem::replace(&mut told, true) => {
                tracing::warn!(%error, "`suture jobs` cannot reach this daemon.");
            }
            _ => {}
        }
        std::thread::sleep(LOOK_EVERY);
    }
}

/// Whoever lets go what is to go.
pub(crate) fn sweeper(context: &Context) -> Sweeper {
    Sweeper::new(Arc::clone(&context.store), context.folders.clone(), Arc::clone(&context.settings), moment(context))
}

/// What time it is.
pub(crate) fn moment(context: &Context) -> Moment {
    Moment { steady: context.world.steady(), wall: context.world.wall() }
}
