//! Folders that go and come back: unmounted, removed, made anew.

use std::time::Duration;

use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::served::{Served, wait_until};

/// `suture jobs list`, once the daemon answers.
fn listed(place: &Place) -> String {
    let ran = || place.suture(["jobs", "list", "--dir", "hot"]);
    wait_until("the daemon answers", || ran().code() == 0);
    ran().expect(0).stdout()
}

/// The mount of one of two folders is not there when the daemon starts, but for the bare folder that it is mounted on.
#[test]
fn f25_a_folder_whose_mount_is_missing_is_not_taken_for_an_empty_one() {
    let place = Place::new();
    let config = "settle = \"30ms\"\nstate = \"state/jobs\"\n[[folders]]\npath = \"hot\"\n[[folders]]\npath = \"scans\"\n";
    place.put("suture.toml", config.as_bytes());
    place.put("scans/in/a.stl", &holes(1));
    place.suture(["watch", "--once", "--config", "suture.toml"]).expect(0);
    // As if it had lain on another mount; and that is gone, with a file waiting on it.
    let mut noted: serde_json::Value = serde_json::from_slice(&place.read("state/folders")).unwrap();
    noted["scans"]["mount"] = "/mnt/disk".into();
    place.put("state/folders", noted.to_string().as_bytes());
    std::fs::rename(place.at("scans"), place.at("disk")).unwrap();
    place.put("disk/in/b.stl", &holes(2));
    place.put("scans/in/c.stl", &holes(3));

    let once = place.suture(["watch", "--once", "--config", "suture.toml"]).expect(1);
    assert!(once.stderr().contains("the mount /mnt/disk is not there"), "{}", once.stderr());
    let _daemon = Served::start(&place, &["--config", "suture.toml"], "log");
    place.put("hot/in/d.stl", &holes(4));
    wait_until("the other folder is served", || place.at("hot/done/d.stl").exists());
    let list = listed(&place);
    assert!(list.contains("out of reach: ") && list.contains("scans: the mount /mnt/disk is not there"), "{list}");
    assert!(list.contains("remove the file ") && list.contains("state/folders if this is another folder"), "{list}");
    assert_eq!(place.names("scans"), ["in/c.stl"], "nothing is made, taken or moved there");

    std::fs::remove_dir_all(place.at("scans")).unwrap();
    std::fs::rename(place.at("disk"), place.at("scans")).unwrap();
    let took = wait_until("it is served again", || place.at("scans/done/b.stl").exists());
    assert!(took < Duration::from_secs(20), "{took:?}");
    assert!(!listed(&place).contains("out of reach"), "{}", listed(&place));
    wait_until("it answers, too", || place.suture(["jobs", "list", "--dir", "scans"]).code() == 0);
    assert_eq!(place.names("scans/out").iter().filter(|name| name.ends_with(".stl")).count(), 2);
    // Each line says its folder, and those of one can be had.
    let of = |folder: &str| place.suture(["jobs", "list", "--dir", "hot", "--folder", folder]);
    let line = |name: &str| listed(&place).lines().find(|line| line.contains(name)).map(str::to_owned).unwrap();
    assert!(line("b.stl").contains(" scans  b.stl") && line("d.stl").contains(" hot    d.stl"), "{}", listed(&place));
    let scans = of("scans").expect(0).stdout();
    assert!(scans.contains("b.stl") && !scans.contains("d.stl"), "{scans}");
    let refused = of("scan").expect(2).stderr();
    assert!(refused.contains("no job is of a folder `scan`") && refused.contains("`hot`, `scans`"), "{refused}");
}

/// `in/` that is made anew is seen at once, not with the next full scan.
#[test]
fn f25_a_folder_for_drops_that_is_made_anew_is_watched() {
    let place = Place::new();
    place.put("hot/in/a.stl", &holes(1));
    let _daemon = Served::start(&place, &["hot", "--settle", "30ms"], "log");
    wait_until("the first file", || place.at("hot/done/a.stl").exists());
    std::fs::remove_dir(place.at("hot/in")).unwrap();
    wait_until("it is missed", || listed(&place).contains("out of reach: "));
    std::fs::create_dir(place.at("hot/in")).unwrap();
    wait_until("it is back", || !listed(&place).contains("out of reach"));
    for (seed, name) in [(2, "b.stl"), (3, "c.stl")] {
        place.put(&format!("hot/in/{name}"), &holes(seed));
        let took = wait_until(name, || place.at(&format!("hot/done/{name}")).exists());
        assert!(took < Duration::from_secs(15), "{name}: {took:?}");
    }
}
