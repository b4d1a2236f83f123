//! Notices for subscribers: ends of jobs, and news of the service itself.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::id::{Seq, Time};
use crate::job::{Job, Kind};

/// Something that happened to the service, and not to a job.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum News {
    /// A hot folder is out of reach.
    FolderAway {
        /// Its name.
        folder: String,
        /// A line for people.
        reason: String,
    },
    /// It is served again.
    FolderBack {
        /// Its name.
        folder: String,
    },
    /// A night is over.
    Night {
        /// The end of the night before.
        since: Time,
        /// Its own end.
        until: Time,
        /// How many jobs there are of each kind: of those that are over for everyone, only the ones that ended in that night.
        jobs: BTreeMap<Kind, u64>,
    },
}

/// News, as they are kept until every subscriber has them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Word {
    /// Number of the transition that they came with; tells one word from another.
    pub seq: Seq,
    /// When they came.
    pub at: Time,
    /// The news themselves.
    pub news: News,
}

/// Something that a subscriber has not heard yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Notice {
    /// A job, as it stood when it came to its end.
    End(Box<Job>),
    /// News of the service.
    Word(Word),
}

impl Notice {
    /// Number of the transition; tells one notice from another.
    pub fn seq(&self) -> Seq {
        match self {
            Self::End(job) => job.seq,
            Self::Word(word) => word.seq,
        }
    }
}
