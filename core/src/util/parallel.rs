//! Work on numbered items by a few threads, results in the items' order.
//!
//! All threads of the crate start here. More than the caller's own are a help, never a need: where the system gives none (a limit of
//! processes), the caller does the work itself, with the same result.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread::{Builder, JoinHandle, Scope, ScopedJoinHandle};

use rayon::ThreadPoolBuilder;

/// Threads a processor, at most: more would only cost their starts.
const MOST_A_PROCESSOR: usize = 4;

/// So many threads of those asked for are of use on this machine.
fn useful(threads: usize) -> usize {
    static MOST: OnceLock<usize> = OnceLock::new();
    threads.min(*MOST.get_or_init(|| MOST_A_PROCESSOR * std::thread::available_parallelism().map_or(1, usize::from)))
}

/// Runs `work` on a rayon pool of so many threads.
pub(crate) fn in_pool<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    let threads = useful(threads);
    if rayon::current_thread_index().is_some() && rayon::current_num_threads() == threads {
        return work();
    }
    if let Ok(pool) = ThreadPoolBuilder::new().num_threads(threads).build() {
        return pool.install(work);
    }
    if rayon::current_thread_index().is_some() {
        return work();
    }
    match ThreadPoolBuilder::new().num_threads(1).use_current_thread().build() {
        Ok(pool) => {
            let result = pool.install(work);
            // This thread belongs to the pool from now on: the pool must not end before it.
            std::mem::forget(pool);
            result
        }
        Err(_) => work(),
    }
}

/// Work that one thread takes out to do it: the thread that was started for it, or its maker.
struct Todo<F>(Mutex<Option<F>>);

impl<F> Todo<F> {
    fn new(work: F) -> Self {
        Self(Mutex::new(Some(work)))
    }

    fn run<R>(&self) -> R
    where
        F: FnOnce() -> R,
    {
        let work = self.0.lock().unwrap_or_else(PoisonError::into_inner).take();
        #[expect(
            clippy::expect_used,
            reason = "both takers are in this module: the maker takes only what no thread was started for"
        )]
        work.expect("work is taken out once")()
    }
}

/// Both results, side by side where there is more than one thread.
pub(crate) fn both<A, B: Send>(threads: usize, a: impl FnOnce() -> A, b: impl FnOnce() -> B + Send) -> (A, B) {
    if threads < 2 {
        return (a(), b());
    }
    let b = Todo::new(b);
    std::thread::scope(|scope| match Builder::new().spawn_scoped(scope, || b.run()) {
        Ok(other) => {
            let a = a();
            (a, other.join().unwrap_or_else(|panic| resume_unwind(panic)))
        }
        Err(_) => (a(), b.run()),
    })
}

/// Work that goes on beside its maker's.
pub(crate) enum Aside<R> {
    Thread(JoinHandle<R>),
    /// No thread was to be had.
    Done(R),
}

impl<R: Send + 'static> Aside<R> {
    /// Begins `work` on a thread of that name; where none is to be had, does it at once.
    pub(crate) fn start<F: FnOnce() -> R + Send + 'static>(name: &str, work: F) -> Self {
        let todo = Arc::new(Todo::new(work));
        let other = Arc::clone(&todo);
        match Builder::new().name(name.into()).spawn(move || other.run()) {
            Ok(thread) => Self::Thread(thread),
            Err(_) => Self::Done(todo.run()),
        }
    }

    /// Waits for its end. A panic of it goes on here.
    pub(crate) fn join(self) -> R {
        match self {
            Self::Thread(thread) => thread.join().unwrap_or_else(|panic| resume_unwind(panic)),
            Self::Done(result) => result,
        }
    }
}

/// A thread that serves its maker until it is told to end; `None` where none is to be had.
pub(crate) fn servant<R: Send + 'static>(name: &str, work: impl FnOnce() -> R + Send + 'static) -> Option<JoinHandle<R>> {
    Builder::new().name(name.into()).spawn(work).ok()
}

/// The same within a scope.
pub(crate) fn scoped_servant<'scope, R: Send + 'scope>(
    scope: &'scope Scope<'scope, '_>,
    name: &str,
    work: impl FnOnce() -> R + Send + 'scope,
) -> Option<ScopedJoinHandle<'scope, R>> {
    Builder::new().name(name.into()).spawn_scoped(scope, work).ok()
}

/// `work(0..count)` on `threads` threads; `result[i]` is `work(i)`, whatever thread ran it.
pub(crate) fn map<R: Send>(threads: usize, count: usize, work: impl Fn(usize) -> R + Sync) -> Vec<R> {
    map_with(threads, count, || (), |(), i| work(i))
}

/// The findings at each of these, in order. `find` is given one with its place, and adds to the second list; it is lent the first one, to be used again.
pub(crate) fn gather<T: Copy + Sync, R: Send>(
    threads: usize,
    all: &[T],
    find: impl Fn(&mut Vec<u32>, (usize, T), &mut Vec<R>) + Sync,
) -> Vec<R> {
    /// A thread takes so many at once.
    const BLOCK: usize = 1 << 12;
    let blocks = map_with(threads, all.len().div_ceil(BLOCK), Vec::new, |lent, block| {
        let mut found = Vec::new();
        let own = all.iter().copied().enumerate().skip(block * BLOCK).take(BLOCK);
        own.for_each(|one| find(lent, one, &mut found));
        found
    });
    blocks.into_iter().flatten().collect()
}

/// As [`map`]; each thread makes one `scratch` and uses it for all its items.
pub(crate) fn map_with<S, R: Send>(
    threads: usize,
    count: usize,
    scratch: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, usize) -> R + Sync,
) -> Vec<R> {
    let threads = useful(threads).clamp(1, count.max(1));
    if threads == 1 {
        let mut s = scratch();
        return (0..count).map(|i| work(&mut s, i)).collect();
    }
    // Many small items are taken some at a time: each would cost less than to take it, and to put it in its place.
    let run = (count / (threads * RUNS)).max(1);
    let next = AtomicUsize::new(0);
    let take = || {
        let mut s = scratch();
        let mut done = Vec::new();
        loop {
            let first = next.fetch_add(run, Ordering::Relaxed);
            if first >= count {
                return done;
            }
            let results: Vec<R> = (first..count.min(first + run)).map(|i| work(&mut s, i)).collect();
            done.push((first, results));
        }
    };
    let mut all: Vec<(usize, Vec<R>)> = std::thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map_while(|_| Builder::new().spawn_scoped(scope, take).ok()).collect();
        let mut all = take();
        for other in others {
            // A panic in one worker is a bug in the engine: let it surface as it is.
            all.extend(other.join().unwrap_or_else(|panic| resume_unwind(panic)));
        }
        all
    });
    all.sort_unstable_by_key(|(first, _)| *first);
    let mut results = Vec::with_capacity(count);
    all.into_iter().for_each(|(_, of_run)| results.extend(of_run));
    results
}

/// So many runs of items a thread, at least, so that what takes long is shared.
const RUNS: usize = 1024;

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn results_are_the_same_with_and_without_other_threads() {
        for threads in [1, 2, 5] {
            assert_eq!(map(threads, 7, |i| i * i), [0, 1, 4, 9, 16, 25, 36]);
            assert_eq!(map(threads, 50_001, |i| i), (0..50_001).collect::<Vec<_>>());
            assert_eq!(both(threads, || 1, || 2), (1, 2));
        }
        assert_eq!(Aside::start("test", || 3).join(), 3);
        assert_eq!(Aside::Done(3).join(), 3);
    }

    /// A machine at its limit of processes made a file's worker panic, and the file was quarantined for it.
    #[test]
    fn no_other_module_starts_threads() {
        fn search(folder: &Path) {
            for entry in std::fs::read_dir(folder).unwrap().flatten() {
                let path = entry.path();
                if path.is_dir() {
                    search(&path);
                    continue;
                }
                let text = std::fs::read_to_string(&path).unwrap();
                let product = text.split("#[cfg(test)]").next().unwrap();
                let starts = ["thread::spawn", "thread::Builder", ".spawn(", ".spawn_scoped(", "ThreadPoolBuilder"];
                assert!(
                    path.ends_with("parallel.rs") || !starts.iter().any(|start| product.contains(start)),
                    "{}",
                    path.display()
                );
            }
        }
        search(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    }
}
