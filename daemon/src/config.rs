//! Settings of the daemon. A hot folder needs none; a TOML file (`--config`) may name several folders, profiles and limits.
//! Unknown settings are errors, with their line.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Deserializer, de};
use suture_core::Profile;

use crate::cli::WatchArgs;
use crate::profiles;
use crate::units::{parse_duration, parse_size, show_size};
use crate::window::RunWindow;

/// A file as large as this is worked on alone, by all threads and with the whole memory.
pub(crate) const LARGE: u64 = 64 << 20;
/// Free space below which nothing new is taken.
const RESERVE: u64 = 256 << 20;

/// A worker with less could not read a mesh of some thousand triangles.
const LEAST_MEMORY: u64 = 4 << 20;

/// The configuration file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    /// Hot folders; the first one's `.suture/` holds the job store unless `state` says otherwise.
    folders: Vec<FolderFile>,
    state: Option<PathBuf>,
    workers: Option<u16>,
    threads: Option<u16>,
    #[serde(default, deserialize_with = "size")]
    memory: Option<u64>,
    #[serde(default, deserialize_with = "size")]
    large: Option<u64>,
    #[serde(default, deserialize_with = "size")]
    reserve: Option<u64>,
    #[serde(default, deserialize_with = "duration")]
    settle: Option<Duration>,
    #[serde(default, deserialize_with = "duration")]
    rescan: Option<Duration>,
    #[serde(default, deserialize_with = "duration")]
    drain: Option<Duration>,
    time_limit: Option<TimeLimitFile>,
    run_window: Option<RunWindow>,
    workers_outside: Option<u16>,
    #[serde(default)]
    profiles: BTreeMap<String, Profile>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FolderFile {
    path: PathBuf,
    /// What jobs call it; its last part unless given.
    name: Option<String>,
    /// Profile of files that lie in no sub-folder.
    profile: Option<String>,
    /// Originals are not moved out of `in/`.
    #[serde(default)]
    leave_originals: bool,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct TimeLimitFile {
    #[serde(default, deserialize_with = "duration")]
    base: Option<Duration>,
    #[serde(default, deserialize_with = "duration")]
    per_gib: Option<Duration>,
}

/// A number, or text with a unit.
#[derive(Deserialize)]
#[serde(untagged)]
enum Quantity {
    Number(u64),
    Text(String),
}

impl Quantity {
    fn text(self) -> String {
        match self {
            Self::Number(n) => n.to_string(),
            Self::Text(text) => text,
        }
    }
}

fn size<'de, D: Deserializer<'de>>(d: D) -> Result<Option<u64>, D::Error> {
    parse_size(&Quantity::deserialize(d)?.text()).map(Some).map_err(de::Error::custom)
}

fn duration<'de, D: Deserializer<'de>>(d: D) -> Result<Option<Duration>, D::Error> {
    parse_duration(&Quantity::deserialize(d)?.text()).map(Some).map_err(de::Error::custom)
}

/// A hot folder to serve.
#[derive(Clone, Debug)]
pub(crate) struct FolderConfig {
    pub name: String,
    pub path: PathBuf,
    pub profile: String,
    /// Originals stay in `in/`, which may be read-only.
    pub leave_originals: bool,
}

/// How long one attempt may take.
#[derive(Clone, Copy, Debug)]
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

/// What the daemon works by.
#[derive(Clone, Debug)]
pub(crate) struct Config {
    pub folders: Vec<FolderConfig>,
    /// Where the job store is.
    pub state: PathBuf,
    /// Small files at a time, one thread each.
    pub workers: usize,
    /// Threads for one large file.
    pub threads: usize,
    /// Bytes all of them together may hold.
    pub memory: u64,
    pub large: u64,
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
    pub profiles: BTreeMap<String, Profile>,
}

impl Config {
    /// From the command line: a folder alone, or a configuration file; options on the command line count over the file's.
    ///
    /// # Errors
    /// A line for people.
    pub(crate) fn from_args(args: &WatchArgs) -> Result<Self, String> {
        let mut config = match (&args.config, &args.dir) {
            (Some(file), _) => Self::from_file(file)?,
            (None, Some(dir)) => Self::for_folder(dir),
            (None, None) => return Err("name a folder, or a file with --config".into()),
        };
        config.memory = args.memory.unwrap_or(config.memory);
        config.workers = args.workers.map_or(config.workers, usize::from);
        config.threads = args.threads.map_or(config.threads, usize::from);
        config.settle = args.settle.or(config.settle);
        let least = LEAST_MEMORY.saturating_mul(config.workers as u64);
        if config.memory < least {
            let (memory, least) = (show_size(config.memory), show_size(least));
            return Err(format!("{memory} of memory are too little for {} workers: they need {least} together", config.workers));
        }
        Ok(config)
    }

    /// For one hot folder, everything else by default.
    pub(crate) fn for_folder(dir: &Path) -> Self {
        let limits = suture_core::Limits::default();
        let folder = FolderConfig { name: name_of(dir), path: dir.to_owned(), profile: "default".into(), leave_originals: false };
        Self {
            state: default_state(dir),
            folders: vec![folder],
            workers: 2,
            threads: limits.threads,
            memory: limits.memory_bytes,
            large: LARGE,
            reserve: RESERVE,
            settle: None,
            rescan: None,
            drain: Duration::from_secs(60),
            time_limit: TimeLimit { base: Duration::from_secs(120), per_gib: Duration::from_secs(1200) },
            run_window: RunWindow::default(),
            workers_outside: 0,
            profiles: BTreeMap::new(),
        }
    }

    fn from_file(path: &Path) -> Result<Self, String> {
        let fail = |line: &str| format!("{}: {line}", path.display());
        let text = std::fs::read_to_string(path).map_err(|e| fail(&format!("cannot read the configuration: {e}")))?;
        let file: File = profiles::parse(&text).map_err(|e| fail(&e))?;
        let Some(first) = file.folders.first() else { return Err(fail("`folders` names no hot folder")) };
        let mut config = Self::for_folder(&first.path);
        config.folders.clear();
        for folder in file.folders {
            let name = folder.name.unwrap_or_else(|| name_of(&folder.path));
            if config.folders.iter().any(|other| other.name == name) {
                return Err(fail(&format!("two folders are called `{name}`; give each a `name` of its own")));
            }
            let profile = folder.profile.unwrap_or("default".into());
            config.folders.push(FolderConfig { name, path: folder.path, profile, leave_originals: folder.leave_originals });
        }
        config.state = file.state.unwrap_or(config.state);
        config.workers = file.workers.map_or(config.workers, usize::from);
        config.threads = file.threads.map_or(config.threads, usize::from);
        if config.workers == 0 || config.threads == 0 {
            return Err(fail("`workers` and `threads` must be at least 1"));
        }
        config.memory = file.memory.unwrap_or(config.memory);
        config.large = file.large.unwrap_or(config.large);
        config.reserve = file.reserve.unwrap_or(config.reserve);
        config.settle = file.settle;
        config.rescan = file.rescan;
        config.drain = file.drain.unwrap_or(config.drain);
        config.workers_outside = file.workers_outside.map_or(0, usize::from);
        if config.workers_outside > 0 && file.run_window.is_none() {
            return Err(fail("`workers_outside` says how many work outside of the hours of `run_window`, which is missing"));
        }
        config.run_window = file.run_window.unwrap_or_default();
        if let Some(limit) = file.time_limit {
            config.time_limit.base = limit.base.unwrap_or(config.time_limit.base);
            config.time_limit.per_gib = limit.per_gib.unwrap_or(config.time_limit.per_gib);
        }
        for (name, mut profile) in file.profiles {
            profile.validate().map_err(|e| fail(&format!("profile `{name}`: {e}")))?;
            profile.name.clone_from(&name);
            config.profiles.insert(name, profile);
        }
        apart(&config.folders).map_err(|line| fail(&line))?;
        if let Some(folder) = config.folders.iter().find(|folder| config.profile(&folder.profile).is_none()) {
            return Err(fail(&format!("folder `{}`: there is no profile `{}`", folder.name, folder.profile)));
        }
        Ok(config)
    }

    /// A profile of the configuration's, or a built-in one.
    pub(crate) fn profile(&self, name: &str) -> Option<Profile> {
        self.profiles.get(name).cloned().or_else(|| Profile::built_in(name))
    }
}

/// Where the job store of a hot folder is.
pub(crate) fn default_state(folder: &Path) -> PathBuf {
    folder.join(".suture").join("state")
}

/// Are these hot folders that do not lie in one another, whatever their paths are called? A folder that is made only later is told by its
/// path, through links and `..` as far as there is something.
fn apart(folders: &[FolderConfig]) -> Result<(), String> {
    let real: Vec<PathBuf> = folders.iter().map(|folder| real(&folder.path)).collect();
    for (i, a) in real.iter().enumerate() {
        for (j, b) in real.iter().enumerate().filter(|(j, _)| *j != i) {
            if let (true, Some(inner), Some(outer)) = (a.starts_with(b), folders.get(i), folders.get(j)) {
                let (shown, other) = (inner.path.display(), outer.path.display());
                return Err(if a == b {
                    format!("{shown} and {other} are the same folder")
                } else {
                    format!(
                        "{shown} lies in the hot folder {other}, which would take its files; hot folders lie beside each other"
                    )
                });
            }
        }
    }
    Ok(())
}

/// The path without links and detours, as far as there is something.
fn real(path: &Path) -> PathBuf {
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

fn name_of(dir: &Path) -> String {
    let full = std::path::absolute(dir).unwrap_or_else(|_| dir.to_owned());
    full.file_name().map_or_else(|| "folder".into(), |name| name.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(text: &str) -> Result<Config, String> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("suture.toml");
        std::fs::write(&path, text).unwrap();
        Config::from_file(&path)
    }

    #[test]
    fn a_configuration_with_everything() {
        let config = load(
            r#"
            workers = 3
            memory = "2GiB"
            settle = "300ms"
            rescan = 20
            [time_limit]
            base = "10s"
            [[folders]]
            path = "/srv/a"
            [[folders]]
            path = "/srv/b"
            profile = "resin"
            [profiles.resin]
            max_hole_edges = 9
            "#,
        )
        .unwrap();
        assert_eq!((config.workers, config.memory, config.folders.len()), (3, 2 << 30, 2));
        assert_eq!((config.settle, config.rescan), (Some(Duration::from_millis(300)), Some(Duration::from_secs(20))));
        assert_eq!(config.state, Path::new("/srv/a/.suture/state"));
        let resin = config.profile("resin").unwrap();
        assert_eq!((resin.name.as_str(), resin.max_hole_edges), ("resin", 9));
        assert_eq!(config.time_limit.of(1 << 30), Duration::from_secs(1210));
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        let error = load("workers = 2\nworkres = 3\nfolders = []").unwrap_err();
        assert!(error.contains("line 2") && error.contains("workres"), "{error}");
        assert!(load("folders = []").unwrap_err().contains("no hot folder"));
        assert!(load("folders = [{ path = \"/a\", profile = \"nope\" }]").unwrap_err().contains("nope"));
        assert!(load("folders = [{ path = \"/x/a\" }, { path = \"/y/a\" }]").unwrap_err().contains("two folders"));
        let error = load("folders = [{ path = \"/x\", name = \"a\" }, { path = \"/x/in/b\" }]").unwrap_err();
        assert!(error.contains("/x/in/b lies in the hot folder /x"), "{error}");
        let error = load("folders = [{ path = \"x\" }, { path = \"./y/../x\", name = \"b\" }]").unwrap_err();
        assert!(error.contains("are the same folder"), "{error}");
        assert!(load("memory = \"lots\"\nfolders = [{ path = \"/a\" }]").unwrap_err().contains("line 1"));
    }
}
