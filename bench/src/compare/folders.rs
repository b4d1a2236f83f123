//! Where things of this crate are.

use std::path::{Path, PathBuf};

/// The folder of this crate.
pub(crate) fn home() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Where raw runs are kept, unless told otherwise.
pub(crate) fn results() -> PathBuf {
    home().join("results")
}
