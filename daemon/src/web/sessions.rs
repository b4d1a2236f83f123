//! People who have shown a token at `/login`: a browser keeps a random name of the session, never the token, and the daemon the digest of that name, in memory
//! alone. And what shows that a form is of a page of ours, seen in that session.

use std::io;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use axum::http::header::COOKIE;
use axum::http::{HeaderMap, HeaderValue};
use rustix::rand::{GetRandomFlags, getrandom};

use super::tokens::Caller;

/// Sessions at a time; a further one ends the oldest.
const MOST: usize = 256;
/// A session that is not used for so long is over.
const REST: Duration = Duration::from_hours(12);
/// Name of the cookie.
const NAME: &str = "suture-session";

struct Session {
    name: blake3::Hash,
    caller: Caller,
    used: Instant,
}

/// Open sessions, of one life of the daemon.
pub(super) struct Sessions {
    /// Known to this process alone.
    secret: [u8; 32],
    open: Mutex<Vec<Session>>,
}

impl Sessions {
    /// None is open yet.
    ///
    /// # Errors
    /// When the system has nothing random.
    pub(super) fn new() -> io::Result<Self> {
        Ok(Self { secret: random()?, open: Mutex::default() })
    }

    /// Opens one for whoever has shown a token; the cookie to set.
    ///
    /// # Errors
    /// When the system has nothing random.
    pub(super) fn open(&self, caller: Caller, now: Instant) -> io::Result<HeaderValue> {
        let name = blake3::Hash::from(random()?).to_hex();
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        if open.len() >= MOST {
            open.remove(0);
        }
        open.push(Session { name: blake3::hash(name.as_bytes()), caller, used: now });
        HeaderValue::try_from(format!("{NAME}={name}; Path=/; HttpOnly; SameSite=Strict")).map_err(io::Error::other)
    }

    /// Whoever opened the session that the browser which sent these headers is in, if it is in one.
    pub(super) fn of(&self, headers: &HeaderMap, now: Instant) -> Option<Caller> {
        let given = cookie(headers).map(|name| blake3::hash(name.as_bytes()))?;
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        open.retain(|session| now.saturating_duration_since(session.used) < REST);
        let session = open.iter_mut().find(|session| session.name == given)?;
        session.used = now;
        Some(session.caller.clone())
    }

    /// Ends the session that sent these headers; the cookie to set.
    pub(super) fn close(&self, headers: &HeaderMap) -> HeaderValue {
        if let Some(given) = cookie(headers).map(|name| blake3::hash(name.as_bytes())) {
            self.open.lock().unwrap_or_else(PoisonError::into_inner).retain(|session| session.name != given);
        }
        HeaderValue::from_static("suture-session=; Path=/; HttpOnly; SameSite=Strict; Max-Age=0")
    }

    /// The word that forms of pages carry which this browser is shown.
    pub(super) fn form_word(&self, headers: &HeaderMap) -> String {
        blake3::keyed_hash(&self.secret, cookie(headers).unwrap_or_default().as_bytes()).to_hex().to_string()
    }

    /// Is it that word?
    pub(super) fn is_form_word(&self, headers: &HeaderMap, given: &str) -> bool {
        // Digests are compared, so that nothing is told by how long it took.
        blake3::hash(self.form_word(headers).as_bytes()) == blake3::hash(given.as_bytes())
    }
}

fn random() -> io::Result<[u8; 32]> {
    let mut bytes = [0; 32];
    // So few bytes come at once, or not at all.
    let got = getrandom(&mut bytes, GetRandomFlags::empty())?;
    if got == bytes.len() { Ok(bytes) } else { Err(io::Error::other("the system has nothing random to give")) }
}

/// The name of the session that a browser believes to be in.
fn cookie(headers: &HeaderMap) -> Option<&str> {
    let lines = headers.get_all(COOKIE).iter().filter_map(|line| line.to_str().ok());
    let mut pairs = lines.flat_map(|line| line.split(';')).filter_map(|pair| pair.trim().split_once('='));
    pairs.find(|(name, _)| *name == NAME).map(|(_, value)| value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(cookie: &HeaderValue) -> HeaderMap {
        let pair = cookie.to_str().unwrap().split(';').next().unwrap();
        HeaderMap::from_iter([(COOKIE, format!("other=1; {pair}").parse().unwrap())])
    }

    fn has(sessions: &Sessions, headers: &HeaderMap, now: Instant) -> bool {
        sessions.of(headers, now).is_some()
    }

    #[test]
    fn a_session_is_open_until_it_is_closed_or_rests() {
        let (sessions, now) = (Sessions::new().unwrap(), Instant::now());
        let (first, second) = (sessions.open(Caller::default(), now).unwrap(), sessions.open(Caller::default(), now).unwrap());
        assert_ne!(first, second);
        assert!(first.to_str().unwrap().contains("HttpOnly; SameSite=Strict"));
        assert!(has(&sessions, &with(&first), now) && !has(&sessions, &HeaderMap::new(), now));
        assert!(!has(&sessions, &with(&HeaderValue::from_static("suture-session=")), now));
        assert!(!has(&Sessions::new().unwrap(), &with(&first), now), "of another life");
        sessions.close(&with(&first));
        assert!(!has(&sessions, &with(&first), now) && has(&sessions, &with(&second), now));
        assert!(has(&sessions, &with(&second), now + REST - Duration::from_secs(1)), "used again");
        assert!(has(&sessions, &with(&second), now + REST), "so that it goes on");
        assert!(!has(&sessions, &with(&second), now + 3 * REST));
    }

    #[test]
    fn so_many_are_open_and_no_more() {
        let (sessions, now) = (Sessions::new().unwrap(), Instant::now());
        let all: Vec<_> = (0..=MOST).map(|_| sessions.open(Caller::default(), now).unwrap()).collect();
        assert!(!has(&sessions, &with(&all[0]), now) && all[1..].iter().all(|cookie| has(&sessions, &with(cookie), now)));
    }

    #[test]
    fn the_word_of_a_form_is_of_one_session_and_one_life() {
        let (sessions, now) = (Sessions::new().unwrap(), Instant::now());
        let (one, other) =
            (with(&sessions.open(Caller::default(), now).unwrap()), with(&sessions.open(Caller::default(), now).unwrap()));
        let word = sessions.form_word(&one);
        assert!(sessions.is_form_word(&one, &word));
        for (headers, given) in [(&one, ""), (&other, &word), (&HeaderMap::new(), &word)] {
            assert!(!sessions.is_form_word(headers, given));
        }
        assert!(!Sessions::new().unwrap().is_form_word(&one, &word));
    }
}
