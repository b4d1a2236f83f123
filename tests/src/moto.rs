//! A server that speaks S3: `moto_server`, which `.ci/run` installs.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};

use crate::served::wait_until;

/// A server of a test's own.
pub struct Store {
    child: Child,
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
        let port = TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr()).expect("a port").port();
        let mut command = Command::new("moto_server");
        command.args(["-H", "127.0.0.1", "-p", &port.to_string()]).stdout(Stdio::null()).stderr(Stdio::null());
        match command.spawn() {
            Ok(child) => {
                let store = Self { child, port };
                wait_until("the object store listens", || TcpStream::connect(("127.0.0.1", port)).is_ok());
                Some(store)
            }
            Err(error) if std::env::var_os("CI").is_none() => {
                println!("skipped: moto_server cannot be started: {error}");
                None
            }
            Err(error) => panic!("moto_server: {error}"),
        }
    }

    /// Asks, and returns the body of the answer.
    ///
    /// # Panics
    /// When there is none.
    pub fn ask(&self, method: &str, path: &str, body: &[u8]) -> Vec<u8> {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).expect("it listens");
        let head = format!(
            "{method} {path} HTTP/1.0\r\nHost: localhost\r\nAuthorization: AWS4-HMAC-SHA256 Credential=a/20260101/us-east-1/s3/aws4_request\r\n\
             Content-Length: {}\r\n\r\n",
            body.len()
        );
        stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(body)).expect("it reads");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("it answers");
        let at = answer.windows(4).position(|four| four == b"\r\n\r\n").expect("a head");
        answer.split_off(at + 4)
    }

    /// The keys of all objects of the bucket `prints`.
    ///
    /// # Panics
    /// When it does not answer.
    pub fn keys(&self) -> Vec<String> {
        let listed = String::from_utf8(self.ask("GET", "/prints?list-type=2", b"")).expect("text");
        listed.split("<Key>").skip(1).filter_map(|rest| rest.split('<').next()).map(String::from).collect()
    }
}

/// Has a command use the object store at that port.
pub fn on(mut command: Command, port: u16) -> Command {
    command.env("AWS_ENDPOINT", format!("http://127.0.0.1:{port}")).env("AWS_ALLOW_HTTP", "true").env("AWS_REGION", "us-east-1");
    command.env("AWS_ACCESS_KEY_ID", "a-key").env("AWS_SECRET_ACCESS_KEY", "a-secret");
    command
}
