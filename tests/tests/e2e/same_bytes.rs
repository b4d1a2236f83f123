//! Promise 1: chunk size, threads, memory and spilling never change the output.

use serde_json::Value;
use suture_bench::generate::Case;
use suture_tests::Place;

/// What a report says of the result rather than of the way there.
fn result_of(report: &Value) -> Value {
    let fields = ["outcome", "before", "after", "tolerances", "loops_left", "edit", "edit_records", "verdict"];
    let mut result: Value = fields.iter().map(|field| ((*field).to_owned(), report[field].clone())).collect();
    result["blake3"] = report["output"]["blake3"].clone();
    let repairs = report["repairs"].as_array().unwrap().iter();
    result["repairs"] = repairs.map(|r| serde_json::json!([r["name"], r["count"], r["note"]])).collect();
    result
}

fn same_bytes(case: Case) {
    let place = Place::new();
    // More than 1 MiB: two threads copy the input ahead, one does not.
    place.generate(case, 24_000, 7);
    let input = format!("{case}.stl");
    let run = |chunk: &str, threads: &str, memory: &str, spill: &str| {
        let limits = ["--chunk-triangles", chunk, "--threads", threads, "--memory", memory, "--spill", spill];
        let options = [&limits[..], &["--list-edit", "--force"]].concat();
        let report = place.repair(&input, "out.stl", &[&options[..], &["--report", "report.json"]].concat()).expect(0);
        drop(report);
        (result_of(&serde_json::from_slice(&place.read("report.json")).unwrap()), place.read("out.stl"))
    };
    let first = run("100000", "1", "1GiB", "never");
    for chunk in ["64", "1000", "100000"] {
        for threads in ["1", "2"] {
            for (memory, spill) in [("64MiB", "auto"), ("64MiB", "always"), ("1GiB", "always"), ("1GiB", "never")] {
                let other = run(chunk, threads, memory, spill);
                let what = format!("{case}: chunks of {chunk}, {threads} threads, {memory}, spill {spill}");
                assert!(other.1 == first.1, "{what}: other bytes");
                assert_eq!(other.0, first.0, "{what}");
            }
        }
    }
}

#[test]
fn mixed() {
    same_bytes(Case::Mixed);
}

/// More triangles go than come: behind the first gap, everything moves up.
#[test]
fn duplicates() {
    same_bytes(Case::Duplicates);
}

#[test]
fn holes_of_two_bodies() {
    same_bytes(Case::TwoBodies);
}

#[test]
fn soup() {
    same_bytes(Case::Soup);
}

#[test]
fn shuffled() {
    same_bytes(Case::Shuffled);
}

#[test]
fn huge_fan() {
    same_bytes(Case::HugeFan);
}
