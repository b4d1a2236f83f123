//! What needs review: a person approves it, and the bytes that were judged are published; or rejects it.

use serde_json::Value;
use suture_tests::Place;
use suture_tests::hot::{doubtful, holes};
use suture_tests::http::Client;
use suture_tests::served::{Served, jobs, wait_until};

fn begin(place: &Place) -> Served<'_> {
    Served::start(place, &["hot", "--settle", "30ms"], "log")
}

fn kind(place: &Place, id: usize) -> String {
    jobs(place, "hot").get(id - 1).map_or_else(String::new, |job| job["kind"].as_str().unwrap_or_default().to_owned())
}

fn ask(place: &Place, words: &[&str]) -> suture_tests::Ran {
    place.suture([&["jobs"], words, &["--dir", "hot"]].concat())
}

fn json(place: &Place, name: &str) -> Value {
    serde_json::from_slice(&place.read(name)).expect("JSON")
}

/// A folder in which one file needs review; its best attempt.
fn reviewed(place: &Place) -> Vec<u8> {
    place.put("hot/in/part.stl", &doubtful());
    let command = ["watch", "hot", "--once", "--settle", "30ms"];
    place.suture(command).expect(1);
    assert_eq!(kind(place, 1), "needs_review");
    place.read("hot/failed/part.best.stl")
}

#[test]
fn what_is_approved_is_published_as_it_was_judged_and_says_who() {
    let place = Place::new();
    let best = reviewed(&place);
    let judged = json(&place, "hot/failed/part.stl.report.json");
    let _daemon = begin(&place);
    ask(&place, &["approve", "1", "--as", "Ada Lovelace", "--note", "the hole was meant"]).expect(0);
    wait_until("it is published", || kind(&place, 1) == "done");
    assert_eq!(place.read("hot/out/part.stl"), best);
    assert_eq!(place.read("hot/done/part.stl"), doubtful());
    assert!(place.names("hot/failed").is_empty(), "{:?}", place.names("hot/failed"));
    let (report, receipt) = (json(&place, "hot/out/part.stl.report.json"), json(&place, "hot/out/part.stl.suture.json"));
    for told in [&report["decision"], &receipt["decision"]] {
        let words = ["verdict", "by", "note"].map(|word| told[word].as_str().unwrap_or_default());
        assert_eq!(words, ["approved", "Ada Lovelace", "the hole was meant"]);
        assert!(told["at"].as_u64().is_some_and(|at| at > 1_700_000_000_000), "{told}");
    }
    assert_eq!((&report["outcome"], &report["verdict"]), (&judged["outcome"], &judged["verdict"]), "what was found stays said");
    assert!(report["output"]["path"].as_str().is_some_and(|path| path.ends_with("hot/out/part.stl")), "{report}");
    assert_eq!(receipt["output_blake3"], judged["output"]["blake3"]);
    let shown = ask(&place, &["show", "1"]).expect(0).stdout();
    assert!(shown.contains("decision  approved by Ada Lovelace at ") && shown.contains("the hole was meant"), "{shown}");
    let list = ask(&place, &["list"]).expect(0).stdout();
    assert!(list.contains("out/part.stl, approved by Ada Lovelace"), "{list}");
    for word in ["approve", "reject"] {
        let said = ask(&place, &[word, "1"]).expect(2).stderr();
        assert!(said.contains("job 1 was approved already, by Ada Lovelace"), "{said}");
    }
    // Good by itself: there is nothing to decide.
    place.put("hot/in/good.stl", &holes(1));
    wait_until("the other is done", || kind(&place, 2) == "done");
    let said = ask(&place, &["approve", "2"]).expect(2).stderr();
    assert!(said.contains("job 2 is done; only what needs review can be approved"), "{said}");
    // It is nobody else's result.
    place.put("hot/in/again.stl", &doubtful());
    wait_until("the same once more", || kind(&place, 3) == "needs_review");
}

#[test]
fn other_bytes_than_those_that_were_judged_are_not_published() {
    let place = Place::new();
    let best = reviewed(&place);
    place.put("hot/failed/part.best.stl", &[&best[..], b"!"].concat());
    let daemon = begin(&place);
    let said = ask(&place, &["approve", "1"]).expect(2).stderr();
    assert!(said.contains("cannot be approved: the best attempt was changed since it was judged"), "{said}");
    std::fs::remove_file(place.at("hot/failed/part.best.stl")).unwrap();
    let said = ask(&place, &["approve", "1"]).expect(2).stderr();
    assert!(said.contains("the best attempt is not there any more"), "{said}");
    drop(daemon);
    // Without a daemon nobody looks, until one does.
    ask(&place, &["approve", "1"]).expect(0);
    place.put("hot/failed/part.best.stl", b"another");
    place.suture(["watch", "hot", "--once", "--settle", "30ms"]).expect(1);
    assert_eq!(kind(&place, 1), "needs_review");
    let list = ask(&place, &["list"]).expect(0).stdout();
    assert!(list.contains("the best attempt was changed since it was judged"), "{list}");
    assert!(place.names("hot/out").is_empty());
    assert_eq!(place.read("hot/failed/part.best.stl"), b"another", "it is whosever it is");
    assert_eq!(place.read("hot/failed/part.stl"), doubtful());
    assert!(place.names("hot/.suture/work").is_empty());
}

#[test]
fn what_is_rejected_stays_and_waits_for_no_one() {
    let place = Place::new();
    let best = reviewed(&place);
    ask(&place, &["reject", "1", "--as", "Ada", "--note", "too thin"]).expect(0);
    assert_eq!((kind(&place, 1).as_str(), place.read("hot/failed/part.best.stl")), ("rejected", best.clone()));
    let list = ask(&place, &["list"]).expect(0).stdout();
    assert!(list.contains("rejected by Ada") && list.contains("1 rejected") && !list.contains("needs_review"), "{list}");
    let said = ask(&place, &["reject", "1"]).expect(2).stderr();
    assert!(said.contains("job 1 was rejected already, by Ada"), "{said}");
    ask(&place, &["approve", "1", "--as", ""]).expect(2);
    // A person may think again; without a daemon the next one does it.
    let said = ask(&place, &["approve", "1", "--as", "Grace"]).expect(0).stdout();
    assert!(said.contains("approved") && said.contains("Grace"), "{said}");
    let said = ask(&place, &["cancel", "1"]).expect(2).stderr();
    assert!(said.contains("cannot be taken back"), "{said}");
    place.suture(["watch", "hot", "--once", "--settle", "30ms"]).expect(0);
    assert_eq!((kind(&place, 1).as_str(), place.read("hot/out/part.stl")), ("done", best));
}

/// The store may be lost: the receipt tells who approved it.
#[test]
fn a_decision_outlives_the_store() {
    let place = Place::new();
    reviewed(&place);
    ask(&place, &["approve", "1", "--as", "Ada"]).expect(0);
    place.suture(["watch", "hot", "--once", "--settle", "30ms"]).expect(0);
    for name in place.names("hot/.suture") {
        if name.starts_with("store") || name == "db" || name == "state" {
            std::fs::remove_dir_all(place.at(&format!("hot/.suture/{name}"))).unwrap();
        }
    }
    place.suture(["watch", "hot", "--once", "--settle", "30ms"]).expect(0);
    let job = &jobs(&place, "hot")[0];
    assert_eq!((&job["id"], &job["kind"]), (&1.into(), &"done".into()));
    assert_eq!(job["state"]["ended"]["publication"]["decision"]["by"], "Ada");
}

/// Originals that stay where they were dropped stay there.
#[test]
fn an_original_that_stays_stays_when_its_result_is_approved() {
    let place = Place::new();
    place.put("hot/in/part.stl", &doubtful());
    let lines = format!("settle = \"30ms\"\n[[folders]]\npath = {:?}\nleave_originals = true\n", place.at("hot"));
    let config = place.put("suture.toml", lines.as_bytes());
    let watch = || place.suture(["watch", "--once", "--config", config.to_str().unwrap()]);
    watch().expect(1);
    let best = place.read("hot/failed/part.best.stl");
    ask(&place, &["approve", "1"]).expect(0);
    watch().expect(0);
    assert_eq!((place.read("hot/out/part.stl"), place.read("hot/in/part.stl")), (best, doubtful()));
    assert!(place.names("hot/failed").is_empty() && place.names("hot/done").is_empty());
    watch().expect(0);
    assert_eq!(jobs(&place, "hot").len(), 1, "it is not taken again");
}

#[test]
fn programs_approve_and_reject() {
    let place = Place::new();
    let daemon = Served::start(&place, &["hot", "--settle", "30ms", "--listen", "127.0.0.1:0"], "log");
    let client = Client::of(&daemon);
    for name in ["a.stl", "b.stl"] {
        place.put(&format!("hot/in/{name}"), &doubtful());
    }
    let state = |id: u64| client.get(&format!("/v1/jobs/{id}")).json()["state"].as_str().unwrap_or_default().to_owned();
    wait_until("both need review", || state(1) == "needs_review" && state(2) == "needs_review");
    let wish = |id: u64, wish: &str, body: &str| client.send("POST", &format!("/v1/jobs/{id}/{wish}"), &[], body.as_bytes());
    let long = format!("{{\"by\": \"{}\"}}", "b".repeat(65));
    for wrong in ["{", "{\"by\": 3}", "{\"who\": \"Ada\"}", "{\"by\": \"\"}", &long] {
        wish(1, "approve", wrong).expect(400);
    }
    wish(9, "approve", "").expect(404);
    wish(1, "approve", "{\"by\": \"Ada\", \"note\": \"fine\"}").expect(200);
    wait_until("it is published", || state(1) == "done");
    let job = client.get("/v1/jobs/1").expect(200).json();
    let words = ["verdict", "by", "note"].map(|word| job["decision"][word].as_str().unwrap_or_default());
    assert_eq!(words, ["approved", "Ada", "fine"]);
    client.get("/v1/jobs/1/result").expect(200);
    client.get("/v1/jobs/1/report").expect(200);
    wish(1, "approve", "").expect(409);
    let job = wish(2, "reject", "").expect(200).json();
    assert_eq!((&job["state"], &job["decision"]["by"]), (&"rejected".into(), &"local".into()));
    wish(2, "reject", "").expect(409);
    let rejected = client.get("/v1/jobs?state=rejected").expect(200).json();
    assert_eq!(rejected["jobs"].as_array().map(Vec::len), Some(1));
}
