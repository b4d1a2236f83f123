//! The claim on a job.

use serde::{Deserialize, Serialize};

use crate::id::{Attempt, Boot, Epoch, Token};

/// Who works on a job, and in which life of the daemon.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hold {
    /// Which attempt this is.
    pub attempt: Attempt,
    /// The life of the daemon that claimed it.
    pub epoch: Epoch,
    /// Names the claim; each claim has another one.
    pub token: Token,
    /// Nothing else may run meanwhile: the job is suspected of killing the daemon, or needs the whole memory.
    pub alone: bool,
    /// The machine's life in which it was claimed.
    #[serde(default)]
    pub boot: Boot,
}

impl Hold {
    /// Of no life of any daemon: a claim puts its own in the place of this one.
    pub(super) fn none(attempt: Attempt) -> Self {
        Self { attempt, epoch: Epoch(0), token: Token(0), alone: false, boot: Boot(0) }
    }
}
