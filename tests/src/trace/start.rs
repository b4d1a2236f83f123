//! Starts a program under the tracer: a fork that waits until it is traced, asks the kernel to stop it at chosen system calls, and
//! becomes the program.

use std::ffi::{CString, OsStr};
use std::fs::{File, OpenOptions};
use std::io;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd};
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::process::Command;

use libc::{c_char, c_int, pid_t, sock_filter};

/// Exit status of a child that could not become the program.
const NOT_STARTED: c_int = 126;

const OPTIONS: c_int = libc::PTRACE_O_TRACESECCOMP
    | libc::PTRACE_O_TRACEFORK
    | libc::PTRACE_O_TRACEVFORK
    | libc::PTRACE_O_TRACECLONE
    | libc::PTRACE_O_TRACEEXEC
    | libc::PTRACE_O_TRACESYSGOOD
    | libc::PTRACE_O_EXITKILL;

/// All a forked child needs, made before the fork: a child of a process with threads may not allocate.
struct Plan {
    program: CString,
    arguments: Vec<*const c_char>,
    environment: Vec<*const c_char>,
    null: OwnedFd,
    errors: File,
    filter: Vec<sock_filter>,
    gate: OwnedFd,
    key: OwnedFd,
}

/// Starts the command (its program, arguments and environment), traced by this thread, standard error in a file. It stops at the
/// system calls of these numbers from its `execve` on, that one included if it is one of them.
///
/// # Errors
/// When the system refuses.
pub(super) fn start(command: &Command, errors: &Path, numbers: &[i64]) -> io::Result<pid_t> {
    let text = |text: &OsStr| CString::new(text.as_bytes()).map_err(io::Error::other);
    let program = text(command.get_program())?;
    let arguments: Vec<CString> = command.get_args().map(text).collect::<io::Result<_>>()?;
    let environment = environment(command)?;
    let [gate, key] = pipe()?;
    let null = OpenOptions::new().read(true).write(true).open("/dev/null")?.into();
    let pointers = |texts: &[CString]| texts.iter().map(|text| text.as_ptr()).chain([std::ptr::null()]).collect::<Vec<_>>();
    let arguments_with_name = [std::slice::from_ref(&program), &arguments].concat();
    let plan = Plan {
        arguments: pointers(&arguments_with_name),
        environment: pointers(&environment),
        program,
        null,
        errors: File::create(errors)?,
        filter: filter(numbers),
        gate,
        key,
    };
    // SAFETY: the child only makes system calls on what was made before, and never returns.
    let pid = unsafe { libc::fork() };
    match pid {
        -1 => Err(io::Error::last_os_error()),
        // SAFETY: this is the child.
        0 => unsafe { become_program(&plan) },
        _ => {
            seize(pid)?;
            // SAFETY: one byte of a constant.
            let told = unsafe { libc::write(plan.key.as_raw_fd(), b"x".as_ptr().cast(), 1) };
            if told == 1 { Ok(pid) } else { Err(io::Error::last_os_error()) }
        }
    }
}

fn seize(pid: pid_t) -> io::Result<()> {
    // SAFETY: no pointers.
    let done = unsafe { libc::ptrace(libc::PTRACE_SEIZE, pid, 0, OPTIONS) };
    if done == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

fn environment(command: &Command) -> io::Result<Vec<CString>> {
    let mut all: std::collections::BTreeMap<_, _> = std::env::vars_os().collect();
    for (name, value) in command.get_envs() {
        match value {
            Some(value) => drop(all.insert(name.to_owned(), value.to_owned())),
            None => drop(all.remove(name)),
        }
    }
    let line = |(name, value): (_, std::ffi::OsString)| {
        let mut line: std::ffi::OsString = name;
        line.push("=");
        line.push(value);
        CString::new(line.as_bytes()).map_err(io::Error::other)
    };
    all.into_iter().map(line).collect()
}

fn pipe() -> io::Result<[OwnedFd; 2]> {
    let mut ends = [0; 2];
    // SAFETY: room for two descriptors, which are ours then.
    unsafe {
        if libc::pipe2(ends.as_mut_ptr(), libc::O_CLOEXEC) != 0 {
            return Err(io::Error::last_os_error());
        }
        Ok(ends.map(|end| OwnedFd::from_raw_fd(end)))
    }
}

/// Stops at these numbers; everything else runs at full speed.
fn filter(numbers: &[i64]) -> Vec<sock_filter> {
    const AUDIT_ARCH_X86_64: u32 = 0xC000_003E;
    let load = |offset: u32| op(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, 0, 0, offset);
    let equal = |value: u32, then: usize, or: u8| op(libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K, then as u8, or, value);
    let answer = |value: u32| op(libc::BPF_RET | libc::BPF_K, 0, 0, value);
    let mut wanted = numbers.to_vec();
    wanted.sort_unstable();
    wanted.dedup();
    assert!(wanted.len() < 250, "a jump reaches 255 lines");
    let mut lines = vec![load(4), equal(AUDIT_ARCH_X86_64, 1, 0), answer(libc::SECCOMP_RET_ALLOW), load(0)];
    for (at, number) in wanted.iter().enumerate() {
        lines.push(equal(*number as u32, wanted.len() - at, 0));
    }
    lines.push(answer(libc::SECCOMP_RET_ALLOW));
    lines.push(answer(libc::SECCOMP_RET_TRACE));
    lines
}

fn op(code: u32, jt: u8, jf: u8, k: u32) -> sock_filter {
    sock_filter { code: code as u16, jt, jf, k }
}

/// # Safety
/// Only in a forked child; makes nothing but system calls.
unsafe fn become_program(plan: &Plan) -> ! {
    // SAFETY: descriptors and pointers of the plan, which lives in this copy of the memory.
    unsafe {
        libc::close(plan.key.as_raw_fd());
        let mut byte = 0_u8;
        let opened = libc::read(plan.gate.as_raw_fd(), (&raw mut byte).cast(), 1) == 1;
        let stream = |from: RawFd, to: RawFd| libc::dup2(from, to) == to;
        let null = plan.null.as_raw_fd();
        let program = libc::sock_fprog { len: plan.filter.len() as u16, filter: plan.filter.as_ptr().cast_mut() };
        // As any program is started, whatever the test's own habits.
        libc::signal(libc::SIGPIPE, libc::SIG_DFL);
        let ready = opened
            && stream(null, 0)
            && stream(null, 1)
            && stream(plan.errors.as_raw_fd(), 2)
            && libc::setpgid(0, 0) == 0
            && libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0
            && libc::syscall(libc::SYS_seccomp, libc::SECCOMP_SET_MODE_FILTER, 0, &raw const program) == 0;
        if ready {
            libc::execve(plan.program.as_ptr(), plan.arguments.as_ptr(), plan.environment.as_ptr());
        }
        libc::_exit(NOT_STARTED)
    }
}
