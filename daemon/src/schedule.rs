//! Who may claim what, and when. Small files run side by side, one thread each; while a result is brought into place, which is waiting for the
//! disk, the next file is computed. A large file runs alone, by all threads and with the whole memory: two of them at once would only fight for the same
//! processors. A suspect (a file that was running when the daemon died, twice) runs alone too, after everything else.
//!
//! The higher priority goes first. So that small files do not wait behind a row of huge ones, of equal priority a large file's turn comes when no small one
//! waits, or when none has had a turn for [`ALONE_AT_LEAST_EVERY`]. A job's priority grows while it waits (the store's business): who has risen by that is the
//! equal of those who were asked for sooner, but not before them, so that a row of huge files grows no more urgent than small ones only because huge ones
//! always wait.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use suture_store::{Filter, JobStore, Priority, StoreError, Waiting};

use crate::config::Config;
use crate::world::World;
use crate::yielded::Yielded;

/// However many small files of its priority come, one that runs alone has a turn this often.
const ALONE_AT_LEAST_EVERY: Duration = Duration::from_secs(300);
/// How often an idle slot asks again: pauses after errors end without anyone's word.
const ASK_EVERY: Duration = Duration::from_secs(1);
/// By then every daemon with an idle slot has asked once, and has its answer.
const OTHERS_HAVE_ASKED: Duration = Duration::from_millis(1500);

/// What a slot may claim next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Turn {
    /// A small file, beside others.
    Small,
    /// A large file, alone.
    Large,
    /// A file of any size that must run alone: a suspect, or one that needs the whole memory.
    Alone,
    /// Nothing any more.
    Stop,
}

impl Turn {
    /// With all threads and the whole memory?
    pub(crate) fn is_alone(self) -> bool {
        matches!(self, Self::Large | Self::Alone)
    }

    /// As the store takes it.
    pub(crate) fn filter(self, sizes: Sizes) -> Filter {
        let Sizes { large, largest } = sizes;
        match self {
            Self::Small | Self::Stop => Filter { size: (0, large.saturating_sub(1).min(largest)), alone: false },
            Self::Large => Filter { size: (large, largest), alone: false },
            Self::Alone => Filter { size: (0, largest), alone: true },
        }
    }
}

/// How sizes of files decide who takes them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sizes {
    /// From this size on a file is worked on alone.
    pub large: u64,
    /// Beyond this size it is left to other daemons.
    pub largest: u64,
}

impl Sizes {
    /// As the configuration has them.
    pub(crate) fn of(config: &Config) -> Self {
        Self { large: config.large, largest: config.largest.unwrap_or(u64::MAX) }
    }
}

/// What keeps all slots from work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Hold {
    /// There is too little room on a disk.
    Disk,
    /// An operator wants it so.
    Operator,
    /// An operator wants it so, and has said it to the store that daemons share.
    Drain,
}

/// What keeps the daemon from work, and how much it does all the same.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Standing {
    /// Jobs in work.
    pub running: usize,
    /// Why nothing new is taken, in words; empty: it is.
    pub held: Vec<String>,
    /// Why folders are out of reach, in words.
    #[serde(default)]
    pub away: Vec<String>,
    /// Of which folders nothing new is taken because a disk of theirs is nearly full, in words. Where all are, `held` says so.
    #[serde(default)]
    pub full: Vec<String>,
    /// Who could not be told of ends of jobs yet, in words.
    #[serde(default)]
    pub untold: Vec<String>,
    /// Jobs that wait for a host that is not there, in words.
    #[serde(default)]
    pub stranded: Vec<String>,
}

/// Turns of all slots.
pub(crate) struct Schedule {
    state: Mutex<State>,
    wake: Condvar,
    world: Arc<dyn World>,
}

struct State {
    /// Slots at work.
    busy: usize,
    /// Those of them that compute, or are about to.
    computing: usize,
    /// One of them wants no company.
    alone: bool,
    /// By [`Hold`]: why nothing is given out, in words.
    held: [Option<String>; 3],
    /// So many slots may compute.
    most: usize,
    stop: bool,
    last_alone: Instant,
    yielded: Yielded,
}

/// What waits for each kind of turn.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Waits {
    /// A result that is only to be brought into place.
    pub parked: bool,
    pub small: Option<Waiting>,
    pub large: Option<Waiting>,
    pub alone: Option<Waiting>,
}

impl Waits {
    /// As the store has it.
    ///
    /// # Errors
    /// As the store's.
    pub(crate) fn of(store: &dyn JobStore, sizes: Sizes) -> Result<Self, StoreError> {
        let of = |turn: Turn| {
            let want = turn.filter(sizes);
            if want.size.0 <= want.size.1 { store.waiting(&want) } else { Ok(None) }
        };
        Ok(Self { parked: store.has_parked()?, small: of(Turn::Small)?, large: of(Turn::Large)?, alone: of(Turn::Alone)? })
    }
}

impl Schedule {
    pub(crate) fn new(world: Arc<dyn World>) -> Self {
        let last_alone = world.steady();
        let (held, yielded) = (Default::default(), Yielded::default());
        let state = State { busy: 0, computing: 0, alone: false, held, most: usize::MAX, stop: false, last_alone, yielded };
        Self { state: Mutex::new(state), wake: Condvar::new(), world }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for this slot's turn; `look` tells what waits. After anything but [`Turn::Stop`], [`Schedule::computed`] and [`Schedule::done`] must follow.
    ///
    /// # Errors
    /// As `look`.
    pub(crate) fn next<E>(&self, look: &dyn Fn() -> Result<Waits, E>) -> Result<Turn, E> {
        let mut state = self.lock();
        loop {
            if let Some(turn) = state.give(self.world.steady(), look)? {
                return Ok(turn);
            }
            // However often it is woken for nothing, pauses end and jobs grow older meanwhile.
            (state, _) = self.wake.wait_timeout(state, ASK_EVERY).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// The same without waiting: `None` where no turn is to be had now.
    ///
    /// # Errors
    /// As `look`.
    #[cfg(test)]
    pub(crate) fn try_next<E>(&self, look: &dyn Fn() -> Result<Waits, E>) -> Result<Option<Turn>, E> {
        self.lock().give(self.world.steady(), look)
    }

    /// The slot computes no longer: another one may.
    pub(crate) fn computed(&self) {
        let mut state = self.lock();
        state.computing = state.computing.saturating_sub(1);
        drop(state);
        self.wake.notify_all();
    }

    /// The slot's turn is over.
    pub(crate) fn done(&self, turn: Turn) {
        let now = self.world.steady();
        let mut state = self.lock();
        state.busy = state.busy.saturating_sub(1);
        if turn.is_alone() {
            state.alone = false;
            state.last_alone = now;
        }
        drop(state);
        self.wake.notify_all();
    }

    /// There may be something new to claim.
    pub(crate) fn news(&self) {
        // Whoever looked before that waits by now.
        drop(self.lock());
        self.wake.notify_all();
    }

    /// A job was handed on since `began`: other daemons claim it, if they can.
    pub(crate) fn hand_on(&self, began: Instant) {
        self.lock().yielded.hand_on(began..self.world.steady(), OTHERS_HAVE_ASKED);
    }

    /// Gives nothing out for this reason, in words, or no longer. Returns whether that is news.
    pub(crate) fn hold(&self, why: Hold, words: Option<String>) -> bool {
        let mut state = self.lock();
        let held = &mut state.held[why as usize];
        let is_news = held.is_some() != words.is_some();
        *held = words;
        drop(state);
        if is_news {
            self.wake.notify_all();
        }
        is_news
    }

    /// Lets no more than so many slots compute at a time. Returns whether that is news.
    pub(crate) fn limit(&self, most: usize) -> bool {
        let is_news = std::mem::replace(&mut self.lock().most, most) != most;
        if is_news {
            self.wake.notify_all();
        }
        is_news
    }

    /// Is nothing given out for now?
    pub(crate) fn is_paused(&self) -> bool {
        let state = self.lock();
        state.most == 0 || state.held.iter().any(Option::is_some)
    }

    /// Why nothing is given out for this reason, in words, if it holds.
    pub(crate) fn held(&self, why: Hold) -> Option<String> {
        self.lock().held[why as usize].clone()
    }

    /// What an operator may want to know.
    pub(crate) fn standing(&self) -> Standing {
        let state = self.lock();
        let hours = (state.most == 0).then(|| "it is outside of the hours of `run_window`".to_owned());
        let held = state.held.iter().flatten().cloned().chain(hours).collect();
        Standing { running: state.busy, held, ..Standing::default() }
    }

    /// Gives nothing out any more.
    pub(crate) fn stop(&self) {
        self.lock().stop = true;
        self.wake.notify_all();
    }

    /// How many slots have a turn.
    pub(crate) fn busy(&self) -> usize {
        self.lock().busy
    }

    /// How many slots compute.
    pub(crate) fn computing(&self) -> usize {
        self.lock().computing
    }
}

impl State {
    /// A turn for one slot more, if there is one now.
    fn give<E>(&mut self, now: Instant, look: &dyn Fn() -> Result<Waits, E>) -> Result<Option<Turn>, E> {
        if self.stop {
            return Ok(Some(Turn::Stop));
        }
        if !self.may_give() || self.yielded.holds(now) {
            return Ok(None);
        }
        let overdue = now.duration_since(self.last_alone) >= ALONE_AT_LEAST_EVERY;
        let turn = choose(self.busy, overdue, &look()?);
        if let Some(turn) = turn {
            self.busy += 1;
            self.computing += 1;
            self.alone = turn.is_alone();
        }
        Ok(turn)
    }

    fn may_give(&self) -> bool {
        self.held.iter().all(Option::is_none) && !self.alone && self.computing < self.most
    }
}

/// Who is next. `overdue`: none has run alone for long.
fn choose(busy: usize, overdue: bool, waits: &Waits) -> Option<Turn> {
    if waits.parked {
        return Some(Turn::Small);
    }
    let alone = match (waits.large, waits.alone) {
        (Some(large), Some(alone)) => {
            // Suspects come last, but come: who has risen as far as that goes has waited for long enough.
            let risen = alone.aged == Priority::HIGHEST && alone.highest < Priority::HIGHEST;
            let turn = if alone.aged > large.aged || risen { Turn::Alone } else { Turn::Large };
            Some((turn, Waiting { highest: large.highest.max(alone.highest), aged: large.aged.max(alone.aged) }))
        }
        (large, alone) => large.map(|large| (Turn::Large, large)).or(alone.map(|alone| (Turn::Alone, alone))),
    };
    match (waits.small, alone) {
        (Some(small), Some((turn, alone))) => {
            // Only who was asked for sooner goes first for it; whoever has merely waited goes first among their like.
            let first = alone.highest > small.aged || (overdue && small.highest <= alone.aged);
            if !first { Some(Turn::Small) } else { (busy == 0).then_some(turn) }
        }
        (Some(_), None) => Some(Turn::Small),
        (None, alone) => alone.filter(|_| busy == 0).map(|(turn, _)| turn),
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;
    use crate::world::Machine;

    fn schedule() -> Schedule {
        Schedule::new(Arc::new(Machine))
    }

    fn waiting(highest: i64, aged: i64) -> Option<Waiting> {
        let priority = |number| Priority::try_from(number).unwrap();
        Some(Waiting { highest: priority(highest), aged: priority(aged) })
    }

    fn waits(small: i64, large: i64, alone: i64) -> Waits {
        let of = |number| if number == 0 { None } else { waiting(number, number) };
        Waits { parked: false, small: of(small), large: of(large), alone: of(alone) }
    }

    fn next(s: &Schedule, waits: Waits) -> Turn {
        s.next(&|| Ok::<_, Infallible>(waits)).unwrap()
    }

    #[test]
    fn small_ones_run_beside_each_other_a_large_one_alone() {
        let s = schedule();
        let both = waits(5, 5, 0);
        assert_eq!([next(&s, both), next(&s, both)], [Turn::Small, Turn::Small]);
        s.computed();
        s.done(Turn::Small);
        // Nothing small is left, but one still runs: the large one must wait for it.
        assert_eq!(choose(1, false, &waits(0, 5, 0)), None);
        s.computed();
        s.done(Turn::Small);
        assert_eq!(next(&s, waits(0, 5, 0)), Turn::Large);
        assert!(!s.lock().may_give(), "nothing beside a large one");
        s.computed();
        s.done(Turn::Large);
        assert_eq!(next(&s, both), Turn::Small, "a small one that came meanwhile is before the next large one");
    }

    /// To bring a result into place is no reason to let a processor wait. A large file does wait: its turn is alone.
    #[test]
    fn the_next_is_computed_while_a_result_is_brought_into_place() {
        let s = schedule();
        s.limit(1);
        assert_eq!(next(&s, waits(5, 5, 0)), Turn::Small);
        assert!(!s.lock().may_give());
        s.computed();
        assert_eq!((s.computing(), s.standing().running), (0, 1));
        assert_eq!(s.try_next(&|| Ok::<_, Infallible>(waits(0, 5, 0))), Ok(None));
        assert_eq!(next(&s, waits(5, 5, 0)), Turn::Small);
        s.computed();
        [Turn::Small; 2].into_iter().for_each(|turn| s.done(turn));
        assert_eq!(next(&s, waits(0, 5, 0)), Turn::Large);
    }

    /// Whatever its turn, a daemon asks for no file that it leaves to others, and for each size that it takes.
    #[test]
    fn larger_files_are_left_to_others() {
        for (largest, expected) in [
            (u64::MAX, [(0, 99), (100, u64::MAX), (0, u64::MAX)]),
            (500, [(0, 99), (100, 500), (0, 500)]),
            (7, [(0, 7), (100, 7), (0, 7)]),
        ] {
            let sizes = Sizes { large: 100, largest };
            assert_eq!([Turn::Small, Turn::Large, Turn::Alone].map(|turn| turn.filter(sizes).size), expected);
        }
    }

    #[test]
    fn suspects_come_last_and_alone() {
        let s = schedule();
        for (waits, turn) in [(waits(5, 5, 5), Turn::Small), (waits(0, 5, 5), Turn::Large), (waits(0, 0, 5), Turn::Alone)] {
            assert_eq!((next(&s, waits), s.computing()), (turn, 1));
            s.computed();
            s.done(turn);
        }
        assert_eq!(choose(0, false, &Waits::default()), None, "there is nothing for anyone");
    }

    /// Higher first, whatever its size; but no one else begins what would keep it waiting.
    #[test]
    fn the_more_urgent_goes_first() {
        assert_eq!(choose(0, false, &waits(5, 6, 0)), Some(Turn::Large));
        assert_eq!(choose(1, false, &waits(5, 6, 0)), None, "the slots empty for it");
        assert_eq!(choose(0, true, &waits(6, 5, 5)), Some(Turn::Small), "not even then");
        assert_eq!(choose(0, false, &waits(5, 5, 6)), Some(Turn::Alone));
        assert_eq!(choose(0, false, &waits(0, 5, 6)), Some(Turn::Alone));
    }

    /// There is little to do for it, so that it is in no one's way, and no one is in its.
    #[test]
    fn what_is_parked_waits_for_no_one() {
        assert_eq!(choose(1, true, &Waits { parked: true, ..waits(5, 9, 0) }), Some(Turn::Small));
    }

    /// Among their like, small ones go first, but for one turn now and then.
    #[test]
    fn a_large_one_has_a_turn_now_and_then() {
        assert_eq!(choose(0, true, &waits(5, 5, 0)), Some(Turn::Large));
        assert_eq!(choose(1, true, &waits(5, 5, 0)), None);
        assert_eq!(choose(0, true, &waits(5, 0, 5)), Some(Turn::Alone));
    }

    /// A row of large files that have waited for hours is no reason to keep a small one waiting; nor do urgent ones keep one waiting for ever.
    #[test]
    fn who_has_waited_becomes_one_of_the_others() {
        let old = |small, large| Waits { small, large, ..Waits::default() };
        assert_eq!(choose(0, false, &old(waiting(5, 5), waiting(5, 9))), Some(Turn::Small));
        assert_eq!(choose(0, true, &old(waiting(5, 5), waiting(5, 9))), Some(Turn::Large));
        assert_eq!(choose(0, true, &old(waiting(9, 9), waiting(0, 8))), Some(Turn::Small));
        assert_eq!(choose(0, true, &old(waiting(9, 9), waiting(0, 9))), Some(Turn::Large));
        assert_eq!(choose(0, false, &old(waiting(0, 8), waiting(9, 9))), Some(Turn::Large));
        assert_eq!(choose(0, false, &old(waiting(0, 9), waiting(9, 9))), Some(Turn::Small));
        let suspect = |alone| Waits { large: waiting(9, 9), alone, ..Waits::default() };
        assert_eq!(choose(0, false, &suspect(waiting(5, 8))), Some(Turn::Large));
        assert_eq!(choose(0, false, &suspect(waiting(5, 9))), Some(Turn::Alone));
    }

    #[test]
    fn nothing_is_given_out_while_one_reason_holds() {
        let s = schedule();
        assert!(s.hold(Hold::Disk, Some("full".into())) && s.hold(Hold::Operator, Some("wanted".into())));
        assert!(!s.hold(Hold::Disk, Some("still full".into())), "no news");
        assert_eq!(s.standing().held, ["still full", "wanted"]);
        assert!(s.hold(Hold::Disk, None) && s.is_paused() && !s.lock().may_give());
        assert!(s.hold(Hold::Operator, None) && !s.is_paused());
        assert_eq!(next(&s, waits(5, 0, 0)), Turn::Small);
    }

    #[test]
    fn outside_of_the_hours_fewer_slots_work() {
        let s = schedule();
        assert!(s.limit(1) && !s.limit(1) && !s.is_paused());
        let turn = next(&s, waits(5, 0, 0));
        assert!(!s.lock().may_give(), "one is at work");
        s.limit(0);
        s.done(turn);
        assert!(!s.lock().may_give() && s.is_paused());
        assert_eq!(s.standing().held.len(), 1);
    }

    /// Who waits for work is told of news at once.
    #[test]
    fn news_wake_who_waits() {
        let s = schedule();
        let there = std::sync::atomic::AtomicBool::new(false);
        let look = || Ok::<_, Infallible>(waits(i64::from(there.load(std::sync::atomic::Ordering::Relaxed)), 0, 0));
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| s.next(&look).unwrap());
            let began = Instant::now();
            std::thread::sleep(Duration::from_millis(100));
            there.store(true, std::sync::atomic::Ordering::Relaxed);
            s.news();
            assert_eq!(waiting.join().unwrap(), Turn::Small);
            assert!(began.elapsed() < ASK_EVERY, "it was not woken");
        });
    }

    #[test]
    fn stopping_ends_every_wait() {
        let s = schedule();
        s.hold(Hold::Disk, Some("full".into()));
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| next(&s, waits(5, 5, 5)));
            s.stop();
            assert_eq!(waiting.join().unwrap(), Turn::Stop);
        });
    }
}
