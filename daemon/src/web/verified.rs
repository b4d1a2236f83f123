//! Files that were found to be what their jobs left: remembered for as long as they are not touched.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use suture_store::JobId;

use crate::fsx::Identity;

/// Files that are remembered.
const REMEMBERED: usize = 1024;

/// A file of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Which {
    Result,
    Report,
    /// As it came.
    Original,
}

/// Files that were found to be what their jobs left.
#[derive(Default)]
pub(super) struct Verified(Mutex<HashMap<(JobId, Which), Identity>>);

impl Verified {
    pub(super) fn has(&self, key: (JobId, Which), found: &Identity) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get(&key) == Some(found)
    }

    pub(super) fn add(&self, key: (JobId, Which), found: Identity) {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if known.len() >= REMEMBERED {
            known.clear();
        }
        known.insert(key, found);
    }
}
