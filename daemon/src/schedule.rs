//! Who may claim what, and when. Small files run side by side, one thread each. A large file runs alone, by all threads and with
//! the whole memory: two of them at once would only fight for the same processors. A suspect (a file that was running when the
//! daemon died, twice) runs alone too, after everything else.
//!
//! So that small files do not wait behind a row of huge ones, a large file's turn comes when no small one waits, or when none
//! has had a turn for [`ALONE_AT_LEAST_EVERY`]; that bounds the large ones' wait as well.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use suture_store::Filter;

/// However many small files come, one that runs alone has a turn this often.
const ALONE_AT_LEAST_EVERY: Duration = Duration::from_secs(300);
/// How often an idle slot asks again: pauses after errors end without anyone's word.
const ASK_EVERY: Duration = Duration::from_secs(1);

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
    pub(crate) fn filter(self, large: u64) -> Filter {
        match self {
            Self::Small | Self::Stop => Filter { size: (0, large.saturating_sub(1)), alone: false },
            Self::Large => Filter { size: (large, u64::MAX), alone: false },
            Self::Alone => Filter { size: (0, u64::MAX), alone: true },
        }
    }
}

/// Turns of all slots.
pub(crate) struct Schedule {
    state: Mutex<State>,
    wake: Condvar,
}

struct State {
    /// Slots at work.
    busy: usize,
    /// One of them wants no company.
    alone: bool,
    /// Nothing is given out while set (no room on the disk, a folder is gone).
    paused: bool,
    stop: bool,
    /// Raised when there may be something new.
    news: u64,
    /// `news` when the store last had nothing for a kind of turn.
    empty: [u64; 3],
    last_alone: Instant,
}

impl State {
    fn may_have(&self, turn: Turn) -> bool {
        self.empty.get(index(turn)).is_some_and(|empty| *empty < self.news)
    }
}

fn index(turn: Turn) -> usize {
    match turn {
        Turn::Small | Turn::Stop => 0,
        Turn::Large => 1,
        Turn::Alone => 2,
    }
}

/// A turn, and what was known when it was given.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Given {
    pub turn: Turn,
    news: u64,
}

impl Schedule {
    pub(crate) fn new() -> Self {
        let state =
            State { busy: 0, alone: false, paused: false, stop: false, news: 1, empty: [0; 3], last_alone: Instant::now() };
        Self { state: Mutex::new(state), wake: Condvar::new() }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for this slot's turn. After anything but [`Turn::Stop`], [`Schedule::done`] must follow.
    pub(crate) fn next(&self) -> Given {
        let mut state = self.lock();
        loop {
            if state.stop {
                return Given { turn: Turn::Stop, news: state.news };
            }
            if let Some(turn) = choose(&state) {
                state.busy += 1;
                state.alone = turn.is_alone();
                return Given { turn, news: state.news };
            }
            let (guard, timeout) = self.wake.wait_timeout(state, ASK_EVERY).unwrap_or_else(PoisonError::into_inner);
            state = guard;
            if timeout.timed_out() {
                state.news += 1;
            }
        }
    }

    /// The slot's turn is over; `found`: there was something to claim.
    pub(crate) fn done(&self, given: Given, found: bool) {
        let mut state = self.lock();
        state.busy = state.busy.saturating_sub(1);
        if given.turn.is_alone() {
            state.alone = false;
        }
        if given.turn.is_alone() {
            state.last_alone = Instant::now();
        }
        if !found && let Some(empty) = state.empty.get_mut(index(given.turn)) {
            *empty = given.news;
        }
        drop(state);
        self.wake.notify_all();
    }

    /// There may be something new to claim.
    pub(crate) fn news(&self) {
        self.lock().news += 1;
        self.wake.notify_all();
    }

    /// Gives nothing out while `paused`; returns whether it was so before.
    pub(crate) fn pause(&self, paused: bool) -> bool {
        let before = std::mem::replace(&mut self.lock().paused, paused);
        self.wake.notify_all();
        before
    }

    /// Is nothing given out for now?
    pub(crate) fn is_paused(&self) -> bool {
        self.lock().paused
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
}

fn choose(state: &State) -> Option<Turn> {
    if state.paused || state.alone {
        return None;
    }
    let large_waits = state.may_have(Turn::Large);
    let overdue = (large_waits || state.may_have(Turn::Alone)) && state.last_alone.elapsed() >= ALONE_AT_LEAST_EVERY;
    if state.may_have(Turn::Small) && !overdue {
        return Some(Turn::Small);
    }
    if state.busy > 0 {
        return None;
    }
    if large_waits {
        return Some(Turn::Large);
    }
    state.may_have(Turn::Alone).then_some(Turn::Alone)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_ones_run_beside_each_other_a_large_one_alone() {
        let s = Schedule::new();
        let (a, b) = (s.next(), s.next());
        assert_eq!((a.turn, b.turn), (Turn::Small, Turn::Small));
        s.done(a, true);
        // Nothing small is left, but one still runs: the large one must wait for it.
        let c = s.next();
        s.done(c, false);
        assert_eq!(choose(&s.lock()), None);
        s.done(b, true);
        let large = s.next();
        assert_eq!(large.turn, Turn::Large);
        s.news();
        assert_eq!(choose(&s.lock()), None, "nothing beside a large one");
        s.done(large, true);
        assert_eq!(s.next().turn, Turn::Small, "a small one that came meanwhile is before the next large one");
    }

    #[test]
    fn suspects_come_last_and_alone() {
        let s = Schedule::new();
        for expected in [Turn::Small, Turn::Large] {
            let given = s.next();
            assert_eq!(given.turn, expected);
            s.done(given, false);
        }
        let suspect = s.next();
        assert_eq!(suspect.turn, Turn::Alone);
        assert_eq!(s.busy(), 1);
        s.done(suspect, false);
        assert_eq!(choose(&s.lock()), None, "there was nothing for anyone");
        s.news();
        assert_eq!(choose(&s.lock()), Some(Turn::Small), "what came since was not asked for yet");
    }

    /// News that come between a slot's question and its answer are not lost.
    #[test]
    fn an_empty_answer_is_as_old_as_its_question() {
        let s = Schedule::new();
        let given = s.next();
        s.news();
        s.done(given, false);
        assert_eq!(s.next().turn, Turn::Small);
    }

    #[test]
    fn stopping_ends_every_wait() {
        let s = Schedule::new();
        s.pause(true);
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| s.next().turn);
            s.stop();
            assert_eq!(waiting.join().unwrap(), Turn::Stop);
        });
    }
}
