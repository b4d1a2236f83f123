//! Is it alive, is it ready? For service managers and load balancers.

use std::sync::{Arc, PoisonError};
use std::time::Duration;

use axum::Json;
use axum::extract::State;
use serde::Serialize;

use crate::attempt::Context;
use crate::schedule::Hold;

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
    if shared.context.pulse.silence() > SILENCE {
        return Err(Problem::unavailable("the daemon does not go on: a disk may hang"));
    }
    Ok(Json(Health { status: "alive" }))
}

/// `GET /readyz`: does it take files, and work on them? A pause or hours of work do not count: someone wants it so.
pub(super) async fn readyz(State(shared): State<Arc<Shared>>) -> Result<Json<Health>, Problem> {
    let why = ask(&shared.context, |context| Ok(unready(context))).await?;
    why.map_or(Ok(Json(Health { status: "ready" })), |why| Err(Problem::unavailable(why)))
}

/// Why the daemon is not ready, in words.
pub(super) fn unready(context: &Context) -> Option<String> {
    if context.pulse.is_ending() {
        return Some("the daemon ends".into());
    }
    if context.has_failed() || context.store.check().is_err() {
        return Some("the job store is to be opened again".into());
    }
    if let Some(folder) = context.folders.iter().find(|folder| context.pulse.scan_of(&folder.name).is_none()) {
        return Some(format!("the folder `{}` was not looked at yet", folder.name));
    }
    let away = context.away.lock().unwrap_or_else(PoisonError::into_inner);
    if context.folders.iter().all(|folder| folder.check().is_err() && away.get(&folder.name).is_some_and(|why| !why.is_empty())) {
        return Some("every folder is out of reach".into());
    }
    context.schedule.held(Hold::Disk)
}
