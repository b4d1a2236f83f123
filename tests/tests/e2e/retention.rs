//! What goes by itself: results and reports by age, records by number, and originals never, but to an archive.

use std::fs::File;
use std::time::{Duration, SystemTime};

use suture_tests::hot::holes;
use suture_tests::{Place, Ran};

const DAY: Duration = Duration::from_secs(24 * 3600);

/// Works once through the hot folder, by a configuration with these lines in `[keep]`, and more in `[[folders]]`.
fn once(place: &Place, keep: &str, folder: &str) -> Ran {
    place.put("suture.toml", format!("settle = \"30ms\"\n[keep]\n{keep}\n[[folders]]\npath = \"hot\"\n{folder}\n").as_bytes());
    place.suture(["watch", "--once", "--config", "suture.toml"])
}

fn make_old(place: &Place, receipt: &str, days: u32) {
    let then = SystemTime::now() - days * DAY;
    File::open(place.at(receipt)).unwrap().set_modified(then).unwrap();
}

/// Names of everything in the hot folder.
fn all(place: &Place) -> Vec<String> {
    place.names("hot")
}

/// Two good files and one that fails, worked on 100 days ago.
fn of_old() -> Place {
    let place = Place::new();
    place.put("hot/in/a.stl", &holes(1));
    place.put("hot/in/order/b.stl", &holes(2));
    place.put("hot/in/bad.stl", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
    once(&place, "", "").expect(1);
    for receipt in ["out/a.stl", "out/order/b.stl", "failed/bad.stl"] {
        make_old(&place, &format!("hot/{receipt}.suture.json"), 100);
    }
    place
}

#[test]
fn by_default_nothing_goes() {
    let place = of_old();
    let before = all(&place);
    assert_eq!(place.suture(["retention", "suture.toml"]).expect(0).stdout(), "nothing would go\n");
    once(&place, "", "").expect(0);
    assert_eq!(all(&place), before);
}

#[test]
fn results_and_reports_go_when_they_are_old() {
    let place = of_old();
    // Of today, and someone's work.
    place.put("hot/in/new.stl", &holes(3));
    place.put("hot/out/order/b.stl", b"as a person made it");
    let before = all(&place);
    place.put("suture.toml", b"[keep]\nresults = \"30d\"\nreports = \"60d\"\n[[folders]]\npath = \"hot\"\n");
    let would = place.suture(["retention", "suture.toml"]).expect(0).stdout();
    assert_eq!(all(&place), before, "it only says so");
    let lines: Vec<&str> = would.lines().collect();
    assert!(lines[0].starts_with("would remove hot/out/a.stl (result, ") && lines[0].ends_with("): older than 30d"), "{would}");
    assert!(lines.iter().any(|line| line.starts_with("would remove hot/failed/bad.stl.report.json (report, ")), "{would}");
    assert!(!would.contains("original") && !would.contains("b.stl (result"), "{would}");

    let ran = once(&place, "results = \"30d\"\nreports = \"60d\"", "").expect(0);
    let removed = |name: &str| {
        ran.stderr().lines().any(|line| line.contains("a file was removed") && line.contains(name) && line.contains("older than"))
    };
    assert!(removed("out/a.stl\"") && removed("failed/bad.stl.report.json"), "{}", ran.stderr());
    assert!(ran.stderr().contains("someone has changed it since"), "{}", ran.stderr());
    once(&place, "results = \"30d\"\nreports = \"60d\"", "").expect(0);
    let left = [
        "done/a.stl",
        "done/new.stl",
        "done/order/b.stl",
        "failed/bad.stl",
        "out/new.stl",
        "out/new.stl.report.json",
        "out/new.stl.suture.json",
        "out/order/b.stl",
        "out/order/b.stl.suture.json",
        "out/order/order.report.json",
    ];
    assert_eq!(all(&place), left);
    assert_eq!(place.read("hot/out/order/b.stl"), b"as a person made it");
}

#[test]
fn of_too_many_bytes_the_oldest_go() {
    let place = of_old();
    place.put("hot/in/new.stl", &holes(3));
    make_old(&place, "hot/out/order/b.stl.suture.json", 101);
    let size = place.read("hot/out/a.stl").len();
    // Room for one of three; but one is of today.
    once(&place, &format!("results_size = {}", size + 1000), "").expect(0);
    let there = |name: &str| place.at(&format!("hot/out/{name}")).exists();
    assert_eq!([there("order/b.stl"), there("a.stl"), there("new.stl")], [false, false, true]);
    assert!(there("a.stl.report.json"), "of reports nothing was said");
}

#[test]
fn originals_go_to_an_archive_or_stay() {
    let place = of_old();
    let originals = ["done/a.stl", "done/order/b.stl", "failed/bad.stl"];
    let contents: Vec<_> = originals.iter().map(|name| place.read(&format!("hot/{name}"))).collect();
    let keep = "originals = \"0s\"\narchive = \"archive\"";
    let refused = once(&place, "originals = \"0s\"", "").expect(2);
    assert!(refused.stderr().contains("an original is never deleted"), "{}", refused.stderr());
    std::fs::create_dir(place.at("archive")).unwrap();
    // The bare folder of a disk that is not mounted.
    let ran = once(&place, keep, "").expect(0);
    assert!(ran.stderr().contains("`.suture-archive`; mount it"), "{}", ran.stderr());
    assert!(place.names("archive").is_empty() && originals.iter().all(|name| place.at(&format!("hot/{name}")).exists()));
    place.put("archive/.suture-archive", b"");
    // Another file has the name there.
    place.put("archive/hot/done/a.stl", b"another");
    let would = place.suture(["retention", "suture.toml"]).expect(0).stdout();
    assert!(would.contains("would move hot/done/a.stl to archive/hot (original, "), "{would}");
    let ran = once(&place, keep, "").expect(0);
    assert!(ran.stderr().contains("an original moved to the archive"), "{}", ran.stderr());
    assert!(originals.iter().all(|name| !place.at(&format!("hot/{name}")).exists()));
    let archived = ["archive/hot/done/a~2.stl", "archive/hot/done/order/b.stl", "archive/hot/failed/bad.stl"];
    assert_eq!(archived.map(|name| place.read(name)).to_vec(), contents);
    assert_eq!(place.read("archive/hot/done/a.stl"), b"another");
    assert!(place.at("hot/out/a.stl").exists() && place.at("hot/failed/bad.stl.report.json").exists());
}

#[test]
fn old_jobs_are_forgotten_and_nothing_is_taken_twice() {
    let place = of_old();
    once(&place, "history_jobs = 1", "").expect(0);
    let listed = || place.suture(["jobs", "list", "--dir", "hot"]).expect(0).stdout();
    assert_eq!(listed().lines().count(), 2, "the newest, and the summary: {}", listed());
    place.put("hot/in/c.stl", &holes(4));
    once(&place, "history = \"0s\"", "").expect(0);
    assert_eq!(listed(), "no jobs\n");
    // Originals that are left in their place are remembered for as long as they lie there.
    let place = Place::new();
    place.put("hot/in/a.stl", &holes(1));
    for _ in 0..3 {
        once(&place, "history = \"0s\"\nhistory_jobs = 1", "leave_originals = true").expect(0);
    }
    assert_eq!(place.names("hot/out"), ["a.stl", "a.stl.report.json", "a.stl.suture.json"]);
}
