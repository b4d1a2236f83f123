//! Where everything is, and the configuration that the simulated daemon works by.

use std::path::{Path, PathBuf};

use suture_store::testkit::Chance;

/// Hot folders. Originals stay in the second one.
pub(super) const FOLDERS: [&str; 2] = ["hot", "left"];
/// The one in which originals stay.
pub(super) const LEFT: usize = 1;

/// Hours of work, by the clock on the wall.
const WINDOWS: [Option<&str>; 5] =
    [None, None, Some("20:00-07:00"), Some("01:30-03:30"), Some("06:00-06:20, 12:00-13:00, 22:00-24:00")];

/// What of the configuration changes while the daemon runs.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub workers: u64,
    pub window: Option<&'static str>,
    pub priorities: [u64; 2],
    pub drain: u64,
    /// Days after which results go.
    pub results: u64,
    pub history_jobs: u64,
    /// Of so many jobs one is computed twice; 0: none.
    pub check_one_in: u64,
}

impl Plan {
    pub(super) fn new(chance: &mut Chance) -> Self {
        Self {
            workers: chance.between(1, 3),
            window: chance.pick(&WINDOWS),
            priorities: [chance.below(10), chance.below(10)],
            drain: chance.between(1, 99),
            results: chance.between(1, 3),
            history_jobs: chance.pick(&[20, 200, 30_000]),
            check_one_in: chance.pick(&[0, 1, 3]),
        }
    }
}

/// Where everything is.
pub(super) struct Place {
    base: tempfile::TempDir,
}

impl Place {
    /// A new one, in memory where the system has files there.
    pub(super) fn new() -> Self {
        let memory = Path::new("/dev/shm");
        let base = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
        let place = Self { base: base.unwrap() };
        std::fs::create_dir(place.archive()).unwrap();
        std::fs::write(place.archive().join(".suture-archive"), "").unwrap();
        place
    }

    pub(super) fn root(&self, folder: usize) -> PathBuf {
        self.base.path().join(FOLDERS[folder])
    }

    /// Where a hot folder is while it is away.
    pub(super) fn away(&self, folder: usize) -> PathBuf {
        self.base.path().join(format!("{} away", FOLDERS[folder]))
    }

    pub(super) fn inbox(&self, folder: usize) -> PathBuf {
        self.root(folder).join("in")
    }

    pub(super) fn archive(&self) -> PathBuf {
        self.base.path().join("archive")
    }

    pub(super) fn state(&self) -> PathBuf {
        self.base.path().join("state").join("store")
    }

    pub(super) fn config(&self) -> PathBuf {
        self.base.path().join("suture.toml")
    }

    /// Writes the configuration.
    pub(super) fn write(&self, plan: &Plan) {
        let Plan { workers, priorities: [hot, left], drain, results, history_jobs, check_one_in, .. } = plan;
        let window = plan.window.map_or(String::new(), |window| format!("run_window = \"{window}\"\n"));
        let (state, archive) = (self.state(), self.archive());
        let text = format!(
            "state = {state:?}\nworkers = {workers}\nthreads = 2\nmemory = \"64MiB\"\nlarge = \"4KiB\"\nreserve = \"1MiB\"\nsettle = \"5s\"\n\
             rescan = \"10s\"\ndrain = {drain}\ncheck_one_in = {check_one_in}\n{window}time_limit.base = \"2m\"\n\
             [keep]\nresults = \"{results}d\"\nreports = \"4d\"\noriginals_size = \"3KiB\"\narchive = {archive:?}\nhistory_jobs = {history_jobs}\n\
             [[folders]]\nname = \"hot\"\npath = {:?}\npriority = {hot}\n\
             [[folders]]\nname = \"left\"\npath = {:?}\npriority = {left}\nleave_originals = true\n",
            self.root(0),
            self.root(1),
        );
        std::fs::write(self.config(), text).unwrap();
    }

    /// Spoils the configuration: no daemon works by it.
    pub(super) fn spoil(&self) {
        std::fs::write(self.config(), "workers = 0\n").unwrap();
    }
}
