//! One hot folder on disk: its parts, its owner, and what its names mean.

use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use suture_core::read::ENDINGS;
use suture_store::job::Area;
use suture_store::{Job, RelPath, Token};

use crate::alike::Alike;
use crate::config::FolderConfig;
use crate::config::taken::OnTaken;
pub(crate) use crate::ground::{FolderError, is_fading, make_parent};
use crate::ground::{Ground, LOCK, PARTS, PRIVATE, Trace, id};
use crate::receipt::{RECEIPT, REPORT};
use crate::sentinel::{Answer, Sentinel};
use crate::shelf::Shelf;
use crate::{create, fsx};

/// Part of a hot folder that holds results.
const OUT: &str = "out";

/// A hot folder that this process serves: it holds the lock as long as it lives. One that is away is told by what it left behind.
#[derive(Debug)]
pub(crate) struct Folder {
    pub name: String,
    pub root: PathBuf,
    /// Originals stay in `in/`.
    pub leave_originals: bool,
    /// For a result whose name is taken.
    pub on_taken: OnTaken,
    /// Names of results that other systems take for the same.
    pub alike: Alike,
    /// Its parts are there; here is only what this machine works on.
    pub bucket: Option<Shelf>,
    /// Daemons on other machines serve it, too.
    pub is_shared: bool,
    ground: Mutex<Result<Ground, Trace>>,
    /// Of a shared one: this daemon has its lock.
    is_kept: AtomicBool,
    /// `None`: whoever looks waits as long as it takes.
    sentinel: Option<Sentinel>,
}

/// Waits for a folder on a hung mount no longer than a few seconds.
///
/// # Errors
/// When it does not answer, or no thread can be started that asks it.
pub(crate) fn must_answer(root: &Path) -> Result<(), FolderError> {
    match Sentinel::post(root).map_err(FolderError::unseen(root))?.answers_at_last() {
        Answer::Yes => Ok(()),
        Answer::NotYet | Answer::Silent => Err(FolderError::Silent { root: root.to_owned() }),
    }
}

impl Folder {
    /// Makes the parts that are missing and takes the folder's lock, which the system releases when the process ends. `known`: what told the
    /// folder of that name when it was served last. If its mount is gone, nothing is made, and it is away until it is back.
    ///
    /// # Errors
    /// When another daemon serves it, or it cannot be made.
    pub(crate) fn open(config: &FolderConfig, known: Option<&Trace>) -> Result<Self, FolderError> {
        let root = absolute(config)?;
        let ground = match known.filter(|known| known.missing(&root).is_some()) {
            Some(known) => Err(known.clone()),
            None => Ok(take(&root, config.is_shared.then_some(&config.name))?),
        };
        Ok(Self::at(root, config, ground))
    }

    /// As [`Folder::open`], but nothing waits for a folder that hangs, now or later: it is away until it answers.
    ///
    /// # Errors
    /// As [`Folder::open`]; also when it does not answer, and was never served before.
    pub(crate) fn open_guarded(config: &FolderConfig, known: Option<&Trace>) -> Result<Self, FolderError> {
        let root = absolute(config)?;
        let bucket = shelf(config, &root)?;
        let sentinel = Sentinel::post(&root).map_err(FolderError::unseen(&root))?;
        let folder = match (sentinel.answers_at_last(), known) {
            (Answer::Yes, known) => Self::open(config, known)?,
            (_, Some(known)) => Self::at(root, config, Err(known.clone())),
            (_, None) => return Err(FolderError::Silent { root }),
        };
        Ok(Self { sentinel: Some(sentinel), bucket, ..folder })
    }

    /// A folder that another daemon serves: it is away until that one lets go of it.
    ///
    /// # Errors
    /// When it cannot be looked at.
    pub(crate) fn of_other(config: &FolderConfig) -> Result<Self, FolderError> {
        let root = std::path::absolute(&config.path).map_err(FolderError::unseen(&config.path))?;
        let trace = Trace::of_other(&root).map_err(FolderError::unseen(&root))?;
        let (bucket, sentinel) = (shelf(config, &root)?, Sentinel::post(&root).map_err(FolderError::unseen(&root))?);
        Ok(Self { sentinel: Some(sentinel), bucket, ..Self::at(root, config, Err(trace)) })
    }

    fn at(root: PathBuf, config: &FolderConfig, ground: Result<Ground, Trace>) -> Self {
        let FolderConfig { name, leave_originals, on_taken, .. } = config.clone();
        Self {
            name,
            root,
            leave_originals,
            on_taken,
            alike: Alike::default(),
            bucket: None,
            is_shared: config.is_shared,
            ground: Mutex::new(ground),
            is_kept: AtomicBool::new(false),
            sentinel: None,
        }
    }

    fn ground(&self) -> MutexGuard<'_, Result<Ground, Trace>> {
        self.ground.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Asks whether it answers, before a look that nobody may wait for.
    pub(crate) fn answers(&self) -> Answer {
        self.sentinel.as_ref().map_or(Answer::Yes, Sentinel::answers)
    }

    /// It has not answered for a long time, in words. Looks at nothing.
    pub(crate) fn silence(&self) -> Option<String> {
        self.sentinel.as_ref().is_some_and(Sentinel::is_silent).then(|| self.silent())
    }

    /// The words for a folder that does not answer.
    pub(crate) fn silent(&self) -> String {
        FolderError::Silent { root: self.root.clone() }.to_string()
    }

    /// Is the folder still the one that was opened? A path that leads elsewhere by now (renamed and made anew, a mount that came or went)
    /// must not be believed: neither what is there, nor what is missing. One that does not answer is waited for no longer than a few seconds.
    ///
    /// # Errors
    /// A line for people.
    pub(crate) fn check(&self) -> Result<(), String> {
        if self.sentinel.as_ref().is_some_and(|sentinel| sentinel.answers_at_last() != Answer::Yes) {
            return Err(self.silent());
        }
        if let Some(trouble) = self.bucket.as_ref().and_then(|shelf| shelf.bucket.trouble()) {
            return Err(trouble);
        }
        match &*self.ground() {
            Ok(ground) => ground.check(&self.root),
            Err(trace) => Err(self.away(trace)),
        }
    }

    fn away(&self, trace: &Trace) -> String {
        trace.missing(&self.root).unwrap_or_else(|| format!("{}: the hot folder is coming back", self.root.display()))
    }

    /// What tells the folder again.
    pub(crate) fn trace(&self) -> Trace {
        match &*self.ground() {
            Ok(ground) => ground.trace().clone(),
            Err(trace) => trace.clone(),
        }
    }

    /// Is the mount gone that the folder lay on? In words.
    pub(crate) fn missing(&self) -> Option<String> {
        self.silence().or_else(|| self.trace().missing(&self.root))
    }

    /// Takes the folder again if it was away and is back: it has its own mark, whatever its device is by now. One whose mount is gone is let go of.
    ///
    /// # Errors
    /// A line for people: why it is not served.
    pub(crate) fn regain(&self) -> Result<(), String> {
        self.silence().map_or(Ok(()), Err)?;
        let mut ground = self.ground();
        let trace = match &*ground {
            Ok(here) => {
                let why = here.check(&self.root);
                if why.is_ok() || !here.is_left(&self.root) {
                    return why;
                }
                let trace = here.trace().clone();
                if !trace.leads_here(&self.root).unwrap_or(false) {
                    if trace.is_unmounted(&self.root) {
                        // With its lock goes what keeps the file system from being unmounted in truth.
                        *ground = Err(trace);
                        self.is_kept.store(false, Ordering::Release);
                    }
                    return why;
                }
                trace
            }
            Err(trace) => trace.clone(),
        };
        if let Some(missing) = trace.missing(&self.root) {
            return Err(missing);
        }
        self.is_kept.store(false, Ordering::Release);
        *ground = Ok(take(&self.root, self.is_shared.then_some(&self.name)).map_err(|error| error.to_string())?);
        Ok(())
    }

    /// Is it this daemon that looks for drops in it, and does what one has to do alone? Looks at nothing.
    pub(crate) fn keeps(&self) -> bool {
        !self.is_shared || self.is_kept.load(Ordering::Acquire)
    }

    /// Keeps it from now on, if no other daemon does. Returns whether this one does.
    pub(crate) fn try_keep(&self) -> bool {
        if self.keeps() {
            return true;
        }
        let ground = self.ground();
        let keeps = match ground.as_ref().map(Ground::try_keep) {
            Ok(Ok(keeps)) => keeps,
            Ok(Err(error)) => {
                tracing::debug!(folder = %self.root.display(), %error, "The lock of a shared folder cannot be asked for.");
                false
            }
            Err(_) => false,
        };
        self.is_kept.store(keeps, Ordering::Release);
        keeps
    }

    /// The device of a file, as a job notes it: each machine has a number of its own for a share.
    pub(crate) fn noted_device(&self, device: u64) -> u64 {
        if self.is_shared { fsx::NO_DEVICE } else { device }
    }

    /// Has this machine ask the server of a share what lies in that folder, where it may remember an older state of it: opening a folder does that (NFS,
    /// close-to-open consistency).
    pub(crate) fn look_anew(&self, folder: &Path) {
        if self.is_shared {
            // A folder that cannot be opened is the business of whoever looks there.
            drop(create::open_to_read(folder));
        }
    }

    /// Why nothing new is taken of it when its disk, or that of its results, has no room, in words.
    pub(crate) fn nearly_full(&self) -> String {
        format!("the disk of {} is nearly full", self.root.display())
    }

    /// Is there something of that name, in a part of the folder, wherever that is?
    ///
    /// # Errors
    /// As `lstat`, or when the bucket does not answer.
    pub(crate) fn has(&self, path: &Path) -> io::Result<bool> {
        match &self.bucket {
            None => fsx::exists(path),
            Some(shelf) => shelf.has(&self.root, path),
        }
    }

    /// The absolute path or the address of the folder, for whoever is told of it.
    pub(crate) fn place(&self) -> &Path {
        self.bucket.as_ref().map_or(&self.root, |shelf| &shelf.place)
    }

    /// A path in a part of the folder, for people.
    pub(crate) fn shown(&self, path: &Path) -> String {
        self.bucket.as_ref().map_or_else(|| path.display().to_string(), |shelf| shelf.shown(&self.root, path))
    }

    /// Where files are dropped.
    pub(crate) fn inbox(&self) -> PathBuf {
        self.root.join("in")
    }

    /// Where good results go.
    pub(crate) fn out(&self) -> PathBuf {
        self.root.join(OUT)
    }

    /// The folder of an area.
    pub(crate) fn area(&self, area: Area) -> PathBuf {
        self.root.join(match area {
            Area::In => "in",
            Area::Done => "done",
            Area::Failed => "failed",
            Area::Quarantine => "quarantine",
        })
    }

    /// Where the original of a job is.
    pub(crate) fn original(&self, job: &Job) -> PathBuf {
        let (area, path) = job.original();
        self.area(area).join(path.to_path())
    }

    /// Where the attempts' folders are.
    pub(crate) fn work_root(&self) -> PathBuf {
        self.root.join(PRIVATE).join("work")
    }

    /// Where files that come by the web are, on their way into `in/`.
    pub(crate) fn uploads(&self) -> PathBuf {
        self.root.join(PRIVATE).join("upload")
    }

    /// The folder of one attempt.
    pub(crate) fn work(&self, token: Token) -> PathBuf {
        self.work_root().join(token.to_string())
    }

    /// The sub-folder that names the profile of a file of `in/`, if it lies in one.
    pub(crate) fn profile_folder(path: &RelPath) -> Option<String> {
        let path = path.to_path();
        let mut parts = path.components();
        let first = parts.next()?.as_os_str().to_string_lossy().into_owned();
        parts.next().is_some().then_some(first)
    }
}

/// The folder's bucket, if it lies in one.
fn shelf(config: &FolderConfig, scratch: &Path) -> Result<Option<Shelf>, FolderError> {
    config.bucket.as_ref().map(|bucket| Shelf::open(&bucket.address, scratch, bucket.cache)).transpose()
}

/// Made once as an absolute path: the process may be asked to look again after hours.
fn absolute(config: &FolderConfig) -> Result<PathBuf, FolderError> {
    std::path::absolute(&config.path).map_err(|source| {
        let path = config.path.clone();
        FolderError::Io { path, action: "cannot be found", source }
    })
}

/// Is a folder a hot one?
///
/// # Errors
/// As `stat`.
pub(crate) fn is_hot(path: &Path) -> io::Result<bool> {
    Ok(fsx::behind(&path.join(PRIVATE).join(LOCK))?.is_some())
}

/// Where a path leads, if that is anywhere.
fn real(path: &Path) -> Result<Option<PathBuf>, FolderError> {
    fsx::if_there(path.canonicalize()).map_err(FolderError::unseen(path))
}

/// The hot folder in a part of which `root` lies.
fn outer_folder(root: &Path) -> Result<Option<PathBuf>, FolderError> {
    for there in root.ancestors() {
        // A folder that is not there yet lies where the one above it does.
        let (Some(above), Ok(below)) = (real(there)?, root.strip_prefix(there)) else { continue };
        let root = above.join(below);
        for outer in root.ancestors().skip(1).filter(|outer| PARTS.iter().any(|part| root.starts_with(outer.join(part)))) {
            if is_hot(outer).map_err(FolderError::unseen(outer))? {
                return Ok(Some(outer.to_owned()));
            }
        }
        break;
    }
    Ok(None)
}

/// No part may be another one, or lie in it, by links or mounts: what is put into `out/` would appear in `in/`, without end.
fn parts_apart(root: &Path) -> Result<(), FolderError> {
    let mut seen: Vec<(PathBuf, PathBuf, (u64, u64))> = Vec::with_capacity(PARTS.len());
    for part in PARTS {
        let path = root.join(part);
        let found = fsx::behind(&path).map_err(FolderError::unseen(&path))?;
        let (Some(found), Some(real)) = (found, real(&path)?) else { continue };
        let here = id(&found);
        let is_mixed =
            |(_, other, there): &&(PathBuf, PathBuf, _)| real.starts_with(other) || other.starts_with(&real) || *there == here;
        if let Some((other, ..)) = seen.iter().find(is_mixed) {
            return Err(FolderError::Mixed { a: other.clone(), b: path });
        }
        seen.push((path, real, here));
    }
    Ok(())
}

/// Makes a folder's parts and takes it, or visits it where others serve it, too, if it may be a hot one.
fn take(root: &Path, shared_as: Option<&String>) -> Result<Ground, FolderError> {
    if let Some(outer) = outer_folder(root)? {
        return Err(FolderError::Within { root: root.to_owned(), outer });
    }
    parts_apart(root)?;
    shared_as.map_or_else(|| Ground::take(root), |name| Ground::visit(root, name))
}

/// What a name in `in/` is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NameKind {
    /// A mesh we repair.
    Mesh,
    /// Temporary, hidden, or the litter of a system: not there, as far as we are concerned.
    Ignored,
    /// Something else: left where it is, and named once.
    Foreign,
}

/// Is that the name of a file that someone surely meant to have repaired: a mesh, whatever its format, or an archive of some?
pub(crate) fn is_meant(name: &OsStr) -> bool {
    const FORMATS: [&str; 18] = [
        "stl", "3mf", "obj", "ply", "off", "amf", "zip", "gz", "7z", "step", "stp", "iges", "igs", "gltf", "glb", "dae", "fbx",
        "x3d",
    ];
    let lower = name.to_string_lossy().to_ascii_lowercase();
    lower.rsplit_once('.').is_some_and(|(_, extension)| FORMATS.contains(&extension))
}

/// Endings of names of meshes, for people.
pub(crate) fn endings() -> String {
    ENDINGS.map(|ending| format!(".{ending}")).join(", ")
}

/// Tells names apart. Temporary names are those of browsers, copy programs, editors, office programs and file servers.
pub(crate) fn name_kind(name: &OsStr) -> NameKind {
    let lossy = name.to_string_lossy();
    let lower = lossy.to_ascii_lowercase();
    const TEMPORARY: [&str; 9] = [".part", ".tmp", ".temp", ".crdownload", ".partial", ".filepart", ".download", ".swp", "~"];
    const LITTER: [&str; 4] = ["thumbs.db", "desktop.ini", "@eadir", "lost+found"];
    let hidden = lower.starts_with('.') || lower.starts_with("~$") || lower.starts_with('#');
    // What this program puts beside results, and someone copies back with them.
    let ours = lower.ends_with(REPORT) || lower.ends_with(RECEIPT);
    if hidden || ours || TEMPORARY.iter().any(|ending| lower.ends_with(ending)) || LITTER.contains(&lower.as_str()) {
        return NameKind::Ignored;
    }
    let is_mesh = lower.rsplit_once('.').is_some_and(|(_, ending)| ENDINGS.contains(&ending));
    if is_mesh { NameKind::Mesh } else { NameKind::Foreign }
}

#[cfg(test)]
mod tests;
