//! Every error has one shape: a problem as RFC 9457 describes it.

use axum::http::header::{CONTENT_TYPE, RETRY_AFTER};
use axum::http::{HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use suture_store::StoreError;

use crate::control::Refusal;

/// The media type of a problem.
pub(super) const PROBLEM: &str = "application/problem+json";
/// Seconds after which it makes sense to try again.
const TRY_AGAIN: HeaderValue = HeaderValue::from_static("2");

/// Why a request came to nothing.
#[derive(Debug)]
pub(super) struct Problem {
    status: StatusCode,
    detail: String,
}

/// The line for people, beside an answer that is a problem.
#[derive(Clone)]
pub(super) struct Detail(pub String);

/// As it is sent.
#[derive(Serialize)]
struct Shown<'a> {
    #[serde(rename = "type")]
    kind: &'static str,
    title: &'static str,
    status: u16,
    detail: &'a str,
}

impl Problem {
    /// With this status. `detail`: a line for people, with what to do.
    pub(super) fn new(status: StatusCode, detail: impl Into<String>) -> Self {
        Self { status, detail: detail.into() }
    }

    /// The status that it is sent with.
    pub(super) fn status(&self) -> StatusCode {
        self.status
    }

    /// The request is wrong.
    pub(super) fn bad(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, detail)
    }

    /// There is nothing of that name.
    pub(super) fn missing(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, detail)
    }

    /// Things stand otherwise than this request needs.
    pub(super) fn conflict(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::CONFLICT, detail)
    }

    /// For now; trying again may help.
    pub(super) fn unavailable(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::SERVICE_UNAVAILABLE, detail)
    }
}

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        match &error {
            StoreError::Unknown(_) => Self::missing(error.to_string()),
            StoreError::TooLong { .. } => Self::bad(error.to_string()),
            _ if error.is_callers() => Self::conflict(error.to_string()),
            StoreError::Away { seconds, .. } => {
                Self::unavailable(format!("the job database has not answered for {seconds} s; try again"))
            }
            // Paths of this machine are no client's business.
            _ => Self::unavailable("the job store does not answer for now; try again"),
        }
    }
}

impl From<Refusal> for Problem {
    fn from(Refusal { line, exit_code }: Refusal) -> Self {
        if exit_code == 2 { Self::conflict(line) } else { Self::unavailable("the daemon cannot do that for now; try again") }
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let title = self.status.canonical_reason().unwrap_or("Error");
        let shown = Shown { kind: "about:blank", title, status: self.status.as_u16(), detail: &self.detail };
        let body = serde_json::to_vec(&shown).unwrap_or_default();
        let mut response = (self.status, [(CONTENT_TYPE, PROBLEM)], body).into_response();
        response.extensions_mut().insert(Detail(self.detail));
        if self.status == StatusCode::SERVICE_UNAVAILABLE {
            response.headers_mut().insert(RETRY_AFTER, TRY_AGAIN);
        }
        response
    }
}
