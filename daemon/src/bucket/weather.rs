//! How the calls of one object store went lately. A store that does not answer is a folder that is out of reach: its jobs wait, and no file is
//! to blame.

use std::sync::{Mutex, PoisonError};

/// Since the last call that was answered.
#[derive(Debug, Default)]
pub(crate) struct Weather(Mutex<Option<String>>);

impl Weather {
    /// A call was answered.
    pub(super) fn fair(&self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    /// Calls are not answered, for this reason. The first one of an outage stays.
    pub(super) fn foul(&self, reason: &str) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_with(|| reason.to_owned());
    }

    /// Why calls are not answered; `None`: they are, as far as anyone knows.
    pub(crate) fn trouble(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
