//! The binary under test, built by the test itself: a binary that happens to lie about may be anyone's.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Tries to get hold of a build before another test's build takes its place.
const TRIES: u32 = 10;

/// A built binary, copied into a folder of its own, where no other build can replace it.
type Caught = OnceLock<(tempfile::TempDir, PathBuf)>;

/// The `suture` binary as users build it.
///
/// # Panics
/// When it cannot be built: no test means anything then.
pub fn suture() -> &'static Path {
    static BUILT: Caught = OnceLock::new();
    &BUILT.get_or_init(|| catch(&[], false)).1
}

/// The `suture` binary with crash points.
///
/// # Panics
/// When it cannot be built: no test means anything then.
pub fn with_crash_points() -> &'static Path {
    static BUILT: Caught = OnceLock::new();
    &BUILT.get_or_init(|| catch(&["--features", "crash-points"], true)).1
}

fn catch(options: &[&str], crash_points: bool) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let copy = dir.path().join("suture");
    // Builds with other features leave their result under the same name: look which one was caught.
    let caught = (0..TRIES).any(|_| {
        std::fs::copy(build(options), &copy).expect("the built binary can be copied");
        let version = Command::new(&copy).arg("--version").output().expect("the built binary runs");
        String::from_utf8_lossy(&version.stdout).contains("crash points") == crash_points
    });
    assert!(caught, "no build of suture with {options:?} could be got hold of");
    (dir, copy)
}

/// Builds the binary from these sources, in the profile and the target folder of the tests, and returns where cargo says it is.
/// When nothing has changed, that takes a fraction of a second.
fn build(options: &[&str]) -> PathBuf {
    let (target, profile) = target_and_profile();
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    // What cargo tells this test program of its package would have dependencies compiled anew whose build scripts read it.
    let is_of_package =
        |name: &str| ["CARGO_PKG_", "CARGO_MANIFEST_", "CARGO_PRIMARY_"].iter().any(|told| name.starts_with(told));
    for (name, _) in std::env::vars_os() {
        if name.to_str().is_some_and(is_of_package) {
            command.env_remove(name);
        }
    }
    let output = command
        .args(["build", "--quiet", "--package", "suture", "--bin", "suture", "--message-format", "json-render-diagnostics"])
        .arg("--target-dir")
        .arg(target)
        .arg("--profile")
        .arg(profile)
        .args(options)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
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

/// Where the tests were built, and in which profile: cargo puts them into `TARGET/PROFILE/deps/`, where the profile `dev` is called
/// `debug`.
fn target_and_profile() -> (PathBuf, OsString) {
    let test = std::env::current_exe().expect("a program knows its own place");
    let folder = test.ancestors().nth(2).expect("tests lie in a folder of their profile");
    let profile = folder.file_name().expect("the folder has a name");
    let profile = if profile == "debug" { "dev".into() } else { profile.to_owned() };
    (folder.parent().expect("the folder lies in the target folder").to_owned(), profile)
}
