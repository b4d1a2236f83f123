//! How soon a file is wanted.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A job counts for one step of priority more after each so many milliseconds since it was dropped, or retried.
pub const AGEING_MS: u64 = 30 * 60_000;

/// How soon a file is wanted: 0 to 9, the higher first; 5 unless someone says otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "i64", into = "i64")]
pub struct Priority(u8);

impl Priority {
    /// The last to be taken.
    pub const LOWEST: Self = Self(0);
    /// The first to be taken.
    pub const HIGHEST: Self = Self(9);

    /// Steps from another one up to this one; none if it is not below.
    pub(crate) fn above(self, other: Self) -> u64 {
        self.0.saturating_sub(other.0).into()
    }

    /// The next lower one.
    pub(crate) fn lowered(self) -> Option<Self> {
        self.0.checked_sub(1).map(Self)
    }

    /// Is it the one that counts where no one says anything?
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// Higher by so many steps, as far as there are any.
    pub fn raised(self, steps: u64) -> Self {
        let raised = u64::from(self.0).saturating_add(steps);
        u8::try_from(raised).map_or(Self::HIGHEST, |raised| Self(raised).min(Self::HIGHEST))
    }
}

impl Default for Priority {
    fn default() -> Self {
        Self(5)
    }
}

/// A number that is no priority.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a priority is a whole number from 0 to 9, the higher the sooner, not {0}")]
pub struct NoPriority(i64);

impl TryFrom<i64> for Priority {
    type Error = NoPriority;

    fn try_from(number: i64) -> Result<Self, NoPriority> {
        let small = u8::try_from(number).ok().map(Self);
        small.filter(|priority| *priority <= Self::HIGHEST).ok_or(NoPriority(number))
    }
}

impl From<Priority> for i64 {
    fn from(priority: Priority) -> Self {
        priority.0.into()
    }
}

impl fmt::Display for Priority {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
