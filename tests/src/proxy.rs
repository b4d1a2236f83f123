//! A way to an object store that fails as such ways do, by a seed.

use std::collections::HashMap;
use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicU8, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use suture_store::testkit::Chance;

/// How it behaves.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(u8)]
pub enum Mood {
    /// It carries all.
    Honest,
    /// Of three calls one meets a [`Fault`].
    Failing,
    /// Nothing is allowed any more.
    Refusing,
    /// Nothing is answered.
    Dead,
}

/// A call may end in such a way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fault {
    /// An error of the server, which did nothing.
    Undone,
    /// An error of the server, which did what was asked.
    Untold,
    /// The answer ends in its middle.
    Cut,
    /// The answer stops for a second in its middle.
    Slow,
    /// A listing that was true some calls ago.
    Stale,
}

const FAULTS: [Fault; 5] = [Fault::Undone, Fault::Untold, Fault::Cut, Fault::Slow, Fault::Stale];
const PAUSE: Duration = Duration::from_secs(1);
const ERROR: &[u8] = b"HTTP/1.1 500 Oops\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";

/// The proxy; it lives as long as the process.
pub struct Proxy {
    /// Where it listens.
    pub address: SocketAddr,
    shared: Arc<Shared>,
}

struct Shared {
    far: SocketAddr,
    mood: AtomicU8,
    chance: Mutex<Chance>,
    /// The last answers to the same question, by what was listed.
    listings: Mutex<HashMap<String, Vec<u8>>>,
    met: [AtomicUsize; FAULTS.len()],
}

impl Proxy {
    /// Listens at that address, on any port, for calls of the server at `far`.
    ///
    /// # Panics
    /// When it cannot listen.
    pub fn start(at: &str, far: SocketAddr, mood: Mood, seed: u64) -> Self {
        let listener = TcpListener::bind((at, 0)).expect("a port");
        let address = listener.local_addr().expect("an address");
        let shared = Shared {
            far,
            mood: AtomicU8::new(mood as u8),
            chance: Mutex::new(Chance::new(seed)),
            listings: Mutex::default(),
            met: Default::default(),
        };
        let shared = Arc::new(shared);
        let own = Arc::clone(&shared);
        std::thread::spawn(move || {
            for near in listener.incoming().flatten() {
                let shared = Arc::clone(&own);
                // A connection that ends while it is served has its end.
                std::thread::spawn(move || _ = shared.relay(near));
            }
        });
        Self { address, shared }
    }

    /// From the next call on.
    pub fn become_now(&self, mood: Mood) {
        self.shared.mood.store(mood as u8, Ordering::SeqCst);
    }

    /// How often each fault was met so far.
    pub fn met(&self) -> Vec<(Fault, usize)> {
        FAULTS.into_iter().zip(self.shared.met.iter().map(|count| count.load(Ordering::Relaxed))).collect()
    }
}

impl Shared {
    /// One call: the server ends each connection with its answer.
    fn relay(&self, mut near: TcpStream) -> std::io::Result<()> {
        let mood = self.mood.load(Ordering::SeqCst);
        if mood == Mood::Dead as u8 {
            return Ok(());
        }
        let head = head(&mut near)?;
        if mood == Mood::Refusing as u8 {
            let body = "<Error><Code>AccessDenied</Code><AWSAccessKeyId>a-key</AWSAccessKeyId></Error>";
            let head = format!("HTTP/1.1 403 Forbidden\r\nContent-Length: {}\r\nConnection: close\r\n\r\n", body.len());
            return refuse(near, &[head.as_bytes(), body.as_bytes()].concat());
        }
        let listed = listed(&head);
        let fault = if mood == Mood::Failing as u8 { self.fault(listed.is_some()) } else { None };
        if fault == Some(Fault::Undone) {
            return refuse(near, ERROR);
        }
        let answer = self.ask(&near, &head)?;
        let answer = match listed {
            Some(what) => self.listing(what, answer, fault == Some(Fault::Stale)),
            None => answer,
        };
        let half = answer.len() / 2;
        match fault {
            Some(Fault::Untold) => near.write_all(ERROR)?,
            Some(Fault::Cut) => near.write_all(&answer[..half])?,
            Some(Fault::Slow) => {
                near.write_all(&answer[..half])?;
                std::thread::sleep(PAUSE);
                near.write_all(&answer[half..])?;
            }
            Some(Fault::Undone | Fault::Stale) | None => near.write_all(&answer)?,
        }
        near.shutdown(Shutdown::Both)
    }

    fn fault(&self, is_listing: bool) -> Option<Fault> {
        let mut chance = self.chance.lock().unwrap_or_else(PoisonError::into_inner);
        let fault = chance.one_in(3).then(|| chance.pick(&FAULTS)).filter(|fault| is_listing || *fault != Fault::Stale)?;
        self.met[fault as usize].fetch_add(1, Ordering::Relaxed);
        Some(fault)
    }

    /// Has the server do it; its whole answer.
    fn ask(&self, near: &TcpStream, head: &[u8]) -> std::io::Result<Vec<u8>> {
        let mut far = TcpStream::connect(self.far)?;
        far.write_all(head)?;
        let (mut from, mut to) = (near.try_clone()?, far.try_clone()?);
        std::thread::spawn(move || std::io::copy(&mut from, &mut to));
        let mut answer = Vec::new();
        far.read_to_end(&mut answer)?;
        // The thread beside has nothing to do any more.
        near.shutdown(Shutdown::Read)?;
        Ok(answer)
    }

    fn listing(&self, what: String, answer: Vec<u8>, is_stale: bool) -> Vec<u8> {
        let mut listings = self.listings.lock().unwrap_or_else(PoisonError::into_inner);
        match listings.get(&what).filter(|_| is_stale) {
            Some(earlier) => earlier.clone(),
            None => {
                listings.insert(what, answer.clone());
                answer
            }
        }
    }
}

/// Reads the head of a request, and perhaps more; an answer that is sent before would be lost with the connection.
fn head(near: &mut TcpStream) -> std::io::Result<Vec<u8>> {
    let (mut head, mut buffer) = (Vec::new(), [0; 4096]);
    while !head.windows(4).any(|four| four == b"\r\n\r\n") {
        match near.read(&mut buffer)? {
            0 => return Err(std::io::ErrorKind::UnexpectedEof.into()),
            n => head.extend_from_slice(&buffer[..n]),
        }
    }
    Ok(head)
}

/// Answers without a server. The body that still comes is read, for some time: with bytes unread, the answer would be lost.
fn refuse(mut near: TcpStream, answer: &[u8]) -> std::io::Result<()> {
    near.write_all(answer)?;
    near.shutdown(Shutdown::Write)?;
    near.set_read_timeout(Some(PAUSE))?;
    std::io::copy(&mut near, &mut std::io::sink()).map(drop)
}

/// The prefix and page that a request lists; `None`: it is another request.
fn listed(head: &[u8]) -> Option<String> {
    let line = String::from_utf8_lossy(head.split(|byte| *byte == b'\r').next()?).into_owned();
    let (_, query) = line.split(' ').nth(1)?.split_once('?')?;
    let words: Vec<&str> = query.split('&').collect();
    let is_of_it = |word: &&&str| word.starts_with("prefix=") || word.starts_with("continuation-token=");
    words.contains(&"list-type=2").then(|| words.iter().filter(is_of_it).copied().collect::<Vec<_>>().join("&"))
}
