//! What the machine has to offer, read from the system. Linux; where the system does not say, nothing is taken to be scarce.
//!
//! Only the way to a result may depend on it, never the result.

use std::path::Path;

/// Bytes of mapped files that can stay in memory beside a full budget, going by what the machine and the memory cgroups around this
/// process leave.
pub(crate) fn page_cache_room(memory_bytes: u64) -> u64 {
    let cgroups = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let groups = cgroup_room(&cgroups, Path::new("/sys/fs/cgroup"));
    let free = memory_available().unwrap_or(u64::MAX).min(groups.unwrap_or(u64::MAX));
    free.saturating_sub(memory_bytes)
}

/// Memory that could be had without swapping.
fn memory_available() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    Some(number_after(&text, "MemAvailable:")? * 1024)
}

/// The number after a word at the beginning of a line.
fn number_after(text: &str, word: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(word)?.strip_prefix(char::is_whitespace))?;
    rest.split_whitespace().next()?.parse().ok()
}

/// The least that any memory cgroup around this process leaves: its limit less what it holds and cannot drop. `None` without a limit.
/// `listing` is what the system says of the groups a process is in; `mounts` is where they are mounted.
fn cgroup_room(listing: &str, mounts: &Path) -> Option<u64> {
    let groups = listing.lines().filter_map(|line| {
        let mut parts = line.splitn(3, ':').skip(1);
        let (controllers, path) = (parts.next()?, parts.next()?);
        match controllers {
            "" => Some((mounts.to_owned(), path, ["memory.max", "memory.current"])),
            c if c.split(',').any(|c| c == "memory") => {
                Some((mounts.join("memory"), path, ["memory.limit_in_bytes", "memory.usage_in_bytes"]))
            }
            _ => None,
        }
    });
    let rooms = groups.flat_map(|(mount, path, [limit, usage])| {
        // In a container the path may be that of the host, and only the root of the mount is there.
        let ancestors = Path::new(path.trim_start_matches('/')).ancestors();
        let room = |dir: &Path| {
            let read = |name| std::fs::read_to_string(dir.join(name)).ok();
            // "max" is no number.
            let limit: u64 = read(limit)?.trim().parse().ok()?;
            let usage: u64 = read(usage)?.trim().parse().ok()?;
            let stat = read("memory.stat")?;
            let cached: u64 = ["inactive_file", "active_file"].iter().filter_map(|word| number_after(&stat, word)).sum();
            Some(limit.saturating_sub(usage.saturating_sub(cached)))
        };
        ancestors.filter_map(|a| room(&mount.join(a))).collect::<Vec<_>>()
    });
    rooms.min()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Makes a group of these files.
    fn group(dir: &Path, files: [(&str, &str); 3]) {
        std::fs::create_dir_all(dir).unwrap();
        files.iter().for_each(|(name, text)| std::fs::write(dir.join(name), text).unwrap());
    }

    #[test]
    fn the_narrowest_group_counts_and_its_page_cache_does_not() {
        let mounts = tempfile::tempdir().unwrap();
        let root = mounts.path();
        let stat = "anon 50\nfile 40\ninactive_file 30\nactive_file 10\nactive_file_more 1000\n";
        group(&root.join("outer"), [("memory.max", "1000\n"), ("memory.current", "100\n"), ("memory.stat", stat)]);
        group(&root.join("outer/inner"), [("memory.max", "max\n"), ("memory.current", "100\n"), ("memory.stat", stat)]);
        assert_eq!(cgroup_room("0::/outer/inner\n", root), Some(940), "of 1000, all but 100 - 40 can be had");
        let v1 = [("memory.limit_in_bytes", "500\n"), ("memory.usage_in_bytes", "300\n"), ("memory.stat", "cache 0\n")];
        group(&root.join("memory"), v1);
        let listing = "5:cpu,cpuacct:/x\n4:memory:/not/in/this/container\n0::/outer\n";
        assert_eq!(cgroup_room(listing, root), Some(200), "both kinds at once, the first known by its root only");
        assert_eq!(cgroup_room("0::/elsewhere\n", root), None);
    }

    #[test]
    fn this_machine_says_what_it_has() {
        assert!(memory_available().is_some_and(|bytes| bytes > 1 << 20));
    }
}
