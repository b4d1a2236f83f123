//! The configuration file. Unknown settings are errors, and every mistake is told with its line.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Deserializer, de};
use suture_core::Profile;
use suture_store::{Priority, Roles, Share, Weight};
use toml::Spanned;

use super::apart::apart;
use super::api::Api;
use super::events::{self, OnDoneFile, WebhookFile};
use super::keep::{Bound, Keep};
use super::sampling::OneIn;
use super::shared::StoreFile;
use super::taken::OnTaken;
use super::{AUTO, Config, DEFAULT_PROFILE, FolderConfig, bucket, name_of, real, roles, share};
use crate::own_profile::OwnProfile;
use crate::profiles::{self, place_of, with_line};
use crate::units::{parse_duration, parse_listen, parse_size};
use crate::window::{RunWindow, TimeOfDay};

/// As it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    /// Hot folders; the first one's `.suture/` holds the job store unless `state` says otherwise.
    #[serde(default)]
    folders: Vec<FolderFile>,
    state: Option<PathBuf>,
    store: Option<StoreFile>,
    roles: Option<Roles>,
    workers: Option<Count>,
    threads: Option<Count>,
    memory: Option<Size>,
    large: Option<Size>,
    largest: Option<Size>,
    reserve: Option<Size>,
    settle: Option<TimeOrAuto>,
    rescan: Option<TimeOrAuto>,
    drain: Option<Time>,
    time_limit: Option<TimeLimitFile>,
    run_window: Option<RunWindow>,
    workers_outside: Option<Spanned<u16>>,
    night_ends: Option<TimeOfDay>,
    reuse: Option<bool>,
    check_one_in: Option<OneIn>,
    keep: Option<Spanned<KeepFile>>,
    api: Option<Spanned<ApiFile>>,
    #[serde(default)]
    webhook: Vec<Spanned<WebhookFile>>,
    on_done: Option<OnDoneFile>,
    #[serde(default)]
    profiles: BTreeMap<String, Spanned<OwnProfile>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FolderFile {
    path: Spanned<PathBuf>,
    /// The name that jobs call it by; its last part unless given.
    name: Option<Spanned<String>>,
    /// Profile of files that lie in no sub-folder.
    profile: Option<Spanned<String>>,
    /// Originals are not moved out of `in/`.
    #[serde(default)]
    leave_originals: bool,
    /// How soon its files are wanted.
    #[serde(default)]
    priority: Priority,
    /// How often it has its turn beside other folders.
    #[serde(default)]
    share: Weight,
    /// Jobs of it in work at a time.
    most_running: Option<NonZeroU32>,
    /// For a result whose name is taken.
    #[serde(default)]
    on_taken: OnTaken,
    /// Of one in a bucket: bytes of drops that are kept on this machine.
    cache: Option<Size>,
    /// Daemons on other machines serve it, too.
    #[serde(default)]
    shared: bool,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct TimeLimitFile {
    base: Option<Time>,
    per_gib: Option<Time>,
}

/// Files have no bound unless it is said.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct KeepFile {
    results: Option<Time>,
    results_size: Option<Size>,
    reports: Option<Time>,
    reports_size: Option<Size>,
    originals: Option<Time>,
    originals_size: Option<Size>,
    archive: Option<PathBuf>,
    history: Option<Time>,
    history_jobs: Option<Count64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ApiFile {
    listen: Listen,
    token_file: Option<PathBuf>,
    #[serde(default)]
    hosts: Vec<String>,
    max_upload: Option<Size>,
}

/// An address to listen at.
#[derive(Debug)]
struct Listen(SocketAddr);

impl<'de> Deserialize<'de> for Listen {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        parse_listen(&String::deserialize(d)?).map(Self).map_err(de::Error::custom)
    }
}

/// A number, or text with a unit.
#[derive(Deserialize)]
#[serde(untagged, expecting = "a whole number, or text with a unit such as \"2GiB\" or \"5s\", is needed here")]
enum Quantity {
    Number(u64),
    Text(String),
}

impl Quantity {
    fn read<'de, D: Deserializer<'de>>(d: D) -> Result<String, D::Error> {
        Self::deserialize(d).map(|quantity| match quantity {
            Self::Number(n) => n.to_string(),
            Self::Text(text) => text,
        })
    }
}

/// How many, at least one.
#[derive(Debug)]
struct Count(usize);

impl<'de> Deserialize<'de> for Count {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        match u16::deserialize(d)? {
            0 => Err(de::Error::custom("must be at least 1")),
            count => Ok(Self(count.into())),
        }
    }
}

/// How many, at least one, of what there may be very many.
#[derive(Debug)]
struct Count64(u64);

impl<'de> Deserialize<'de> for Count64 {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        match u64::deserialize(d)? {
            0 => Err(de::Error::custom("must be at least 1")),
            count => Ok(Self(count)),
        }
    }
}

/// Bytes.
#[derive(Debug)]
struct Size(u64);

impl<'de> Deserialize<'de> for Size {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        parse_size(&Quantity::read(d)?).map(Self).map_err(de::Error::custom)
    }
}

#[derive(Debug)]
struct Time(Duration);

impl<'de> Deserialize<'de> for Time {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        parse_duration(&Quantity::read(d)?).map(Self).map_err(de::Error::custom)
    }
}

/// A time, or none: the daemon chooses it by the file system.
#[derive(Debug)]
struct TimeOrAuto(Option<Duration>);

impl<'de> Deserialize<'de> for TimeOrAuto {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        match Quantity::read(d)?.as_str() {
            AUTO => Ok(Self(None)),
            text => parse_duration(text).map(Some).map(Self).map_err(de::Error::custom),
        }
    }
}

/// Reads a configuration file.
///
/// # Errors
/// One line for people, with the file and the number of the line at fault.
pub(crate) fn from_file(path: &Path) -> Result<Config, String> {
    let wrong = |line: String| format!("{}: {line}", path.display());
    let text = std::fs::read_to_string(path).map_err(|e| wrong(format!("cannot read the configuration: {e}")))?;
    from_text(&text).map_err(wrong)
}

/// The same for one that is to be served as it stands: no option of the command line adds to its memory.
///
/// # Errors
/// As [`from_file`].
pub(crate) fn whole(path: &Path) -> Result<Config, String> {
    let config = from_file(path)?;
    let at = |settings: &'static [&'static str]| {
        move |what: String| {
            let text = std::fs::read_to_string(path).unwrap_or_default();
            // The one of these that is there; the latest, if several are.
            let at = settings.iter().map(|setting| place_of(&text, 0, setting)).max().unwrap_or(0);
            format!("{}: {}", path.display(), with_line(&text, at, &what))
        }
    };
    config.check_memory().map_err(at(&["memory", "workers"]))?;
    roles::check(&config).map_err(at(&["roles"]))?;
    share::check(&config).map_err(|what| format!("{}: {what}", path.display()))?;
    Ok(config)
}

fn from_text(text: &str) -> Result<Config, String> {
    let file: File = profiles::parse(text)?;
    let Some(first) = file.folders.first() else {
        return Err("`folders` names no hot folder; add `[[folders]]` with a line such as `path = \"prints\"`".into());
    };
    let mut config = Config::for_folder(first.path.get_ref());
    config.profiles = own_profiles(text, file.profiles)?;
    config.folders = folders(text, &file.folders, &config)?;
    for (folder, of_file) in config.folders.iter_mut().zip(&file.folders) {
        let placed = bucket::place(folder, of_file.cache.as_ref().map(|size| size.0), file.state.as_deref());
        let placed = placed.and_then(|()| share::place(folder, of_file.shared, file.state.as_deref()));
        placed.map_err(|what| with_line(text, of_file.path.span().start, &what))?;
    }
    config.state = file.state.unwrap_or(config.state);
    config.store = file.store.map(|store| store.0);
    config.roles = file.roles.unwrap_or_default();
    config.workers = file.workers.map_or(config.workers, |count| count.0);
    config.threads = file.threads.map_or(config.threads, |count| count.0);
    config.memory = file.memory.map_or(config.memory, |size| size.0);
    config.large = file.large.map_or(config.large, |size| size.0);
    config.largest = file.largest.map(|size| size.0);
    config.reserve = file.reserve.map_or(config.reserve, |size| size.0);
    config.settle = file.settle.and_then(|time| time.0);
    config.rescan = file.rescan.and_then(|time| time.0);
    config.drain = file.drain.map_or(config.drain, |time| time.0);
    if let (Some(outside), None) = (&file.workers_outside, &file.run_window) {
        let what = "says how many work outside of the hours of `run_window`, which is missing; add it, or leave this out";
        return Err(with_line(text, outside.span().start, what));
    }
    config.workers_outside = file.workers_outside.map_or(0, |count| count.into_inner().into());
    config.reuse = file.reuse.unwrap_or(config.reuse);
    config.check_one_in = file.check_one_in.and_then(|one_in| one_in.0);
    config.run_window = file.run_window.unwrap_or_default();
    config.night_ends = file.night_ends.unwrap_or(config.night_ends);
    if let Some(of_file) = file.keep {
        let at = of_file.span().start;
        config.keep = keep(text, of_file, &config.folders)?;
        bucket::check(&config).map_err(|what| with_line(text, at, &what))?;
    }
    config.api = file.api.map(|of_file| api(text, of_file)).transpose()?;
    config.events = events::read(text, file.webhook, file.on_done)?;
    if let Some(TimeLimitFile { base, per_gib }) = file.time_limit {
        config.time_limit.base = base.map_or(config.time_limit.base, |time| time.0);
        config.time_limit.per_gib = per_gib.map_or(config.time_limit.per_gib, |time| time.0);
    }
    Ok(config)
}

fn keep(text: &str, of_file: Spanned<KeepFile>, folders: &[FolderConfig]) -> Result<Keep, String> {
    let (from, of_file) = (of_file.span().start, of_file.into_inner());
    let bound = |age: Option<Time>, size: Option<Size>| Bound { age: age.map(|age| age.0), size: size.map(|size| size.0) };
    let keep = Keep {
        results: bound(of_file.results, of_file.results_size),
        reports: bound(of_file.reports, of_file.reports_size),
        originals: bound(of_file.originals, of_file.originals_size),
        archive: of_file.archive,
        history: of_file.history.map(|time| time.0),
        history_jobs: of_file.history_jobs.map_or(Keep::default().history_jobs, |count| count.0),
    };
    let wrong = |setting, what: &str| Err(with_line(text, place_of(text, from, setting), what));
    match &keep.archive {
        None if !keep.originals.is_open() => wrong(
            "originals",
            "an original is never deleted, only moved to an archive; add `archive = \"/path\"`, or leave this out",
        ),
        Some(archive) => {
            let archive = real(archive);
            let near = |folder: &&FolderConfig| {
                let root = real(&folder.path);
                archive.starts_with(&root) || root.starts_with(&archive)
            };
            match folders.iter().find(near) {
                Some(folder) => wrong(
                    "archive",
                    &format!("it must lie beside the hot folder {}, not in it or around it", folder.path.display()),
                ),
                None => Ok(keep),
            }
        }
        None => Ok(keep),
    }
}

fn api(text: &str, of_file: Spanned<ApiFile>) -> Result<Api, String> {
    let (from, of_file) = (of_file.span().start, of_file.into_inner());
    let mut api = Api { token_file: of_file.token_file, hosts: of_file.hosts, ..Api::at(of_file.listen.0) };
    api.max_upload = of_file.max_upload.map_or(api.max_upload, |size| size.0);
    api.check().map_err(|what| with_line(text, place_of(text, from, "listen"), &what))?;
    Ok(api)
}

fn own_profiles(text: &str, of_file: BTreeMap<String, Spanned<OwnProfile>>) -> Result<BTreeMap<String, OwnProfile>, String> {
    let mut all = BTreeMap::new();
    for (name, own) in of_file {
        let from = own.span().start;
        let mut own = own.into_inner();
        profiles::validate(&own.profile, text, from)?;
        own.profile.name.clone_from(&name);
        all.insert(name, own);
    }
    Ok(all)
}

/// `config` knows the profiles.
fn folders(text: &str, of_file: &[FolderFile], config: &Config) -> Result<Vec<FolderConfig>, String> {
    let mut folders: Vec<FolderConfig> = Vec::new();
    for folder in of_file {
        let path = folder.path.get_ref();
        let name = folder.name.as_ref().map_or_else(|| name_of(path), |name| name.get_ref().clone());
        if folders.iter().any(|other| other.name == name) {
            let at = folder.name.as_ref().map_or(folder.path.span(), Spanned::span).start;
            return Err(with_line(text, at, &format!("two folders are called `{name}`; give each a `name` of its own")));
        }
        let profile = folder.profile.as_ref().map_or(DEFAULT_PROFILE, |profile| profile.get_ref().as_str());
        if let (None, Some(named)) = (config.profile(profile), &folder.profile) {
            let known: Vec<&str> = config.profiles.keys().map(String::as_str).chain(Profile::BUILT_IN).collect();
            let what =
                format!("there is no profile `{profile}`; name one of {}, or add `[profiles.{profile}]`", known.join(", "));
            return Err(with_line(text, named.span().start, &what));
        }
        let (leave_originals, priority, on_taken) = (folder.leave_originals, folder.priority, folder.on_taken);
        let (profile, share) = (profile.to_owned(), Share { weight: folder.share, most_running: folder.most_running });
        folders.push(FolderConfig { name, profile, leave_originals, priority, share, on_taken, ..FolderConfig::of(path) });
    }
    apart(&folders).map_err(|(folder, what)| {
        let at = of_file.get(folder).map_or(0, |folder| folder.path.span().start);
        with_line(text, at, &what)
    })?;
    Ok(folders)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_configuration_with_everything() {
        let config = from_text(
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
        assert_eq!([config.folder_profile("a"), config.folder_profile("b")], ["default", "resin"]);
        let resin = config.profile("resin").unwrap();
        assert_eq!((resin.name.as_str(), resin.max_hole_edges), ("resin", 9));
        assert_eq!(config.time_limit.of(1 << 30), Duration::from_secs(1210));
    }

    /// Each mistake on its own: words for it, which begin with the line, and say what to do.
    #[test]
    fn mistakes_are_named_with_their_line() {
        let mistakes = [
            (
                "workers = 2\nworkres = 3\nfolders = []",
                "line 2, `workres = 3`: unknown field `workres`, expected one of `folders`",
            ),
            ("workers = 2\nworkers = 3", "line 2, `workers = 3`: duplicate key"),
            ("memory = 2GiB", "line 1, `memory = 2GiB`: "),
            ("memory = \"lots\"\nfolders = [{ path = \"/a\" }]", "line 1, `memory = \"lots\"`: `lots` is not a size (try 512MiB"),
            ("\nlarge = true", "line 2, `large = true`: a whole number, or text with a unit"),
            ("settle = \"soon\"", "line 1, `settle = \"soon\"`: `soon` is not a duration (try 5s"),
            ("threads = 2\nworkers = 0", "line 2, `workers = 0`: must be at least 1"),
            ("night_ends = \"7\"", "line 1, `night_ends = \"7\"`: `7` is no time of day; write it as in \"07:00\""),
            ("[[folders]]\npaht = \"/a\"", "line 2, `paht = \"/a\"`: unknown field `paht`, expected one of `path`"),
            ("[[folders]]\nname = \"a\"", "line 1, `[[folders]]`: missing field `path`"),
            (
                "[[folders]]\npath = \"/a\"\nprofile = \"nope\"",
                "line 3, `profile = \"nope\"`: there is no profile `nope`; name one of default, fast",
            ),
            (
                "[[folders]]\npath = \"/x/a\"\n[[folders]]\npath = \"/y/a\"",
                "line 4, `path = \"/y/a\"`: two folders are called `a`; give each a `name`",
            ),
            (
                "[[folders]]\npath = \"/x\"\nname = \"a\"\n[[folders]]\npath = \"/x/in/b\"",
                "line 5, `path = \"/x/in/b\"`: /x/in/b lies in the hot folder /x",
            ),
            (
                "folders = [{ path = \"x\" },\n{ path = \"./y/../x\", name = \"b\" }]",
                "line 1, `folders = [{ path = \"x\" },`: x and ./y/../x are the same folder",
            ),
            (
                "[[folders]]\npath = \"/a\"\n[profiles.resin]\nfill_holes = true\nweld_relative = 7.0",
                "line 5, `weld_relative = 7.0`: `weld_relative` must be a number from 0 to 1, not 7",
            ),
            (
                "[[folders]]\npath = \"/a\"\n[profiles.resin]\nfill_holse = true",
                "line 4, `fill_holse = true`: unknown field `fill_holse`",
            ),
        ];
        assert_named(&mistakes);
        for text in ["", "folders = []"] {
            assert!(from_text(text).unwrap_err().contains("no hot folder; add"));
        }
    }

    fn assert_named(mistakes: &[(&str, &str)]) {
        for (text, words) in mistakes {
            let error = from_text(text).unwrap_err();
            assert!(error.starts_with(words), "{words}: {error}");
        }
    }

    #[test]
    fn mistakes_of_priorities_and_of_what_goes_by_itself_are_named_too() {
        assert_named(&[
            (
                "[[folders]]\npriority = 12\npath = \"/a\"",
                "line 2, `priority = 12`: a priority is a whole number from 0 to 9, the higher the sooner, not 12",
            ),
            (
                "[[folders]]\npath = \"/a\"\n[profiles.resin]\nfill_holes = true\npriority = -2",
                "line 5, `priority = -2`: a priority is a whole number",
            ),
            (
                "[[folders]]\npath = \"/a\"\n[keep]\nresults = \"1d\"\noriginals = \"2d\"",
                "line 5, `originals = \"2d\"`: an original is never deleted, only moved to an archive; add",
            ),
            (
                "keep.archive = \"/a/done/x\"\n[[folders]]\npath = \"/a\"",
                "line 1, `keep.archive = \"/a/done/x\"`: it must lie beside the hot folder /a",
            ),
            (
                "[[folders]]\npath = \"/a\"\n[api]\nhosts = []\nlisten = \"0.0.0.0:80\"",
                "line 5, `listen = \"0.0.0.0:80\"`: everyone in the network reaches 0.0.0.0:80, so it needs tokens",
            ),
            ("[[folders]]\npath = \"/a\"\n[api]\nlisten = \"here\"", "line 4, `listen = \"here\"`: `here` is no address"),
            ("[[folders]]\npath = \"/a\"\nshare = 0", "line 3, `share = 0`: a share is a whole number from 1 to 100, not 0"),
            ("[[folders]]\npath = \"/a\"\n[keep]\nhistory_jobs = 0", "line 4, `history_jobs = 0`: must be at least 1"),
        ]);
    }

    #[test]
    fn too_little_memory_is_named_with_the_line_that_says_so() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("suture.toml");
        for (settings, words) in [
            ("threads = 1\nmemory = \"5MiB\"", "line 2, `memory = \"5MiB\"`: 5.2 MB of memory are too little for 2 workers"),
            ("workers = 400", "line 1, `workers = 400`: "),
        ] {
            std::fs::write(&path, format!("{settings}\n[[folders]]\npath = \"a\"\n")).unwrap();
            from_file(&path).expect("an option may add to it");
            let error = whole(&path).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
    }
}
