//! What pages need beside themselves: built in, so that nothing comes from elsewhere. three.js is as published (0.185.0 of npm: `assets/three`, with its licence).

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
const ALL: [(&str, &str, &[u8]); 6] = [
    ("icon.svg", "image/svg+xml", include_bytes!("../../../assets/icon.svg")),
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes of another size would be another version, or changed ones.
    #[test]
    fn three_is_as_published() {
        let of = |name: &str| ALL.into_iter().find(|(known, ..)| *known == name).map(|(.., content)| content).unwrap();
        assert_eq!((of("three/three.module.min.js").len(), of("three/three.core.min.js").len()), (365_552, 385_390));
        let text = String::from_utf8_lossy(of("three/three.module.min.js"));
        assert!(text.contains("from\"./three.core.min.js\"") && text.contains("SPDX-License-Identifier: MIT"));
        assert!(String::from_utf8_lossy(of("three/LICENSE")).contains("The MIT License"));
    }

    /// A job that ends between the making of a page and the begin of its stream would be shown as in work for ever; so would a job that
    /// ends while someone stands in its part of the page.
    #[test]
    fn a_page_is_renewed_when_its_stream_begins_and_when_it_is_left() {
        let text = include_str!("../../../assets/live.js");
        assert!(text.contains("addEventListener(\"open\", renew)") && text.contains("addEventListener(\"focusout\""));
    }

    /// Colours of the system on paper of ours, or the other way round, cannot be read in the dark: a report says both.
    #[test]
    fn reports_have_ink_and_paper_by_day_and_in_the_dark() {
        assert_eq!((STYLE.matches("--ink:").count(), STYLE.matches("--paper:").count()), (2, 2));
        assert!(STYLE.contains("background:var(--paper);color:var(--ink)") && STYLE.contains(":focus-visible{outline:3px"));
    }

    /// Scripts of ours ask this daemon and no one else.
    #[test]
    fn nothing_comes_from_elsewhere() {
        for name in ["live.js", "view.js"] {
            let (_, _, content) = ALL.into_iter().find(|(known, ..)| *known == name).unwrap();
            let text = String::from_utf8_lossy(content);
            assert!(!text.contains("http:") && !text.contains("https:") && !text.contains("innerHTML ="), "{name}");
        }
        let (_, _, icon) = ALL.into_iter().find(|(known, ..)| *known == "icon.svg").unwrap();
        assert!(!String::from_utf8_lossy(icon).contains("href"));
        assert!(!PAGES.contains("url(") && !STYLE.contains("url(") && !PAGES.contains("@import"));
    }
}
