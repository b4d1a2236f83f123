//! The files of a sub-folder belong together: one summary tells what became of an order.

use serde_json::Value;
use suture_tests::hot::holes;
use suture_tests::{Place, Ran};

const SUMMARY: &str = "hot/out/order-123/order.report.json";
const PICTURE: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR";

fn once(place: &Place) -> Ran {
    place.suture(["watch", "hot", "--once", "--settle", "30ms"])
}

fn summary(place: &Place, name: &str) -> Value {
    serde_json::from_slice(&place.read(name)).unwrap()
}

/// Of each file its name, what became of it, and where its result is.
fn files(summary: &Value) -> Vec<(String, String, String)> {
    let text = |value: &Value| value.as_str().unwrap_or("-").to_owned();
    let files = summary["files"].as_array().unwrap().iter();
    files.map(|file| (text(&file["source"]), text(&file["kind"]), text(&file["result"]))).collect()
}

fn row(source: &str, kind: &str, result: &str) -> (String, String, String) {
    (source.into(), kind.into(), result.into())
}

#[test]
fn an_order_is_summed_up_when_it_is_done_and_when_a_file_comes_later() {
    let place = Place::new();
    for (name, bytes) in
        [("a.stl", holes(1)), ("deep/b.stl", holes(2)), ("bad.stl", PICTURE.to_vec()), ("notes.txt", b"by air".to_vec())]
    {
        place.put(&format!("hot/in/order-123/{name}"), &bytes);
    }
    let ran = once(&place).expect(1);
    let mut expected = vec![
        row("order-123/a.stl", "done", "out/order-123/a.stl"),
        row("order-123/bad.stl", "failed", "-"),
        row("order-123/deep/b.stl", "done", "out/order-123/deep/b.stl"),
        row("order-123/notes.txt", "noticed", "-"),
    ];
    let first = summary(&place, SUMMARY);
    assert_eq!(files(&first), expected);
    assert_eq!((&first["order"], &first["folder"]), (&"order-123".into(), &"hot".into()));
    assert_eq!(first["counts"], serde_json::json!({"noticed": 1, "done": 2, "failed": 1}));
    let bad = &first["files"][1];
    assert_eq!(bad["original"], "failed/order-123/bad.stl");
    assert!(place.at("hot").join(bad["report"].as_str().unwrap()).exists() && !bad["reason"].as_str().unwrap().is_empty());
    let told: Vec<_> = ran.stderr().lines().filter(|line| line.contains("An order is done")).map(str::to_owned).collect();
    assert!(told.len() == 1 && told[0].contains("4 files: 1 noticed, 2 done, 1 failed (order-123/bad.stl: "), "{told:?}");

    // The failed one, mended, and one more.
    place.put("hot/in/order-123/bad.stl", &holes(3));
    place.put("hot/in/order-123/c.stl", &holes(4));
    once(&place).expect(0);
    // The one that failed is still told of, and counts no more.
    expected.insert(2, row("order-123/bad.stl", "done", "out/order-123/bad.stl"));
    expected.insert(3, row("order-123/c.stl", "done", "out/order-123/c.stl"));
    let second = summary(&place, SUMMARY);
    assert_eq!(files(&second), expected);
    assert_eq!((&second["files"][1]["later"], &second["files"][2]["later"]), (&second["files"][2]["job"], &Value::Null));
    assert_eq!(second["counts"], serde_json::json!({"noticed": 1, "done": 4}));
    assert_eq!(place.names("hot/out").iter().filter(|name| name.contains("order.report")).count(), 1);
    let told = |ran: &Ran| ran.stderr().contains("An order is done");
    assert!(!told(&once(&place).expect(0)), "nothing is new");
}

/// Whatever a kill left undone: the summary is made of the store, and says the same.
#[test]
fn a_summary_that_was_not_made_is_made_in_the_next_life() {
    let place = Place::new();
    place.put("hot/in/order-123/a.stl", &holes(1));
    once(&place).expect(0);
    let before = place.read(SUMMARY);
    std::fs::remove_file(place.at(SUMMARY)).unwrap();
    once(&place).expect(0);
    assert!(!place.at(SUMMARY).exists(), "someone took it, and it is not made again for nothing");
    std::fs::write(place.at("hot/.suture/orders"), b"0\n").unwrap();
    once(&place).expect(0);
    assert_eq!(place.read(SUMMARY), before);
}

#[test]
fn a_profiles_folder_is_no_order_and_a_summary_is_no_drop() {
    let place = Place::new();
    place.put("hot/in/scan/a.stl", &holes(1));
    place.put("hot/in/scan/order-7/b.stl", &holes(2));
    place.put("hot/in/c.stl", &holes(3));
    once(&place).expect(0);
    let summaries = |part: &str| -> Vec<String> {
        place.names(part).into_iter().filter(|name| name.ends_with("order.report.json")).collect()
    };
    assert_eq!(summaries("hot/out"), ["scan/order-7/order.report.json"]);
    assert_eq!(files(&summary(&place, "hot/out/scan/order-7/order.report.json")).len(), 1);
    // Copied back with everything else.
    for name in place.names("hot/out") {
        place.put(&format!("hot/in/again/{name}"), &place.read(&format!("hot/out/{name}")));
    }
    once(&place).expect(0);
    let jobs = place.suture(["jobs", "list", "--dir", "hot"]).expect(0).stdout();
    assert!(!jobs.contains(".json") && jobs.contains("6 done"), "{jobs}");
}
