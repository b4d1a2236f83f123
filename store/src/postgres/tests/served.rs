//! Daemons that serve folders of their own on one database.

use std::sync::mpsc::channel;
use std::time::Duration;

use super::*;
use crate::job::Ending;
use crate::store::Query;
use crate::testkit::{ManualClock, dropped, result_of};

/// A daemon of that name that serves the folder of its name.
fn daemon(shared: &Shared, name: &str) -> Shared {
    Shared { folders: Some(vec![name.to_owned()]), ..other(shared, name) }
}

fn file(folder: &str, name: &str) -> Submission {
    let mut found = dropped(name, 84).unwrap();
    found.source.folder = folder.to_owned();
    found
}

/// What one serves is nothing to the other: not to be claimed, counted, listed, told, or taken back.
#[test]
fn each_knows_the_jobs_of_its_folders_alone() {
    let Some(server) = server() else { return };
    let shared = server.schema("");
    let stores = ["one", "two"].map(|name| PostgresStore::open(&daemon(&shared, name)).unwrap());
    let [one, two] = &stores;
    stores.iter().for_each(|store| store.subscribe(&["farm".into()]).unwrap());
    one.submit(&[file("one", "a.stl")]).unwrap();
    two.submit(&[file("two", "b.stl"), file("two", "c.stl")]).unwrap();
    for (store, count) in [(one, 1), (two, 2)] {
        let waits = store.waiting(&Filter::default()).unwrap().is_some();
        let counted: u64 = store.counts().unwrap().iter().map(|(_, count)| count).sum();
        let listed = store.list(&Query::default()).unwrap().len();
        let shown = store.page(&Look { limit: 9, ..Look::default() }).unwrap().jobs.len();
        assert_eq!((waits, counted, listed, shown), (true, count, listed, usize::try_from(count).unwrap()));
    }
    let claim = one.claim(&Filter::default()).unwrap().unwrap();
    assert_eq!((claim.job.source.folder.as_str(), one.claim(&Filter::default()).unwrap()), ("one", None));
    assert_eq!(one.waiting(&Filter::default()).unwrap(), None);
    for step in [Step::Intend(result_of(&claim.job, Ending::Clean)), Step::Placed, Step::Finished] {
        one.advance(&claim, step).unwrap();
    }
    // Each tells of its own, and what no one is left to tell of goes.
    assert_eq!((one.notices("farm", 9).unwrap().len(), two.notices("farm", 9).unwrap().len()), (1, 0));
    assert_eq!((one.backlog("farm").unwrap(), two.backlog("farm").unwrap()), (1, 0));
    let heard = one.notices("farm", 9).unwrap()[0].seq();
    one.acknowledge("farm", heard).unwrap();
    sql(&shared, "DO $$ BEGIN ASSERT (SELECT count(*) FROM outbox) = 0; END $$").unwrap();
    // The subscribers of one are not those of the other; nor are nights, nor whether receipts were read.
    one.subscribe(&[]).unwrap();
    one.set_filled().unwrap();
    one.begin_night(Time(7)).unwrap();
    assert_eq!((one.is_unfilled().unwrap(), two.is_unfilled().unwrap()), (false, true));
    assert_eq!((one.last_night().unwrap(), two.last_night().unwrap()), (Some(Time(7)), None));
    let all = PostgresStore::visit(&shared).unwrap();
    assert_eq!(all.list(&Query::default()).unwrap().len(), 3);
    assert!(all.claim(&Filter::default()).is_err(), "who only looks takes nothing");
}

/// Two that live never serve folders of one name; one that ended, or gave no sign for a lease, is in no one's way.
#[test]
fn a_folder_has_one_daemon_at_a_time() {
    let Some(server) = server() else { return };
    let clock = Arc::new(ManualClock::new(Time(1_000_000)));
    let open = |shared: &Shared| PostgresStore::open_at(shared, Arc::clone(&clock) as Arc<dyn Clock>);
    let shared = server.schema("");
    let first = Shared { folders: Some(vec!["a".into(), "b".into()]), ..other(&shared, "first") };
    let second = Shared { folders: Some(vec!["b".into(), "c".into()]), ..other(&shared, "second") };
    let living = open(&first).unwrap();
    let refused = open(&second).err().unwrap();
    assert!(matches!(&refused, StoreError::Served { folder, by } if folder == "b" && by == "first"), "{refused}");
    assert_eq!(refused.exit_code(), 73);
    // Under its own name it begins anew.
    let again = open(&first).unwrap();
    drop((living, again));
    let ended = open(&second).unwrap();
    ended.end_without_a_word();
    assert!(matches!(open(&first), Err(StoreError::Served { .. })), "it may live");
    clock.pass(u64::try_from(shared.lease.as_millis()).unwrap());
    open(&first).unwrap();
}

/// Whoever waits hears of what others bring, and of nothing that he does himself with a claim.
#[test]
fn idle_daemons_are_woken() {
    let Some(server) = server() else { return };
    let shared = server.schema("");
    let [idle, busy] = ["one", "two"].map(|name| PostgresStore::open(&other(&shared, name)).unwrap());
    let (tell, told) = channel();
    idle.hear(Arc::new(move || _ = tell.send(Instant::now())));
    let soon = || told.recv_timeout(Duration::from_secs(20));
    soon().expect("it listens");
    let began = Instant::now();
    busy.submit(&[file("hot", "a.stl")]).unwrap();
    let heard = soon().expect("a submission is heard of");
    eprintln!("heard of a submission after {:?}", heard.duration_since(began));
    let claim = busy.claim(&Filter::default()).unwrap().unwrap();
    busy.advance(&claim, Step::Environment { reason: "full".into() }).unwrap();
    assert!(told.recv_timeout(Duration::from_millis(300)).is_err(), "a step of a holder wakes no one");
    busy.control(claim.id, Control::Hasten).unwrap();
    soon().expect("an operator is heard of");
}

/// Who is told may wait for someone who waits for the database.
#[test]
fn words_keep_no_call_from_its_answer() {
    let Some(server) = server() else { return };
    let store = PostgresStore::open(&server.schema("one")).unwrap();
    let busy = Arc::new(Mutex::new(()));
    let waits = Arc::clone(&busy);
    let (tell, told) = channel();
    let held = busy.lock().unwrap();
    store.hear(Arc::new(move || {
        _ = tell.send(());
        drop(waits.lock().unwrap());
    }));
    told.recv_timeout(Duration::from_secs(20)).expect("it listens");
    store.counts().expect("an answer");
    drop(held);
}

/// Where the database is, everyone is told; what its password is, no one.
#[test]
fn an_outage_is_known_to_all_and_over_with_the_first_answer() {
    let Some(server) = Server::start() else { return };
    let shared = Shared { url: server.url().replace("owner@", "owner:secret@"), ..server.schema("daemon") };
    let store = PostgresStore::open(&shared).unwrap();
    assert_eq!(store.away(), None);
    server.kill();
    let began = Instant::now();
    while store.away().is_none() {
        assert!(began.elapsed() < Duration::from_secs(20));
        assert!(brief(|| store.counts()).is_err());
    }
    // It is certain now, so that no one in a hurry waits; and patience is for the others.
    let asked = Instant::now();
    let error = brief(|| store.counts()).unwrap_err();
    assert!(asked.elapsed() < Duration::from_secs(2), "{:?}", asked.elapsed());
    assert!(matches!(error, StoreError::Away { .. }) && !error.to_string().contains("secret"), "{error}");
    std::thread::scope(|scope| {
        let patient = scope.spawn(|| store.counts());
        std::thread::sleep(Duration::from_millis(200));
        assert!(!patient.is_finished());
        server.run();
        patient.join().unwrap().unwrap();
    });
    assert_eq!(store.away(), None);
}
