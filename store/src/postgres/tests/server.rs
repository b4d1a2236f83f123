//! Stores on the tests' own server.

use std::time::Duration;

use super::super::Shared;
pub(super) use crate::testkit::server::{Server, server};

/// Gives stores out.
pub(super) trait Schemas {
    /// A store of its own, for a daemon of that name.
    fn schema(&self, daemon: &str) -> Shared;
}

impl Schemas for Server {
    fn schema(&self, daemon: &str) -> Shared {
        let patience = Duration::from_secs(30);
        Shared { schema: format!("store_{}", self.number()), patience, ..Shared::new(&self.url(), daemon) }
    }
}
