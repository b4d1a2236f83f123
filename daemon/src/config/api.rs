//! How the web interface is reached, and by whom.

use std::net::SocketAddr;
use std::path::PathBuf;

/// Largest upload unless the configuration says otherwise, in bytes.
const MAX_UPLOAD: u64 = 4 << 30;

/// The web interface of a daemon.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Api {
    /// Where it listens.
    pub listen: SocketAddr,
    /// A file with one token a line, each with a name if it has one; without it, everyone who reaches the address may ask everything.
    pub token_file: Option<PathBuf>,
    /// Names by which clients may call this machine, beside `localhost` and addresses.
    pub hosts: Vec<String>,
    /// Largest upload in bytes.
    pub max_upload: u64,
}

impl Api {
    /// At this address, everything else by default.
    pub(crate) fn at(listen: SocketAddr) -> Self {
        Self { listen, token_file: None, hosts: Vec::new(), max_upload: MAX_UPLOAD }
    }

    /// Refuses an address that others reach, unless they need a token.
    ///
    /// # Errors
    /// A line for people.
    pub(crate) fn check(&self) -> Result<(), String> {
        if self.listen.ip().is_loopback() || self.token_file.is_some() {
            return Ok(());
        }
        Err(format!(
            "everyone in the network reaches {}, so it needs tokens; name a file of them with `token_file` in `[api]`, or listen at 127.0.0.1:{}",
            self.listen,
            self.listen.port()
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::parse_listen;

    #[test]
    fn beyond_this_machine_only_with_tokens() {
        let check = |listen: &str, token_file: Option<&str>| {
            Api { token_file: token_file.map(PathBuf::from), ..Api::at(parse_listen(listen).unwrap()) }.check()
        };
        for loopback in ["127.0.0.1:0", "127.9.9.9:80", "[::1]:7878"] {
            assert_eq!(check(loopback, None), Ok(()), "{loopback}");
        }
        for beyond in ["0.0.0.0:7878", "[::]:7878", "192.168.1.5:80"] {
            assert!(check(beyond, None).unwrap_err().contains("`token_file`"), "{beyond}");
            assert_eq!(check(beyond, Some("tokens")), Ok(()));
        }
        assert!(parse_listen("localhost").unwrap_err().contains("try 127.0.0.1:7878"));
    }
}
