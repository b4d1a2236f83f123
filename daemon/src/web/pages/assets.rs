//! What pages need beside themselves: built in, so that nothing comes from elsewhere. three.js is as published (`assets/three`, with its licence).

use axum::extract::Path;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE, ETAG, IF_NONE_MATCH};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};

use crate::html::STYLE;
use crate::web::problem::Problem;

const SCRIPT: &str = "text/javascript; charset=utf-8";
const WORDS: &str = "text/plain; charset=utf-8";
/// Browsers ask again each time, and are told that nothing changed.
const FRESH: &str = "no-cache";

/// Name, kind, content.
const ALL: [(&str, &str, &[u8]); 5] = [
    ("live.js", SCRIPT, include_bytes!("../../../assets/live.js")),
    ("view.js", SCRIPT, include_bytes!("../../../assets/view.js")),
    ("three/three.module.min.js", SCRIPT, include_bytes!("../../../assets/three/three.module.min.js")),
    ("three/three.core.min.js", SCRIPT, include_bytes!("../../../assets/three/three.core.min.js")),
    ("three/LICENSE", WORDS, include_bytes!("../../../assets/three/LICENSE")),
];
const PAGES: &str = include_str!("../../../assets/pages.css");

/// `GET /assets/{name}`.
pub(super) async fn asset(Path(name): Path<String>, headers: HeaderMap) -> Result<Response, Problem> {
    if name == "suture.css" {
        return Ok(send("text/css; charset=utf-8", [STYLE, PAGES].concat().into_bytes(), &headers));
    }
    let (_, kind, content) =
        ALL.into_iter().find(|(known, ..)| *known == name).ok_or_else(|| Problem::missing("there is no such asset"))?;
    Ok(send(kind, content, &headers))
}

fn send<B: AsRef<[u8]> + IntoResponse>(kind: &'static str, content: B, headers: &HeaderMap) -> Response {
    let tag = format!("\"{}\"", &blake3::hash(content.as_ref()).to_hex()[..32]);
    let has_it = headers.get(IF_NONE_MATCH).is_some_and(|known| known.as_bytes() == tag.as_bytes());
    let head = [(ETAG, tag), (CACHE_CONTROL, FRESH.to_owned()), (CONTENT_TYPE, kind.to_owned())];
    if has_it { (StatusCode::NOT_MODIFIED, head).into_response() } else { (head, content).into_response() }
}
