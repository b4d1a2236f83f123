//! What a person may want of a job. Each is a form, so that it works without a script, and is done as for programs.

use std::sync::Arc;

use axum::Extension;
use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::header::LOCATION;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use maud::{Markup, html};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use suture_store::job::{MAX_BY, MAX_REASON, Withdrawal};
use suture_store::{Decision, Job, Kind, State as JobState, Verdict};

use super::frame::Frame;
use crate::control::JobsWish;
use crate::say::plain;
use crate::web::jobs::{grant, parameters, released, short};
use crate::web::problem::Problem;
use crate::web::shared::Shared;
use crate::web::tokens::Caller;

/// Something to be done with a job.
struct Action {
    /// The last part of its address.
    name: &'static str,
    label: &'static str,
    /// Is it offered?
    fits: fn(&Job) -> bool,
    /// Is it a decision, under which a name stands?
    is_signed: bool,
    wish: fn(&Job, &Sent) -> Result<JobsWish, Problem>,
}

/// All of them, in the order in which they are shown.
const ALL: [Action; 5] = [
    Action {
        name: "approve",
        label: "Approve",
        fits: |job| matches!(job.kind(), Kind::NeedsReview | Kind::Rejected),
        is_signed: true,
        wish: |job, sent| decided(job, sent, Verdict::Approved),
    },
    Action {
        name: "reject",
        label: "Reject",
        fits: |job| job.kind() == Kind::NeedsReview,
        is_signed: true,
        wish: |job, sent| decided(job, sent, Verdict::Rejected),
    },
    Action {
        name: "retry",
        label: "Try again",
        fits: can_be_retried,
        is_signed: false,
        wish: |job, _| Ok(JobsWish::Retry(job.id)),
    },
    Action {
        name: "release",
        label: "Release from quarantine",
        fits: |job| job.kind() == Kind::Quarantined,
        is_signed: false,
        wish: |job, _| released(job),
    },
    Action {
        name: "cancel",
        label: "Cancel",
        fits: |job| job.kind().is_live(),
        is_signed: false,
        wish: |job, _| Ok(JobsWish::Cancel(job.id)),
    },
];

fn decided(job: &Job, sent: &Sent, verdict: Verdict) -> Result<JobsWish, Problem> {
    let decision = Decision::new(verdict, &sent.by, &sent.note).map_err(|error| Problem::bad(error.to_string()))?;
    Ok(JobsWish::Decide(job.id, decision))
}

fn can_be_retried(job: &Job) -> bool {
    match (&job.state, job.kind()) {
        // Its file is not there any more, or has a job of its own.
        (JobState::Cancelled { why }, _) => *why == Withdrawal::Operator,
        (_, kind) => matches!(kind, Kind::Failed | Kind::NeedsReview | Kind::Rejected | Kind::Waiting | Kind::Parked),
    }
}

/// Forms for all that fits a job.
pub(super) fn forms(frame: &Frame, job: &Job) -> Markup {
    let offered = || ALL.iter().filter(|action| (action.fits)(job));
    let address = |action: &Action| format!("/jobs/{}/{}", job.id, action.name);
    let signed: Vec<&Action> = offered().filter(|action| action.is_signed).collect();
    html! {
        @if let Some(first) = signed.first() {
            li class="decision" {
                form method="post" action=(address(first)) {
                    (frame.field())
                    @if let Some(name) = frame.caller.name() { p { "You decide as " strong { (plain(name)) } "." } } @else {
                        label { "Your name " input name="by" required maxlength=(MAX_BY) autocomplete="name"; }
                    }
                    label { "Note (not needed) " input name="note" maxlength=(MAX_REASON); }
                    @for action in &signed { button formaction=(address(action)) { (action.label) } }
                }
            }
        }
        @for action in offered().filter(|action| !action.is_signed) {
            li { form method="post" action=(address(action)) { (frame.field()) button { (action.label) } } }
        }
    }
}

#[derive(Deserialize)]
struct Sent {
    word: String,
    /// Who decides, and what they add.
    #[serde(default)]
    by: String,
    #[serde(default)]
    note: String,
}

/// `POST /jobs/{id}/{action}`: does it, and leads back to the job.
pub(super) async fn act(
    State(shared): State<Arc<Shared>>,
    Path((id, action)): Path<(String, String)>,
    Extension(caller): Extension<Caller>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    let action = ALL.iter().find(|known| known.name == action).ok_or_else(|| Problem::missing("there is no such action"))?;
    let mut sent: Sent = form(body).await?;
    check_word(&shared, &headers, &sent.word)?;
    if let Some(name) = caller.name() {
        name.clone_into(&mut sent.by);
    }
    let job = grant(&shared, &id, move |job| (action.wish)(job, &sent)).await?;
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
