//! Who goes first: priorities of folders, of profiles and by an operator's word.

use std::process::Child;
use std::time::{Duration, Instant};

use serde_json::Value;
use suture_bench::generate::{Case, write};
use suture_tests::Place;

fn mesh(triangles: u64, seed: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(Case::Clean, triangles, seed, &mut bytes).unwrap();
    bytes
}

/// Killed at the end of its test.
struct Daemon(Child);

impl Drop for Daemon {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// `suture jobs list --json`, by number.
fn jobs(place: &Place) -> Vec<Value> {
    let listed = place.suture(["jobs", "list", "--json", "--dir", "hot"]).expect(0).stdout();
    listed.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn path(job: &Value) -> &str {
    job["source"]["path"].as_str().unwrap()
}

fn number_of(place: &Place, name: &str) -> String {
    jobs(place).iter().find(|job| path(job) == name).unwrap_or_else(|| panic!("{name}"))["id"].to_string()
}

fn line_of(place: &Place, name: &str) -> String {
    let listed = place.suture(["jobs", "list", "--dir", "hot"]).expect(0).stdout();
    listed.lines().find(|line| line.contains(&format!(" {name} "))).unwrap_or_else(|| panic!("{name}: {listed}")).to_owned()
}

#[test]
fn the_more_urgent_goes_first() {
    let place = Place::new();
    let settings = "settle = \"30ms\"\nworkers = 1\nlarge = \"100KB\"\n[[folders]]\npath = \"hot\"\npriority = 3\n[profiles.rush]\npriority = 9\n";
    place.put("suture.toml", settings.as_bytes());
    let once = |code| place.suture(["watch", "--once", "--config", "suture.toml"]).expect(code);
    once(0);
    place.suture(["jobs", "pause", "--dir", "hot"]).expect(0);
    place.put("hot/in/low/.suture.toml", b"priority = 0\n");
    for (seed, name) in (0..).zip(["plain.stl", "low/low.stl", "rush/small.stl", "later.stl", "sooner.stl"]) {
        place.put(&format!("hot/in/{name}"), &mesh(600, seed));
    }
    place.put("hot/in/rush/large.stl", &mesh(3000, 9));
    once(1);
    // A wish of the operator's, without a daemon.
    let rank =
        |name: &str, priority: &str| place.suture(["jobs", "priority", &number_of(&place, name), priority, "--dir", "hot"]);
    assert!(rank("sooner.stl", "7").expect(0).stdout().contains("priority 7"));
    rank("later.stl", "2").expect(0);
    let refused = rank("later.stl", "10").expect(2).stderr();
    assert!(refused.contains("a whole number from 0 to 9"), "{refused}");
    assert!(line_of(&place, "rush/large.stl").contains("priority 9") && line_of(&place, "low/low.stl").contains("priority 0"));
    place.suture(["jobs", "resume", "--dir", "hot"]).expect(0);
    once(0);
    let mut done = jobs(&place);
    done.sort_by_key(|job| job["seq"].as_u64());
    let order: Vec<_> = done.iter().map(path).collect();
    let expected = ["rush/small.stl", "rush/large.stl", "sooner.stl", "plain.stl", "later.stl", "low/low.stl"];
    assert_eq!(order, expected);
    let late = rank("plain.stl", "9").expect(2).stderr();
    assert!(late.contains("a job that is done cannot be given a priority"), "{late}");
}

/// The daemon does it while it runs.
#[test]
fn a_running_daemon_is_told() {
    let place = Place::new();
    place.suture(["watch", "hot", "--once"]).expect(0);
    place.suture(["jobs", "pause", "--dir", "hot"]).expect(0);
    place.put("hot/in/part.stl", &mesh(600, 1));
    let _daemon = Daemon(place.command().args(["watch", "hot", "--settle", "30ms"]).spawn().unwrap());
    let began = Instant::now();
    while jobs(&place).is_empty() && began.elapsed().as_secs() < 60 {
        std::thread::sleep(Duration::from_millis(50));
    }
    let asked = ["8", "10"].map(|priority| place.suture(["jobs", "priority", "1", priority, "--dir", "hot"]));
    let line = line_of(&place, "part.stl");
    assert_eq!((asked[0].code(), asked[1].code()), (0, 2));
    assert!(line.contains("queued") && line.contains("priority 8"), "{line}");
}

/// What is not said is not shown.
#[test]
fn a_priority_is_shown_where_it_is_not_the_default() {
    let place = Place::new();
    place.put("hot/in/part.stl", &mesh(600, 1));
    place.suture(["watch", "hot", "--once", "--settle", "30ms"]).expect(0);
    let listed = place.suture(["jobs", "list", "--dir", "hot"]).expect(0).stdout();
    assert!(!listed.contains("priority"), "{listed}");
    let shown = place.suture(["jobs", "show", "1", "--dir", "hot"]).expect(0).stdout();
    assert!(shown.contains("  priority  5\n"), "{shown}");
}
