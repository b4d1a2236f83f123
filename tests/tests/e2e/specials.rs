//! What lies in `in/` and is no file: it is not followed, not waited for, and told of once.

use std::ffi::CString;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::symlink;
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::time::Duration;

use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::served::{Served, jobs, wait_until};

fn make_pipe(path: &Path) {
    let path = CString::new(path.as_os_str().as_bytes()).unwrap();
    // SAFETY: the pointer is to a string that outlives the call.
    assert_eq!(unsafe { libc::mkfifo(path.as_ptr(), 0o666) }, 0);
}

/// Links to a file and to a folder, a pipe and a socket, among them a file that has a second name elsewhere: that is a file like any other.
#[test]
fn f24_links_pipes_and_sockets_are_left_and_told_of_once() {
    let place = Place::new();
    let config = "settle = \"30ms\"\nrescan = \"300ms\"\n[[folders]]\npath = \"hot\"\n";
    place.put("suture.toml", config.as_bytes());
    place.put("linked.stl", &holes(1));
    place.put("named.stl", &holes(2));
    let inbox = place.at("hot/in");
    std::fs::create_dir_all(&inbox).unwrap();
    symlink(place.at("linked.stl"), inbox.join("link.stl")).unwrap();
    symlink(place.at(""), inbox.join("folder.stl")).unwrap();
    make_pipe(&inbox.join("pipe.stl"));
    let _socket = UnixListener::bind(inbox.join("socket.stl")).unwrap();
    std::fs::hard_link(place.at("named.stl"), inbox.join("second.stl")).unwrap();
    let daemon = Served::start(&place, &["--config", "suture.toml"], "log");
    wait_until("the file is done", || place.at("hot/done/second.stl").exists());
    let noticed = || jobs(&place, "hot").iter().filter(|job| job["kind"] == "noticed").count();
    wait_until("all four are noticed", || noticed() == 4);
    // Four more scans.
    std::thread::sleep(Duration::from_millis(1500));
    let told = daemon.lines("Left where it is.");
    let text = |value: &serde_json::Value| value.as_str().unwrap_or_default().to_owned();
    let mut told: Vec<_> = told.iter().map(|line| (text(&line["file"]), text(&line["what"]))).collect();
    told.sort();
    let a_link = "a symbolic link, which is not followed";
    let expected = [("folder.stl", a_link), ("link.stl", a_link), ("pipe.stl", "a pipe"), ("socket.stl", "a socket")];
    assert_eq!(told, expected.map(|(file, what)| (file.to_owned(), what.to_owned())));
    assert_eq!(place.names("hot/out"), ["second.stl", "second.stl.report.json", "second.stl.suture.json"]);
    assert_eq!((place.read("linked.stl"), place.read("named.stl")), (holes(1), holes(2)));
    assert_eq!(noticed(), 4);
}
