//! A hot folder for one scenario: what was dropped in it, its daemon, and whether all is as it must be.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs::{File, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use serde_json::Value;
use suture_bench::generate::{Case, write};
use suture_tests::binary::suture;

use crate::world::{processes_of, send};

/// Where originals may lie.
const AREAS: [&str; 4] = ["in", "done", "failed", "quarantine"];
/// How often a wait looks.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// A mesh with holes.
pub(crate) fn holes(triangles: u64, number: u64) -> Vec<u8> {
    /// Their holes are small against so small a mesh: nobody is asked about them.
    const SEEDS: [u64; 16] = [1, 2, 3, 4, 5, 7, 10, 11, 13, 18, 19, 21, 22, 24, 25, 26];
    let seed = if triangles == 600 { SEEDS[(number - 1) as usize % SEEDS.len()] } else { number };
    let mut bytes = Vec::new();
    write(Case::Holes, triangles, seed, &mut bytes).expect("a mesh is generated into memory");
    bytes
}

/// One line of the table.
pub(crate) fn row(scenario: &str, done: &str, seen: &str) {
    println!("| {scenario} | {done} | {seen} |");
}

/// A folder with a hot folder `hot` in it.
pub(crate) struct Stage {
    dir: tempfile::TempDir,
    binary: PathBuf,
    /// Who runs the daemon; root or whoever runs the test by default.
    user: Option<u32>,
    /// Lines of the configuration before its folders.
    pub lines: String,
    dropped: Mutex<BTreeMap<String, Vec<u8>>>,
}

impl Stage {
    pub(crate) fn new() -> Self {
        Self::of(suture())
    }

    /// To be served by `binary`.
    pub(crate) fn of(binary: &Path) -> Self {
        let dir = tempfile::Builder::new().prefix("suture-trouble-").tempdir().expect("a temporary folder");
        // Other users run the binary from here; its path is this scenario's own, so that its processes are known by it.
        std::fs::set_permissions(dir.path(), Permissions::from_mode(0o755)).expect("the folder can be opened to others");
        let own = dir.path().join("suture");
        if std::fs::hard_link(binary, &own).is_err() {
            std::fs::copy(binary, &own).expect("the binary can be copied");
        }
        for part in ["hot", "hot/in"] {
            std::fs::create_dir(dir.path().join(part)).expect("the hot folder can be made");
        }
        let lines = "settle = \"30ms\"\nreserve = 1\nworkers = 2\nthreads = 1\n".to_owned();
        Self { dir, binary: own, user: None, lines, dropped: Mutex::default() }
    }

    /// The hot folder belongs to this user, who runs the daemon.
    pub(crate) fn owned_by(mut self, user: u32) -> Self {
        for part in ["hot", "hot/in"] {
            std::os::unix::fs::chown(self.at(part), Some(user), Some(user)).expect("root may give folders away");
        }
        self.user = Some(user);
        self
    }

    pub(crate) fn at(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub(crate) fn hot(&self, name: &str) -> PathBuf {
        self.at("hot").join(name)
    }

    pub(crate) fn binary(&self) -> &Path {
        &self.binary
    }

    /// Drops a file into `in/`, and remembers it.
    pub(crate) fn put(&self, name: &str, bytes: &[u8]) {
        self.expect(name, bytes);
        let path = self.hot("in").join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("the sub-folder can be made");
        std::fs::write(path, bytes).expect("the file can be written");
    }

    /// Remembers a file that is dropped in another way.
    pub(crate) fn expect(&self, name: &str, bytes: &[u8]) {
        self.dropped.lock().expect("no test panicked").insert(name.into(), bytes.into());
    }

    /// `suture` with these arguments, as the user of the stage.
    pub(crate) fn command<A: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = A>) -> Command {
        let mut command = Command::new(&self.binary);
        command.args(arguments).current_dir(self.at("")).env_remove("RUST_LOG").env("SUTURE_LOG", "info");
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        if let Some(user) = self.user {
            command.uid(user).gid(user);
        }
        command
    }

    pub(crate) fn run<A: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = A>) -> Output {
        self.command(arguments).output().expect("the binary can be started")
    }

    /// `suture watch` by the configuration; its log goes to a file.
    pub(crate) fn watch(&self, options: &[&str]) -> Command {
        self.watch_by(&format!("{}[[folders]]\npath = {:?}\n", self.lines, self.at("hot")), options)
    }

    /// `suture watch` by this configuration.
    pub(crate) fn watch_by(&self, text: &str, options: &[&str]) -> Command {
        let file = self.at("suture.toml");
        std::fs::write(&file, text).expect("the configuration can be written");
        let mut command = self.command(["watch", "--config"]);
        command.arg(file).args(options).stdout(Stdio::null());
        let log = File::options().create(true).append(true).open(self.at("log")).expect("the log can be opened");
        command.stderr(log);
        command
    }

    /// Starts the daemon and waits until it serves.
    pub(crate) fn serve(&self) -> Daemon<'_> {
        let mut daemon = self.start(self.watch(&[]));
        self.wait_served(&mut daemon);
        daemon
    }

    /// Waits until a daemon that was just started serves.
    pub(crate) fn wait_served(&self, daemon: &mut Daemon) {
        self.wait("the daemon to serve", 20, || {
            daemon.tend();
            self.hot(".suture/control.sock").exists()
        });
    }

    /// Starts the daemon.
    pub(crate) fn start(&self, mut command: Command) -> Daemon<'_> {
        Daemon { child: command.spawn().expect("the daemon can be started"), stage: self, restarts: 0 }
    }

    /// What the daemon has said so far.
    pub(crate) fn log(&self) -> String {
        std::fs::read_to_string(self.at("log")).unwrap_or_default()
    }

    /// What `suture jobs list --json` says; nothing while the store is out of reach.
    pub(crate) fn jobs(&self) -> Vec<Value> {
        let hot = self.at("hot");
        let listed = self.run(["jobs", "list", "--json", "--dir"].map(OsStr::new).into_iter().chain([hot.as_os_str()]));
        // No hot folder yet, another owner, or a store that cannot be read now.
        let code = listed.status.code();
        assert!(matches!(code, Some(0 | 2 | 73 | 75)), "jobs list: {code:?}: {}", String::from_utf8_lossy(&listed.stderr));
        let silent = String::from_utf8_lossy(&listed.stderr).contains("does not answer");
        assert!(!silent, "the daemon runs, but does not say what it does");
        String::from_utf8_lossy(&listed.stdout).lines().map(|line| serde_json::from_str(line).expect("a line of JSON")).collect()
    }

    /// The last job of a file.
    pub(crate) fn job(&self, name: &str) -> Option<Value> {
        self.jobs().into_iter().rfind(|job| job["source"]["path"] == name)
    }

    pub(crate) fn kind(&self, name: &str) -> String {
        self.job(name).map(|job| text(&job["kind"])).unwrap_or_default()
    }

    /// Why a file waits.
    pub(crate) fn note(&self, name: &str) -> String {
        self.job(name).map(|job| text(&job["note"])).unwrap_or_default()
    }

    /// Waits; fails when it takes longer than it ever should. Returns how long it took.
    pub(crate) fn wait(&self, what: &str, seconds: u64, mut until: impl FnMut() -> bool) -> Duration {
        let start = Instant::now();
        while !until() {
            if start.elapsed() > Duration::from_secs(seconds) {
                let log = self.log();
                let tail: Vec<_> = log.lines().rev().take(30).collect();
                panic!(
                    "waited {seconds} s for {what}\n{:#?}\n{}",
                    self.jobs(),
                    tail.into_iter().rev().collect::<Vec<_>>().join("\n")
                );
            }
            std::thread::sleep(LOOK_EVERY);
        }
        start.elapsed()
    }

    /// Waits until every dropped file has its result and lies in `done/`.
    pub(crate) fn wait_done(&self, seconds: u64, daemon: &mut Daemon) -> Duration {
        self.wait("every file to be done", seconds, || {
            daemon.tend();
            let jobs = self.jobs();
            let done = |name: &String| jobs.iter().any(|job| job["source"]["path"] == name.as_str() && job["kind"] == "done");
            self.dropped.lock().expect("no test panicked").keys().all(done)
        })
    }

    /// Every file below a part of the hot folder.
    pub(crate) fn files(&self, part: &str) -> BTreeMap<String, Vec<u8>> {
        let mut files = BTreeMap::new();
        let root = self.hot(part);
        collect(&root, &root, &mut files);
        files
    }

    /// Where the original of `name` lies, byte for byte as dropped.
    pub(crate) fn places(&self, name: &str) -> Vec<String> {
        let dropped = self.dropped.lock().expect("no test panicked");
        let bytes = &dropped[name];
        AREAS
            .iter()
            .flat_map(|area| self.files(area).into_iter().map(move |(path, content)| (area, path, content)))
            .filter(|(_, path, content)| unversioned(path) == name && content == bytes)
            .map(|(area, path, _)| format!("{area}/{path}"))
            .collect()
    }

    /// Every original is whole in one place, whatever goes on.
    pub(crate) fn assert_originals(&self, when: &str) {
        let names: Vec<String> = self.dropped.lock().expect("no test panicked").keys().cloned().collect();
        for name in names {
            let places = self.places(&name);
            assert_eq!(places.len(), 1, "{when}: {name} is in {places:?}\n{}", self.log());
        }
    }

    /// Every file is done: one original in `done/`, one right result in `out/`, nothing else, nothing left over.
    pub(crate) fn assert_done(&self) {
        let dropped = self.dropped.lock().expect("no test panicked").clone();
        self.assert_originals("at the end");
        let out: Vec<(String, Vec<u8>)> = self.files("out").into_iter().filter(|(name, _)| !name.ends_with(".json")).collect();
        for (name, bytes) in &dropped {
            let results: Vec<_> = out.iter().filter(|(path, _)| unversioned(path) == *name).collect();
            assert_eq!(results.len(), 1, "results of {name}: {:?}", self.files("out").keys());
            assert!(results[0].1 == result_of(bytes), "{name}: another result than of an undisturbed run");
            assert!(self.places(name)[0].starts_with("done/"), "{name} is in {:?}", self.places(name));
        }
        assert_eq!(out.len(), dropped.len(), "more results than files");
        self.assert_nothing_partial();
        let work: Vec<_> = self.files(".suture/work").into_keys().collect();
        assert!(work.is_empty(), "left over: {work:?}");
    }

    /// Reports are whole, and no temporary file is seen.
    pub(crate) fn assert_nothing_partial(&self) {
        for part in AREAS.iter().chain(&["out"]) {
            for (path, bytes) in self.files(part) {
                let name = path.rsplit('/').next().unwrap_or_default();
                assert!(!name.starts_with('.'), "left over: {part}/{path}");
                if name.ends_with(".json") {
                    assert!(serde_json::from_slice::<Value>(&bytes).is_ok(), "{part}/{path} is not whole");
                }
            }
        }
    }

    /// No process of this scenario is left.
    pub(crate) fn assert_no_process(&self) {
        self.wait("the last process to end", 5, || processes_of(&self.binary).is_empty());
    }
}

/// The daemon of a stage, watched over as a service manager does: it is started again when it ends with 75.
pub(crate) struct Daemon<'a> {
    pub child: Child,
    stage: &'a Stage,
    pub restarts: u32,
}

impl Daemon<'_> {
    pub(crate) fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Starts it again if it has ended; fails when it ended in a way that no service manager takes for "try again".
    pub(crate) fn tend(&mut self) {
        if let Some(status) = self.child.try_wait().expect("a child can be asked") {
            assert_eq!(status.code(), Some(75), "{status}\n{}", self.stage.log());
            let log = self.stage.log();
            assert!(log.lines().any(|line| line.starts_with("suture: ")), "it ended without a line:\n{log}");
            self.restarts += 1;
            std::thread::sleep(Duration::from_secs(1));
            self.child = self.stage.watch(&[]).spawn().expect("the daemon can be started");
        }
    }

    /// How it ended, if it does so within that many seconds.
    pub(crate) fn ended_within(&mut self, seconds: u64) -> Option<ExitStatus> {
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(seconds) {
            if let Some(status) = self.child.try_wait().expect("a child can be asked") {
                return Some(status);
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        None
    }

    pub(crate) fn signal(&self, signal: i32) {
        send(self.pid(), signal);
    }

    /// Stops it in an orderly way.
    pub(crate) fn stop(&mut self) {
        self.signal(libc::SIGTERM);
        let status = self.ended_within(20);
        assert_eq!(status.and_then(|status| status.code()), Some(0), "{status:?}\n{}", self.stage.log());
        self.stage.assert_no_process();
    }

    /// Kills it and all its workers at the same instant, as a power cut does: no one learns of the other's end.
    pub(crate) fn cut(&mut self) {
        let all = processes_of(&self.stage.binary);
        for signal in [libc::SIGSTOP, libc::SIGKILL] {
            all.iter().for_each(|pid| send(*pid, signal));
        }
        self.child.wait().expect("a child can be waited for");
        self.stage.assert_no_process();
    }
}

impl Drop for Daemon<'_> {
    fn drop(&mut self) {
        for pid in processes_of(&self.stage.binary) {
            send(pid, libc::SIGKILL);
        }
        // It has ended already, or does so now.
        let _ = self.child.wait();
    }
}

/// What an undisturbed `suture repair` makes of a mesh.
pub(crate) fn result_of(bytes: &[u8]) -> Vec<u8> {
    static KNOWN: Mutex<BTreeMap<Vec<u8>, Vec<u8>>> = Mutex::new(BTreeMap::new());
    let mut known = KNOWN.lock().expect("no test panicked");
    known
        .entry(bytes.into())
        .or_insert_with(|| {
            let place = suture_tests::Place::new();
            place.put("a.stl", bytes);
            place.repair("a.stl", "b.stl", &[]).expect(0);
            place.read("b.stl")
        })
        .clone()
}

pub(crate) fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

/// `a/part~2.stl` → `a/part.stl`.
fn unversioned(path: &str) -> String {
    match path.rsplit_once('~') {
        Some((stem, rest)) if rest.starts_with(|c: char| c.is_ascii_digit()) => {
            stem.to_owned() + rest.trim_start_matches(|c: char| c.is_ascii_digit())
        }
        _ => path.to_owned(),
    }
}

fn collect(root: &Path, dir: &Path, files: &mut BTreeMap<String, Vec<u8>>) {
    for entry in std::fs::read_dir(dir).into_iter().flatten().flatten() {
        let path = entry.path();
        // Not followed, if it is a link; a file may go between two looks.
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => collect(root, &path, files),
            Ok(kind) if kind.is_file() => {
                let name = path.strip_prefix(root).unwrap_or(&path).to_string_lossy().into_owned();
                if let Ok(bytes) = std::fs::read(&path) {
                    files.insert(name, bytes);
                }
            }
            _ => {}
        }
    }
}
