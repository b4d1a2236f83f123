//! A memory cgroup around a process: what it holds, dirty pages of its output included, stays below a limit or it is killed.
//!
//! Needs the right to make groups at the root of the memory controller, of cgroup v2 or v1: usually root's.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Root of the memory controller of cgroup v1; where it is absent, that of v2.
const ROOTS: [&str; 2] = ["/sys/fs/cgroup/memory", "/sys/fs/cgroup"];

/// A group of its own, removed when dropped.
pub(super) struct Group {
    folder: PathBuf,
}

impl Group {
    /// Makes a group that may hold `bytes` and, where the kernel can bound that, swaps nothing.
    pub(super) fn make(bytes: u64) -> io::Result<Self> {
        let [old, new] = ROOTS.map(Path::new);
        let is_old = old.join("memory.limit_in_bytes").exists();
        if !is_old {
            // Fails where the controller is on already, which is usual; then what follows succeeds.
            let _ = fs::write(new.join("cgroup.subtree_control"), "+memory");
        }
        let folder = if is_old { old } else { new }.join(format!("suture-bench-{}", std::process::id()));
        fs::create_dir(&folder)?;
        let group = Self { folder };
        let (limit, swap, most_swap) = match is_old {
            true => ("memory.limit_in_bytes", "memory.memsw.limit_in_bytes", bytes),
            false => ("memory.max", "memory.swap.max", 0),
        };
        fs::write(group.folder.join(limit), bytes.to_string())?;
        // Absent where the kernel does not count swap.
        let _ = fs::write(group.folder.join(swap), most_swap.to_string());
        Ok(group)
    }

    /// `command`, started inside the group.
    pub(super) fn hold(&self, command: &Command) -> Command {
        let mut held = Command::new("sh");
        held.args(["-c", "echo $$ > \"$0\" && exec \"$@\""]).arg(self.folder.join("cgroup.procs"));
        held.arg(command.get_program()).args(command.get_args());
        held
    }

    /// The most that was held, file pages that could be dropped included; some kernels do not say.
    pub(super) fn peak_bytes(&self) -> Option<u64> {
        let read = |name| fs::read_to_string(self.folder.join(name)).ok();
        read("memory.peak").or_else(|| read("memory.max_usage_in_bytes"))?.trim().parse().ok()
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        // Fails while a process is in it; nothing is left behind then but an empty group.
        let _ = fs::remove_dir(&self.folder);
    }
}
