//! Promise 4 in small: what the worker holds stays under the budget, or the file is refused in numbers.

use std::time::Duration;

use suture_bench::generate::Case;
use suture_tests::Place;

/// The largest anonymous memory of any child of a process, looked at every few milliseconds until it ends.
fn watched(mut child: std::process::Child) -> (std::process::Output, u64) {
    let pid = child.id();
    let mut peak = 0;
    while child.try_wait().unwrap().is_none() {
        let children = std::fs::read_to_string(format!("/proc/{pid}/task/{pid}/children")).unwrap_or_default();
        for worker in children.split_whitespace() {
            let status = std::fs::read_to_string(format!("/proc/{worker}/status")).unwrap_or_default();
            let line = status.lines().find_map(|line| line.strip_prefix("RssAnon:"));
            let kilobytes: u64 = line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok()).unwrap_or(0);
            peak = peak.max(kilobytes * 1024);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    (child.wait_with_output().unwrap(), peak)
}

#[test]
fn f10_a_million_triangles_within_64_mib_or_refused() {
    const BUDGET: u64 = 64 << 20;
    let place = Place::new();
    for case in [Case::Mixed, Case::Shuffled, Case::Soup] {
        place.generate(case, 1_000_000, 1);
        let input = format!("{case}.stl");
        let mut command = place.command();
        command.args(["repair", &input, "-o", "out.stl", "--json", "--memory", "64MiB", "--threads", "2", "--force"]);
        // Pipes would have to be read while it runs.
        let (out, err) = (place.at("stdout"), place.at("stderr"));
        command.stdout(std::fs::File::create(&out).unwrap()).stderr(std::fs::File::create(&err).unwrap());
        let (output, seen) = watched(command.spawn().unwrap());
        let said = std::fs::read_to_string(&err).unwrap();
        assert!(seen > 0 && seen <= BUDGET, "{case}: {seen} bytes of anonymous memory were seen");
        match output.status.code() {
            Some(0) => {
                let report: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&out).unwrap()).unwrap();
                let peak = report["cost"]["peak_anonymous_bytes"].as_u64().unwrap();
                assert!(peak > 0 && peak <= BUDGET, "{case}: {peak} bytes of anonymous memory");
            }
            Some(2) => {
                let numbers = said.split(|c: char| !c.is_ascii_digit()).filter(|word| !word.is_empty()).count();
                assert!(said.lines().count() == 1 && said.contains("--memory") && numbers > 1, "{case}: {said}");
                assert!(!place.at("out.stl").exists());
            }
            other => panic!("{case}: {other:?}: {said}"),
        }
        let _ = std::fs::remove_file(place.at("out.stl"));
    }
}
