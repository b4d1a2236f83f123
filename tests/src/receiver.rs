//! A receiver of webhooks: it notes what it is sent, and answers as it is told to. It checks signatures as any receiver does.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, SocketAddrV4, TcpListener, TcpStream};
use std::os::fd::OwnedFd;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use hmac::{Hmac, KeyInit, Mac};
use rustix::net::{AddressFamily, SocketType, bind, getsockname, socket, sockopt};
use serde_json::Value;
use sha2::Sha256;

/// A request that came.
#[derive(Clone, Debug)]
pub struct Message {
    /// What follows the host in the address.
    pub path: String,
    /// Names in small letters.
    pub headers: Vec<(String, String)>,
    /// As it was sent.
    pub body: Vec<u8>,
}

impl Message {
    /// A header's value; empty where there is none.
    pub fn header(&self, name: &str) -> &str {
        self.headers.iter().find(|(there, _)| there == name).map_or("", |(_, value)| value.as_str())
    }

    /// The body as JSON.
    ///
    /// # Panics
    /// When it is none.
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body).expect("a body of JSON")
    }

    /// Is it signed with this secret? Then when, in seconds since 1970.
    pub fn signed(&self, secret: &str) -> Option<u64> {
        let (time, signature) = self.header("suture-signature").strip_prefix("t=")?.split_once(",v1=")?;
        let mut mac = Hmac::<Sha256>::new_from_slice(secret.as_bytes()).ok()?;
        mac.update(&[time.as_bytes(), b".", &self.body].concat());
        let own: String = mac.finalize().into_bytes().iter().map(|byte| format!("{byte:02x}")).collect();
        (own == signature).then(|| time.parse().ok())?
    }
}

#[derive(Default)]
struct Shared {
    came: Mutex<Vec<Message>>,
    answers: Mutex<VecDeque<String>>,
}

/// A port on which no one listens, and which is given to no one else as long as this lives. Tests run side by side: a port that was let go is soon
/// another daemon's.
pub struct Port {
    /// Where it is: `127.0.0.1:PORT`.
    pub address: SocketAddrV4,
    /// Bound, and never listening. A second socket may listen at the same address, if it asks for the address by name and for `SO_REUSEADDR`, as
    /// `TcpListener` and Python do; the system itself chooses a bound port for no one (`inet_csk_find_open_port` of Linux).
    _held: OwnedFd,
}

impl Port {
    /// A port of the system's choice.
    ///
    /// # Panics
    /// When there is none to be had.
    pub fn new() -> Self {
        let held = socket(AddressFamily::INET, SocketType::STREAM, None).expect("a socket");
        sockopt::set_socket_reuseaddr(&held, true).expect("a socket that shares its address");
        bind(&held, &SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0)).expect("a port is free");
        let address = getsockname(&held).ok().and_then(|address| address.try_into().ok()).expect("an address");
        Self { address, _held: held }
    }
}

impl Default for Port {
    fn default() -> Self {
        Self::new()
    }
}

/// A receiver that answers until the test ends.
pub struct Receiver {
    /// Where it is: `127.0.0.1:PORT`.
    pub address: String,
    shared: Arc<Shared>,
}

impl Receiver {
    /// One that takes everything.
    ///
    /// # Panics
    /// When there is no port to be had.
    pub fn start() -> Self {
        Self::at("127.0.0.1:0", &[])
    }

    /// One at this address, that gives each of `answers` once (a status line and headers, each with its end of line; nothing: it says nothing, and
    /// keeps the connection), and then takes everything.
    ///
    /// # Panics
    /// When the address is not to be had.
    pub fn at(address: &str, answers: &[&str]) -> Self {
        let listener = TcpListener::bind(address).expect("the address is free");
        let address = listener.local_addr().expect("an address").to_string();
        let shared = Arc::<Shared>::default();
        lock(&shared.answers).extend(answers.iter().map(|answer| (*answer).to_owned()));
        let serving = Arc::clone(&shared);
        // It ends with the process.
        std::thread::spawn(move || {
            let mut silent = Vec::new();
            for stream in listener.incoming().flatten() {
                silent.extend(serve(&serving, stream));
            }
        });
        Self { address, shared }
    }

    /// All that came so far.
    pub fn came(&self) -> Vec<Message> {
        lock(&self.shared.came).clone()
    }
}

fn lock<T>(what: &Mutex<T>) -> MutexGuard<'_, T> {
    what.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Takes one message. The connection in return, if nothing is said on it.
fn serve(shared: &Shared, stream: TcpStream) -> Option<TcpStream> {
    let mut reader = BufReader::new(stream.try_clone().ok()?);
    let mut line = String::new();
    reader.read_line(&mut line).ok()?;
    let path = line.split(' ').nth(1)?.to_owned();
    let mut headers = Vec::new();
    loop {
        let mut line = String::new();
        reader.read_line(&mut line).ok()?;
        let Some((name, value)) = line.trim_end().split_once(": ") else { break };
        headers.push((name.to_ascii_lowercase(), value.to_owned()));
    }
    let mut message = Message { path, headers, body: Vec::new() };
    // One that is killed in the midst of it has sent nothing.
    let length: usize = message.header("content-length").parse().ok()?;
    message.body = vec![0; length];
    reader.read_exact(&mut message.body).ok()?;
    lock(&shared.came).push(message);
    let answer = lock(&shared.answers).pop_front();
    if answer.as_deref() == Some("") {
        return Some(stream);
    }
    let head = answer.unwrap_or_else(|| "HTTP/1.1 204 No Content\r\n".into());
    let _ = (&stream).write_all(format!("{head}\r\n").as_bytes());
    None
}
