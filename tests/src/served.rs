//! A daemon at work in a place, and how to wait for what it does.

use std::fs::File;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::Place;

/// What is sure to come is waited for so long: other tests may keep the disk busy for a minute.
const PATIENCE: Duration = Duration::from_secs(180);

/// Waits for what is sure to come; how long it took.
///
/// # Panics
/// When it does not come.
pub fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) -> Duration {
    let began = Instant::now();
    while !is_so() {
        assert!(began.elapsed() < PATIENCE, "in vain: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
    began.elapsed()
}

/// The children of all threads of a process.
pub fn children_of(process: u32) -> Vec<Pid> {
    let threads = std::fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    let children = threads.filter_map(|thread| std::fs::read_to_string(thread.path().join("children")).ok());
    let pids = |list: String| list.split_whitespace().filter_map(|pid| pid.parse().ok()).collect::<Vec<i32>>();
    children.flat_map(pids).filter_map(Pid::from_raw).collect()
}

/// The child of a process that has mapped a file of this name.
pub fn worker_of(process: u32, name: &str) -> Option<Pid> {
    let maps = |child: &Pid| std::fs::read_to_string(format!("/proc/{}/maps", child.as_raw_nonzero()));
    children_of(process).into_iter().find(|child| maps(child).is_ok_and(|maps| maps.contains(name)))
}

/// A running daemon, which is killed when it is dropped. Its log is a file of the place.
pub struct Served<'a> {
    place: &'a Place,
    log: String,
    child: Child,
}

impl<'a> Served<'a> {
    /// Starts `suture watch` with these arguments, and waits until it serves a folder.
    ///
    /// # Panics
    /// When it does not.
    pub fn start(place: &'a Place, arguments: &[&str], log: &str) -> Self {
        let mut command = place.command();
        command.arg("watch").args(arguments);
        Self::of(place, command, log)
    }

    /// Starts a daemon by this command, and waits until it serves a folder.
    ///
    /// # Panics
    /// When it does not.
    pub fn of(place: &'a Place, command: Command, log: &str) -> Self {
        let served = Self::begin(place, command, log);
        wait_until("the daemon serves its folder", || !served.lines("Serving a hot folder.").is_empty());
        served
    }

    /// Starts a daemon by this command, and waits for nothing.
    ///
    /// # Panics
    /// When it cannot be started.
    pub fn begin(place: &'a Place, mut command: Command, log: &str) -> Self {
        let file = File::create(place.at(log)).expect("the log can be made");
        let child = command.stdout(Stdio::null()).stderr(file).spawn().expect("the daemon can be started");
        Self { place, log: log.to_owned(), child }
    }

    /// Its process.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Sends it a signal.
    ///
    /// # Panics
    /// When it has ended.
    pub fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.child), signal).expect("the daemon lives");
    }

    /// How it ended; `None`: it runs.
    ///
    /// # Panics
    /// When it cannot be asked.
    pub fn end(&mut self) -> Option<ExitStatus> {
        self.child.try_wait().expect("a child can be asked")
    }

    /// Waits for its end.
    ///
    /// # Panics
    /// When it cannot be waited for.
    pub fn ended(mut self) -> ExitStatus {
        self.child.wait().expect("the daemon can be waited for")
    }

    /// Lines of its log that hold these words.
    ///
    /// # Panics
    /// When one of them is no JSON.
    pub fn lines(&self, words: &str) -> Vec<Value> {
        let log = String::from_utf8_lossy(&self.place.read(&self.log)).into_owned();
        // The last line may be half written.
        let whole = log.rsplit_once('\n').map_or("", |(whole, _)| whole);
        whole
            .lines()
            .filter(|line| line.contains(words))
            .map(|line| serde_json::from_str(line).expect("a line of JSON"))
            .collect()
    }
}

impl Drop for Served<'_> {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// What `suture jobs list --json` says of a hot folder of the place.
///
/// # Panics
/// When it cannot be had.
pub fn jobs(place: &Place, folder: &str) -> Vec<Value> {
    let listed = place.suture(["jobs", "list", "--json", "--dir", folder]).expect(0).stdout();
    listed.lines().map(|line| serde_json::from_str(line).expect("a line of JSON")).collect()
}
