//! The hosts of a farm on the overview, and forms that drain one.

use std::sync::Arc;

use axum::Extension;
use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::HeaderMap;
use axum::response::Response;
use maud::{Markup, html};
use serde::Deserialize;
use suture_store::{Host, Role};

use super::actions::{check_word, form, see};
use super::frame::Frame;
use crate::hosts::{keeps, state};
use crate::html::words::time;
use crate::say::plain;
use crate::units::{show_count, show_size};
use crate::web::hosts::wish;
use crate::web::problem::Problem;
use crate::web::shared::Shared;
use crate::web::tokens::Caller;

/// Each of them; forms where the store is one that others share.
pub(super) fn table(hosts: &[Host], is_shared: bool, frame: &Frame) -> Markup {
    html! {
        h2 { "Hosts" }
        div class="wide" { table {
            thead { tr {
                th scope="col" { "Host" } th scope="col" { "Does" } th scope="col" { "Looks for drops in" } th scope="col" { "State" } th scope="col" class="n" { "In work" } th scope="col" class="n" { "Workers" }
                th scope="col" class="n" { "Memory" } th scope="col" class="n" { "Files up to" } th scope="col" { "Suture" } th scope="col" { "Last sign" } @if is_shared { th scope="col" { "" } }
            } }
            tbody { @for host in hosts { (row(host, is_shared, frame)) } }
        } }
    }
}

fn row(host: &Host, is_shared: bool, frame: &Frame) -> Markup {
    let (station, works) = (&host.station, host.station.roles.has(Role::Worker));
    let class = match state(host) {
        "alive" => "state good",
        "silent" => "state bad",
        _ => "state review",
    };
    html! { tr {
        th scope="row" { (plain(&station.host)) br; span class="soft" { (plain(&host.daemon)) } }
        td { (station.roles) }
        td { (keeps(host).map_or_else(|| "–".to_owned(), |folders| plain(&folders))) }
        td { span class=(class) { (state(host)) } }
        td class="n" { (show_count(host.running)) }
        td class="n" { @if works { (station.workers) } @else { "–" } }
        td class="n" { @if works { (show_size(station.memory)) } @else { "–" } }
        td class="n" { @if works { (station.largest.map_or_else(|| "any size".to_owned(), show_size)) } @else { "–" } }
        td { (plain(&station.version)) }
        td class="time" { (time(host.seen)) }
        @if is_shared { td { @if works {
            @let (action, label) = if host.is_draining { ("resume", "Resume") } else { ("drain", "Drain") };
            form method="post" action={ "/hosts/" (action) } {
                (frame.field())
                input type="hidden" name="name" value=(host.daemon);
                button { (label) }
            }
        } } }
    } }
}

#[derive(Deserialize)]
struct Sent {
    word: String,
    name: String,
}

/// `POST /hosts/{action}`: does it, and leads back to the overview.
pub(super) async fn act(
    State(shared): State<Arc<Shared>>,
    Path(action): Path<String>,
    Extension(caller): Extension<Caller>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    let drains = match action.as_str() {
        "drain" => true,
        "resume" => false,
        _ => return Err(Problem::missing("there is no such action")),
    };
    let sent: Sent = form(body).await?;
    check_word(&shared, &headers, &sent.word)?;
    wish(&shared, sent.name, drains, caller).await?;
    Ok(see("/"))
}
