//! What there is in a simulation, and the work that its workers do. While one works, time goes by and everything else goes on: so several jobs are in work
//! at a time in one thread, each begun within the other.

use std::cell::{Cell, OnceCell, Ref, RefCell};
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::PathBuf;
use std::rc::{Rc, Weak};
use std::sync::Arc;
use std::time::Duration;

use suture_core::report::Outcome;
use suture_core::{ErrorClass, Report};
use suture_store::testkit::Chance;

use super::life::Life;
use super::matter::{Fate, Matter};
use super::oracle::Oracle;
use super::plan::{Place, Plan};
use super::sky::Sky;
use crate::fsx::Identity;
use crate::protocol::Request;
use crate::supervise::{Cause, Death, Ended};
use crate::world::{Share, World};

/// The keeper looks at the disk's room this often.
const DISK_EVERY: Duration = Duration::from_secs(5);
/// So many steps are told of when something is wrong.
const TOLD: usize = 80;

/// The daemon is killed: what unwinds then.
pub(super) struct Killed;

/// How much goes on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    /// While a worker works, something happens once in so many moments.
    pub meanwhile: u64,
    /// A job takes so many seconds at most, if nothing is special about it.
    pub seconds: u64,
    /// Every job's turn is compared with all that wait.
    pub watch_order: bool,
    /// The sweeper is asked to look after so long.
    pub tend: Duration,
}

/// A simulation.
pub(super) struct Stage {
    pub sky: Arc<Sky>,
    pub place: Place,
    pub scale: Scale,
    pub plan: RefCell<Plan>,
    pub oracle: RefCell<Oracle>,
    chance: RefCell<Chance>,
    life: RefCell<Option<Rc<Life>>>,
    log: RefCell<VecDeque<String>>,
    /// Of all steps: tells two runs apart.
    digest: RefCell<blake3::Hasher>,
    /// Crash points until the daemon is killed; 0: it is not.
    pub until_kill: Cell<u32>,
    /// All is to come to rest: people leave the folders alone.
    pub is_closing: Cell<bool>,
    /// When something was dropped or worked on last.
    pub active: Cell<Duration>,
    /// When the sweeper looked last.
    pub tended: Cell<Duration>,
    /// Dropped files in work, and the last ones that were.
    pub in_hand: RefCell<VecDeque<PathBuf>>,
    /// What the clock on the wall showed at a sweep of which no one has looked what it let go, and after how many milliseconds results may go.
    pub sweep: Cell<Option<(u64, u64)>>,
    /// The keeper has had time to see that the disk is full.
    seen_full: Cell<bool>,
    /// The hot folder that is away.
    pub away: Cell<Option<usize>>,
    sample: OnceCell<Report>,
}

thread_local! {
    static STAGE: RefCell<Weak<Stage>> = const { RefCell::new(Weak::new()) };
}

/// That of this thread.
pub(super) fn current() -> Rc<Stage> {
    STAGE.with(|stage| stage.borrow().upgrade()).expect("a simulation runs")
}

impl Stage {
    pub(super) fn new(seed: u64, begin: &str, scale: Scale, plan: impl FnOnce(&mut Chance) -> Plan) -> Rc<Self> {
        let mut chance = Chance::new(seed);
        let plan = RefCell::new(plan(&mut chance));
        let stage = Rc::new(Self {
            sky: Sky::new(begin),
            place: Place::new(),
            scale,
            plan,
            oracle: RefCell::default(),
            chance: RefCell::new(chance),
            life: RefCell::default(),
            log: RefCell::default(),
            digest: RefCell::default(),
            until_kill: Cell::new(0),
            is_closing: Cell::new(false),
            active: Cell::new(Duration::ZERO),
            tended: Cell::new(Duration::ZERO),
            in_hand: RefCell::default(),
            sweep: Cell::new(None),
            seen_full: Cell::new(false),
            away: Cell::new(None),
            sample: OnceCell::new(),
        });
        STAGE.with(|slot| *slot.borrow_mut() = Rc::downgrade(&stage));
        let watched = Rc::downgrade(&stage);
        suture_store::testkit::at_crash_points(Some(Rc::new(move |name| {
            if let Some(stage) = watched.upgrade() {
                stage.at_crash_point(name);
            }
        })));
        stage
    }

    pub(super) fn chance<T>(&self, choose: impl FnOnce(&mut Chance) -> T) -> T {
        choose(&mut self.chance.borrow_mut())
    }

    /// Notes what happens.
    pub(super) fn say(&self, what: impl FnOnce() -> String) {
        let time = self.sky.passed().as_secs();
        let line = format!("{time:>8} s  {}", what());
        self.digest.borrow_mut().update(line.as_bytes());
        if std::env::var_os("SUTURE_STEPS").is_some() {
            eprintln!("{line}");
        }
        let mut log = self.log.borrow_mut();
        log.push_back(line);
        if log.len() > TOLD {
            log.pop_front();
        }
    }

    /// The last steps, one a line.
    pub(super) fn told(&self) -> String {
        self.log.borrow().iter().map(|line| format!("{line}\n")).collect()
    }

    /// Of all steps so far.
    pub(super) fn digest(&self) -> String {
        self.digest.borrow().finalize().to_hex().to_string()
    }

    pub(super) fn life(&self) -> Rc<Life> {
        Ref::map(self.life.borrow(), |life| life.as_ref().expect("the daemon lives")).clone()
    }

    /// Does something during which the daemon may be killed; if it is, the next life begins.
    pub(super) fn survive(&self, act: impl FnOnce()) {
        if let Err(cause) = catch_unwind(AssertUnwindSafe(act)) {
            if !cause.is::<Killed>() {
                resume_unwind(cause);
            }
            let reboot = self.chance(|chance| chance.one_in(4));
            self.rise(reboot);
        }
    }

    /// The daemon is dead; the next one begins, and may die at that.
    pub(super) fn rise(&self, reboot: bool) {
        self.bring_back();
        self.judge_sweep();
        loop {
            if let Some(life) = self.life.take() {
                assert_eq!(Rc::strong_count(&life), 1, "nothing of it goes on");
            }
            self.oracle.borrow_mut().killed();
            self.sky.begin_life(reboot);
            self.place.write(&self.plan.borrow());
            self.say(|| format!("a life begins{}", if reboot { ", of the machine too" } else { "" }));
            match catch_unwind(AssertUnwindSafe(|| Life::begin(&self.sky, &self.place))) {
                Ok(life) => {
                    *self.life.borrow_mut() = Some(Rc::new(life));
                    return;
                }
                Err(cause) if cause.is::<Killed>() => {}
                Err(cause) => resume_unwind(cause),
            }
        }
    }

    /// Kills the daemon, in the midst of what it does.
    pub(super) fn die(&self) -> ! {
        self.until_kill.set(0);
        self.say(|| "the daemon is killed".into());
        resume_unwind(Box::new(Killed))
    }

    fn at_crash_point(&self, name: &str) {
        // Where the database is in the midst of a call, a kill is nothing that it lives to tell of.
        if name.starts_with("store.") && !name.starts_with("store.commit") {
            return;
        }
        if name == "daemon.claimed" {
            self.may_claim();
        }
        match self.until_kill.get() {
            0 => {}
            1 => {
                self.say(|| format!("at {name}:"));
                self.die();
            }
            more => self.until_kill.set(more - 1),
        }
        if name.starts_with("daemon.")
            && self.life.borrow().is_some()
            && self.chance(|chance| chance.one_in(self.scale.meanwhile * 8))
        {
            self.say(|| format!("at {name}:"));
            self.user();
        }
    }

    /// The hot folder that is away is back.
    pub(super) fn bring_back(&self) {
        if let Some(folder) = self.away.take() {
            self.say(|| format!("folder {folder} is back"));
            std::fs::rename(self.place.away(folder), self.place.root(folder)).unwrap();
        }
    }

    /// A worker's work.
    pub(super) fn work(&self, share: Share, request: &Request, limit: Duration, stop: &dyn Fn() -> bool) -> Ended {
        let failed = |class, message: &str| Ended::Failed { class, message: message.to_owned() };
        let Ok(bytes) = std::fs::read(&request.input) else { return failed(ErrorClass::Environment, "it cannot be read") };
        let Some((matter, false)) = Matter::read(&bytes) else { return failed(ErrorClass::Unreadable, "it is no mesh") };
        let runs = self.oracle.borrow_mut().begins(self, matter, share);
        self.hold(PathBuf::from(&request.shown_input));
        let witness = Witness { stage: self, path: request.witness.clone() };
        let needed = self.needed(matter.fate);
        self.say(|| format!("work on {matter:?}, run {runs}, for {} s", needed.as_secs_f64()));
        let mut left = needed.min(limit);
        while !left.is_zero() {
            let step = left.min(Duration::from_secs(20));
            left -= step;
            self.sky.pass(step);
            self.meanwhile();
            if stop() {
                self.oracle.borrow_mut().rests(share);
                return Ended::Stopped;
            }
        }
        drop(witness);
        self.active.set(self.sky.passed());
        self.oracle.borrow_mut().rests(share);
        let died = |cause| Ended::Died(Death { cause, last_words: String::new() });
        let whole = share.memory >= self.life().context.settings.now().memory;
        match matter.fate {
            _ if needed > limit => died(Cause::Time(limit)),
            Fate::Kills => died(Cause::Fault(6)),
            Fate::Stumbles if runs == 1 => died(Cause::Fault(11)),
            Fate::Shot if runs == 1 => died(Cause::Killed(9)),
            Fate::Unlucky if runs == 1 => failed(ErrorClass::Environment, "it did not work"),
            Fate::Unreadable => failed(ErrorClass::Unreadable, "it is no mesh"),
            Fate::Refused => failed(ErrorClass::Refused, "it is too much"),
            Fate::Hungry if !whole => failed(ErrorClass::Starved, "it needs more memory"),
            _ => self.done(matter, request).unwrap_or_else(|error| failed(ErrorClass::Environment, &error.to_string())),
        }
    }

    /// How long a worker takes.
    fn needed(&self, fate: Fate) -> Duration {
        let seconds = self.scale.seconds;
        match fate {
            Fate::Hangs => Duration::from_secs(100_000),
            Fate::Slow => Duration::from_secs(self.chance(|chance| chance.between(20, 100))),
            _ => Duration::from_millis(self.chance(|chance| chance.between(1, seconds * 1000))),
        }
    }

    fn done(&self, matter: Matter, request: &Request) -> std::io::Result<Ended> {
        let (content, result) = (matter.dropped(), matter.result());
        let output = request.output.as_ref().ok_or(std::io::ErrorKind::InvalidInput)?;
        std::fs::write(output, &result)?;
        let mut report = self.sample.get_or_init(|| crate::table::tests::sample(Outcome::Repaired)).clone();
        report.outcome = matter.fate.outcome();
        report.verdict.good = report.outcome.is_good();
        (report.profile, report.input.path) = (request.profile.clone(), request.input.clone());
        (report.input.bytes, report.input.blake3) = (content.len() as u64, blake3::hash(&content).to_hex().to_string());
        if let Some(facts) = &mut report.output {
            (facts.bytes, facts.blake3) = (result.len() as u64, blake3::hash(&result).to_hex().to_string());
        }
        Ok(Ended::Done { report: Box::new(report), written: Some(Identity::of(output)?) })
    }

    /// While a worker works: people, the keeper, and the other slots.
    fn meanwhile(&self) {
        if self.chance(|chance| chance.one_in(self.scale.meanwhile)) {
            self.user();
        }
        if !self.is_closing.get() && self.chance(|chance| chance.one_in(self.scale.meanwhile * 30)) {
            self.die();
        }
        self.keep();
        self.life().work();
    }

    /// The keeper looks at everything.
    pub(super) fn keep(&self) {
        self.life().keep();
        self.seen_full.set(self.sky.full_for().is_some_and(|time| time >= DISK_EVERY));
    }

    /// Nothing is claimed while there is a reason not to, be it only to be brought into place.
    fn may_claim(&self) {
        let config = self.life().context.settings.now();
        assert!(config.run_window.is_open(&|| self.sky.local()), "nothing is claimed outside of the hours of work");
        assert!(!self.seen_full.get(), "nothing is claimed while the disk is full");
        assert!(!crate::standstill::is_set(&config.state).unwrap(), "nothing is claimed while an operator wants that");
    }

    /// Notes that a dropped file is in work.
    fn hold(&self, path: PathBuf) {
        let mut held = self.in_hand.borrow_mut();
        held.push_back(path);
        if held.len() > 2 {
            held.pop_front();
        }
    }
}

/// Leaves word that a worker outlived its daemon.
struct Witness<'a> {
    stage: &'a Stage,
    path: Option<PathBuf>,
}

impl Drop for Witness<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() && self.stage.chance(|chance| !chance.one_in(3)) {
            let _ = self.path.as_ref().map(|path| std::fs::write(path, ""));
        }
    }
}
