//! The settings in force while the daemon runs. SIGHUP has its file read anew: all of it is checked, then it takes the place of what was in force,
//! or nothing does. Whoever works by them takes them once for a piece of work, which ends as it began.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::{Arc, PoisonError, RwLock};

use suture_store::Role;

use crate::bucket::address::BucketAddress;
use crate::cli::WatchArgs;
use crate::config::api::Api;
use crate::config::taken::OnTaken;
use crate::config::{BucketConfig, Config, FolderConfig, read, real, roles, share, show};
use crate::signals::Hangup;

/// The configuration in force, and where it comes from.
pub(crate) struct Settings {
    now: RwLock<Arc<Config>>,
    /// What was said on the command line; `None`: there is nothing to be read anew.
    args: Option<WatchArgs>,
    hangup: Hangup,
}

/// What came of reading the file anew.
#[derive(Debug, PartialEq)]
pub(crate) enum Reload {
    /// There is no file.
    NoFile,
    /// Another configuration is in force; each of its changes in words, none if it says the same.
    Done(Vec<String>),
    /// Nothing changed, for this reason.
    Refused(String),
}

impl Settings {
    /// Settings that stay as they are.
    pub(crate) fn fixed(config: Config) -> Self {
        Self { now: RwLock::new(Arc::new(config)), args: None, hangup: Hangup::default() }
    }

    /// The settings that a command line asks for, to be read anew after a `hangup`.
    ///
    /// # Errors
    /// A line for people.
    pub(crate) fn of(args: &WatchArgs, hangup: Hangup) -> Result<Self, String> {
        Ok(Self { args: Some(args.clone()), hangup, ..Self::fixed(from_args(args)?) })
    }

    /// As they are now.
    pub(crate) fn now(&self) -> Arc<Config> {
        Arc::clone(&self.now.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// Reads the file anew if that was asked for since the last call.
    pub(crate) fn renew(&self) -> Option<Reload> {
        self.hangup.came().then(|| self.read_anew())
    }

    fn read_anew(&self) -> Reload {
        let Some(args) = self.args.as_ref().filter(|args| args.config.is_some()) else { return Reload::NoFile };
        let new = match from_args(args) {
            Ok(new) => new,
            Err(reason) => return Reload::Refused(reason),
        };
        let old = self.now();
        let fixed = fixed(&old, &new);
        if !fixed.is_empty() {
            return Reload::Refused(format!("only a restart of the daemon changes {}", fixed.join(", ")));
        }
        let changes = changes(&old, &new);
        *self.now.write().unwrap_or_else(PoisonError::into_inner) = Arc::new(new);
        Reload::Done(changes)
    }
}

/// From the command line: a folder alone, or a configuration file; options on the command line count over the file's.
fn from_args(args: &WatchArgs) -> Result<Config, String> {
    let mut config = match (&args.config, &args.dir) {
        (Some(file), _) => read::from_file(file)?,
        (None, Some(dir)) if dir.to_str().and_then(BucketAddress::parse).is_some() => {
            return Err(format!(
                "{}: a folder in a bucket is served from a configuration that names a `state` folder, with --config",
                dir.display()
            ));
        }
        (None, Some(dir)) => Config::for_folder(dir),
        (None, None) => return Err("name a folder, or a file with --config".into()),
    };
    config.memory = args.memory.unwrap_or(config.memory);
    config.workers = args.workers.map_or(config.workers, usize::from);
    config.threads = args.threads.map_or(config.threads, usize::from);
    config.largest = args.largest.or(config.largest);
    config.settle = args.settle.or(config.settle);
    config.store = args.store.clone().or(config.store);
    config.roles = args.roles.unwrap_or(config.roles);
    config.check_memory()?;
    roles::check(&config)?;
    share::check(&config)?;
    if args.once && !config.roles.are_all() {
        return Err(format!(
            "--once waits for the end of all work, which a daemon with the roles {} leaves to others; leave it out",
            config.roles
        ));
    }
    if let Some(listen) = args.listen {
        if !config.roles.has(Role::Control) {
            return Err(format!("--listen is for the role control, and this daemon has {}; leave one of them out", config.roles));
        }
        let api = config.api.take().unwrap_or_else(|| Api::at(listen));
        config.api = Some(Api { listen, ..api });
    }
    config.api.as_ref().map_or(Ok(()), Api::check)?;
    roles::narrow(&mut config);
    Ok(config)
}

/// What differs and cannot change while the daemon runs: it holds the lock of each folder and of the store.
fn fixed(old: &Config, new: &Config) -> Vec<String> {
    let mut fixed = Vec::new();
    if real(&old.state) != real(&new.state) {
        fixed.push("`state`".to_owned());
    }
    if old.store != new.store {
        fixed.push("`store`".to_owned());
    }
    if old.roles != new.roles {
        fixed.push("`roles`".to_owned());
    }
    if old.api != new.api {
        fixed.push("`[api]`".to_owned());
    }
    let places = |config: &Config| -> BTreeMap<String, (PathBuf, Option<BucketConfig>, [bool; 2], OnTaken)> {
        let of = |folder: &FolderConfig| {
            (real(&folder.path), folder.bucket.clone(), [folder.is_shared, folder.leave_originals], folder.on_taken)
        };
        config.folders.iter().map(|folder| (folder.name.clone(), of(folder))).collect()
    };
    let (was, is) = (places(old), places(new));
    let names: BTreeSet<&String> = was.keys().chain(is.keys()).collect();
    let differ = names.into_iter().filter(|name| was.get(*name) != is.get(*name));
    fixed.extend(differ.map(|name| format!("the folder `{name}`")));
    fixed
}

/// Every other difference, in words.
fn changes(old: &Config, new: &Config) -> Vec<String> {
    let values = show::values(old).into_iter().zip(show::values(new)).filter(|(was, is)| was != is);
    let shown = |value: Option<String>| value.unwrap_or_else(|| "none".into());
    let mut changes: Vec<String> =
        values.map(|((name, was), (_, is))| format!("{name} {} -> {}", shown(was), shown(is))).collect();
    for folder in &new.folders {
        let was = old.folder_profile(&folder.name);
        if was != folder.profile {
            changes.push(format!("the profile of folder {} {was} -> {}", folder.name, folder.profile));
        }
        let was = old.folders.iter().find(|known| known.name == folder.name).map_or(folder.priority, |known| known.priority);
        if was != folder.priority {
            changes.push(format!("the priority of folder {} {was} -> {}", folder.name, folder.priority));
        }
        if old.folders.iter().any(|known| known.name == folder.name && known.share != folder.share) {
            changes.push(format!("the share of folder {}", folder.name));
        }
    }
    if old.events != new.events {
        changes.push("who hears of the ends of jobs".into());
    }
    let names: BTreeSet<&String> = old.profiles.keys().chain(new.profiles.keys()).collect();
    for name in names {
        match (old.profiles.get(name), new.profiles.get(name)) {
            (Some(_), None) => changes.push(format!("profile {name} removed")),
            (None, Some(_)) => changes.push(format!("profile {name} added")),
            (was, is) if was != is => changes.push(format!("profile {name} changed")),
            _ => {}
        }
    }
    changes
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::time::Duration;

    use clap::Parser;

    use super::*;
    use crate::cli::{Cli, Command};

    const FIRST: &str =
        "memory = \"1GiB\"\n[[folders]]\npath = \"/nowhere/a\"\nprofile = \"resin\"\n[profiles.resin]\nmax_hole_edges = 9\n";

    fn settings(file: &Path, options: &[&str]) -> Settings {
        let words = ["suture", "watch", "--config", file.to_str().unwrap()];
        let Command::Watch(args) = Cli::parse_from(words.iter().chain(options)).command else { panic!("it is `watch`") };
        Settings::of(&args, Hangup::default()).unwrap()
    }

    /// A file that is read first with [`FIRST`] in it, then with another text.
    fn reloaded(text: &str, options: &[&str]) -> (Reload, Arc<Config>, Arc<Config>) {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("suture.toml");
        std::fs::write(&file, FIRST).unwrap();
        let settings = settings(&file, options);
        let before = settings.now();
        std::fs::write(&file, text).unwrap();
        (settings.read_anew(), before, settings.now())
    }

    #[test]
    fn what_changed_is_in_force_and_told() {
        let text = FIRST.replace("1GiB", "2GiB").replace("= 9", "= 8").replace("\"resin\"", "\"thin\"");
        let text = text.replace("profile = \"thin\"", "profile = \"thin\"\npriority = 7");
        let text = format!("workers = 3\nsettle = \"1s\"\ndrain = 5\ntime_limit.base = \"1h\"\n{text}[profiles.thin]\n");
        let (reload, before, after) = reloaded(&text, &[]);
        let expected = [
            "memory \"1GiB\" -> \"2GiB\"",
            "workers 2 -> 3",
            "settle \"auto\" -> \"1s\"",
            "drain \"1m\" -> \"5s\"",
            "time_limit.base \"2m\" -> \"1h\"",
            "the profile of folder a resin -> thin",
            "the priority of folder a 5 -> 7",
            "profile resin changed",
            "profile thin added",
        ];
        assert_eq!(reload, Reload::Done(expected.map(String::from).to_vec()));
        assert_eq!((before.memory, after.memory, after.drain), (1 << 30, 2 << 30, Duration::from_secs(5)));
        assert_eq!([before, after].map(|config| config.profile("resin").unwrap().max_hole_edges), [9, 8]);
    }

    #[test]
    fn a_file_that_says_the_same_changes_nothing() {
        let (reload, before, after) = reloaded(&format!("# A word on it.\n{FIRST}"), &[]);
        assert_eq!((reload, before), (Reload::Done(Vec::new()), after));
    }

    /// What was said on the command line counts over the file's, also when that is read anew.
    #[test]
    fn options_stay_above_the_file() {
        let (reload, _, after) = reloaded(&format!("settle = \"9s\"\n{FIRST}").replace("1GiB", "2GiB"), &["--settle", "1s"]);
        assert_eq!(reload, Reload::Done(vec!["memory \"1GiB\" -> \"2GiB\"".into()]));
        assert_eq!(after.settle, Some(Duration::from_secs(1)));
    }

    #[test]
    fn f26_a_mistake_leaves_all_as_it_was() {
        for (text, words) in [
            (format!("memroy = 1\n{FIRST}"), "line 1, `memroy = 1`"),
            (FIRST.replace("[profiles.resin]", "[profiles.other]"), "there is no profile `resin`"),
            (FIRST.replace("= 9", "= -9"), "line 6"),
            (FIRST.replace("1GiB", "1MiB"), "too little for 2 workers"),
        ] {
            let (reload, before, after) = reloaded(&text, &[]);
            assert!(matches!(&reload, Reload::Refused(reason) if reason.contains(words)), "{words}: {reload:?}");
            assert!(Arc::ptr_eq(&before, &after));
        }
    }

    /// Nothing of it, not even what could change.
    #[test]
    fn f26_what_needs_a_restart_is_named_and_nothing_is_taken_over() {
        let first = FIRST.replace("1GiB", "2GiB");
        for (text, words) in [
            (format!("state = \"/nowhere/state\"\n{first}"), "changes `state`"),
            (format!("{first}[api]\nlisten = \"127.0.0.1:1\"\n"), "changes `[api]`"),
            (format!("{first}[[folders]]\npath = \"/nowhere/b\"\n"), "changes the folder `b`"),
            (first.replace("/nowhere/a", "/nowhere/c"), "changes `state`, the folder `a`, the folder `c`"),
            (first.replace("profile =", "name = \"d\"\nprofile ="), "changes the folder `a`, the folder `d`"),
        ] {
            let (reload, before, after) = reloaded(&text, &[]);
            assert!(matches!(&reload, Reload::Refused(reason) if reason.ends_with(words)), "{words}: {reload:?}");
            assert!(Arc::ptr_eq(&before, &after));
        }
        let (reload, ..) = reloaded(&FIRST.replace("/nowhere/a", "/nowhere/b/../a"), &[]);
        assert_eq!(reload, Reload::Done(Vec::new()), "it is the same folder");
    }

    /// The scratch of a folder is called the same, wherever its bucket is.
    #[test]
    fn another_bucket_needs_a_restart() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("suture.toml");
        let text = "state = \"/nowhere/state\"\n[[folders]]\npath = \"s3://prints/farm\"\n";
        std::fs::write(&file, text).unwrap();
        let settings = settings(&file, &[]);
        std::fs::write(&file, text.replace("prints", "other")).unwrap();
        let reload = settings.read_anew();
        assert!(matches!(&reload, Reload::Refused(reason) if reason.ends_with("changes the folder `farm`")), "{reload:?}");
    }

    #[test]
    fn without_a_file_there_is_nothing_to_read() {
        let Command::Watch(args) = Cli::parse_from(["suture", "watch", "/nowhere/a"]).command else { panic!("it is `watch`") };
        let settings = Settings::of(&args, Hangup::default()).unwrap();
        assert_eq!((settings.read_anew(), settings.renew()), (Reload::NoFile, None));
    }
}
