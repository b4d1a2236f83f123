//! The words for where a job stands.

use serde::{Deserialize, Serialize};

/// `State` without its data, endings told apart: what lists and counters show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A file was seen, and is not taken yet.
    Noticed,
    /// Queued, and may be claimed.
    Queued,
    /// Queued, after a pause.
    Waiting,
    /// Queued, but must run alone.
    Alone,
    /// A worker has it.
    Running,
    /// It is decided how it ends, and nothing is in place yet.
    Concluded,
    /// Its result is being put in its place.
    Publishing,
    /// Its result is in its place, and the original is to be moved.
    Published,
    /// Its result is known, but cannot be brought into place for now: tried again after a pause.
    Parked,
    /// Good, and in `out/`.
    Done,
    /// No mesh, but named by one: in `out/`, as it was dropped.
    Carried,
    /// Not good, and in `failed/`.
    Failed,
    /// Good, but a person must look; in `failed/`.
    NeedsReview,
    /// A person has looked, and does not want it; in `failed/`.
    Rejected,
    /// It crashed or hung the repair.
    Quarantined,
    /// It was withdrawn.
    Cancelled,
}

impl Kind {
    /// All of them, in the order of a job's life.
    pub const ALL: [Self; 16] = [
        Self::Noticed,
        Self::Queued,
        Self::Waiting,
        Self::Alone,
        Self::Running,
        Self::Concluded,
        Self::Publishing,
        Self::Published,
        Self::Parked,
        Self::Done,
        Self::Carried,
        Self::Failed,
        Self::NeedsReview,
        Self::Rejected,
        Self::Quarantined,
        Self::Cancelled,
    ];

    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Noticed => "noticed",
            Self::Queued => "queued",
            Self::Waiting => "waiting",
            Self::Alone => "queued_alone",
            Self::Running => "running",
            Self::Concluded => "concluded",
            Self::Publishing => "publishing",
            Self::Published => "published",
            Self::Parked => "parked",
            Self::Done => "done",
            Self::Carried => "carried",
            Self::Failed => "failed",
            Self::NeedsReview => "needs_review",
            Self::Rejected => "rejected",
            Self::Quarantined => "quarantined",
            Self::Cancelled => "cancelled",
        }
    }

    /// Is there something left to do without anyone asking for it?
    pub fn is_live(self) -> bool {
        self.is_queued() || self.is_held() || self == Self::Parked
    }

    /// Is it over, unless an operator wants it tried again?
    pub fn is_at_rest(self) -> bool {
        !self.is_live() && self != Self::Noticed
    }

    /// Waiting for a claim.
    pub fn is_queued(self) -> bool {
        matches!(self, Self::Queued | Self::Waiting | Self::Alone)
    }

    /// Under a claim.
    pub fn is_held(self) -> bool {
        matches!(self, Self::Running | Self::Concluded | Self::Publishing | Self::Published)
    }
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}
