//! What a person says of a result that needs review.

use std::fmt::{Display, Formatter};

use serde::{Deserialize, Serialize};

use super::words::{MAX_REASON, one_line};
use crate::id::Time;

/// Longest name of who decides, in bytes.
pub const MAX_BY: usize = 64;

/// Is the result to be used?
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The best attempt is as good as any result: it is published.
    Approved,
    /// It is not to be used.
    Rejected,
}

impl Verdict {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Approved => "approved",
            Self::Rejected => "rejected",
        }
    }
}

/// What a person said, and when.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Decision {
    /// Is the result to be used?
    pub verdict: Verdict,
    /// Who said so: a name, as it was given.
    pub by: String,
    /// Words to go with it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub note: String,
    /// When the store took it down.
    pub at: Time,
}

impl Display for Decision {
    /// The verdict, and who said so.
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} by {}", self.verdict.name(), self.by)
    }
}

/// A decision that cannot be taken down.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says it")]
pub enum NoDecision {
    #[error("say who decides: a name of 1 to {MAX_BY} bytes")]
    By,
    #[error("the note is longer than {MAX_REASON} bytes; say it in fewer words")]
    Note,
}

impl Decision {
    /// What `by` says. The store puts the time to it.
    ///
    /// # Errors
    /// When the name is missing, or something is too long to be recorded.
    pub fn new(verdict: Verdict, by: &str, note: &str) -> Result<Self, NoDecision> {
        let (by, note) = (by.trim(), note.trim());
        if by.is_empty() || by.len() > MAX_BY {
            return Err(NoDecision::By);
        }
        if note.len() > MAX_REASON {
            return Err(NoDecision::Note);
        }
        Ok(Self { verdict, by: one_line(by), note: one_line(note), at: Time(0) })
    }
}
