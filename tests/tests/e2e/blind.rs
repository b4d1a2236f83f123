//! The system tells nobody of changes: files are found by looking.

use std::io;
use std::os::unix::process::CommandExt;
use std::process::Command;
use std::time::Duration;

use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::served::{Served, jobs, wait_until};

/// As the configuration says.
const RESCAN: Duration = Duration::from_secs(2);

/// This system call fails in the process that the command starts, and in those that it starts itself.
fn fail(command: &mut Command, call: libc::c_long, errno: i32) {
    let op = |code: u32, jt: u8, jf: u8, k: u32| libc::sock_filter { code: code as u16, jt, jf, k };
    let filter = [
        op(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, 0, 0, 0),
        op(libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K, 0, 1, call as u32),
        op(libc::BPF_RET | libc::BPF_K, 0, 0, libc::SECCOMP_RET_ERRNO | errno as u32),
        op(libc::BPF_RET | libc::BPF_K, 0, 0, libc::SECCOMP_RET_ALLOW),
    ];
    let on: libc::c_ulong = 1;
    let off: libc::c_ulong = 0;
    // SAFETY: between fork and exec only plain system calls are made, with a pointer to what the closure owns.
    unsafe {
        command.pre_exec(move || {
            let program = libc::sock_fprog { len: filter.len() as u16, filter: filter.as_ptr().cast_mut() };
            let done = libc::prctl(libc::PR_SET_NO_NEW_PRIVS, on, off, off, off) == 0
                && libc::prctl(libc::PR_SET_SECCOMP, libc::SECCOMP_MODE_FILTER, &raw const program) == 0;
            if done { Ok(()) } else { Err(io::Error::last_os_error()) }
        });
    }
}

/// Each file is found within two scans, and is one job.
fn found_without(call: libc::c_long, errno: i32) {
    let place = Place::new();
    place.put("suture.toml", b"settle = \"30ms\"\nrescan = \"2s\"\n[[folders]]\npath = \"hot\"\n");
    std::fs::create_dir_all(place.at("hot/in/sub")).unwrap();
    let mut command = place.command();
    command.args(["watch", "--config", "suture.toml"]);
    fail(&mut command, call, errno);
    let daemon = Served::of(&place, command, "log");
    assert_eq!(daemon.lines("Serving a hot folder.")[0]["polled"], true);
    assert_eq!(daemon.lines("The system does not tell of changes; polling.").len(), 1);
    let names = ["a.stl", "new/c.stl", "sub/b.stl"];
    for (seed, name) in (1..).zip(names) {
        let (dropped, path) = (place.put("dropped", &holes(seed)), place.at("hot/in").join(name));
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::rename(dropped, path).unwrap();
        let took = wait_until(name, || place.at("hot/done").join(name).exists());
        assert!(took <= 2 * RESCAN, "{name}: {took:?}");
    }
    // No later scan takes one of them for another.
    std::thread::sleep(RESCAN + RESCAN / 2);
    let all = jobs(&place, "hot");
    assert!(all.len() == names.len() && all.iter().all(|job| job["kind"] == "done"), "{all:?}");
    let out = place.names("hot/out").into_iter().filter(|name| !name.ends_with(".json"));
    assert!(out.eq(names), "{:?}", place.names("hot/out"));
}

#[test]
fn f18_files_are_found_where_the_system_tells_of_nothing() {
    found_without(libc::SYS_inotify_init1, libc::ENOSYS);
}

/// The most common reason: other programs of the user watch as many folders as one may.
#[test]
fn f18_files_are_found_where_no_more_folders_may_be_watched() {
    found_without(libc::SYS_inotify_add_watch, libc::ENOSPC);
}
