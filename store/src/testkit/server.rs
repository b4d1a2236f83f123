//! A database server of the tests' own, on a socket in a temporary folder, which ends with the test program however that ends.

use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

/// A server, running or not.
pub struct Server {
    dir: tempfile::TempDir,
    bin: PathBuf,
    /// Reads the pipe whose other end this program has; when it is closed, the server is stopped and the folder goes.
    _cleaner: Child,
    /// Of its command line.
    options: Mutex<String>,
    numbers: AtomicU32,
}

/// The server of all tests of a program; `None` where there is none to be had: such tests pass over, but not in CI.
///
/// # Panics
/// As [`Server::start`].
pub fn server() -> Option<&'static Server> {
    static SERVER: OnceLock<Option<Server>> = OnceLock::new();
    SERVER.get_or_init(Server::start).as_ref()
}

/// Where the programs of the server are.
fn programs() -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let packaged = std::fs::read_dir("/usr/lib/postgresql").into_iter().flatten().flatten();
    folders.extend(packaged.map(|version| version.path().join("bin")));
    folders.into_iter().find(|folder| ["initdb", "pg_ctl"].iter().all(|name| folder.join(name).metadata().is_ok()))
}

/// The server refuses to run as root: then it runs as a user of its own.
fn user() -> Option<&'static str> {
    let number = |arguments: &[&str]| {
        let output = Command::new("id").args(arguments).output().ok()?;
        String::from_utf8(output.stdout).ok()?.trim().parse::<u32>().ok()
    };
    let is_root = number(&["-u"]) == Some(0);
    is_root.then(|| ["postgres", "nobody"].into_iter().find(|user| number(&["-u", user]).is_some())).flatten()
}

impl Server {
    /// A server of one's own; `None` where there is none to be had, which is said.
    ///
    /// # Panics
    /// When it does not start, and where there is none in CI.
    pub fn start() -> Option<Self> {
        Self::start_in(&std::env::temp_dir(), &[])
    }

    /// The same, its files in a folder of this one; `init` are more options for `initdb`.
    ///
    /// # Panics
    /// As [`Server::start`].
    pub fn start_in(folder: &Path, init: &[&str]) -> Option<Self> {
        let Some(bin) = programs() else {
            assert!(std::env::var_os("CI").is_none(), "CI has no PostgreSQL");
            eprintln!("skipped: there is no PostgreSQL on this machine");
            return None;
        };
        let dir = tempfile::Builder::new().prefix("suture-pg").tempdir_in(folder).expect("a temporary folder");
        own(dir.path());
        let data = dir.path().join("data");
        let mut make = as_user(&bin.join("initdb"), dir.path());
        make.arg("-D")
            .arg(&data)
            .args(["--auth=trust", "--username=owner", "--no-sync", "--encoding=UTF8", "--locale=C"])
            .args(init);
        assert!(make.stdout(Stdio::null()).status().expect("it can be started").success(), "initdb");
        let script = "read -r _; \"$1\" -D \"$2\" -m immediate stop; rm -rf \"$3\"";
        let mut cleaner = as_user(Path::new("sh"), dir.path());
        cleaner.args(["-c", script, "sh"]).arg(bin.join("pg_ctl")).arg(&data).arg(dir.path());
        // A signal to the test program's group, as from a terminal, is not for it.
        let cleaner = cleaner
            .process_group(0)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("a shell starts");
        let server = Self { dir, bin, _cleaner: cleaner, options: Mutex::default(), numbers: AtomicU32::new(0) };
        server.run();
        Some(server)
    }

    fn control(&self) -> Command {
        let mut control = as_user(&self.bin.join("pg_ctl"), self.dir.path());
        control.arg("-D").arg(self.dir.path().join("data")).stdout(Stdio::null()).stderr(Stdio::null());
        control
    }

    /// Starts it anew with more on its command line, as `-c listen_addresses=127.0.0.1`.
    ///
    /// # Panics
    /// When it does not start.
    pub fn run_with(&self, options: &str) {
        self.kill();
        options.clone_into(&mut self.options.lock().unwrap_or_else(PoisonError::into_inner));
        self.run();
    }

    /// Starts it, and waits until it answers.
    ///
    /// # Panics
    /// When it does not start.
    pub fn run(&self) {
        let more = self.options.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let options = format!(
            "-k {} -c listen_addresses='' -c shared_buffers=16MB -c max_connections=100 -c wal_level=minimal -c max_wal_senders=0 {more}",
            self.dir.path().display()
        );
        let log = self.dir.path().join("log");
        let started =
            self.control().arg("-w").arg("-l").arg(&log).arg("-o").arg(options).arg("start").status().expect("it can be started");
        assert!(started.success(), "{}", std::fs::read_to_string(log).unwrap_or_default());
    }

    /// Ends it as a power cut would: nothing is written any more.
    ///
    /// # Panics
    /// When it does not end.
    pub fn kill(&self) {
        assert!(self.control().args(["-m", "immediate", "stop"]).status().expect("it can be started").success());
    }

    /// Starts it anew, whether it runs or has failed.
    ///
    /// # Panics
    /// When it does not start.
    pub fn run_anew(&self) {
        // There may be none to stop.
        _ = self.control().args(["-m", "immediate", "stop"]).status();
        self.run();
    }

    /// Where its socket is.
    pub fn folder(&self) -> &Path {
        self.dir.path()
    }

    /// Where `psql` and the like are.
    pub fn programs(&self) -> &Path {
        &self.bin
    }

    /// Its address by the socket, for its owner.
    pub fn url(&self) -> String {
        format!("postgres://owner@localhost/postgres?host={}", self.dir.path().display())
    }

    /// A number that no one else was given.
    pub fn number(&self) -> u32 {
        self.numbers.fetch_add(1, Ordering::Relaxed)
    }

    /// Has its user own a file, and no one else read it: keys are refused else.
    ///
    /// # Panics
    /// When it cannot be done.
    pub fn give(&self, file: &Path) {
        own(file);
        let only_own = std::os::unix::fs::PermissionsExt::from_mode(0o600);
        std::fs::set_permissions(file, only_own).expect("the mode can be set");
    }
}

/// Has the user of the server own it.
fn own(path: &Path) {
    if let Some(user) = user() {
        let status = Command::new("chown").arg(format!("{user}:")).arg(path).status();
        assert!(status.expect("chown starts").success(), "{} cannot be given to {user}", path.display());
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        _ = self.control().args(["-m", "immediate", "stop"]).status();
    }
}

fn as_user(program: &Path, dir: &Path) -> Command {
    let mut command = match user() {
        Some(user) => {
            let mut command = Command::new("setpriv");
            command.args(["--reuid", user, "--regid", user, "--clear-groups"]).arg(program);
            command
        }
        None => Command::new(program),
    };
    command.current_dir(dir);
    command
}
