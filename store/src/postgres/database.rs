//! Connections to the database, few and kept, and calls that outlive its restart.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use sqlx::ConnectOptions;
use sqlx::postgres::{PgConnectOptions, PgConnection};
use tokio::runtime::{Handle, Runtime};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};

use super::outage::Outage;
use crate::id::Clock;
use crate::patience::is_hurried;
use crate::store::StoreError;

/// A connection that does not come about for so long is given up, and tried again.
const CONNECT: Duration = Duration::from_secs(5);
/// A call that is not answered for so long is given up with its connection.
const CALL: Duration = Duration::from_secs(60);
/// The same of all of a call that is to be brief, its connection included.
const BRIEF: Duration = Duration::from_secs(2);
/// First and longest pause before a call is tried again.
const PAUSES: (Duration, Duration) = (Duration::from_millis(10), Duration::from_secs(1));

/// Why a call failed.
#[derive(Debug)]
pub(super) enum Failure {
    /// The store says no.
    Store(StoreError),
    /// The database, or the way to it, failed.
    Database(sqlx::Error),
}

impl From<sqlx::Error> for Failure {
    fn from(error: sqlx::Error) -> Self {
        Self::Database(error)
    }
}

impl From<StoreError> for Failure {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

impl From<Failure> for StoreError {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Store(error) => error,
            Failure::Database(error) => Self::Backend(Box::new(error)),
        }
    }
}

impl Failure {
    /// May the same call succeed later: the database restarts, fails over, or two transactions were in each other's way?
    fn passes(&self) -> bool {
        let Self::Database(error) = self else { return false };
        match error {
            sqlx::Error::Database(error) => {
                self.is_outage() || error.code().is_some_and(|code| ["40", "55P03"].iter().any(|class| code.starts_with(class)))
            }
            _ => self.is_outage(),
        }
    }

    /// Is the database, or the way to it, away?
    fn is_outage(&self) -> bool {
        let Self::Database(error) = self else { return false };
        match error {
            sqlx::Error::Io(_) | sqlx::Error::Protocol(_) | sqlx::Error::Tls(_) => true,
            sqlx::Error::Database(error) => error.code().is_some_and(|code| {
                // A standby that has not taken over yet refuses to write.
                ["08", "53", "57P"].iter().any(|class| code.starts_with(class)) || code == "25006"
            }),
            _ => false,
        }
    }

    /// A certificate that is not trusted: that does not pass by itself, but a server that starts may show another one for a moment.
    fn is_distrust(&self) -> bool {
        match self {
            Self::Database(sqlx::Error::Tls(_)) => true,
            Self::Database(sqlx::Error::Io(error)) => error.kind() == io::ErrorKind::InvalidData,
            _ => false,
        }
    }
}

/// May a call be made again whose outcome is unknown?
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Again {
    /// It sees for itself whether it was done.
    Yes,
    /// It would be done twice.
    No,
}

/// The database, by a bounded number of connections.
pub(super) struct Database {
    options: PgConnectOptions,
    idle: Mutex<Vec<PgConnection>>,
    permits: Semaphore,
    patience: Duration,
    pub(super) outage: Outage,
    /// A connection came about once: what does not pass for a beginner may pass now.
    was_there: AtomicBool,
    /// Tests set the time; else the database's counts, and no other.
    clock: Option<Arc<dyn Clock>>,
}

impl Database {
    /// `place`: where it is, for people.
    pub(super) fn new(
        options: PgConnectOptions,
        place: String,
        connections: u32,
        patience: Duration,
        clock: Option<Arc<dyn Clock>>,
    ) -> Self {
        let permits = Semaphore::new(usize::try_from(connections.max(1)).unwrap_or(1));
        let options = options.disable_statement_logging();
        let (outage, was_there) = (Outage::new(place), AtomicBool::new(false));
        Self { options, idle: Mutex::new(Vec::new()), permits, patience, outage, was_there, clock }
    }

    /// How to reach it, for a connection beside those that are counted.
    pub(super) fn options(&self) -> PgConnectOptions {
        self.options.clone()
    }

    fn idle(&self) -> std::sync::MutexGuard<'_, Vec<PgConnection>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }

    async fn connection(&self) -> Result<PgConnection, Failure> {
        let idle = self.idle().pop();
        let mut connection = match idle {
            Some(connection) => connection,
            None => timeout(CONNECT, self.options.connect()).await.map_err(|_| late())??,
        };
        self.was_there.store(true, Ordering::Relaxed);
        if let Some(clock) = &self.clock {
            let now = clock.now().0.to_string();
            sqlx::query("SELECT set_config('suture.now', $1, false)").bind(now).execute(&mut connection).await?;
        }
        Ok(connection)
    }

    /// One try of a call; its connection is kept if all went well. Whether the call itself was begun comes with a failure.
    async fn once<T>(&self, call: &impl AsyncFn(&mut PgConnection) -> Result<T, Failure>) -> Result<T, (bool, Failure)> {
        let _permit = self.permits.acquire().await.map_err(|_| (false, late()))?;
        let mut connection = self.connection().await.map_err(|failure| (false, failure))?;
        match timeout(CALL, call(&mut connection)).await.unwrap_or_else(|_| Err(late())) {
            Ok(value) => {
                self.idle().push(connection);
                Ok(value)
            }
            Err(failure) => {
                // A transaction that was not ended is taken back before the connection's next statement.
                if matches!(failure, Failure::Store(_)) {
                    self.idle().push(connection);
                }
                Err((true, failure))
            }
        }
    }

    /// A call, tried again while the database is away, up to the patience; one that is to be brief is given up soon.
    pub(super) async fn call<T>(
        &self,
        again: Again,
        is_brief: bool,
        call: impl AsyncFn(&mut PgConnection) -> Result<T, Failure>,
    ) -> Result<T, StoreError> {
        let (began, mut pause) = (Instant::now(), PAUSES.0);
        loop {
            if is_brief && self.outage.is_certain() {
                return Err(self.outage.error());
            }
            let once = self.once(&call);
            let done = if is_brief { timeout(BRIEF, once).await.unwrap_or_else(|_| Err((true, late()))) } else { once.await };
            let (begun, failure) = match done {
                Ok(value) => {
                    self.outage.end();
                    return Ok(value);
                }
                Err(failed) => failed,
            };
            let is_outage = failure.is_outage();
            if !is_outage {
                self.outage.end();
            }
            if failure.is_distrust() && !self.was_there.load(Ordering::Relaxed) {
                return Err(self.outage.distrust(&told(&failure.into())));
            }
            if !failure.passes() || (begun && again == Again::No) {
                return Err(failure.into());
            }
            // Connections of before the failure are as dead as this one.
            self.idle().clear();
            let error = StoreError::from(failure);
            if is_outage {
                self.outage.go_on(&told(&error));
            }
            let patience = if is_brief || is_hurried() { BRIEF.min(self.patience) } else { self.patience };
            if began.elapsed() >= patience {
                return Err(if is_outage { self.outage.error() } else { error });
            }
            sleep(pause).await;
            pause = (2 * pause).min(PAUSES.1);
        }
    }
}

/// Why, without the words that go before it.
fn told(error: &StoreError) -> String {
    std::error::Error::source(error).map_or_else(|| error.to_string(), ToString::to_string)
}

fn late() -> Failure {
    Failure::Database(sqlx::Error::Io(io::Error::new(io::ErrorKind::TimedOut, "no answer in time")))
}

/// Runs a call to its end, also for callers that are part of a runtime themselves: those must not be blocked by another one, so that a thread
/// waits in their place.
pub(super) fn wait<T: Send>(runtime: &Runtime, call: impl AsyncFn() -> Result<T, StoreError> + Sync) -> Result<T, StoreError> {
    if Handle::try_current().is_err() {
        return runtime.block_on(call());
    }
    let waited = std::thread::scope(|scope| scope.spawn(|| runtime.block_on(call())).join());
    waited
        .unwrap_or_else(|_| Err(StoreError::Poisoned { reason: "a call of the job database ended in an internal error".into() }))
}
