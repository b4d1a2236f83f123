//! Paths relative to a hot folder's parts (`in/`, `out/`, `failed/` …), as bytes: a file's name need not be UTF-8.
//!
//! In records and messages a path is text in which `%`, `"`, `\`, control characters and every byte that is not part of valid
//! UTF-8 stand as `%XX`; where that makes it longer than two digits for every byte (a name in another encoding), it is `%%` and
//! those digits. The text is reversible, prints on one line, and JSON adds nothing to it.

use std::ffi::OsStr;
use std::fmt::{self, Write as _};
use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// Longest path in its text form, in bytes; a
/// single name of 255 bytes, none of them valid UTF-8, fits.
pub const MAX_TEXT: usize = 640;

/// Longest path of a dropped file, in its text form.
pub const MAX_SOURCE: usize = MAX_NAMED - 32;

/// Longest path of what is made of a dropped file: what a name adds to it (`~99999`, `.best`, each byte as two digits) still fits, so
/// that no file is taken for which there are no names. Shorter than [`MAX_TEXT`], since a record has come to hold more than its paths.
pub(crate) const MAX_NAMED: usize = MAX_TEXT - 28;

/// A relative path without `.`, `..`, empty parts or NUL.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RelPath(Vec<u8>);

/// Why something is no [`RelPath`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says it")]
pub enum PathError {
    #[error("not a plain relative path (absolute, empty, or with `.`, `..` or NUL in it)")]
    NotPlain,
    #[error("longer than {MAX_TEXT} bytes")]
    TooLong,
    #[error("`%` is not followed by two hexadecimal digits")]
    BadEscape,
}

impl RelPath {
    /// The path these bytes spell, parts parted by `/`.
    ///
    /// # Errors
    /// When the bytes are not a plain relative path or too long for a record.
    pub fn new(bytes: impl Into<Vec<u8>>) -> Result<Self, PathError> {
        let bytes = bytes.into();
        let plain = bytes.split(|&b| b == b'/').all(|part| !part.is_empty() && part != b"." && part != b"..");
        if !plain || bytes.contains(&0) {
            return Err(PathError::NotPlain);
        }
        let path = Self(bytes);
        if path.to_string().len() > MAX_TEXT { Err(PathError::TooLong) } else { Ok(path) }
    }

    /// The same of a [`Path`]. On systems whose paths are not bytes, a path that is not Unicode is refused.
    ///
    /// # Errors
    /// As [`RelPath::new`].
    pub fn from_path(path: &Path) -> Result<Self, PathError> {
        let mut bytes = Vec::new();
        for component in path.components() {
            let Component::Normal(name) = component else { return Err(PathError::NotPlain) };
            if !bytes.is_empty() {
                bytes.push(b'/');
            }
            bytes.extend_from_slice(os_bytes(name).ok_or(PathError::NotPlain)?);
        }
        Self::new(bytes)
    }

    /// For the file system, relative to the folder it belongs to.
    pub fn to_path(&self) -> PathBuf {
        self.0.split(|&b| b == b'/').map(os_name).collect()
    }

    /// The bytes, parts parted by `/`.
    pub fn as_bytes(&self) -> &[u8] {
        &self.0
    }

    /// The first characters of its text, for messages about a path that is too long.
    pub fn beginning(&self) -> String {
        self.to_string().chars().take(40).collect()
    }

    /// The last part.
    pub fn name(&self) -> &[u8] {
        self.0.rsplit(|&b| b == b'/').next().unwrap_or_default()
    }

    fn from_text(text: &str) -> Result<Self, PathError> {
        let mut bytes = Vec::with_capacity(text.len());
        let (mut rest, all_digits) = match text.strip_prefix("%%") {
            Some(digits) => (digits.bytes(), true),
            None => (text.bytes(), false),
        };
        while rest.len() > 0 {
            let escaped = all_digits || {
                let byte = rest.next().unwrap_or_default();
                if byte != b'%' {
                    bytes.push(byte);
                }
                byte == b'%'
            };
            if escaped {
                let mut digit = || rest.next().and_then(|b| char::from(b).to_digit(16)).and_then(|d| u8::try_from(d).ok());
                match (digit(), digit()) {
                    (Some(high), Some(low)) => bytes.push(high << 4 | low),
                    _ => return Err(PathError::BadEscape),
                }
            }
        }
        Self::new(bytes)
    }
}

#[cfg(unix)]
fn os_bytes(name: &OsStr) -> Option<&[u8]> {
    Some(std::os::unix::ffi::OsStrExt::as_bytes(name))
}

#[cfg(unix)]
fn os_name(bytes: &[u8]) -> PathBuf {
    PathBuf::from(<OsStr as std::os::unix::ffi::OsStrExt>::from_bytes(bytes))
}

#[cfg(not(unix))]
fn os_bytes(name: &OsStr) -> Option<&[u8]> {
    name.to_str().map(str::as_bytes)
}

#[cfg(not(unix))]
fn os_name(bytes: &[u8]) -> PathBuf {
    PathBuf::from(String::from_utf8_lossy(bytes).into_owned())
}

impl fmt::Display for RelPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = String::with_capacity(self.0.len() + 2);
        for chunk in self.0.utf8_chunks() {
            for c in chunk.valid().chars() {
                if c.is_control() || matches!(c, '%' | '"' | '\\') {
                    c.encode_utf8(&mut [0; 4]).bytes().try_for_each(|byte| write!(text, "%{byte:02X}"))?;
                } else {
                    text.push(c);
                }
            }
            chunk.invalid().iter().try_for_each(|byte| write!(text, "%{byte:02X}"))?;
        }
        if text.len() <= 2 * self.0.len() + 2 {
            return f.pad(&text);
        }
        f.write_str("%%")?;
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02X}"))
    }
}

impl fmt::Debug for RelPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\"{self}\"")
    }
}

impl Serialize for RelPath {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for RelPath {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::from_text(&String::deserialize(deserializer)?).map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn only_plain_relative_paths() {
        for wrong in [&b""[..], b"/a", b"a/", b"a//b", b"..", b"a/../b", b"./a", b"a\0b"] {
            assert_eq!(RelPath::new(wrong), Err(PathError::NotPlain), "{wrong:?}");
        }
        assert_eq!(RelPath::from_path(Path::new("../a")), Err(PathError::NotPlain));
        let path = RelPath::new(*b"scan/part 1.stl").unwrap();
        assert_eq!(path.name(), b"part 1.stl");
        assert_eq!(path.to_path(), Path::new("scan/part 1.stl"));
    }

    #[test]
    fn f23_hostile_names_are_one_line_of_text() {
        let path = RelPath::new(*b"a\nb\"\\50%\xff.stl").unwrap();
        assert_eq!(path.to_string(), "a%0Ab%22%5C50%25%FF.stl");
        // "ÄÖÜ" in Latin-1: no byte of it is UTF-8.
        let path = RelPath::new(*b"\xc4\xd6\xdc").unwrap();
        assert_eq!(path.to_string(), "%%C4D6DC");
        assert_eq!(RelPath::from_text("%%C4D6DC"), Ok(path));
        for wrong in ["%", "%4", "%zz", "%%4", "%%zz"] {
            assert_eq!(RelPath::from_text(wrong), Err(PathError::BadEscape), "{wrong}");
        }
    }

    #[test]
    fn f23_the_longest_name_fits_whatever_its_bytes() {
        assert!(RelPath::new([0xff; 255]).is_ok());
        assert_eq!(RelPath::new([b'a'; MAX_TEXT + 1]), Err(PathError::TooLong));
    }

    proptest! {
        #[test]
        fn text_is_reversible(bytes in proptest::collection::vec(any::<u8>(), 1..200)) {
            if let Ok(path) = RelPath::new(bytes.clone()) {
                let json = serde_json::to_string(&path).unwrap();
                prop_assert_eq!(json.len(), path.to_string().len() + 2);
                let back: RelPath = serde_json::from_str(&json).unwrap();
                prop_assert_eq!(back.as_bytes(), &bytes[..]);
                prop_assert_eq!(RelPath::from_path(&path.to_path()), Ok(path));
            }
        }
    }
}
