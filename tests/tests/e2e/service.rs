//! The daemon as a service: what it tells the service manager, and how it is looked at.

use std::fs::File;
use std::io::{Read, Write};
use std::os::unix::net::UnixDatagram;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::Signal;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use serde_json::Value;
use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::served::{Served, jobs, wait_until};

/// All that was heard so far, a line each.
fn heard(manager: &UnixDatagram, all: &mut Vec<String>) {
    let mut words = [0; 4096];
    while let Ok(n) = manager.recv(&mut words) {
        all.extend(String::from_utf8_lossy(&words[..n]).lines().map(str::to_owned));
    }
}

fn manager(place: &Place) -> UnixDatagram {
    let socket = UnixDatagram::bind(place.at("notify")).unwrap();
    socket.set_nonblocking(true).unwrap();
    socket
}

#[test]
fn f27_the_service_manager_hears_of_its_whole_life() {
    let place = Place::new();
    let socket = manager(&place);
    place.put("suture.toml", b"settle = \"30ms\"\n[[folders]]\npath = \"hot\"\n");
    let mut command = place.command();
    command.args(["watch", "--config", "suture.toml"]).env("NOTIFY_SOCKET", place.at("notify")).env("WATCHDOG_USEC", "900000");
    let daemon = Served::of(&place, command, "log");
    let mut all = Vec::new();
    let mut wait_for = |what: &str, count: usize| {
        wait_until(what, || {
            heard(&socket, &mut all);
            all.iter().filter(|line| line.starts_with(what)).count() >= count
        });
        all.clone()
    };
    wait_for("READY=1", 1);
    wait_for("WATCHDOG=1", 4);
    let all_so_far = wait_for("STATUS=0 waiting, 0 in work", 1);
    assert!(!all_so_far.iter().any(|line| line.starts_with("RELOADING") || line.starts_with("STOPPING")), "{all_so_far:?}");
    daemon.signal(Signal::HUP);
    let reloaded = wait_for("READY=1", 2);
    let at = |line: &str| reloaded.iter().position(|there| there.starts_with(line)).unwrap_or(usize::MAX);
    assert!(at("RELOADING=1") < reloaded.len() && at("MONOTONIC_USEC=") == at("RELOADING=1") + 1, "{reloaded:?}");
    // Stopped as by a debugger, it says nothing.
    daemon.signal(Signal::STOP);
    std::thread::sleep(Duration::from_millis(300));
    let before = wait_for("READY=1", 2).len();
    std::thread::sleep(Duration::from_millis(1500));
    assert_eq!(wait_for("READY=1", 2).len(), before);
    daemon.signal(Signal::CONT);
    daemon.signal(Signal::TERM);
    wait_for("STOPPING=1", 1);
    assert!(daemon.ended().success());
}

/// The threads around go on, but that which looks after the folders is held up: it is not said that the daemon goes on.
#[test]
fn f27_a_daemon_that_stalls_does_not_say_that_it_goes_on() {
    let place = Place::new();
    let socket = manager(&place);
    let mut command = place.command();
    command.args(["watch", "hot", "--settle", "30ms"]).env("NOTIFY_SOCKET", place.at("notify")).env("WATCHDOG_USEC", "900000");
    let daemon = Served::of(&place, command, "log");
    let mut all = Vec::new();
    wait_until("it goes on", || {
        heard(&socket, &mut all);
        all.iter().any(|line| line == "WATCHDOG=1")
    });
    let keeper = Held::thread(daemon.pid());
    // What was under way before, and what the time allows.
    std::thread::sleep(Duration::from_millis(1500));
    heard(&socket, &mut all);
    all.clear();
    wait_until("the others go on", || {
        heard(&socket, &mut all);
        all.iter().any(|line| line.starts_with("STATUS="))
    });
    assert!(!all.iter().any(|line| line == "WATCHDOG=1"), "{all:?}");
    drop(keeper);
    wait_until("it goes on again", || {
        heard(&socket, &mut all);
        all.iter().any(|line| line == "WATCHDOG=1")
    });
}

/// A thread that is held, and nothing else of its process.
struct Held(i32);

impl Held {
    fn thread(thread: u32) -> Self {
        let thread = i32::try_from(thread).unwrap();
        // SAFETY: no address is passed.
        let stopped = unsafe {
            libc::ptrace(libc::PTRACE_SEIZE, thread, 0, 0) == 0
                && libc::ptrace(libc::PTRACE_INTERRUPT, thread, 0, 0) == 0
                && libc::waitpid(thread, std::ptr::null_mut(), libc::__WALL) == thread
        };
        assert!(stopped, "{}", std::io::Error::last_os_error());
        Self(thread)
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        // SAFETY: no address is passed.
        unsafe { libc::ptrace(libc::PTRACE_DETACH, self.0, 0, 0) };
    }
}

/// For the other socket, which is not in the file system.
#[test]
fn a_name_that_is_no_file_is_reached() {
    use std::os::linux::net::SocketAddrExt;
    let place = Place::new();
    let name = format!("suture-e2e-{}", std::process::id());
    let address = std::os::unix::net::SocketAddr::from_abstract_name(&name).unwrap();
    let socket = UnixDatagram::bind_addr(&address).unwrap();
    socket.set_nonblocking(true).unwrap();
    let mut command = place.command();
    command.args(["watch", "hot", "--once"]).env("NOTIFY_SOCKET", format!("@{name}"));
    assert!(command.output().unwrap().status.success());
    let mut all = Vec::new();
    heard(&socket, &mut all);
    assert!(["READY=1", "STOPPING=1"].iter().all(|word| all.iter().any(|line| line == word)), "{all:?}");
}

#[test]
fn a_daemon_is_shown_on_one_screen_and_its_store_without_one() {
    let place = Place::new();
    let status = |code: i32, options: &[&str]| {
        let ran = place.suture(["status", "--dir", "hot"].iter().chain(options)).expect(code);
        (ran.stdout(), ran.stderr())
    };
    assert!(status(2, &[]).1.contains("is no hot folder"));
    let daemon = Served::start(&place, &["hot", "--settle", "30ms"], "log");
    place.put("hot/in/part.stl", &holes(1));
    place.put("hot/in/picture.stl", b"\x89PNG\r\n\x1a\nendsolid");
    wait_until("both end", || {
        jobs(&place, "hot").iter().filter(|job| job["kind"] == "done" || job["kind"] == "failed").count() == 2
    });
    wait_until("it is ready", || place.suture(["status", "--ready", "--dir", "hot"]).code() == 0);
    place.suture(["jobs", "pause", "--dir", "hot"]).expect(0);
    let text = status(0, &[]).0;
    for words in
        ["runs since", "ready", "waiting   none", "ended     1 done, 1 failed", "an operator has paused it", "part.stl", "free"]
    {
        assert!(text.contains(words), "{words}: {text}");
    }
    let told: Value = serde_json::from_str(&status(0, &["--json"]).0).unwrap();
    assert_eq!(
        (&told["jobs"]["done"], &told["ready"], told["last"].as_array().map(Vec::len)),
        (&1.into(), &true.into(), Some(2))
    );
    assert!(told["store_bytes"].as_u64().is_some_and(|bytes| bytes > 0) && told["since"].is_u64(), "{told}");
    daemon.signal(Signal::TERM);
    assert!(daemon.ended().success());
    let text = status(0, &[]).0;
    for words in ["no daemon runs", "ended     1 done, 1 failed", "an operator has paused it", "part.stl"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    status(1, &["--ready"]);
    let told: Value = serde_json::from_str(&status(0, &["--json"]).0).unwrap();
    assert_eq!((&told["ready"], told.get("since").is_some_and(Value::is_u64)), (&false.into(), false));
    assert!(place.suture(["top", "--dir", "hot"]).expect(2).stderr().contains("needs a terminal"));
}

/// The cursor and the screen of before.
const END: &str = "\x1b[?25h\x1b[?1049l";

#[test]
fn top_shows_it_until_someone_has_seen_enough() {
    let place = Place::new();
    let _daemon = Served::start(&place, &["hot", "--settle", "30ms"], "log");
    let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&ours).unwrap();
    unlockpt(&ours).unwrap();
    let name = ptsname(&ours, Vec::new()).unwrap();
    let theirs = || File::options().read(true).write(true).open(name.to_str().unwrap()).unwrap();
    let mut command = place.command();
    command.args(["top", "--dir", "hot"]).stdin(theirs()).stdout(theirs()).stderr(theirs());
    let mut child = command.spawn().unwrap();
    drop(command);
    let (mut ours, mut seen, mut buffer, mut asked) = (File::from(ours), String::new(), [0; 4096], false);
    // An end of the terminal stays open here: what the program wrote last is there to be read after it ended.
    let _kept = theirs();
    wait_until("the terminal is as it was", || {
        while poll(&mut [PollFd::new(&ours, PollFlags::IN)], Some(&Timespec::default())).unwrap() > 0 {
            let count = ours.read(&mut buffer).unwrap();
            seen += &String::from_utf8_lossy(&buffer[..count]);
        }
        // The second time it is another second.
        if !asked && seen.matches("  job store").count() >= 2 {
            ours.write_all(b"xq").unwrap();
            asked = true;
        }
        asked && seen.ends_with(END)
    });
    assert!(child.wait().unwrap().success());
    assert!(seen.contains("hot: suture ") && seen.contains("runs since"), "{seen}");
    assert!(seen.starts_with("\x1b[?1049h\x1b[?25l") && !seen.contains("xq"), "{seen:?}");
}
