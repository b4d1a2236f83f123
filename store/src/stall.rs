//! Which calls into the database are under way. sled 0.34 waits, now and then, for ever after a write that failed (a buffer that no one
//! writes any more): no error comes of it, and no call returns. Whoever lives with it looks here, and begins anew.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// A call into the database that has not returned.
#[derive(Clone, Copy, Debug)]
pub struct UnderWay {
    /// When it began.
    pub since: Instant,
    /// Number of the thread that waits for it (`gettid`).
    pub thread: u32,
}

static CALLS: Mutex<(u64, BTreeMap<u64, UnderWay>)> = Mutex::new((0, BTreeMap::new()));

fn calls() -> MutexGuard<'static, (u64, BTreeMap<u64, UnderWay>)> {
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
        let thread = rustix::thread::gettid().as_raw_nonzero().get().cast_unsigned();
        calls.1.insert(id, UnderWay { since: Instant::now(), thread });
        Self(id)
    }
}

impl Drop for Call {
    fn drop(&mut self) {
        calls().1.remove(&self.0);
    }
}

/// The calls into the database of this process that are under way, the oldest first.
pub fn under_way() -> Vec<UnderWay> {
    calls().1.values().copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_counts_until_it_ends() {
        // Other tests' stores come and go meanwhile.
        let call = Call::begin();
        let id = call.0;
        let own = rustix::thread::gettid().as_raw_nonzero().get().cast_unsigned();
        assert!(under_way().iter().any(|call| call.thread == own));
        drop(call);
        assert!(!calls().1.contains_key(&id));
    }
}
