//! A server that speaks S3: `moto_server`, which `.ci/run` installs.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};

use crate::served::wait_until;

/// A server of a test's own.
pub struct Store {
    child: Child,
    /// Of this machine, or of the network of a test.
    host: String,
    /// Where it listens.
    pub port: u16,
}

impl Drop for Store {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Store {
    /// `None`, and a line: this machine has no such server.
    ///
    /// # Panics
    /// Where CI has none.
    pub fn start() -> Option<Self> {
        Self::start_at("127.0.0.1")
    }

    /// At an address of the machine that this thread is on.
    ///
    /// # Panics
    /// Where CI has none.
    pub fn start_at(host: &str) -> Option<Self> {
        let port = TcpListener::bind((host, 0)).and_then(|free| free.local_addr()).expect("a port").port();
        let mut command = Command::new("moto_server");
        command.args(["-H", host, "-p", &port.to_string()]).stdout(Stdio::null()).stderr(Stdio::null());
        match command.spawn() {
            Ok(child) => {
                let store = Self { child, host: host.into(), port };
                wait_until("the object store listens", || TcpStream::connect((host, port)).is_ok());
                Some(store)
            }
            Err(error) if std::env::var_os("CI").is_none() => {
                println!("skipped: moto_server cannot be started: {error}");
                None
            }
            Err(error) => panic!("moto_server: {error}"),
        }
    }

    /// Where it listens.
    ///
    /// # Panics
    /// When the address of its machine is a name.
    pub fn address(&self) -> SocketAddr {
        SocketAddr::new(self.host.parse().expect("numbers"), self.port)
    }

    /// Asks, and returns the body of the answer.
    ///
    /// # Panics
    /// When there is none.
    pub fn ask(&self, method: &str, path: &str, body: &[u8]) -> Vec<u8> {
        self.answer(method, path, body).1
    }

    /// Asks, and returns the head of the answer and its body.
    ///
    /// # Panics
    /// When there is none.
    pub fn answer(&self, method: &str, path: &str, body: &[u8]) -> (String, Vec<u8>) {
        let mut stream = TcpStream::connect(self.address()).expect("it listens");
        let head = format!(
            "{method} {path} HTTP/1.0\r\nHost: localhost\r\nAuthorization: AWS4-HMAC-SHA256 Credential=a/20260101/us-east-1/s3/aws4_request\r\n\
             Content-Length: {}\r\n\r\n",
            body.len()
        );
        stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(body)).expect("it reads");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("it answers");
        let at = answer.windows(4).position(|four| four == b"\r\n\r\n").expect("a head");
        let body = answer.split_off(at + 4);
        (String::from_utf8_lossy(&answer).into_owned(), body)
    }

    /// The keys of all objects of the bucket `prints`.
    ///
    /// # Panics
    /// When it does not answer.
    pub fn keys(&self) -> Vec<String> {
        let (mut keys, mut from) = (Vec::new(), String::new());
        loop {
            let listed = String::from_utf8(self.ask("GET", &format!("/prints?list-type=2{from}"), b"")).expect("text");
            let all_of =
                |name: &'static str| listed.split(name).skip(1).filter_map(|rest| rest.split('<').next()).map(String::from);
            keys.extend(all_of("<Key>"));
            match all_of("<NextContinuationToken>").next() {
                Some(token) => from = format!("&continuation-token={token}"),
                None => return keys,
            }
        }
    }
}

/// Has a command use the object store at that port of this machine.
pub fn on(command: Command, port: u16) -> Command {
    at(command, &SocketAddr::from(([127, 0, 0, 1], port)))
}

/// Has a command use the object store at that address.
pub fn at(mut command: Command, address: &SocketAddr) -> Command {
    command.env("AWS_ENDPOINT", format!("http://{address}")).env("AWS_ALLOW_HTTP", "true").env("AWS_REGION", "us-east-1");
    command.env("AWS_ACCESS_KEY_ID", "a-key").env("AWS_SECRET_ACCESS_KEY", "a-secret");
    command
}
