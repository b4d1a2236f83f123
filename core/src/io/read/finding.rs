//! What is odd about a file, and why one is not read.

use super::limits::MAX_TRIANGLES;
use crate::contract::error::Error;
use crate::util::legible::escaped;
use crate::util::words::Count;
use std::path::Path;

/// Something odd about the file itself (not about its mesh).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// One line for people.
    pub text: String,
    /// `true`: common slicers read the file all the same, and read the same mesh. `false`: some of them refuse it or read
    /// something else, so a file that is otherwise clean is worth rewriting.
    pub harmless: bool,
    /// Whether it says that a part of the mesh is lost.
    pub loss: Loss,
}

/// Whether a finding says that a part of the mesh is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// It says nothing of a loss.
    None,
    /// More than one triangle that the file announces is not there, or nobody knows how many: if the mesh is open, too, a part of it is lost.
    IfOpen,
    /// The file was cut off; whole bodies may be missing, so that what is left may well be closed.
    Certain,
}

impl Finding {
    pub(super) fn flaw(text: impl Into<String>) -> Self {
        Self { text: escaped(&text.into(), LONGEST_LINE), harmless: false, loss: Loss::None }
    }

    pub(super) fn loss(text: impl Into<String>) -> Self {
        Self { loss: Loss::IfOpen, ..Self::flaw(text) }
    }
}

/// Characters of a line that has a file's own words, at most.
const LONGEST_LINE: usize = 1000;

/// Why a file was not read, before it is joined with the file's name.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Rejection {
    /// No mesh, or damaged beyond reading.
    Unreadable(String),
    /// More triangles than a binary STL can count.
    TooMany,
    /// More triangles than this by objects that are placed again.
    Copies(u64),
}

impl Rejection {
    pub(crate) fn at(self, path: &Path) -> Error {
        match self {
            // Whatever of the file's words is in it.
            Self::Unreadable(reason) => Error::Unreadable { path: path.to_owned(), reason: escaped(&reason, LONGEST_LINE) },
            Self::TooMany => Error::Refused {
                path: path.to_owned(),
                reason: format!("more than {} triangles", Count(MAX_TRIANGLES)),
                advice: "split it, for no binary STL can count them".into(),
            },
            Self::Copies(most) => Error::Refused {
                path: path.to_owned(),
                reason: format!("the copies of its objects are more than {} triangles", Count(most)),
                advice: "let it place fewer copies".into(),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::util::legible::{legible, legible_bytes};

    #[test]
    fn f13_whatever_a_file_says_is_shown_in_one_line() {
        let hostile = "a\u{1b}[2J\nb\u{202e}c".to_owned() + &"x".repeat(1 << 20);
        let finding = Finding::flaw(hostile.clone());
        let refused = Rejection::Unreadable(hostile.clone()).at(Path::new("a.3mf")).to_string();
        for line in [finding.text, refused, legible(&hostile), legible_bytes(hostile.as_bytes())] {
            assert!(line.contains("a\\u{1b}[2J\\nb\\u{202e}cx") && line.ends_with('…'), "{line}");
            assert!(line.len() < 1100 && !line.chars().any(char::is_control));
        }
        assert_eq!(Finding::flaw("1\u{2009}000 “öd”").text, "1\u{2009}000 “öd”");
    }
}
