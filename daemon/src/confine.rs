//! What a worker may not do, whatever a file makes of it: outlive its supervisor, take more memory than it was given, write a file without end, open
//! files without end, leave a core dump, or send signals to other processes. So no file can kill the daemon, and a death of the daemon while a file was worked on is not the file's
//! doing. And where the system runs out of memory, a worker goes first.

use std::io;
use std::path::PathBuf;

use landlock::RulesetStatus;
use rustix::process::{Resource, Rlimit, Signal, getppid, getrlimit, set_parent_process_death_signal, setrlimit};
use rustix::thread::set_no_new_privs;

use crate::cli::WorkerArgs;
use crate::{create, fence};

/// Added to the system's own count of who should go first (from −1000 to 1000).
const OUT_OF_MEMORY_SCORE: &str = "500";

/// Files that a worker may have open. It was never seen to have more than eleven.
const OPEN_FILES: u64 = 256;

/// Binds this process to its supervisor, to its memory, and to few open files.
///
/// # Errors
/// When the supervisor is gone already, or the system refuses.
pub(crate) fn bind(args: &WorkerArgs) -> io::Result<()> {
    set_parent_process_death_signal(Some(Signal::TERM))?;
    // If it died before the line above took effect, someone else is the parent by now.
    if getppid().map(|pid| pid.as_raw_nonzero().get().cast_unsigned()) != Some(args.parent) {
        return Err(io::Error::new(io::ErrorKind::BrokenPipe, "the supervisor is gone"));
    }
    let limit = |bytes| Rlimit { current: Some(bytes), maximum: Some(bytes) };
    setrlimit(Resource::Core, limit(0))?;
    setrlimit(Resource::Data, limit(args.data))?;
    setrlimit(Resource::Nofile, lowered(getrlimit(Resource::Nofile), OPEN_FILES))?;
    // A write beyond the limit fails, and says so, instead of ending the process.
    // SAFETY: no handler is installed; the disposition of a signal that nothing else here uses is set.
    unsafe { libc::signal(libc::SIGXFSZ, libc::SIG_IGN) };
    Ok(())
}

/// These limits, or less.
fn lowered(now: Rlimit, most: u64) -> Rlimit {
    let lower = |limit: Option<u64>| Some(limit.map_or(most, |limit| limit.min(most)));
    Rlimit { current: lower(now.current), maximum: lower(now.maximum) }
}

/// Bytes that any file may have that is written for an input of so many bytes within so much memory. A triangle of the input takes at most 50 bytes in a
/// file, and a few times that where large ones are sorted by place (twice, measured); in the input it takes 50, or not much less as text. Whatever is
/// added or listed was held in memory, and takes at most four times its room there.
pub(crate) fn file_bound(input: u64, memory: u64) -> u64 {
    input.saturating_mul(8).saturating_add(memory.saturating_mul(4)).saturating_add(64 << 20)
}

/// The limit of the size of files that this process writes.
pub(crate) struct Files {
    /// Someone else set this for all of us.
    outside: Option<u64>,
    /// This is in force, as far as we know.
    set: Option<u64>,
}

impl Files {
    /// As it was inherited.
    pub(crate) fn inherited() -> Self {
        let now = getrlimit(Resource::Fsize).current;
        Self { outside: now, set: now }
    }

    /// Lets no file grow beyond so many bytes from now on; how many it is, since someone else may allow less. A system that refuses leaves it as it is.
    pub(crate) fn bound(&mut self, bytes: u64) -> u64 {
        let now = getrlimit(Resource::Fsize);
        if now.current != self.set {
            // Changed from outside while we live (`prlimit`).
            self.outside = now.current;
        }
        let most = self.outside.map_or(bytes, |outside| outside.min(bytes));
        match setrlimit(Resource::Fsize, Rlimit { current: Some(most), maximum: now.maximum }) {
            Ok(()) => self.set = Some(most),
            Err(error) => tracing::debug!(%error, "The size of a worker's files is not bounded."),
        }
        most
    }
}

/// Confines this process, before it has other threads. A system that refuses (an old kernel, a sandbox) leaves it as it is.
/// `reads`: files that it is to read beyond its fence.
pub(crate) fn confine(args: &WorkerArgs, reads: &[PathBuf]) {
    if let Err(error) = create::tell_kernel("oom_score_adj", OUT_OF_MEMORY_SCORE) {
        tracing::debug!(%error, "The system will not let a worker go first when memory is short.");
    }
    match fence::keep_within(&args.within, reads) {
        Ok(RulesetStatus::FullyEnforced) => {}
        Ok(status) => tracing::debug!(?status, "The system does not keep a worker within all of its fence."),
        Err(error) => tracing::debug!(%error, "A worker has no fence."),
    }
    let confined = set_no_new_privs(true).map_err(io::Error::from).and_then(|()| forbid_signals());
    if let Err(error) = confined {
        tracing::debug!(%error, "A worker is not kept from sending signals.");
    }
}

/// Loads a filter that lets signals go to this process only.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
fn forbid_signals() -> io::Result<()> {
    let program = program(std::process::id());
    let length = u16::try_from(program.len()).unwrap_or(0);
    let filter = libc::sock_fprog { len: length, filter: program.as_ptr().cast_mut() };
    // SAFETY: the kernel copies `length` instructions of `program`, which lives until the call returns, and checks them.
    let result = unsafe { libc::prctl(libc::PR_SET_SECCOMP, libc::SECCOMP_MODE_FILTER, &raw const filter) };
    if result == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
fn forbid_signals() -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// The filter (`seccomp(2)`): calls whose first argument is a process go through if that is `pid`; the other ways to send a signal fail
/// with EPERM; all else goes through.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
fn program(pid: u32) -> Vec<libc::sock_filter> {
    use libc::{BPF_ABS, BPF_JEQ, BPF_JMP, BPF_K, BPF_LD, BPF_RET, BPF_W};
    // `AUDIT_ARCH_X86_64` and `AUDIT_ARCH_AARCH64` of `linux/audit.h`.
    const ARCH: u32 = if cfg!(target_arch = "x86_64") { 0xC000_003E } else { 0xC000_00B7 };
    /// Places in `struct seccomp_data`: number of the call, architecture, low half of the first argument.
    const NUMBER: u32 = 0;
    const ARCHITECTURE: u32 = 4;
    const FIRST: u32 = 16;
    let to_a_process = [libc::SYS_kill, libc::SYS_tgkill, libc::SYS_rt_sigqueueinfo, libc::SYS_rt_tgsigqueueinfo];
    let others = [libc::SYS_tkill, libc::SYS_pidfd_send_signal];
    let instruction = |code: u32, k: u32, jt: usize, jf: usize| libc::sock_filter {
        // Codes and distances are small.
        code: code as u16,
        jt: jt as u8,
        jf: jf as u8,
        k,
    };
    let load = |place| instruction(BPF_LD | BPF_W | BPF_ABS, place, 0, 0);
    let give = |what| instruction(BPF_RET | BPF_K, what, 0, 0);
    let equal = |k, jt, jf| instruction(BPF_JMP | BPF_JEQ | BPF_K, k, jt, jf);
    let (calls, all) = (to_a_process.len(), to_a_process.len() + others.len());
    let mut program = vec![load(ARCHITECTURE), equal(ARCH, 0, all + 1), load(NUMBER)];
    for (i, call) in to_a_process.into_iter().chain(others).enumerate() {
        // Behind the comparisons: allow, look at the process, refuse.
        let left = all - i - 1;
        let distance = if i < calls { left + 1 } else { left + 3 };
        program.push(equal(call as u32, distance, 0));
    }
    program.extend([
        give(libc::SECCOMP_RET_ALLOW),
        load(FIRST),
        equal(pid, 1, 0),
        give(libc::SECCOMP_RET_ERRNO | libc::EPERM as u32),
        give(libc::SECCOMP_RET_ALLOW),
    ]);
    program
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_only_ever_lowered() {
        let limits = |current, maximum| Rlimit { current, maximum };
        let pair = |limits: Rlimit| (limits.current, limits.maximum);
        assert_eq!(pair(lowered(limits(None, None), 256)), (Some(256), Some(256)));
        assert_eq!(pair(lowered(limits(Some(1024), None), 256)), (Some(256), Some(256)));
        assert_eq!(pair(lowered(limits(Some(64), Some(128)), 256)), (Some(64), Some(128)));
    }

    #[test]
    fn files_may_be_as_large_as_the_work_can_make_them() {
        assert!(file_bound(0, 0) > 1 << 20, "a report of nothing");
        let (input, memory) = (10 << 30, 1 << 30);
        assert!(file_bound(input, memory) >= 8 * input + 4 * memory);
        assert_eq!(file_bound(u64::MAX, 1), u64::MAX);
    }
}
