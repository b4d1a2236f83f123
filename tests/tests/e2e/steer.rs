//! What an operator and the clock may stop: nothing new is taken then, and `suture jobs list` says why.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::served::{Served, wait_until};

/// A daemon that begins to serve `hot`.
fn begin(place: &Place) -> Served<'_> {
    let mut command = place.command();
    command.args(["watch", "hot", "--settle", "30ms"]);
    Served::begin(place, command, "log")
}

fn is_there(place: &Place, name: &str) -> bool {
    place.at(name).exists()
}

fn listed(place: &Place) -> String {
    place.suture(["jobs", "list", "--dir", "hot"]).expect(0).stdout()
}

/// A daemon that starts has the store before it answers, and a worker outlives its killed daemon by a moment: a list waits for either.
#[test]
fn a_list_waits_while_the_store_changes_hands() {
    let place = Place::new();
    (0..4).for_each(|i| drop(place.put(&format!("hot/in/{i}.stl"), &holes(i))));
    for round in 0..10 {
        let daemon = begin(&place);
        if round > 0 {
            listed(&place);
        }
        wait_until("it serves the folder", || place.at("hot/.suture/control.sock").exists());
        std::thread::sleep(Duration::from_millis(20 * round));
        drop(daemon);
        listed(&place);
    }
    assert!(listed(&place).contains("3.stl"));
}

#[test]
fn a_pause_holds_over_a_restart_until_an_operator_goes_on() {
    let place = Place::new();
    place.put("hot/in/first.stl", &holes(1));
    let daemon = begin(&place);
    wait_until("the first one", || is_there(&place, "hot/out/first.stl"));
    let paused = place.suture(["jobs", "pause", "--dir", "hot"]).expect(0);
    assert!(paused.stdout().starts_with("paused: nothing new is taken"), "{}", paused.stdout());
    place.put("hot/in/second.stl", &holes(2));
    let list = || listed(&place);
    wait_until("it is seen", || list().contains("second.stl"));
    drop(daemon);
    assert!(list().contains("nothing new is taken: an operator has paused it"), "{}", list());
    let daemon = begin(&place);
    // It has had time for much more than this.
    place.put("hot/in/third.stl", &holes(1));
    wait_until("the third is seen", || list().contains("third.stl"));
    assert!(!is_there(&place, "hot/out/second.stl") && list().contains("nothing new is taken: an operator has paused it"));
    place.suture(["jobs", "resume", "--dir", "hot"]).expect(0);
    wait_until("both", || is_there(&place, "hot/out/second.stl") && is_there(&place, "hot/out/third.stl"));
    assert!(!list().contains("nothing new is taken"), "{}", list());
    drop(daemon);
}

#[test]
fn f27_a_drain_ends_when_nothing_is_in_work() {
    let place = Place::new();
    (0..20).for_each(|i| drop(place.put(&format!("hot/in/{i}.stl"), &holes(i))));
    let _daemon = begin(&place);
    wait_until("work began", || place.at("hot/out").read_dir().is_ok_and(|all| all.count() > 0));
    let drained = place.suture(["jobs", "drain", "--dir", "hot"]).expect(0);
    assert!(drained.stdout().starts_with("drained: "), "{}", drained.stdout());
    let running = place.suture(["jobs", "list", "--state", "running", "--dir", "hot"]).expect(0).stdout();
    assert!(running.starts_with("no jobs"), "{running}");
}

#[test]
fn without_a_daemon_the_next_one_is_paused() {
    let place = Place::new();
    place.put("hot/in/part.stl", &holes(1));
    place.suture(["jobs", "pause", "--dir", "hot"]).expect(2);
    place.suture(["watch", "hot", "--once", "--settle", "30ms"]).expect(0);
    place.suture(["jobs", "pause", "--dir", "hot"]).expect(0);
    place.put("hot/in/more.stl", &holes(2));
    let left = place.suture(["watch", "hot", "--once", "--settle", "30ms"]).expect(1);
    assert!(left.stderr().contains("an operator has paused it"), "{}", left.stderr());
    place.suture(["jobs", "resume", "--dir", "hot"]).expect(0);
    place.suture(["watch", "hot", "--once", "--settle", "30ms"]).expect(0);
    assert!(is_there(&place, "hot/out/more.stl"));
}

#[test]
fn originals_that_are_left_are_taken_once() {
    let place = Place::new();
    let (good, sheet) = (holes(1), b"solid nothing\nendsolid nothing\n");
    place.put("hot/in/order/part.stl", &good);
    place.put("hot/in/empty.stl", sheet);
    place.put("suture.toml", b"settle = \"30ms\"\n[[folders]]\npath = \"hot\"\nleave_originals = true\n");
    let once = |code| place.suture(["watch", "--once", "--config", "suture.toml"]).expect(code);
    once(1);
    let out = ["order/order.report.json", "order/part.stl", "order/part.stl.report.json", "order/part.stl.suture.json"];
    let left = || (place.names("hot/in"), place.names("hot/out").len(), place.names("hot/done").len());
    assert_eq!(left(), (vec!["empty.stl".into(), "order/part.stl".into()], out.len(), 0), "{:?}", place.names("hot/out"));
    assert!(!place.names("hot/failed").contains(&"empty.stl".to_owned()), "its report alone");
    let failed = place.names("hot/failed");
    // Nothing is taken again, not even in another life.
    once(0);
    assert_eq!((left().1, place.names("hot/failed")), (4, failed.clone()));
    place.suture(["jobs", "retry", "2", "--dir", "hot"]);
    place.suture(["jobs", "retry", "1", "--dir", "hot"]);
    once(1);
    assert_eq!(left().1, 4, "what is done is not retried");
    // Another content is another job.
    place.put("hot/in/order/part.stl", &holes(2));
    once(0);
    assert_eq!((left().1, place.names("hot/in").len()), (7, 2));
}

#[test]
fn outside_of_the_hours_of_work_files_wait() {
    let minute = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs() / 60 % (24 * 60);
    let time = |minute: u64| format!("{:02}:{:02}", minute / 60 % 24, minute % 60);
    // Three hours from now, and all day but for then.
    let (closed, open) =
        (format!("{}-{}", time(minute + 180), time(minute + 240)), format!("{}-{}", time(minute + 240), time(minute + 180)));
    let once = |window: &str, more: &str| {
        let place = Place::new();
        place.put("hot/in/part.stl", &holes(1));
        let text = format!("run_window = \"{window}\"\n{more}\nsettle = \"30ms\"\n[[folders]]\npath = \"hot\"\n");
        place.put("suture.toml", text.as_bytes());
        let ran = |zone: &str| {
            let ran = place.command().env("TZ", zone).args(["watch", "--once", "--config", "suture.toml"]).output().unwrap();
            (ran.status.code(), String::from_utf8_lossy(&ran.stderr).contains("The time zone cannot be told"))
        };
        let (code, warned) = ran("UTC");
        assert!(!warned, "{window}");
        let ended = (code, is_there(&place, "hot/out/part.stl"));
        assert!(code == Some(2) || ran("Europe/Nowhere").1, "hours of another zone than was meant are told of: {window}");
        ended
    };
    assert_eq!(once(&closed, ""), (Some(1), false));
    assert_eq!(once(&closed, "workers_outside = 1"), (Some(0), true));
    assert_eq!(once(&open, ""), (Some(0), true));
    assert_eq!(once("20:00", ""), (Some(2), false), "refused");
}
