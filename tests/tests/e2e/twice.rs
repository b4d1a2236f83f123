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
    assert_eq!(paths, ["b.stl"], "the store of the second");
}
