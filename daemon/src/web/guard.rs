//! The gate that every request passes, and every answer.
//!
//! * The name by which a client calls this machine must be a known one: a page of someone else's, whose name was made to lead here, asks by
//!   that name. Addresses need no list: no one but us has them.
//! * Where there are tokens, all but the two questions after health need one, or a session that was opened with one; so that one can be opened, `/login` and the
//!   files that every page is made of need none. Whoever is let in has the name of their token with them, and lines of the log say it.
//! * What changes anything is refused when a browser says, or its `Origin` shows, that a page of someone else's sent it.
//! * Every answer forbids browsers to guess, embed or run anything, but for scripts of ours in pages of ours; every error is a [`Problem`], which a person reads on
//!   a page.

use std::net::{IpAddr, Ipv6Addr};
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::header::{ACCEPT, ALLOW, CACHE_CONTROL, CONTENT_TYPE, HOST, ORIGIN, RETRY_AFTER, WWW_AUTHENTICATE};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, Uri};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use tracing::Instrument;

use super::pages::{self, ForPeople};
use super::problem::{Detail, PROBLEM, Problem};
use super::shared::Shared;
use super::tokens::Caller;

/// Said with every answer to programs.
const TO_PROGRAMS: [(&str, &str); 2] =
    [("content-security-policy", "default-src 'none'; frame-ancestors 'none'; sandbox"), ("referrer-policy", "no-referrer")];
/// Said with every page: all that it needs is ours, and nothing stands in it that a browser would run. Without a referrer, browsers would not say either whose
/// page a form is of.
const TO_PEOPLE: [(&str, &str); 2] = [
    (
        "content-security-policy",
        "default-src 'none'; style-src 'self'; img-src 'self'; script-src 'self'; connect-src 'self'; form-action 'self'; base-uri 'none'; \
         frame-ancestors 'none'",
    ),
    ("referrer-policy", "same-origin"),
];
/// Said with every answer.
const TO_ALL: [(&str, &str); 3] =
    [("cross-origin-resource-policy", "same-origin"), ("x-content-type-options", "nosniff"), ("x-frame-options", "DENY")];

/// Paths that need no token.
pub(super) const OPEN: [&str; 3] = ["/livez", "/readyz", pages::LOGIN];

/// The one way in, and out.
pub(super) async fn guard(State(shared): State<Arc<Shared>>, mut request: Request, next: Next) -> Response {
    let for_a_person = wants_page(request.headers());
    let mut response = match admit(&shared, &request) {
        Ok(caller) => {
            let span = caller.span();
            request.extensions_mut().insert(caller);
            next.run(request).instrument(span).await
        }
        Err(problem) if problem.status() == StatusCode::UNAUTHORIZED && for_a_person => pages::lead(&request),
        Err(problem) => problem.into_response(),
    };
    let status = response.status();
    let is_error = status.is_client_error() || status.is_server_error();
    let is_ours = response.extensions().get::<ForPeople>().is_some()
        || response.headers().get(CONTENT_TYPE).is_some_and(|kind| kind == PROBLEM);
    if is_error && !is_ours {
        // The library's own words.
        let allow = response.headers_mut().remove("allow");
        response = Problem::new(status, words(status)).into_response();
        response.headers_mut().extend(allow.map(|allow| (ALLOW, allow)));
    }
    let detail = response.extensions_mut().remove::<Detail>();
    if let Some(Detail(detail)) = detail.filter(|_| for_a_person) {
        let mut page = pages::sorry(status, &detail);
        let kept = [ALLOW, RETRY_AFTER].map(|name| (response.headers_mut().remove(&name), name));
        page.headers_mut().extend(kept.into_iter().filter_map(|(value, name)| Some((name, value?))));
        response = page;
    }
    let is_page = response.extensions().get::<ForPeople>().is_some();
    let headers = response.headers_mut();
    for (name, value) in if is_page { TO_PEOPLE } else { TO_PROGRAMS }.into_iter().chain(TO_ALL) {
        headers.insert(name, HeaderValue::from_static(value));
    }
    headers.entry(CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
    if status == StatusCode::UNAUTHORIZED {
        headers.insert(WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    }
    response
}

fn words(status: StatusCode) -> &'static str {
    match status {
        StatusCode::NOT_FOUND => "there is nothing of that name; /v1/openapi.json lists what there is",
        StatusCode::METHOD_NOT_ALLOWED => "this cannot be done here; /v1/openapi.json lists what can",
        _ => "the request cannot be understood; /v1/openapi.json says how it should be",
    }
}

fn admit(shared: &Shared, request: &Request) -> Result<Caller, Problem> {
    let headers = request.headers();
    let host = host(request.uri(), headers).ok_or_else(|| Problem::bad("the request names no host, or several"))?;
    if !is_known(host, &shared.api.hosts) {
        let status = StatusCode::MISDIRECTED_REQUEST;
        return Err(Problem::new(
            status,
            "this daemon is not called so; add the name to `hosts` in `[api]` of its configuration",
        ));
    }
    let path = request.uri().path();
    let is_open = OPEN.contains(&path) || path.starts_with(pages::ASSETS);
    let in_session = || shared.sessions.of(headers, shared.context.world.steady());
    let caller = shared.tokens.admit(headers).or_else(in_session).or_else(|| is_open.then(Caller::default)).ok_or_else(|| {
        let detail = "a token is needed, as `Authorization: Bearer TOKEN` or `X-API-Key: TOKEN`";
        Problem::new(StatusCode::UNAUTHORIZED, detail)
    })?;
    let looks = matches!(*request.method(), Method::GET | Method::HEAD | Method::OPTIONS);
    if !looks && !is_own(headers, host) {
        return Err(Problem::new(StatusCode::FORBIDDEN, "a page of another site may not change anything here"));
    }
    Ok(caller)
}

/// Is it a person's browser that asks?
fn wants_page(headers: &HeaderMap) -> bool {
    headers.get(ACCEPT).and_then(|kinds| kinds.to_str().ok()).is_some_and(|kinds| kinds.contains("text/html"))
}

/// The name that the client calls this machine by, with its port.
fn host<'a>(uri: &'a Uri, headers: &'a HeaderMap) -> Option<&'a str> {
    let mut named = headers.get_all(HOST).iter();
    let (first, more) = (named.next()?.to_str().ok()?, named.next());
    // A proxy's form of request names it once more.
    let agrees = uri.authority().is_none_or(|authority| authority.as_str().eq_ignore_ascii_case(first));
    (more.is_none() && agrees).then_some(first)
}

/// A name or address without its port.
fn bare(host: &str) -> Option<&str> {
    if let Some(rest) = host.strip_prefix('[') {
        let (address, port) = rest.split_once(']')?;
        return (port.is_empty() || is_port(port)).then_some(address);
    }
    match host.split_once(':') {
        Some((name, port)) => port.bytes().all(|byte| byte.is_ascii_digit()).then_some(name),
        None => Some(host),
    }
}

fn is_port(text: &str) -> bool {
    text.strip_prefix(':').is_some_and(|port| port.bytes().all(|byte| byte.is_ascii_digit()))
}

fn is_known(host: &str, known: &[String]) -> bool {
    let Some(name) = bare(host) else { return false };
    let name = name.strip_suffix('.').unwrap_or(name);
    let is_address = if host.starts_with('[') { name.parse::<Ipv6Addr>().is_ok() } else { name.parse::<IpAddr>().is_ok() };
    is_address || name.eq_ignore_ascii_case("localhost") || known.iter().any(|known| known.eq_ignore_ascii_case(name))
}

/// Comes it from no page, or from one of ours?
fn is_own(headers: &HeaderMap, host: &str) -> bool {
    let text = |value: &HeaderValue| value.to_str().unwrap_or("?").to_owned();
    let site = headers.get("sec-fetch-site").map(text);
    let origin = headers.get(ORIGIN).map(text);
    let ours = |origin: &String| origin.split_once("://").is_some_and(|(_, from)| from.eq_ignore_ascii_case(host));
    site.is_none_or(|site| site == "same-origin" || site == "none") && origin.as_ref().is_none_or(ours)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f28_only_known_names_lead_here() {
        let known = ["farm.example".to_owned()];
        for host in
            ["localhost", "LOCALHOST:7878", "127.0.0.1:80", "[::1]:7878", "192.168.1.9", "farm.example:443", "Farm.Example."]
        {
            assert!(is_known(host, &known), "{host}");
        }
        for host in [
            "evil.example",
            "",
            ":80",
            "localhost.evil.example",
            "127.0.0.1.evil.example:80",
            "farm.example@evil.example",
            "localhost:80:80",
            "[::1",
            "[evil.example]",
            "[::1]x",
            "::1",
            "farm.example/x",
        ] {
            assert!(!is_known(host, &known), "{host}");
        }
    }

    #[test]
    fn f28_pages_of_other_sites_are_told() {
        let of = |pairs: &[(&'static str, &'static str)]| {
            let pairs =
                pairs.iter().map(|(name, value)| (name.parse::<axum::http::HeaderName>().unwrap(), value.parse().unwrap()));
            is_own(&HeaderMap::from_iter(pairs), "127.0.0.1:7878")
        };
        assert!(of(&[]) && of(&[("sec-fetch-site", "none")]));
        assert!(of(&[("sec-fetch-site", "same-origin"), ("origin", "http://127.0.0.1:7878")]));
        for foreign in [
            &[("sec-fetch-site", "cross-site")][..],
            &[("sec-fetch-site", "same-site")],
            &[("origin", "null")],
            &[("origin", "http://127.0.0.1:8000")],
            &[("origin", "http://evil.example")],
            &[("sec-fetch-site", "same-origin"), ("origin", "http://evil.example")],
        ] {
            assert!(!of(foreign), "{foreign:?}");
        }
    }
}
