//! What a person at a terminal sees while the work goes on, and what a pipe is spared.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use suture_bench::generate::Case;
use suture_tests::Place;
use suture_tests::hot::mesh;

/// What `suture` with these arguments writes to standard error when that is a terminal, and how long it took.
fn on_a_terminal(place: &Place, arguments: &[&str]) -> (String, Duration) {
    let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&ours).unwrap();
    unlockpt(&ours).unwrap();
    let name = ptsname(&ours, Vec::new()).unwrap();
    let theirs = File::options().read(true).write(true).open(Path::new(name.to_str().unwrap())).unwrap();
    let start = Instant::now();
    let mut command = place.command();
    command.args(arguments).env("TERM", "xterm").stdout(Stdio::null()).stderr(theirs);
    let mut child = command.spawn().unwrap();
    // With it goes the last terminal end of ours: reading then ends with the child.
    drop(command);
    let mut seen = Vec::new();
    let mut buffer = [0; 4096];
    let mut ours = File::from(ours);
    while let Ok(count @ 1..) = ours.read(&mut buffer) {
        seen.extend_from_slice(&buffer[..count]);
    }
    assert!(child.wait().unwrap().success());
    (String::from_utf8_lossy(&seen).into_owned(), start.elapsed())
}

/// Long work shows what is being done, its rate and the time left, and takes the bar away in the end; the same into a pipe says nothing.
#[test]
fn long_work_shows_how_far_it_is() {
    // However fast the machine, some size takes a while.
    for triangles in [500_000, 2_000_000, 8_000_000, 32_000_000] {
        let place = Place::new();
        place.generate(Case::Holes, triangles, 1);
        let (seen, took) = on_a_terminal(&place, &["repair", "holes.stl", "-o", "seen.stl", "--threads", "1"]);
        if took < Duration::from_secs(3) {
            continue;
        }
        for words in ["holes.stl", "looking for defects", "triangles/s", " left", "checking the result"] {
            assert!(seen.contains(words), "no {words:?} in {seen:?}");
        }
        let ran = place.suture(["repair", "holes.stl", "-o", "unseen.stl", "--threads", "1"]).expect(0);
        assert_eq!(ran.stderr(), "");
        return;
    }
    panic!("no work takes three seconds");
}

#[test]
fn short_work_shows_nothing() {
    let place = Place::new();
    place.put("part.stl", &mesh(Case::Holes, 1));
    let (seen, took) = on_a_terminal(&place, &["repair", "part.stl", "-o", "out.stl"]);
    assert!(seen.is_empty() || took > Duration::from_secs(1), "{seen:?}");
}

/// What was asked for is printed whole, or that it is not is said; a reader that has seen enough is no failure.
#[test]
fn what_cannot_be_printed_is_not_passed_over() {
    let place = Place::new();
    place.put("hot/in/part.stl", &mesh(Case::Holes, 1));
    place.suture(["watch", "hot", "--once", "--settle", "30ms"]).expect(0);
    for words in [
        &["jobs", "list", "--json", "--dir", "hot"][..],
        &["store", "export", "--dir", "hot"],
        &["status", "--json", "--dir", "hot"],
        &["config", "print"],
        &["completions", "bash"],
        &["check", "--json", "hot/out/part.stl"],
    ] {
        let full = File::options().write(true).open("/dev/full").unwrap();
        let ran = place.command().args(words).stdout(full).output().unwrap();
        let said = String::from_utf8_lossy(&ran.stderr).into_owned();
        assert!(ran.status.code() == Some(75) && said.contains("standard output cannot be written"), "{words:?}: {said}");
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let ran = place.command().args(words).stdout(writer).output().unwrap();
        assert!(ran.status.success() && ran.stderr.is_empty(), "{words:?}: {}", String::from_utf8_lossy(&ran.stderr));
    }
}
