//! Where a webhook is: `http://HOST[:PORT][/PATH]`, and nothing else that an address may have.

/// The address of a receiver.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Url {
    /// Without the brackets of an IPv6 address.
    pub host: String,
    pub port: u16,
    /// With what follows it, from the slash on.
    pub path: String,
}

impl Url {
    /// # Errors
    /// A line for people.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        if text.starts_with("https://") {
            return Err(format!(
                "`{text}` wants encryption, which is a proxy's work here: name one on this machine with http://, or have `[on_done]` call a client such as curl"
            ));
        }
        let wrong = || format!("`{text}` is no address of a receiver (try http://127.0.0.1:9000/suture)");
        let rest = text.strip_prefix("http://").ok_or_else(wrong)?;
        if !rest.bytes().all(|byte| byte.is_ascii_graphic()) || rest.contains('#') {
            return Err(wrong());
        }
        let at = rest.find(['/', '?']).unwrap_or(rest.len());
        let (authority, path) = rest.split_at(at);
        if authority.contains('@') {
            return Err(format!("`{text}` holds a password; sign messages with a `secret_file` instead"));
        }
        let (host, port) = match authority.strip_prefix('[') {
            Some(rest) => rest.split_once(']').ok_or_else(wrong)?,
            None => authority.split_at(authority.find(':').unwrap_or(authority.len())),
        };
        let port = match port {
            "" => 80,
            port => port.strip_prefix(':').and_then(|port| port.parse().ok()).filter(|port| *port != 0).ok_or_else(wrong)?,
        };
        if host.is_empty() || host.contains(['[', ']']) || (host.contains(':') && !authority.starts_with('[')) {
            return Err(wrong());
        }
        let path = if path.starts_with('/') { path.to_owned() } else { format!("/{path}") };
        Ok(Self { host: host.to_owned(), port, path })
    }

    /// Host and port, as a request names them.
    pub(crate) fn authority(&self) -> String {
        let host = if self.host.contains(':') { format!("[{}]", self.host) } else { self.host.clone() };
        if self.port == 80 { host } else { format!("{host}:{}", self.port) }
    }
}

impl std::fmt::Display for Url {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "http://{}{}", self.authority(), self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read() {
        for (text, host, port, path, shown) in [
            ("http://farm", "farm", 80, "/", "http://farm/"),
            ("http://127.0.0.1:9000/a/b?c=d", "127.0.0.1", 9000, "/a/b?c=d", "http://127.0.0.1:9000/a/b?c=d"),
            ("http://[::1]:81/x", "::1", 81, "/x", "http://[::1]:81/x"),
            ("http://farm?x", "farm", 80, "/?x", "http://farm/?x"),
        ] {
            let url = Url::parse(text).unwrap();
            assert_eq!((url.host.as_str(), url.port, url.path.as_str()), (host, port, path), "{text}");
            assert_eq!(url.to_string(), shown);
            assert_eq!(Url::parse(&url.to_string()), Ok(url));
        }
    }

    #[test]
    fn what_is_no_address_is_refused() {
        let wrong = [
            "",
            "farm",
            "ftp://farm",
            "http://",
            "http:///x",
            "http://:80",
            "http://farm:0",
            "http://farm:x",
            "http://a b",
            "http://farm/\r\nX: y",
            "http://::1/",
            "http://[::1",
            "http://farm/#x",
            "http://farm:70000",
        ];
        for text in wrong {
            assert!(Url::parse(text).is_err_and(|line| line.contains("try http://")), "{text}");
        }
        assert!(Url::parse("https://farm/x").unwrap_err().contains("curl"));
        assert!(Url::parse("http://me:secret@farm/x").unwrap_err().contains("`secret_file`"));
    }
}
