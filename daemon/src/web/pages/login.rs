//! Where a person shows a token, once for a session.

use std::sync::Arc;
use std::time::Duration;

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::header::SET_COOKIE;
use axum::http::{HeaderMap, Method, StatusCode, Uri};
use axum::response::{IntoResponse, Response};
use maud::html;
use serde::Deserialize;
use tokio::time::sleep;

use super::actions::{check_word, form as fields, see};
use super::frame;
use crate::escape::escaped;
use crate::web::jobs::parameters;
use crate::web::problem::Problem;
use crate::web::shared::Shared;

/// Where a token is shown.
pub(in crate::web) const LOGIN: &str = "/login";
/// Below it, everything is public.
pub(in crate::web) const ASSETS: &str = "/assets/";
/// How long a wrong token is thought about.
const DELAY: Duration = Duration::from_secs(1);

/// Leads a person to where a token is shown, and from there back to the page that was asked for.
pub(in crate::web) fn lead(asked: &Request) -> Response {
    let next = if asked.method() == Method::GET { asked.uri().path() } else { "/" };
    see(&format!("{LOGIN}?next={}", escaped(next)))
}

#[derive(Default, Deserialize)]
struct Asked {
    next: Option<String>,
}

/// `GET /login`.
pub(super) async fn form(State(shared): State<Arc<Shared>>, uri: Uri) -> Result<Response, Problem> {
    if !shared.tokens.are_needed() {
        return Ok(see("/"));
    }
    let Asked { next } = parameters(&uri)?;
    Ok(page(StatusCode::OK, next.as_deref().unwrap_or("/"), ""))
}

fn page(status: StatusCode, next: &str, wrong: &str) -> Response {
    let body = html! {
        h1 { "Sign in" }
        @if !wrong.is_empty() { div class="outcome bad" role="alert" { strong { (wrong) } } }
        form method="post" action=(LOGIN) {
            p { label for="token" { "Token" } br;
                input id="token" name="token" type="password" autocomplete="current-password" required autofocus size="40"; }
            p { "It stands in the file that " code { "token_file" } " in the daemon’s configuration names. Whoever runs the daemon has it." }
            input type="hidden" name="next" value=(next);
            button { "Sign in" }
        }
    };
    frame::bare(status, "Sign in", &body)
}

#[derive(Deserialize)]
struct Shown {
    token: String,
    #[serde(default)]
    next: String,
}

/// `POST /login`: opens a session for a right token.
pub(super) async fn login(State(shared): State<Arc<Shared>>, body: Body) -> Result<Response, Problem> {
    let Shown { token, next } = fields(body).await?;
    let _seat = shared.logins.try_acquire().map_err(|_| Problem::unavailable("too many sign in at once; try again"))?;
    let Some(caller) = shared.tokens.opened_by(token.trim()) else {
        tracing::warn!("A wrong token was shown at the page to sign in.");
        sleep(DELAY).await;
        return Ok(page(StatusCode::FORBIDDEN, &next, "This is not one of the tokens. Try again."));
    };
    let cookie = shared.sessions.open(caller, shared.context.world.steady());
    let cookie = cookie.map_err(|_| Problem::unavailable("no session can be opened for now; try again"))?;
    let mut response = see(if is_ours(&next) { &next } else { "/" });
    response.headers_mut().insert(SET_COOKIE, cookie);
    Ok(response)
}

/// Leads the address to a page of ours, and nowhere else?
fn is_ours(address: &str) -> bool {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/-_.".contains(&byte);
    address.starts_with('/') && !address.starts_with("//") && address.bytes().all(plain)
}

#[derive(Deserialize)]
struct Sent {
    word: String,
}

/// `POST /logout`.
pub(super) async fn logout(State(shared): State<Arc<Shared>>, headers: HeaderMap, body: Body) -> Result<Response, Problem> {
    let Sent { word } = fields(body).await?;
    check_word(&shared, &headers, &word)?;
    Ok(([(SET_COOKIE, shared.sessions.close(&headers))], see(LOGIN)).into_response())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f28_signing_in_leads_to_pages_of_ours_only() {
        assert!(is_ours("/") && is_ours("/jobs/12"));
        for wrong in ["", "//evil.example", "/\\evil.example", "https://evil.example", "/a\r\nb", "/%2fevil"] {
            assert!(!is_ours(wrong), "{wrong}");
        }
    }
}
