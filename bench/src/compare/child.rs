//! One whole process, measured: wall time until its output is on the disk, CPU time, peak memory, and what it says of itself.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open, pidfd_send_signal};
use serde::{Deserialize, Serialize};

use super::error::Error;

/// The cost of one process.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Cost {
    /// From before the start until the output was synced.
    pub(crate) wall_seconds: f64,
    /// User and system time of the process and of the children it waited for.
    pub(crate) cpu_seconds: f64,
    /// Largest resident set of any of its processes, mapped file pages included. Where the system's account is no larger than what this process had itself
    /// when it started the other one, which that account begins with, it is the largest that was looked at every few milliseconds.
    pub(crate) peak_resident_bytes: u64,
    /// Largest anonymous memory of all its processes together, looked at every few milliseconds.
    #[serde(default)]
    pub(crate) peak_anonymous_bytes: Option<u64>,
    /// How it ended: `exit 0`, `signal 9`, `over the time limit`.
    pub(crate) end: String,
    /// It ended by itself, and not by a signal.
    pub(crate) exited: bool,
    /// Exit code, if it exited.
    pub(crate) code: Option<i32>,
    /// Bytes of the output; `None` without one.
    pub(crate) output_bytes: Option<u64>,
    /// Where its time went, by its own word.
    #[serde(default)]
    pub(crate) stages: Vec<Stage>,
    /// Counts of its own, by name.
    #[serde(default)]
    pub(crate) facts: std::collections::BTreeMap<String, u64>,
    /// The end of what it said on standard error.
    pub(crate) complaint: String,
}

impl Cost {
    /// Seconds of a stage, by the process's own word.
    pub(super) fn stage_seconds(&self, name: &str) -> Option<f64> {
        self.stages.iter().find(|stage| stage.name == name).map(|stage| stage.seconds)
    }
}

/// A part of a process's work.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Stage {
    pub(crate) name: String,
    pub(crate) seconds: f64,
}

/// A process that ended, and what it wrote to standard output.
pub(super) struct Ended {
    pub(super) cost: Cost,
    pub(super) said: String,
}

/// Runs `command` to its end, then syncs `output` (a file, or a folder) if asked to. At `limit` the process is killed.
pub(super) fn measure(command: Command, output: Option<&Path>, sync: bool, limit: Duration) -> Result<Ended, Error> {
    // What others left to be written must not be waited for inside the measured time.
    rustix::fs::sync();
    run(command, output, sync, limit)
}

/// The same where it does not matter to the millisecond how long it takes.
pub(super) fn run(mut command: Command, output: Option<&Path>, sync: bool, limit: Duration) -> Result<Ended, Error> {
    let name = command.get_program().to_string_lossy().into_owned();
    let scratch = || tempfile::tempfile().map_err(Error::io("creating a temporary file"));
    let (words, complaints) = (scratch()?, scratch()?);
    let share = |file: &File| file.try_clone().map_err(Error::io("sharing a temporary file"));
    command.stdin(Stdio::null()).stdout(share(&words)?).stderr(share(&complaints)?);
    // A new process shares the memory of the one that starts it until it runs its own program, and its account begins with that.
    let own_peak = peak_resident_bytes_of_self();
    let begin = Instant::now();
    let child = command.spawn().map_err(Error::io(format!("starting {name}")))?;
    let waited = wait(child.id(), limit).map_err(Error::io(format!("waiting for {name}")))?;
    let written = output.and_then(|path| File::open(path).ok());
    if let Some(file) = written.as_ref().filter(|_| sync) {
        sync_all(file).map_err(Error::io("syncing an output"))?;
    }
    let wall_seconds = begin.elapsed().as_secs_f64();
    let usage = waited.usage;
    let seconds = |time: libc::timeval| time.tv_sec as f64 + time.tv_usec as f64 * 1e-6;
    let code = libc::WIFEXITED(waited.status).then(|| libc::WEXITSTATUS(waited.status));
    let end = match code {
        _ if waited.late => format!("over the time limit of {} s", limit.as_secs()),
        Some(code) => format!("exit {code}"),
        None => format!("signal {}", libc::WTERMSIG(waited.status)),
    };
    let cost = Cost {
        wall_seconds,
        cpu_seconds: seconds(usage.ru_utime) + seconds(usage.ru_stime),
        peak_resident_bytes: match usage.ru_maxrss as u64 * 1024 {
            // The system counts pages of each processor by themselves, so the two accounts differ a little. Of a process that ended too soon no other
            // account is known: it had no more than that.
            told if told > own_peak + own_peak / 16 || waited.looks < LOOKS => told,
            _ => waited.memory.resident,
        },
        peak_anonymous_bytes: Some(waited.memory.anonymous).filter(|bytes| *bytes > 0),
        end,
        exited: code.is_some(),
        code,
        output_bytes: written.is_some().then(|| output.map_or(0, bytes_under)),
        complaint: last_words(complaints, 2000),
        ..Cost::default()
    };
    Ok(Ended { cost, said: last_words(words, 64 << 20) })
}

/// Syncs a file, or all of the file system that a folder is on.
fn sync_all(file: &File) -> std::io::Result<()> {
    if file.metadata()?.is_dir() { Ok(rustix::fs::syncfs(file)?) } else { file.sync_all() }
}

/// Length of a file, or of all files in a folder.
fn bytes_under(path: &Path) -> u64 {
    let length = |path: &Path| path.metadata().map_or(0, |facts| facts.len());
    match std::fs::read_dir(path) {
        Ok(entries) => entries.flatten().map(|entry| length(&entry.path())).sum(),
        Err(_) => length(path),
    }
}

/// The system's account of a child that ended.
struct Waited {
    status: libc::c_int,
    usage: libc::rusage,
    /// It had to be killed at the limit.
    late: bool,
    memory: Memory,
    /// How often its memory was looked at.
    looks: u32,
}

/// After so many looks, 11 milliseconds, a process has run its own program for a while.
const LOOKS: u32 = 6;

/// Memory of a process and of all that it started, in bytes; what cannot be read counts as none.
#[derive(Clone, Copy, Debug, Default)]
struct Memory {
    /// Anonymous memory of all of them together.
    anonymous: u64,
    /// The largest resident set that any of them had.
    resident: u64,
}

impl Memory {
    /// Now.
    fn of(id: u32) -> Self {
        let status = status_of(id);
        let own = Self { anonymous: bytes_of(&status, "RssAnon:"), resident: bytes_of(&status, "VmHWM:") };
        let threads = std::fs::read_dir(format!("/proc/{id}/task")).into_iter().flatten().flatten();
        let children = threads.filter_map(|thread| std::fs::read_to_string(thread.path().join("children")).ok());
        children
            .flat_map(|line| numbers(&line))
            .map(Self::of)
            .fold(own, |all, one| Self { anonymous: all.anonymous + one.anonymous, resident: all.resident.max(one.resident) })
    }

    /// The more of two looks.
    fn max(self, other: Self) -> Self {
        Self { anonymous: self.anonymous.max(other.anonymous), resident: self.resident.max(other.resident) }
    }
}

/// Waits for a child, and looks at its memory meanwhile.
fn wait(id: u32, limit: Duration) -> std::io::Result<Waited> {
    let pid = Pid::from_raw(id as i32).ok_or(std::io::ErrorKind::InvalidInput)?;
    // A handle, not a number: the number may be another process's by the time of the kill.
    let handle = pidfd_open(pid, PidfdFlags::empty())?;
    let (done, watch) = mpsc::channel::<()>();
    std::thread::scope(|scope| {
        let handle = &handle;
        let watchdog = scope.spawn(move || {
            let begin = Instant::now();
            let (mut pause, mut memory, mut looks) = (Duration::from_millis(1), Memory::default(), 0);
            while let Err(RecvTimeoutError::Timeout) = watch.recv_timeout(pause.min(limit.saturating_sub(begin.elapsed()))) {
                if begin.elapsed() >= limit {
                    return (pidfd_send_signal(handle, Signal::KILL).is_ok(), memory, looks);
                }
                memory = memory.max(Memory::of(id));
                looks += 1;
                // Often enough for a short process, and for a long one below a thousandth of a processor.
                pause = (pause * 5 / 4).min(Duration::from_millis(50));
            }
            (false, memory, looks)
        });
        let mut status = 0;
        // SAFETY: rusage is a plain C structure of integers, for which all zeros are valid.
        let mut usage: libc::rusage = unsafe { std::mem::zeroed() };
        // SAFETY: both pointers are to live variables of the right types; `id` is a child of ours that nothing else waits for
        // (its `Child` is never waited on).
        let waited = unsafe { libc::wait4(id as libc::pid_t, &mut status, 0, &mut usage) };
        let error = std::io::Error::last_os_error();
        drop(done);
        let (late, memory, looks) = watchdog.join().unwrap_or_default();
        if waited < 0 { Err(error) } else { Ok(Waited { status, usage, late, memory, looks }) }
    })
}

/// The largest resident set that this process had.
fn peak_resident_bytes_of_self() -> u64 {
    bytes_of(&status_of(std::process::id()), "VmHWM:")
}

/// The system's account of a process; empty if there is none.
fn status_of(id: u32) -> String {
    std::fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default()
}

/// A number of kilobytes in an account of the system, in bytes; 0 if it is not there.
pub(super) fn bytes_of(status: &str, name: &str) -> u64 {
    let line = status.lines().find_map(|line| line.strip_prefix(name));
    line.and_then(|line| line.split_whitespace().next()).and_then(|number| number.parse::<u64>().ok()).unwrap_or(0) * 1024
}

fn numbers(line: &str) -> Vec<u32> {
    line.split_whitespace().filter_map(|word| word.parse().ok()).collect()
}

/// The end of what was written to `file`, at most `most` bytes.
fn last_words(mut file: File, most: u64) -> String {
    let length = file.metadata().map_or(0, |facts| facts.len());
    let mut text = Vec::new();
    let read = file.seek(SeekFrom::Start(length.saturating_sub(most))).and_then(|_| file.read_to_end(&mut text));
    read.map_or_else(|error| error.to_string(), |_| String::from_utf8_lossy(&text).trim().into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(script: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        command
    }

    const LONG: Duration = Duration::from_secs(60);

    #[test]
    fn exit_code_output_and_words_are_seen() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let mut command = shell("printf 12345 > \"$0\"; echo oh >&2; echo ah; exit 3");
        command.arg(&out);
        let Ended { cost, said } = measure(command, Some(&out), true, LONG).unwrap();
        assert_eq!((cost.code, cost.output_bytes, cost.complaint.as_str()), (Some(3), Some(5), "oh"));
        assert_eq!((cost.end.as_str(), said.as_str()), ("exit 3", "ah"));
        assert!(cost.peak_resident_bytes > 100_000 && cost.wall_seconds > 0.0);
    }

    #[test]
    fn a_folder_of_outputs_is_summed() {
        let folder = tempfile::tempdir().unwrap();
        let mut command = shell("printf 12345 > \"$0/a\"; printf 12 > \"$0/b\"");
        command.arg(folder.path());
        assert_eq!(measure(command, Some(folder.path()), true, LONG).unwrap().cost.output_bytes, Some(7));
    }

    #[test]
    fn cpu_time_is_the_childs() {
        let cost = measure(shell("i=0; while [ $i -lt 200000 ]; do i=$((i+1)); done"), None, true, LONG).unwrap().cost;
        let idle = measure(shell("sleep 0.05"), None, true, LONG).unwrap().cost;
        assert!(cost.cpu_seconds > idle.cpu_seconds, "{} {}", cost.cpu_seconds, idle.cpu_seconds);
        assert!(idle.wall_seconds >= 0.05);
    }

    /// The shell waits for a child that holds the memory.
    #[test]
    fn memory_of_a_childs_child_is_seen() {
        let script = "sh -c 'a=$(head -c 20000000 /dev/zero | tr \"\\0\" x); sleep 0.3; : \"$a\"'; true";
        let cost = measure(shell(script), None, true, LONG).unwrap().cost;
        assert!(cost.peak_anonymous_bytes.unwrap() > 20_000_000, "{cost:?}");
    }

    #[test]
    fn memory_of_who_starts_it_is_not_the_childs() {
        let own = vec![1_u8; 200_000_000];
        let cost = measure(shell("sleep 0.5"), None, true, LONG).unwrap().cost;
        assert!(cost.peak_resident_bytes > 100_000 && cost.peak_resident_bytes < 50_000_000, "{cost:?}");
        assert_eq!(own.iter().map(|x| u64::from(*x)).sum::<u64>(), 200_000_000);
    }

    #[test]
    fn what_takes_too_long_is_ended() {
        let mut command = Command::new("sleep");
        command.arg("30");
        let cost = measure(command, None, true, Duration::from_millis(50)).unwrap().cost;
        assert!(!cost.exited && cost.end.starts_with("over the time limit") && cost.wall_seconds < 20.0);
    }
}
