//! The web interface: HTTP beside the daemon, in one thread of its own.
//!
//! The engine and the daemon are threads and stay so. This one has a small asynchronous runtime, because clients may be many, slow and
//! hostile. What touches the job store or a disk runs on its few blocking threads. It starts only when the configuration says so, and what
//! becomes of it is never the daemon's trouble: one that panics is begun anew, and nothing of the daemon waits for it.
//!
//! `routes` is the table of all that can be asked; everything passes `guard` first.

use std::io;
use std::net::TcpListener;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use crate::attempt::Context;
use crate::config::api::Api;

mod ask;
mod drawing;
mod files;
mod flow;
mod guard;
mod health;
mod hosts;
mod intake;
mod jobs;
mod metrics;
mod pages;
mod patience;
mod preview;
mod problem;
mod reported;
mod routes;
mod seats;
mod server;
mod sessions;
mod shared;
mod status;
mod stream;
mod tally;
mod tokens;
mod upload;
mod verified;

use shared::Shared;
use tokens::Tokens;

/// Rest before a web interface that ended in an error is begun anew.
const REST: Duration = Duration::from_secs(1);
/// How long the daemon's end waits for answers under way.
const GOODBYE: Duration = Duration::from_secs(2);

/// The address is taken, the tokens are read; no one is answered yet.
pub(crate) struct Web {
    api: Api,
    tokens: Tokens,
    listener: TcpListener,
}

impl Web {
    /// Takes the address and reads the tokens.
    ///
    /// # Errors
    /// A line for people, and what kept it.
    pub(crate) fn bind(api: &Api) -> Result<Self, (String, io::Error)> {
        let tokens = Tokens::of(api.token_file.as_deref())?;
        let listener = TcpListener::bind(api.listen)
            .and_then(|listener| listener.set_nonblocking(true).map(|()| listener))
            .map_err(|error| {
                (format!("cannot listen at {}: {error}; choose another address for the web interface", api.listen), error)
            })?;
        Ok(Self { api: api.clone(), tokens, listener })
    }

    /// Answers from now on.
    ///
    /// # Errors
    /// When no thread is to be had.
    pub(crate) fn start(&self, context: &Arc<Context>) -> io::Result<Serving> {
        let ended = Arc::<AtomicBool>::default();
        let shared = Arc::new(Shared::new(Arc::clone(context), self.api.clone(), self.tokens.clone())?);
        let (listener, stop) = (self.listener.try_clone()?, Arc::clone(&ended));
        let address = self.listener.local_addr().unwrap_or(self.api.listen);
        tracing::info!(%address, "Serving the web interface.");
        let thread = Builder::new().name("web".into()).spawn(move || keep_serving(&listener, &shared, &stop))?;
        Ok(Serving { ended, thread })
    }
}

/// A web interface that answers.
pub(crate) struct Serving {
    ended: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Serving {
    /// Answers no more. One that hangs is left to itself.
    pub(crate) fn stop(self) {
        self.ended.store(true, Ordering::Relaxed);
        let asked = Instant::now();
        while !self.thread.is_finished() && asked.elapsed() < GOODBYE {
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

fn keep_serving(listener: &TcpListener, shared: &Arc<Shared>, ended: &AtomicBool) {
    while !ended.load(Ordering::Relaxed) {
        let served = catch_unwind(AssertUnwindSafe(|| {
            let stop = || ended.load(Ordering::Relaxed);
            server::serve(listener.try_clone()?, routes::router(Arc::clone(shared)), &stop)
        }));
        match served {
            Ok(Ok(())) => {}
            Ok(Err(error)) => tracing::error!(%error, "The web interface failed, and is begun anew."),
            Err(_) => tracing::error!("The web interface ended in an internal error, and is begun anew."),
        }
        if !ended.load(Ordering::Relaxed) {
            std::thread::sleep(REST);
        }
    }
}
