//! Daemons that share the store, and what an operator may want of one.

use std::sync::Arc;

use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::{Extension, Json};
use serde::Serialize;
use suture_store::Host;

use super::ask::ask;
use super::problem::Problem;
use super::shared::Shared;
use super::tokens::Caller;
use crate::attempt::Context;
use crate::hosts;
use crate::say::plain;
use crate::shown::when;

/// A daemon, for programs.
#[derive(Serialize)]
pub(super) struct Shown {
    daemon: String,
    host: String,
    state: &'static str,
    pid: u32,
    version: String,
    roles: suture_store::Roles,
    folders: Vec<String>,
    /// Of these, it looks for drops.
    keeps: Vec<String>,
    running: u64,
    workers: u32,
    memory_bytes: u64,
    /// It takes no larger file; not there: of any size.
    #[serde(skip_serializing_if = "Option::is_none")]
    largest_bytes: Option<u64>,
    began: String,
    seen: String,
}

impl From<Host> for Shown {
    fn from(host: Host) -> Self {
        let state = hosts::state(&host);
        let keeps = host.kept().map(str::to_owned).collect();
        let Host { daemon, station, folders, began, seen, running, .. } = host;
        Self {
            daemon,
            host: station.host,
            state,
            pid: station.pid,
            version: station.version,
            roles: station.roles,
            folders,
            keeps,
            running,
            workers: station.workers,
            memory_bytes: station.memory,
            largest_bytes: station.largest,
            began: when(began),
            seen: when(seen),
        }
    }
}

#[derive(Serialize)]
pub(super) struct Hosts {
    hosts: Vec<Shown>,
}

fn shown(context: &Context) -> Result<Hosts, Problem> {
    Ok(Hosts { hosts: hosts::all(context)?.into_iter().map(Shown::from).collect() })
}

/// `GET /v1/hosts`.
pub(super) async fn list(State(shared): State<Arc<Shared>>) -> Result<Json<Hosts>, Problem> {
    ask(&shared.context, shown).await.map(Json)
}

/// `POST /v1/hosts/{name}/drain`: it finishes what it has, and takes nothing more.
pub(super) async fn drain(
    State(shared): State<Arc<Shared>>,
    Path(name): Path<String>,
    Extension(caller): Extension<Caller>,
) -> Result<Json<Hosts>, Problem> {
    wish(&shared, name, true, caller).await?;
    ask(&shared.context, shown).await.map(Json)
}

/// `POST /v1/hosts/{name}/resume`: it takes jobs again.
pub(super) async fn resume(
    State(shared): State<Arc<Shared>>,
    Path(name): Path<String>,
    Extension(caller): Extension<Caller>,
) -> Result<Json<Hosts>, Problem> {
    wish(&shared, name, false, caller).await?;
    ask(&shared.context, shown).await.map(Json)
}

/// Does it.
///
/// # Errors
/// When no host and no daemon is called so.
pub(super) async fn wish(shared: &Shared, name: String, drains: bool, caller: Caller) -> Result<(), Problem> {
    ask(&shared.context, move |context| {
        if !context.store.drain(&name, drains)? {
            let words = "no host and no daemon that shares this store is called so; where a daemon is alone, `suture jobs drain` is for it";
            return Err(Problem::new(StatusCode::NOT_FOUND, words));
        }
        tracing::info!(name = plain(&name), drains, by = caller.name().unwrap_or_default(), "An operator's wish for a host.");
        Ok(())
    })
    .await
}
