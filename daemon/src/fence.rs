//! The fence around a worker: the system (Landlock, from Linux 5.13 on) lets it reach the folders of its work and nothing else: no other customer's file, no
//! program, no job store, no address of the net. So what a hostile file can make of a worker ends with its own work.
//!
//! <https://docs.kernel.org/userspace-api/landlock.html>. A fence stands where a folder *is*, not where its name leads: a folder that was made anew
//! lies outside, and needs another worker.

use std::ffi::OsString;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use landlock::{ABI, Access, AccessFs, AccessNet, BitFlags, PathBeneath, PathFd, Ruleset, RulesetAttr, RulesetCreated};
use landlock::{RulesetCreatedAttr, RulesetError, RulesetStatus, Scope};

/// The newest rules that are asked for; an older system keeps to those it knows.
const RULES: ABI = ABI::V6;
/// A worker reads here how much memory it has, and how many processors.
const SYSTEM: [&str; 2] = ["/proc/self", "/sys/fs/cgroup"];

/// Folders that a worker may read and write. Empty: no fence at all.
#[derive(Clone, Debug, Default)]
pub(crate) struct Fence(Vec<Within>);

#[derive(Clone, Debug, PartialEq, Eq)]
struct Within {
    path: PathBuf,
    /// Device and inode.
    id: (u64, u64),
}

impl Fence {
    /// Has it enclose this folder, as it is now. Returns whether it did not before, so that a worker within it must be replaced.
    ///
    /// # Errors
    /// When the folder is out of reach.
    pub(crate) fn take_in(&mut self, folder: &Path) -> io::Result<bool> {
        let found = std::fs::metadata(folder)?;
        let here = Within { path: folder.to_owned(), id: (found.dev(), found.ino()) };
        if self.0.contains(&here) {
            return Ok(false);
        }
        self.0.retain(|within| within.path != here.path);
        self.0.push(here);
        Ok(true)
    }

    /// Has it enclose no folder any more that is `away`: a worker that begins there may wait for ever.
    pub(crate) fn leave_out(&mut self, is_away: impl Fn(&Path) -> bool) {
        self.0.retain(|within| !is_away(&within.path));
    }

    /// The fence in a worker's command line.
    pub(crate) fn arguments(&self) -> impl Iterator<Item = OsString> {
        self.0.iter().flat_map(|within| ["--within".into(), within.path.clone().into_os_string()])
    }
}

/// Keeps this thread, and all that it starts, within these folders; `reads` are files beyond them that it may read. Without a folder there is no fence.
/// Returns how much of it the system enforces.
///
/// # Errors
/// When the system refuses, though it knows of fences.
pub(crate) fn keep_within(folders: &[PathBuf], reads: &[PathBuf]) -> Result<RulesetStatus, RulesetError> {
    if folders.is_empty() {
        return Ok(RulesetStatus::NotEnforced);
    }
    let all = AccessFs::from_all(RULES);
    let rules = Ruleset::default().handle_access(all)?.handle_access(AccessNet::from_all(RULES))?;
    let mut rules = rules.scope(Scope::from_all(RULES))?.create()?;
    for folder in folders {
        rules = allow(rules, folder, all & !AccessFs::Execute)?;
    }
    for file in reads {
        rules = allow(rules, file, AccessFs::ReadFile.into())?;
    }
    let [process, groups] = SYSTEM.map(Path::new);
    rules = allow(rules, process, AccessFs::ReadFile | AccessFs::WriteFile)?;
    rules = allow(rules, groups, AccessFs::ReadFile.into())?;
    Ok(rules.restrict_self()?.ruleset)
}

/// A path that is not there, or out of reach, stays so.
fn allow(rules: RulesetCreated, path: &Path, access: BitFlags<AccessFs>) -> Result<RulesetCreated, RulesetError> {
    match PathFd::new(path) {
        Ok(there) => rules.add_rule(PathBeneath::new(there, access)),
        Err(error) => {
            tracing::debug!(%error, path = %path.display(), "A folder is not within a worker's fence.");
            Ok(rules)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::ErrorKind::{CrossesDevices, PermissionDenied};
    use std::net::{TcpListener, TcpStream};

    use super::*;

    #[test]
    fn a_folder_that_was_made_anew_is_another_one() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| dir.path().join(name));
        for folder in [&a, &b] {
            std::fs::create_dir(folder).unwrap();
        }
        let mut fence = Fence::default();
        assert!(fence.take_in(&a).unwrap() && fence.take_in(&b).unwrap());
        assert!(!fence.take_in(&a).unwrap() && !fence.take_in(&b).unwrap());
        // So that its number is not given again.
        std::fs::rename(&a, dir.path().join("old")).unwrap();
        assert!(fence.take_in(&a).is_err());
        std::fs::create_dir(&a).unwrap();
        assert!(fence.take_in(&a).unwrap() && !fence.take_in(&a).unwrap());
        let arguments: Vec<_> = fence.arguments().collect();
        assert_eq!(arguments, [OsString::from("--within"), b.into(), "--within".into(), a.into()]);
    }

    /// A fence is one thread's, so that this test can put it up.
    #[test]
    fn nothing_is_reached_beyond_the_fence() {
        let dir = tempfile::tempdir().unwrap();
        let [work, other] = ["work", "other"].map(|name| dir.path().join(name));
        for folder in [&work, &other] {
            std::fs::create_dir(folder).unwrap();
            std::fs::write(folder.join("a.stl"), "solid").unwrap();
        }
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let fenced = std::thread::spawn(move || {
            let [mine, its] = [&work, &other].map(|folder| folder.join("a.stl"));
            let status = keep_within(std::slice::from_ref(&work), &[]).unwrap();
            if status == RulesetStatus::NotEnforced {
                println!("This system has no fences.");
                return;
            }
            assert_eq!(std::fs::read(&mine).unwrap(), b"solid");
            std::fs::write(work.join("b.stl"), "solid").unwrap();
            std::fs::rename(work.join("b.stl"), work.join("c.stl")).unwrap();
            crate::create::tell_kernel("clear_refs", "5").unwrap();
            std::fs::read("/proc/self/statm").unwrap();
            let denied = [
                std::fs::read(&its).map(drop),
                std::fs::write(&its, "").map(drop),
                std::fs::write(other.join("b.stl"), ""),
                std::fs::remove_file(&its),
                std::fs::rename(&mine, other.join("c.stl")),
                std::fs::read_dir(&other).map(drop),
                std::process::Command::new("/bin/true").status().map(drop),
            ];
            for (i, tried) in denied.into_iter().enumerate() {
                let kind = tried.map_err(|error| error.kind());
                assert!(matches!(kind, Err(PermissionDenied | CrossesDevices)), "{i}: {kind:?}");
            }
            // From Linux 6.7 on.
            if status == RulesetStatus::FullyEnforced {
                assert_eq!(TcpStream::connect(address).unwrap_err().kind(), PermissionDenied);
            }
        });
        fenced.join().unwrap();
    }
}
