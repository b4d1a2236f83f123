//! What all pages have in common.

use axum::http::header::CONTENT_TYPE;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use maud::{DOCTYPE, Markup, html};

use crate::web::shared::Shared;
use crate::web::tokens::Caller;

/// Marks an answer as a page for people, which may have a style and scripts of ours.
#[derive(Clone, Copy)]
pub(in crate::web) struct ForPeople;

/// What a page is shown in.
pub(super) struct Frame {
    /// The word that its forms carry.
    pub word: String,
    in_session: bool,
    /// Whoever is signed in.
    pub caller: Caller,
}

impl Frame {
    /// For the browser that sent these headers.
    pub(super) fn of(shared: &Shared, headers: &HeaderMap) -> Self {
        let session = shared.tokens.are_needed().then(|| shared.sessions.of(headers, shared.context.world.steady())).flatten();
        Self { word: shared.sessions.form_word(headers), in_session: session.is_some(), caller: session.unwrap_or_default() }
    }

    /// A page; `here`: its address, if the head leads to it.
    pub(super) fn page(&self, here: &str, title: &str, body: &Markup) -> Response {
        let entry = |address: &str, words: &str| {
            html! { li { a href=(address) aria-current=[(address == here).then_some("page")] { (words) } } }
        };
        let head = html! {
            nav aria-label="Pages" { ul { (entry("/", "Overview")) (entry("/jobs", "All jobs")) } }
            @if self.in_session { form method="post" action="/logout" { (self.field()) button { "Sign out" } } }
        };
        respond(StatusCode::OK, title, &head, body)
    }

    /// The field of a form that shows that it is ours.
    pub(super) fn field(&self) -> Markup {
        html! { input type="hidden" name="word" value=(self.word); }
    }
}

/// A page that says why a request came to nothing.
pub(in crate::web) fn sorry(status: StatusCode, detail: &str) -> Response {
    let title = status.canonical_reason().unwrap_or("Error");
    let body = html! {
        h1 { "This did not work" }
        div class="outcome review" { strong { (title) } p { (crate::say::plain(detail)) } }
        p { a href="/" { "Go to the overview" } }
    };
    respond(status, title, &html! {}, &body)
}

/// A page outside of any session.
pub(super) fn bare(status: StatusCode, title: &str, body: &Markup) -> Response {
    respond(status, title, &html! {}, body)
}

fn respond(status: StatusCode, title: &str, head: &Markup, body: &Markup) -> Response {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) " – Suture" }
                link rel="icon" href="/assets/icon.svg" type="image/svg+xml";
                link rel="stylesheet" href="/assets/suture.css";
                script src="/assets/live.js" defer {}
            }
            body {
                a class="skip" href="#main" { "Skip to the content" }
                header class="top" { strong { "Suture" } (head) }
                main id="main" { (body) }
            }
        }
    };
    let mut response = (status, [(CONTENT_TYPE, "text/html; charset=utf-8")], page.into_string()).into_response();
    response.extensions_mut().insert(ForPeople);
    response
}
