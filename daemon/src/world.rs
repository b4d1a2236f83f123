//! The world that the daemon decides by: what time it is, who does the work, how much room a disk has, who tells of changes. Everything that is decided asks
//! here and nowhere else, so that a simulation can put a world of its own in the place of the machine's ([`Machine`]).

use std::io;
use std::path::Path;
use std::time::{Duration, Instant};

use jiff::Zoned;
use suture_store::{Clock, SystemClock, Time};

use crate::course::Course;
use crate::fence::Fence;
use crate::fsx;
use crate::protocol::Request;
use crate::supervise::{Ended, Worker};

/// A worker, whatever it is.
pub(crate) trait Hand {
    /// Its process.
    fn pid(&self) -> u32;

    /// Is it there, waiting for a request?
    fn is_alive(&mut self) -> bool;

    /// Works on one request, at most `limit` long, until `stop` says so, and tells `told` where the work stands. After anything
    /// but an answer the worker is gone.
    fn run(&mut self, request: &Request, limit: Duration, stop: &dyn Fn() -> bool, told: Telling<'_>) -> Ended;
}

/// Hears where work stands.
pub(crate) type Telling<'a> = &'a mut dyn FnMut(&Course);

/// What a worker gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Share {
    /// Bytes it may hold by its own count.
    pub memory: u64,
    pub threads: usize,
    /// It is to serve many small files.
    pub many: bool,
}

/// What the daemon decides by.
pub(crate) trait World: Send + Sync {
    /// By a clock that only goes forward, and that nothing sets.
    fn steady(&self) -> Instant;

    /// By the clock on the wall, which may jump.
    fn wall(&self) -> Time;

    /// The same clock where the machine is.
    fn local(&self) -> Zoned;

    /// Starts a worker that reaches no other folders.
    ///
    /// # Errors
    /// When the machine has none to give.
    fn hire(&self, share: Share, fence: &Fence) -> io::Result<Box<dyn Hand>>;

    /// Bytes that may still be written to a folder's file system, as [`fsx::free_space`].
    fn room(&self, folder: &Path, reserve: u64) -> u64;

    /// Does the system tell of changes in a folder?
    fn tells_of(&self, folder: &Path) -> bool;
}

/// The machine that the program runs on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Machine;

impl World for Machine {
    fn steady(&self) -> Instant {
        Instant::now()
    }

    fn wall(&self) -> Time {
        SystemClock.now()
    }

    fn local(&self) -> Zoned {
        Zoned::now()
    }

    fn hire(&self, share: Share, fence: &Fence) -> io::Result<Box<dyn Hand>> {
        Ok(Box::new(Worker::spawn(share.memory, share.threads, share.many, fence)?))
    }

    fn room(&self, folder: &Path, reserve: u64) -> u64 {
        fsx::free_space(folder, reserve)
    }

    fn tells_of(&self, folder: &Path) -> bool {
        !fsx::needs_polling(folder)
    }
}

impl Hand for Worker {
    fn pid(&self) -> u32 {
        Worker::pid(self)
    }

    fn is_alive(&mut self) -> bool {
        Worker::is_alive(self)
    }

    fn run(&mut self, request: &Request, limit: Duration, stop: &dyn Fn() -> bool, told: Telling<'_>) -> Ended {
        Worker::run(self, request, Some(limit), stop, told)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every other module of what is simulated, and every line of it that could look at a clock, at a disk's room or for a worker by itself.
    #[test]
    fn no_other_module_looks_at_the_world() {
        const WAYS: [&str; 9] = [
            "Instant::now",
            ".elapsed()",
            "SystemTime::now",
            "SystemClock",
            "Zoned::now",
            "Timestamp::now",
            "Worker::spawn",
            "fsx::free_space",
            "fsx::needs_polling",
        ];
        // Command lines and workers, which no daemon decides by; locks of other processes; the room of an archive; a daemon's beginning and end;
        // the threads that look whether others hang; and how long things took, and the web, which are told of and decide nothing.
        const APART: [&str; 21] = [
            "bar.rs",
            "event_bus.rs",
            "event_store.rs",
            "ground.rs",
            "ground/shared.rs",
            "item.rs",
            "pulse.rs",
            "reach.rs",
            "retention/archive.rs",
            "retention/command.rs",
            "sentinel.rs",
            "supervise.rs",
            "uploads.rs",
            "watch.rs",
            "watchdog.rs",
            "web.rs",
            "web/drawing.rs",
            "web/intake.rs",
            "web/metrics.rs",
            "worker.rs",
            "world.rs",
        ];
        let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let (mut folders, mut found) = (vec![sources.clone()], 0);
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap().flatten() {
                let (path, name) = (entry.path(), entry.path().strip_prefix(&sources).unwrap().display().to_string());
                if path.is_dir() {
                    folders.extend((name != "simulation").then_some(path));
                    continue;
                }
                if name.ends_with("tests.rs") {
                    continue;
                }
                let text = std::fs::read_to_string(&path).unwrap();
                let product = text.split("#[cfg(test)]\nmod tests").next().unwrap();
                let looks = WAYS.into_iter().find(|way| product.contains(way));
                found += usize::from(looks.is_some());
                assert!(looks.is_none() || APART.contains(&name.as_str()), "{name} has a {looks:?}");
            }
        }
        assert_eq!(found, APART.len(), "each of them does");
    }

    #[test]
    fn the_machine_is_the_system() {
        let (before, wall) = (Machine.steady(), Machine.wall());
        assert!(Machine.steady() >= before && Machine.wall() >= wall);
        assert!(Machine.local().timestamp().as_millisecond() as u64 >= wall.0);
        let here = std::env::temp_dir();
        assert_eq!(Machine.tells_of(&here), !fsx::needs_polling(&here));
        assert_eq!(Machine.room(Path::new("/nowhere/at/all"), 0), u64::MAX);
    }
}
