//! A hot folder of one test, and what is in it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};

use suture_bench::generate::{Case, write};

/// A hot folder in a temporary place.
pub struct Hot {
    dir: tempfile::TempDir,
    binary: PathBuf,
    /// The address of a shared store that holds its jobs.
    store: Option<String>,
}

/// All files below a folder: relative name to content.
pub type Tree = BTreeMap<String, Vec<u8>>;

impl Hot {
    /// An empty one, to be served by `binary`.
    ///
    /// # Panics
    /// When no temporary folder can be made.
    pub fn new(binary: &Path) -> Self {
        let dir = tempfile::tempdir().expect("a temporary folder");
        std::fs::create_dir(dir.path().join("in")).expect("a folder for drops");
        Self { dir, binary: binary.into(), store: None }
    }

    /// The same, its jobs in a shared store.
    ///
    /// # Panics
    /// As [`Hot::new`].
    pub fn sharing(binary: &Path, store: &str) -> Self {
        Self { store: Some(store.into()), ..Self::new(binary) }
    }

    /// Says where the jobs are.
    fn of_store(&self) -> impl Iterator<Item = &str> {
        self.store.iter().flat_map(|store| ["--store", store])
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.dir.path()
    }

    /// Drops a file (`name` may have sub-folders).
    ///
    /// # Panics
    /// When it cannot be written.
    pub fn put(&self, name: &str, bytes: &[u8]) {
        let path = self.path().join("in").join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("the sub-folder can be made");
        std::fs::write(path, bytes).expect("the file can be written");
    }

    /// The daemon over it, not yet started. It takes files after a short rest, and says nothing.
    pub fn watch(&self, options: &[&str]) -> Command {
        let mut command = Command::new(&self.binary);
        command.arg("watch").arg(self.path()).args(["--settle", "30ms"]).args(self.of_store()).args(options);
        command.env("SUTURE_LOG", "off").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command
    }

    /// The daemon over it by a configuration with these lines, working once through what is there; not yet started.
    ///
    /// # Panics
    /// When the configuration cannot be written.
    pub fn configured(&self, lines: &str) -> Command {
        self.configured_folder(lines, "")
    }

    /// As [`Self::configured`], with these lines about the folder.
    ///
    /// # Panics
    /// When the configuration cannot be written.
    pub fn configured_folder(&self, lines: &str, of_folder: &str) -> Command {
        let file = self.path().join("suture.toml");
        let text = format!("{lines}\n[[folders]]\npath = {:?}\n{of_folder}\n", self.path());
        std::fs::write(&file, text).expect("the configuration can be written");
        let mut command = Command::new(&self.binary);
        command.args(["watch", "--once", "--config"]).arg(file);
        command.env("SUTURE_LOG", "off").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command
    }

    /// Runs the daemon until everything is done, or it is killed at the `pass`-th crash point if one is given.
    ///
    /// # Panics
    /// When it cannot be started.
    pub fn once(&self, pass: Option<u64>) -> ExitStatus {
        let mut command = self.watch(&["--once"]);
        if let Some(pass) = pass {
            command.env("SUTURE_CRASH_AT", format!("*:{pass}"));
        }
        command.status().expect("the daemon can be started")
    }

    /// Starts the daemon.
    ///
    /// # Panics
    /// When it cannot be started.
    pub fn start(&self) -> Child {
        self.watch(&[]).spawn().expect("the daemon can be started")
    }

    /// What `suture jobs list --json` says.
    ///
    /// # Panics
    /// When it fails.
    pub fn jobs(&self) -> Vec<serde_json::Value> {
        let output = Command::new(&self.binary)
            .args(["jobs", "list", "--json", "--dir"])
            .arg(self.path())
            .args(self.of_store())
            .output()
            .expect("the binary can be started");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let jobs = text.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).expect("a line of JSON"));
        // A shared store tells of all folders.
        let name = self.path().file_name().and_then(|name| name.to_str());
        jobs.filter(|job| self.store.is_none() || job["source"]["folder"].as_str() == name).collect()
    }

    /// `suture jobs` with these words; whether it was done.
    ///
    /// # Panics
    /// When it cannot be started.
    pub fn ask(&self, words: &[&str]) -> bool {
        let mut command = Command::new(&self.binary);
        command.arg("jobs").args(words).arg("--dir").arg(self.path()).stdout(Stdio::null()).stderr(Stdio::null());
        command.status().expect("the binary can be started").success()
    }

    /// Every file of a part of the folder (`out`, `done`, …).
    pub fn tree(&self, part: &str) -> Tree {
        let mut tree = Tree::new();
        let root = self.path().join(part);
        collect(&root, &root, &mut tree);
        tree
    }
}

fn collect(root: &Path, dir: &Path, tree: &mut Tree) {
    for entry in std::fs::read_dir(dir).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(root, &path, tree);
        } else {
            let name = path.strip_prefix(root).unwrap_or(&path).to_string_lossy().into_owned();
            tree.insert(name, std::fs::read(&path).unwrap_or_default());
        }
    }
}

/// A small generated mesh.
///
/// # Panics
/// When the generator fails.
pub fn mesh(case: Case, seed: u64) -> Vec<u8> {
    made(case, 512, seed)
}

/// A generated mesh of about 600 triangles with holes. Those of seeds 1 and 2 are closed without a question.
///
/// # Panics
/// When the generator fails.
pub fn holes(seed: u64) -> Vec<u8> {
    made(Case::Holes, 600, seed)
}

/// A mesh that is repaired, but for a person to look at.
///
/// # Panics
/// When the generator fails.
pub fn doubtful() -> Vec<u8> {
    mesh(Case::Holes, 6)
}

fn made(case: Case, triangles: u64, seed: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(case, triangles, seed, &mut bytes).expect("a mesh is generated into memory");
    bytes
}
