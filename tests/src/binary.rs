//! The binary under test, built by the test itself: a binary that happens to lie about may be anyone's.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Tries to get hold of a build before another test's build takes its place.
const TRIES: u32 = 10;

/// The `suture` binary with crash points, in a place of its own.
///
/// # Panics
/// When it cannot be built: no test means anything then.
pub fn with_crash_points() -> &'static Path {
    static BUILT: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    &BUILT
        .get_or_init(|| {
            let dir = tempfile::tempdir().expect("a temporary folder");
            let copy = dir.path().join("suture");
            // Builds with other features leave their result under the same name: look which one was caught.
            let caught = (0..TRIES).any(|_| {
                std::fs::copy(build(&["--features", "crash-points"]), &copy).expect("the built binary can be copied");
                let version = Command::new(&copy).arg("--version").output().expect("the built binary runs");
                String::from_utf8_lossy(&version.stdout).contains("crash points")
            });
            assert!(caught, "no build with crash points could be got hold of");
            (dir, copy)
        })
        .1
}

/// Builds the binary and returns where cargo says it is.
fn build(options: &[&str]) -> PathBuf {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["build", "--quiet", "--package", "suture", "--message-format", "json"])
        .args(options)
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
        .output()
        .expect("cargo can be started");
    assert!(output.status.success(), "suture does not build: {}", String::from_utf8_lossy(&output.stderr));
    let messages = String::from_utf8_lossy(&output.stdout).into_owned();
    messages
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter_map(|message| message.get("executable")?.as_str().map(PathBuf::from))
        .next_back()
        .expect("cargo names the binary it built")
}
