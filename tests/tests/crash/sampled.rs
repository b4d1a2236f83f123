//! Jobs that are computed twice: whatever is killed, one result comes of them; and where the two differ, none does.

use std::process::Command;

use serde_json::Value;
use suture_store::testkit::server::server;
use suture_tests::Place;
use suture_tests::binary::with_crash_points;
use suture_tests::hot::{Hot, Tree, holes};
use suture_tests::moto::{Store, on};
use suture_tests::served::{Served, wait_until};

use super::{assert_at_rest, drop_two, exhaustive, on_two_threads, reference, state, traced, was_killed};

fn daemon(hot: &Hot) -> Command {
    hot.configured("settle = \"30ms\"\ncheck_one_in = 1")
}

/// The second attempt is computed, not copied, and what comes of it is what comes of one.
#[test]
fn f01_killed_at_steps_of_two_attempts() {
    let (expected, _) = reference(drop_two);
    let hot = Hot::new(with_crash_points());
    drop_two(&hot);
    let (status, trace) = traced(&hot, daemon(&hot));
    assert_eq!(status.code(), Some(1), "one is no mesh");
    assert_eq!((trace.matches("daemon.worked\n").count(), trace.matches("daemon.reused\n").count()), (3, 0), "{trace}");
    assert_eq!(state(&hot), expected, "without a kill");
    let passes = trace.lines().count() as u64;
    let steps: Vec<u64> = (1..=passes).step_by(if exhaustive() { 1 } else { 4 }).collect();
    on_two_threads(&steps, |&step| {
        let hot = Hot::new(with_crash_points());
        drop_two(&hot);
        let what = format!("killed at pass {step} of {passes}");
        let first = daemon(&hot).env("SUTURE_CRASH_AT", format!("*:{step}")).status().expect("it starts");
        assert!(was_killed(first) || step + 8 > passes, "{what}: was not");
        let status = daemon(&hot).status().expect("it starts");
        assert!(status.code().is_some_and(|code| code < 2), "{what}: {status}");
        assert_eq!(state(&hot), expected, "{what}");
        assert_at_rest(&hot, &what);
    });
}

/// What a job's reason says of two results: its own words, and that it names each of these.
fn assert_differs(reason: &str, parts: &[&str]) {
    assert!(reason.starts_with("computed twice, with two results: "), "{reason}");
    for part in parts {
        assert!(reason.contains(part), "{part}: {reason}");
    }
}

fn reason(job: &Value) -> &str {
    job["state"]["ended"]["publication"]["reason"].as_str().expect("a reason")
}

/// A machine that makes other bytes each time publishes none of them; the next file is another matter.
#[test]
fn a_file_with_two_results_needs_review_and_is_not_published() {
    let hot = Hot::new(with_crash_points());
    hot.put("part!flip!.stl", &holes(1));
    hot.put("whole.stl", &holes(2));
    assert_eq!(daemon(&hot).status().expect("it starts").code(), Some(1));
    let out = hot.tree("out");
    assert!(out.keys().all(|name| name.starts_with("whole.stl")) && out.contains_key("whole.stl"), "{:?}", out.keys());
    let jobs = hot.jobs();
    let job = jobs.iter().find(|job| job["source"]["path"] == "part!flip!.stl").expect("a job");
    assert_eq!((job["kind"].as_str(), job["attempts"].as_u64()), (Some("needs_review"), Some(2)));
    let failed = hot.tree("failed");
    assert_eq!(failed.get("part!flip!.stl"), Some(&holes(1)), "the original");
    let output = job["state"]["ended"]["publication"]["output"].as_str().expect("the second result is kept");
    let second = blake3::hash(&failed[output]).to_hex().to_string();
    assert_differs(reason(job), &["pause it (`suture jobs pause`)", &format!("made BLAKE3 {second}"), env!("CARGO_PKG_VERSION")]);
    let report = failed.iter().find(|(name, _)| name.ends_with(".report.json")).expect("a report").1;
    let report: Value = serde_json::from_slice(report).expect("JSON");
    assert_eq!((report["outcome"].as_str(), report["verdict"]["reasons"][0].as_str()), (Some("needs_review"), Some(reason(job))));
    assert_eq!(hot.tree(".suture/work"), Tree::new());
    // Tried again, it is computed twice again.
    let id = job["id"].to_string();
    assert!(hot.ask(&["retry", &id]));
    assert_eq!(daemon(&hot).status().expect("it starts").code(), Some(1));
    let jobs = hot.jobs();
    let job = jobs.iter().find(|job| job["source"]["path"] == "part!flip!.stl").expect("a job");
    assert_eq!((job["kind"].as_str(), job["attempts"].as_u64()), (Some("needs_review"), Some(4)));
}

/// Of two hosts on one bucket each makes a result, and the reason names both.
#[test]
fn two_hosts_with_two_results_are_named() {
    let (Some(server), Some(bucket)) = (server(), Store::start()) else { return };
    bucket.ask("PUT", "/prints", b"");
    let (place, url) = (Place::new(), server.url());
    let command = |words: &[&str]| {
        let mut command = on(place.command_of(with_crash_points()), bucket.port);
        command.args(words);
        command
    };
    let start = |host: &str| {
        let text = format!(
            "state = \"{host}\"\nstore = \"{url}\"\nrescan = \"1s\"\ncheck_one_in = 1\n[[folders]]\npath = \"s3://prints/farm\"\nname = \"farm\"\n"
        );
        place.put(&format!("{host}.toml"), text.as_bytes());
        Served::of(&place, command(&["watch", "--config", &format!("{host}.toml")]), &format!("{host}.log"))
    };
    let hosts = [start("one"), start("two")];
    bucket.ask("PUT", "/prints/farm/in/part!flip!.stl", &holes(1));
    let job = || {
        let listed = command(&["jobs", "list", "--json", "--store", &url]).output().expect("it starts");
        let text = String::from_utf8_lossy(&listed.stdout).into_owned();
        // Other tests have jobs there, too.
        let mut jobs = text.lines().map(|line| serde_json::from_str::<Value>(line).expect("a line of JSON"));
        jobs.find(|job| job["source"]["folder"] == "farm")
    };
    wait_until("it has ended", || job().is_some_and(|job| job["state"].get("ended").is_some()));
    let job = job().expect("a job");
    assert_eq!(job["kind"], "needs_review");
    let names = ["one", "two"].map(|host| format!(":{}", place.at(host).display()));
    assert_differs(reason(&job), &[&names[0], &names[1], "drain both (`suture hosts drain`)"]);
    let keys = bucket.keys();
    assert!(keys.iter().all(|key| !key.starts_with("farm/out/")), "{keys:?}");
    assert!(keys.contains(&"farm/failed/part!flip!.stl".into()), "{keys:?}");
    let told: usize = hosts.iter().map(|host| host.lines("Computed twice: the results differ.").len()).sum();
    assert_eq!(told, 1);
}
