//! Daemons that serve folders together: what each tells of itself, who tells of ends, and who is drained.

use super::farm::{files, finish};
use super::*;
use crate::job::Kind;
use crate::role::Role;
use crate::testkit::ManualClock;

/// A daemon of that name on a host of its own, with these roles, that serves these folders with others.
fn daemon(shared: &Shared, name: &str, roles: &str, folders: &[&str]) -> Shared {
    let folders: Vec<String> = folders.iter().map(|folder| (*folder).to_owned()).collect();
    let station = Station {
        host: format!("host-{name}"),
        pid: 7,
        version: "1.2.3".into(),
        roles: roles.parse().unwrap(),
        workers: 3,
        memory: 1 << 30,
        largest: (name == "small").then_some(1000),
        keeps: Vec::new(),
    };
    Shared { joint: folders.iter().cloned().collect(), folders: Some(folders), station, ..other(shared, name) }
}

fn claim(store: &PostgresStore) -> Option<Claim> {
    store.claim(&Filter::default()).unwrap()
}

#[test]
fn each_tells_what_it_is() {
    let Some(server) = server() else { return };
    let shared = server.schema("");
    let small = daemon(&shared, "small", "worker", &["hot"]);
    let [worker, _shows] =
        [&small, &daemon(&shared, "shows", "intake,control", &["hot"])].map(|one| PostgresStore::open(one).unwrap());
    worker.submit(&files(2)).unwrap();
    claim(&worker).unwrap();
    let told = |store: &PostgresStore| {
        let of = |host: Host| (host.daemon, host.station, host.folders, host.is_alive, host.is_draining, host.running);
        store.hosts().unwrap().into_iter().map(of).collect::<Vec<_>>()
    };
    let hosts = told(&worker);
    let shows = daemon(&shared, "shows", "intake,control", &["hot"]).station;
    assert_eq!(
        hosts,
        [
            ("shows".into(), shows, vec!["hot".to_owned()], true, false, 0),
            ("small".into(), small.station.clone(), vec!["hot".into()], true, false, 1)
        ]
    );
    assert_eq!(told(&PostgresStore::visit(&shared).unwrap()), hosts, "who only looks is no host");
    // A change is told at once.
    let anew = Station { workers: 9, keeps: vec!["hot".into()], ..small.station };
    worker.announce(&anew);
    assert!(worker.hosts().unwrap().iter().any(|host| host.station == anew));
    drop(worker);
    assert_eq!(told(&_shows).len(), 1, "one that ended is none");
}

/// It holds what it has, and gets nothing more, whoever asks, until that is over: also in its next life.
#[test]
fn a_drained_host_claims_nothing() {
    let Some(server) = server() else { return };
    let clock = Arc::new(ManualClock::new(Time(1_000_000)));
    let open = |shared: &Shared| PostgresStore::open_at(shared, Arc::clone(&clock) as Arc<dyn Clock>).unwrap();
    let shared = server.schema("");
    let [one, two] = ["one", "two"].map(|name| daemon(&shared, name, "worker", &["hot"]));
    let (first, second) = (open(&one), open(&two));
    first.submit(&files(6)).unwrap();
    let held = claim(&first).unwrap();
    assert!(!second.drain("nobody", true).unwrap());
    assert!(second.drain("host-one", true).unwrap());
    assert_eq!((claim(&first), first.is_draining().unwrap(), second.is_draining().unwrap()), (None, true, false));
    finish(&first, &held).unwrap();
    let lost = claim(&second).unwrap();
    drop(first);
    let first = open(&one);
    assert_eq!(claim(&first), None, "in its next life");
    // Nor what another one has lost.
    second.end_without_a_word();
    clock.pass(u64::try_from(shared.lease.as_millis()).unwrap());
    assert_eq!(claim(&first), None);
    let second = open(&two);
    assert!(first.drain("two", true).unwrap() && first.drain("host-one", false).unwrap());
    assert_eq!(claim(&second), None, "by the daemon's name");
    assert_eq!(first.get(lost.id).unwrap().unwrap().kind(), Kind::Running);
    assert!(claim(&first).is_some());
    // Of a host those too that were named one by one.
    assert!(first.drain("host-two", false).unwrap() && claim(&second).is_some());
}

/// Of two that show the same folders one tells, and the other goes on where it was when it is gone.
#[test]
fn one_of_those_who_may_tell_does() {
    let Some(server) = server() else { return };
    let clock = Arc::new(ManualClock::new(Time(1_000_000)));
    let open = |shared: &Shared| PostgresStore::open_at(shared, Arc::clone(&clock) as Arc<dyn Clock>);
    let shared = server.schema("");
    let [one, two] = ["one", "two"].map(|name| daemon(&shared, name, "control", &["hot", "cold"]));
    let worker = open(&daemon(&shared, "worker", "worker", &["hot"])).unwrap();
    let (first, second) = (open(&one).unwrap(), open(&two).unwrap());
    for store in [&first, &second] {
        store.subscribe(&["farm".into()]).unwrap();
    }
    worker.submit(&files(3)).unwrap();
    for _ in 0..3 {
        finish(&worker, &claim(&worker).unwrap()).unwrap();
    }
    let heard: Vec<_> = first.notices("farm", 9).unwrap().iter().map(Notice::seq).collect();
    assert_eq!((heard.len(), second.notices("farm", 9).unwrap().len()), (3, 0));
    first.acknowledge("farm", heard[0]).unwrap();
    assert_eq!(second.backlog("farm").unwrap(), 2);
    // Nights are told by both as by one.
    assert!(first.tell(&News::Night { since: Time(1), until: Time(9), jobs: BTreeMap::new() }).unwrap());
    assert!(!second.tell(&News::Night { since: Time(1), until: Time(9), jobs: BTreeMap::new() }).unwrap());
    first.end_without_a_word();
    assert_eq!(second.notices("farm", 9).unwrap(), [], "it may live");
    clock.pass(u64::try_from(shared.lease.as_millis()).unwrap());
    let again = open(&two).unwrap();
    let told: Vec<_> = again.notices("farm", 9).unwrap().iter().map(Notice::seq).collect();
    assert_eq!((told.len(), &told[..2]), (3, &heard[1..]), "and the night");
    let _second = second;
}

/// Whoever shows other folders beside would tell twice; a folder on a machine is that machine's; all others go together.
#[test]
fn daemons_that_do_not_go_together_are_refused() {
    let Some(server) = server() else { return };
    let shared = server.schema("");
    let shows = PostgresStore::open(&daemon(&shared, "shows", "control,intake", &["hot", "cold"])).unwrap();
    let worker = PostgresStore::open(&daemon(&shared, "worker", "worker", &["cold", "other"])).unwrap();
    let same = PostgresStore::open(&daemon(&shared, "same", "intake,worker,control", &["cold", "hot"])).unwrap();
    let told = |error: Option<StoreError>| error.map(|error| (error.to_string(), error.exit_code())).unwrap_or_default();
    let (line, code) = told(PostgresStore::open(&daemon(&shared, "more", "control", &["hot"])).err());
    assert!(line.contains("of the folder `hot` are told by another daemon, shows,") && code == 73, "{line}");
    let near = Shared { joint: BTreeSet::new(), ..daemon(&shared, "near", "intake,worker,control", &["other"]) };
    let (line, code) = told(PostgresStore::open(&near).err());
    assert!(line.contains("`other` is served by another daemon already, worker,") && code == 73, "{line}");
    drop((shows, worker, same));
    let _near = PostgresStore::open(&near).unwrap();
    let (line, _) = told(PostgresStore::open(&daemon(&shared, "late", "worker", &["other"])).err());
    assert!(line.contains("`other` is served by another daemon already, near,"), "{line}");
}

/// A daemon of one machine becomes one of a farm, and serves more folders later: what was not told yet is told once, and nothing waits for who it was.
#[test]
fn whoever_tells_next_tells_what_is_left() {
    let Some(server) = server() else { return };
    let shared = server.schema("");
    let farm = daemon(&shared, "one", "intake,worker,control", &["hot"]);
    let alone = Shared { joint: BTreeSet::new(), ..farm.clone() };
    let store = PostgresStore::open(&alone).unwrap();
    store.subscribe(&["farm".into()]).unwrap();
    store.submit(&files(2)).unwrap();
    for _ in 0..2 {
        finish(&store, &claim(&store).unwrap()).unwrap();
    }
    let left = store.notices("farm", 9).unwrap();
    store.acknowledge("farm", left[0].seq()).unwrap();
    drop(store);
    // A worker of the farm is no one who tells, and keeps no one from it who does.
    let _worker = PostgresStore::open(&daemon(&shared, "one", "worker", &["hot"])).unwrap();
    for then in [
        daemon(&shared, "second", "control", &["hot"]),
        farm.clone(),
        daemon(&shared, "one", "control", &["hot", "cold"]),
        daemon(&shared, "other", "control", &["new", "cold", "hot"]),
    ] {
        let store = PostgresStore::open(&then).unwrap();
        store.subscribe(&["farm".into()]).unwrap();
        assert_eq!(store.notices("farm", 9).unwrap(), left[1..], "{:?}", then.folders);
        sql(&shared, "DO $$ BEGIN ASSERT (SELECT count(*) FROM subscribers) = 1; END $$").unwrap();
    }
}

/// As one that has the part of whoever shows, it must be among them.
#[test]
fn only_who_shows_tells() {
    let (shows, works) = (Role::Control, Role::Worker);
    let shared = Shared::new("postgres://nowhere.invalid/x", "");
    let teller = |roles: &str, folders: &[&str]| daemon(&shared, "one", roles, folders).teller();
    assert!(teller(shows.name(), &["hot"]).starts_with("joint:"));
    assert_eq!(teller(shows.name(), &["hot", "cold"]), teller("intake,control", &["cold", "hot"]));
    assert_ne!(teller(shows.name(), &["ab", "c"]), teller(shows.name(), &["a", "bc"]));
    assert_eq!(teller(works.name(), &["hot"]), "one");
    assert_eq!(Shared { joint: BTreeSet::new(), ..daemon(&shared, "one", shows.name(), &["hot"]) }.teller(), "one");
}
