//! How the daemon stands, at a glance.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use serde::Serialize;

use crate::attempt::Context;
use crate::control::{DaemonWish, steer};
use crate::fsx;
use crate::schedule::Standing;

use super::ask::ask;
use super::health::unready;
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
    /// How many jobs there are in each state.
    pub jobs: BTreeMap<&'static str, u64>,
    pub folders: Vec<Served>,
}

#[derive(Serialize)]
pub(super) struct Served {
    pub name: String,
    pub reachable: bool,
    /// Bytes that results may still fill.
    pub free_bytes: u64,
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
    let Standing { running, held, away } = steer(context, &DaemonWish::Standing)?;
    let reserve = context.settings.now().reserve;
    let served = |folder: &Arc<crate::folder::Folder>| Served {
        name: folder.name.clone(),
        reachable: folder.check().is_ok(),
        free_bytes: fsx::free_space(&folder.root, reserve),
    };
    let reason = unready(context);
    Ok(Status {
        version: env!("CARGO_PKG_VERSION"),
        ready: reason.is_none(),
        reason,
        running,
        held,
        away,
        jobs: context.store.counts()?.into_iter().map(|(kind, count)| (kind.name(), count)).collect(),
        folders: context.folders.iter().map(served).collect(),
    })
}
