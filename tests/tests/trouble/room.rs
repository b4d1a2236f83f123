//! Inodes, bytes and sizes of files run out, and come back.

use std::os::unix::process::CommandExt;
use std::time::Duration;

use crate::stage::{Stage, holes, row};
use crate::world::{Mount, fill_bytes, fill_inodes, is_root, processes_of, set_limit};

/// A mesh of 200 kB.
fn large() -> Vec<u8> {
    holes(4000, 1)
}

#[test]
fn f07_inodes_run_out() {
    if !is_root("inodes run out") {
        return;
    }
    std::thread::scope(|scope| {
        for free in [1, 2, 3, 5] {
            scope.spawn(move || few_inodes(free));
        }
    });
}

/// All but a few inodes are taken when a file of 200 kB is dropped.
fn few_inodes(free: usize) {
    let stage = Stage::new();
    let _mount = Mount::tmpfs(&stage.at("hot"), "size=200m,nr_inodes=400", 0);
    std::fs::create_dir(stage.hot("in")).unwrap();
    let mut daemon = stage.serve();
    let fillers = fill_inodes(&stage.hot("fillers"), free);
    stage.put("part.stl", &large());
    let mut notes = Vec::new();
    for _ in 0..40 {
        std::thread::sleep(Duration::from_millis(100));
        daemon.tend();
        stage.assert_originals("without inodes");
        let note = stage.note("part.stl");
        if !note.is_empty() && !notes.contains(&note) {
            notes.push(note);
        }
    }
    let done_anyway = stage.kind("part.stl") == "done";
    assert!(done_anyway || !notes.is_empty() || daemon.restarts > 0, "no reason is given\n{}", stage.log());
    for filler in fillers {
        std::fs::remove_file(filler).unwrap();
    }
    let took = stage.wait_done(60, &mut daemon);
    stage.assert_done();
    let restarts = daemon.restarts;
    daemon.stop();
    row(
        "inodes run out",
        &format!("tmpfs with {free} free inodes, file of 200 kB, inodes freed"),
        &format!("original whole; {notes:?}; done {:.0} s after, {restarts} restarts", took.as_secs_f64()),
    );
}

#[test]
fn f07_bytes_run_out() {
    if !is_root("bytes run out") {
        return;
    }
    std::thread::scope(|scope| {
        for full in ["hot/out", "hot/.suture/work", "hot/done"] {
            scope.spawn(move || full_part(full));
        }
        scope.spawn(full_state);
        scope.spawn(full_beside);
        scope.spawn(whole_disk_full);
    });
}

/// One part of the folder is a small disk of its own, and full.
fn full_part(full: &str) {
    let stage = Stage::new();
    let _mount = Mount::tmpfs(&stage.at(full), "size=2m", 0);
    let mut daemon = stage.serve();
    let filler = stage.at(full).join("filler");
    fill_bytes(&filler);
    stage.put("part.stl", &large());
    // Room for results is looked at before a file is taken.
    let reason = || if full == "hot/out" { said(&stage, "hot") } else { stage.note("part.stl") };
    let words = if full == "hot/out" { "is nearly full" } else { "No space left" };
    stage.wait("a reason", 20, || reason().contains(words));
    let note = reason();
    stage.assert_originals("on a full disk");
    std::fs::remove_file(filler).unwrap();
    let took = stage.wait_done(40, &mut daemon);
    stage.assert_done();
    assert_eq!(daemon.restarts, 0);
    daemon.stop();
    row(
        "bytes run out",
        &format!("{full} is a full tmpfs, freed later"),
        &format!("{note:?}; done {:.0} s after", took.as_secs_f64()),
    );
}

/// What keeps the daemon of a hot folder from work.
fn said(stage: &Stage, folder: &str) -> String {
    let listed = stage.run(["status", "--dir", stage.at(folder).to_str().unwrap()]);
    String::from_utf8_lossy(&listed.stdout).lines().filter(|line| line.contains("nearly full")).collect()
}

/// Two folders, of which one has a disk that is nearly full, and then full to the last byte when the daemon begins: the other one goes on.
fn full_beside() {
    let mut stage = Stage::new();
    let other = stage.at("other");
    let _mount = Mount::tmpfs(&other, "size=8m", 0);
    let state = stage.at("state");
    stage.lines = stage.lines.replace("reserve = 1\n", &format!("reserve = \"1MiB\"\nstate = {state:?}\n"));
    stage.lines += &format!("[[folders]]\npath = {other:?}\n");
    let mut daemon = stage.serve();
    let [filler, more] = ["filler", "more"].map(|name| other.join(name));
    std::fs::write(&filler, vec![1; 8_000_000]).unwrap();
    stage.wait("it is said", 20, || {
        said(&stage, "hot").contains("other is nearly full; nothing new is taken there")
            && said(&stage, "hot").contains("disk full: the disk of ")
    });
    std::fs::write(other.join("in/waits.stl"), large()).unwrap();
    stage.put("part.stl", &large());
    let beside = stage.wait_done(30, &mut daemon);
    assert_eq!(stage.kind("waits.stl"), "queued", "it is not tried in vain");
    daemon.stop();
    fill_bytes(&more);
    let mut daemon = stage.start(stage.watch(&[]));
    stage.put("second.stl", &holes(4000, 2));
    stage.wait_done(30, &mut daemon);
    assert!(!other.join("out/waits.stl").exists() && other.join("in/waits.stl").exists());
    [filler, more].into_iter().for_each(|filler| std::fs::remove_file(filler).unwrap());
    let took = stage.wait("it is done", 40, || stage.kind("waits.stl") == "done");
    assert!(said(&stage, "hot").is_empty() && daemon.restarts == 0);
    daemon.stop();
    row(
        "bytes run out",
        "the disk of one of two folders is full, freed later",
        &format!("the other one goes on ({:.0} s); done {:.0} s after", beside.as_secs_f64(), took.as_secs_f64()),
    );
}

/// The job store has a small disk of its own, and that is full.
fn full_state() {
    let mut stage = Stage::new();
    let mount_at = stage.at("state-disk");
    let _mount = Mount::tmpfs(&mount_at, "size=24m", 0);
    stage.lines += &format!("state = {:?}\n", mount_at.join("state"));
    let mut daemon = stage.serve();
    stage.put("before.stl", &holes(600, 2));
    stage.wait_done(30, &mut daemon);
    let filler = mount_at.join("filler");
    fill_bytes(&filler);
    stage.put("part.stl", &large());
    for _ in 0..120 {
        std::thread::sleep(Duration::from_millis(100));
        daemon.tend();
        stage.assert_originals("the state's disk is full");
    }
    std::fs::remove_file(filler).unwrap();
    let took = stage.wait_done(40, &mut daemon);
    stage.assert_done();
    assert_eq!(daemon.restarts, 0, "it waits for room\n{}", stage.log());
    daemon.stop();
    row(
        "bytes run out",
        "the state's disk is full for 12 s, freed later",
        &format!("no restart; done {:.0} s after", took.as_secs_f64()),
    );
}

/// One disk for everything, full to the last byte once the file lies there.
fn whole_disk_full() {
    let stage = Stage::new();
    let _mount = Mount::tmpfs(&stage.at("hot"), "size=24m", 0);
    std::fs::create_dir(stage.hot("in")).unwrap();
    let mut daemon = stage.serve();
    daemon.stop();
    stage.put("part.stl", &large());
    let filler = stage.hot("filler");
    fill_bytes(&filler);
    let mut daemon = stage.start(stage.watch(&[]));
    for _ in 0..60 {
        std::thread::sleep(Duration::from_millis(100));
        daemon.tend();
        stage.assert_originals("the disk is full");
    }
    let (during, note) = (daemon.restarts, stage.note("part.stl"));
    std::fs::remove_file(filler).unwrap();
    let took = stage.wait_done(40, &mut daemon);
    stage.assert_done();
    daemon.stop();
    row(
        "bytes run out",
        "one disk for all, full for 6 s, freed later",
        &format!("{during} restarts after 75, {note:?}; done {:.0} s after", took.as_secs_f64()),
    );
}

/// A quota stops a write in its midst on a disk with room. A limit of the size of files does the same to every process, and needs no
/// kernel that was built with quotas.
#[test]
fn f07_a_quota_stops_writes() {
    let stage = Stage::new();
    let mut command = stage.watch(&[]);
    // SAFETY: between fork and exec only async-signal-safe calls are made: two plain system calls.
    unsafe {
        command.pre_exec(|| {
            // As with a quota, the write fails; no signal ends the process.
            libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
            Ok(())
        });
    }
    let mut daemon = stage.start(command);
    stage.wait_served(&mut daemon);
    for pid in processes_of(stage.binary()) {
        set_limit(pid, libc::RLIMIT_FSIZE, 900 << 10);
    }
    stage.put("part.stl", &holes(30_000, 1));
    stage.wait("a reason", 20, || !stage.note("part.stl").is_empty());
    let note = stage.note("part.stl");
    stage.assert_originals("over quota");
    for pid in processes_of(stage.binary()) {
        set_limit(pid, libc::RLIMIT_FSIZE, libc::RLIM_INFINITY);
    }
    let took = stage.wait_done(60, &mut daemon);
    stage.assert_done();
    daemon.stop();
    row(
        "quota",
        "RLIMIT_FSIZE of 900 KiB in place of a quota, raised later",
        &format!("{note:?}; done {:.0} s after, {} restarts", took.as_secs_f64(), daemon.restarts),
    );
}
