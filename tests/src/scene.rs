//! A hot folder with six small files of every fate, for tests that make the daemon's life hard, and how to bring it to rest again.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::stl::{cuboid, mesh};

/// Runs without a fault until everything is finished.
const ROUNDS: u32 = 8;
/// A run without a fault takes a fraction of a second.
const ROUND: Duration = Duration::from_secs(60);

/// Files by their path below some folder.
pub type Files = BTreeMap<PathBuf, Vec<u8>>;

/// The hot folder.
pub struct Scene {
    dir: tempfile::TempDir,
    root: PathBuf,
    binary: PathBuf,
}

/// A closed box with its last triangle missing.
fn open_box(size: f32) -> Vec<u8> {
    mesh(&cuboid([0.0; 3], [size; 3])[..11])
}

/// One file of every fate: clean, repaired, of another profile, without a picture of a mesh, not good, of an odd name.
pub fn six() -> Files {
    let path = |name: &[u8]| PathBuf::from(OsStr::from_bytes(name));
    Files::from([
        (path(b"clean.stl"), mesh(&cuboid([0.0; 3], [10.0; 3]))),
        (path(b"holes.stl"), open_box(12.0)),
        (path(b"scan/part.stl"), open_box(14.0)),
        (path(b"picture.stl"), b"\x89PNG\r\n\x1a\nendsolid".to_vec()),
        (path(b"cautious/sheet.stl"), mesh(&cuboid([0.0; 3], [16.0; 3])[..2])),
        (path(b"odd\xFF \x1Bname\n.stl"), open_box(18.0)),
    ])
}

/// These, and the content of the clean one once more, under a name that comes later: its result is a copy.
pub fn with_a_double(mut files: Files) -> Files {
    let clean = files.get(Path::new("clean.stl")).cloned().unwrap_or_default();
    files.insert("double.stl".into(), clean);
    files
}

impl Scene {
    /// With these files dropped.
    ///
    /// # Panics
    /// When it cannot be made.
    pub fn new(binary: &Path, dropped: &Files) -> Self {
        let scene = Self::empty(binary);
        scene.drop_all(dropped);
        scene
    }

    /// Drops these files.
    ///
    /// # Panics
    /// When they cannot be written.
    pub fn drop_all(&self, files: &Files) {
        for (name, bytes) in files {
            let path = self.path().join("in").join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("the sub-folder can be made");
            std::fs::write(path, bytes).expect("the file can be written");
        }
    }

    /// An empty folder, always of the same name, as jobs remember it.
    ///
    /// # Panics
    /// When it cannot be made.
    pub fn empty(binary: &Path) -> Self {
        let dir = quick_folder();
        let root = dir.path().join("hot");
        std::fs::create_dir(&root).expect("the folder can be made");
        Self { dir, root, binary: binary.into() }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.root
    }

    /// A path beside it, on the same file system.
    pub fn beside(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// The daemon over it, working once through what is there; not yet started.
    pub fn once(&self) -> Command {
        let mut command = Command::new(&self.binary);
        command.arg("watch").arg(self.path()).args(["--once", "--settle", "30ms", "--workers", "1", "--threads", "1"]);
        // A log helps where one fault is looked at; in a sweep it is off.
        let log = std::env::var_os("SUTURE_LOG").unwrap_or_else(|| "off".into());
        command.env("SUTURE_LOG", log).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    }

    /// `suture jobs` with these words, not yet started.
    pub fn jobs_command(&self, words: &[&str]) -> Command {
        let mut command = Command::new(&self.binary);
        command.args(["jobs", "--json", "--dir"]).arg(self.path()).args(words).stdin(Stdio::null());
        command
    }

    fn ask(&self, words: &[&str]) -> Result<String, String> {
        let output = self.jobs_command(words).output().map_err(|e| format!("the binary cannot be started: {e}"))?;
        if !output.status.success() {
            return Err(format!("jobs {words:?}: {}: {}", output.status, String::from_utf8_lossy(&output.stderr).trim()));
        }
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    }

    /// What `suture jobs list --json` says.
    ///
    /// # Errors
    /// A line when it fails.
    pub fn jobs(&self) -> Result<Vec<Value>, String> {
        let text = self.ask(&["list"])?;
        text.lines().map(|line| serde_json::from_str(line).map_err(|e| format!("jobs list: {e}: {line}"))).collect()
    }

    /// Works without a fault until every job has ended; those that wait after an error are retried at once, as an operator would.
    ///
    /// # Errors
    /// A line when a run fails, or jobs never end.
    pub fn come_to_rest(&self) -> Result<(), String> {
        let mut live = Vec::new();
        for _ in 0..ROUNDS {
            self.run_once()?;
            let jobs = self.jobs()?;
            live = jobs.into_iter().filter(|job| !has_ended(job)).collect();
            if live.is_empty() {
                return Ok(());
            }
            for job in live.iter().filter(|job| job["kind"] == "waiting") {
                // It may have become ready meanwhile.
                let _ = self.ask(&["retry", &job["id"].to_string()]);
            }
        }
        Err(format!("stuck: jobs never end: {}", live.iter().map(Value::to_string).collect::<Vec<_>>().join(", ")))
    }

    /// Retries these jobs, and comes to rest again.
    ///
    /// # Errors
    /// As [`Scene::come_to_rest`].
    pub fn retry(&self, jobs: &[u64]) -> Result<(), String> {
        for job in jobs {
            self.ask(&["retry", &job.to_string()])?;
        }
        self.come_to_rest()
    }

    fn run_once(&self) -> Result<(), String> {
        let errors = std::fs::File::create(self.errors()).map_err(|e| e.to_string())?;
        let mut child = self.once().stderr(errors).spawn().map_err(|e| e.to_string())?;
        let deadline = Instant::now() + ROUND;
        loop {
            match child.try_wait().map_err(|e| e.to_string())? {
                Some(status) if status.code().is_some_and(|code| code < 2) => return Ok(()),
                Some(status) => {
                    let said = std::fs::read(self.errors()).unwrap_or_default();
                    return Err(format!("recovery: {status}: {}", String::from_utf8_lossy(&said).trim()));
                }
                None if Instant::now() > deadline => {
                    // It may end at this very moment.
                    let _ = child.kill();
                    let _ = child.wait();
                    return Err("recovery: stuck".into());
                }
                None => std::thread::sleep(Duration::from_millis(3)),
            }
        }
    }

    /// Where the standard error of a run goes.
    pub fn errors(&self) -> PathBuf {
        self.beside("stderr")
    }

    /// Every file below a part of the folder, whatever its name.
    pub fn files(&self, part: &str) -> Files {
        let mut files = Files::new();
        let root = self.path().join(part);
        collect(&root, &root, &mut files);
        files
    }
}

/// Has a job, as listed, come to its end?
pub fn has_ended(job: &Value) -> bool {
    matches!(job["kind"].as_str(), Some("done" | "carried" | "failed" | "needs_review" | "quarantined" | "cancelled" | "noticed"))
}

/// In memory where there is a place for that: syncing is what a run waits for.
fn quick_folder() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    tempfile::tempdir_in(memory).or_else(|_| tempfile::tempdir()).expect("a temporary folder")
}

fn collect(root: &Path, dir: &Path, files: &mut Files) {
    for entry in std::fs::read_dir(dir).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(root, &path, files);
        } else {
            let name = path.strip_prefix(root).unwrap_or(&path).to_owned();
            files.insert(name, std::fs::read(&path).unwrap_or_default());
        }
    }
}
