//! Files and folders of other users, and who may read what.

use std::fs::Permissions;
use std::os::unix::fs::{MetadataExt, PermissionsExt, chown};
use std::os::unix::process::CommandExt;
use std::process::Command;

use crate::stage::{Stage, holes, row};
use crate::world::is_root;

const DAEMON: u32 = 45_001;
const STRANGER: u32 = 45_002;

fn mode(path: impl AsRef<std::path::Path>, mode: u32) {
    std::fs::set_permissions(path, Permissions::from_mode(mode)).unwrap();
}

/// Originals in a folder that the daemon may not write to cannot be moved away: their jobs wait, and hold no one up.
#[test]
fn f25_a_sub_folder_of_another_user() {
    if !is_root("strangers") {
        return;
    }
    let stage = Stage::new().owned_by(DAEMON);
    for seed in 1..=3 {
        stage.put(&format!("theirs/{seed}.stl"), &holes(600, seed));
    }
    chown(stage.hot("in/theirs"), Some(STRANGER), Some(STRANGER)).unwrap();
    let mut daemon = stage.serve();
    stage.wait("their jobs to be parked", 20, || (1..=3).all(|n| stage.kind(&format!("theirs/{n}.stl")) == "parked"));
    let note = stage.note("theirs/1.stl");
    assert!(note.contains("Permission denied"), "{note}");
    for seed in 11..=13 {
        stage.put(&format!("{seed}.stl"), &holes(600, seed));
    }
    stage.wait("the others to go on", 20, || (11..=13).all(|n| stage.kind(&format!("{n}.stl")) == "done"));
    stage.assert_originals("while they wait");
    let id = stage.job("theirs/1.stl").unwrap()["id"].to_string();
    let hot = stage.at("hot");
    let cancel = stage.run(["jobs", "cancel", &id, "--dir", hot.to_str().unwrap()]);
    // Its result is published, and stands; the original stays where it is, and is not taken again.
    assert_eq!(cancel.status.code(), Some(0), "{}", String::from_utf8_lossy(&cancel.stderr));
    assert_eq!(stage.kind("theirs/1.stl"), "done");
    mode(stage.hot("in/theirs"), 0o777);
    let took = stage.wait_done(90, &mut daemon);
    assert_eq!(stage.places("theirs/1.stl"), ["in/theirs/1.stl"]);
    std::fs::rename(stage.hot("in/theirs/1.stl"), stage.hot("done/theirs/1.stl")).unwrap();
    stage.assert_done();
    daemon.stop();
    row(
        "strangers",
        "in/theirs is another user's, chmod 777 later",
        &format!(
            "parked: {note:?}; others done; cancel: the result stays, the original too; all done {:.0} s after chmod",
            took.as_secs_f64()
        ),
    );
}

/// A result that cannot be placed is parked; it can be cancelled, and the other is placed once that is possible.
#[test]
fn f25_a_folder_of_results_that_may_not_be_written_to() {
    if !is_root("strangers") {
        return;
    }
    let stage = Stage::new().owned_by(DAEMON);
    let mut daemon = stage.serve();
    std::fs::create_dir(stage.hot("out/sub")).unwrap();
    stage.put("sub/a.stl", &holes(600, 1));
    chown(stage.hot("in/sub"), Some(DAEMON), None).unwrap();
    let cancelled = holes(600, 2);
    std::fs::write(stage.hot("in/sub/b.stl"), &cancelled).unwrap();
    stage.wait("both to be parked", 20, || ["sub/a.stl", "sub/b.stl"].iter().all(|name| stage.kind(name) == "parked"));
    let note = stage.note("sub/b.stl");
    assert!(note.contains("Permission denied"), "{note}");
    stage.put("c.stl", &holes(600, 3));
    stage.wait("another one to go on", 20, || stage.kind("c.stl") == "done");
    let id = stage.job("sub/b.stl").unwrap()["id"].to_string();
    let hot = stage.at("hot");
    let cancel = stage.run(["jobs", "cancel", &id, "--dir", hot.to_str().unwrap()]);
    assert_eq!(cancel.status.code(), Some(0), "{}", String::from_utf8_lossy(&cancel.stderr));
    assert_eq!(std::fs::read(stage.hot("in/sub/b.stl")).unwrap(), cancelled, "it stays where it is");
    mode(stage.hot("out/sub"), 0o777);
    let took = stage.wait_done(60, &mut daemon);
    assert_eq!(stage.kind("sub/b.stl"), "cancelled");
    std::fs::remove_file(stage.hot("in/sub/b.stl")).unwrap();
    stage.assert_done();
    daemon.stop();
    row(
        "strangers",
        "out/sub may not be written to, one of two cancelled, chmod later",
        &format!("parked: {note:?}; cancelled; the other done {:.0} s after chmod", took.as_secs_f64()),
    );
}

/// The mode of the original without execute bits, whatever the umask; the group of a folder that passes its own on; the owner of the
/// original where the daemon may give files away.
#[test]
fn results_have_the_rights_of_their_originals() {
    if !is_root("strangers") {
        return;
    }
    let stage = Stage::new();
    let mut command = stage.watch(&[]);
    // SAFETY: between fork and exec only an async-signal-safe call is made.
    unsafe {
        command.pre_exec(|| {
            libc::umask(0o002);
            Ok(())
        });
    }
    let mut daemon = stage.start(command);
    stage.wait_served(&mut daemon);
    chown(stage.hot("out"), None, Some(STRANGER)).unwrap();
    mode(stage.hot("out"), 0o2775);
    let mut seen = Vec::new();
    for (seed, given, wanted) in [(1, 0o600, 0o600), (2, 0o664, 0o664), (3, 0o755, 0o644)] {
        let name = format!("{given:o}.stl");
        let bytes = holes(600, seed);
        stage.expect(&name, &bytes);
        let path = stage.at(&name);
        std::fs::write(&path, bytes).unwrap();
        mode(&path, given);
        chown(&path, Some(DAEMON), Some(DAEMON)).unwrap();
        std::fs::rename(path, stage.hot("in").join(&name)).unwrap();
        stage.wait("it to be done", 20, || stage.kind(&name) == "done");
        for suffix in ["", ".report.json", ".suture.json"] {
            let meta = std::fs::metadata(stage.hot("out").join(name.clone() + suffix)).unwrap();
            assert_eq!((meta.mode() & 0o7777, meta.uid(), meta.gid()), (wanted, DAEMON, STRANGER), "{name}{suffix}");
        }
        seen.push(format!("{given:o} → {wanted:o}"));
    }
    stage.assert_done();
    daemon.stop();
    row(
        "strangers",
        "originals of another user, umask 002, out/ setgid",
        &format!("{}; owner of the original, group of out/", seen.join(", ")),
    );
}

/// A sub-folder that cannot be read is named once, not at every scan.
#[test]
fn f25_an_unreadable_sub_folder_is_logged_once() {
    if !is_root("strangers") {
        return;
    }
    let mut stage = Stage::new().owned_by(DAEMON);
    stage.lines += "rescan = \"100ms\"\n";
    stage.put("secret/part.stl", &holes(600, 1));
    mode(stage.hot("in/secret"), 0o000);
    chown(stage.hot("in/secret"), Some(STRANGER), None).unwrap();
    let mut daemon = stage.serve();
    stage.put("other.stl", &holes(600, 2));
    stage.wait("the other one to be done", 20, || stage.kind("other.stl") == "done");
    std::thread::sleep(std::time::Duration::from_millis(1500));
    assert_eq!(stage.log().matches("A sub-folder cannot be read").count(), 1, "{}", stage.log());
    chown(stage.hot("in/secret"), Some(DAEMON), None).unwrap();
    mode(stage.hot("in/secret"), 0o755);
    stage.wait_done(30, &mut daemon);
    stage.assert_done();
    daemon.stop();
    row(
        "strangers",
        "in/secret cannot be read, scanned every 0.1 s, readable later",
        "logged once; the other one done; then it, too",
    );
}

/// Looking at jobs needs no right to write.
#[test]
fn f25_jobs_are_listed_on_a_read_only_mount() {
    if !is_root("strangers") {
        return;
    }
    let stage = Stage::new();
    let mount = crate::world::Mount::tmpfs(&stage.at("hot"), "size=64m", 0);
    std::fs::create_dir(stage.hot("in")).unwrap();
    stage.put("part.stl", &holes(600, 1));
    let mut daemon = stage.serve();
    stage.wait_done(30, &mut daemon);
    daemon.stop();
    mount.make_read_only();
    let mut listed = Vec::new();
    for words in [["list", ""], ["show", "1"]] {
        let mut command: Command = stage.command(["jobs", "--dir"]);
        command.arg(stage.at("hot")).args(words.iter().filter(|word| !word.is_empty()));
        let output = command.output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(said.contains("part.stl"), "{said}");
        listed.push(words[0]);
    }
    row("strangers", "the hot folder is on a read-only mount, no daemon", &format!("{listed:?} work"));
}
