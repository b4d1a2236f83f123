//! Very many files at once.

use std::time::{Duration, Instant};

use suture_tests::Place;
use suture_tests::served::{Served, jobs};
use suture_tests::stl::{cuboid, mesh};

/// The daemon's resident memory at its highest.
fn peak_of(process: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() * 1024
}

/// Each is done once, and the daemon stays small. Three hundred files; with `SUTURE_EXHAUSTIVE=1` ten thousand.
#[test]
fn f19_files_that_come_at_once_are_done_once_each() {
    let count: u16 = if std::env::var_os("SUTURE_EXHAUSTIVE").is_some() { 10_000 } else { 300 };
    let place = Place::new();
    std::fs::create_dir_all(place.at("hot/in")).unwrap();
    let daemon = Served::start(&place, &["hot", "--settle", "200ms"], "log");
    // Sound, each of its own size.
    let bytes = |k: u16| mesh(&cuboid([0.0; 3], [1.0 + f32::from(k); 3]));
    for k in 0..count {
        std::fs::write(place.at("hot/in").join(format!("{k}.stl")), bytes(k)).unwrap();
    }
    let began = Instant::now();
    let limit = Duration::from_secs(60 + u64::from(count) / 4);
    let done = || std::fs::read_dir(place.at("hot/done")).unwrap().count();
    while done() < usize::from(count) {
        assert!(began.elapsed() < limit, "{} of {count}", done());
        std::thread::sleep(Duration::from_millis(200));
    }
    let peak = peak_of(daemon.pid());
    println!("{count} files in {:.1} s, {} MiB", began.elapsed().as_secs_f64(), peak >> 20);
    assert!(peak < 200 << 20, "{peak} bytes");
    // The last may not be noted yet.
    std::thread::sleep(Duration::from_secs(1));
    let all = jobs(&place, "hot");
    assert_eq!((all.len(), all.iter().filter(|job| job["kind"] == "done").count()), (count.into(), count.into()));
    assert_eq!(place.names("hot/out").len(), 3 * usize::from(count), "a result, a report and a receipt each");
    assert!((0..count).all(|k| place.read(&format!("hot/out/{k}.stl")) == bytes(k)), "clean files are passed on");
}
