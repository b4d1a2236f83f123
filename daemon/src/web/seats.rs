//! How many may do at once what takes long, and who does it.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::Semaphore;

use crate::uploads::Key;

use super::problem::Problem;

/// Uploads at a time.
const UPLOADS: usize = 8;
/// Listeners at a time.
pub(super) const LISTENERS: usize = 64;

/// Uploads under way.
pub(super) struct Uploads {
    pub seats: Semaphore,
    keys: Mutex<BTreeSet<Key>>,
}

impl Default for Uploads {
    fn default() -> Self {
        Self { seats: Semaphore::new(UPLOADS), keys: Mutex::default() }
    }
}

/// A key whose upload is under way, until its file has its place, whether the client is still there or not.
pub(super) struct Taken {
    uploads: Arc<Uploads>,
    pub key: Key,
}

impl Uploads {
    /// Begins one with a key.
    ///
    /// # Errors
    /// When one with the same key is under way.
    pub(super) fn take(self: &Arc<Self>, key: Key) -> Result<Taken, Problem> {
        let mut keys = self.keys.lock().unwrap_or_else(PoisonError::into_inner);
        if !keys.insert(key.clone()) {
            return Err(Problem::conflict("an upload with this `Idempotency-Key` is under way; ask again when it is done"));
        }
        drop(keys);
        Ok(Taken { uploads: Arc::clone(self), key })
    }
}

impl Drop for Taken {
    fn drop(&mut self) {
        self.uploads.keys.lock().unwrap_or_else(PoisonError::into_inner).remove(&self.key);
    }
}
