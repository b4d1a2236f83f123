//! A folder on a share, which daemons of several machines serve: whatever a machine that dies for good leaves there, another one finishes.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use suture_store::testkit::server::server;
use suture_tests::binary::with_crash_points;
use suture_tests::hot::{Hot, Tree};

use super::{assert_at_rest, drop_two, exhaustive, on_two_threads, reference, state, traced, was_killed};

/// A daemon that died is taken for dead after that, by the clock of the database.
const LEASE: Duration = Duration::from_secs(60);

/// The daemon of a host on the folder: its own state, which lies beside.
fn host(hot: &Hot, states: &tempfile::TempDir, name: &str, url: &str, options: &[&str]) -> Command {
    let folder = hot.path().file_name().and_then(|name| name.to_str()).expect("a name");
    let at = |what: &str| states.path().join(format!("{folder}-{name}{what}"));
    let head = format!("state = {:?}\nstore = {url:?}\nsettle = \"30ms\"\nrescan = \"200ms\"\ncheck_one_in = 0\n", at(""));
    std::fs::write(at(".toml"), format!("{head}[[folders]]\npath = {:?}\nshared = true\n", hot.path())).expect("a configuration");
    let mut command = Command::new(with_crash_points());
    command.args(["watch", "--config"]).arg(at(".toml")).args(options);
    let log = std::fs::File::create(at(".log")).expect("a log");
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log);
    command
}

fn log(hot: &Hot, states: &tempfile::TempDir, name: &str) -> Vec<String> {
    let folder = hot.path().file_name().and_then(|name| name.to_str()).expect("a name");
    let log = std::fs::read_to_string(states.path().join(format!("{folder}-{name}.log"))).expect("a log");
    log.lines().map(str::to_owned).collect()
}

/// The first host is killed at each step of its work, and never comes back: the second one, with a state of its own, finishes as if nothing had been. All
/// deaths come first, so that one wait is enough.
#[test]
fn f01_a_machine_that_dies_at_each_step_leaves_a_share_to_another() {
    let Some(server) = server() else { return };
    let (url, states) = (server.url(), tempfile::tempdir().expect("a temporary folder"));
    let (expected, _) = reference(drop_two);
    let alone = Hot::sharing(with_crash_points(), &url);
    drop_two(&alone);
    let (status, trace) = traced(&alone, host(&alone, &states, "alone", &url, &["--once"]));
    assert!(status.code().is_some_and(|code| code < 2), "{status}");
    assert_eq!(state(&alone), expected, "without a kill");
    let passes = trace.lines().count() as u64;
    assert!(passes > 20, "{trace}");
    let steps: Vec<u64> = (1..=passes).step_by(if exhaustive() { 1 } else { 3 }).collect();
    let places: Vec<(u64, Hot)> = steps.iter().map(|step| (*step, Hot::sharing(with_crash_points(), &url))).collect();
    on_two_threads(&places, |(step, hot)| {
        drop_two(hot);
        let mut first = host(hot, &states, "first", &url, &["--once"]);
        let status = first.env("SUTURE_CRASH_AT", format!("*:{step}")).status().expect("it starts");
        assert!(was_killed(status) || step + 8 > passes, "killed at pass {step} of {passes}: was not");
    });
    std::thread::sleep(LEASE + Duration::from_secs(1));
    on_two_threads(&places, |(step, hot)| {
        let what = format!("killed at pass {step} of {passes}");
        let mut second = host(hot, &states, "second", &url, &[]).spawn().expect("it starts");
        let (began, is_open) = (Instant::now(), |kind: &str| !matches!(kind, "done" | "failed" | "needs_review"));
        let is_done = |jobs: &[Value]| jobs.len() == 2 && !jobs.iter().any(|job| job["kind"].as_str().is_none_or(is_open));
        while !is_done(&hot.jobs()) || hot.tree(".suture/work") != Tree::new() {
            let told = || (hot.jobs(), hot.tree(".suture/work").into_keys().collect::<Vec<_>>(), log(hot, &states, "second"));
            assert!(began.elapsed() < 3 * LEASE, "{what}: in vain: {:#?}", told());
            std::thread::sleep(Duration::from_millis(100));
        }
        kill_process(Pid::from_child(&second), Signal::TERM).expect("it lives");
        assert!(second.wait().expect("it ends").success(), "{what}: after {:?}", began.elapsed());
        assert_eq!(state(hot), expected, "{what}");
        assert_at_rest(hot, &what);
    });
}
