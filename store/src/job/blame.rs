//! Who is to blame for a death, and what follows from it.

use serde::{Deserialize, Serialize};

/// Charged attempts after which a file is quarantined.
pub const CHARGES: u32 = 2;
/// Deaths of the daemon of what this file's worker said, after which the file is quarantined: at least [`DEATHS_ALONE`] of them with nothing
/// else running.
pub const DEATHS_IN_HAND: u32 = 3;
/// So many of these deaths that there was no company to take the blame, charged attempts included.
pub const DEATHS_ALONE: u32 = 2;
/// Deaths of the daemon, for whatever reason, after which a file must run alone. One is enough if it was of what its worker said.
pub const DEATHS_TO_SUSPECT: u32 = 2;
/// Kills from outside after which the next start waits; they never end a job.
pub const KILLS_FREE: u32 = 3;

/// What is known of a death of the daemon that interrupted a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Testimony {
    /// Nothing. A kill from outside leaves nothing behind, and a worker cannot kill the daemon: it is not allowed to send signals.
    None,
    /// The job's worker was still at work, or had ended well, when the daemon was gone.
    Outlived,
    /// The daemon died while it read what the job's worker had to say.
    InHand,
    /// The machine went down: the system was started anew since.
    Machine,
}

/// What counts against a file. Reset by an operator's retry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Blame {
    /// Attempts whose worker died of the file.
    pub charges: u32,
    /// Deaths of the daemon while it ran, without a witness for it.
    pub deaths: u32,
    /// Those of them that were the file's: the daemon was reading its worker's answer, and nothing else ran.
    pub deaths_alone: u32,
    /// Deaths of the daemon while it read its worker's answer, in company or not.
    #[serde(default, skip_serializing_if = "is_none")]
    pub in_hand: u8,
    /// Deaths of the machine while it ran. They are never the file's; it runs alone afterwards, so that it cannot take others along.
    #[serde(default)]
    pub machine: u32,
    /// Errors of the environment.
    pub environment: u32,
    /// Kills from outside. They are counted only so that a start after many of them waits.
    pub kills: u32,
}

impl Blame {
    /// Must it run alone?
    pub fn is_suspect(&self) -> bool {
        self.deaths >= DEATHS_TO_SUSPECT || self.in_hand > 0 || self.machine > 0
    }

    /// Has it killed too often?
    pub fn is_condemned(&self) -> bool {
        let alone = self.charges.saturating_add(self.deaths_alone);
        // Older records count those alone only.
        let all = self.charges.saturating_add(self.deaths_alone.max(self.in_hand.into()));
        self.charges >= CHARGES || (alone >= DEATHS_ALONE && all >= DEATHS_IN_HAND)
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde gives a reference")]
fn is_none(count: &u8) -> bool {
    *count == 0
}

/// How a worker process died.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Death {
    /// By a signal of its own making (SIGSEGV, SIGBUS, SIGABRT …).
    Signal(i32),
    /// It ended with a code that is none of its protocol's (a panic).
    Exit(i32),
    /// It reached its time limit.
    TimeLimit,
    /// It reached its memory limit.
    MemoryLimit,
    /// It was killed from outside (SIGKILL, SIGTERM), not by one of our limits.
    Killed(i32),
}

impl Death {
    /// Did the worker die of the file?
    pub fn is_charged(self) -> bool {
        !matches!(self, Self::Killed(_))
    }
}

impl std::fmt::Display for Death {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Signal(signal) => write!(f, "the repair crashed on it (signal {signal})"),
            Self::Exit(code) => write!(f, "the repair ended in an error of its own on it (code {code})"),
            Self::TimeLimit => f.write_str("the repair did not come to an end within its time limit"),
            Self::MemoryLimit => f.write_str("the repair needed more memory than it may have"),
            Self::Killed(signal) => write!(f, "the repair was killed from outside (signal {signal})"),
        }
    }
}
