//! Who may claim what, and when. Small files run side by side, one thread each. A large file runs alone, by all threads and with
//! the whole memory: two of them at once would only fight for the same processors. A suspect (a file that was running when the
//! daemon died, twice) runs alone too, after everything else.
//!
//! So that small files do not wait behind a row of huge ones, a large file's turn comes when no small one waits, or when none
//! has had a turn for [`ALONE_AT_LEAST_EVERY`]; that bounds the large ones' wait as well.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
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

/// What keeps all slots from work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Hold {
    /// There is too little room on a disk.
    Disk,
    /// An operator wants it so.
    Operator,
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
    /// By [`Hold`]: why nothing is given out, in words.
    held: [Option<String>; 2],
    /// So many slots may be at work.
    most: usize,
    stop: bool,
    /// Raised when there may be something new.
    news: u64,
    /// `news` when the store last had nothing for a kind of turn.
    empty: [u64; 3],
    last_alone: Instant,
    /// When idle slots last asked again.
    asked: Instant,
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
        let state = State {
            busy: 0,
            alone: false,
            held: [None, None],
            most: usize::MAX,
            stop: false,
            news: 1,
            empty: [0; 3],
            last_alone: Instant::now(),
            asked: Instant::now(),
        };
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
            let (guard, _) = self.wake.wait_timeout(state, ASK_EVERY).unwrap_or_else(PoisonError::into_inner);
            state = guard;
            // However often it is woken for nothing.
            if state.asked.elapsed() >= ASK_EVERY {
                state.asked = Instant::now();
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

    /// Lets no more than so many slots work at a time. Returns whether that is news.
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

    /// What an operator may want to know.
    pub(crate) fn standing(&self) -> Standing {
        let state = self.lock();
        let hours = (state.most == 0).then(|| "it is outside of the hours of `run_window`".to_owned());
        let held = state.held.iter().flatten().cloned().chain(hours).collect();
        Standing { running: state.busy, held, away: Vec::new() }
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
    if state.held.iter().any(Option::is_some) || state.alone || state.busy >= state.most {
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

    #[test]
    fn nothing_is_given_out_while_one_reason_holds() {
        let s = Schedule::new();
        assert!(s.hold(Hold::Disk, Some("full".into())) && s.hold(Hold::Operator, Some("wanted".into())));
        assert!(!s.hold(Hold::Disk, Some("still full".into())), "no news");
        assert_eq!(s.standing().held, ["still full", "wanted"]);
        assert!(s.hold(Hold::Disk, None) && s.is_paused() && choose(&s.lock()).is_none());
        assert!(s.hold(Hold::Operator, None) && !s.is_paused());
        assert_eq!(s.next().turn, Turn::Small);
    }

    #[test]
    fn outside_of_the_hours_fewer_slots_work() {
        let s = Schedule::new();
        assert!(s.limit(1) && !s.limit(1) && !s.is_paused());
        let given = s.next();
        assert_eq!(choose(&s.lock()), None, "one is at work");
        s.limit(0);
        s.done(given, true);
        assert!(choose(&s.lock()).is_none() && s.is_paused());
        assert_eq!(s.standing().held.len(), 1);
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
        s.hold(Hold::Disk, Some("full".into()));
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| s.next().turn);
            s.stop();
            assert_eq!(waiting.join().unwrap(), Turn::Stop);
        });
    }
}
