//! Names of entries, and which of them are safe.

use std::collections::HashMap;

use super::super::finding::Rejection;
use crate::util::legible::legible;

/// Bytes of a name, at most.
const LONGEST: usize = 1024;

/// A name for people: control characters escaped, cut to 80 characters, in quotes.
pub(crate) fn shown(name: &str) -> String {
    format!("\"{}\"", legible(name))
}

/// A refusal of the archive for this entry.
pub(super) fn refused(name: &str, reason: impl std::fmt::Display) -> Rejection {
    Rejection::Unreadable(format!("the archive's entry {} {reason}", shown(name)))
}

/// The name as text. Bytes that are no UTF-8 become U+FFFD, which no name of a part has.
pub(super) fn text(name: &[u8]) -> String {
    let start = name.get(..LONGEST).unwrap_or(name);
    String::from_utf8_lossy(start).into_owned()
}

/// Refuses a name that is a risk wherever an entry is unpacked, or that is none.
pub(super) fn check(name: &[u8]) -> Result<(), Rejection> {
    let text = text(name);
    let refuse = |reason: &str| Err(refused(&text, reason));
    if name.is_empty() {
        return Err(Rejection::Unreadable("an entry of the archive has no name".into()));
    }
    if name.len() > LONGEST {
        return refuse("has a name of more than 1 024 bytes");
    }
    if name.contains(&b'\\') {
        return refuse("has a backslash in its name");
    }
    if text.chars().any(char::is_control) {
        return refuse("has a control character in its name");
    }
    // A letter and a colon are a drive.
    if name.starts_with(b"/") || matches!(name, [drive, b':', ..] if drive.is_ascii_alphabetic()) {
        return refuse("has an absolute name");
    }
    if name.split(|byte| *byte == b'/').any(|part| part == b"..") {
        return refuse("leads out of its folder");
    }
    Ok(())
}

/// Names and the numbers of their entries. Names of parts are equal when they differ by the case of ASCII letters alone (ECMA-376 part 2, 6.2.2.3).
#[derive(Debug, Default)]
pub(super) struct Names(HashMap<Vec<u8>, usize>);

impl Names {
    /// Adds a name, and refuses one that is there already.
    pub(super) fn add(&mut self, name: &[u8]) -> Result<(), Rejection> {
        let number = self.0.len();
        match self.0.insert(name.to_ascii_lowercase(), number) {
            None => Ok(()),
            Some(_) => Err(refused(&text(name), "is there twice, or differs from another one by the case of letters alone")),
        }
    }

    /// The number of this name's entry.
    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.0.get(name.to_ascii_lowercase().as_bytes()).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_parts_are_taken() {
        for name in ["3D/3dmodel.model", "[Content_Types].xml", "_rels/.rels", "3D/", "a..b/..c", "Metadata/größe.png", ".", "C"]
        {
            assert_eq!(check(name.as_bytes()), Ok(()), "{name}");
        }
        assert_eq!(check(&[b'a'; 1024]), Ok(()));
    }

    #[test]
    fn unsafe_names_are_refused_by_name() {
        for (name, word) in [
            ("", "no name"),
            ("..", "leads out"),
            ("../a", "leads out"),
            ("a/../../b", "leads out"),
            ("/etc/passwd", "absolute"),
            ("C:/a", "absolute"),
            ("a\\b", "backslash"),
            ("a\0b", "\\u{0}"),
            ("a\nb", "\\n"),
            ("a\u{85}b", "control"),
        ] {
            let Err(Rejection::Unreadable(reason)) = check(name.as_bytes()) else { panic!("{name} is taken") };
            assert!(reason.contains(word), "{reason}");
            assert!(!reason.contains(['\0', '\n']), "{reason}");
        }
        assert!(check(&[b'a'; 1025]).is_err());
    }

    #[test]
    fn long_names_are_cut_and_turned_text_is_escaped() {
        assert_eq!(shown(&"é".repeat(81)).chars().filter(|c| *c == 'é').count(), 80);
        assert!(shown(&"é".repeat(81)).ends_with("…\""));
        assert_eq!(shown("a\u{202e}b"), "\"a\\u{202e}b\"");
    }

    #[test]
    fn names_are_equal_without_case() {
        let mut names = Names::default();
        assert!(names.add(b"3D/A.model").is_ok() && names.add(b"3D/B.model").is_ok());
        assert!(names.add(b"3d/a.MODEL").is_err());
        assert!(names.add("3D/Ä".as_bytes()).is_ok() && names.add("3D/ä".as_bytes()).is_ok(), "ASCII alone");
    }
}
