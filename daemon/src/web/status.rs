//! How the daemon stands, at a glance.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use serde::Serialize;

use crate::attempt::Context;
use crate::glance::Glance;
use crate::schedule::Standing;

use super::ask::ask;
use super::problem::Problem;
use super::shared::Shared;

#[derive(Serialize)]
pub(super) struct Status {
    version: &'static str,
    ready: bool,
    /// Why not.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
    /// Jobs in work.
    running: usize,
    /// Why nothing new is taken; empty: it is.
    held: Vec<String>,
    /// All that is out of reach, in words.
    away: Vec<String>,
    /// Who could not be told of ends of jobs yet, in words.
    untold: Vec<String>,
    /// How many jobs there are in each state.
    jobs: BTreeMap<&'static str, u64>,
    folders: Vec<Served>,
}

#[derive(Serialize)]
struct Served {
    name: String,
    reachable: bool,
    /// Bytes that results may still fill.
    free_bytes: u64,
}

/// `GET /v1/status`.
pub(super) async fn status(State(shared): State<Arc<Shared>>) -> Result<Json<Status>, Problem> {
    ask(&shared.context, of).await.map(Json)
}

fn of(context: &Context) -> Result<Status, Problem> {
    let Glance { ready, reason, standing: Standing { running, held, away, untold }, jobs, folders, .. } = Glance::of(context)?;
    let served =
        |folder: crate::glance::Served| Served { name: folder.name, reachable: folder.reachable, free_bytes: folder.free_bytes };
    Ok(Status {
        version: env!("CARGO_PKG_VERSION"),
        ready,
        reason,
        running,
        held,
        away,
        untold,
        jobs: jobs.into_iter().map(|(kind, count)| (kind.name(), count)).collect(),
        folders: folders.into_iter().map(served).collect(),
    })
}
