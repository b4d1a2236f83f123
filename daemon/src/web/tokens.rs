//! Who may ask: whoever has one of the tokens, if there are any.

use std::io;
use std::path::Path;
use std::sync::Arc;

use axum::http::HeaderMap;
use axum::http::header::AUTHORIZATION;

/// A shorter token could be guessed.
const SHORTEST: usize = 16;

/// Digests of the tokens: comparing two takes as long whatever they are.
#[derive(Clone)]
pub(crate) struct Tokens(Option<Arc<[blake3::Hash]>>);

impl Tokens {
    /// Reads one token a line; lines that are empty or begin with `#` are left out. Without a file, no token is needed.
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
        let mut all = Vec::new();
        for (number, token) in lines {
            if token.len() < SHORTEST || !token.bytes().all(|byte| byte.is_ascii_graphic()) {
                let number = number + 1;
                return Err(format!(
                    "line {number}: a token is one word of {SHORTEST} characters at least (try `openssl rand -hex 32`)"
                ));
            }
            all.push(blake3::hash(token.as_bytes()));
        }
        if all.is_empty() { Err("holds no token (try `openssl rand -hex 32`)".into()) } else { Ok(Self(Some(all.into()))) }
    }

    /// Is one needed?
    pub(crate) fn are_needed(&self) -> bool {
        self.0.is_some()
    }

    /// Is it one of them?
    pub(crate) fn are_opened_by(&self, token: &str) -> bool {
        let given = blake3::hash(token.as_bytes());
        self.0.iter().flat_map(|known| known.iter()).fold(false, |any, known| any | (*known == given))
    }

    /// Does whoever sent these headers have one, where one is needed? As `Authorization: Bearer TOKEN` or `X-API-Key: TOKEN`.
    pub(crate) fn allow(&self, headers: &HeaderMap) -> bool {
        if !self.are_needed() {
            return true;
        }
        let bearer = headers.get(AUTHORIZATION).and_then(|value| value.to_str().ok()).and_then(|value| {
            let (scheme, token) = value.split_once(' ')?;
            scheme.eq_ignore_ascii_case("bearer").then_some(token.trim())
        });
        let key = headers.get("x-api-key").and_then(|value| value.to_str().ok());
        // Each with each, so that nothing is told by how long it took.
        bearer.into_iter().chain(key).fold(false, |any, token| any | self.are_opened_by(token))
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
            assert!(tokens.allow(&headers(name, value)), "{name}: {value}");
        }
        for (name, value) in [
            ("authorization", "Basic 0123456789abcdef"),
            ("authorization", "0123456789abcdef"),
            ("authorization", "Bearer 0123456789abcde"),
            ("x-api-key", ""),
            ("x-api-key", "# of the farm"),
            ("cookie", "0123456789abcdef"),
        ] {
            assert!(!tokens.allow(&headers(name, value)), "{name}: {value}");
        }
        assert!(!tokens.allow(&HeaderMap::new()));
        assert!(Tokens::of(None).is_ok_and(|none| none.allow(&HeaderMap::new())));
    }

    #[test]
    fn short_tokens_and_none_are_refused() {
        for (text, words) in
            [("# only words\n", "holds no token"), ("x\n", "line 1"), ("0123456789abcdef\nmy own token 123\n", "line 2")]
        {
            assert!(Tokens::parse(text).err().unwrap().starts_with(words), "{text}");
        }
    }
}
