//! A client of the web interface that can also be rude.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::Duration;

use serde_json::Value;

use crate::openapi::assert_fits;
use crate::served::{Served, wait_until};

/// An answer is waited for so long.
const PATIENCE: Duration = Duration::from_secs(60);

/// A browser wants pages.
const BROWSER: (&str, &str) = ("Accept", "text/html,application/xhtml+xml,*/*;q=0.8");

/// A client of one daemon.
pub struct Client {
    /// Where the daemon listens.
    pub address: String,
}

/// An answer.
#[derive(Debug)]
pub struct Answer {
    /// The code of its status; 0 when the connection was closed without an answer.
    pub status: u16,
    /// Names in small letters.
    pub headers: Vec<(String, String)>,
    /// The body, whole.
    pub body: Vec<u8>,
}

impl Client {
    /// Of a daemon that says in its log where it listens.
    ///
    /// # Panics
    /// When it does not.
    pub fn of(served: &Served) -> Self {
        let lines = || served.lines("Serving the web interface.");
        wait_until("the web interface", || !lines().is_empty());
        let address = lines().last().and_then(|line| line["address"].as_str().map(str::to_owned));
        Self { address: address.expect("an address") }
    }

    /// Asks for something.
    ///
    /// # Panics
    /// When no whole answer comes.
    pub fn get(&self, path: &str) -> Answer {
        self.send("GET", path, &[], b"")
    }

    /// Sends a request, with headers beside those that every request has, and a body. Whatever comes back must be as the daemon's document says.
    ///
    /// # Panics
    /// When no whole answer comes.
    pub fn send(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &[u8]) -> Answer {
        let answer = self.ask(method, path, headers, body);
        // A head that is too long never gets as far as the handlers.
        if ![0, 431].contains(&answer.status) {
            assert_fits(method, path, &answer);
        }
        answer
    }

    /// Asks as a person's browser does. What comes back is for people, and no document describes it.
    ///
    /// # Panics
    /// When no whole answer comes.
    pub fn browse(&self, path: &str) -> Answer {
        self.ask("GET", path, &[BROWSER], b"")
    }

    /// Sends a form as a page of the daemon does, with headers beside those that every browser sends.
    ///
    /// # Panics
    /// When no whole answer comes.
    pub fn submit(&self, path: &str, headers: &[(&str, &str)], form: &str) -> Answer {
        let kind = ("Content-Type", "application/x-www-form-urlencoded");
        self.ask("POST", path, &[&[BROWSER, kind], headers].concat(), form.as_bytes())
    }

    /// Sends a request, with headers beside those that every request has, and a body.
    ///
    /// # Panics
    /// When no whole answer comes.
    pub fn ask(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &[u8]) -> Answer {
        let has = |name: &str| headers.iter().any(|(there, _)| there.eq_ignore_ascii_case(name));
        let mut head = format!("{method} {path} HTTP/1.1\r\nConnection: close\r\n");
        if !has("host") {
            head += &format!("Host: {}\r\n", self.address);
        }
        if !has("content-length") && !has("transfer-encoding") {
            head += &format!("Content-Length: {}\r\n", body.len());
        }
        head.extend(headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")));
        self.raw(&[head.as_bytes(), b"\r\n", body].concat())
    }

    /// Sends bytes, whatever they are, and takes what comes.
    ///
    /// # Panics
    /// When the daemon cannot be reached.
    pub fn raw(&self, bytes: &[u8]) -> Answer {
        let mut stream = self.connect();
        // Whoever is refused early does not get rid of the rest.
        let _ = stream.write_all(bytes);
        read_answer(&mut stream)
    }

    /// A connection on which nothing was said yet.
    ///
    /// # Panics
    /// When the daemon cannot be reached.
    pub fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.address).expect("the daemon listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("a time can be set");
        stream
    }
}

/// Reads to the end of the connection.
///
/// # Panics
/// When what comes is no answer.
pub fn read_answer(stream: &mut TcpStream) -> Answer {
    let mut bytes = Vec::new();
    // A reset after the answer is an end, too.
    let _ = stream.read_to_end(&mut bytes);
    let _ = stream.shutdown(Shutdown::Both);
    let Some(end) = bytes.windows(4).position(|window| window == b"\r\n\r\n") else {
        return Answer { status: 0, headers: Vec::new(), body: bytes };
    };
    let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let mut lines = head.lines();
    let status = lines.next().and_then(|line| line.split(' ').nth(1)?.parse().ok()).expect("a status");
    let headers: Vec<(String, String)> = lines
        .filter_map(|line| line.split_once(':'))
        .map(|(name, value)| (name.to_ascii_lowercase(), value.trim().to_owned()))
        .collect();
    let chunked = headers.iter().any(|(name, value)| name == "transfer-encoding" && value == "chunked");
    let body = bytes.split_off(end + 4);
    Answer { status, headers, body: if chunked { unchunked(&body) } else { body } }
}

fn unchunked(mut body: &[u8]) -> Vec<u8> {
    let mut whole = Vec::new();
    while let Some(end) = body.windows(2).position(|window| window == b"\r\n") {
        let size = String::from_utf8_lossy(&body[..end]).into_owned();
        let size = usize::from_str_radix(&size, 16).expect("the size of a chunk");
        let from = end + 2;
        if size == 0 || body.len() < from + size {
            break;
        }
        whole.extend_from_slice(&body[from..from + size]);
        body = body.get(from + size + 2..).unwrap_or_default();
    }
    whole
}

impl Answer {
    /// The value of a header.
    pub fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(there, _)| there == name).map(|(_, value)| value.as_str())
    }

    /// Fails unless it has this status; returns itself.
    ///
    /// # Panics
    /// When it has not.
    pub fn expect(self, status: u16) -> Self {
        assert_eq!(self.status, status, "{:?}: {}", self.headers, String::from_utf8_lossy(&self.body));
        self
    }

    /// The body as text.
    ///
    /// # Panics
    /// When it is none.
    pub fn text(&self) -> &str {
        std::str::from_utf8(&self.body).expect("text")
    }

    /// The body as JSON.
    ///
    /// # Panics
    /// When it is none.
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|error| panic!("{error}: {}", String::from_utf8_lossy(&self.body)))
    }
}
