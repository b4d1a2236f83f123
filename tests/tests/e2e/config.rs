//! The configuration: `suture config check|print`, and a running daemon that reads it anew.

use std::time::{Duration, Instant};

use rustix::process::Signal;
use serde_json::Value;
use suture_bench::generate::Case;
use suture_tests::Place;
use suture_tests::hot::mesh;
use suture_tests::served::{Served, wait_until};

/// A daemon at work in a place.
struct Daemon<'a> {
    place: &'a Place,
    served: Served<'a>,
}

impl<'a> Daemon<'a> {
    fn start(place: &'a Place, arguments: &[&str]) -> Self {
        Self { place, served: Served::start(place, arguments, "log") }
    }

    fn lines(&self, words: &str) -> Vec<Value> {
        self.served.lines(words)
    }

    fn signal(&self, signal: Signal) {
        self.served.signal(signal);
    }

    /// Sends SIGHUP; the one line that says what came of it.
    fn hang_up(&self, words: &str) -> Value {
        let before = self.lines(words).len();
        self.signal(Signal::HUP);
        wait_until(words, || self.lines(words).len() > before);
        assert_eq!(self.lines(words).len(), before + 1);
        self.lines(words).remove(before)
    }

    /// Drops a file into the folder; the part of it that the original ends up in.
    fn drop_in(&self, name: &str, bytes: &[u8]) -> &'static str {
        // Renamed into place, so that it need not rest.
        self.place.put("drop.part", bytes);
        std::fs::create_dir_all(self.place.at(&format!("hot/in/{name}")).parent().unwrap()).unwrap();
        std::fs::rename(self.place.at("drop.part"), self.place.at(&format!("hot/in/{name}"))).unwrap();
        let mut came = None;
        wait_until(name, || {
            came = ["done", "failed"].into_iter().find(|part| self.place.at(&format!("hot/{part}/{name}")).exists());
            came.is_some()
        });
        came.unwrap()
    }

    fn end(self) {
        self.signal(Signal::TERM);
        let status = self.served.ended();
        assert_eq!(status.code(), Some(0), "{status}");
    }
}

const GOOD: &str = "memory = \"2GiB\"\n\n[[folders]]\npath = \"hot\"\n\n[[folders]]\npath = \"scans\"\nprofile = \"scan\"\n\n[profiles.resin]\nmax_hole_edges = 500\n";

#[test]
fn check_says_what_is_there_or_which_line_is_wrong() {
    let place = Place::new();
    place.put("suture.toml", GOOD.as_bytes());
    let good = place.suture(["config", "check", "suture.toml"]).expect(0);
    assert_eq!(good.stdout(), "suture.toml: good: 2 folders (hot, scans), 1 profile (resin)\n");
    assert_eq!(place.names(""), ["suture.toml"], "folders that are not there are not made");
    let mistakes = [
        (GOOD.replace("memory", "memroy"), "line 1, `memroy = \"2GiB\"`: unknown field `memroy`, expected one of"),
        (GOOD.replace("2GiB", "2 ells"), "line 1, `memory = \"2 ells\"`: `2 ells` is not a size (try 512MiB or 2GiB)"),
        (GOOD.replace("2GiB", "1MiB"), "line 1, `memory = \"1MiB\"`: 1.0 MB of memory are too little for 2 workers"),
        (GOOD.replace("\"hot\"", "\"scans\""), "line 7, `path = \"scans\"`: two folders are called `scans`"),
        (GOOD.replace("\"hot\"", "\"scans/in/x\""), "line 4, `path = \"scans/in/x\"`: scans/in/x lies in the hot folder scans"),
        (GOOD.replace("\"scan\"", "\"scam\""), "line 8, `profile = \"scam\"`: there is no profile `scam`; name one of"),
        (GOOD.replace("500", "-500"), "line 11, `max_hole_edges = -500`: invalid value"),
        (
            GOOD.replace("500", "5\nmax_skin_lost = 2.0"),
            "line 12, `max_skin_lost = 2.0`: `max_skin_lost` must be a number from 0 to 1, not 2",
        ),
        (GOOD.replace("[profiles.resin]", "[profiles.resin"), "line 10, `[profiles.resin`: "),
    ];
    for (text, words) in mistakes {
        place.put("suture.toml", text.as_bytes());
        for command in
            [["config", "check", "suture.toml"], ["config", "print", "suture.toml"], ["watch", "--config", "suture.toml"]]
        {
            let ran = place.suture(command).expect(2);
            let said = ran.stderr();
            assert!(ran.stdout().is_empty() && said.lines().count() == 1, "{said}");
            if command[0] == "config" {
                assert!(said.starts_with(&format!("suture: suture.toml: {words}")), "{words}: {said}");
            }
        }
    }
    let said = place.suture(["config", "check", "none.toml"]).expect(2).stderr();
    assert!(said.starts_with("suture: none.toml: cannot read the configuration"), "{said}");
    assert_eq!(place.names(""), ["suture.toml"], "nothing was made");
}

#[test]
fn what_is_printed_is_read_back() {
    let place = Place::new();
    let every = [
        "memory",
        "workers",
        "threads",
        "large",
        "reserve",
        "settle",
        "rescan",
        "drain",
        "time_limit.base",
        "time_limit.per_gib",
        "state",
        "path",
        "name",
        "profile",
    ];
    let defaults = place.suture(["config", "print"]).expect(0).stdout();
    for name in every {
        assert!(defaults.lines().any(|line| line.starts_with(&format!("{name} = "))), "{name}: {defaults}");
    }
    assert!(defaults.contains("path = \"prints\"") && defaults.contains("profile = \"default\""));
    let all = format!(
        "settle = 2\nrescan = \"auto\"\ndrain = \"90s\"\nlarge = 1000000\nreserve = \"1GB\"\nstate = \"elsewhere\"\nworkers = 3\nthreads = 5\n\
         time_limit = {{ base = \"1500ms\" }}\n{GOOD}"
    );
    for text in [defaults, GOOD.to_owned(), all] {
        place.put("suture.toml", text.as_bytes());
        let printed = place.suture(["config", "print", "suture.toml"]).expect(0).stdout();
        place.put("printed.toml", printed.as_bytes());
        place.suture(["config", "check", "printed.toml"]).expect(0);
        assert_eq!(place.suture(["config", "print", "printed.toml"]).expect(0).stdout(), printed);
    }
    let printed = String::from_utf8(place.read("printed.toml")).unwrap();
    for line in [
        "settle = \"2s\"",
        "rescan = \"auto\"",
        "drain = \"90s\"",
        "large = \"1000000B\"",
        "reserve = \"1000000000B\"",
        "memory = \"2GiB\"",
        "time_limit.base = \"1.5s\"",
        "time_limit.per_gib = \"20m\"",
        "[profiles.resin]",
        "max_hole_edges = 500",
        "fill_holes = true",
    ] {
        assert!(printed.lines().any(|there| there == line), "{line}: {printed}");
    }
}

/// A configuration in which the profile `resin` fills holes or not, after these lines.
fn configuration(lines: &str, fills: bool) -> String {
    format!(
        "{lines}\n[[folders]]\npath = \"hot\"\n\n[profiles.resin]\nguarantee = \"strict\"\nfill_holes = {fills}\ngap_edge_share = 0.0\n"
    )
}

/// F26: one with a mistake changes nothing, one that is right counts for the next file, and the daemon goes on.
#[test]
fn f26_a_running_daemon_reads_its_configuration_anew() {
    let place = Place::new();
    let holes = mesh(Case::Holes, 1);
    place.put("suture.toml", configuration("settle = \"50ms\"", false).as_bytes());
    let daemon = Daemon::start(&place, &["--config", "suture.toml"]);
    assert_eq!(daemon.drop_in("resin/a.stl", &holes), "failed", "it may not fill holes");

    place.put("suture.toml", configuration("settle = \"50ms\"\nmemroy = 1", true).as_bytes());
    let line = daemon.hang_up("not taken over");
    assert_eq!(line["level"], "ERROR");
    assert!(line["reason"].as_str().unwrap().contains("suture.toml: line 2, `memroy = 1`: unknown field"), "{line}");
    assert_eq!(daemon.drop_in("resin/b.stl", &holes), "failed", "the old one is in force");

    // What needs a restart keeps all the rest from changing.
    place.put("suture.toml", configuration("state = \"elsewhere\"", true).as_bytes());
    let line = daemon.hang_up("not taken over");
    assert!(line["reason"].as_str().unwrap().contains("only a restart of the daemon changes `state`"), "{line}");
    assert_eq!(daemon.drop_in("resin/c.stl", &holes), "failed");

    place.put("suture.toml", configuration("settle = \"60ms\"", true).as_bytes());
    let line = daemon.hang_up("is in force");
    assert_eq!(
        (&line["level"], &line["changes"]),
        (&"INFO".into(), &"settle \"50ms\" -> \"60ms\", profile resin changed".into())
    );
    assert_eq!(daemon.drop_in("resin/d.stl", &holes), "done", "the new one is in force");
    assert!(place.at("hot/out/resin/d.stl").exists());
    daemon.end();
}

/// More workers, and fewer: so many files are worked on at a time, without a restart.
#[test]
fn the_number_of_workers_is_read_anew() {
    let place = Place::new();
    let configuration = |workers: usize| format!("settle = \"30ms\"\nworkers = {workers}\n[[folders]]\npath = \"hot\"\n");
    place.put("suture.toml", configuration(1).as_bytes());
    let daemon = Daemon::start(&place, &["--config", "suture.toml"]);
    let slots = || {
        let tasks = std::fs::read_dir(format!("/proc/{}/task", daemon.served.pid())).unwrap().flatten();
        tasks.filter(|task| std::fs::read_to_string(task.path().join("comm")).is_ok_and(|name| name.trim() == "slot")).count()
    };
    wait_until("the thread is there", || slots() == 1);
    // As many compute as there are workers, and as many bring results into place meanwhile.
    for (workers, threads) in [(3, 6), (2, 6)] {
        place.put("suture.toml", configuration(workers).as_bytes());
        daemon.hang_up("is in force");
        wait_until("the threads are there", || slots() == threads);
        for n in 0..8 {
            daemon.drop_in(&format!("{workers}-{n}.stl"), &mesh(Case::Holes, n));
        }
    }
    daemon.end();
}

/// A file that waits for a mistake to be mended is tried when the configuration is read anew.
#[test]
fn reading_anew_tries_what_waits() {
    let place = Place::new();
    place.put("suture.toml", configuration("", true).as_bytes());
    place.put("hot/in/mine/.suture.toml", b"max_hole_edgse = 7\n");
    place.put("hot/in/mine/part.stl", &mesh(Case::Holes, 1));
    let daemon = Daemon::start(&place, &["--config", "suture.toml", "--settle", "50ms"]);
    let list = || place.suture(["jobs", "list", "--dir", "hot"]).expect(0).stdout();
    wait_until("it waits", || list().contains("waiting"));
    std::fs::remove_file(place.at("hot/in/mine/.suture.toml")).unwrap();
    assert_eq!(daemon.hang_up("is in force")["changes"], "none");
    let start = Instant::now();
    wait_until("it is done", || place.at("hot/done/mine/part.stl").exists());
    assert!(start.elapsed() < Duration::from_secs(10), "it waited for its own time, 15 s");
    daemon.end();
}

/// F26: without a file there is nothing to read, and SIGHUP does not end the daemon.
#[test]
fn f26_a_daemon_without_a_configuration_is_not_ended_by_sighup() {
    let place = Place::new();
    let daemon = Daemon::start(&place, &["hot", "--settle", "50ms"]);
    assert_eq!(daemon.hang_up("SIGHUP changes nothing")["level"], "WARN");
    assert_eq!(daemon.drop_in("part.stl", &mesh(Case::Holes, 1)), "done");
    daemon.end();
}
