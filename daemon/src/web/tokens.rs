//! Who may ask: whoever has one of the tokens, if there are any; and by which name, if the token has one.

use std::io;
use std::path::Path;
use std::sync::Arc;

use axum::http::HeaderMap;
use axum::http::header::AUTHORIZATION;
use suture_store::{Decision, Verdict};
use tracing::Span;

/// A shorter token could be guessed.
const SHORTEST: usize = 16;

/// Whoever asks, by the name of their token.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Caller(Option<Arc<str>>);

impl Caller {
    /// Under this name is done what they do, whatever they say; `None`: the token has none, and their word counts.
    pub(super) fn name(&self) -> Option<&str> {
        self.0.as_deref()
    }

    /// Has lines of the log say who it was.
    pub(super) fn span(&self) -> Span {
        self.name().map_or_else(Span::none, |by| tracing::info_span!("asked", by))
    }
}

/// A token: its digest, since comparing two of them takes as long whatever they are.
struct Known {
    digest: blake3::Hash,
    caller: Caller,
}

/// The tokens that open; without any, everyone may ask.
#[derive(Clone)]
pub(crate) struct Tokens(Option<Arc<[Known]>>);

impl Tokens {
    /// Reads one token a line, with its name and a colon before it if it has one; lines that are empty or begin with `#` are left out. Without a file, no
    /// token is needed.
    ///
    /// # Errors
    /// A line for people, and what kept it.
    pub(crate) fn of(file: Option<&Path>) -> Result<Self, (String, io::Error)> {
        let Some(file) = file else { return Ok(Self(None)) };
        let text = std::fs::read_to_string(file)
            .map_err(|error| (format!("{}: cannot read the tokens: {error}", file.display()), error))?;
        Self::parse(&text).map_err(|what| (format!("{}: {what}", file.display()), io::ErrorKind::InvalidData.into()))
    }

    fn parse(text: &str) -> Result<Self, String> {
        let lines = text.lines().map(str::trim).enumerate().filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let mut all: Vec<Known> = Vec::new();
        for (number, line) in lines {
            let wrong = |what: &str| format!("line {}: {what}", number + 1);
            let (name, token) = match line.split_once(':') {
                Some((name, token)) => (Some(name.trim()), token.trim()),
                None => (None, line),
            };
            if token.len() < SHORTEST || !token.bytes().all(|byte| byte.is_ascii_graphic()) {
                return Err(wrong(&format!(
                    "a token is one word of {SHORTEST} characters at least (try `openssl rand -hex 32`), after a name and a colon if it has a name"
                )));
            }
            // A name must do for a decision.
            if let Some(Err(error)) = name.map(|name| Decision::new(Verdict::Approved, name, "")) {
                return Err(wrong(&format!("before the colon stands no name: {error}")));
            }
            let known = Known { digest: blake3::hash(token.as_bytes()), caller: Caller(name.map(Arc::from)) };
            if all.iter().any(|other| other.digest == known.digest && other.caller != known.caller) {
                return Err(wrong("this token has another name on another line; give each its own"));
            }
            all.push(known);
        }
        if all.is_empty() { Err("holds no token (try `openssl rand -hex 32`)".into()) } else { Ok(Self(Some(all.into()))) }
    }

    /// Is one needed?
    pub(crate) fn are_needed(&self) -> bool {
        self.0.is_some()
    }

    /// Whose token is it, if it is one of them?
    pub(crate) fn opened_by(&self, token: &str) -> Option<Caller> {
        let given = blake3::hash(token.as_bytes());
        let all = self.0.iter().flat_map(|known| known.iter());
        all.fold(None, |found, known| if known.digest == given { Some(&known.caller) } else { found }).cloned()
    }

    /// Whoever sent these headers, if they have one, or none is needed. As `Authorization: Bearer TOKEN` or `X-API-Key: TOKEN`.
    pub(crate) fn admit(&self, headers: &HeaderMap) -> Option<Caller> {
        if !self.are_needed() {
            return Some(Caller::default());
        }
        let bearer = headers.get(AUTHORIZATION).and_then(|value| value.to_str().ok()).and_then(|value| {
            let (scheme, token) = value.split_once(' ')?;
            scheme.eq_ignore_ascii_case("bearer").then_some(token.trim())
        });
        let key = headers.get("x-api-key").and_then(|value| value.to_str().ok());
        // Each with each, so that nothing is told by how long it took.
        bearer.into_iter().chain(key).map(|token| self.opened_by(token)).fold(None, Option::or)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(name: &'static str, value: &str) -> HeaderMap {
        HeaderMap::from_iter([(axum::http::HeaderName::from_static(name), value.parse().unwrap())])
    }

    #[test]
    fn one_of_the_tokens_opens() {
        let tokens = Tokens::parse("# of the farm\n0123456789abcdef\n\n  fedcba9876543210  \n").unwrap();
        for (name, value) in [
            ("authorization", "Bearer 0123456789abcdef"),
            ("authorization", "bearer fedcba9876543210"),
            ("x-api-key", "fedcba9876543210"),
        ] {
            assert_eq!(tokens.admit(&headers(name, value)), Some(Caller::default()), "{name}: {value}");
        }
        for (name, value) in [
            ("authorization", "Basic 0123456789abcdef"),
            ("authorization", "0123456789abcdef"),
            ("authorization", "Bearer 0123456789abcde"),
            ("x-api-key", ""),
            ("x-api-key", "# of the farm"),
            ("cookie", "0123456789abcdef"),
        ] {
            assert_eq!(tokens.admit(&headers(name, value)), None, "{name}: {value}");
        }
        assert_eq!(tokens.admit(&HeaderMap::new()), None);
        assert!(Tokens::of(None).is_ok_and(|none| none.admit(&HeaderMap::new()) == Some(Caller::default())));
    }

    #[test]
    fn a_token_may_have_a_name() {
        let tokens = Tokens::parse("0123456789abcdef\nAda Lovelace: fedcba9876543210\nshop:a:b:0123456789abcdef\n").unwrap();
        let of = |token: &str| tokens.opened_by(token).map(|caller| caller.name().map(str::to_owned));
        assert_eq!(of("0123456789abcdef"), Some(None));
        assert_eq!(of("fedcba9876543210"), Some(Some("Ada Lovelace".into())));
        assert_eq!(of("a:b:0123456789abcdef"), Some(Some("shop".into())), "the first colon ends the name");
        for token in ["Ada Lovelace: fedcba9876543210", "Ada Lovelace:fedcba9876543210", "Ada Lovelace", ""] {
            assert_eq!(of(token), None, "{token}");
        }
        let key = headers("x-api-key", "fedcba9876543210");
        assert_eq!(tokens.admit(&key).unwrap().name(), Some("Ada Lovelace"));
    }

    #[test]
    fn short_tokens_and_none_are_refused() {
        for (text, words) in
            [("# only words\n", "holds no token"), ("x\n", "line 1"), ("0123456789abcdef\nmy own token 123\n", "line 2")]
        {
            assert!(Tokens::parse(text).err().unwrap().starts_with(words), "{text}");
        }
        let long = format!("{}:0123456789abcdef", "n".repeat(65));
        for text in ["Ada:short", ":0123456789abcdef", &long, "Ada:0123456789abcdef\nGrace:0123456789abcdef"] {
            assert!(Tokens::parse(text).err().unwrap().starts_with("line "), "{text}");
        }
        assert!(Tokens::parse("Ada:0123456789abcdef\nAda:fedcba9876543210").is_ok(), "one may have two");
    }
}
