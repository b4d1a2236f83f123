//! Sees when a call into the job database will never return ([`suture_store::stall`]). A disk that is only slow is not mistaken for that:
//! whoever waits for a disk cannot be interrupted, and the system says so of the thread.

use std::io;
use std::path::Path;
use std::time::Duration;

use suture_store::stall::{UnderWay, under_way};

const LOOK_EVERY: Duration = Duration::from_millis(500);
/// So many more looks at which a call hangs than at which it is served. A single look tells little: other threads have work of their own.
const LOOKS: u32 = 20;
/// How sled names the threads that write for it.
const DATABASE_THREADS: [&str; 2] = ["sled-io-", "log flusher"];

/// Watches from a thread of its own until the process ends, or a call hangs: then it does `on_hang`, and nothing more.
///
/// # Errors
/// Where no thread is to be had. The database needs threads, too, and would wait for them for ever.
pub(crate) fn start(on_hang: impl FnOnce() + Send + 'static) -> io::Result<()> {
    let watch = move || {
        let mut looks = 0;
        while looks < LOOKS {
            std::thread::sleep(LOOK_EVERY);
            looks = look(looks, &under_way());
        }
        tracing::error!("A call into the job database does not return.");
        on_hang();
    };
    std::thread::Builder::new().name("watchdog".into()).spawn(watch).map(drop)
}

/// How many looks count after this one.
fn look(looks: u32, calls: &[UnderWay]) -> u32 {
    match calls.first() {
        Some(oldest) if oldest.since.elapsed() < LOOK_EVERY => 0,
        None => 0,
        Some(_) if is_served(calls) => looks.saturating_sub(1),
        Some(_) => looks + 1,
    }
}

/// Does a thread wait for a disk, or is a thread of the database or one that waits for it at work?
fn is_served(calls: &[UnderWay]) -> bool {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    tasks.map(|task| task.path()).any(|task| {
        let stat = std::fs::read_to_string(task.join("stat")).unwrap_or_default();
        // The name in parentheses may hold anything; the state is behind the last one.
        match stat.rsplit(')').next().and_then(|rest| rest.trim_start().chars().next()) {
            Some('D') => true,
            Some('R') => is_of_database(&task, calls),
            _ => false,
        }
    })
}

fn is_of_database(task: &Path, calls: &[UnderWay]) -> bool {
    let number = task.file_name().and_then(|name| name.to_str()?.parse::<u32>().ok());
    let name = std::fs::read_to_string(task.join("comm")).unwrap_or_default();
    calls.iter().any(|call| Some(call.thread) == number) || DATABASE_THREADS.iter().any(|own| name.starts_with(own))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::time::Instant;

    use super::*;

    fn call(thread: u32) -> UnderWay {
        UnderWay { since: Instant::now().checked_sub(Duration::from_secs(1)).unwrap(), thread }
    }

    /// A caller at work is served; work of other threads says nothing about the call.
    #[test]
    fn only_work_for_the_call_counts() {
        let end = Arc::new(AtomicBool::new(false));
        let (busy, number) = {
            let (end, (tell, told)) = (Arc::clone(&end), std::sync::mpsc::channel());
            let work = move || {
                tell.send(rustix::thread::gettid().as_raw_nonzero().get().cast_unsigned()).unwrap();
                while !end.load(Ordering::Relaxed) {}
            };
            (std::thread::Builder::new().name("a busy keeper".into()).spawn(work).unwrap(), told.recv().unwrap())
        };
        let task = Path::new("/proc/self/task").join(number.to_string());
        assert!((0..100).any(|_| is_served(&[call(number)])));
        assert!(is_of_database(&task, &[call(number)]) && !is_of_database(&task, &[call(1)]));
        end.store(true, Ordering::Relaxed);
        busy.join().unwrap();
    }

    /// A young call begins the count anew, an old one that is not served adds to it.
    #[test]
    fn looks_add_up_only_while_a_call_hangs() {
        assert_eq!(look(7, &[]), 0);
        assert_eq!(look(7, &[UnderWay { since: Instant::now(), thread: 1 }]), 0);
        assert!([6, 8].contains(&look(7, &[call(1)])), "other tests may wait for a disk");
    }
}
