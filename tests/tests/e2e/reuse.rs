//! The same content again: a copy of the earlier result under its own name, or, where that is not what it was, the work anew.

use std::os::unix::fs::MetadataExt;

use serde_json::Value;
use suture_bench::generate::{Case, write};
use suture_tests::Place;

fn mesh(case: Case, seed: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(case, 600, seed, &mut bytes).unwrap();
    bytes
}

fn once(place: &Place, code: i32) {
    place.suture(["watch", "hot", "--once", "--settle", "30ms"]).expect(code);
}

fn json(place: &Place, name: &str) -> Value {
    serde_json::from_slice(&place.read(name)).unwrap()
}

/// What a job says of where its result is from, by the name of the dropped file.
fn reused(place: &Place, name: &str) -> Value {
    let listed = place.suture(["jobs", "list", "--json", "--dir", "hot"]).expect(0).stdout();
    let mut jobs = listed.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let job = jobs.find(|job| job["source"]["path"] == name).unwrap_or_else(|| panic!("{name}: {listed}"));
    assert!(job["kind"] != "queued" && job["reused"] == job["state"]["ended"]["publication"]["reused"], "{job}");
    job["reused"].clone()
}

/// A result, and a second drop of the content it was made of.
fn second_drop(case: Case, name: &str) -> Place {
    let place = Place::new();
    place.put("hot/in/first.stl", &mesh(case, 1));
    once(&place, 0);
    place.put(&format!("hot/in/{name}"), &mesh(case, 1));
    place
}

#[test]
fn the_same_content_has_a_copy_of_the_result_with_report_and_receipt() {
    for case in [Case::Holes, Case::Clean] {
        let place = second_drop(case, "second.stl");
        once(&place, 0);
        assert_eq!((reused(&place, "first.stl"), reused(&place, "second.stl")), (Value::Null, 1.into()));
        assert_eq!(place.read("hot/out/second.stl"), place.read("hot/out/first.stl"));
        assert_eq!((place.read("hot/done/second.stl"), place.names("hot/in").len()), (mesh(case, 1), 0));
        // Each is a file of its own.
        let [first, second] = ["first", "second"].map(|name| place.at(&format!("hot/out/{name}.stl")).metadata().unwrap());
        assert!(first.ino() != second.ino() && second.nlink() == 1 && first.mode() == second.mode());

        let [first, second] = ["first", "second"].map(|name| json(&place, &format!("hot/out/{name}.stl.report.json")));
        assert_eq!(
            (&first["reused"], &second["reused"]["job"], &second["reused"]["output"]),
            (&Value::Null, &1.into(), &"first.stl".into())
        );
        assert!(second["input"]["path"].as_str().unwrap().ends_with("/in/second.stl"), "{}", second["input"]);
        assert!(second["output"]["path"].as_str().unwrap().ends_with("/out/second.stl"), "{}", second["output"]);
        assert_eq!((&first["before"], &first["certificate"]), (&second["before"], &second["certificate"]));
        let receipt = json(&place, "hot/out/second.stl.suture.json");
        assert_eq!((&receipt["job"], &receipt["reused"], &receipt["output"]), (&2.into(), &1.into(), &"second.stl".into()));
        assert_eq!(receipt["output_blake3"], json(&place, "hot/out/first.stl.suture.json")["output_blake3"]);
        assert_eq!(receipt["source_blake3"], second["input"]["blake3"]);

        // The certificate is of this file, too.
        let options = ["inspect", "hot/out/second.stl", "--certificate", "hot/out/second.stl.report.json", "--original"];
        place.suture(options.iter().chain(&["hot/done/second.stl"])).expect(0);
        let listed = place.suture(["jobs", "list", "--dir", "hot"]).expect(0).stdout();
        assert!(listed.contains("→ out/second.stl, reused from job 1") && listed.contains("2 done (1 reused)"), "{listed}");
        place.suture(["jobs", "show", "2", "--dir", "hot"]).expect(0);
    }
}

/// Whoever edits or takes away a result gets it made anew for the next drop; a copy is as good a source as what was computed.
#[test]
fn a_result_that_is_not_what_it_was_is_made_anew() {
    let place = second_drop(Case::Holes, "second.stl");
    let result = place.read("hot/out/first.stl");
    let mut edited = result.clone();
    edited[100] ^= 1;
    place.put("hot/out/first.stl", &edited);
    once(&place, 0);
    assert_eq!((reused(&place, "second.stl"), place.read("hot/out/second.stl")), (Value::Null, result.clone()));
    assert_eq!(place.read("hot/out/first.stl"), edited, "what a person made of it stays");

    place.put("hot/in/third.stl", &mesh(Case::Holes, 1));
    once(&place, 0);
    assert_eq!(reused(&place, "third.stl"), 2);
    std::fs::remove_file(place.at("hot/out/second.stl")).unwrap();
    place.put("hot/in/fourth.stl", &mesh(Case::Holes, 1));
    once(&place, 0);
    assert_eq!((reused(&place, "fourth.stl"), place.read("hot/out/fourth.stl")), (3.into(), result.clone()));
    for name in ["third", "fourth"] {
        std::fs::remove_file(place.at(&format!("hot/out/{name}.stl"))).unwrap();
    }
    place.put("hot/in/fifth.stl", &mesh(Case::Holes, 1));
    once(&place, 0);
    assert_eq!((reused(&place, "fifth.stl"), place.read("hot/out/fifth.stl")), (Value::Null, result));
}

/// Other settings, or none of it at all.
#[test]
fn other_settings_are_other_results() {
    let place = second_drop(Case::Holes, "scan/second.stl");
    place.put("hot/in/mine/.suture.toml", b"max_hole_edges = 19999\n");
    place.put("hot/in/mine/third.stl", &mesh(Case::Holes, 1));
    once(&place, 0);
    assert_eq!((reused(&place, "scan/second.stl"), reused(&place, "mine/third.stl")), (Value::Null, Value::Null));
    place.put("hot/in/scan/fourth.stl", &mesh(Case::Holes, 1));
    once(&place, 0);
    assert_eq!(reused(&place, "scan/fourth.stl"), reused_id(&place, "scan/second.stl"));

    let place = second_drop(Case::Holes, "second.stl");
    place.put("suture.toml", b"reuse = false\nsettle = \"30ms\"\n[[folders]]\npath = \"hot\"\n");
    place.suture(["watch", "--once", "--config", "suture.toml"]).expect(0);
    assert_eq!((reused(&place, "second.stl"), place.read("hot/out/second.stl")), (Value::Null, place.read("hot/out/first.stl")));
}

fn reused_id(place: &Place, name: &str) -> Value {
    let listed = place.suture(["jobs", "list", "--json", "--dir", "hot"]).expect(0).stdout();
    let mut jobs = listed.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    jobs.find(|job| job["source"]["path"] == name).unwrap()["id"].clone()
}

/// `!force` is a word, not a place: all but the work is as it would be without it.
#[test]
fn what_is_forced_is_worked_on_anew_and_goes_where_it_would_go_anyway() {
    let place = second_drop(Case::Holes, "!force/first.stl");
    place.put("hot/in/scan/order/!force/a.stl", &mesh(Case::Holes, 1));
    place.put("hot/in/!force/scan/order/b.stl", &mesh(Case::Holes, 1));
    once(&place, 0);
    for name in ["!force/first.stl", "scan/order/!force/a.stl", "!force/scan/order/b.stl"] {
        assert_eq!(reused(&place, name), Value::Null, "{name}");
    }
    assert_eq!(place.read("hot/out/first~2.stl"), place.read("hot/out/first.stl"));
    let receipt = json(&place, "hot/out/first~2.stl.suture.json");
    assert_eq!((&receipt["source"], &receipt["profile"]), (&"!force/first.stl".into(), &"default".into()));
    for name in ["a", "b"] {
        assert_eq!(json(&place, &format!("hot/out/scan/order/{name}.stl.suture.json"))["profile"], "scan");
    }
    let order = json(&place, "hot/out/scan/order/order.report.json");
    assert_eq!((&order["order"], &order["counts"]["done"]), (&"scan/order".into(), &2.into()), "{order}");
    let names = ["out", "done", "in"].map(|part| place.names(&format!("hot/{part}")));
    assert!(names.iter().flatten().all(|name| !name.contains("!force")), "{names:?}");

    // Its result is one like any other.
    place.put("hot/in/later.stl", &mesh(Case::Holes, 1));
    once(&place, 0);
    assert_eq!(reused(&place, "later.stl"), reused_id(&place, "!force/first.stl"));
    // In an order, it takes the place of the file of that name.
    place.put("hot/in/scan/!force/order/a.stl", &mesh(Case::Holes, 1));
    once(&place, 0);
    let order = json(&place, "hot/out/scan/order/order.report.json");
    let files = order["files"].as_array().unwrap().iter().filter(|file| file.get("later").is_none());
    let mut results: Vec<_> = files.filter_map(|file| file["result"].as_str()).collect();
    results.sort_unstable();
    assert_eq!(results, ["out/scan/order/a~2.stl", "out/scan/order/b.stl"], "{order}");
}

/// Where originals stay, a forced one is done once, also when the state is lost.
#[test]
fn what_is_forced_and_stays_is_worked_on_once() {
    let place = Place::new();
    place.put("suture.toml", b"settle = \"30ms\"\n[[folders]]\npath = \"hot\"\nleave_originals = true\n");
    let once = || place.suture(["watch", "--once", "--config", "suture.toml"]).expect(0);
    for name in ["a.stl", "!force/a.stl"] {
        place.put(&format!("hot/in/{name}"), &mesh(Case::Holes, 1));
        once();
    }
    let before = place.names("hot/out");
    assert_eq!(before.iter().filter(|name| name.ends_with(".stl")).collect::<Vec<_>>(), ["a.stl", "a~2.stl"]);
    once();
    std::fs::remove_dir_all(place.at("hot/.suture/state")).unwrap();
    once();
    assert_eq!(place.names("hot/out"), before);
}

/// The same content after a failure is tried again, and so is what an operator wants retried.
#[test]
fn a_failure_is_never_reused() {
    let place = Place::new();
    // The cautious profile closes nothing.
    let settings = |profile: &str| {
        let text = format!("settle = \"30ms\"\n[[folders]]\npath = \"hot\"\n[profiles.mine]\n{profile}\n");
        place.put("suture.toml", text.as_bytes());
    };
    let once = |code| place.suture(["watch", "--once", "--config", "suture.toml"]).expect(code);
    settings("fill_holes = false\ngap_edge_share = 0.0\nguarantee = \"strict\"");
    place.put("hot/in/mine/first.stl", &mesh(Case::Holes, 1));
    once(1);
    place.put("hot/in/mine/second.stl", &mesh(Case::Holes, 1));
    once(1);
    assert_eq!((reused(&place, "mine/second.stl"), place.names("hot/out").len()), (Value::Null, 0));
    settings("");
    place.put("hot/in/mine/third.stl", &mesh(Case::Holes, 1));
    once(0);
    place.suture(["jobs", "retry", "1", "--dir", "hot"]).expect(0);
    once(0);
    assert_eq!(reused(&place, "mine/first.stl"), Value::Null, "computed, although there is a result");
    assert_eq!(place.read("hot/out/mine/first.stl"), place.read("hot/out/mine/third.stl"));
    place.put("hot/in/mine/fourth.stl", &mesh(Case::Holes, 1));
    once(0);
    assert_eq!(reused(&place, "mine/fourth.stl"), 3, "the latest by number");
}
