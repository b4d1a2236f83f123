//! The largest anonymous memory of this process over a span of time, which the system does not count by itself.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError, Weak};
use std::time::Duration;

use crate::util::{cost, parallel};

/// Time between two looks: what is taken for a shorter time may be missed.
const BETWEEN: Duration = Duration::from_millis(20);

/// Spans that are watched by one thread, which is started by the first of them, sleeps while there are none, and lives as long as the process.
#[derive(Default)]
struct Watch {
    spans: Vec<Weak<AtomicU64>>,
    is_running: bool,
}

static WATCH: Mutex<Watch> = Mutex::new(Watch { spans: Vec::new(), is_running: false });
static BEGUN: Condvar = Condvar::new();

/// The largest anonymous memory since this was made.
pub(crate) struct Peak(Arc<AtomicU64>);

impl Peak {
    /// Begins a span. Takes microseconds, but for the first one, which starts a thread; without that thread, only [`Self::look`] looks.
    pub(crate) fn begin() -> Self {
        let bytes = Arc::new(AtomicU64::new(0));
        let mut watch = WATCH.lock().unwrap_or_else(PoisonError::into_inner);
        watch.spans.push(Arc::downgrade(&bytes));
        if !watch.is_running {
            watch.is_running = parallel::servant("memory", look_on).is_some();
        }
        BEGUN.notify_one();
        Self(bytes)
    }

    /// Looks once more: at the end of a stage, since short ones pass between two looks of the thread. Microseconds.
    pub(crate) fn look(&self) {
        self.0.fetch_max(cost::anonymous_bytes(), Ordering::Relaxed);
    }

    /// The largest so far.
    pub(crate) fn bytes(&self) -> u64 {
        self.look();
        self.0.load(Ordering::Relaxed)
    }
}

/// Looks at the memory as long as any span lasts.
fn look_on() {
    let mut watch = WATCH.lock().unwrap_or_else(PoisonError::into_inner);
    loop {
        let lasting: Vec<Arc<AtomicU64>> = watch.spans.iter().filter_map(Weak::upgrade).collect();
        if lasting.is_empty() {
            watch.spans.clear();
            watch = BEGUN.wait(watch).unwrap_or_else(PoisonError::into_inner);
            continue;
        }
        watch.spans.retain(|span| span.strong_count() > 0);
        drop(watch);
        let now = cost::anonymous_bytes();
        lasting.into_iter().for_each(|bytes| {
            bytes.fetch_max(now, Ordering::Relaxed);
        });
        std::thread::sleep(BETWEEN);
        watch = WATCH.lock().unwrap_or_else(PoisonError::into_inner);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Memory that is given back before anyone asks was seen; a span that begins later does not count it.
    #[test]
    fn what_is_given_back_was_seen() {
        let much = 256 << 20;
        let before = Peak::begin();
        let filled = vec![1_u8; much];
        std::thread::sleep(10 * BETWEEN);
        assert_eq!(std::hint::black_box(&filled).len(), much);
        drop(filled);
        let behind = Peak::begin();
        std::thread::sleep(10 * BETWEEN);
        // Other tests of this process take memory too: half of it is a bound that they do not reach.
        assert!(before.bytes() > behind.bytes() + much as u64 / 2, "{} {}", before.bytes(), behind.bytes());
    }
}
