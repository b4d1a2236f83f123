//! Does a hot folder answer? A mount whose server is gone (NFS with `hard`, a user-space file system whose program stands still) and a dying disk answer no
//! call at all, for hours, and no call can be given a time limit. So a thread of its own asks first, and may wait for ever in the place of the threads that
//! look after all folders.
//!
//! Who asks with [`Sentinel::answers`] before each look is caught only by a folder that falls silent between the answer and the look; the service manager's
//! watchdog begins the daemon anew then.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crossbeam::channel::{Sender, unbounded};

use crate::ground::PARTS;

/// An answer comes within this time, or is asked for later.
const AT_ONCE: Duration = Duration::from_millis(20);
/// For who works in a folder for a while, an answer holds so long, as long as no other is owed. The folders are asked more often than that all the
/// time, so that such a thread hardly ever waits.
const HOLDS: Duration = Duration::from_millis(500);
/// A folder that does not answer for so long is silent.
const PATIENCE: Duration = Duration::from_secs(10);

/// Does it answer?
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    Yes,
    /// Not now; it may be slow.
    NotYet,
    /// It has not for a long time.
    Silent,
}

/// A thread that asks a folder.
#[derive(Debug)]
pub(crate) struct Sentinel {
    ask: Sender<()>,
    asked: Arc<Asked>,
}

/// Where the asking stands.
#[derive(Debug, Default)]
struct Asked {
    state: Mutex<State>,
    answered: Condvar,
}

#[derive(Debug, Default)]
struct State {
    /// Since when an answer is owed, if one is.
    since: Option<Instant>,
    /// The last answer.
    last: Option<Instant>,
}

impl Asked {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Sentinel {
    /// Posts one at a hot folder.
    ///
    /// # Errors
    /// When the system has no thread to give.
    pub(crate) fn post(root: &Path) -> io::Result<Self> {
        let parts: Vec<PathBuf> = std::iter::once(root.to_owned()).chain(PARTS.map(|part| root.join(part))).collect();
        Self::looking(move || {
            for part in &parts {
                // Of all looks, this one is never answered from a memory of earlier ones; an error is an answer.
                let _ = rustix::fs::statvfs(part);
            }
        })
    }

    fn looking(look: impl Fn() + Send + 'static) -> io::Result<Self> {
        let (ask, asks) = unbounded();
        let asked = Arc::new(Asked::default());
        let owed = Arc::clone(&asked);
        // Never waited for: it may hang, and ends with the process then.
        std::thread::Builder::new().name("sentinel".into()).spawn(move || {
            for () in asks {
                look();
                *owed.state() = State { since: None, last: Some(Instant::now()) };
                owed.answered.notify_all();
            }
        })?;
        Ok(Self { ask, asked })
    }

    /// Asks, if no answer is owed yet, and waits a moment for it.
    pub(crate) fn answers(&self) -> Answer {
        self.answers_within(AT_ONCE)
    }

    /// As [`Sentinel::answers`], for who has time: waits until the folder answers, or is silent. An answer of late is enough.
    pub(crate) fn answers_at_last(&self) -> Answer {
        let is_owed = |state: &State| state.since.is_some() || state.last.is_none_or(|last| last.elapsed() >= HOLDS);
        if is_owed(&self.asked.state()) { self.answers_within(PATIENCE) } else { Answer::Yes }
    }

    fn answers_within(&self, wait: Duration) -> Answer {
        let mut state = self.asked.state();
        if state.since.is_none() {
            // The thread lives as long as this does.
            let _ = self.ask.send(());
        }
        // Together nobody waits longer than for one silence.
        let since = *state.since.get_or_insert_with(Instant::now);
        let wait = wait.min(PATIENCE.saturating_sub(since.elapsed()));
        let waited = self.asked.answered.wait_timeout_while(state, wait, |state| state.since.is_some());
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        match state.since {
            None => Answer::Yes,
            Some(since) if since.elapsed() >= PATIENCE => Answer::Silent,
            Some(_) => Answer::NotYet,
        }
    }

    /// Has the folder not answered for a long time? Asks nothing.
    pub(crate) fn is_silent(&self) -> bool {
        self.asked.state().since.is_some_and(|since| since.elapsed() >= PATIENCE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_hangs_is_asked_once_and_not_waited_for() {
        let (go, gate) = unbounded::<()>();
        let (looked, looks) = unbounded();
        let sentinel = Sentinel::looking(move || {
            looked.send(()).unwrap();
            gate.recv().unwrap();
        })
        .unwrap();
        assert_eq!(sentinel.answers(), Answer::NotYet);
        assert_eq!(sentinel.answers(), Answer::NotYet);
        looks.recv().unwrap();
        assert!(looks.is_empty() && !sentinel.is_silent(), "it is asked once");
        sentinel.asked.state().since = Some(Instant::now().checked_sub(PATIENCE).unwrap());
        assert_eq!((sentinel.answers(), sentinel.is_silent()), (Answer::Silent, true));
        go.send(()).unwrap();
        go.send(()).unwrap();
        while sentinel.is_silent() {
            std::thread::yield_now();
        }
        assert_eq!((sentinel.answers_at_last(), sentinel.is_silent()), (Answer::Yes, false), "it is back");
    }

    #[test]
    fn a_folder_that_is_not_there_answers() {
        let sentinel = Sentinel::post(Path::new("/nowhere/at/all")).unwrap();
        assert_eq!(sentinel.answers_at_last(), Answer::Yes);
    }
}
