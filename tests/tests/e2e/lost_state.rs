//! The state folder is lost. What is finished is not done again: originals lie in `done/` and `failed/`, and nobody looks for work there.

use std::collections::BTreeMap;

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
        let paths: Vec<_> = jobs(&place, "hot").iter().map(|job| job["source"]["path"].clone()).collect();
        assert_eq!(paths, ["c.stl"], "{lost}");
    }
}
