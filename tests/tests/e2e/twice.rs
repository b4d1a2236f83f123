//! Two daemons for one store or one folder: the second one ends at once and says who is there; when that one is gone, it begins.

use std::time::{Duration, Instant};

use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::served::{Served, jobs, wait_until};

fn configure(place: &Place, name: &str, state: &str, folder: &str) {
    let text = format!("settle = \"30ms\"\nstate = \"{state}\"\n[[folders]]\npath = \"{folder}\"\n");
    place.put(name, text.as_bytes());
}

/// Code 73 with one line that names the process, within a second. The fastest of three counts: other tests run beside this one.
fn assert_refused(place: &Place, configuration: &str, owner: u32) {
    let mut fastest = Duration::MAX;
    for _ in 0..3 {
        let began = Instant::now();
        let ran = place.suture(["watch", "--config", configuration]).expect(73);
        fastest = fastest.min(began.elapsed());
        let said = ran.stderr();
        assert!(said.lines().count() == 1 && said.contains(&format!("(process {owner})")), "{said}");
    }
    assert!(fastest < Duration::from_secs(1), "{fastest:?}");
}

fn wait_done(place: &Place, folder: &str) {
    wait_until("the file is done", || jobs(place, folder).iter().any(|job| job["kind"] == "done"));
}

fn meshes(place: &Place, part: &str) -> Vec<String> {
    place.names(part).into_iter().filter(|name| !name.ends_with(".json")).collect()
}

#[test]
fn f16_a_second_daemon_of_one_store_ends_at_once() {
    let place = Place::new();
    configure(&place, "a.toml", "state/jobs", "hot");
    configure(&place, "b.toml", "state/jobs", "other");
    place.put("other/in/b.stl", &holes(2));
    let first = Served::start(&place, &["--config", "a.toml"], "log");
    assert_refused(&place, "b.toml", first.pid());
    assert_eq!(place.names("other"), ["in/b.stl"], "it takes nothing");
    place.put("hot/in/a.stl", &holes(1));
    wait_done(&place, "hot");
    drop(first);
    place.suture(["watch", "--once", "--config", "b.toml"]).expect(0);
    assert_eq!((meshes(&place, "hot/out"), meshes(&place, "other/out")), (vec!["a.stl".into()], vec!["b.stl".into()]));
}

/// The lock ends with its process, so that no rule says how old it must be. (A second machine on a share is not tried here.)
#[test]
fn f17_a_second_daemon_of_one_folder_ends_at_once_and_begins_when_the_first_is_killed() {
    let place = Place::new();
    configure(&place, "a.toml", "first/jobs", "hot");
    configure(&place, "b.toml", "second/jobs", "hot");
    let first = Served::start(&place, &["--config", "a.toml"], "log");
    assert_refused(&place, "b.toml", first.pid());
    assert!(!place.at("second").exists(), "it makes nothing");
    place.put("hot/in/a.stl", &holes(1));
    wait_done(&place, "hot");
    drop(first);
    place.put("hot/in/b.stl", &holes(2));
    place.suture(["watch", "--once", "--config", "b.toml"]).expect(0);
    assert_eq!(meshes(&place, "hot/out"), ["a.stl", "b.stl"]);
    assert_eq!(meshes(&place, "hot/done"), ["a.stl", "b.stl"]);
    let paths: Vec<_> = jobs(&place, "hot").iter().map(|job| job["source"]["path"].clone()).collect();
    assert_eq!(paths, ["a.stl", "b.stl"], "the store of the second, which knows the first one's by its receipt");
}

/// With several folders, the others are served; the owned one is said to be out of reach, and taken when it is free.
#[test]
fn f17_the_other_folders_are_served_when_one_is_another_daemons() {
    let place = Place::new();
    configure(&place, "a.toml", "first/jobs", "hot");
    let text = "settle = \"30ms\"\nstate = \"second/jobs\"\n[[folders]]\npath = \"hot\"\n[[folders]]\npath = \"other\"\n";
    place.put("b.toml", text.as_bytes());
    let first = Served::start(&place, &["--config", "a.toml"], "log");
    let owner = format!("(process {})", first.pid());
    place.put("other/in/b.stl", &holes(2));
    // A folder of an attempt of the first one's, under a number that the second gives as well.
    for token in 1..40 {
        place.put(&format!("hot/.suture/work/{token}/in-hand"), b"");
    }
    let once = place.suture(["watch", "--once", "--config", "b.toml"]).expect(1);
    assert!(once.stderr().contains(&owner), "{}", once.stderr());
    assert_eq!(meshes(&place, "other/out"), ["b.stl"]);
    let second = Served::start(&place, &["--config", "b.toml"], "log of the second");
    wait_until("it says who has the folder", || {
        second.lines("The folder cannot be served").iter().any(|line| line["level"] == "ERROR")
    });
    let listed = || place.suture(["jobs", "list", "--dir", "other"]).expect(0).stdout();
    wait_until("it is listed", || listed().contains("out of reach") && listed().contains(&owner));
    place.put("other/in/c.stl", &holes(1));
    wait_until("the other folder is served", || meshes(&place, "other/out").len() == 2);
    let stands = |token: u32| place.at(&format!("hot/.suture/work/{token}/in-hand")).exists();
    assert!((1..40).all(stands), "work of the first one was cleared away");
    place.put("hot/in/a.stl", &holes(1));
    wait_done(&place, "hot");
    assert_eq!((meshes(&place, "hot/out"), meshes(&place, "hot/done")), (vec!["a.stl".into()], vec!["a.stl".into()]));
    drop(first);
    place.put("hot/in/d.stl", &holes(2));
    wait_until("the second has the folder", || meshes(&place, "hot/out").len() == 2);
    assert!(!listed().contains("out of reach"), "{}", listed());
}
