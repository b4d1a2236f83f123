//! The machine and the versions that a figure belongs to.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::cache;
use super::child;
use super::folders::home;
use super::programs::said;
use super::way::Cache;

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
    /// Bytes a second that a new file is written at, synced, and read at, once dropped from the page cache.
    #[serde(default)]
    pub(crate) disk: Option<DiskRate>,
    /// Compiler, commit, peers.
    pub(crate) versions: Vec<String>,
}

/// How fast the disk is under the files, in bytes a second.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct DiskRate {
    pub(crate) write: f64,
    pub(crate) read: f64,
}

impl Machine {
    pub(super) fn describe(folder: &Path, peers: Vec<String>) -> Self {
        let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        let field = |text: &str, name: &str| {
            let line = text.lines().find(|line| line.starts_with(name));
            line.and_then(|line| line.split_once(':')).map(|(_, value)| value.trim().to_owned())
        };
        let mut versions: Vec<_> = said(Command::new("rustc").arg("--version")).into_iter().collect();
        let git = |arguments: &[&str]| said(Command::new("git").arg("-C").arg(home()).args(arguments));
        if let Some(commit) = git(&["rev-parse", "--short", "HEAD"]) {
            let changed = git(&["status", "--porcelain", "--untracked-files=no"]).is_some_and(|changes| !changes.is_empty());
            versions.push(format!("suture at commit {commit}{}", if changed { ", changed" } else { "" }));
        }
        versions.extend(peers);
        Self {
            processor: field(&read("/proc/cpuinfo"), "model name").unwrap_or_else(|| "unknown".into()),
            processors: std::thread::available_parallelism().map_or(1, usize::from),
            memory_bytes: child::bytes_of(&read("/proc/meminfo"), "MemTotal:"),
            kernel: format!("Linux {}", read("/proc/sys/kernel/osrelease").trim()),
            file_system: file_system(&read("/proc/mounts"), folder),
            load: read("/proc/loadavg").split_whitespace().next().unwrap_or("unknown").into(),
            disk: disk_rate(folder).ok(),
            versions,
        }
    }
}

/// Writes and reads 512 MB that no file system can squeeze.
fn disk_rate(folder: &Path) -> io::Result<DiskRate> {
    const BLOCK: usize = 1 << 20;
    const BLOCKS: usize = 512;
    let path = folder.join("disk");
    let rate = |begin: Instant| (BLOCK * BLOCKS) as f64 / begin.elapsed().as_secs_f64();
    let mut state = 1u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8
    };
    let mut block: Vec<u8> = (0..BLOCK).map(|_| noise()).collect();
    let begin = Instant::now();
    let mut file = File::create(&path)?;
    for number in 0..BLOCKS {
        block[number] ^= 0x55;
        file.write_all(&block)?;
    }
    file.sync_all()?;
    let write = rate(begin);
    cache::bring(Cache::Cold, [path.as_path()].into_iter())?;
    let begin = Instant::now();
    io::copy(&mut File::open(&path)?, &mut io::sink())?;
    let read = rate(begin);
    std::fs::remove_file(&path)?;
    Ok(DiskRate { write, read })
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
