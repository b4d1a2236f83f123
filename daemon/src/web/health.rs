//! Is it alive, is it ready? For service managers and load balancers.

use std::sync::Arc;
use std::time::Duration;

use axum::Json;
use axum::extract::State;
use serde::Serialize;

use crate::glance::unready;

use super::ask::ask;
use super::problem::Problem;
use super::shared::Shared;

/// A daemon whose eyes have been shut for so long is not alive. One look at a folder of many files on a slow disk may take a while.
const SILENCE: Duration = Duration::from_secs(120);

#[derive(Serialize)]
pub(super) struct Health {
    status: &'static str,
}

/// `GET /livez`: does the daemon go on?
pub(super) async fn livez(State(shared): State<Arc<Shared>>) -> Result<Json<Health>, Problem> {
    // While it waits for its database, all that it can do is wait.
    if shared.context.pulse.silence() > SILENCE && shared.context.store.away().is_none() {
        return Err(Problem::unavailable("the daemon does not go on: a disk may hang"));
    }
    Ok(Json(Health { status: "alive" }))
}

/// `GET /readyz`: does it take files, and work on them? A pause or hours of work do not count: someone wants it so.
pub(super) async fn readyz(State(shared): State<Arc<Shared>>) -> Result<Json<Health>, Problem> {
    let why = ask(&shared.context, |context| Ok(unready(context))).await?;
    why.map_or(Ok(Json(Health { status: "ready" })), |why| Err(Problem::unavailable(why)))
}
