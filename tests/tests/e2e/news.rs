//! Others hear of the service itself, too: of folders that go and come back, and of the ends of nights.

use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use rustix::process::Signal;
use serde_json::Value;
use suture_tests::Place;
use suture_tests::hot::{doubtful, holes};
use suture_tests::receiver::Receiver;
use suture_tests::served::{Served, jobs, wait_until};

const SECRET: &str = "0123456789abcdef0123456789abcdef";

fn configure(place: &Place, first: &str, receiver: &Receiver, events: &str) {
    let hook = format!("[[webhook]]\nurl = \"http://{}/\"\nsecret_file = \"secret\"\nevents = [{events}]\n", receiver.address);
    place.put("secret", SECRET.as_bytes());
    place.put(
        "suture.toml",
        format!("settle = \"30ms\"\nstate = \"state/jobs\"\n{first}\n[[folders]]\npath = \"hot\"\n[[folders]]\npath = \"scans\"\n{hook}")
            .as_bytes(),
    );
}

/// Messages that came, each once: a message that came again has the same id.
fn came(receiver: &Receiver) -> Vec<Value> {
    let mut all: Vec<Value> = Vec::new();
    for message in receiver.came() {
        let told = message.json();
        assert!(message.signed(SECRET).is_some() && told["id"] == message.header("suture-delivery"), "{message:?}");
        match all.iter().find(|other| other["id"] == told["id"]) {
            Some(other) => assert_eq!(*other, told),
            None => all.push(told),
        }
    }
    all
}

fn events(receiver: &Receiver) -> Vec<String> {
    came(receiver).iter().map(|told| told["event"].as_str().unwrap().to_owned()).collect()
}

/// A folder goes, the daemon is killed while it is away, and again when it is back: each is told once.
#[test]
fn a_folder_that_goes_and_comes_back_is_told_once() {
    let place = Place::new();
    let receiver = Receiver::start();
    configure(&place, "", &receiver, "\"folder_away\", \"folder_back\"");
    let start = |log: &str| Served::start(&place, &["--config", "suture.toml"], log);
    let daemon = start("first");
    wait_until("both folders are served", || daemon.lines("Serving a hot folder.").len() == 2);
    std::fs::rename(place.at("scans"), place.at("disk")).unwrap();
    wait_until("it is told", || events(&receiver) == ["folder_away"]);
    let told = &came(&receiver)[0];
    let path = place.at("").canonicalize().unwrap().join("scans");
    assert_eq!((&told["folder"]["name"], told["folder"]["path"].as_str()), (&"scans".into(), path.to_str()));
    assert!(told["folder"]["reason"].as_str().is_some_and(|why| why.contains("scans")), "{told}");
    assert!(told.get("job").is_none() && told.get("night").is_none());
    daemon.signal(Signal::KILL);
    drop(daemon);

    // It is away still, for another daemon: that is no news. A file that is done shows that it has looked.
    std::fs::create_dir(place.at("scans")).unwrap();
    let mut noted: Value = serde_json::from_slice(&place.read("state/folders")).unwrap();
    noted["scans"]["mount"] = "/mnt/disk".into();
    place.put("state/folders", noted.to_string().as_bytes());
    let daemon = start("second");
    wait_until("it is missed", || !daemon.lines("The folder cannot be served").is_empty());
    place.put("hot/in/a.stl", &holes(1));
    wait_until("the other folder is served", || jobs(&place, "hot").iter().any(|job| job["kind"] == "done"));
    assert_eq!(events(&receiver), ["folder_away"]);
    daemon.signal(Signal::KILL);
    drop(daemon);

    // It comes back while no daemon runs.
    std::fs::remove_dir(place.at("scans")).unwrap();
    std::fs::rename(place.at("disk"), place.at("scans")).unwrap();
    let daemon = start("third");
    wait_until("it is told", || events(&receiver) == ["folder_away", "folder_back"]);
    let told = &came(&receiver)[1];
    assert_eq!(told["folder"], serde_json::json!({"name": "scans", "path": path.to_str()}));
    drop(daemon);
    let daemon = start("fourth");
    place.put("scans/in/b.stl", &holes(2));
    wait_until("it is served", || jobs(&place, "hot").iter().filter(|job| job["kind"] == "done").count() == 2);
    assert_eq!(events(&receiver), ["folder_away", "folder_back"]);
    drop(daemon);
}

/// Seconds since 1970.
fn now() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs()
}

/// That time, as messages have it.
fn stamp(at: u64) -> String {
    let said = Command::new("date").args(["-u", "-d", &format!("@{at}"), "+%Y-%m-%dT%H:%M:%SZ"]).output().unwrap();
    String::from_utf8(said.stdout).unwrap().trim().to_owned()
}

/// A time zone in which the clock on the wall shows 07:00 at this time.
fn zone_of_seven(at: u64) -> String {
    let behind = (at + 24 * 3600 - 7 * 3600) % (24 * 3600);
    format!("TEST{:02}:{:02}:{:02}", behind / 3600, behind / 60 % 60, behind % 60)
}

/// The night ends while no daemon runs: the next one tells of it, and no other.
fn told_by_the_next(first: &str) {
    let place = Place::new();
    let receiver = Receiver::start();
    configure(&place, first, &receiver, "\"night\"");
    place.put("hot/in/good.stl", &holes(1));
    place.put("hot/in/doubtful.stl", &doubtful());
    place.put("hot/in/picture.stl", b"no mesh");
    let seven = now() + 20;
    let start = |log: &str| {
        let mut command = place.command();
        command.args(["watch", "--config", "suture.toml"]).env("TZ", zone_of_seven(seven));
        Served::of(&place, command, log)
    };
    let daemon = start("first");
    wait_until("all end", || {
        let ended = ["done", "failed", "needs_review"];
        jobs(&place, "hot").iter().filter(|job| ended.iter().any(|kind| job["kind"] == *kind)).count() == 3
    });
    daemon.signal(Signal::KILL);
    drop(daemon);
    assert_eq!((events(&receiver).len(), now() < seven), (0, true), "it was too slow for this test");
    wait_until("the night is over", || now() > seven);

    let daemon = start("second");
    wait_until("it is told", || events(&receiver) == ["night"]);
    let night = &came(&receiver)[0]["night"];
    assert_eq!(night["until"], stamp(seven));
    let since = night["since"].as_str().unwrap();
    assert!(*stamp(seven - 30) < *since && *since < *stamp(seven), "since the first daemon began: {night}");
    assert_eq!((&night["need_someone"], &night["waiting"], &night["in_work"]), (&2.into(), &0.into(), &0.into()));
    let count = |kind: &str| night["jobs"][kind].as_u64().unwrap();
    assert_eq!(["done", "failed", "needs_review", "quarantined"].map(count), [1, 1, 1, 0]);
    // The same numbers as a person is shown.
    place.suture(["night", "--dir", "hot", "-o", "night.html"]).expect(0);
    let page = String::from_utf8(place.read("night.html")).unwrap();
    assert!(page.contains("2 files need you.") && page.contains("1 done, 0 rejected, 0 cancelled."), "{page}");
    daemon.signal(Signal::KILL);
    drop(daemon);
    let daemon = start("third");
    place.put("hot/in/later.stl", &holes(3));
    wait_until("it works", || jobs(&place, "hot").len() == 4 || !daemon.lines("hours of work").is_empty());
    assert_eq!(events(&receiver), ["night"]);
}

#[test]
fn a_night_without_hours_of_work_is_told_once() {
    told_by_the_next("night_ends = \"07:00\"");
}

#[test]
fn a_night_is_told_once_when_its_hours_of_work_end() {
    told_by_the_next("run_window = \"20:00-07:00\"");
}
