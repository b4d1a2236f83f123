//! A job store that is damaged: it is refused, kept aside on request, and what was done comes back from receipts.

use std::collections::BTreeMap;
use std::fs::File;

use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::served::{Served, jobs};

fn cut(place: &Place) {
    File::options().write(true).open(place.at("hot/.suture/state/db/db")).unwrap().set_len(100).unwrap();
}

fn lose(place: &Place) {
    std::fs::remove_dir_all(place.at("hot/.suture/state/db")).unwrap();
}

/// Number, state and path of each.
fn listed(place: &Place) -> Vec<String> {
    jobs(place, "hot").iter().map(|job| format!("{} {} {}", job["id"], job["kind"], job["source"]["path"])).collect()
}

fn files(place: &Place) -> BTreeMap<String, Vec<u8>> {
    place.names("hot").into_iter().map(|name| (name.clone(), place.read(&format!("hot/{name}")))).collect()
}

#[test]
fn f05_a_damaged_store_is_rebuilt_from_receipts() {
    for (what, damage) in [("cut", cut as fn(&Place)), ("lost", lose)] {
        let place = Place::new();
        let once = |code| place.suture(["watch", "hot", "--once", "--settle", "30ms"]).expect(code);
        let rebuild = |code| place.suture(["jobs", "rebuild", "--dir", "hot"]).expect(code);
        place.put("hot/in/a.stl", &holes(1));
        place.put("hot/in/order/b.stl", &holes(2));
        place.put("hot/in/bad.stl", b"no mesh at all");
        once(1);
        let (before, kept) = (listed(&place), files(&place));
        assert!(rebuild(2).stderr().contains("is sound; nothing was changed"), "{what}");
        damage(&place);
        place.put("hot/in/c.stl", &holes(1));
        for refused in [once(75), place.suture(["jobs", "retry", "1", "--dir", "hot"]).expect(75)] {
            assert!(refused.stderr().contains("suture jobs rebuild --dir"), "{what}: {}", refused.stderr());
        }
        let said = rebuild(0).stdout();
        assert!(said.starts_with("3 jobs came back"), "{what}: {said}");
        assert_eq!(listed(&place), before, "{what}");
        let aside: Vec<_> =
            std::fs::read_dir(place.at("hot/.suture/state")).unwrap().flatten().map(|entry| entry.path()).collect();
        let aside = aside.iter().find(|path| path.to_string_lossy().contains("corrupt-")).expect("it is kept");
        assert!(aside.join("SEQ").exists() && said.contains(&*aside.file_name().unwrap().to_string_lossy()), "{what}: {said}");
        // Only what was not done is done.
        once(0);
        let mut now = files(&place);
        for name in ["done/c.stl", "out/c.stl", "out/c.stl.report.json", "out/c.stl.suture.json"] {
            assert!(now.remove(name).is_some(), "{what}: no {name}");
        }
        assert!(now == kept, "{what}: {:?} was {:?}", now.keys(), kept.keys());
        assert_eq!(listed(&place).len(), 4, "{what}");
    }
}

/// What is wrong is said, and what to do; nothing is changed by it, and what is said to be done is accepted.
#[test]
fn f05_a_damaged_store_is_told_from_a_sound_one() {
    let place = Place::new();
    let verify = |code| place.suture(["store", "verify", "--dir", "hot"]).expect(code);
    let rebuild = |code| place.suture(["jobs", "rebuild", "--dir", "hot"]).expect(code);
    place.put("hot/in/a.stl", &holes(1));
    place.put("hot/in/bad.stl", b"no mesh at all");
    place.suture(["watch", "hot", "--once", "--settle", "30ms"]).expect(1);
    let sound = verify(0).stdout();
    assert!(sound.contains("state: sound: 2 jobs, ") && sound.lines().count() == 1, "{sound}");
    rebuild(2);
    let bytes = |name: &str| place.read(&format!("hot/.suture/state/{name}"));
    let before = (bytes("db/db"), bytes("SEQ"), bytes("LOCK"));
    assert_eq!(verify(0).stdout(), sound);
    assert!((bytes("db/db"), bytes("SEQ"), bytes("LOCK")) == before, "nothing is changed");
    cut(&place);
    let damaged = verify(1);
    for words in ["not sound", "1 found wrong", "the database went back in time", "suture jobs rebuild --dir"] {
        assert!(damaged.stdout().contains(words), "{words}: {}", damaged.stdout());
    }
    assert!(damaged.stderr().is_empty() && bytes("db/db").len() == 100, "{}", damaged.stderr());
    rebuild(0);
    assert!(verify(0).stdout().contains(": sound: 2 jobs, "));
    assert!(place.suture(["store", "verify", "--dir", "nowhere"]).expect(2).stderr().contains("is no hot folder"));
}

/// The same lines as a list, whether a daemon runs or not; a file is written whole, and not over another one.
#[test]
fn all_jobs_are_exported_with_and_without_a_daemon() {
    let place = Place::new();
    place.put("hot/in/a.stl", &holes(1));
    place.put("hot/in/bad.stl", b"no mesh at all");
    place.suture(["watch", "hot", "--once", "--settle", "30ms"]).expect(1);
    let export = |more: &[&str], code| place.suture(["store", "export", "--dir", "hot"].iter().chain(more)).expect(code);
    let listed = place.suture(["jobs", "list", "--json", "--dir", "hot"]).expect(0).stdout();
    let numbers = || jobs(&place, "hot").iter().map(|job| job["id"].as_u64()).collect::<Vec<_>>();
    assert!(numbers() == [Some(1), Some(2)] && export(&[], 0).stdout() == listed);
    let daemon = Served::start(&place, &["hot", "--log-format", "json"], "log");
    assert_eq!(export(&["-o", "all.jsonl"], 0).stdout(), "");
    assert!(place.read("all.jsonl") == listed.as_bytes());
    let refused = place.suture(["store", "verify", "--dir", "hot"]).expect(73).stderr();
    assert!(refused.contains(&daemon.pid().to_string()) && refused.contains("stop it, then verify"), "{refused}");
    place.put("all.jsonl", b"mine");
    assert!(export(&["-o", "all.jsonl"], 2).stderr().contains("--force"));
    assert!(place.read("all.jsonl") == b"mine");
    export(&["-o", "all.jsonl", "--force"], 0);
    assert!(place.read("all.jsonl") == listed.as_bytes());
}

#[test]
fn f05_no_store_is_rebuilt_under_a_daemon() {
    let place = Place::new();
    let daemon = Served::start(&place, &["hot", "--log-format", "json"], "log");
    let refused = place.suture(["jobs", "rebuild", "--dir", "hot"]).expect(73);
    assert!(refused.stderr().contains(&daemon.pid().to_string()), "{}", refused.stderr());
    assert!(place.suture(["jobs", "rebuild", "--dir", "nowhere"]).expect(2).stderr().contains("is no hot folder"));
}
