//! How a program runs: which side, from which state of the cache, with which threads and memory.

use serde::{Deserialize, Serialize};

use super::sides::Side;

/// Where the input is when a process starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Cache {
    /// Read just before, so in the page cache as far as that is large enough.
    Warm,
    /// Synced and dropped from the page cache by `posix_fadvise(DONTNEED)`. The disk may have a cache of its own.
    Cold,
}

impl std::str::FromStr for Cache {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "warm" => Ok(Self::Warm),
            "cold" => Ok(Self::Cold),
            _ => Err("the states of the cache are warm and cold".into()),
        }
    }
}

/// Which program ran, and how: runs of one way are one sample.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) struct Way {
    pub(crate) side: Side,
    pub(crate) cache: Cache,
    /// `--threads` of suture; `None`: as the program likes.
    pub(crate) threads: Option<u16>,
    /// `--memory` of suture; `None`: its default.
    pub(crate) memory: Option<String>,
    /// Limit of the memory cgroup it ran in, in bytes.
    pub(crate) cgroup: Option<u64>,
}

impl Way {
    /// With a warm cache and nothing else said.
    pub(crate) fn plain(side: Side) -> Self {
        Self { side, cache: Cache::Warm, threads: None, memory: None, cgroup: None }
    }

    /// In words.
    pub(crate) fn name(&self) -> String {
        let mut name = self.side.facts().name.to_owned();
        if self.cache == Cache::Cold {
            name += ", cold";
        }
        match self.threads {
            Some(1) => name += ", 1 thread",
            Some(threads) => name += &format!(", {threads} threads"),
            None => {}
        }
        if let Some(memory) = &self.memory {
            name += &format!(", --memory {memory}");
        }
        if let Some(bytes) = self.cgroup {
            name += &format!(", cgroup of {} MiB", bytes >> 20);
        }
        name
    }
}
