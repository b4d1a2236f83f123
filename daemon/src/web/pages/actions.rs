//! What a person may want of a job. Each is a form, so that it works without a script, and is done as for programs.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::header::LOCATION;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use maud::{Markup, html};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use suture_store::{Job, Kind};

use super::frame::Frame;
use crate::control::JobsWish;
use crate::web::jobs::{grant, parameters, released, short};
use crate::web::problem::Problem;
use crate::web::shared::Shared;

/// Something to be done with a job.
struct Action {
    /// The last part of its address.
    name: &'static str,
    label: &'static str,
    /// Is it offered?
    fits: fn(Kind) -> bool,
    wish: fn(&Job) -> Result<JobsWish, Problem>,
}

/// All of them, in the order in which they are shown.
const ALL: [Action; 3] = [
    Action { name: "retry", label: "Try again", fits: can_be_retried, wish: |job| Ok(JobsWish::Retry(job.id)) },
    Action { name: "release", label: "Release from quarantine", fits: |kind| kind == Kind::Quarantined, wish: released },
    Action { name: "cancel", label: "Cancel", fits: Kind::is_live, wish: |job| Ok(JobsWish::Cancel(job.id)) },
];

fn can_be_retried(kind: Kind) -> bool {
    matches!(kind, Kind::Failed | Kind::NeedsReview | Kind::Cancelled | Kind::Waiting)
}

/// Forms for all that fits a job.
pub(super) fn forms(frame: &Frame, job: &Job) -> Markup {
    let offered = ALL.iter().filter(|action| (action.fits)(job.kind()));
    html! {
        @for action in offered {
            li { form method="post" action={ "/jobs/" (job.id) "/" (action.name) } { (frame.field()) button { (action.label) } } }
        }
    }
}

#[derive(Deserialize)]
struct Sent {
    word: String,
}

/// `POST /jobs/{id}/{action}`: does it, and leads back to the job.
pub(super) async fn act(
    State(shared): State<Arc<Shared>>,
    Path((id, action)): Path<(String, String)>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    let action = ALL.iter().find(|known| known.name == action).ok_or_else(|| Problem::missing("there is no such action"))?;
    let Sent { word } = form(body).await?;
    check_word(&shared, &headers, &word)?;
    let job = grant(&shared, &id, action.wish).await?;
    Ok(see(&format!("/jobs/{}", job.id)))
}

/// Refuses a form that is not of a page that this browser was shown.
///
/// # Errors
/// When it is not.
pub(super) fn check_word(shared: &Shared, headers: &HeaderMap, word: &str) -> Result<(), Problem> {
    let refused = || Problem::new(StatusCode::FORBIDDEN, "this form is out of date; go back, load the page again, and repeat it");
    shared.sessions.is_form_word(headers, word).then_some(()).ok_or_else(refused)
}

/// The fields of a form, whose body is written as the question of an address.
///
/// # Errors
/// When it is too long, comes too slowly, or lacks a field.
pub(super) async fn form<T: DeserializeOwned>(body: Body) -> Result<T, Problem> {
    let bytes = short(body).await?;
    let text = std::str::from_utf8(&bytes).unwrap_or("?");
    let uri = format!("/?{text}").parse().map_err(|_| Problem::bad("the form cannot be understood"))?;
    parameters(&uri)
}

/// Leads a browser to another page.
pub(super) fn see(address: &str) -> Response {
    (StatusCode::SEE_OTHER, [(LOCATION, address.to_owned())]).into_response()
}
