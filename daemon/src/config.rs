//! The settings that the daemon works by. A hot folder needs no settings; a TOML file may name several folders, profiles and limits: [`read`] reads it,
//! [`show`] writes one, [`command`] does either for people. [`keep`] is what goes by itself, [`api`] the web interface, [`events`] who hears of
//! what happens.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::time::Duration;

use suture_core::Profile;
use suture_store::{Address, Priority, Roles, Share, Shares};

use crate::bucket::address::BucketAddress;
use crate::own_profile::OwnProfile;
use crate::sample::SHARED_ONE_IN;
use crate::units::show_size;
use crate::window::{RunWindow, TimeOfDay};
use api::Api;
use events::Events;
use keep::Keep;
use taken::OnTaken;

mod apart;
pub(crate) mod api;
mod bucket;
pub(crate) mod command;
pub(crate) mod events;
pub(crate) mod keep;
pub(crate) mod read;
pub(crate) mod roles;
mod sampling;
pub(crate) mod share;
mod shared;
pub(crate) mod show;
pub(crate) mod taken;

/// A file as large as this is worked on alone, by all threads and with the whole memory.
pub(crate) const LARGE: u64 = 64 << 20;
/// Free space below which nothing new is taken.
const RESERVE: u64 = 256 << 20;

/// A worker with less could not read a mesh of some thousand triangles.
const LEAST_MEMORY: u64 = 4 << 20;

/// Where a folder's parts are, if not on this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct BucketConfig {
    pub address: BucketAddress,
    /// Bytes of drops that are kept in the scratch for another attempt.
    pub cache: u64,
}

/// A hot folder to serve.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FolderConfig {
    /// The name that jobs call it by.
    pub name: String,
    pub path: PathBuf,
    /// Its parts are there, and `path` is the scratch of this machine.
    pub bucket: Option<BucketConfig>,
    /// It lies on a share, and daemons on other machines serve it, too.
    pub is_shared: bool,
    /// Profile of files that lie in no sub-folder.
    pub profile: String,
    /// Originals stay in `in/`, which may be read-only.
    pub leave_originals: bool,
    /// How soon files are wanted whose profile says nothing of that.
    pub priority: Priority,
    /// Its part of the work beside other folders.
    pub share: Share,
    /// For a result whose name is taken.
    pub on_taken: OnTaken,
}

impl FolderConfig {
    /// A folder of which nothing more is said.
    pub(crate) fn of(path: &Path) -> Self {
        Self {
            name: name_of(path),
            path: path.to_owned(),
            bucket: None,
            is_shared: false,
            profile: DEFAULT_PROFILE.into(),
            leave_originals: false,
            priority: Priority::default(),
            share: Share::default(),
            on_taken: OnTaken::default(),
        }
    }

    /// May daemons on several machines serve it?
    pub(crate) fn is_for_many(&self) -> bool {
        self.bucket.is_some() || self.is_shared
    }
}

/// How long one attempt may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TimeLimit {
    pub base: Duration,
    pub per_gib: Duration,
}

impl TimeLimit {
    /// For a file of `size` bytes.
    pub(crate) fn of(&self, size: u64) -> Duration {
        let gib = size as f64 / (1u64 << 30) as f64;
        self.base.saturating_add(Duration::try_from_secs_f64(self.per_gib.as_secs_f64() * gib).unwrap_or(Duration::MAX))
    }
}

/// The settings that the daemon works by.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Config {
    pub folders: Vec<FolderConfig>,
    /// The folder of this machine's own state: the job store, unless `store` names another one.
    pub state: PathBuf,
    /// The database that holds the jobs, and that other daemons share.
    pub store: Option<Address>,
    /// The parts of the work that this daemon does, and leaves to no other.
    pub roles: Roles,
    /// Small files at a time, one thread each.
    pub workers: usize,
    /// Threads for one large file.
    pub threads: usize,
    /// Bytes all of them together may hold.
    pub memory: u64,
    pub large: u64,
    /// Larger files are left to other daemons; `None`: it takes files of any size.
    pub largest: Option<u64>,
    pub reserve: u64,
    /// Rest a file needs before it is taken; `None`: by file system, and short with `--once`.
    pub settle: Option<Duration>,
    /// Time between full scans; `None`: by file system.
    pub rescan: Option<Duration>,
    /// How long running jobs may go on after the first signal.
    pub drain: Duration,
    pub time_limit: TimeLimit,
    /// The hours at which all workers work; at others, so many do.
    pub run_window: RunWindow,
    pub workers_outside: usize,
    /// When a night ends that no hours of work end.
    pub night_ends: TimeOfDay,
    /// A result that was made of the same content before is copied, not made once more.
    pub reuse: bool,
    /// Of so many jobs one is computed twice, and compared; 0: none, `None`: by where the jobs are.
    pub check_one_in: Option<u64>,
    /// What goes by itself, and when.
    pub keep: Keep,
    /// The web interface; `None`: there is none.
    pub api: Option<Api>,
    /// Who hears of the ends of jobs.
    pub events: Events,
    pub profiles: BTreeMap<String, OwnProfile>,
}

impl Config {
    /// For one hot folder, everything else by default.
    pub(crate) fn for_folder(dir: &Path) -> Self {
        let limits = suture_core::Limits::default();
        Self {
            state: default_state(dir),
            store: None,
            roles: Roles::default(),
            folders: vec![FolderConfig::of(dir)],
            workers: 2,
            threads: limits.threads,
            memory: limits.memory_bytes,
            large: LARGE,
            largest: None,
            reserve: RESERVE,
            settle: None,
            rescan: None,
            drain: Duration::from_secs(60),
            time_limit: TimeLimit { base: Duration::from_secs(120), per_gib: Duration::from_secs(1200) },
            run_window: RunWindow::default(),
            workers_outside: 0,
            night_ends: TimeOfDay::SEVEN,
            reuse: true,
            check_one_in: None,
            keep: Keep::default(),
            api: None,
            events: Events::default(),
            profiles: BTreeMap::new(),
        }
    }

    /// Refuses a budget that does not do for its workers.
    ///
    /// # Errors
    /// A line for people.
    pub(crate) fn check_memory(&self) -> Result<(), String> {
        let least = LEAST_MEMORY.saturating_mul(self.workers as u64);
        if self.memory >= least {
            return Ok(());
        }
        let (memory, least) = (show_size(self.memory), show_size(least));
        Err(format!("{memory} of memory are too little for {} workers: they need {least} together", self.workers))
    }

    /// Of so many jobs one is computed twice; 0: none.
    pub(crate) fn check_one_in(&self) -> u64 {
        self.check_one_in.unwrap_or(if self.store.is_some() { SHARED_ONE_IN } else { 0 })
    }

    /// How the hot folders share the work.
    pub(crate) fn shares(&self) -> Shares {
        self.folders.iter().map(|folder| (folder.name.clone(), folder.share)).collect()
    }

    /// A profile of the configuration's, or a built-in one.
    pub(crate) fn profile(&self, name: &str) -> Option<Profile> {
        self.profiles.get(name).map(|own| own.profile.clone()).or_else(|| Profile::built_in(name))
    }

    /// The profile of files that lie in no sub-folder of a hot folder.
    pub(crate) fn folder_profile(&self, folder: &str) -> &str {
        self.folders.iter().find(|known| known.name == folder).map_or(DEFAULT_PROFILE, |known| known.profile.as_str())
    }
}

/// For what the daemon chooses by itself.
pub(crate) const AUTO: &str = "auto";
/// The profile of a folder that names none.
pub(crate) const DEFAULT_PROFILE: &str = "default";

/// Where the job store of a hot folder is.
pub(crate) fn default_state(folder: &Path) -> PathBuf {
    folder.join(".suture").join("state")
}

/// The path without links and detours, as far as there is something.
pub(crate) fn real(path: &Path) -> PathBuf {
    let full = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut real = PathBuf::new();
    for part in full.components() {
        match part {
            Component::ParentDir => drop(real.pop()),
            part => real.push(part),
        }
        real = real.canonicalize().unwrap_or(real);
    }
    real
}

/// What jobs call a folder that has no name of its own.
pub(crate) fn name_of(dir: &Path) -> String {
    let full = std::path::absolute(dir).unwrap_or_else(|_| dir.to_owned());
    full.file_name().map_or_else(|| "folder".into(), |name| name.to_string_lossy().into_owned())
}
