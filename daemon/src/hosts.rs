//! Daemons that share this one's store, and what waits for one that is not there: for pages, programs and metrics alike.

use suture_store::{Filter, Host, JobStore, Kind, Look, Role, StoreError, Time};

use crate::attempt::Context;
use crate::say::plain;
use crate::shared::{daemon_name, station};
use crate::units::{show_count, show_size};

/// Jobs that may be claimed.
const QUEUED: [Kind; 3] = [Kind::Queued, Kind::Waiting, Kind::Alone];
/// A job that no host takes is looked for among so many of a folder.
const LATEST: usize = 500;

/// All of them; of a store that no other can share, this one.
///
/// # Errors
/// Store errors only.
pub(crate) fn all(context: &Context) -> Result<Vec<Host>, StoreError> {
    Ok(or_this(context.store.hosts()?, context))
}

/// These; or this one, where there are none.
pub(crate) fn or_this(hosts: Vec<Host>, context: &Context) -> Vec<Host> {
    if !hosts.is_empty() {
        return hosts;
    }
    let config = context.settings.now();
    let folders: Vec<String> = context.folders.iter().map(|folder| folder.name.clone()).collect();
    vec![Host {
        daemon: daemon_name(&config.state),
        station: station(&config, folders.clone()),
        folders,
        began: Time(context.bus.life),
        seen: context.world.wall(),
        is_alive: true,
        is_draining: false,
        running: context.schedule.busy() as u64,
    }]
}

/// Where a host stands, in a word: also a label of metrics.
pub(crate) fn state(host: &Host) -> &'static str {
    match host {
        Host { is_alive: false, .. } => "silent",
        Host { is_draining: true, running: 0, .. } => "drained",
        Host { is_draining: true, .. } => "draining",
        _ => "alive",
    }
}

/// The words for where a host may stand.
pub(crate) const STATES: [&str; 4] = ["alive", "draining", "drained", "silent"];

/// A host in one line, for a terminal.
pub(crate) fn line(host: &Host) -> String {
    let station = &host.station;
    let (state, work) = (state(host), show_count(host.running));
    let version = if station.version.is_empty() { "an earlier version" } else { &station.version };
    let largest = station.largest.map(|largest| format!(", files up to {}", show_size(largest))).unwrap_or_default();
    let workers = if station.roles.has(Role::Worker) {
        format!("; {} workers, {} of memory{largest}", station.workers, show_size(station.memory))
    } else {
        String::new()
    };
    let keeps = keeps(host).map(|folders| format!("; looks for drops in {folders}")).unwrap_or_default();
    plain(&format!(
        "{}: {state}, {}, {work} in work{workers}{keeps}; {version}, process {}",
        host.daemon, station.roles, station.pid
    ))
}

/// The folders in which a host looks for drops, in words; `None`: in none.
pub(crate) fn keeps(host: &Host) -> Option<String> {
    let folders: Vec<&str> = host.kept().collect();
    (!folders.is_empty()).then(|| folders.join(", "))
}

/// These hot folders lack a host, in words: nobody looks for drops there, or jobs wait for a host that is not there.
///
/// # Errors
/// Store errors only.
pub(crate) fn stranded(store: &dyn JobStore, hosts: &[Host], folders: &[String]) -> Result<Vec<String>, StoreError> {
    let mut words: Vec<String> = folders.iter().filter_map(|folder| unkept(hosts, folder)).collect();
    let waits = |above: Option<u64>| {
        let size = (above.map_or(0, |most| most.saturating_add(1)), u64::MAX);
        let of = |alone| store.waiting(&Filter { size, alone });
        Ok::<_, StoreError>(of(false)?.is_some() || of(true)?.is_some())
    };
    for folder in folders {
        let serve = || hosts.iter().filter(|host| host.works() && host.folders.contains(folder));
        // Of any size, where one host takes any.
        let Some(most) = serve().map(|host| host.station.largest.unwrap_or(u64::MAX)).max() else {
            if waits(None)? && latest(store, folder, None)?.is_some() {
                words.push(format!("no host works on the folder `{folder}`: none with the role worker is alive and takes jobs"));
            }
            continue;
        };
        if most == u64::MAX || !waits(Some(most))? {
            continue;
        }
        if let Some((id, size)) = latest(store, folder, Some(most))? {
            let (size, most) = (show_size(size), show_size(most));
            words.push(format!(
                "job {id} waits for a host that takes files of {size}: those that work on the folder `{folder}` take up to {most}"
            ));
        }
    }
    Ok(words)
}

/// That nobody looks for drops in a folder, in words, if it is so.
fn unkept(hosts: &[Host], folder: &str) -> Option<String> {
    if hosts.iter().any(|host| host.is_alive && host.keeps(folder)) {
        return None;
    }
    let could =
        |host: &&Host| host.is_alive && host.station.roles.has(Role::Intake) && host.folders.iter().any(|name| name == folder);
    let why = match (hosts.iter().find(|host| host.keeps(folder)), hosts.iter().find(could)) {
        (Some(silent), Some(_)) => {
            format!("{} did, and gives no sign of life; another host does as soon as that process is gone", silent.daemon)
        }
        (Some(silent), None) => format!("{} did, and gives no sign of life, and no other host could", silent.daemon),
        (None, Some(could)) => format!("{} could, and has not begun", could.daemon),
        (None, None) => "none with the role intake is alive".to_owned(),
    };
    Some(format!("no host looks for drops in the folder `{folder}`: {why}"))
}

/// The latest job of a folder that waits, of more than so many bytes.
fn latest(store: &dyn JobStore, folder: &str, above: Option<u64>) -> Result<Option<(suture_store::JobId, u64)>, StoreError> {
    let look = Look { kinds: QUEUED.into(), folder: Some(folder.to_owned()), limit: LATEST, before: None };
    let jobs = store.page(&look)?.jobs;
    let found = jobs.iter().find(|job| above.is_none_or(|most| job.source.size > most));
    Ok(found.map(|job| (job.id, job.source.size)))
}

#[cfg(test)]
mod tests {
    use suture_store::testkit::dropped;
    use suture_store::{MemoryStore, Roles, Station};

    use super::*;

    fn host(daemon: &str, roles: &str, largest: Option<u64>) -> Host {
        let roles: Roles = roles.parse().unwrap();
        Host {
            daemon: daemon.into(),
            station: Station {
                roles,
                largest,
                workers: 2,
                memory: 1 << 30,
                version: "1.2.3".into(),
                pid: 7,
                host: "a".into(),
                keeps: vec!["hot".into()],
            },
            folders: vec!["hot".into()],
            began: Time(1),
            seen: Time(2),
            is_alive: true,
            is_draining: false,
            running: 1,
        }
    }

    /// A file that nobody takes is told of, with who could; what someone takes is not.
    #[test]
    fn what_no_host_takes_is_told() {
        let store = MemoryStore::default();
        let keeper = host("k:/s", "intake", None);
        let told = |hosts: &[Host]| stranded(&store, &[hosts, std::slice::from_ref(&keeper)].concat(), &["hot".into()]).unwrap();
        let (small, large) = (host("a:/s", "worker", Some(1000)), host("b:/s", "worker", None));
        assert_eq!(told(&[]), [""; 0], "nothing waits");
        store.submit(&[dropped("small.stl", 84).unwrap()]).unwrap();
        assert_eq!(told(std::slice::from_ref(&small)), [""; 0]);
        let shows = host("c:/s", "intake,control", None);
        let drained = Host { is_draining: true, ..large.clone() };
        let dead = Host { is_alive: false, ..large.clone() };
        assert!(told(&[shows.clone(), drained.clone(), dead])[0].starts_with("no host works on the folder `hot`"));
        store.submit(&[dropped("large.stl", 3000).unwrap()]).unwrap();
        let words = told(&[small.clone(), shows, drained]);
        assert_eq!(
            words,
            ["job 2 waits for a host that takes files of 3.0 KB: those that work on the folder `hot` take up to 1.0 KB"]
        );
        assert_eq!(told(&[small, large]), [""; 0]);
    }

    /// A folder in which nobody looks for drops is told of, with who did and who could.
    #[test]
    fn a_folder_that_nobody_keeps_is_told() {
        let store = MemoryStore::default();
        let told = |hosts: &[Host]| stranded(&store, hosts, &["hot".into()]).unwrap().join("; ");
        let keeper = host("a:/s", "intake", None);
        let silent = Host { is_alive: false, ..keeper.clone() };
        let visitor =
            Host { station: Station { keeps: Vec::new(), ..keeper.station.clone() }, daemon: "b:/s".into(), ..keeper.clone() };
        let worker = host("c:/s", "worker", None);
        assert_eq!(told(&[keeper.clone(), visitor.clone(), worker.clone()]), "");
        let words = "no host looks for drops in the folder `hot`: ";
        assert_eq!(told(&[worker]), format!("{words}none with the role intake is alive"));
        assert_eq!(told(std::slice::from_ref(&visitor)), format!("{words}b:/s could, and has not begun"));
        assert_eq!(
            told(std::slice::from_ref(&silent)),
            format!("{words}a:/s did, and gives no sign of life, and no other host could")
        );
        let waits = "a:/s did, and gives no sign of life; another host does as soon as that process is gone";
        assert_eq!(told(&[silent.clone(), visitor]), format!("{words}{waits}"));
        assert_eq!(told(&[silent, keeper]), "", "another one does");
    }

    #[test]
    fn a_host_is_a_line() {
        let told = line(&Host { is_draining: true, ..host("a:/s\u{1b}", "worker", Some(2 << 30)) });
        assert_eq!(
            told,
            "a:/s\\u{1b}: draining, worker, 1 in work; 2 workers, 1.1 GB of memory, files up to 2.1 GB; 1.2.3, process 7"
        );
        assert!(!line(&host("a:/s", "control", None)).contains("memory"));
        assert_eq!(
            line(&host("a:/s", "intake", None)),
            "a:/s: alive, intake, 1 in work; looks for drops in hot; 1.2.3, process 7"
        );
        assert_eq!(state(&Host { is_alive: false, ..host("a", "worker", None) }), "silent");
        assert_eq!(state(&Host { is_draining: true, running: 0, ..host("a", "worker", None) }), "drained");
    }
}
