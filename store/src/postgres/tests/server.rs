//! A database server of the tests' own, on a socket in a temporary folder, which ends with the test program however that ends.

use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use super::super::Shared;

/// A server, running or not.
pub(super) struct Server {
    dir: tempfile::TempDir,
    bin: PathBuf,
    /// Reads the pipe whose other end this program has; when it is closed, the server is stopped and the folder goes.
    _cleaner: Child,
    schemas: AtomicU32,
}

/// The server of all tests; `None` where there is none to be had: such tests pass over, but not in CI.
pub(super) fn server() -> Option<&'static Server> {
    static SERVER: OnceLock<Option<Server>> = OnceLock::new();
    SERVER.get_or_init(Server::start).as_ref()
}

/// Where the programs of the server are.
fn programs() -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let packaged = std::fs::read_dir("/usr/lib/postgresql").into_iter().flatten().flatten();
    folders.extend(packaged.map(|version| version.path().join("bin")));
    folders.into_iter().find(|folder| folder.join("initdb").exists() && folder.join("pg_ctl").exists())
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
    /// A server of one's own; `None` where there is none to be had.
    pub(super) fn start() -> Option<Self> {
        let Some(bin) = programs() else {
            assert!(std::env::var_os("CI").is_none(), "CI has no PostgreSQL");
            eprintln!("skipped: there is no PostgreSQL on this machine");
            return None;
        };
        let dir = tempfile::Builder::new().prefix("suture-pg").tempdir().unwrap();
        if let Some(user) = user() {
            let owner = format!("{user}:");
            assert!(Command::new("chown").arg(owner).arg(dir.path()).status().unwrap().success());
        }
        let data = dir.path().join("data");
        let mut init = as_user(&bin.join("initdb"), dir.path());
        init.arg("-D").arg(&data).args(["--auth=trust", "--username=owner", "--no-sync", "--encoding=UTF8", "--locale=C"]);
        assert!(init.stdout(Stdio::null()).status().unwrap().success(), "initdb");
        let script = "read -r _; \"$1\" -D \"$2\" -m immediate stop; rm -rf \"$3\"";
        let mut cleaner = as_user(Path::new("sh"), dir.path());
        cleaner.args(["-c", script, "sh"]).arg(bin.join("pg_ctl")).arg(&data).arg(dir.path());
        // A signal to the test program's group, as from a terminal, is not for it.
        let cleaner = cleaner.process_group(0).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let server = Self { dir, bin, _cleaner: cleaner, schemas: AtomicU32::new(0) };
        server.run();
        Some(server)
    }

    fn control(&self) -> Command {
        let mut control = as_user(&self.bin.join("pg_ctl"), self.dir.path());
        control.arg("-D").arg(self.dir.path().join("data")).stdout(Stdio::null()).stderr(Stdio::null());
        control
    }

    /// Starts it, and waits until it answers.
    pub(super) fn run(&self) {
        let options = format!(
            "-k {} -c listen_addresses='' -c shared_buffers=16MB -c max_connections=100 -c wal_level=minimal -c max_wal_senders=0",
            self.dir.path().display()
        );
        let log = self.dir.path().join("log");
        let started = self.control().arg("-w").arg("-l").arg(&log).arg("-o").arg(options).arg("start").status().unwrap();
        assert!(started.success(), "{}", std::fs::read_to_string(log).unwrap_or_default());
    }

    /// Ends it as a power cut would: nothing is written any more.
    pub(super) fn kill(&self) {
        assert!(self.control().args(["-m", "immediate", "stop"]).status().unwrap().success());
    }

    /// Where its socket is.
    pub(super) fn folder(&self) -> &Path {
        self.dir.path()
    }

    /// A store of its own, for a daemon of that name.
    pub(super) fn schema(&self, daemon: &str) -> Shared {
        let number = self.schemas.fetch_add(1, Ordering::Relaxed);
        let url = format!("postgres://owner@localhost/postgres?host={}", self.dir.path().display());
        let patience = Duration::from_secs(30);
        Shared { schema: format!("store_{number}"), patience, ..Shared::new(&url, daemon) }
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
