//! The programs that are compared: Suture as this very workspace builds it, and pymeshlab in an environment of its own.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::Error;

/// What runs over an input, in the order in which they take their turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Side {
    /// `suture repair`.
    Suture,
    /// `pipelines/plain.py`.
    Plain,
    /// `pipelines/competent.py`.
    Competent,
    /// `suture inspect`: topology alone, no output.
    Inspect,
    /// `cp`.
    Copy,
    /// `cp`, and the copy synced.
    CopySynced,
}

impl Side {
    /// Its column's heading.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Suture => "suture",
            Self::Plain => "plain",
            Self::Competent => "competent",
            Self::Inspect => "inspect",
            Self::Copy => "cp",
            Self::CopySynced => "cp, synced",
        }
    }

    /// It repairs: its output is judged.
    pub(crate) fn repairs(self) -> bool {
        matches!(self, Self::Suture | Self::Plain | Self::Competent)
    }

    pub(super) fn needs_pymeshlab(self) -> bool {
        matches!(self, Self::Plain | Self::Competent)
    }

    pub(super) fn needs_suture(self) -> bool {
        matches!(self, Self::Suture | Self::Inspect)
    }

    /// Its output is on the disk before its time ends.
    pub(super) fn synced(self) -> bool {
        self != Self::Copy
    }
}

impl std::str::FromStr for Side {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let sides = [Self::Suture, Self::Plain, Self::Competent];
        sides.into_iter().find(|side| side.name() == name).ok_or_else(|| "the sides are suture, plain, competent".into())
    }
}

/// Where the programs are.
pub(super) struct Programs {
    suture: Option<PathBuf>,
    python: Option<PathBuf>,
}

impl Programs {
    /// Builds and installs what `sides` need. `suture` stands in for the built binary.
    pub(super) fn prepare(sides: &[Side], suture: Option<PathBuf>) -> Result<Self, Error> {
        let wanted = |need: fn(Side) -> bool| sides.iter().any(|&side| need(side));
        let suture = match suture {
            _ if !wanted(Side::needs_suture) => None,
            Some(path) => Some(path),
            None => Some(build_suture()?),
        };
        let python = wanted(Side::needs_pymeshlab).then(install_pymeshlab).transpose()?;
        Ok(Self { suture, python })
    }

    /// The command of `side` over `input`.
    pub(super) fn command(&self, side: Side, input: &Path, output: &Path) -> Command {
        let mut command = Command::new(match side {
            Side::Suture | Side::Inspect => self.suture.as_deref().unwrap_or(Path::new("suture")),
            Side::Plain | Side::Competent => self.python.as_deref().unwrap_or(Path::new("python3")),
            Side::Copy | Side::CopySynced => Path::new("cp"),
        });
        match side {
            Side::Suture => command.arg("repair").arg(input).arg("-o").arg(output),
            Side::Inspect => command.arg("inspect").arg(input),
            Side::Plain => command.arg(home().join("pipelines/plain.py")).args([input, output]),
            Side::Competent => command.arg(home().join("pipelines/competent.py")).args([input, output]),
            Side::Copy | Side::CopySynced => command.args([input, output]),
        };
        command
    }

    /// `name version` of every rival.
    pub(super) fn versions(&self) -> Vec<String> {
        let mut versions = Vec::new();
        if let Some(python) = &self.python {
            versions.extend(said(Command::new(python).arg("--version")));
            let script = "import importlib.metadata as m; print('pymeshlab', m.version('pymeshlab'))";
            versions.extend(said(Command::new(python).args(["-c", script])));
        }
        versions
    }
}

/// What a command prints, if it succeeds.
pub(super) fn said(command: &mut Command) -> Option<String> {
    let output = command.output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8_lossy(&output.stdout).trim().into())
}

/// The folder of this crate.
pub(super) fn home() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Builds the release binary now, so that no older one is measured, and takes its place from cargo's own word.
fn build_suture() -> Result<PathBuf, Error> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.args(["build", "--release", "--package", "suture", "--message-format", "json-render-diagnostics"]);
    let output = command
        .current_dir(home())
        .stderr(std::process::Stdio::inherit())
        .output()
        .map_err(Error::io("starting cargo to build suture"))?;
    let messages = String::from_utf8_lossy(&output.stdout);
    let built = messages.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok()).find_map(|message| {
        let is_suture = message["target"]["name"] == "suture" && message["target"]["kind"][0] == "bin";
        message["executable"].as_str().filter(|_| is_suture).map(PathBuf::from)
    });
    built.filter(|_| output.status.success()).ok_or(Error::Build)
}

/// Makes `.venv` with the pinned pymeshlab, unless it is there.
fn install_pymeshlab() -> Result<PathBuf, Error> {
    let folder = home().join(".venv");
    let python = folder.join("bin/python");
    let requirements = home().join("pipelines/requirements.txt");
    let text = std::fs::read_to_string(&requirements).map_err(Error::io("reading pipelines/requirements.txt"))?;
    let pinned = text.lines().find_map(|line| line.strip_prefix("pymeshlab==")).unwrap_or_default().trim();
    let script = "import importlib.metadata as m, pymeshlab; print(m.version('pymeshlab'))";
    let installed = || said(Command::new(&python).args(["-c", script])).is_some_and(|version| version == pinned);
    if installed() {
        return Ok(python);
    }
    eprintln!("installing pymeshlab {pinned} into {}", folder.display());
    let made = Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder).status();
    if !made.is_ok_and(|status| status.success()) {
        return Err(Error::NoPython);
    }
    let pip = Command::new(&python).args(["-m", "pip", "install", "--quiet", "--requirement"]).arg(&requirements).status();
    if !pip.is_ok_and(|status| status.success()) || !installed() {
        return Err(Error::NoPymeshlab { version: pinned.into() });
    }
    Ok(python)
}
