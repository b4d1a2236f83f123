//! No process and no thread is to be had.

use std::os::unix::process::CommandExt;
use std::time::Duration;

use crate::stage::{Stage, holes, row};
use crate::world::{is_root, processes_of, raise_limit_as};

/// Users of this scenario, so that no one else's processes count.
const FIRST_USER: u32 = 45_100;

#[test]
fn limit_of_processes() {
    if !is_root("processes") {
        return;
    }
    let limits: &[u32] = &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 16];
    let next = std::sync::atomic::AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                while let Some(limit) = limits.get(next.fetch_add(1, std::sync::atomic::Ordering::Relaxed)) {
                    limited(*limit);
                }
            });
        }
    });
}

/// The daemon's user may have that many processes and threads; later as many as it wants. It goes on, or ends with 75 and a line.
fn limited(limit: u32) {
    let user = FIRST_USER + limit;
    let stage = Stage::new().owned_by(user);
    for seed in 1..=3 {
        stage.put(&format!("{seed}.stl"), &holes(600, seed));
    }
    let mut command = stage.watch(&[]);
    // SAFETY: between fork and exec only an async-signal-safe call is made, with a local that outlives it.
    unsafe {
        command.pre_exec(move || {
            // The hard limit stays: to raise it again is not for every user.
            let mut now = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
            let done = libc::getrlimit(libc::RLIMIT_NPROC, &raw mut now) == 0 && {
                now.rlim_cur = limit.into();
                libc::setrlimit(libc::RLIMIT_NPROC, &raw const now) == 0
            };
            if done { Ok(()) } else { Err(std::io::Error::last_os_error()) }
        });
    }
    let mut daemon = stage.start(command);
    let early = daemon.ended_within(3);
    let during = stage.jobs();
    let note = during.iter().filter_map(|job| job["note"].as_str()).find(|note| !note.is_empty()).unwrap_or_default().to_owned();
    stage.assert_originals("at the limit");
    for pid in processes_of(stage.binary()) {
        raise_limit_as(user, pid, libc::RLIMIT_NPROC);
    }
    std::thread::sleep(Duration::from_millis(100));
    let took = stage.wait_done(60, &mut daemon);
    stage.assert_done();
    let done = during.iter().filter(|job| job["kind"] == "done").count();
    daemon.stop();
    row(
        "processes",
        &format!("RLIMIT_NPROC {limit} for 3 s, then none"),
        &format!(
            "under it {done} of 3 done, ended: {:?}, {note:?}; {} restarts after 75; all done {:.0} s after",
            early.and_then(|status| status.code()),
            daemon.restarts,
            took.as_secs_f64()
        ),
    );
}
