//! How the daemon stands, at a glance.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use serde::Serialize;
use suture_store::Roles;

use crate::attempt::Context;
use crate::glance;
use crate::schedule::Standing;

use super::ask::ask;
use super::problem::Problem;
use super::shared::Shared;

#[derive(Serialize)]
pub(super) struct Status {
    pub version: &'static str,
    pub ready: bool,
    /// Why not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Jobs in work.
    pub running: usize,
    /// Why nothing new is taken; empty: it is.
    pub held: Vec<String>,
    /// All that is out of reach, in words.
    pub away: Vec<String>,
    /// Folders whose disk is nearly full while others have room, in words.
    pub full: Vec<String>,
    /// Who could not be told of ends of jobs yet, in words.
    pub untold: Vec<String>,
    /// What waits for a host that is not there, in words.
    pub stranded: Vec<String>,
    /// What this daemon does.
    pub roles: Roles,
    /// How many jobs there are in each state.
    pub jobs: BTreeMap<&'static str, u64>,
    pub folders: Vec<Served>,
}

#[derive(Serialize)]
pub(super) struct Served {
    pub name: String,
    pub reachable: bool,
    /// Bytes that results may still fill; of a folder out of reach nobody knows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub free_bytes: Option<u64>,
}

/// `GET /v1/status`.
pub(super) async fn status(State(shared): State<Arc<Shared>>) -> Result<Json<Status>, Problem> {
    ask(&shared.context, of).await.map(Json)
}

/// How it stands now.
///
/// # Errors
/// When the store does not answer.
pub(super) fn of(context: &Context) -> Result<Status, Problem> {
    let Standing { running, held, away, full, untold, stranded } = glance::standing(context)?;
    let served =
        |folder: glance::Served| Served { name: folder.name, reachable: folder.reachable, free_bytes: folder.free_bytes };
    let reason = glance::unready(context);
    Ok(Status {
        version: env!("CARGO_PKG_VERSION"),
        ready: reason.is_none(),
        reason,
        running,
        held,
        away,
        full,
        untold,
        stranded,
        roles: context.settings.now().roles,
        jobs: glance::counts(context)?.into_iter().map(|(kind, count)| (kind.name(), count)).collect(),
        folders: glance::folders(context).into_iter().map(served).collect(),
    })
}
