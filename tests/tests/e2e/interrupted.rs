//! A repair that is stopped, or whose file changes under it: one line, no output, nothing left behind.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use suture_bench::generate::Case;
use suture_tests::hot::{holes, mesh};
use suture_tests::served::{Served, children_of, jobs, wait_until, worker_of};
use suture_tests::{Place, stl};

/// `suture repair` of a file large enough to be caught at work, and its worker, which has mapped it.
fn at_work(place: &Place) -> (Child, Pid) {
    place.generate(Case::Mixed, 1_000_000, 1);
    let mut command = place.command();
    command.args(["repair", "mixed.stl", "-o", "out.stl", "--report", "report.json", "--threads", "1"]);
    command.stdout(Stdio::null()).stderr(File::create(place.at("stderr")).unwrap());
    let mut child = command.spawn().unwrap();
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(60) {
        if let Some(worker) = worker_of(child.id(), "mixed.stl") {
            return (child, worker);
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    panic!("no worker has mapped the file: {}", child.wait().unwrap());
}

/// Waits for the end, which must be code 2 or 130 with one line of these words, and nothing in the folder but the input.
fn assert_ends(place: &Place, mut child: Child, code: i32, words: &str) {
    let status = child.wait().unwrap();
    let said = std::fs::read_to_string(place.at("stderr")).unwrap();
    assert_eq!(status.code(), Some(code), "{said}");
    assert!(said.lines().count() == 1 && said.contains("mixed.stl") && said.contains(words), "{said}");
    assert_eq!(place.names(""), ["mixed.stl", "stderr"], "nothing is left");
}

fn is_there(process: Pid) -> bool {
    Path::new(&format!("/proc/{}", process.as_raw_nonzero())).exists()
}

/// No core dump, few open files, and files of a size that follows from the input's and the memory's.
#[test]
fn a_worker_is_bounded() {
    let place = Place::new();
    let (mut child, worker) = at_work(&place);
    let limits = std::fs::read_to_string(format!("/proc/{}/limits", worker.as_raw_nonzero())).unwrap();
    kill_process(Pid::from_child(&child), Signal::KILL).unwrap();
    child.wait().unwrap();
    let limit =
        |name: &str| limits.lines().find_map(|line| line.strip_prefix(name)?.split_whitespace().next()?.parse::<u64>().ok());
    assert_eq!((limit("Max core file size"), limit("Max open files")), (Some(0), Some(256)), "{limits}");
    let input = place.read("mixed.stl").len() as u64;
    assert_eq!(limit("Max file size"), Some(8 * input + (4 << 30) + (64 << 20)), "{limits}");
}

/// What is written grows beyond a limit: no signal ends the worker, the file has its line, and others are done.
#[test]
fn work_that_would_write_too_much_fails_with_a_line() {
    const MOST: u64 = 8 << 20;
    let place = Place::new();
    let limited = |words: &[&str]| {
        let mut command = place.command_of(Path::new("prlimit"));
        command.arg(format!("--fsize={MOST}")).arg(suture_tests::binary::suture()).args(words);
        command
    };
    let words = "the limit of the size of files is 8.4 MB here: raise it (`ulimit -f`)";
    let large = place.generate(Case::Mixed, 300_000, 1).0;
    let ended = limited(&["repair", "mixed.stl", "-o", "out.stl"]).output().unwrap();
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert!(ended.status.code() == Some(2) && said.lines().count() == 1 && said.contains(words), "{}: {said}", ended.status);
    assert!(!place.at("out.stl").exists());
    place.put("hot/in/small.stl", &holes(1));
    std::fs::rename(large, place.at("hot/in/large.stl")).unwrap();
    let _daemon = Served::of(&place, limited(&["watch", "hot", "--settle", "30ms", "--workers", "1"]), "log");
    let job = |name: &str| jobs(&place, "hot").into_iter().find(|job| job["source"]["path"] == name).unwrap_or_default();
    wait_until("the small one is done", || job("small.stl")["kind"] == "done");
    wait_until("the large one has its line", || job("large.stl")["note"].to_string().contains(words));
    assert_eq!(job("large.stl")["kind"], "waiting");
}

#[test]
fn by_a_signal() {
    for signal in [Signal::INT, Signal::TERM] {
        let place = Place::new();
        let (child, worker) = at_work(&place);
        kill_process(Pid::from_child(&child), signal).unwrap();
        assert_ends(&place, child, 130, "interrupted");
        assert!(!is_there(worker), "the worker goes, too");
    }
}

#[test]
fn f03_by_the_death_of_the_worker() {
    let place = Place::new();
    let (child, worker) = at_work(&place);
    kill_process(worker, Signal::KILL).unwrap();
    assert_ends(&place, child, 2, "");
}

/// What is in the making has no name: not even a kill that no one can catch leaves anything.
#[test]
fn by_a_kill() {
    let place = Place::new();
    let (mut child, worker) = at_work(&place);
    child.kill().unwrap();
    child.wait().unwrap();
    assert_goes(worker);
    assert_eq!(place.names(""), ["mixed.stl", "stderr"], "nothing is left");
}

fn assert_goes(worker: Pid) {
    let start = Instant::now();
    while is_there(worker) {
        assert!(start.elapsed() < Duration::from_secs(30), "the worker outlives the command");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// From the first record to the last stage, by a signal and by a kill, of binary files and of text (which is spooled): either the whole
/// result is there or nothing, and no process is left.
#[test]
fn f02_at_any_moment() {
    const MOMENTS: u32 = 8;
    for text in [false, true] {
        let place = Place::new();
        place.generate(Case::Mixed, 200_000, 1);
        if text {
            let triangles: Vec<_> = stl::records(&place.read("mixed.stl")).iter().map(stl::corners).collect();
            place.put("mixed.stl", stl::text("mixed", &triangles).as_bytes());
        }
        let start = Instant::now();
        place.repair("mixed.stl", "whole.stl", &["--threads", "1"]).expect(0);
        let (takes, whole) = (start.elapsed(), place.read("whole.stl"));
        for k in 0..2 * MOMENTS {
            let signal = if k % 2 == 0 { Signal::INT } else { Signal::KILL };
            let mut command = place.command();
            command.args(["repair", "mixed.stl", "-o", "out.stl", "--threads", "1"]).stdout(Stdio::null()).stderr(Stdio::null());
            let mut child = command.spawn().unwrap();
            std::thread::sleep(takes * (k / 2 + 1) / (MOMENTS + 1));
            let workers = children_of(child.id());
            kill_process(Pid::from_child(&child), signal).unwrap();
            let status = child.wait().unwrap();
            workers.into_iter().for_each(assert_goes);
            if place.at("out.stl").exists() {
                assert_eq!(place.read("out.stl"), whole, "moment {k}: whole or not at all");
                std::fs::remove_file(place.at("out.stl")).unwrap();
            } else {
                assert_eq!(status.code(), (signal == Signal::INT).then_some(130), "moment {k}");
            }
            assert_eq!(place.names(""), ["mixed.stl", "whole.stl"], "moment {k}: something is left");
        }
    }
}

/// Of several files, those that are told of are there, whole; the others have left nothing.
#[test]
fn among_many_files() {
    let place = Place::new();
    let names: Vec<String> = (0..300).map(|k| format!("{k:03}.stl")).collect();
    for (seed, name) in (0..).zip(&names) {
        place.put(name, &mesh(Case::Mixed, seed));
    }
    for (signal, folder) in [(Signal::INT, "out-int"), (Signal::TERM, "out-term"), (Signal::KILL, "out-kill")] {
        std::fs::create_dir(place.at(folder)).unwrap();
        let mut command = place.command();
        command.args(["repair", "--json", "-o", folder]).args(&names).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut told = BufReader::new(child.stdout.take().unwrap()).lines();
        let mut seen: Vec<String> = told.by_ref().take(5).map(Result::unwrap).collect();
        let workers = children_of(child.id());
        kill_process(Pid::from_child(&child), signal).unwrap();
        seen.extend(told.map(Result::unwrap));
        let output = child.wait_with_output().unwrap();
        workers.into_iter().for_each(assert_goes);
        let there = place.names(folder);
        assert!((5..300).contains(&there.len()), "it was caught at work: {} files", there.len());
        assert!(there.iter().eq(&names[..there.len()]), "in their order: {there:?}");
        assert!(seen.len() <= there.len());
        for line in &seen {
            let report: serde_json::Value = serde_json::from_str(line).unwrap();
            assert_eq!(report["output"]["bytes"], place.read(report["output"]["path"].as_str().unwrap()).len());
        }
        if signal != Signal::KILL {
            assert_eq!(output.status.code(), Some(130));
            assert_eq!(seen.len(), there.len(), "all that is there was told of");
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(said.lines().count() == 1 && said.contains("interrupted"), "{said}");
        }
    }
}

#[test]
fn f22_by_a_cut_in_the_mapped_file() {
    let place = Place::new();
    let (child, _) = at_work(&place);
    File::options().write(true).open(place.at("mixed.stl")).unwrap().set_len(1_000).unwrap();
    assert_ends(&place, child, 2, "changed while it was being worked on");
}

#[test]
fn f22_by_a_change_of_the_file() {
    let place = Place::new();
    let (child, _) = at_work(&place);
    File::options().write(true).open(place.at("mixed.stl")).unwrap().set_modified(std::time::SystemTime::UNIX_EPOCH).unwrap();
    assert_ends(&place, child, 2, "changed while it was being worked on");
}
