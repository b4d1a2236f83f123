//! The profiles that come with the product, on files and in a hot folder.

use serde_json::{Value, json};
use suture_bench::generate::Case;
use suture_bench::judge::judge;
use suture_tests::Place;
use suture_tests::hot::mesh;

/// What is good is passed on as it is, under its name and with its report; of anything else nothing is written but the report.
#[test]
fn inspect_only_repairs_nothing() {
    let place = Place::new();
    let (clean, holes) = (mesh(Case::Clean, 1), mesh(Case::Holes, 1));
    place.put("clean.stl", &clean);
    place.put("holes.stl", &holes);
    let options = ["--profile", "inspect-only", "--report"];
    let report = place.repair("clean.stl", "out.stl", &[&options[..], &["clean.json"]].concat()).expect(0).report();
    assert_eq!((&report["outcome"], &report["profile"]["repair"]), (&"clean".into(), &false.into()));
    assert_eq!(place.read("out.stl"), clean);
    let report = place.repair("holes.stl", "none.stl", &[&options[..], &["holes.json"]].concat()).expect(1).report();
    assert_eq!((&report["outcome"], &report["output"], &report["repairs"]), (&"not_good".into(), &Value::Null, &json!([])));
    assert!(report["before"]["boundary_edges"].as_u64() > Some(0) && !report["loops"]["listed"].as_array().unwrap().is_empty());
    assert_eq!(
        place.names(""),
        ["clean.json", "clean.stl", "holes.json", "holes.stl", "out.stl"],
        "of the other, the report alone"
    );

    let said = place.suture(["repair", "holes.stl", "-o", "none.stl", "--profile", "inspect-only"]).expect(1).stdout();
    assert!(said.starts_with("holes.stl: NOT GOOD, and nothing was repaired"), "{said}");
    assert!(said.contains("the profile `inspect-only` says `repair = false`") && said.contains("  wrote   nothing\n"), "{said}");
}

#[test]
fn inspect_only_in_a_hot_folder_sorts() {
    let place = Place::new();
    let (clean, holes) = (mesh(Case::Clean, 1), mesh(Case::Holes, 1));
    place.put("hot/in/inspect-only/clean.stl", &clean);
    place.put("hot/in/inspect-only/holes.stl", &holes);
    place.suture(["watch", "hot", "--once", "--settle", "50ms"]).expect(1);
    let beside = |name: &str| ["", ".report.json", ".suture.json"].map(|end| format!("inspect-only/{name}{end}"));
    assert_eq!(place.names("hot/out"), beside("clean.stl"));
    assert_eq!(place.read("hot/out/inspect-only/clean.stl"), clean, "byte for byte");
    assert_eq!(place.names("hot/done"), ["inspect-only/clean.stl"]);
    assert_eq!(place.names("hot/failed"), beside("holes.stl"), "there is no best attempt");
    assert_eq!(place.read("hot/failed/inspect-only/holes.stl"), holes);
    let report: Value = serde_json::from_slice(&place.read("hot/failed/inspect-only/holes.stl.report.json")).unwrap();
    assert_eq!((&report["outcome"], &report["output"]), (&"not_good".into(), &Value::Null));
    assert!(place.names("hot/in").is_empty());
}

/// Each sub-folder of that name has its profile. Without shaping, only holes that are small against their surface need no look.
#[test]
fn fast_and_strict_in_a_hot_folder() {
    let place = Place::new();
    let (holes, _) = place.generate(Case::Holes, 20_000, 1);
    let holes = std::fs::read(holes).unwrap();
    for name in ["fast", "strict"] {
        place.put(&format!("hot/in/{name}/holes.stl"), &holes);
    }
    let code = place.suture(["watch", "hot", "--once", "--settle", "50ms"]).code();
    assert!(judge(&place.at("hot/out/fast/holes.stl")).unwrap().sound());
    let report = |path: &str| -> Value { serde_json::from_slice(&place.read(path)).unwrap() };
    let fast = report("hot/out/fast/holes.stl.report.json");
    assert_eq!((&fast["outcome"], &fast["verdict"]["unchecked"]), (&"repaired".into(), &json!(["self-intersection"])));
    // Whatever it makes of these holes, it says so in its limits.
    let part = if code == 0 { "out" } else { "failed" };
    let strict = report(&format!("hot/{part}/strict/holes.stl.report.json"));
    assert_eq!((&strict["profile"]["guarantee"], &strict["profile"]["max_volume_change"]), (&"strict".into(), &0.01.into()));
    assert_eq!(strict["verdict"]["unchecked"], json!([]));
}

/// A hint on walls is the same whatever the limits, is shown to people, and changes no byte.
#[test]
fn thin_walls_are_told_of_and_change_nothing() {
    let place = Place::new();
    place.generate(Case::Holes, 24_000, 7);
    place.put("walls.toml", b"thin_wall_mm = 28.0\n");
    let input = format!("{}.stl", Case::Holes);
    let run = |profile: &str, chunk: &str, threads: &str, memory: &str, spill: &str| {
        let limits = ["--chunk-triangles", chunk, "--threads", threads, "--memory", memory, "--spill", spill];
        let options = [&["--profile", profile, "--force", "--report", "report.json"][..], &limits[..]].concat();
        let said = place.repair(&input, "out.stl", &options).expect(0).stdout();
        let report: Value = serde_json::from_slice(&place.read("report.json")).unwrap();
        (report["thin_walls"].clone(), report["hints"].clone(), place.read("out.stl"), said)
    };
    let (walls, hints, bytes, said) = run("walls.toml", "100000", "1", "1GiB", "never");
    assert!(walls["points"].as_u64() > Some(1000) && walls["share"].as_f64() > Some(0.0), "{walls}");
    assert!(said.contains("walls are thinner than 28 mm"), "{said}");
    for (chunk, threads, memory, spill) in
        [("64", "2", "64MiB", "always"), ("1000", "2", "1GiB", "auto"), ("100000", "2", "64MiB", "never")]
    {
        let other = run("walls.toml", chunk, threads, memory, spill);
        assert!(
            other.2 == bytes && (&other.0, &other.1) == (&walls, &hints),
            "{threads} threads, {memory}: {} instead of {walls}",
            other.0
        );
    }
    let without = run("default", "100000", "2", "1GiB", "never");
    assert!(without.2 == bytes && without.0.is_null() && !without.3.contains("walls"), "{}", without.3);
    run("walls.toml", "100000", "2", "1GiB", "never");
    place.suture(["report", "report.json", "-o", "page.html"]).expect(0);
    assert!(String::from_utf8(place.read("page.html")).unwrap().contains("Thin walls"));
}
