//! One request to a receiver, and the head of its answer. Nothing of a body is read, no address is followed to another one, and all of it has an end.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use crate::url::Url;

/// How long a connection may take to be there.
const CONNECT: Duration = Duration::from_secs(3);
/// How often a wait looks whether it is over.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// Longest head of an answer, in bytes.
const LONGEST_HEAD: usize = 16 << 10;
/// Most headers of an answer.
const MOST_HEADERS: usize = 64;

/// The head of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Answer {
    pub status: u16,
    /// The receiver wants to be left alone for so long.
    pub retry_after: Option<Duration>,
}

/// Sends `body` as JSON with these headers, until `is_over`.
///
/// # Errors
/// As connecting, writing and reading; of kind `TimedOut` when it is over before there is an answer, `InvalidData` when that is none.
pub(crate) fn post(url: &Url, headers: &[(&str, String)], body: &[u8], is_over: &dyn Fn() -> bool) -> io::Result<Answer> {
    let mut stream = connect(url)?;
    stream.set_read_timeout(Some(LOOK_EVERY))?;
    stream.set_write_timeout(Some(CONNECT))?;
    let mut request = format!("POST {} HTTP/1.1\r\nHost: {}\r\n", url.path, url.authority());
    request += &format!("User-Agent: suture/{}\r\nConnection: close\r\n", env!("CARGO_PKG_VERSION"));
    request += &format!("Content-Type: application/json\r\nContent-Length: {}\r\n", body.len());
    for (name, value) in headers {
        request += &format!("{name}: {value}\r\n");
    }
    request += "\r\n";
    stream.write_all(&[request.as_bytes(), body].concat())?;
    let mut head = Vec::new();
    let mut piece = [0; 1024];
    loop {
        if let Some(answer) = parse(&mut head)? {
            return Ok(answer);
        }
        match stream.read(&mut piece) {
            Ok(0) => return Err(io::Error::new(ErrorKind::UnexpectedEof, "the receiver hung up without an answer")),
            Ok(read) => head.extend_from_slice(piece.get(..read).unwrap_or_default()),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(error) => return Err(error),
        }
        if is_over() {
            return Err(io::Error::new(ErrorKind::TimedOut, "the receiver took too long to answer"));
        }
    }
}

/// To the first of its addresses that is there.
fn connect(url: &Url) -> io::Result<TcpStream> {
    let mut last = io::Error::new(ErrorKind::NotFound, "no machine has that name");
    for address in (url.host.as_str(), url.port).to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECT) {
            Ok(stream) => return Ok(stream),
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// The answer in `head`, if all of it is there. Words before it (`100 Continue`) are taken away.
fn parse(head: &mut Vec<u8>) -> io::Result<Option<Answer>> {
    loop {
        let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
        let mut response = httparse::Response::new(&mut headers);
        let none = |why: &str| io::Error::new(ErrorKind::InvalidData, format!("what the receiver says is no answer: {why}"));
        let length = match response.parse(head).map_err(|error| none(&error.to_string()))? {
            httparse::Status::Complete(length) => length,
            httparse::Status::Partial if head.len() > LONGEST_HEAD => return Err(none("its head does not end")),
            httparse::Status::Partial => return Ok(None),
        };
        let status = response.code.ok_or_else(|| none("it has no status"))?;
        if status >= 200 {
            let after = response.headers.iter().find(|header| header.name.eq_ignore_ascii_case("retry-after"));
            let seconds = after.and_then(|after| std::str::from_utf8(after.value).ok()?.trim().parse().ok());
            return Ok(Some(Answer { status, retry_after: seconds.map(Duration::from_secs) }));
        }
        head.drain(..length);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> io::Result<Option<Answer>> {
        parse(&mut text.as_bytes().to_vec())
    }

    #[test]
    fn heads_are_read() {
        let answer = |status, seconds: Option<u64>| Some(Answer { status, retry_after: seconds.map(Duration::from_secs) });
        assert_eq!(parsed("HTTP/1.1 200 OK\r\n\r\nbody").unwrap(), answer(200, None));
        assert_eq!(parsed("HTTP/1.0 503 No\r\nRETRY-AFTER: 7\r\n\r\n").unwrap(), answer(503, Some(7)));
        assert_eq!(parsed("HTTP/1.1 429 No\r\nRetry-After: tomorrow\r\n\r\n").unwrap(), answer(429, None));
        assert_eq!(parsed("HTTP/1.1 100 Continue\r\n\r\nHTTP/1.1 204 \r\n\r\n").unwrap(), answer(204, None));
        for part in ["", "HTTP/1.1", "HTTP/1.1 200 OK\r\nA: b\r\n", "HTTP/1.1 100 Continue\r\n\r\n"] {
            assert_eq!(parsed(part).unwrap(), None, "{part}");
        }
    }

    #[test]
    fn what_is_no_answer_is_refused() {
        let endless = format!("HTTP/1.1 200 OK\r\nA: {}", "b".repeat(LONGEST_HEAD));
        for text in ["SSH-2.0-x\r\n", "HTTP/1.1 two OK\r\n\r\n", &endless] {
            assert_eq!(parsed(text).unwrap_err().kind(), ErrorKind::InvalidData, "{}", &text[..9]);
        }
    }

    #[test]
    fn one_who_says_nothing_is_not_waited_for_for_ever() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let url = Url::parse(&format!("http://{}/", listener.local_addr().unwrap())).unwrap();
        let looks = std::cell::Cell::new(0);
        let is_over = || looks.replace(looks.get() + 1) == 2;
        assert_eq!(post(&url, &[], b"{}", &is_over).unwrap_err().kind(), ErrorKind::TimedOut);
        assert_eq!(looks.get(), 3);
    }
}
