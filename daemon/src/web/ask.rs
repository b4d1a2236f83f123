//! Questions to the daemon, from a handler: on a blocking thread, with an end to the patience.

use std::sync::Arc;
use std::time::Duration;

use suture_store::patience::brief;
use tokio::task::spawn_blocking;
use tokio::time::timeout;

use crate::attempt::Context;

use super::problem::Problem;

/// How long a client waits for the daemon.
pub(super) const PATIENCE: Duration = Duration::from_secs(10);

/// Asks the daemon something that may touch a disk.
///
/// # Errors
/// The question's own; or that the daemon does not answer. It may still come to pass then.
pub(super) async fn ask<T: Send + 'static>(
    context: &Arc<Context>,
    question: impl FnOnce(&Context) -> Result<T, Problem> + Send + 'static,
) -> Result<T, Problem> {
    let (context, span) = (Arc::clone(context), tracing::Span::current());
    match timeout(PATIENCE, spawn_blocking(move || span.in_scope(|| brief(|| question(&context))))).await {
        Ok(Ok(answer)) => answer,
        // The panic is in the log.
        Ok(Err(_)) => Err(Problem::new(axum::http::StatusCode::INTERNAL_SERVER_ERROR, "an internal error; the log says more")),
        Err(_) => Err(Problem::unavailable("the daemon does not answer for now; try again")),
    }
}
