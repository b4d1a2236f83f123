//! Signs of life of the daemon: for whoever asks from outside whether it lives, and whether it is ready for work.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use suture_store::{Clock, SystemClock, Time};

/// A look at a hot folder.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scan {
    pub at: Time,
    pub took: Duration,
}

/// Signs of one life of the daemon.
pub(crate) struct Pulse {
    born: Instant,
    /// Milliseconds from birth to the last beat.
    beat: AtomicU64,
    /// The last look at each hot folder.
    scanned: Mutex<BTreeMap<String, Scan>>,
    ending: AtomicBool,
    /// A command runs of which the daemon's end is to wait for a while.
    commanding: AtomicBool,
    /// So often the configuration was read anew.
    reloads: AtomicU64,
    /// Who cannot be told of ends of jobs, and why.
    troubles: Mutex<BTreeMap<String, String>>,
}

impl Pulse {
    /// Of a life that begins now.
    pub(crate) fn new() -> Self {
        Self {
            born: Instant::now(),
            beat: AtomicU64::new(0),
            scanned: Mutex::default(),
            ending: AtomicBool::new(false),
            commanding: AtomicBool::new(false),
            reloads: AtomicU64::new(0),
            troubles: Mutex::default(),
        }
    }

    /// The thread that looks after the folders goes on.
    pub(crate) fn beat(&self) {
        self.beat.store(u64::try_from(self.born.elapsed().as_millis()).unwrap_or(u64::MAX), Ordering::Relaxed);
    }

    /// Since the last beat.
    pub(crate) fn silence(&self) -> Duration {
        self.born.elapsed().saturating_sub(Duration::from_millis(self.beat.load(Ordering::Relaxed)))
    }

    /// A hot folder was looked at, whether it could be read or not.
    pub(crate) fn scanned(&self, folder: &str, took: Duration) {
        let scan = Scan { at: SystemClock.now(), took };
        self.scanned.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.to_owned(), scan);
    }

    /// The last look at this hot folder, if there was one.
    pub(crate) fn scan_of(&self, folder: &str) -> Option<Scan> {
        self.scanned.lock().unwrap_or_else(PoisonError::into_inner).get(folder).copied()
    }

    fn troubles(&self) -> MutexGuard<'_, BTreeMap<String, String>> {
        self.troubles.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// This target of events takes nothing now.
    pub(crate) fn trouble(&self, target: &str, why: String) {
        self.troubles().insert(target.to_owned(), why);
    }

    /// It does again.
    pub(crate) fn no_trouble(&self, target: &str) {
        self.troubles().remove(target);
    }

    /// Only these targets are left.
    pub(crate) fn keep_troubles(&self, is_there: &dyn Fn(&str) -> bool) {
        self.troubles().retain(|target, _| is_there(target));
    }

    /// Is it in trouble?
    pub(crate) fn has_trouble(&self, target: &str) -> bool {
        self.troubles().contains_key(target)
    }

    /// All targets that take nothing now, and why.
    pub(crate) fn all_troubles(&self) -> Vec<(String, String)> {
        self.troubles().iter().map(|(target, why)| (target.clone(), why.clone())).collect()
    }

    /// The configuration was read anew, whatever came of it.
    pub(crate) fn reloaded(&self) {
        self.reloads.fetch_add(1, Ordering::Relaxed);
    }

    /// How often it was.
    pub(crate) fn reloads(&self) -> u64 {
        self.reloads.load(Ordering::Relaxed)
    }

    /// The daemon takes nothing new any more.
    pub(crate) fn end(&self) {
        self.ending.store(true, Ordering::Relaxed);
    }

    /// A command begins, or has ended.
    pub(crate) fn command(&self, runs: bool) {
        self.commanding.store(runs, Ordering::Relaxed);
    }

    /// Does one run?
    pub(crate) fn has_command(&self) -> bool {
        self.commanding.load(Ordering::Relaxed)
    }

    /// Does it end?
    pub(crate) fn is_ending(&self) -> bool {
        self.ending.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_beat_ends_the_silence() {
        let pulse = Pulse::new();
        std::thread::sleep(Duration::from_millis(60));
        let silence = pulse.silence();
        pulse.beat();
        assert!(silence >= Duration::from_millis(60) && pulse.silence() < silence);
        pulse.scanned("hot", Duration::ZERO);
        assert!(pulse.scan_of("hot").is_some() && pulse.scan_of("other").is_none() && !pulse.is_ending());
    }
}
