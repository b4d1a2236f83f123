//! Sees when a call into the job database will never return ([`suture_store::stall`]), and begins the program anew then. A disk that is only
//! slow is not mistaken for that: whoever waits for a disk cannot be interrupted, and the system says so of the thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use suture_store::stall::oldest_call;

use crate::again::Lives;
use crate::exit::Exit;
use crate::say::complain;
use crate::signals::Stop;

const LOOK_EVERY: Duration = Duration::from_millis(500);
/// Looks in a row at which a call hangs and no thread waits for a disk.
const LOOKS: u32 = 20;

/// Watches from a thread of its own until the process ends. Where no thread is to be had, there is no watch.
pub(crate) fn start(lives: Lives, not_good: Arc<AtomicBool>, stop: Stop) {
    let born = Instant::now();
    let watch = move || {
        let mut looks = 0;
        loop {
            std::thread::sleep(LOOK_EVERY);
            let hangs = oldest_call().is_some_and(|age| age >= LOOK_EVERY) && !waits_for_a_disk();
            looks = if hangs { looks + 1 } else { 0 };
            if looks < LOOKS {
                continue;
            }
            tracing::error!("A call into the job database does not return.");
            lives.begin_another(born.elapsed(), not_good.load(Ordering::Relaxed), &|| stop.asked());
            complain(&"the job database does not answer after an error of its disk; try again");
            // Nothing that could be waited for ends any more.
            std::process::exit(i32::from(Exit::TryAgain.code()));
        }
    };
    if let Err(error) = std::thread::Builder::new().name("watchdog".into()).spawn(watch) {
        tracing::debug!(%error, "The job database is not watched.");
    }
}

/// Is a thread of this process in an uninterruptible wait, or at work?
fn waits_for_a_disk() -> bool {
    let own = rustix::thread::gettid().as_raw_nonzero().to_string();
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    tasks.filter(|task| task.file_name().to_str() != Some(&own)).any(|task| {
        let stat = std::fs::read_to_string(task.path().join("stat")).unwrap_or_default();
        // The name in parentheses may hold anything; the state is behind the last one.
        let state = stat.rsplit(')').next().and_then(|rest| rest.trim_start().chars().next());
        matches!(state, Some('D' | 'R'))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A thread at work is seen.
    #[test]
    fn a_busy_thread_is_no_hang() {
        let end = Arc::new(AtomicBool::new(false));
        let busy = {
            let end = Arc::clone(&end);
            std::thread::spawn(move || while !end.load(Ordering::Relaxed) {})
        };
        assert!((0..100).any(|_| waits_for_a_disk()));
        end.store(true, Ordering::Relaxed);
        busy.join().unwrap();
    }
}
