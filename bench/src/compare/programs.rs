//! Where the programs are: Suture as this very workspace builds it, and the peers in an environment of their own.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::error::Error;
use super::folders::home;
use super::sides::{NO_SI, Program, SUTURE_PACKAGE, Side, TOBJ_VERSION};
use super::way::Way;

/// The programs that are there to be measured.
pub(super) struct Programs {
    suture: Option<PathBuf>,
    /// This suture knows how to leave the search for self-intersections out.
    may_leave_si_out: bool,
    python: Option<PathBuf>,
    /// Version by Python package.
    packages: BTreeMap<String, String>,
    admesh: Option<String>,
    /// With its version.
    tobj: Option<String>,
}

impl Programs {
    /// Builds and installs what `sides` need, as far as that can be had. `suture` stands in for the built binary.
    ///
    /// # Errors
    /// When suture is wanted and cannot be built.
    pub(super) fn prepare(sides: &[Side], suture: Option<PathBuf>) -> Result<Self, Error> {
        Self::prepare_with(sides, &[], suture)
    }

    /// The same, and `packages` of Python that no side names.
    ///
    /// # Errors
    /// As [`Self::prepare`].
    pub(super) fn prepare_with(sides: &[Side], packages: &[&str], suture: Option<PathBuf>) -> Result<Self, Error> {
        let suture = match suture {
            _ if !sides.iter().any(|side| side.is_suture()) => None,
            Some(path) => Some(path),
            None => Some(build_suture()?),
        };
        let help = suture.as_ref().and_then(|path| said(Command::new(path).args(["repair", "--help"])));
        let wanted: Vec<_> = sides.iter().filter_map(|side| package(*side)).chain(packages.iter().copied()).collect();
        let (python, packages) = if wanted.is_empty() { (None, BTreeMap::new()) } else { python_with(&wanted) };
        Ok(Self {
            may_leave_si_out: help.is_some_and(|help| help.contains(NO_SI)),
            suture,
            python,
            packages,
            admesh: said(Command::new("admesh").arg("--version")).filter(|_| sides.contains(&Side::Admesh)),
            tobj: sides.contains(&Side::Tobj).then(|| TOBJ_VERSION.into()),
        })
    }

    /// Why a package of Python cannot be called; `None` when it can.
    pub(super) fn lack_of(&self, package: &str) -> Option<String> {
        match &self.python {
            None => Some("python3 with its venv module is not there".into()),
            Some(_) if !self.packages.contains_key(package) => Some(format!("{package} could not be installed")),
            Some(_) => None,
        }
    }

    /// Why a side cannot run; `None` when it can.
    pub(super) fn lack(&self, side: Side) -> Option<String> {
        match side.facts().program {
            Program::Suture if side.facts().flag == Some(NO_SI) && !self.may_leave_si_out => {
                Some(format!("this suture has no {NO_SI}"))
            }
            Program::Python { package, .. } => self.lack_of(package),
            Program::Admesh if self.admesh.is_none() => Some("admesh is not installed".into()),
            Program::Admesh | Program::Suture | Program::Convert | Program::Itself { .. } | Program::Copy => None,
        }
    }

    /// The command of a way over an input, which is one file, or a folder of several.
    pub(super) fn command(&self, way: &Way, files: u64, input: &Path, output: &Path) -> Command {
        let facts = way.side.facts();
        let all = || std::fs::read_dir(input).into_iter().flatten().flatten().map(|entry| entry.path());
        let mut command;
        match facts.program {
            Program::Copy => {
                command = Command::new("cp");
                if files == 1 {
                    command.arg(input)
                } else {
                    command.arg("-r").arg(input)
                };
                command.arg(output);
            }
            Program::Suture => {
                command = self.suture();
                command.arg(if facts.writes { "repair" } else { "inspect" });
                if files == 1 {
                    command.arg(input)
                } else {
                    command.args(all())
                };
                if facts.writes {
                    command.arg("-o").arg(output);
                }
                command.arg("--json").args(facts.flag);
                bound(&mut command, way);
            }
            Program::Convert => {
                command = self.suture();
                command.arg("convert").args([input, output]);
                bound(&mut command, way);
            }
            Program::Itself { task } => {
                command = Command::new(itself());
                command.arg(task).arg(input);
            }
            Program::Python { script, .. } => {
                command = self.script(script);
                command.args([input, output]).args(facts.flag);
            }
            Program::Admesh => {
                command = Command::new("admesh");
                let mut target = std::ffi::OsString::from("--write-binary-stl=");
                target.push(output);
                command.args(["-e", "-n", "-u", "-f", "-d", "-v"]).arg(target).arg(input);
            }
        }
        command
    }

    /// What runs when `side` does: its version, and the hash of its binary or script, so that two that may differ have two names.
    ///
    /// # Errors
    /// When the binary or the script cannot be read.
    pub(super) fn identity(&self, side: Side) -> Result<String, Error> {
        match side.facts().program {
            Program::Python { script, package } => self.identity_of(Some((package, script))),
            Program::Suture | Program::Convert => self.identity_of(None),
            Program::Admesh => Ok(self.admesh.clone().unwrap_or_default()),
            Program::Itself { .. } => Ok(self.tobj.clone().unwrap_or_default()),
            Program::Copy => Ok("cp".into()),
        }
    }

    /// The same of a package of Python with its script, or of suture.
    ///
    /// # Errors
    /// When the binary or the script cannot be read.
    pub(super) fn identity_of(&self, peer: Option<(&str, &str)>) -> Result<String, Error> {
        let (name, path) = match peer {
            Some((package, script)) => {
                let version = self.packages.get(package).map_or("", String::as_str);
                (format!("{package} {version}"), home().join("pipelines").join(script))
            }
            None => ("suture".into(), self.suture.clone().unwrap_or_else(|| "suture".into())),
        };
        let bytes = std::fs::read(&path).map_err(Error::io(format!("reading {}", path.display())))?;
        Ok(format!("{name} {:.12}", blake3::hash(&bytes).to_hex()))
    }

    /// Suture, all its arguments still to be given.
    pub(super) fn suture(&self) -> Command {
        Command::new(self.suture.as_deref().unwrap_or(Path::new("suture")))
    }

    /// A script of `pipelines/`, its arguments still to be given.
    pub(super) fn script(&self, name: &str) -> Command {
        let mut command = Command::new(self.python.as_deref().unwrap_or(Path::new("python3")));
        command.arg(home().join("pipelines").join(name));
        command
    }

    /// `name version` of every peer that is there.
    pub(super) fn versions(&self) -> Vec<String> {
        let python = self.python.as_ref().and_then(|python| said(Command::new(python).arg("--version")));
        let packages = self.packages.iter().map(|(name, version)| format!("{name} {version}"));
        python.into_iter().chain(packages).chain(self.admesh.clone()).chain(self.tobj.clone()).collect()
    }
}

/// The Python package a side needs.
fn package(side: Side) -> Option<&'static str> {
    match side.facts().program {
        Program::Python { package, .. } => Some(package),
        Program::Copy | Program::Suture | Program::Convert | Program::Itself { .. } | Program::Admesh => None,
    }
}

/// This program.
fn itself() -> PathBuf {
    std::env::current_exe().unwrap_or_else(|_| "suture-bench".into())
}

/// Tells suture the threads and the memory of a way.
fn bound(command: &mut Command, way: &Way) {
    if let Some(threads) = way.threads {
        command.arg("--threads").arg(threads.to_string());
    }
    if let Some(memory) = &way.memory {
        command.arg("--memory").arg(memory);
    }
}

/// The text that a command prints, if it succeeds.
pub(super) fn said(command: &mut Command) -> Option<String> {
    let output = command.stderr(Stdio::null()).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8_lossy(&output.stdout).trim().into())
}

/// Builds the release binary now, so that no older one is measured, and takes its place from cargo's own word.
fn build_suture() -> Result<PathBuf, Error> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.args(["build", "--release", "--package", "suture", "--message-format", "json-render-diagnostics"]);
    let output =
        command.current_dir(home()).stderr(Stdio::inherit()).output().map_err(Error::io("starting cargo to build suture"))?;
    let messages = String::from_utf8_lossy(&output.stdout);
    let built = messages.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok()).find_map(|message| {
        let is_suture = message["target"]["name"] == "suture" && message["target"]["kind"][0] == "bin";
        message["executable"].as_str().filter(|_| is_suture).map(PathBuf::from)
    });
    built.filter(|_| output.status.success()).ok_or(Error::Build)
}

/// The Python of `.venv`, made and filled now unless what `wanted` needs is there in its pinned version, and what it has.
fn python_with(wanted: &[&str]) -> (Option<PathBuf>, BTreeMap<String, String>) {
    let folder = home().join(".venv");
    let python = folder.join("bin/python");
    let requirements = home().join("pipelines/requirements.txt");
    let pinned = pins(&std::fs::read_to_string(&requirements).unwrap_or_default());
    let right = |there: &BTreeMap<String, String>, name: &str| there.get(name) == pinned.get(name);
    let mut there = installed(&python);
    let peers = |wanted: &&&str| **wanted != SUTURE_PACKAGE;
    if !wanted.iter().filter(peers).all(|name| right(&there, name)) {
        if !make_environment(&folder, &pinned) {
            return (None, BTreeMap::new());
        }
        there = installed(&python);
    }
    there.retain(|name, version| pinned.get(name) == Some(version));
    if wanted.contains(&SUTURE_PACKAGE) {
        there.extend(install_suture(&python));
    }
    (Some(python), there)
}

/// The package of this repository, built now, so that no older one is measured: its name and version, if that can be done.
fn install_suture(python: &Path) -> Option<(String, String)> {
    eprintln!("building {SUTURE_PACKAGE}");
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "install", "--quiet", "--force-reinstall", "--no-deps"]).arg(home().join("../python"));
    pip.status().ok().filter(|status| status.success())?;
    installed(python).remove_entry(SUTURE_PACKAGE)
}

/// A Python environment with the pinned packages, as far as they can be had; false if there is no Python to make one.
fn make_environment(folder: &Path, pinned: &BTreeMap<String, String>) -> bool {
    let python = folder.join("bin/python");
    eprintln!("installing {} into {}", pinned.keys().cloned().collect::<Vec<_>>().join(", "), folder.display());
    let made = Command::new("python3").args(["-m", "venv", "--clear"]).arg(folder).status();
    if !made.is_ok_and(|status| status.success()) {
        return false;
    }
    // One by one, so that what cannot be had keeps nothing else away.
    for (name, version) in pinned {
        let pip = Command::new(&python).args(["-m", "pip", "install", "--quiet", &format!("{name}=={version}")]).status();
        if !pip.is_ok_and(|status| status.success()) {
            eprintln!("{name} {version} could not be installed");
        }
    }
    true
}

/// `NAME==VERSION` of each line.
fn pins(requirements: &str) -> BTreeMap<String, String> {
    let lines = requirements.lines().filter(|line| !line.starts_with('#'));
    lines.filter_map(|line| line.trim().split_once("==")).map(|(name, version)| (name.into(), version.into())).collect()
}

/// Version by package that a Python has.
fn installed(python: &Path) -> BTreeMap<String, String> {
    let script = "import importlib.metadata as m
for d in m.distributions(): print(d.metadata['Name'] + '==' + d.version)";
    let listed = said(Command::new(python).args(["-c", script])).unwrap_or_default();
    let mut packages = pins(&listed);
    packages.retain(|name, _| name != "pip" && name != "setuptools");
    packages
}

#[cfg(test)]
mod tests {
    use super::super::simplified::Simplifier;
    use super::*;

    #[test]
    fn every_package_of_a_side_is_pinned() {
        let pinned = pins(include_str!("../../pipelines/requirements.txt"));
        for side in Side::ALL {
            let name = package(side).filter(|name| *name != SUTURE_PACKAGE);
            assert!(name.is_none_or(|name| pinned.contains_key(name)), "{side:?}");
        }
        assert_eq!(pins("# a==1\nb==2.0\n\n").into_iter().collect::<Vec<_>>(), [("b".into(), "2.0".into())]);
    }

    #[test]
    fn the_version_of_tobj_is_the_one_that_is_built() {
        let lock = include_str!("../../../Cargo.lock").replace("name = ", "").replace("\"\nversion = \"", " ");
        assert!(lock.contains(&format!("\"{TOBJ_VERSION}\"\n")));
    }

    #[test]
    fn every_script_is_there() {
        for side in Side::ALL {
            if let Program::Python { script, .. } = side.facts().program {
                assert!(home().join("pipelines").join(script).exists(), "{script}");
            }
        }
        let pinned = pins(include_str!("../../pipelines/requirements.txt"));
        for (package, script) in Simplifier::ALL.into_iter().filter_map(Simplifier::peer) {
            assert!(home().join("pipelines").join(script).exists() && pinned.contains_key(package), "{script}");
        }
    }
}
