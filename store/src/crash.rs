//! Crash points: named places where a test may have the process killed, as a power cut would, without clean-up.
//!
//! In a build with the feature `crash-points` (never a released one) two environment variables are read:
//! * `SUTURE_CRASH_AT=name:k` sends the process SIGKILL at its `k`-th pass (from 1) through the point `name`; the name `*`
//!   counts the passes through all points together.
//! * `SUTURE_CRASH_TRACE=file` appends each pass's name to `file`, one a line: how a test learns which points there are and how
//!   often a run passes them.
//!
//! With the feature `testkit` a test learns of the passes of its own thread (`testkit::at_crash_points`). Without either [`crash_point`] is an
//! empty function.

/// Names this place. Names are `crate.step`, lower case.
#[inline(always)]
#[cfg_attr(not(any(feature = "crash-points", feature = "testkit")), allow(unused_variables, reason = "it is empty then"))]
pub fn crash_point(name: &'static str) {
    #[cfg(feature = "testkit")]
    watched::pass(name);
    #[cfg(feature = "crash-points")]
    armed::crash_point(name);
}

#[cfg(feature = "testkit")]
pub use watched::at_crash_points;

#[cfg(feature = "testkit")]
mod watched {
    use std::cell::RefCell;
    use std::rc::Rc;

    type Watch = Rc<dyn Fn(&'static str)>;

    thread_local! {
        static WATCH: RefCell<Option<Watch>> = const { RefCell::new(None) };
    }

    /// Has `watch` be called with the name of each crash point that this thread passes, or no one any more. It may unwind: so a
    /// simulation ends a daemon without ending the process.
    pub fn at_crash_points(watch: Option<Watch>) {
        WATCH.with(|slot| *slot.borrow_mut() = watch);
    }

    pub(super) fn pass(name: &'static str) {
        let watch = WATCH.with(|slot| slot.borrow().clone());
        if let Some(watch) = watch {
            watch(name);
        }
    }
}

#[cfg(feature = "crash-points")]
mod armed {
    use std::fs::File;
    use std::io::Write;
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::sync::{Mutex, OnceLock};

    struct Plan {
        at: Option<(String, u64)>,
        trace: Option<Mutex<File>>,
        passes: AtomicU64,
    }

    fn plan() -> &'static Plan {
        static PLAN: OnceLock<Plan> = OnceLock::new();
        PLAN.get_or_init(|| {
            let at = std::env::var("SUTURE_CRASH_AT").ok().and_then(|text| {
                let (name, pass) = text.rsplit_once(':')?;
                Some((name.to_owned(), pass.parse().ok()?))
            });
            let trace = std::env::var_os("SUTURE_CRASH_TRACE")
                .and_then(|path| File::options().create(true).append(true).open(path).ok())
                .map(Mutex::new);
            Plan { at, trace, passes: AtomicU64::new(0) }
        })
    }

    /// Names this place; kills the process here when the environment says so.
    pub(super) fn crash_point(name: &'static str) {
        let plan = plan();
        if let Some(trace) = &plan.trace {
            let mut file = trace.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            // One write per line: lines of several processes do not mix. A trace that cannot be written fails the test that
            // reads it, not the process.
            let _ = file.write_all(format!("{name}\n").as_bytes());
        }
        if let Some((wanted, pass)) = &plan.at
            && (wanted == name || wanted == "*")
            && plan.passes.fetch_add(1, Ordering::SeqCst) + 1 == *pass
        {
            let _ = rustix::process::kill_process(rustix::process::getpid(), rustix::process::Signal::KILL);
            // The signal is delivered before the call returns; should the system refuse it, end without clean-up all the same.
            std::process::abort();
        }
    }
}
