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

#[test]
fn f05_no_store_is_rebuilt_under_a_daemon() {
    let place = Place::new();
    let daemon = Served::start(&place, &["hot", "--log-format", "json"], "log");
    let refused = place.suture(["jobs", "rebuild", "--dir", "hot"]).expect(73);
    assert!(refused.stderr().contains(&daemon.pid().to_string()), "{}", refused.stderr());
    assert!(place.suture(["jobs", "rebuild", "--dir", "nowhere"]).expect(2).stderr().contains("is no hot folder"));
}
