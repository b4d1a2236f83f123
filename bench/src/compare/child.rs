//! One whole process, measured: wall time until its output is on the disk, CPU time, peak memory.

use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open, pidfd_send_signal};
use serde::{Deserialize, Serialize};

use super::Error;

/// What one process cost.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Cost {
    /// From before the start until the output was synced.
    pub(crate) wall_seconds: f64,
    /// User and system time of the process and of the children it waited for.
    pub(crate) cpu_seconds: f64,
    /// Largest resident set, mapped file pages included.
    pub(crate) peak_resident_bytes: u64,
    /// How it ended: `exit 0`, `signal 9`, `over the time limit`.
    pub(crate) end: String,
    /// It ended by itself, and not by a signal.
    pub(crate) exited: bool,
    /// Exit code, if it exited.
    pub(crate) code: Option<i32>,
    /// Bytes of the output; `None` without one.
    pub(crate) output_bytes: Option<u64>,
    /// What it said on standard error, its end.
    pub(crate) complaint: String,
}

/// Runs `command` to its end, then syncs `output` if asked to. At `limit` the process is killed.
pub(super) fn measure(mut command: Command, output: Option<&Path>, sync: bool, limit: Duration) -> Result<Cost, Error> {
    // What others left to be written must not be waited for inside the measured time.
    rustix::fs::sync();
    let name = command.get_program().to_string_lossy().into_owned();
    let complaints = tempfile::tempfile().map_err(Error::io("creating a temporary file"))?;
    let kept = complaints.try_clone().map_err(Error::io("sharing a temporary file"))?;
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(kept);
    let begin = Instant::now();
    let child = command.spawn().map_err(Error::io(format!("starting {name}")))?;
    let (status, usage, late) = wait(child.id(), limit).map_err(Error::io(format!("waiting for {name}")))?;
    let written = output.and_then(|path| File::open(path).ok());
    if let Some(file) = written.as_ref().filter(|_| sync) {
        file.sync_all().map_err(Error::io("syncing an output"))?;
    }
    let wall_seconds = begin.elapsed().as_secs_f64();
    let seconds = |time: libc::timeval| time.tv_sec as f64 + time.tv_usec as f64 * 1e-6;
    let code = libc::WIFEXITED(status).then(|| libc::WEXITSTATUS(status));
    let end = match code {
        _ if late => format!("over the time limit of {} s", limit.as_secs()),
        Some(code) => format!("exit {code}"),
        None => format!("signal {}", libc::WTERMSIG(status)),
    };
    Ok(Cost {
        wall_seconds,
        cpu_seconds: seconds(usage.ru_utime) + seconds(usage.ru_stime),
        peak_resident_bytes: usage.ru_maxrss as u64 * 1024,
        end,
        exited: code.is_some(),
        code,
        output_bytes: written.and_then(|file| file.metadata().ok()).map(|facts| facts.len()),
        complaint: last_words(complaints),
    })
}

/// Waits for a child; the flag says that it had to be killed at the limit.
fn wait(id: u32, limit: Duration) -> std::io::Result<(libc::c_int, libc::rusage, bool)> {
    let pid = Pid::from_raw(id as i32).ok_or(std::io::ErrorKind::InvalidInput)?;
    // A handle, not a number: the number may be another process's by the time of the kill.
    let handle = pidfd_open(pid, PidfdFlags::empty())?;
    let (done, watch) = mpsc::channel::<()>();
    std::thread::scope(|scope| {
        let handle = &handle;
        let watchdog = scope.spawn(move || {
            let late = matches!(watch.recv_timeout(limit), Err(mpsc::RecvTimeoutError::Timeout));
            late && pidfd_send_signal(handle, Signal::KILL).is_ok()
        });
        let mut status = 0;
        // SAFETY: rusage is a plain C structure of integers, for which all zeros are valid.
        let mut usage: libc::rusage = unsafe { std::mem::zeroed() };
        // SAFETY: both pointers are to live variables of the right types; `id` is a child of ours that nothing else waits for
        // (its `Child` is never waited on).
        let waited = unsafe { libc::wait4(id as libc::pid_t, &mut status, 0, &mut usage) };
        let error = std::io::Error::last_os_error();
        drop(done);
        let late = watchdog.join().unwrap_or(false);
        if waited < 0 { Err(error) } else { Ok((status, usage, late)) }
    })
}

/// The end of what was written to `file`, at most 2000 bytes.
fn last_words(mut file: File) -> String {
    use std::io::{Read, Seek, SeekFrom};
    let length = file.metadata().map_or(0, |facts| facts.len());
    let mut text = Vec::new();
    let read = file.seek(SeekFrom::Start(length.saturating_sub(2000))).and_then(|_| file.read_to_end(&mut text));
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
    fn exit_code_output_and_complaint_are_seen() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let mut command = shell("printf 12345 > \"$0\"; echo oh >&2; exit 3");
        command.arg(&out);
        let cost = measure(command, Some(&out), true, LONG).unwrap();
        assert_eq!((cost.code, cost.output_bytes, cost.complaint.as_str()), (Some(3), Some(5), "oh"));
        assert_eq!(cost.end, "exit 3");
        assert!(cost.peak_resident_bytes > 100_000 && cost.wall_seconds > 0.0);
    }

    #[test]
    fn cpu_time_is_the_childs() {
        let cost = measure(shell("i=0; while [ $i -lt 200000 ]; do i=$((i+1)); done"), None, true, LONG).unwrap();
        let idle = measure(shell("sleep 0.05"), None, true, LONG).unwrap();
        assert!(cost.cpu_seconds > idle.cpu_seconds, "{} {}", cost.cpu_seconds, idle.cpu_seconds);
        assert!(idle.wall_seconds >= 0.05);
    }

    #[test]
    fn what_takes_too_long_is_ended() {
        let mut command = Command::new("sleep");
        command.arg("30");
        let cost = measure(command, None, true, Duration::from_millis(50)).unwrap();
        assert!(!cost.exited && cost.end.starts_with("over the time limit") && cost.wall_seconds < 20.0);
    }
}
