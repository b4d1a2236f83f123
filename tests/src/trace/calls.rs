//! The system calls a test can make fail, and the errors each of them can give in life.
//!
//! Calls of one purpose are one kind (`open`, `openat` and `openat2` are `open`), so that a test does not depend on which of them a
//! library prefers. Some kinds are told apart by an argument: opening creates or does not, `fcntl` makes a descriptor or takes a lock.

use std::os::unix::fs::FileTypeExt;

use libc::{
    EACCES, EAGAIN, EDQUOT, EINTR, EIO, EMFILE, ENOLCK, ENOMEM, ENOSPC, EOPNOTSUPP, c_int, c_long, user_regs_struct as Registers,
};

use super::stop::{Stop, word};

/// Where a call keeps the number of bytes it is to move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// The third argument.
    Third,
    /// The fourth.
    Fourth,
    /// The fifth.
    Fifth,
}

/// One kind of system call.
#[derive(Debug)]
pub struct Kind {
    /// Its name in a fault's line.
    pub name: &'static str,
    numbers: &'static [c_long],
    /// Errors it can give in life.
    pub errnos: &'static [c_int],
    /// A signal handler can interrupt it.
    pub interruptible: bool,
    /// Its count of bytes, when it may do less than it was asked for.
    pub count: Option<Count>,
}

// A path leads through folders that may be closed to us, must be read from a disk, and be kept in memory.
const PATH: &[c_int] = &[EACCES, EIO, ENOMEM];
// A path to a new name: its folder may have to grow, which needs a block, within the owner's quota.
const NEW_NAME: &[c_int] = &[EACCES, EIO, ENOSPC, EDQUOT];
// A file that is opened takes a descriptor.
const OPEN: &[c_int] = &[EACCES, EIO, EMFILE, ENOMEM];
// A file that is created takes a descriptor and an inode.
const CREATE: &[c_int] = &[EACCES, EIO, EMFILE, ENOSPC, EDQUOT];
// Bytes come from a disk, which may fail.
const READ: &[c_int] = &[EIO];
// Bytes need blocks, within the quota, on a disk, which may fail. With delayed allocation a sync finds out first.
const WRITE: &[c_int] = &[EIO, ENOSPC, EDQUOT];
// A new table, mapping or process needs memory of the system.
const MEMORY: &[c_int] = &[ENOMEM];
// A new descriptor needs a free number and memory of the system.
const DESCRIPTOR: &[c_int] = &[EMFILE, ENOMEM];
// Changing an inode writes to the disk, and may be forbidden.
const INODE: &[c_int] = &[EACCES, EIO];
// Threads and processes are limited in number, and need memory.
const PROCESS: &[c_int] = &[EAGAIN, ENOMEM];
// Locks are limited in number on network file systems.
const LOCK: &[c_int] = &[ENOLCK];
// What the file system does not know.
const UNKNOWN: &[c_int] = &[EOPNOTSUPP];
// `prctl`, `prlimit64` (a lower limit), `kill` and `wait4` of one's own child cannot fail in life, but the last may be interrupted.
const NONE: &[c_int] = &[];

const fn kind(name: &'static str, numbers: &'static [c_long], errnos: &'static [c_int]) -> Kind {
    Kind { name, numbers, errnos, interruptible: false, count: None }
}

const fn slow(name: &'static str, numbers: &'static [c_long], errnos: &'static [c_int]) -> Kind {
    Kind { name, numbers, errnos, interruptible: true, count: None }
}

const fn transfer(name: &'static str, numbers: &'static [c_long], errnos: &'static [c_int], count: Count) -> Kind {
    Kind { name, numbers, errnos, interruptible: true, count: Some(count) }
}

/// Every kind.
pub const KINDS: &[Kind] = &[
    slow("open", &[libc::SYS_open, libc::SYS_openat, libc::SYS_openat2], OPEN),
    slow("create", &[libc::SYS_creat], CREATE),
    transfer("read", &[libc::SYS_read], READ, Count::Third),
    slow("readv", &[libc::SYS_readv, libc::SYS_preadv, libc::SYS_preadv2], READ),
    transfer("pread64", &[libc::SYS_pread64], READ, Count::Third),
    transfer("write", &[libc::SYS_write], WRITE, Count::Third),
    // Its count is one of buffers: one less is a short write, too.
    transfer("writev", &[libc::SYS_writev, libc::SYS_pwritev, libc::SYS_pwritev2], WRITE, Count::Third),
    transfer("pwrite64", &[libc::SYS_pwrite64], WRITE, Count::Third),
    // Pipes and sockets lie on no disk. Their calls may be interrupted, and move less than was asked for.
    transfer("pipe_read", &[], NONE, Count::Third),
    transfer("pipe_write", &[], NONE, Count::Third),
    // Network file systems tell of a failed write when the file is closed.
    kind("close", &[libc::SYS_close], READ),
    slow("fsync", &[libc::SYS_fsync], WRITE),
    slow("fdatasync", &[libc::SYS_fdatasync], WRITE),
    kind("sync_file_range", &[libc::SYS_sync_file_range, libc::SYS_msync], WRITE),
    slow("ftruncate", &[libc::SYS_ftruncate, libc::SYS_truncate], WRITE),
    slow("fallocate", &[libc::SYS_fallocate], &[EIO, ENOSPC, EDQUOT, EOPNOTSUPP]),
    kind("lseek", &[libc::SYS_lseek], READ),
    kind("stat", &[libc::SYS_newfstatat, libc::SYS_statx, libc::SYS_fstat, libc::SYS_stat, libc::SYS_lstat], PATH),
    kind("access", &[libc::SYS_access, libc::SYS_faccessat, libc::SYS_faccessat2], PATH),
    kind("rename", &[libc::SYS_rename, libc::SYS_renameat, libc::SYS_renameat2], NEW_NAME),
    kind("link", &[libc::SYS_link, libc::SYS_linkat, libc::SYS_symlink, libc::SYS_symlinkat], NEW_NAME),
    kind("unlink", &[libc::SYS_unlink, libc::SYS_unlinkat], INODE),
    kind("rmdir", &[libc::SYS_rmdir], INODE),
    kind("mkdir", &[libc::SYS_mkdir, libc::SYS_mkdirat], NEW_NAME),
    kind("getdents64", &[libc::SYS_getdents64, libc::SYS_getdents], READ),
    kind("chmod", &[libc::SYS_chmod, libc::SYS_fchmod, libc::SYS_fchmodat], INODE),
    kind("chown", &[libc::SYS_chown, libc::SYS_fchown, libc::SYS_lchown, libc::SYS_fchownat], INODE),
    kind("utimensat", &[libc::SYS_utimensat], INODE),
    transfer("copy_file_range", &[libc::SYS_copy_file_range], WRITE, Count::Fifth),
    transfer("sendfile", &[libc::SYS_sendfile], WRITE, Count::Fourth),
    kind("ioctl", &[libc::SYS_ioctl], UNKNOWN),
    slow("lock", &[libc::SYS_flock], LOCK),
    kind("dup", &[libc::SYS_dup, libc::SYS_dup2, libc::SYS_dup3], &[EMFILE]),
    slow("statfs", &[libc::SYS_statfs, libc::SYS_fstatfs], PATH),
    kind("readlink", &[libc::SYS_readlink, libc::SYS_readlinkat], PATH),
    kind("getcwd", &[libc::SYS_getcwd], MEMORY),
    kind("mmap", &[libc::SYS_mmap], MEMORY),
    kind("mprotect", &[libc::SYS_mprotect], MEMORY),
    kind("munmap", &[libc::SYS_munmap], MEMORY),
    kind("mremap", &[libc::SYS_mremap], MEMORY),
    kind("madvise", &[libc::SYS_madvise], MEMORY),
    kind("brk", &[libc::SYS_brk], MEMORY),
    kind("clone", &[libc::SYS_clone, libc::SYS_clone3, libc::SYS_fork, libc::SYS_vfork], PROCESS),
    kind("execve", &[libc::SYS_execve, libc::SYS_execveat], &[EACCES, EIO, ENOMEM]),
    kind("pipe", &[libc::SYS_pipe, libc::SYS_pipe2], DESCRIPTOR),
    slow("wait", &[libc::SYS_wait4, libc::SYS_waitid], NONE),
    kind("pidfd", &[libc::SYS_pidfd_open], DESCRIPTOR),
    kind("socket", &[libc::SYS_socket, libc::SYS_socketpair], DESCRIPTOR),
    kind("bind", &[libc::SYS_bind], NEW_NAME),
    kind("listen", &[libc::SYS_listen], MEMORY),
    slow("accept", &[libc::SYS_accept, libc::SYS_accept4], DESCRIPTOR),
    slow("connect", &[libc::SYS_connect], &[EACCES]),
    slow("receive", &[libc::SYS_recvfrom, libc::SYS_recvmsg], MEMORY),
    slow("send", &[libc::SYS_sendto, libc::SYS_sendmsg], MEMORY),
    kind("epoll_create", &[libc::SYS_epoll_create1], DESCRIPTOR),
    kind("epoll_ctl", &[libc::SYS_epoll_ctl], MEMORY),
    slow("epoll_wait", &[libc::SYS_epoll_wait, libc::SYS_epoll_pwait, libc::SYS_epoll_pwait2], NONE),
    slow("poll", &[libc::SYS_poll, libc::SYS_ppoll], MEMORY),
    kind("inotify_init", &[libc::SYS_inotify_init1], DESCRIPTOR),
    // Its own ENOSPC: the user's watches are all in use.
    kind("inotify_add_watch", &[libc::SYS_inotify_add_watch], &[EACCES, ENOMEM, ENOSPC]),
    kind("eventfd", &[libc::SYS_eventfd2], DESCRIPTOR),
];

/// Errors of a whole machine, which hit every call that can give them.
pub const GROUPS: [(&str, c_int); 4] = [("disk", ENOSPC), ("broken", EIO), ("descriptors", EMFILE), ("memory", ENOMEM)];

const ERRNOS: [(&str, c_int); 11] = [
    ("EIO", EIO),
    ("ENOSPC", ENOSPC),
    ("EDQUOT", EDQUOT),
    ("EACCES", EACCES),
    ("EMFILE", EMFILE),
    ("ENOMEM", ENOMEM),
    ("EAGAIN", EAGAIN),
    ("EINTR", EINTR),
    ("ENOLCK", ENOLCK),
    ("EOPNOTSUPP", EOPNOTSUPP),
    ("EPERM", libc::EPERM),
];

/// An error's name.
///
/// # Panics
/// When this table does not know it.
pub fn errno_name(errno: c_int) -> &'static str {
    ERRNOS.iter().find(|(_, number)| *number == errno).expect("a known error").0
}

/// An error by its name.
pub fn errno_named(name: &str) -> Option<c_int> {
    ERRNOS.iter().find(|(known, _)| *known == name).map(|(_, number)| *number)
}

/// The kind of that name.
pub fn named(name: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|kind| kind.name == name)
}

/// Numbers of all system calls that may be of this kind.
pub fn numbers(kind: &Kind) -> Vec<c_long> {
    let mut numbers = kind.numbers.to_vec();
    match kind.name {
        "create" => numbers.extend([libc::SYS_open, libc::SYS_openat, libc::SYS_openat2]),
        "lock" | "dup" => numbers.push(libc::SYS_fcntl),
        "pipe_read" => numbers.push(libc::SYS_read),
        "pipe_write" => numbers.push(libc::SYS_write),
        _ => {}
    }
    numbers
}

/// The kind of the call that is about to be made.
pub(super) fn kind_of(stop: &Stop) -> Option<&'static Kind> {
    let (number, [first, second, third, ..]) = (stop.number(), stop.arguments());
    let open = match number {
        libc::SYS_open => Some(second),
        libc::SYS_openat => Some(third),
        libc::SYS_openat2 => Some(stop.memory(third, 8).map_or(0, |bytes| word(&bytes))),
        _ => None,
    };
    if let Some(flags) = open {
        let creates = flags & (libc::O_CREAT as u64) != 0 || flags & (libc::O_TMPFILE as u64) == libc::O_TMPFILE as u64;
        return named(if creates { "create" } else { "open" });
    }
    match number {
        libc::SYS_fcntl => match second as c_int {
            libc::F_DUPFD | libc::F_DUPFD_CLOEXEC => named("dup"),
            libc::F_SETLK | libc::F_SETLKW | libc::F_OFD_SETLK | libc::F_OFD_SETLKW => named("lock"),
            // Reading and setting flags cannot fail in life.
            _ => None,
        },
        libc::SYS_read | libc::SYS_write | libc::SYS_close => {
            let found = std::fs::metadata(stop.descriptor(first)).ok()?.file_type();
            match number {
                libc::SYS_read if found.is_file() => named("read"),
                libc::SYS_write if found.is_file() => named("write"),
                libc::SYS_close if found.is_file() => named("close"),
                libc::SYS_read if found.is_fifo() || found.is_socket() => named("pipe_read"),
                libc::SYS_write if found.is_fifo() || found.is_socket() => named("pipe_write"),
                // The kernel's own objects (events, watches) and folders that are closed do not fail.
                _ => None,
            }
        }
        _ => KINDS.iter().find(|kind| kind.numbers.contains(&number)),
    }
}

impl Kind {
    /// Can it fail with this error?
    pub fn can_fail_with(&self, errno: c_int) -> bool {
        self.errnos.contains(&errno) || (errno == EINTR && self.interruptible)
    }
}

impl Count {
    /// The count among the call's arguments.
    pub fn of(self, registers: &mut Registers) -> &mut u64 {
        match self {
            Self::Third => &mut registers.rdx,
            Self::Fourth => &mut registers.r10,
            Self::Fifth => &mut registers.r8,
        }
    }
}
