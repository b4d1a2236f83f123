//! The tracer's loop: waits for stops of any thread, and shows system calls to someone who looks at them.

use std::collections::HashMap;
use std::io;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, ExitStatus};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use libc::{c_int, pid_t};

use super::fault::Role;
use super::start::start;
use super::stop::Stop;

/// Processes that outlive the first one get so long to notice.
const PATIENCE: Duration = Duration::from_secs(5);

/// What a stopped thread does next.
pub enum Next {
    /// The call, unseen.
    Go,
    /// The call, and then another look at it.
    Return,
    /// No call: this error is its result.
    Fail(i32),
    /// The call with other registers, and then another look at it.
    Change(Box<libc::user_regs_struct>),
}

/// Someone who looks at system calls.
pub trait Eyes {
    /// Numbers of the calls to look at.
    fn numbers(&self) -> Vec<i64>;
    /// A call about to be made.
    fn before(&mut self, stop: &Stop) -> Next;
    /// A call that was made, for which [`Next::Return`] or [`Next::Change`] was answered. Registers to be set, if any.
    fn after(&mut self, _stop: &Stop) -> Option<libc::user_regs_struct> {
        None
    }
}

/// How a traced run ended.
#[derive(Debug)]
pub struct Ended {
    /// Of the first process.
    pub status: ExitStatus,
    /// It did not end in time, and was killed: what its threads waited for.
    pub stuck: Option<String>,
    /// Processes that outlived the first one by more than a few seconds, and were killed.
    pub left: usize,
    /// What it wrote to its standard error.
    pub errors: String,
}

struct Thread {
    role: Role,
    /// The program's own part has begun: the standard library's first act is a `poll` of the standard streams.
    begun: bool,
    /// Between a call and its result.
    in_call: bool,
}

struct Tracer<'a> {
    first: pid_t,
    threads: HashMap<pid_t, Thread>,
    /// Stopped before their maker told of them.
    early: Vec<pid_t>,
    eyes: &'a mut dyn Eyes,
    status: Option<ExitStatus>,
}

/// Runs the command to its end under these eyes; kills it after `limit`.
///
/// # Errors
/// When the system refuses to trace.
pub fn run(command: &Command, errors: &Path, limit: Duration, eyes: &mut dyn Eyes) -> io::Result<Ended> {
    let mut numbers = eyes.numbers();
    numbers.push(libc::SYS_poll);
    let first = start(command, errors, &numbers)?;
    let main = Thread { role: Role::Daemon, begun: false, in_call: false };
    let mut tracer = Tracer { first, threads: HashMap::from([(first, main)]), early: Vec::new(), eyes, status: None };
    let watchdog = Watchdog::start(first, limit);
    while tracer.status.is_none() {
        let (thread, status) = wait(true)?.ok_or_else(|| io::Error::other("no process to wait for"))?;
        tracer.stopped(thread, status);
    }
    let stuck = watchdog.end();
    let left = tracer.bury()?;
    let errors = String::from_utf8_lossy(&std::fs::read(errors)?).into_owned();
    Ok(Ended { status: tracer.status.unwrap_or_default(), stuck, left, errors })
}

/// The next stop or end of a process traced by this thread; `None` when there is none (yet).
fn wait(block: bool) -> io::Result<Option<(pid_t, c_int)>> {
    let mut status = 0;
    let flags = libc::__WALL | libc::__WNOTHREAD | if block { 0 } else { libc::WNOHANG };
    loop {
        // SAFETY: room for the status.
        match unsafe { libc::waitpid(-1, &raw mut status, flags) } {
            0 => return Ok(None),
            -1 => match io::Error::last_os_error() {
                error if error.raw_os_error() == Some(libc::EINTR) => {}
                error if error.raw_os_error() == Some(libc::ECHILD) => return Ok(None),
                error => return Err(error),
            },
            pid => return Ok(Some((pid, status))),
        }
    }
}

impl Tracer<'_> {
    fn stopped(&mut self, thread: pid_t, status: c_int) {
        if libc::WIFEXITED(status) || libc::WIFSIGNALED(status) {
            self.threads.remove(&thread);
            if thread == self.first {
                self.status = Some(ExitStatus::from_raw(status));
            }
            return;
        }
        let signal = libc::WSTOPSIG(status);
        match status >> 16 {
            libc::PTRACE_EVENT_SECCOMP => self.before(thread),
            libc::PTRACE_EVENT_FORK | libc::PTRACE_EVENT_VFORK | libc::PTRACE_EVENT_CLONE => self.made(thread),
            libc::PTRACE_EVENT_EXEC => {
                // Another thread than the first may have asked; it has the first one's number from now on, and nobody tells of its end.
                let former = event_message(thread);
                if former != thread {
                    self.threads.remove(&former);
                }
                if let Some(state) = self.threads.get_mut(&thread) {
                    if thread != self.first {
                        state.role = Role::Worker;
                    }
                    state.begun = false;
                    state.in_call = false;
                }
                go(thread, 0);
            }
            libc::PTRACE_EVENT_STOP if self.threads.contains_key(&thread) => go(thread, 0),
            libc::PTRACE_EVENT_STOP => self.early.push(thread),
            _ if signal == libc::SIGTRAP | 0x80 => self.after(thread),
            _ => go(thread, signal),
        }
    }

    /// A thread made another one: a thread, or a process.
    fn made(&mut self, maker: pid_t) {
        let made = event_message(maker);
        if let Some(state) = self.threads.get(&maker) {
            let new = Thread { role: state.role, begun: state.begun, in_call: false };
            self.threads.insert(made, new);
        }
        if let Some(at) = self.early.iter().position(|early| *early == made) {
            self.early.swap_remove(at);
            go(made, 0);
        }
        // On its way out of the call that made it, if someone waits for that.
        if self.threads.get(&maker).is_some_and(|state| state.in_call) { go_to_return(maker) } else { go(maker, 0) }
    }

    fn before(&mut self, thread: pid_t) {
        let Some(state) = self.threads.get_mut(&thread) else { return go(thread, 0) };
        let Some(stop) = Stop::of(thread, state.role, state.begun) else { return };
        if !state.begun {
            state.begun = stop.number() == libc::SYS_poll;
            return go(thread, 0);
        }
        match self.eyes.before(&stop) {
            Next::Go => return go(thread, 0),
            Next::Return => {}
            Next::Fail(errno) => {
                let mut registers = stop.registers;
                registers.orig_rax = u64::MAX;
                registers.rax = i64::from(-errno).cast_unsigned();
                stop.set(&registers);
                return go(thread, 0);
            }
            Next::Change(registers) => stop.set(&registers),
        }
        state.in_call = true;
        go_to_return(thread);
    }

    fn after(&mut self, thread: pid_t) {
        if let Some(state) = self.threads.get_mut(&thread) {
            state.in_call = false;
            if let Some(stop) = Stop::of(thread, state.role, state.begun)
                && let Some(registers) = self.eyes.after(&stop)
            {
                stop.set(&registers);
            }
        }
        go(thread, 0);
    }

    /// Waits for the others after the first one's end; kills them in the end. How many had to be killed.
    fn bury(&mut self) -> io::Result<usize> {
        let deadline = Instant::now() + PATIENCE;
        let mut left = 0;
        while !self.threads.is_empty() {
            match wait(left > 0)? {
                Some((thread, status)) => self.stopped(thread, status),
                None if left > 0 => break,
                None if Instant::now() < deadline => std::thread::sleep(Duration::from_micros(300)),
                None => {
                    left = self.threads.len();
                    for thread in self.threads.keys() {
                        // SAFETY: no pointers; a traced thread, whose number is its own until it is waited for.
                        unsafe { libc::kill(*thread, libc::SIGKILL) };
                    }
                }
            }
        }
        Ok(left)
    }
}

/// What the system tells of the event at which this thread has stopped: a thread's number.
fn event_message(thread: pid_t) -> pid_t {
    let mut message: libc::c_ulong = 0;
    // SAFETY: room for one number.
    unsafe { libc::ptrace(libc::PTRACE_GETEVENTMSG, thread, 0, &raw mut message) };
    message as pid_t
}

fn go(thread: pid_t, signal: c_int) {
    // SAFETY: no pointers. A thread that was killed meanwhile goes nowhere.
    unsafe { libc::ptrace(libc::PTRACE_CONT, thread, 0, signal) };
}

fn go_to_return(thread: pid_t) {
    // SAFETY: as above.
    unsafe { libc::ptrace(libc::PTRACE_SYSCALL, thread, 0, 0) };
}

/// Kills a process that does not end in time. The process is not waited for before the watchdog has ended, or has no other name.
struct Watchdog {
    over: std::sync::mpsc::Sender<()>,
    barked: Arc<Mutex<Option<String>>>,
    thread: std::thread::JoinHandle<()>,
}

impl Watchdog {
    fn start(process: pid_t, limit: Duration) -> Self {
        let (over, end) = channel();
        let barked = Arc::new(Mutex::new(None));
        let bark = Arc::clone(&barked);
        let thread = std::thread::spawn(move || {
            if end.recv_timeout(limit) == Err(RecvTimeoutError::Timeout) {
                *bark.lock().unwrap_or_else(PoisonError::into_inner) = Some(what_threads_do(process));
                // SAFETY: no pointers.
                unsafe { libc::kill(process, libc::SIGKILL) };
            }
        });
        Self { over, barked, thread }
    }

    fn end(self) -> Option<String> {
        // It may have barked already.
        let _ = self.over.send(());
        let _ = self.thread.join();
        self.barked.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// Names of threads and numbers of the system calls they are in, and how many threads each.
fn what_threads_do(process: pid_t) -> String {
    let mut counts = std::collections::BTreeMap::<String, usize>::new();
    for task in std::fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten() {
        let read = |name: &str| std::fs::read_to_string(task.path().join(name)).unwrap_or_default();
        let (name, call) = (read("comm"), read("syscall"));
        let name = name.trim().trim_end_matches(|c: char| c.is_ascii_digit());
        *counts.entry(format!("{name} in {}", call.split_whitespace().next().unwrap_or("?"))).or_default() += 1;
    }
    counts.iter().map(|(what, count)| format!("{count} × {what}")).collect::<Vec<_>>().join(", ")
}
