//! The supervisor's side of a worker process: starts it with limits, speaks the protocol, and says what it died of.
//!
//! The engine maps files that others may truncate, and works on whatever people drop: SIGBUS, a stack overflow, an abort for
//! want of memory or an endless loop must cost one file, never the daemon, and must be one clear line, never a core dump.
//!
//! The kernel's parent-death signal follows the *thread* that started the child: whoever owns a [`Worker`] must keep the thread
//! alive that spawned it.

use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crossbeam::channel::{Receiver, RecvTimeoutError, unbounded};
use rustix::process::{Pid, Signal};
use suture_core::{ErrorClass, Report};

use crate::course::Course;
use crate::create;
use crate::exit::WORKER_CUT;
use crate::fence::Fence;
use crate::fsx::{self, Identity};
use crate::protocol::{Message, Request};

/// How often a waiting supervisor looks whether it should stop.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Kills by the kernel are counted anew before a request, but not more often: it takes as long as a small file's hash.
const COUNT_EVERY: Duration = Duration::from_secs(1);
/// For the C library's allocator (another one pays no attention): tables up to 4 MiB come from the heap, of which up to 16 MiB are kept.
/// Else every file's tables come from the system anew, page by page, which takes a twelfth of the time of a small file.
const TUNABLES: &str = "GLIBC_TUNABLES";
const KEEP_MEMORY: &str = "glibc.malloc.mmap_threshold=4194304:glibc.malloc.trim_threshold=16777216";
/// And of a large file: lists from 1 MiB on come from the system, and go back to it. Else the allocator keeps up to 32 MiB each in its heap once
/// such a list was freed, with small blocks in between, which held 250 MB of 800 with nothing in them (200 M triangles).
const GIVE_BACK: &str = "glibc.malloc.mmap_threshold=1048576";
/// Lines of a worker's standard error that are kept for the post mortem.
const TAIL_LINES: usize = 12;

/// What came of one request.
#[derive(Debug)]
pub(crate) enum Ended {
    /// An answer: the report, and what the file that was written was when it had been read back.
    Done { report: Box<Report>, written: Option<Identity> },
    /// An answer: the engine's error, in words that name the file.
    Failed { class: ErrorClass, message: String },
    /// No answer: the worker died, or was killed for exceeding a limit.
    Died(Death),
    /// The caller wanted it stopped; the worker is gone, and nothing is the file's fault.
    Stopped,
}

/// Why a worker died without an answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Death {
    pub cause: Cause,
    /// The last thing it said, if anything.
    pub last_words: String,
}

/// What killed a worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    /// A signal of its own making: SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGSYS, SIGTRAP.
    Fault(i32),
    /// It ended by itself without an answer (an internal error).
    Internal(i32),
    /// It asked for more memory than its limit.
    Memory,
    /// The machine, or the group of processes it runs in, was out of memory.
    Machine,
    /// It took longer than it was given.
    Time(Duration),
    /// It ended before it had begun, or could not say what came of its work: the world's fault.
    Cut,
    /// Someone else killed it.
    Killed(i32),
}

impl Death {
    /// Is the file to blame? An operator's kill, or a machine that is too small, never is its fault.
    pub(crate) fn blames_file(&self) -> bool {
        !matches!(self.cause, Cause::Killed(_) | Cause::Machine | Cause::Cut)
    }

    /// Who can do something about it.
    pub(crate) fn class(&self) -> ErrorClass {
        match self.cause {
            Cause::Memory => ErrorClass::Starved,
            Cause::Killed(_) | Cause::Machine | Cause::Cut => ErrorClass::Environment,
            Cause::Fault(_) | Cause::Internal(_) | Cause::Time(_) => ErrorClass::Refused,
        }
    }

    /// One line for people, without the file's name.
    pub(crate) fn line(&self) -> String {
        let base = match self.cause {
            Cause::Fault(signal) if signal == Signal::BUS.as_raw() => {
                "the file could not be read to its end while it was mapped (SIGBUS: it was cut short meanwhile, or its disk failed)"
                    .to_owned()
            }
            Cause::Fault(signal) => format!("the worker crashed on it ({}); a defect in Suture, please report it", name_of(signal)),
            Cause::Internal(_) => "the worker ended in an internal error on it; a defect in Suture, please report it".to_owned(),
            Cause::Cut => "the worker could not begin, or not say what came of it".to_owned(),
            Cause::Memory => "the work needed more memory than its budget allows; a larger --memory may let it through".to_owned(),
            Cause::Machine => "the machine (or the control group of this process) ran out of memory; a smaller --memory, fewer workers, or \
                               more memory for the machine let it through"
                .to_owned(),
            Cause::Time(limit) => {
                let reached = if self.last_words.is_empty() { String::new() } else { format!(", {}", self.last_words) };
                let limit = crate::units::show_seconds(limit.as_secs_f64());
                format!("stopped at its time limit of {limit}{reached}; a larger `time_limit` may let it through")
            }
            Cause::Killed(signal) => format!("the worker was killed from outside ({}); the file is not to blame", name_of(signal)),
        };
        match (&self.cause, self.last_words.is_empty()) {
            (Cause::Fault(_) | Cause::Internal(_) | Cause::Cut, false) => format!("{base}: {}", self.last_words),
            _ => base,
        }
    }
}

/// Where the work was when it was last heard of.
fn how_far(course: &Course) -> String {
    match course.percent() {
        0 => format!("while {}", course.doing()),
        percent => format!("with {percent} % done, while {}", course.doing()),
    }
}

fn name_of(signal: i32) -> String {
    match signal {
        3 => "SIGQUIT".into(),
        4 => "SIGILL".into(),
        5 => "SIGTRAP".into(),
        6 => "SIGABRT".into(),
        7 => "SIGBUS".into(),
        8 => "SIGFPE".into(),
        9 => "SIGKILL".into(),
        11 => "SIGSEGV".into(),
        15 => "SIGTERM".into(),
        31 => "SIGSYS".into(),
        other => format!("signal {other}"),
    }
}

/// Bytes that a process may have of the system, which holds so many by its own count. That count is what it keeps to; the limit only catches what
/// escapes it. Stacks, allocator slack and code are not in that count.
pub(crate) fn room_of(memory: u64, threads: usize) -> u64 {
    memory.saturating_add(memory / 4).saturating_add(256 << 20).saturating_add(threads as u64 * (8 << 20))
}

/// A running worker process. Dropping it kills it and waits for its end.
pub(crate) struct Worker {
    child: Child,
    stdin: Option<ChildStdin>,
    /// Lines as they came.
    lines: Receiver<Vec<u8>>,
    tail: Arc<Mutex<VecDeque<String>>>,
    readers: Vec<JoinHandle<()>>,
    /// Kills for want of memory, as counted at that time.
    oom_kills: (u64, Instant),
}

impl Worker {
    /// Starts a worker that may hold `memory` bytes by its own count, with headroom for what it does not count. One for `many` small
    /// files keeps the memory of one for the next. Beyond the fence it reaches nothing.
    ///
    /// # Errors
    /// When the process cannot be started.
    pub(crate) fn spawn(memory: u64, threads: usize, many: bool, fence: &Fence) -> io::Result<Self> {
        let data = room_of(memory, threads);
        // The running binary itself, even when a newer one has taken its name meanwhile.
        let mut command = Command::new("/proc/self/exe");
        command.arg0("suture").arg("worker").env("RUST_BACKTRACE", "0");
        command.args(["--parent", &std::process::id().to_string(), "--data", &data.to_string()]);
        command.args(fence.arguments());
        if std::env::var_os(TUNABLES).is_none() {
            command.env(TUNABLES, if many { KEEP_MEMORY } else { GIVE_BACK });
        }
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).process_group(0);
        // The worker binds itself (`confine`): without anything to be done between fork and exec, the system starts it in one call, which never
        // waits for a worker that waits for us.
        let mut child = command.spawn()?;
        let (stdout, stderr, stdin) = (child.stdout.take(), child.stderr.take(), child.stdin.take());
        let (sender, lines) = unbounded();
        let tail = Arc::new(Mutex::new(VecDeque::new()));
        let mut worker =
            Self { child, stdin, lines, tail: Arc::clone(&tail), readers: Vec::new(), oom_kills: (oom_kills(), Instant::now()) };
        // Where no more threads can be had, the worker is dropped, which ends it.
        if let Some(stdout) = stdout {
            worker.readers.push(reader(move || {
                for line in BufReader::new(stdout).split(b'\n') {
                    let Ok(line) = line else { break };
                    if sender.send(line).is_err() {
                        break;
                    }
                }
            })?);
        }
        if let Some(stderr) = stderr {
            worker.readers.push(reader(move || keep_tail(stderr, &tail))?);
        }
        Ok(worker)
    }

    /// The process's id.
    pub(crate) fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Is it there, waiting for a request?
    pub(crate) fn is_alive(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }

    /// Works on one request, at most `limit` long, until `stop` says so. After anything but an answer the worker is gone
    /// ([`Worker::run`] must not be called again).
    pub(crate) fn run(
        &mut self,
        request: &Request,
        limit: Option<Duration>,
        stop: &dyn Fn() -> bool,
        on_progress: &mut dyn FnMut(&Course),
    ) -> Ended {
        let start = Instant::now();
        if start.duration_since(self.oom_kills.1) >= COUNT_EVERY {
            self.oom_kills = (oom_kills(), start);
        }
        if !self.send(request) {
            return Ended::Died(self.post_mortem(false));
        }
        let mut begun = false;
        let mut course = Course::of(request);
        let mut reached = String::new();
        loop {
            match self.lines.recv_timeout(LOOK_EVERY) {
                Ok(line) => match read_answer(&line, request) {
                    Ok(Message::Begun) => begun = true,
                    Ok(Message::Progress { stage, done, total }) => {
                        course.at(&stage, done, total, start.elapsed().as_secs_f64());
                        on_progress(&course);
                        reached = how_far(&course);
                    }
                    Ok(Message::Done { report, written }) => return Ended::Done { report, written },
                    Ok(Message::Failed { class, message }) => return Ended::Failed { class, message },
                    // It speaks nonsense.
                    Err(_) => return Ended::Died(self.post_mortem(begun)),
                },
                Err(RecvTimeoutError::Disconnected) => return Ended::Died(self.post_mortem(begun)),
                Err(RecvTimeoutError::Timeout) => {}
            }
            if stop() {
                self.kill();
                return Ended::Stopped;
            }
            if let Some(limit) = limit.filter(|limit| start.elapsed() >= *limit) {
                self.kill();
                return Ended::Died(Death { cause: Cause::Time(limit), last_words: reached });
            }
        }
    }

    fn send(&mut self, request: &Request) -> bool {
        let Some(stdin) = &mut self.stdin else { return false };
        let Ok(mut line) = serde_json::to_vec(request) else { return false };
        line.push(b'\n');
        stdin.write_all(&line).and_then(|()| stdin.flush()).is_ok()
    }

    /// Kills the worker and whatever it started, and waits for the end.
    fn kill(&mut self) -> Option<ExitStatus> {
        self.stdin = None;
        if let Some(group) = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw) {
            // Gone already: nothing to kill.
            let _ = rustix::process::kill_process_group(group, Signal::KILL);
        }
        // Should the group be out of reach: the process itself.
        let _ = self.child.kill();
        let status = self.child.wait().ok();
        for reader in self.readers.drain(..) {
            let _ = reader.join();
        }
        status
    }

    /// The worker closed its output (or its input) unasked: finds out why. `begun`: it had said that it works on the request.
    fn post_mortem(&mut self, begun: bool) -> Death {
        // A worker that is alive but speaks nonsense, or is slow to die, gets a moment to show its own end.
        let patience = Instant::now() + Duration::from_secs(2);
        let status = loop {
            match self.child.try_wait() {
                Ok(Some(status)) => break Some(status),
                Ok(None) if Instant::now() < patience => std::thread::sleep(Duration::from_millis(2)),
                _ => break None,
            }
        };
        let oom = oom_kills() > self.oom_kills.0;
        self.kill();
        let lines = self.tail.lock().unwrap_or_else(PoisonError::into_inner);
        let out_of_memory = lines.iter().any(|line| line.starts_with("memory allocation of "));
        let last_words = lines.back().cloned().unwrap_or_default();
        let last_words = lines.iter().find(|line| line.contains("panicked at")).map_or(last_words, |head| {
            let after = lines.iter().skip_while(|line| *line != head).nth(1).cloned().unwrap_or_default();
            format!("{head} {after}")
        });
        let cause = match status.map(|status| (status.signal(), status.code())) {
            _ if out_of_memory => Cause::Memory,
            Some((Some(9), _)) if oom => Cause::Machine,
            Some((Some(signal @ (9 | 15)), _)) => Cause::Killed(signal),
            Some((None, Some(code))) if code == i32::from(WORKER_CUT) => Cause::Cut,
            _ if !begun => Cause::Cut,
            Some((Some(signal @ (4..=8 | 11 | 31)), _)) => Cause::Fault(signal),
            Some((Some(signal), _)) => Cause::Killed(signal),
            Some((None, code)) => Cause::Internal(code.unwrap_or(-1)),
            // It lives, but its voice broke.
            None => Cause::Cut,
        };
        Death { cause, last_words }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.kill();
    }
}

/// A thread that reads what a worker says.
fn reader(read: impl FnOnce() + Send + 'static) -> io::Result<JoinHandle<()>> {
    std::thread::Builder::new().name("worker's voice".into()).spawn(read)
}

/// What a worker said. A mark says meanwhile that its answer is being read: nothing else of a file gets as far as the daemon.
fn read_answer(line: &[u8], request: &Request) -> serde_json::Result<Message> {
    let is_answer = line.starts_with(br#"{"done"#) || line.starts_with(br#"{"failed"#);
    let mark = request.mark.as_deref().filter(|_| is_answer);
    // Without a mark the death that may follow is nobody's.
    let _ = mark.map(create::mark);
    #[cfg(feature = "crash-points")]
    if request.shown_input.contains("!kill-daemon!") && is_answer {
        let _ = rustix::process::kill_process(rustix::process::getpid(), Signal::KILL);
    }
    let message = serde_json::from_slice(line);
    let _ = mark.map(fsx::remove_if_there);
    message
}

/// Passes a worker's log on and keeps its end.
fn keep_tail(stderr: impl Read, tail: &Mutex<VecDeque<String>>) {
    for line in BufReader::new(stderr).split(b'\n') {
        let Ok(line) = line else { break };
        let line = String::from_utf8_lossy(&line).trim().chars().take(500).collect::<String>();
        if line.is_empty() {
            continue;
        }
        tracing::debug!(target: "suture::worker", "{line}");
        let mut tail = tail.lock().unwrap_or_else(PoisonError::into_inner);
        tail.push_back(line);
        if tail.len() > TAIL_LINES {
            tail.pop_front();
        }
    }
}

/// How often the kernel has killed for want of memory since it started. SIGKILL alone does not tell an operator from it.
fn oom_kills() -> u64 {
    let text = std::fs::read_to_string("/proc/vmstat").unwrap_or_default();
    text.lines().find_map(|line| line.strip_prefix("oom_kill ")).and_then(|n| n.trim().parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f03_an_operators_kill_is_not_the_files_fault() {
        let death = |cause| Death { cause, last_words: String::new() };
        assert!(!death(Cause::Killed(9)).blames_file());
        assert!(!death(Cause::Killed(15)).blames_file());
        assert!(!death(Cause::Machine).blames_file() && !death(Cause::Cut).blames_file());
        for cause in [Cause::Fault(11), Cause::Internal(101), Cause::Memory, Cause::Time(Duration::from_secs(1))] {
            assert!(death(cause).blames_file());
        }
    }

    /// D9: a machine without memory is not helped by giving its workers more of it.
    #[test]
    fn a_machine_out_of_memory_advises_less() {
        let line = |cause| Death { cause, last_words: String::new() }.line();
        assert!(line(Cause::Machine).contains("smaller --memory") && !line(Cause::Machine).contains("larger"));
        assert!(line(Cause::Memory).contains("larger --memory"));
    }

    #[test]
    fn f10_only_a_death_for_memory_is_starved() {
        let class = |cause| Death { cause, last_words: String::new() }.class();
        assert_eq!(class(Cause::Memory), ErrorClass::Starved);
        for cause in [Cause::Fault(11), Cause::Internal(101), Cause::Time(Duration::from_secs(1))] {
            assert_eq!(class(cause), ErrorClass::Refused);
        }
        assert_eq!(class(Cause::Killed(9)), ErrorClass::Environment);
    }

    #[test]
    fn f11_a_time_limit_says_how_far_the_work_was() {
        let line = |last_words| Death { cause: Cause::Time(Duration::from_secs(120)), last_words }.line();
        let mut course = Course::new(true, false);
        course.at("read", 0, 7, 0.0);
        assert!(line(how_far(&course)).contains(", while reading the file; a larger `time_limit`"));
        // Of the whole, not of the stage.
        course.at("topology", 50, 100, 0.0);
        assert!(line(how_far(&course)).contains(", with 31 % done, while looking for defects; a larger `time_limit`"));
        assert!(!line(String::new()).contains(','));
    }

    #[test]
    fn a_bus_error_speaks_of_the_file_not_of_signals_first() {
        let death = Death { cause: Cause::Fault(7), last_words: "noise".into() };
        assert!(death.line().starts_with("the file could not be read"));
    }
}
