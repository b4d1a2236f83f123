//! Power cuts during one long file, and a file that really kills.

use std::os::unix::process::ExitStatusExt;
use std::time::{Duration, Instant};

use serde_json::Value;
use suture_tests::binary::with_crash_points;

use crate::stage::{Stage, holes, row};
use crate::world::processes_of;

const CUTS: u32 = 6;

/// F2: the machine is cut off six times while it works on one long file: the file is not to blame.
#[test]
fn f02_six_power_cuts_during_one_long_file() {
    let stage = Stage::new();
    // However fast the machine, some size takes a while.
    let size = [100_000, 400_000, 1_600_000].into_iter().find(|size| {
        let start = Instant::now();
        std::fs::write(stage.at("long.stl"), holes(*size, 1)).unwrap();
        let (input, output) = (stage.at("long.stl"), stage.at("probe.stl"));
        let ran = stage.run([
            "repair".as_ref(),
            input.as_os_str(),
            "-o".as_ref(),
            output.as_os_str(),
            "--threads".as_ref(),
            "1".as_ref(),
        ]);
        assert_eq!(ran.status.code(), Some(0));
        std::fs::remove_file(&output).unwrap();
        start.elapsed() > Duration::from_secs(4)
    });
    let size = size.unwrap_or(1_600_000);
    stage.put("long.stl", &std::fs::read(stage.at("long.stl")).unwrap());
    for _ in 0..CUTS {
        let mut daemon = stage.start(stage.watch(&[]));
        stage.wait("a worker", 30, || processes_of(stage.binary()).len() > 1);
        std::thread::sleep(Duration::from_millis(300));
        daemon.cut();
        stage.assert_originals("after a power cut");
        assert!(stage.files("quarantine").is_empty());
    }
    let mut daemon = stage.start(stage.watch(&[]));
    let took = stage.wait_done(120, &mut daemon);
    stage.assert_done();
    daemon.stop();
    let attempts = stage.job("long.stl").unwrap()["attempts"].clone();
    row(
        "power cuts",
        &format!("{CUTS} during one file of {size} triangles"),
        &format!("no blame; done after {attempts} attempts, {:.0} s", took.as_secs_f64()),
    );
}

/// Files that kill their worker, or the daemon, end in quarantine, and their reports say how to go on.
#[test]
fn f12_poison_is_quarantined_and_says_how_to_go_on() {
    for poison in ["a!abort!.stl", "d!kill-daemon!.stl"] {
        let stage = Stage::of(with_crash_points());
        stage.put(poison, &holes(600, 1));
        stage.put("innocent.stl", &holes(600, 2));
        let mut deaths = 0;
        loop {
            let mut daemon = stage.start(stage.watch(&["--once"]));
            let status = daemon.ended_within(120).expect("it ends");
            if status.signal() != Some(9) {
                assert_eq!(status.code(), Some(1), "{}", stage.log());
                break;
            }
            deaths += 1;
            assert!(deaths <= 8, "{}", stage.log());
        }
        assert_eq!(stage.places(poison), [format!("quarantine/{poison}")]);
        assert_eq!(stage.places("innocent.stl"), ["done/innocent.stl"]);
        let report: Value = serde_json::from_slice(&stage.files("quarantine")[&format!("{poison}.report.json")]).unwrap();
        let next = report["next"].as_str().unwrap_or_default();
        let id = stage.job(poison).unwrap()["id"].to_string();
        assert!(next.contains(&format!("suture jobs retry {id}")), "{report}");
        stage.assert_nothing_partial();
        row("poison", poison, &format!("{deaths} deaths of the daemon; quarantine: {}; next: {next:?}", report["reason"]));
    }
}
