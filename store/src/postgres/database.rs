//! Connections to the database, few and kept, and calls that outlive its restart.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use sqlx::ConnectOptions;
use sqlx::postgres::{PgConnectOptions, PgConnection};
use tokio::runtime::{Handle, Runtime};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};

use crate::id::Clock;
use crate::store::StoreError;

/// A connection that does not come about for so long is given up, and tried again.
const CONNECT: Duration = Duration::from_secs(5);
/// A call that is not answered for so long is given up with its connection.
const CALL: Duration = Duration::from_secs(60);
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
            sqlx::Error::Io(_) | sqlx::Error::Protocol(_) | sqlx::Error::Tls(_) => true,
            sqlx::Error::Database(error) => error.code().is_some_and(|code| {
                let classes = ["08", "40", "53", "55P03", "57P"];
                // A standby that has not taken over yet refuses to write.
                classes.iter().any(|class| code.starts_with(class)) || code == "25006"
            }),
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
    /// Tests set the time; else the database's counts, and no other.
    clock: Option<Arc<dyn Clock>>,
}

impl Database {
    pub(super) fn new(options: PgConnectOptions, connections: u32, patience: Duration, clock: Option<Arc<dyn Clock>>) -> Self {
        let permits = Semaphore::new(usize::try_from(connections.max(1)).unwrap_or(1));
        Self { options: options.disable_statement_logging(), idle: Mutex::new(Vec::new()), permits, patience, clock }
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

    /// A call, tried again while the database is away, up to the patience.
    pub(super) async fn call<T>(
        &self,
        again: Again,
        call: impl AsyncFn(&mut PgConnection) -> Result<T, Failure>,
    ) -> Result<T, StoreError> {
        let (began, mut pause, mut told) = (Instant::now(), PAUSES.0, false);
        loop {
            let failure = match self.once(&call).await {
                Ok(value) => {
                    if told {
                        tracing::info!(seconds = began.elapsed().as_secs(), "The job database answers again.");
                    }
                    return Ok(value);
                }
                Err((begun, failure)) if !failure.passes() || (begun && again == Again::No) => return Err(failure.into()),
                Err((_, failure)) => failure,
            };
            // Connections of before the failure are as dead as this one.
            self.idle().clear();
            if began.elapsed() >= self.patience {
                return Err(failure.into());
            }
            if pause >= PAUSES.1 && !std::mem::replace(&mut told, true) {
                let error = StoreError::from(failure);
                tracing::warn!(%error, patience_s = self.patience.as_secs(), "The job database does not answer; the call waits for it.");
            }
            sleep(pause).await;
            pause = (2 * pause).min(PAUSES.1);
        }
    }
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
