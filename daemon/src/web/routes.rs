//! All that can be asked.

use std::sync::Arc;

use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::middleware::from_fn_with_state;
use axum::response::IntoResponse;
use axum::routing::{MethodRouter, get, post};

use super::files;
use super::guard::guard;
use super::health::{livez, readyz};
use super::hosts;
use super::jobs;
use super::metrics::metrics;
use super::pages;
use super::preview;
use super::shared::Shared;
use super::status::status;
use super::stream::events;
use super::upload::submit;

type Route = (&'static str, MethodRouter<Arc<Shared>>);

/// The interface as a program reads it; written by hand, and held to the routes and to every answer by tests.
const OPENAPI: &str = include_str!("openapi.json");

/// `GET /v1/openapi.json`.
async fn openapi() -> impl IntoResponse {
    ([(CONTENT_TYPE, "application/json")], OPENAPI)
}

/// Each path with what can be done there.
fn all() -> Vec<Route> {
    vec![
        ("/livez", get(livez)),
        ("/readyz", get(readyz)),
        ("/metrics", get(metrics)),
        ("/v1/events", get(events)),
        ("/v1/openapi.json", get(openapi)),
        ("/v1/status", get(status)),
        ("/v1/hosts", get(hosts::list)),
        ("/v1/hosts/{name}/drain", post(hosts::drain)),
        ("/v1/hosts/{name}/resume", post(hosts::resume)),
        ("/v1/jobs", get(jobs::list).post(submit)),
        ("/v1/jobs/{id}", get(jobs::show).delete(jobs::forget)),
        ("/v1/jobs/{id}/result", get(files::result)),
        ("/v1/jobs/{id}/report", get(files::report)),
        ("/v1/jobs/{id}/preview", get(preview::preview)),
        ("/v1/jobs/{id}/view", get(preview::view)),
        ("/v1/jobs/{id}/retry", post(jobs::retry)),
        ("/v1/jobs/{id}/cancel", post(jobs::cancel)),
        ("/v1/jobs/{id}/release", post(jobs::release)),
        ("/v1/jobs/{id}/priority", post(jobs::rank)),
        ("/v1/jobs/{id}/approve", post(jobs::approve)),
        ("/v1/jobs/{id}/reject", post(jobs::reject)),
    ]
}

/// The way from requests to answers.
pub(super) fn router(shared: Arc<Shared>) -> Router {
    let router = all().into_iter().chain(pages::all()).fold(Router::new(), |router, (path, methods)| router.route(path, methods));
    let router = router.fallback(async || StatusCode::NOT_FOUND);
    // Bodies are bounded where they are read.
    let router = router.layer(DefaultBodyLimit::disable());
    router.layer(from_fn_with_state(Arc::clone(&shared), guard)).with_state(shared)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Which methods each path has, a test of the running daemon asks.
    #[test]
    fn every_path_is_in_the_document() {
        let document: serde_json::Value = serde_json::from_str(OPENAPI).unwrap();
        let written: BTreeSet<&str> = document["paths"].as_object().unwrap().keys().map(String::as_str).collect();
        let there: BTreeSet<&str> = all().iter().map(|(path, _)| *path).collect();
        assert_eq!(written, there);
    }
}
