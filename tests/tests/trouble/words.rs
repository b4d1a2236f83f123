//! Names that would steer a terminal are shown harmlessly by everything that shows names.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

use crate::stage::{Stage, holes, row};

/// Clears the screen, rings, and begins a new line that looks like another message.
const EVIL: &str = "evil\x1b[2J\x07\nsuture: all is well\r\u{9b}31m.stl";

/// What a command writes to a terminal, on either of its outputs.
fn on_a_terminal(mut command: Command) -> Vec<u8> {
    let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&ours).unwrap();
    unlockpt(&ours).unwrap();
    let name = ptsname(&ours, Vec::new()).unwrap();
    let theirs = || File::options().read(true).write(true).open(Path::new(name.to_str().unwrap())).unwrap();
    command.env("TERM", "xterm").stdin(Stdio::null()).stdout(theirs()).stderr(theirs());
    let mut child = command.spawn().unwrap();
    // With it go the last terminal ends of ours: reading then ends with the child.
    drop(command);
    let (mut seen, mut buffer, mut ours) = (Vec::new(), [0; 4096], File::from(ours));
    while let Ok(count @ 1..) = ours.read(&mut buffer) {
        seen.extend_from_slice(&buffer[..count]);
    }
    child.wait().unwrap();
    seen
}

/// Everything but the program's own colours (`ESC [ digits m`) and ends of lines (the terminal adds CR to LF).
fn raw_controls(seen: &[u8]) -> Vec<String> {
    let text = String::from_utf8_lossy(seen).replace("\r\n", "\n");
    let mut found = Vec::new();
    let mut rest = text.as_str();
    while let Some(c) = rest.chars().next() {
        let colour = rest.strip_prefix("\x1b[").map(|tail| tail.trim_start_matches(|c: char| c.is_ascii_digit() || c == ';'));
        if let Some(tail) = colour.and_then(|tail| tail.strip_prefix('m')) {
            rest = tail;
            continue;
        }
        if c.is_control() && c != '\n' {
            found.push(format!("{:?} before {:?}", c, rest.chars().skip(1).take(20).collect::<String>()));
        }
        rest = &rest[c.len_utf8()..];
    }
    found
}

#[test]
fn f23_no_name_steers_a_terminal() {
    let stage = Stage::new();
    let mesh = holes(600, 1);
    stage.put(EVIL, &mesh);
    std::fs::write(stage.hot("in").join(EVIL.replace(".stl", ".step")), b"v").unwrap();
    let broken = EVIL.replace("evil", "broken");
    std::fs::write(stage.hot("in").join(&broken), b"\x89PNG\r\n\x1a\n").unwrap();
    std::fs::create_dir(stage.hot("in/sub\x1b[31m\n")).unwrap();
    std::fs::write(stage.hot("in/sub\x1b[31m\n/part.stl"), holes(600, 2)).unwrap();
    let log_to_terminal = stage.watch(&["--once"]);
    let mut shown = vec![("watch --once", on_a_terminal(log_to_terminal))];
    let hot = stage.at("hot");
    let hot = hot.to_str().unwrap();
    shown.push(("jobs list", on_a_terminal(stage.command(["jobs", "list", "--dir", hot]))));
    let jobs = stage.jobs();
    assert_eq!(jobs.len(), 4);
    for job in &jobs {
        shown.push(("jobs show", on_a_terminal(stage.command(["jobs", "show", &job["id"].to_string(), "--dir", hot]))));
        shown.push(("jobs retry", on_a_terminal(stage.command(["jobs", "retry", &job["id"].to_string(), "--dir", hot]))));
    }
    std::fs::write(stage.at("").join(EVIL), &mesh).unwrap();
    std::fs::write(stage.at("").join(&broken), b"\x89PNG\r\n\x1a\n").unwrap();
    let output = format!("out {EVIL}");
    for name in [EVIL, &broken] {
        shown.push(("repair", on_a_terminal(stage.command(["repair", name, "-o", &output]))));
        shown.push(("inspect", on_a_terminal(stage.command(["inspect", name]))));
    }
    for (what, seen) in &shown {
        assert!(!seen.is_empty() || *what == "repair", "{what} says nothing");
        let raw = raw_controls(seen);
        assert!(raw.is_empty(), "{what}: {raw:?} in {:?}", String::from_utf8_lossy(seen));
        let forged = String::from_utf8_lossy(seen).lines().any(|line| line.starts_with("suture: all is well"));
        assert!(!forged, "{what}: a name begins a line of its own in {:?}", String::from_utf8_lossy(seen));
    }
    row("words", "names with ESC, BEL, LF, CR and CSI on a terminal", &format!("{} outputs, no raw control byte", shown.len()));
}
