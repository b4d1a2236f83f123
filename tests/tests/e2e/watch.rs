//! The hot folder, worked through once: each dropped file ends in exactly one place.

use serde_json::Value;
use suture_bench::generate::{Case, write};
use suture_bench::judge::judge;
use suture_tests::{Place, Ran};

fn mesh(case: Case, seed: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(case, 600, seed, &mut bytes).unwrap();
    bytes
}

fn once(place: &Place) -> Ran {
    place.suture(["watch", "hot", "--once", "--settle", "50ms"])
}

/// `suture jobs list --json`, by the name of the dropped file.
fn jobs(place: &Place) -> Vec<(String, Value)> {
    let listed = place.suture(["jobs", "list", "--json", "--dir", "hot"]).expect(0).stdout();
    let mut jobs: Vec<_> = listed
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap())
        .map(|job| (job["source"]["path"].as_str().unwrap_or_else(|| panic!("{job}")).to_owned(), job))
        .collect();
    jobs.sort_by(|a, b| a.0.cmp(&b.0));
    jobs
}

/// Meshes among names: results and originals come with reports and receipts.
fn meshes(names: &[String]) -> Vec<&str> {
    names.iter().map(String::as_str).filter(|name| !name.ends_with(".json")).collect()
}

/// A square, which can be no body.
fn lone_sheet() -> Vec<u8> {
    let corners: [[f32; 3]; 6] =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let mut bytes = [&[0; 80][..], &2_u32.to_le_bytes()].concat();
    for triangle in corners.chunks_exact(3) {
        bytes.extend([0; 12]);
        bytes.extend(triangle.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn each_file_ends_in_its_place() {
    let place = Place::new();
    let (clean, holes, sheet) = (mesh(Case::Clean, 1), mesh(Case::Holes, 1), lone_sheet());
    place.put("hot/in/clean.stl", &clean);
    place.put("hot/in/holes.STL", &holes);
    place.put("hot/in/scan/holes.stl", &holes);
    place.put("hot/in/sheet.stl", &sheet);
    place.put("hot/in/picture.stl", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
    let left = ["copying.stl.part", "download.stl.crdownload", "x.tmp", ".hidden.stl", "~$part.stl", "notes.txt", "part.iges"];
    for name in left {
        place.put(&format!("hot/in/{name}"), &holes);
    }
    let ran = once(&place).expect(1);

    assert_eq!(meshes(&place.names("hot/out")), ["clean.stl", "holes.STL", "scan/holes.stl"]);
    assert_eq!(place.read("hot/out/clean.stl"), clean, "a clean file is passed on byte for byte");
    assert!(judge(&place.at("hot/out/holes.STL")).unwrap().sound());
    assert!(judge(&place.at("hot/out/scan/holes.stl")).unwrap().sound());
    assert_eq!(meshes(&place.names("hot/done")), ["clean.stl", "holes.STL", "scan/holes.stl"]);
    assert_eq!(place.read("hot/done/holes.STL"), holes, "originals are kept");

    let failed = place.names("hot/failed");
    assert!(
        ["picture.stl", "picture.stl.report.json", "sheet.stl", "sheet.stl.report.json"]
            .iter()
            .all(|name| failed.iter().any(|there| there == name)),
        "{failed:?}"
    );
    assert_eq!(place.read("hot/failed/sheet.stl"), sheet);
    assert!(failed.iter().any(|name| name.starts_with("sheet") && name.contains("best")), "the best attempt: {failed:?}");
    let report: Value = serde_json::from_slice(&place.read("hot/failed/sheet.stl.report.json")).unwrap();
    assert_eq!((&report["outcome"], &report["verdict"]["closed"]), (&"not_good".into(), &false.into()));
    let report: Value = serde_json::from_slice(&place.read("hot/failed/picture.stl.report.json")).unwrap();
    assert!(report["reason"].as_str().unwrap().contains("PNG"), "{report}");
    assert!(place.names("hot/quarantine").is_empty());

    let mut waiting = left.map(str::to_owned);
    waiting.sort();
    assert_eq!(place.names("hot/in"), waiting, "what is no mesh, or not finished, stays");

    let kinds: Vec<_> = jobs(&place).into_iter().map(|(name, job)| (name, job["kind"].as_str().unwrap().to_owned())).collect();
    let expected = [
        ("clean.stl", "done"),
        ("holes.STL", "done"),
        ("notes.txt", "noticed"),
        ("part.iges", "noticed"),
        ("picture.stl", "failed"),
        ("scan/holes.stl", "done"),
        ("sheet.stl", "failed"),
    ];
    assert_eq!(kinds, expected.map(|(name, kind)| (name.to_owned(), kind.to_owned())));
    assert_eq!(ran.stderr().matches("part.iges").count(), 1, "named once: {}", ran.stderr());
}

#[test]
fn good_files_alone_are_code_0_and_results_have_reports_and_receipts() {
    let place = Place::new();
    place.put("hot/in/holes.stl", &mesh(Case::Holes, 1));
    once(&place).expect(0);
    assert_eq!(place.names("hot/out"), ["holes.stl", "holes.stl.report.json", "holes.stl.suture.json"]);
    assert_eq!(place.names("hot/in"), [""; 0]);
    let report: Value = serde_json::from_slice(&place.read("hot/out/holes.stl.report.json")).unwrap();
    let receipt: Value = serde_json::from_slice(&place.read("hot/out/holes.stl.suture.json")).unwrap();
    assert_eq!(report["outcome"], "repaired");
    assert_eq!(receipt["output_blake3"], report["output"]["blake3"]);
    assert_eq!(receipt["source_blake3"], report["input"]["blake3"]);
}

#[test]
fn names_that_are_taken_are_left_alone() {
    let place = Place::new();
    let (first, second) = (mesh(Case::Holes, 1), mesh(Case::Holes, 2));
    place.put("hot/out/part.stl", b"someone else's");
    place.put("hot/in/part.stl", &first);
    once(&place).expect(0);
    place.put("hot/in/part.stl", &second);
    once(&place).expect(0);
    assert_eq!(meshes(&place.names("hot/out")), ["part.stl", "part~2.stl", "part~3.stl"]);
    assert_eq!(place.read("hot/out/part.stl"), b"someone else's");
    let done = place.names("hot/done");
    let originals: Vec<_> = meshes(&done).iter().map(|name| place.read(&format!("hot/done/{name}"))).collect();
    assert_eq!(originals.len(), 2);
    assert!(originals.contains(&first) && originals.contains(&second));
}

/// Each name gets its own result, also when contents are equal.
#[test]
fn equal_contents_are_results_of_their_own() {
    let place = Place::new();
    let holes = mesh(Case::Holes, 1);
    place.put("hot/in/a.stl", &holes);
    place.put("hot/in/b.stl", &holes);
    once(&place).expect(0);
    assert_eq!(meshes(&place.names("hot/out")), ["a.stl", "b.stl"]);
    assert_eq!(place.read("hot/out/a.stl"), place.read("hot/out/b.stl"));
    assert_eq!(jobs(&place).len(), 2);
}

#[test]
fn result_is_what_repair_writes() {
    let place = Place::new();
    let mixed = mesh(Case::Mixed, 3);
    place.put("mixed.stl", &mixed);
    place.put("hot/in/mixed.stl", &mixed);
    place.repair("mixed.stl", "out.stl", &[]).expect(0);
    once(&place).expect(0);
    assert_eq!(place.read("hot/out/mixed.stl"), place.read("out.stl"));
}

#[test]
fn sub_folder_names_the_profile() {
    let place = Place::new();
    let holes = mesh(Case::Holes, 1);
    place.put("hot/in/cautious/holes.stl", &holes);
    place.put("hot/in/order 7/holes.stl", &holes);
    // The cautious profile closes nothing.
    once(&place).expect(1);
    assert_eq!(meshes(&place.names("hot/out")), ["order 7/holes.stl"]);
    assert!(place.names("hot/failed").iter().any(|name| name == "cautious/holes.stl"));
    let profiles: Vec<_> = jobs(&place).into_iter().map(|(name, job)| (name, job["source"]["profile"].clone())).collect();
    assert_eq!(profiles, [("cautious/holes.stl".into(), "cautious".into()), ("order 7/holes.stl".into(), "default".into())]);
}

/// F16, and F17.
#[test]
fn f16_folder_in_use_is_code_73() {
    let place = Place::new();
    place.put("hot/in/notes.txt", b"");
    let mut daemon = place.command().args(["watch", "hot"]).spawn().unwrap();
    // Its jobs can be listed from the moment it serves the folder.
    let serving = (0..600).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(50));
        place.at("hot/out").is_dir() && place.suture(["watch", "hot", "--once"]).code() == 73
    });
    // Through the daemon, and at once.
    let asked = std::time::Instant::now();
    let listed = place.suture(["jobs", "list", "--dir", "hot"]).expect(0);
    assert!(listed.stdout().contains("notes.txt") || listed.stdout().contains("no jobs"), "{}", listed.stdout());
    assert!(asked.elapsed() < std::time::Duration::from_secs(5), "it waited for an answer that was there");
    rustix::process::kill_process(rustix::process::Pid::from_child(&daemon), rustix::process::Signal::TERM).unwrap();
    let status = daemon.wait().unwrap();
    assert!(serving && status.code() == Some(0), "{status}");
}

/// With `--once`, what an earlier run could not bring into place however often it tried is tried by the next one.
#[test]
fn the_next_run_tries_what_the_last_one_left() {
    let place = Place::new();
    place.put("hot/in/scan/part.stl", &mesh(Case::Holes, 1));
    // Where results of that sub-folder go is a file.
    place.put("hot/out/scan", b"in the way");
    once(&place).expect(1);
    let job = jobs(&place).remove(0).1;
    assert!(job["kind"] == "parked" && job["parked"]["tries"].as_u64() >= Some(4), "{job}");
    std::fs::remove_file(place.at("hot/out/scan")).unwrap();
    once(&place).expect(0);
    assert_eq!(jobs(&place).remove(0).1["kind"], "done");
    assert!(place.at("hot/out/scan/part.stl").is_file() && place.at("hot/done/scan/part.stl").is_file());
}

/// With `--once`, a file that waits is tried by the next run, however short ago it began to wait.
#[test]
fn the_next_run_tries_what_waits() {
    let place = Place::new();
    place.put("hot/in/mine/part.stl", &mesh(Case::Holes, 1));
    place.put("hot/in/mine/.suture.toml", b"max_hole_edgse = 7\n");
    once(&place).expect(1);
    let job = jobs(&place).remove(0).1;
    assert!(job["kind"] == "waiting" && job["note"].as_str().unwrap().contains("max_hole_edgse"), "{job}");
    std::fs::remove_file(place.at("hot/in/mine/.suture.toml")).unwrap();
    once(&place).expect(0);
    assert_eq!(jobs(&place).remove(0).1["kind"], "done");
}

/// However often a file is tried again, it has one name, one report, one receipt and one best attempt.
#[test]
fn trying_again_leaves_no_litter() {
    let place = Place::new();
    place.put("hot/in/sheet.stl", &lone_sheet());
    once(&place).expect(1);
    let failed = place.names("hot/failed");
    assert!(failed.contains(&"sheet.best.stl".to_owned()), "{failed:?}");
    for _ in 0..3 {
        place.suture(["jobs", "retry", "1", "--dir", "hot"]).expect(0);
        once(&place).expect(1);
        assert_eq!(place.names("hot/failed"), failed);
    }
    assert_eq!(place.read("hot/failed/sheet.stl"), lone_sheet());
    // Good at last, by another profile: nothing of the failures is left.
    let config = "settle = \"30ms\"\n[[folders]]\npath = \"hot\"\n[profiles.default]\nsheets = \"thicken\"\n";
    place.put("suture.toml", config.as_bytes());
    place.suture(["jobs", "retry", "1", "--dir", "hot"]).expect(0);
    place.suture(["watch", "--once", "--config", "suture.toml"]).expect(0);
    assert_eq!((place.names("hot/failed"), place.names("hot/done")), (vec![], vec!["sheet.stl".to_owned()]));
}

/// What someone meant to have repaired, and is left, is no success; notes beside it are none of our business.
#[test]
fn meshes_that_are_left_are_code_1() {
    let place = Place::new();
    place.put("hot/in/notes.txt", b"by air");
    place.put("hot/in/d/d/d/d/d/d/d/d/d/d/d/d/part.stl", &mesh(Case::Holes, 1));
    once(&place).expect(0);
    assert!(place.at("hot/done/d/d/d/d/d/d/d/d/d/d/d/d/part.stl").exists());
    place.put("hot/in/part.step", b"PK");
    for _ in 0..2 {
        let ran = once(&place).expect(1);
        assert!(ran.stderr().contains("Files are left where they are"), "{}", ran.stderr());
    }
    std::fs::remove_file(place.at("hot/in/part.step")).unwrap();
    once(&place).expect(0);
    let long = format!("hot/in/{}", format!("{}/", "n".repeat(200)).repeat(4));
    place.put(&format!("{long}part.stl"), &mesh(Case::Holes, 1));
    once(&place).expect(1);
}

#[test]
fn log_lines_look_as_they_are_asked_to() {
    let place = Place::new();
    place.put("hot/in/a.stl", &mesh(Case::Holes, 1));
    for (format, json) in [("auto", true), ("json", true), ("text", false)] {
        let ran = place.suture(["watch", "hot", "--once", "--log-format", format]).expect(0);
        let served = ran.stderr().lines().find(|line| line.contains("Serving a hot folder")).unwrap().to_owned();
        assert_eq!(serde_json::from_str::<Value>(&served).is_ok(), json, "{format}: {served}");
        assert!(!served.contains('\u{1b}'), "no colours where there is no terminal: {served}");
    }
}

#[test]
fn a_state_that_no_job_is_ever_in_is_refused() {
    let place = Place::new();
    place.put("hot/in/a.stl", &mesh(Case::Holes, 1));
    once(&place).expect(0);
    let ran = place.suture(["jobs", "list", "--dir", "hot", "--state", "bogus"]).expect(2);
    assert!(ran.stdout().is_empty() && ran.stderr().contains("no job is ever `bogus`"), "{}", ran.stderr());
}
