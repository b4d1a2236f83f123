//! How many may do at once what takes long, and who does it.

use std::collections::{BTreeSet, HashSet};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;

use crate::uploads::Key;

use super::problem::Problem;

/// Uploads at a time.
const UPLOADS: usize = 8;
/// Listeners at a time.
pub(super) const LISTENERS: usize = 64;
/// People who show a token at a time.
pub(super) const LOGINS: usize = 4;

/// How long a client waits for its turn to have something drawn.
const PATIENCE: Duration = Duration::from_secs(20);
/// So many that cannot be drawn are remembered.
const REMEMBERED: usize = 4096;

/// Who draws, and what cannot be drawn.
pub(super) struct Drawings {
    seat: Arc<Semaphore>,
    impossible: Mutex<HashSet<String>>,
}

impl Default for Drawings {
    fn default() -> Self {
        Self { seat: Arc::new(Semaphore::new(1)), impossible: Mutex::default() }
    }
}

impl Drawings {
    /// The turn to draw.
    ///
    /// # Errors
    /// When others draw for long.
    pub(super) async fn turn(&self) -> Result<OwnedSemaphorePermit, Problem> {
        let busy = || Problem::unavailable("another picture is being made; try again");
        timeout(PATIENCE, Arc::clone(&self.seat).acquire_owned()).await.map_err(|_| busy())?.map_err(|_| busy())
    }

    /// Came the drawing of this name to nothing, for good?
    pub(super) fn is_impossible(&self, name: &str) -> bool {
        self.impossible.lock().unwrap_or_else(PoisonError::into_inner).contains(name)
    }

    /// It did.
    pub(super) fn set_impossible(&self, name: String) {
        let mut impossible = self.impossible.lock().unwrap_or_else(PoisonError::into_inner);
        if impossible.len() >= REMEMBERED {
            impossible.clear();
        }
        impossible.insert(name);
    }
}

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
