//! The state folder is lost. What is finished is not done again, and its jobs come back from receipts.

use std::collections::BTreeMap;

use serde_json::Value;
use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::served::jobs;

const PICTURE: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR";

/// Every file of the hot folder that users see, with its bytes.
fn files(place: &Place) -> BTreeMap<String, Vec<u8>> {
    place.names("hot").into_iter().map(|name| (name.clone(), place.read(&format!("hot/{name}")))).collect()
}

/// The default store, the whole private part around it, and a store in a place of its own; one file waits while it happens.
#[test]
fn f06_what_is_finished_is_not_done_again_when_the_state_is_lost() {
    for (settings, lost) in [("", "hot/.suture/state"), ("", "hot/.suture"), ("state = \"state/jobs\"\n", "state")] {
        let place = Place::new();
        place.put("suture.toml", format!("{settings}settle = \"30ms\"\n[[folders]]\npath = \"hot\"\n").as_bytes());
        let once = |code| place.suture(["watch", "--once", "--config", "suture.toml"]).expect(code);
        place.put("hot/in/a.stl", &holes(1));
        place.put("hot/in/order/b.stl", &holes(2));
        place.put("hot/in/bad.stl", PICTURE);
        once(1);
        let before = files(&place);
        place.put("hot/in/c.stl", &holes(3));
        std::fs::remove_dir_all(place.at(lost)).unwrap();
        once(0);
        let mut after = files(&place);
        for name in ["done/c.stl", "out/c.stl", "out/c.stl.report.json", "out/c.stl.suture.json"] {
            assert!(after.remove(name).is_some(), "{lost}: no {name} in {:?}", after.keys());
        }
        assert!(after.keys().eq(before.keys()), "{lost}: {:?} was {:?}", after.keys(), before.keys());
        assert!(after == before, "{lost}: another content");
        // With their numbers and their endings; what is not good can be tried once more from where it lies.
        let listed: BTreeMap<_, _> = jobs(&place, "hot").iter().map(|job| (path_of(job), word(job, "kind"))).collect();
        let expected = [("a.stl", "done"), ("bad.stl", "failed"), ("c.stl", "done"), ("order/b.stl", "done")];
        assert_eq!(listed, expected.map(|(path, kind)| (path.to_owned(), kind.to_owned())).into(), "{lost}");
        let bad = jobs(&place, "hot").iter().find(|job| path_of(job) == "bad.stl").map(|job| job["id"].to_string()).unwrap();
        place.suture(["jobs", "retry", &bad, "--dir", "hot"]).expect(0);
        once(1);
        assert!(files(&place).keys().filter(|name| name.contains("bad")).count() == 3, "{lost}: {:?}", files(&place).keys());
    }
}

fn word(job: &Value, field: &str) -> String {
    job[field].as_str().expect("a word").to_owned()
}

fn path_of(job: &Value) -> String {
    word(&job["source"], "path")
}

/// Originals that stay in `in/` are known by their receipts. One that changed is a new drop; a receipt that is damaged tells of nothing, and
/// keeps no other from being read.
#[test]
fn f06_originals_that_stay_are_not_done_again_when_the_state_is_lost() {
    let place = Place::new();
    place.put("suture.toml", b"settle = \"30ms\"\n[[folders]]\npath = \"hot\"\nleave_originals = true\n");
    let once = |code| place.suture(["watch", "--once", "--config", "suture.toml"]).expect(code);
    for (name, seed) in [("a.stl", 1), ("order/b.stl", 2), ("c.stl", 1), ("d.stl", 2)] {
        place.put(&format!("hot/in/{name}"), &holes(seed));
    }
    place.put("hot/in/bad.stl", PICTURE);
    once(1);
    let before = files(&place);
    std::fs::remove_dir_all(place.at("hot/.suture/state")).unwrap();
    once(0);
    assert!(files(&place) == before, "{:?} was {:?}", files(&place).keys(), before.keys());
    assert_eq!(jobs(&place, "hot").len(), 5);
    // Its time says nothing against the content, and the time of one that changed nothing for it.
    let touched = std::fs::File::options().append(true).open(place.at("hot/in/a.stl")).unwrap();
    touched.set_modified(std::time::SystemTime::now()).unwrap();
    place.put("hot/in/c.stl", &holes(2));
    place.put("hot/out/d.stl.suture.json", b"{\"receipt_version\":1,");
    std::fs::remove_dir_all(place.at("hot/.suture")).unwrap();
    let said = once(0);
    let after = files(&place);
    let new: Vec<_> = after.keys().filter(|name| !before.contains_key(*name)).cloned().collect();
    let expected = ["c", "d"].map(|name| ["", ".report.json", ".suture.json"].map(|suffix| format!("out/{name}~2.stl{suffix}")));
    assert_eq!(new, expected.concat());
    assert_eq!(jobs(&place, "hot").len(), 6);
    assert_eq!(said.stderr().matches("A receipt is left out").count(), 1, "{}", said.stderr());
}
