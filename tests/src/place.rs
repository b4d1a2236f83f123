//! A temporary folder of one test, and commands run in it.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use suture_bench::generate::{Case, Truth, write_file};

use crate::binary::suture;

/// A temporary folder, removed when it is dropped.
pub struct Place(tempfile::TempDir);

impl Place {
    /// A new, empty one.
    ///
    /// # Panics
    /// When it cannot be made.
    #[expect(clippy::new_without_default, reason = "making a folder is not a default value")]
    pub fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    /// The path of a name in it.
    pub fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file, with the folders it lies in.
    ///
    /// # Panics
    /// When it cannot be written.
    pub fn put(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.at(name);
        std::fs::create_dir_all(path.parent().expect("a file lies in a folder")).expect("the folder can be made");
        std::fs::write(&path, bytes).expect("the file can be written");
        path
    }

    /// Generates a mesh as `CASE.stl`.
    ///
    /// # Panics
    /// When it cannot be written.
    pub fn generate(&self, case: Case, triangles: u64, seed: u64) -> (PathBuf, Truth) {
        let path = self.at(&format!("{case}.stl"));
        let truth = write_file(case, triangles, seed, &path).expect("a mesh is generated");
        (path, truth)
    }

    /// The content of a file.
    ///
    /// # Panics
    /// When it cannot be read.
    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.at(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Names of all files below a folder of it, `.suture/` left out, sorted; relative to that folder.
    pub fn names(&self, folder: &str) -> Vec<String> {
        let root = self.at(folder);
        let mut names = Vec::new();
        collect(&root, &root, &mut names);
        names.sort();
        names
    }

    /// Runs `suture` with these arguments in the folder.
    ///
    /// # Panics
    /// When it cannot be started.
    pub fn suture<A: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = A>) -> Ran {
        let mut command = self.command();
        command.args(arguments);
        Ran(command.output().expect("the binary can be started"))
    }

    /// `suture`, about to run in the folder, its output captured.
    pub fn command(&self) -> Command {
        self.command_of(suture())
    }

    /// The same for another build of it.
    pub fn command_of(&self, binary: &Path) -> Command {
        let mut command = Command::new(binary);
        command.current_dir(self.0.path()).env_remove("SUTURE_LOG").env_remove("RUST_LOG");
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// `suture repair INPUT -o OUTPUT --json` with more options.
    ///
    /// # Panics
    /// When it cannot be started.
    pub fn repair(&self, input: &str, output: &str, options: &[&str]) -> Ran {
        self.suture(["repair", input, "-o", output, "--json"].iter().chain(options))
    }

    /// `suture inspect INPUT --json` with more options.
    ///
    /// # Panics
    /// When it cannot be started.
    pub fn inspect(&self, input: &str, options: &[&str]) -> Ran {
        self.suture(["inspect", input, "--json"].iter().chain(options))
    }
}

fn collect(root: &Path, folder: &Path, names: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            if entry.file_name() != ".suture" {
                collect(root, &path, names);
            }
        } else {
            names.push(path.strip_prefix(root).unwrap_or(&path).to_string_lossy().into_owned());
        }
    }
}

/// A command that has ended.
pub struct Ran(Output);

impl Ran {
    /// Its exit code.
    ///
    /// # Panics
    /// When a signal ended it.
    pub fn code(&self) -> i32 {
        self.0.status.code().unwrap_or_else(|| panic!("{}: {}", self.0.status, self.stderr()))
    }

    /// Fails unless it ended with this code; returns itself.
    ///
    /// # Panics
    /// When it did not.
    pub fn expect(self, code: i32) -> Self {
        assert_eq!(self.code(), code, "stdout: {}\nstderr: {}", self.stdout(), self.stderr());
        self
    }

    /// What it printed.
    pub fn stdout(&self) -> String {
        String::from_utf8_lossy(&self.0.stdout).into_owned()
    }

    /// What it complained about.
    pub fn stderr(&self) -> String {
        String::from_utf8_lossy(&self.0.stderr).into_owned()
    }

    /// The one JSON object it printed.
    ///
    /// # Panics
    /// When it printed something else.
    pub fn report(&self) -> Value {
        let text = self.stdout();
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}\nstderr: {}", self.stderr()))
    }
}
