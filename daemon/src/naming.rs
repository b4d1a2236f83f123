//! Where `suture repair` may write, and under which names: never over an input, never over what is no file, over an existing file
//! only by force. The names depend on the inputs' order alone, not on what is done first. None is like another one for a system that does not
//! tell upper from lower case, or how an accent is spelt.

use std::collections::{HashMap, HashSet};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use suture_core::OutputFormat;

use crate::alike::{Alike, folded};
use crate::cli::meshes::RepairArgs;
use crate::fsx;
use crate::receipt::REPORT;

/// Free names (`part~2.stl`, …) are looked for this far.
const MAX_VERSIONS: u32 = 100_000;

/// Where results and reports go.
pub(crate) struct Naming {
    output: PathBuf,
    /// The ending of results' names in a folder; `None`: that of their inputs.
    ending: Option<&'static str>,
    /// `output` is a folder, and so is `report` if there are several inputs.
    folder: bool,
    report: Option<PathBuf>,
    several: bool,
    /// Device and inode of every input.
    inputs: HashSet<(u64, u64)>,
    pub(crate) force: bool,
    given: Mutex<Given>,
}

/// Names given out in a folder.
#[derive(Default)]
struct Given {
    /// The same for names that are alike.
    names: HashSet<Vec<u8>>,
    /// The last version tried for an input's name.
    versions: HashMap<OsString, u32>,
    /// Names that are in the folder.
    there: Alike,
}

impl Given {
    /// Was this name given out, or one like it?
    fn has(&self, path: &Path) -> bool {
        self.names.contains(&folded(path.file_name().unwrap_or_default()))
    }

    /// Is there no such name yet, nor one like it? One that cannot be looked at is not free; where the folder cannot be read, only the very name counts.
    fn is_free(&self, path: &Path) -> bool {
        !self.has(path) && is_free(path) && !self.there.has_twin(path).unwrap_or(false)
    }
}

impl Naming {
    /// `format`: that of the results.
    ///
    /// # Errors
    /// A line for people when the command line asks for what cannot be.
    pub(crate) fn new(args: &RepairArgs, format: OutputFormat) -> Result<Self, String> {
        let (output, several) = (args.output.clone(), args.inputs.len() > 1);
        let folder = is_folder(&output)?;
        let shown = output.display();
        if !folder && several {
            return Err(match fsx::exists(&output).unwrap_or(true) {
                true => format!("{shown}: is no folder; several inputs need a folder to go to"),
                false => format!("{shown}: no such folder; several inputs need one that exists"),
            });
        }
        if !folder && output.as_os_str().as_encoded_bytes().ends_with(b"/") {
            return Err(format!("{shown}: no such folder"));
        }
        if !folder && !is_folder(fsx::folder_of(&output))? {
            return Err(format!("{shown}: its folder does not exist"));
        }
        let inputs = ids_of(&args.inputs, args.force)?;
        let (report, force) = (args.report.clone(), args.force);
        let ending = format.ending();
        let naming = Self { output, ending, folder, report, several, inputs, force, given: Mutex::default() };
        if !folder {
            naming.check(&naming.output)?;
        }
        if let Some(report) = &naming.report {
            naming.check_reports(report)?;
        }
        Ok(naming)
    }

    /// One result, to be called this.
    pub(crate) fn of_file(output: PathBuf) -> Self {
        Self {
            output,
            ending: None,
            folder: false,
            report: None,
            several: false,
            inputs: HashSet::new(),
            force: false,
            given: Mutex::default(),
        }
    }

    fn check_reports(&self, report: &Path) -> Result<(), String> {
        let shown = report.display();
        if self.several {
            return if is_folder(report)? {
                Ok(())
            } else {
                Err(format!("{shown}: with several inputs --report must be an existing folder"))
            };
        }
        if is_folder(report)? {
            return Err(format!("{shown}: is a folder; name a file for the report"));
        }
        if !is_folder(fsx::folder_of(report))? {
            return Err(format!("{shown}: its folder does not exist"));
        }
        self.check(report)?;
        if !self.folder && same_name(report, &self.output) {
            return Err(format!("{shown}: cannot be both the result and the report"));
        }
        Ok(())
    }

    /// The name the result of `input` is to have: in a folder, the first that is neither there nor given out, nor like one that is. By force, a
    /// file may be there that can be replaced, so that the same command gives the same names again.
    pub(crate) fn target(&self, input: &Path) -> PathBuf {
        if !self.folder {
            return self.output.clone();
        }
        let input = self.ending.map_or_else(|| input.to_owned(), |ending| input.with_extension(ending));
        let name = input.file_name().unwrap_or_default();
        let mut given = self.given.lock().unwrap_or_else(PoisonError::into_inner);
        let reserve = if self.report.is_some() { REPORT.len() } else { 0 };
        let from = given.versions.get(name).map_or(1, |last| last + 1);
        let mut candidates = (from..MAX_VERSIONS).map(|n| (n, fsx::versioned(name, n, reserve)));
        let may_have = |path: PathBuf| given.is_free(&path) || (!given.has(&path) && self.replaces(&path));
        let free = candidates.find(|(_, name)| may_have(self.output.join(name)));
        let Some((version, target)) = free else { return self.output.join(name) };
        given.versions.insert(name.to_owned(), version);
        given.names.insert(folded(&target));
        self.output.join(target)
    }

    /// Is a file there, and is it to be replaced?
    fn replaces(&self, path: &Path) -> bool {
        self.force && !is_free(path) && self.check(path).is_ok()
    }

    /// The next name when `target` has been taken by someone else meanwhile; `None` where only one name will do.
    pub(crate) fn next(&self, input: &Path) -> Option<PathBuf> {
        self.folder.then(|| self.target(input)).filter(|target| is_free(target))
    }

    /// Where the report goes beside a result of this name.
    ///
    /// # Errors
    /// A line for people when nothing may be written there.
    pub(crate) fn report(&self, target: &Path) -> Result<Option<PathBuf>, String> {
        let Some(report) = &self.report else { return Ok(None) };
        if !self.several {
            self.check(report)?;
            return Ok(Some(report.clone()));
        }
        let mut name = target.file_name().unwrap_or_default().to_owned();
        name.push(REPORT);
        let path = report.join(name);
        self.check(&path)?;
        Ok(Some(path))
    }

    /// Is this a name that something may be written to? Never an input, by whatever name, nor anything but a regular file; an existing
    /// file only by force.
    ///
    /// # Errors
    /// A line for people.
    pub(crate) fn check(&self, target: &Path) -> Result<(), String> {
        let shown = target.display();
        let exists = || Err(format!("{shown}: exists already; choose another name or add --force"));
        let Some(there) = fsx::behind(target).map_err(|error| unseen(target, &error))? else {
            // A link that leads nowhere would be replaced, too.
            return if !is_free(target) && !self.force { exists() } else { Ok(()) };
        };
        if self.inputs.contains(&id(&there)) {
            return Err(format!("{shown}: is an input itself; an input is never overwritten"));
        }
        if !there.is_file() {
            return Err(format!("{shown}: is no regular file, and is not replaced"));
        }
        if self.force { Ok(()) } else { exists() }
    }

    /// The result's own name is chosen among free ones.
    pub(crate) fn is_folder(&self) -> bool {
        self.folder
    }
}

/// May what is made of all these inputs be written to `output`? As [`Naming::check`].
///
/// # Errors
/// A line for people.
pub(crate) fn check_one(inputs: &[PathBuf], output: &Path, force: bool) -> Result<(), String> {
    Naming { inputs: ids_of(inputs, force)?, force, ..Naming::of_file(output.to_owned()) }.check(output)
}

fn ids_of(inputs: &[PathBuf], force: bool) -> Result<HashSet<(u64, u64)>, String> {
    let mut ids = HashSet::new();
    for input in inputs {
        match fsx::behind(input) {
            Ok(found) => ids.extend(found.as_ref().map(id)),
            // It may be the very file that is to be replaced.
            Err(error) if force => return Err(unseen(input, &error)),
            Err(_) => {}
        }
    }
    Ok(ids)
}

fn is_folder(path: &Path) -> Result<bool, String> {
    fsx::is_folder(path).map_err(|error| unseen(path, &error))
}

fn unseen(path: &Path, error: &std::io::Error) -> String {
    format!("{}: cannot be looked at: {error}", path.display())
}

/// A name that cannot be looked at is not free.
fn is_free(path: &Path) -> bool {
    fsx::exists(path).is_ok_and(|there| !there)
}

fn id(metadata: &std::fs::Metadata) -> (u64, u64) {
    let identity = fsx::Identity::from(metadata);
    (identity.dev, identity.ino)
}

/// Whether two paths name one file, which need not exist.
fn same_name(a: &Path, b: &Path) -> bool {
    let whole = |p: &Path| (fsx::folder_of(p).canonicalize().ok(), p.file_name().map(ToOwned::to_owned));
    whole(a) == whole(b)
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::{Cli, Command};

    fn naming(line: &[&str]) -> Result<Naming, String> {
        match Cli::try_parse_from([&["suture", "repair"], line].concat()).unwrap().command {
            Command::Repair(args) => Naming::new(&args, OutputFormat::Input),
            _ => unreachable!("the line begins with `repair`"),
        }
    }

    /// Names are given in order, past what is there and past what was given to a file of that very name.
    #[test]
    fn every_input_has_a_name_of_its_own() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().to_str().unwrap();
        std::fs::write(dir.path().join("part.stl"), b"there").unwrap();
        let naming = naming(&["a/part.stl", "part~3.stl", "b/part.stl", "-o", out, "--report", out]).unwrap();
        let names = ["a/part.stl", "part~3.stl", "b/part.stl"].map(|input| naming.target(Path::new(input)));
        assert_eq!(names, ["part~2.stl", "part~3.stl", "part~4.stl"].map(|name| dir.path().join(name)));
        assert_eq!(naming.report(&names[0]), Ok(Some(dir.path().join(format!("part~2.stl{REPORT}")))));
    }

    /// A file that is there is replaced, once; an input and what is no file are not.
    #[test]
    fn by_force_what_is_there_is_replaced() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
        for name in ["part.stl", "part~2.stl", "own.stl", "LIKE.stl"] {
            std::fs::write(at(name), b"there").unwrap();
        }
        std::fs::create_dir(at("folder.stl")).unwrap();
        let naming = naming(&["a", &at("own.stl"), "-o", &at(""), "--force"]).unwrap();
        let asked = ["a/part.stl", "b/part.stl", "c/part.stl", "own.stl", "folder.stl", "like.stl"];
        let wanted = ["part.stl", "part~2.stl", "part~3.stl", "own~2.stl", "folder~2.stl", "like~2.stl"];
        assert_eq!(asked.map(|input| naming.target(Path::new(input))), wanted.map(|name| dir.path().join(name)));
    }

    /// In the order in which they are asked for.
    #[test]
    fn names_that_look_the_same_elsewhere_are_kept_apart() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("THERE.stl"), b"there").unwrap();
        let naming = naming(&["a", "b", "-o", dir.path().to_str().unwrap()]).unwrap();
        let asked = ["x/Part.stl", "y/part.stl", "z/PART.stl", "there.stl", "\u{e9}.stl", "E\u{301}.stl"];
        let names = asked.map(|input| naming.target(Path::new(input)));
        let wanted = ["Part.stl", "part~2.stl", "PART~3.stl", "there~2.stl", "\u{e9}.stl", "E\u{301}~2.stl"];
        assert_eq!(names, wanted.map(|name| dir.path().join(name)));
    }

    #[test]
    fn what_cannot_be_written_is_said_at_once() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
        std::fs::write(at("there"), b"mine").unwrap();
        for (line, words) in [
            (&["a", "b", "-o", &at("new")][..], "no such folder"),
            (&["a", "b", "-o", &at("there")], "is no folder"),
            (&["a", "-o", &at("new/")], "no such folder"),
            (&["a", "-o", &at("no/out")], "its folder does not exist"),
            (&["a", "-o", &at("there")], "exists already"),
            (&[&at("there"), "-o", &at("there"), "--force"], "never overwritten"),
            (&["a", "-o", "/dev/null", "--force"], "no regular file"),
            (&["a", "-o", &at("x"), "--report", &at("x")], "both"),
            (&["a", "-o", &at("x"), "--report", &at("")], "is a folder"),
            (&["a", "-o", &at("x"), "--report", &at("no/r")], "its folder does not exist"),
            (&["a", "b", "-o", &at(""), "--report", &at("r")], "existing folder"),
        ] {
            let error = naming(line).err().unwrap_or_default();
            assert!(error.contains(words) && !error.contains('\n'), "{line:?}: {error:?}");
        }
    }
}
