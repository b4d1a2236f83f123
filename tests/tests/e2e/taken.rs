//! A result whose name is taken: the next name, a person's matter, or none at all, as the folder says.

use serde_json::Value;
use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::served::jobs;

/// A hot folder that goes by `on_taken`, with something of the result's name in `out/`, and a drop of that name.
fn taken(on_taken: &str, there: &str) -> Place {
    let place = Place::new();
    let text = format!("settle = \"30ms\"\n[[folders]]\npath = \"hot\"\n{on_taken}\n");
    place.put("suture.toml", text.as_bytes());
    place.put(&format!("hot/out/{there}"), b"theirs");
    place.put("hot/in/part.stl", &holes(1));
    place
}

fn once(place: &Place, code: i32) {
    place.suture(["watch", "--once", "--config", "suture.toml"]).expect(code);
}

fn only_job(place: &Place) -> Value {
    let mut all = jobs(place, "hot");
    assert_eq!(all.len(), 1, "{all:?}");
    all.remove(0)
}

fn reason(job: &Value) -> &str {
    job["state"]["ended"]["publication"]["reason"].as_str().unwrap()
}

fn read(place: &Place, name: &str) -> Value {
    serde_json::from_slice(&place.read(name)).unwrap()
}

#[test]
fn f23_a_second_result_has_the_next_name_unless_the_folder_says_otherwise() {
    for setting in ["", "on_taken = \"version\""] {
        let place = taken(setting, "part.stl");
        once(&place, 0);
        assert_eq!(place.read("hot/out/part.stl"), b"theirs");
        assert_eq!(read(&place, "hot/out/part~2.stl.suture.json")["output"], "part~2.stl");
    }
}

/// Whoever wants a file worked on anew wants its result.
#[test]
fn forced_work_has_the_next_name_whatever_the_folder_says() {
    for on_taken in ["fail", "skip"] {
        let place = taken(&format!("on_taken = \"{on_taken}\""), "part.stl");
        place.put("hot/in/!force/part.stl", &holes(1));
        std::fs::remove_file(place.at("hot/in/part.stl")).unwrap();
        once(&place, 0);
        assert_eq!((place.read("hot/out/part.stl"), only_job(&place)["kind"].as_str()), (b"theirs".to_vec(), Some("done")));
        assert_eq!(read(&place, "hot/out/part~2.stl.suture.json")["output"], "part~2.stl", "{on_taken}");
    }
}

/// Nothing is repaired and nothing replaced; the name free again, a retry goes through.
#[test]
fn f23_a_taken_name_is_a_persons_matter_where_the_folder_says_so() {
    for there in ["part.stl", "part.stl.report.json"] {
        let place = taken("on_taken = \"fail\"", there);
        once(&place, 1);
        assert_eq!(place.read(&format!("hot/out/{there}")), b"theirs");
        assert_eq!((place.read("hot/failed/part.stl"), place.names("hot/out").len()), (holes(1), 1));
        let job = only_job(&place);
        assert_eq!((&job["kind"], &job["state"]["ended"]["publication"]["ending"]), (&"failed".into(), &"name_taken".into()));
        assert!(reason(&job).contains(&format!("out/{there} is there already")) && reason(&job).contains("retry 1"), "{job}");
        let report = read(&place, "hot/failed/part.stl.report.json");
        assert_eq!((&report["outcome"], &report["reason"]), (&"name_taken".into(), &reason(&job).into()));

        place.suture(["jobs", "retry", "1", "--dir", "hot"]).expect(0);
        once(&place, 1);
        assert_eq!((only_job(&place)["kind"].as_str(), place.names("hot/failed").len()), (Some("failed"), 3));
        std::fs::remove_file(place.at(&format!("hot/out/{there}"))).unwrap();
        place.suture(["jobs", "retry", "1", "--dir", "hot"]).expect(0);
        once(&place, 0);
        assert_eq!((only_job(&place)["kind"].as_str(), place.names("hot/failed").len()), (Some("done"), 0));
        assert_eq!((place.read("hot/done/part.stl"), place.names("hot/out").len()), (holes(1), 3));
    }
}

/// The original counts as done, and report, receipt and list say why there is no result; a store that is lost knows it from them.
#[test]
fn f23_a_taken_name_is_skipped_where_the_folder_says_so() {
    let place = taken("on_taken = \"skip\"", "part.stl");
    once(&place, 0);
    assert_eq!(place.read("hot/out/part.stl"), b"theirs");
    assert_eq!((place.read("hot/done/part~2.stl"), place.names("hot/failed").len()), (holes(1), 0));
    assert_eq!(place.names("hot/out"), ["part.stl", "part~2.stl.report.json", "part~2.stl.suture.json"]);
    let job = only_job(&place);
    assert_eq!((&job["kind"], reason(&job)), (&"done".into(), "skipped: out/part.stl is there already"));
    let report = read(&place, "hot/out/part~2.stl.report.json");
    assert_eq!((&report["outcome"], &report["reason"]), (&"skipped".into(), &reason(&job).into()));
    let listed = place.suture(["jobs", "list", "--dir", "hot"]).expect(0).stdout();
    assert!(listed.contains("skipped: out/part.stl is there already"), "{listed}");
    let refused = place.suture(["jobs", "retry", "1", "--dir", "hot"]).expect(2).stderr();
    assert!(refused.contains("skipped") && refused.contains("done/part~2.stl"), "{refused}");

    std::fs::remove_dir_all(place.at("hot/.suture/state")).unwrap();
    once(&place, 0);
    let again = only_job(&place);
    assert_eq!((&again["id"], &again["kind"], reason(&again)), (&job["id"], &job["kind"], reason(&job)));

    // The same file once more: each drop has its own word, and what is there stays.
    place.put("hot/in/part.stl", &holes(1));
    once(&place, 0);
    assert_eq!((place.read("hot/out/part.stl"), place.read("hot/done/part~3.stl")), (b"theirs".to_vec(), holes(1)));
    assert_eq!(read(&place, "hot/out/part~3.stl.report.json")["outcome"], "skipped");
}
