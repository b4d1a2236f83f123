//! Signals: how many of Ctrl-C and SIGTERM there have been, and whether SIGHUP came.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

/// Set by the first signal to stop; the second ends the process at once (workers die with it).
#[derive(Clone, Default)]
pub(crate) struct Stop(Arc<AtomicBool>);

/// Exit status after a second signal: as of a process ended by SIGINT.
const AT_ONCE: i32 = 130;

impl Stop {
    /// Starts listening.
    ///
    /// # Errors
    /// When the handlers cannot be set.
    pub(crate) fn listen() -> std::io::Result<Self> {
        let stop = Self::default();
        for signal in [SIGINT, SIGTERM] {
            // In this order: the first signal finds the flag unset, and only sets it.
            signal_hook::flag::register_conditional_shutdown(signal, AT_ONCE, Arc::clone(&stop.0))?;
            signal_hook::flag::register(signal, Arc::clone(&stop.0))?;
        }
        Ok(stop)
    }

    /// Has there been a signal?
    pub(crate) fn asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Set by SIGHUP, which then does not end the process: the configuration is to be read anew.
#[derive(Clone, Default)]
pub(crate) struct Hangup(Arc<AtomicBool>);

impl Hangup {
    /// Starts listening.
    ///
    /// # Errors
    /// When the handler cannot be set.
    pub(crate) fn listen() -> std::io::Result<Self> {
        let hangup = Self::default();
        signal_hook::flag::register(SIGHUP, Arc::clone(&hangup.0))?;
        Ok(hangup)
    }

    /// As if it came.
    #[cfg(test)]
    pub(crate) fn raise(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Has there been one since the last call?
    pub(crate) fn came(&self) -> bool {
        self.0.swap(false, Ordering::Relaxed)
    }
}
