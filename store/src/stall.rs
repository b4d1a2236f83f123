//! Which calls into the database are under way. sled 0.34 waits, now and then, for ever after a write that failed (a buffer that no one
//! writes any more): no error comes of it, and no call returns. Whoever lives with it looks here, and begins anew.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

static CALLS: Mutex<(u64, BTreeMap<u64, Instant>)> = Mutex::new((0, BTreeMap::new()));

fn calls() -> MutexGuard<'static, (u64, BTreeMap<u64, Instant>)> {
    // Numbers and times: whole whatever panicked meanwhile.
    CALLS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A call under way, until it is dropped.
pub(crate) struct Call(u64);

impl Call {
    pub(crate) fn begin() -> Self {
        let mut calls = calls();
        calls.0 += 1;
        let id = calls.0;
        calls.1.insert(id, Instant::now());
        Self(id)
    }
}

impl Drop for Call {
    fn drop(&mut self) {
        calls().1.remove(&self.0);
    }
}

/// How long the oldest call into the database of this process has been under way.
pub fn oldest_call() -> Option<Duration> {
    calls().1.values().next().map(Instant::elapsed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_counts_until_it_ends() {
        // Other tests' stores come and go meanwhile.
        let call = Call::begin();
        std::thread::sleep(Duration::from_millis(20));
        assert!(oldest_call().is_some_and(|age| age >= Duration::from_millis(20)));
        let id = call.0;
        drop(call);
        assert!(!calls().1.contains_key(&id));
    }
}
