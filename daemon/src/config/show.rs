//! A configuration as text: every setting with its value, as a file that can be read back.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use serde::Serialize;
use toml::Value;

use super::api::Api;
use super::events::{Events, Occasion, OnDone, Webhook};
use super::keep::Keep;
use super::{AUTO, Config, FolderConfig};
use crate::own_profile::OwnProfile;
use crate::units::{write_duration, write_size};
use crate::window::RunWindow;

/// For whoever reads the text.
const HEAD: &str = "\
# Every setting, as it counts. \"auto\": by file system; settle 5s and rescan 60s, on network mounts 30s and 10s; with --once settle 300ms;
# check_one_in 1000 where the jobs are in a database that machines share, else 0.
";

/// Settings of one value, each with the value as it stands in a file; `None`: it stands in none. The same names for every configuration.
pub(crate) fn values(config: &Config) -> Vec<(&'static str, Option<String>)> {
    let auto = |time: Option<Duration>| quoted(&time.map_or_else(|| AUTO.into(), write_duration));
    // Without it, all hours are open, and none is outside.
    let hours = config.run_window != RunWindow::default();
    let always = [
        ("memory", quoted(&write_size(config.memory))),
        ("workers", config.workers.to_string()),
        ("threads", config.threads.to_string()),
        ("large", quoted(&write_size(config.large))),
        ("reserve", quoted(&write_size(config.reserve))),
        ("settle", auto(config.settle)),
        ("rescan", auto(config.rescan)),
        ("drain", quoted(&write_duration(config.drain))),
        ("reuse", config.reuse.to_string()),
        ("check_one_in", config.check_one_in.map_or_else(|| quoted(AUTO), |one_in| one_in.to_string())),
        ("night_ends", quoted(&config.night_ends.to_string())),
        ("time_limit.base", quoted(&write_duration(config.time_limit.base))),
        ("time_limit.per_gib", quoted(&write_duration(config.time_limit.per_gib))),
    ];
    let of_hours =
        [("run_window", quoted(&config.run_window.to_string())), ("workers_outside", config.workers_outside.to_string())];
    let of_hours = of_hours.map(|(name, value)| (name, hours.then_some(value)));
    let largest = ("largest", config.largest.map(|size| quoted(&write_size(size))));
    always
        .map(|(name, value)| (name, Some(value)))
        .into_iter()
        .chain([largest])
        .chain(of_hours)
        .chain(kept(&config.keep))
        .chain(web(config.api.as_ref()))
        .collect()
}

/// What goes by itself, as far as anything does.
fn kept(keep: &Keep) -> [(&'static str, Option<String>); 9] {
    let age = |time: Option<Duration>| time.map(|time| quoted(&write_duration(time)));
    let size = |bytes: Option<u64>| bytes.map(|bytes| quoted(&write_size(bytes)));
    [
        ("keep.results", age(keep.results.age)),
        ("keep.results_size", size(keep.results.size)),
        ("keep.reports", age(keep.reports.age)),
        ("keep.reports_size", size(keep.reports.size)),
        ("keep.originals", age(keep.originals.age)),
        ("keep.originals_size", size(keep.originals.size)),
        ("keep.archive", keep.archive.as_deref().map(path)),
        ("keep.history", age(keep.history)),
        ("keep.history_jobs", Some(keep.history_jobs.to_string())),
    ]
}

/// The web interface, if there is one.
fn web(api: Option<&Api>) -> [(&'static str, Option<String>); 4] {
    let hosts = |api: &Api| format!("[{}]", api.hosts.iter().map(|host| quoted(host)).collect::<Vec<_>>().join(", "));
    [
        ("api.listen", api.map(|api| quoted(&api.listen.to_string()))),
        ("api.token_file", api.and_then(|api| api.token_file.as_deref()).map(path)),
        ("api.hosts", api.map(hosts)),
        ("api.max_upload", api.map(|api| quoted(&write_size(api.max_upload)))),
    ]
}

/// Text as a value of a file.
fn quoted(text: &str) -> String {
    Value::String(text.into()).to_string()
}

fn path(path: &Path) -> String {
    quoted(&path.to_string_lossy())
}

/// The whole configuration.
///
/// # Errors
/// A line for people; none as yet.
pub(crate) fn text(config: &Config) -> Result<String, String> {
    let mut text = String::from(HEAD);
    for (name, value) in values(config).into_iter().filter_map(|(name, value)| Some((name, value?))) {
        text += &format!("{name} = {value}\n");
    }
    text += &format!("state = {}\n", path(&config.state));
    // Without the password: such a text is shown to people.
    text += &format!("roles = [{}]\n", config.roles.each().map(|role| quoted(role.name())).collect::<Vec<_>>().join(", "));
    text += &config.store.as_ref().map(|store| format!("store = {}\n", quoted(&store.to_string()))).unwrap_or_default();
    for FolderConfig { name, path: root, bucket, is_shared, profile, leave_originals, priority, share, on_taken } in
        &config.folders
    {
        text += &format!(
            "\n[[folders]]\npath = {}\nname = {}\nprofile = {}\n",
            bucket.as_ref().map_or_else(|| path(root), |bucket| quoted(&bucket.address.to_string())),
            quoted(name),
            quoted(profile)
        );
        text += &format!("leave_originals = {leave_originals}\npriority = {priority}\nshare = {}\n", share.weight);
        text += &share.most_running.map(|most| format!("most_running = {most}\n")).unwrap_or_default();
        text += &format!("on_taken = {}\n", quoted(on_taken.name()));
        text += &bucket.as_ref().map(|bucket| format!("cache = {}\n", quoted(&write_size(bucket.cache)))).unwrap_or_default();
        text += if *is_shared { "shared = true\n" } else { "" };
    }
    text += &told(&config.events);
    if !config.profiles.is_empty() {
        text.push('\n');
        text += &own_profiles(&config.profiles)?;
    }
    Ok(text)
}

/// Who hears of the ends of jobs.
pub(crate) fn told(events: &Events) -> String {
    let list = |words: &mut dyn Iterator<Item = &str>| format!("[{}]", words.map(quoted).collect::<Vec<_>>().join(", "));
    let mut text = String::new();
    for Webhook { name, url, secret_file, events } in &events.webhooks {
        text += &format!("\n[[webhook]]\nname = {}\nurl = {}\n", quoted(name), quoted(&url.to_string()));
        text += &secret_file.as_deref().map(|file| format!("secret_file = {}\n", path(file))).unwrap_or_default();
        text += &format!("events = {}\n", list(&mut events.iter().copied().map(Occasion::word)));
    }
    if let Some(OnDone { command, when, time_limit }) = &events.on_done {
        text += &format!("\n[on_done]\ncommand = {}\n", list(&mut command.iter().map(String::as_str)));
        text += &format!("when = {}\ntime_limit = {}\n", quoted(when.word()), quoted(&write_duration(*time_limit)));
    }
    text
}

/// Profiles with all of their settings. Their names are those of their tables.
fn own_profiles(profiles: &BTreeMap<String, OwnProfile>) -> Result<String, String> {
    #[derive(Serialize)]
    struct Shown {
        profiles: BTreeMap<String, OwnProfile>,
    }
    let mut shown = Shown { profiles: profiles.clone() };
    for own in shown.profiles.values_mut() {
        own.profile.name.clear();
    }
    let text = toml::to_string(&shown).map_err(|error| format!("the profiles cannot be written: {error}"))?;
    Ok(text.lines().filter(|line| *line != "name = \"\"").map(|line| format!("{line}\n")).collect())
}

#[cfg(test)]
mod tests {
    use suture_core::Profile;
    use suture_store::{Address, Priority, Share, Weight};

    use super::*;
    use crate::bucket::address::BucketAddress;
    use crate::config::BucketConfig;
    use crate::config::events::When;
    use crate::config::keep::Bound;
    use crate::config::read;
    use crate::config::taken::OnTaken;
    use crate::url::Url;

    fn read_back(config: &Config) -> Config {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("suture.toml");
        std::fs::write(&file, text(config).unwrap()).unwrap();
        read::whole(&file).unwrap()
    }

    #[test]
    fn the_defaults_are_read_back() {
        let config = Config::for_folder(Path::new("prints"));
        assert_eq!(read_back(&config), config);
        let text = text(&config).unwrap();
        for line in ["memory = \"1GiB\"", "settle = \"auto\"", "drain = \"1m\"", "state = \"prints/.suture/state\""] {
            assert!(text.lines().any(|there| there == line), "{line}: {text}");
        }
    }

    #[test]
    fn a_password_is_not_shown() {
        let config =
            Config { store: Address::parse("postgres://farm:secret@db/jobs").ok(), ..Config::for_folder(Path::new("a")) };
        let text = text(&config).unwrap();
        assert!(text.contains("store = \"postgres://farm@db/jobs\"\n") && !text.contains("secret"), "{text}");
    }

    #[test]
    fn a_folder_in_a_bucket_is_read_back() {
        let address = BucketAddress::parse("s3://prints/\"farm\"").unwrap().unwrap();
        let far = FolderConfig {
            bucket: Some(BucketConfig { address, cache: 3 << 20 }),
            path: "/srv/state/buckets/far".into(),
            ..FolderConfig::of(Path::new("far"))
        };
        let config = Config {
            folders: vec![far],
            state: "/srv/state".into(),
            store: Address::parse("postgres://farm@db/jobs").ok(),
            roles: "intake,control".parse().unwrap(),
            ..Config::for_folder(Path::new("far"))
        };
        assert_eq!(read_back(&config), config);
    }

    #[test]
    fn whatever_is_set_is_read_back() {
        let mut config = Config::for_folder(Path::new("a \"b\"/'c'\\d\t"));
        config.state = "/srv/state of 2".into();
        config.store = Address::parse("postgres://farm@db/jobs?sslmode=verify-full").ok();
        config.folders.push(FolderConfig {
            name: "scans & more".into(),
            path: "scans".into(),
            bucket: None,
            is_shared: true,
            profile: "it's mine".into(),
            leave_originals: true,
            priority: Priority::HIGHEST,
            share: Share { weight: Weight::try_from(40).unwrap(), most_running: std::num::NonZeroU32::new(3) },
            on_taken: OnTaken::Skip,
        });
        (config.run_window, config.workers_outside) = ("20:00-07:00, 12:00-13:00".parse().unwrap(), 1);
        config.night_ends = "06:30".parse().unwrap();
        (config.memory, config.large, config.reserve) = (3 << 30, 1_500_000_000, 1);
        (config.workers, config.threads, config.reuse) = (7, 3, false);
        config.check_one_in = Some(0);
        config.largest = Some(7 << 30);
        (config.settle, config.rescan) = (Some(Duration::from_millis(300)), Some(Duration::from_secs(90)));
        (config.drain, config.time_limit.base) = (Duration::ZERO, Duration::from_millis(1500));
        config.keep = Keep {
            results: Bound { age: Some(Duration::from_secs(90 * 24 * 3600)), size: Some(5 << 40) },
            reports: Bound { age: Some(Duration::from_secs(25 * 3600)), size: Some(1) },
            originals: Bound { age: Some(Duration::ZERO), size: None },
            archive: Some("/srv/the \"archive\"".into()),
            history: Some(Duration::from_secs(1)),
            history_jobs: 3,
        };
        config.api = Some(Api {
            token_file: Some("/etc/suture \"tokens\"".into()),
            hosts: vec!["farm".into(), "farm.example".into()],
            max_upload: 7 << 20,
            ..Api::at("0.0.0.0:80".parse().unwrap())
        });
        config.events.webhooks = ["http://farm/a?\"b\"", "http://[::1]:9000/"]
            .map(|url| Webhook {
                name: url.into(),
                url: Url::parse(url).unwrap(),
                secret_file: Some("/etc/a \"secret\"".into()),
                events: vec![Occasion::NeedsReview, Occasion::Night, Occasion::FolderAway, Occasion::FolderBack],
            })
            .to_vec();
        config.events.on_done = Some(OnDone {
            command: ["a \"program\"", "{output}.gcode", "-"].map(String::from).to_vec(),
            when: When::Always,
            time_limit: Duration::from_secs(90),
        });
        for name in ["it's mine", "resin", "default"] {
            let mut profile = Profile::built_in("strict").unwrap();
            profile.name = name.into();
            (profile.weld_relative, profile.max_hole_edges) = (1.25e-7, u32::MAX);
            let priority = (name == "resin").then_some(Priority::LOWEST);
            config.profiles.insert(name.into(), OwnProfile { profile, priority });
        }
        assert_eq!(read_back(&config), config);
    }
}
