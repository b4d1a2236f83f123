//! The machine and the versions that a figure belongs to.

use std::path::Path;
use std::process::Command;

use serde::{Deserialize, Serialize};

use super::sides::{home, said};

/// Where a comparison ran.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Machine {
    pub(crate) processor: String,
    pub(crate) processors: usize,
    pub(crate) memory_bytes: u64,
    pub(crate) kernel: String,
    /// Type of the file system that holds inputs and outputs.
    pub(crate) file_system: String,
    /// Runnable processes over the last minute, when the comparison began: of an idle machine near 0.
    pub(crate) load: String,
    /// Compiler, commit, rivals.
    pub(crate) versions: Vec<String>,
}

impl Machine {
    pub(super) fn describe(folder: &Path, rivals: Vec<String>) -> Self {
        let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        let field = |text: &str, name: &str| {
            let line = text.lines().find(|line| line.starts_with(name));
            line.and_then(|line| line.split_once(':')).map(|(_, value)| value.trim().to_owned())
        };
        let memory = field(&read("/proc/meminfo"), "MemTotal").unwrap_or_default();
        let kilobytes: u64 = memory.split_whitespace().next().and_then(|number| number.parse().ok()).unwrap_or(0);
        let mut versions: Vec<_> = said(Command::new("rustc").arg("--version")).into_iter().collect();
        let git = |arguments: &[&str]| said(Command::new("git").arg("-C").arg(home()).args(arguments));
        if let Some(commit) = git(&["rev-parse", "--short", "HEAD"]) {
            let changed = git(&["status", "--porcelain", "--untracked-files=no"]).is_some_and(|changes| !changes.is_empty());
            versions.push(format!("suture at commit {commit}{}", if changed { ", changed" } else { "" }));
        }
        versions.extend(rivals);
        Self {
            processor: field(&read("/proc/cpuinfo"), "model name").unwrap_or_else(|| "unknown".into()),
            processors: std::thread::available_parallelism().map_or(1, usize::from),
            memory_bytes: kilobytes * 1024,
            kernel: format!("Linux {}", read("/proc/sys/kernel/osrelease").trim()),
            file_system: file_system(&read("/proc/mounts"), folder),
            load: read("/proc/loadavg").split_whitespace().next().unwrap_or("unknown").into(),
            versions,
        }
    }
}

/// The type of the deepest mount above `folder`.
fn file_system(mounts: &str, folder: &Path) -> String {
    let above = mounts.lines().filter_map(|line| {
        let mut words = line.split(' ').skip(1);
        let (place, kind) = (words.next()?, words.next()?);
        folder.starts_with(place).then_some((place.len(), kind))
    });
    // Of mounts on one place the last is on top, and the last of equal maxima is what max_by_key returns.
    above.max_by_key(|&(depth, _)| depth).map_or("unknown", |(_, kind)| kind).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deepest_mount_wins() {
        let mounts = "a / ext4 rw 0 0\nb /tmp tmpfs rw 0 0\nc /tmpfoo xfs rw 0 0\n";
        assert_eq!(file_system(mounts, Path::new("/tmp/x")), "tmpfs");
        assert_eq!(file_system(mounts, Path::new("/tmpf")), "ext4");
    }
}
