//! Work that Python can watch and end.
//!
//! The engine works on a thread of its own, without the interpreter. The caller's thread waits, handles signals (Ctrl-C is one), and tells a
//! callback where the work stands. An exception of either ends the work, and goes on to the caller once it has ended.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crossbeam::channel::{self, Receiver, RecvTimeoutError};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use suture_core::{Error, Progress};

use crate::errors::raise;

/// Between two looks at signals.
const PAUSE: Duration = Duration::from_millis(50);
/// For the thread that works: what a main thread has on Linux.
const STACK: usize = 8 << 20;

/// Where the work stands, and whether it is to end.
#[derive(Default)]
pub(crate) struct Watch {
    ended: AtomicBool,
    stands: Mutex<Option<(&'static str, u64, u64)>>,
}

impl Progress for Watch {
    fn at(&self, stage: &'static str, done: u64, total: u64) {
        if let Ok(mut stands) = self.stands.lock() {
            *stands = Some((stage, done, total));
        }
    }

    fn cancelled(&self) -> bool {
        self.ended.load(Ordering::Relaxed)
    }
}

/// Does `work` without the interpreter. `progress` is called with a stage, and how much of how much is done in it.
///
/// # Errors
/// That of the work, or whatever a handler of a signal or `progress` has raised.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Watch) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let watch = Watch::default();
    let (alive, is_alive) = channel::bounded::<()>(0);
    std::thread::scope(|scope| {
        let watch = &watch;
        let working = std::thread::Builder::new().name("suture".into()).stack_size(STACK).spawn_scoped(scope, move || {
            let result = work(watch);
            drop(alive);
            result
        });
        let working = working.map_err(|error| PyRuntimeError::new_err(format!("no thread can be started: {error}")))?;
        let raised = wait(py, watch, progress, &is_alive);
        if raised.is_err() {
            watch.ended.store(true, Ordering::Relaxed);
        }
        let result = py.detach(|| working.join());
        raised?;
        match result {
            Ok(result) => result.map_err(|error| raise(py, &error)),
            Err(panic) => Err(PyRuntimeError::new_err(format!("internal error, please report it: {}", words(panic.as_ref())))),
        }
    })
}

/// Until the work has ended, which lets go of the channel.
fn wait(py: Python<'_>, watch: &Watch, progress: Option<&Bound<'_, PyAny>>, is_alive: &Receiver<()>) -> PyResult<()> {
    while py.detach(|| is_alive.recv_timeout(PAUSE)) == Err(RecvTimeoutError::Timeout) {
        py.check_signals()?;
        let stands = watch.stands.lock().ok().and_then(|mut stands| stands.take());
        if let (Some(progress), Some(stands)) = (progress, stands) {
            progress.call1(stands)?;
        }
    }
    Ok(())
}

fn words(panic: &(dyn std::any::Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no words")
}
