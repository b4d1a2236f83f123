//! Names of the parts of a hot folder, and of what this program keeps in the private one.

/// All parts of a hot folder.
pub(crate) const PARTS: [&str; 6] = ["in", "out", "done", "failed", "quarantine", ".suture/work"];
/// Work in progress and the job store.
pub(crate) const PRIVATE: &str = ".suture";
/// Locked by the daemon that serves the folder, and its process number.
pub(crate) const LOCK: &str = "owner";
pub(crate) const PID: &str = "owner.pid";
/// Tells the folder from every other one.
pub(crate) const MARK: &str = "id";
