//! A thread that stands still at a system call, about to make it or just back from it.

use std::ffi::{CStr, OsString};
use std::io;
use std::mem::MaybeUninit;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};

use libc::{pid_t, user_regs_struct as Registers};

use super::calls::{self, Kind};
use super::fault::Role;

/// The thread, and its registers.
pub struct Stop {
    /// The thread's number.
    pub thread: pid_t,
    /// What its process is.
    pub role: Role,
    /// Past the start of a program: its loader's calls are not the program's.
    pub begun: bool,
    /// As they were when it stopped.
    pub registers: Registers,
}

impl Stop {
    /// Reads the registers of a stopped thread; `None` when it was killed meanwhile.
    pub(super) fn of(thread: pid_t, role: Role, begun: bool) -> Option<Self> {
        let mut registers = MaybeUninit::<Registers>::zeroed();
        // SAFETY: room for the registers, which the kernel fills.
        let done = unsafe { libc::ptrace(libc::PTRACE_GETREGS, thread, 0, registers.as_mut_ptr()) };
        // SAFETY: numbers, for which zero is a value, too.
        (done == 0).then(|| Self { thread, role, begun, registers: unsafe { registers.assume_init() } })
    }

    /// The call's number.
    pub fn number(&self) -> i64 {
        self.registers.orig_rax.cast_signed()
    }

    /// Its arguments.
    pub fn arguments(&self) -> [u64; 6] {
        let r = &self.registers;
        [r.rdi, r.rsi, r.rdx, r.r10, r.r8, r.r9]
    }

    /// Its result, when it is back.
    pub fn result(&self) -> i64 {
        self.registers.rax.cast_signed()
    }

    /// The kind of the call.
    pub fn kind(&self) -> Option<&'static Kind> {
        calls::kind_of(self)
    }

    /// Gives the thread other registers.
    pub(super) fn set(&self, registers: &Registers) {
        // SAFETY: whole registers. A thread that was killed meanwhile needs none.
        unsafe { libc::ptrace(libc::PTRACE_SETREGS, self.thread, 0, registers) };
    }

    /// Bytes of its memory.
    ///
    /// # Errors
    /// When they are not all there.
    pub fn memory(&self, at: u64, length: usize) -> io::Result<Vec<u8>> {
        let mut bytes = vec![0; length];
        let read = read_memory(self.thread, at, &mut bytes);
        if read == length { Ok(bytes) } else { Err(io::Error::last_os_error()) }
    }

    /// A text in its memory that ends with a zero.
    pub fn text(&self, at: u64) -> Option<PathBuf> {
        const PAGE: u64 = 4096;
        let mut text = Vec::new();
        while text.len() <= libc::PATH_MAX as usize {
            let from = at + text.len() as u64;
            // Not beyond the page: the next one may not be there.
            let mut part = vec![0; (PAGE - from % PAGE) as usize];
            let read = read_memory(self.thread, from, &mut part);
            part.truncate(read);
            text.extend_from_slice(&part);
            if let Ok(whole) = CStr::from_bytes_until_nul(&text) {
                return Some(PathBuf::from(OsString::from_vec(whole.to_bytes().to_vec())));
            }
            if read == 0 {
                return None;
            }
        }
        None
    }

    /// A name that leads to the file of a descriptor, even if it has none.
    pub fn descriptor(&self, fd: u64) -> PathBuf {
        format!("/proc/{}/fd/{}", self.thread, fd as i32).into()
    }

    /// A path that leads where `path` does in the stopped process.
    pub fn resolved(&self, folder: u64, path: &Path) -> PathBuf {
        if let Ok(own) = path.strip_prefix("/proc/self") {
            return Path::new("/proc").join(self.thread.to_string()).join(own);
        }
        if path.is_absolute() {
            return path.to_owned();
        }
        let folder = match folder as i32 {
            libc::AT_FDCWD => PathBuf::from(format!("/proc/{}/cwd", self.thread)),
            _ => self.descriptor(folder),
        };
        std::fs::read_link(&folder).unwrap_or(folder).join(path)
    }
}

/// The first eight bytes as a number.
pub fn word(bytes: &[u8]) -> u64 {
    bytes.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes))
}

fn read_memory(thread: pid_t, at: u64, bytes: &mut [u8]) -> usize {
    let local = libc::iovec { iov_base: bytes.as_mut_ptr().cast(), iov_len: bytes.len() };
    let remote = libc::iovec { iov_base: at as *mut libc::c_void, iov_len: bytes.len() };
    // SAFETY: the kernel writes at most the length of `bytes` into it, and checks the other side.
    let read = unsafe { libc::process_vm_readv(thread, &raw const local, 1, &raw const remote, 1, 0) };
    usize::try_from(read).unwrap_or(0)
}
