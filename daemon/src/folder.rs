//! One hot folder on disk: its parts, its owner, and what its names mean.

use std::ffi::OsStr;
use std::fs::{File, TryLockError};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use suture_store::job::Area;
use suture_store::{RelPath, Token};

use crate::config::FolderConfig;
use crate::create;
use crate::fsx::{self, Identity};
use crate::receipt::{RECEIPT, REPORT};
use crate::rights;

/// Part of a hot folder that holds results.
const OUT: &str = "out";
/// Work in progress and the job store.
const PRIVATE: &str = ".suture";
/// All parts of a hot folder.
const PARTS: [&str; 6] = ["in", OUT, "done", "failed", "quarantine", ".suture/work"];
/// Locked by the daemon that serves the folder, and its process number.
const LOCK: &str = "owner";
const PID: &str = "owner.pid";

/// A hot folder that this process serves: it holds the lock as long as it lives.
#[derive(Debug)]
pub(crate) struct Folder {
    pub name: String,
    pub root: PathBuf,
    /// Originals stay in `in/`.
    pub leave_originals: bool,
    /// What the path stood for at the start.
    id: (u64, u64),
    /// File systems of the parts at the start.
    devices: [Option<u64>; PARTS.len()],
    lock: File,
}

fn id(meta: &std::fs::Metadata) -> (u64, u64) {
    (meta.dev(), meta.ino())
}

/// Why a folder cannot be served.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FolderError {
    #[error("{} is served by another daemon{}", root.display(), pid.map(|pid| format!(" (process {pid})")).unwrap_or_default())]
    Owned { root: PathBuf, pid: Option<u32> },
    #[error("{} lies in the hot folder {}, which would take its files; put it beside that one, or remove {}/.suture if that is none any more", root.display(), outer.display(), outer.display())]
    Within { root: PathBuf, outer: PathBuf },
    #[error("{} and {} are one folder, or one lies in the other: results would be taken for drops", a.display(), b.display())]
    Mixed { a: PathBuf, b: PathBuf },
    #[error("{}: {action}: {source}", path.display())]
    Io { path: PathBuf, action: &'static str, source: io::Error },
}

impl Folder {
    /// Makes the parts that are missing and takes the folder's lock, which the system releases when the process ends.
    ///
    /// # Errors
    /// When another daemon serves it, or it cannot be made.
    pub(crate) fn open(config: &FolderConfig) -> Result<Self, FolderError> {
        let io = |path: &Path, action| {
            let path = path.to_owned();
            move |source| FolderError::Io { path, action, source }
        };
        // Made once as an absolute path: the process may be asked to look again after hours.
        let root = std::path::absolute(&config.path).map_err(io(&config.path, "cannot be found"))?;
        if let Some(outer) = outer_folder(&root) {
            return Err(FolderError::Within { root, outer });
        }
        parts_apart(&root)?;
        for part in PARTS {
            let path = root.join(part);
            make_folder(&path).map_err(io(&path, "cannot be made"))?;
        }
        let lock = take_lock(&root)?;
        let pid = format!("{}\n", std::process::id());
        let path = root.join(PRIVATE).join(PID);
        create::replace(&path, pid.as_bytes()).map_err(io(&path, "cannot be written"))?;
        let id = id(&std::fs::metadata(&root).map_err(io(&root, "cannot be looked at"))?);
        let devices = PARTS.map(|part| device(&root.join(part)));
        let (name, leave_originals) = (config.name.clone(), config.leave_originals);
        Ok(Self { name, root, leave_originals, id, devices, lock })
    }

    /// Is the folder still the one that was opened? A path that leads elsewhere by now (renamed and made anew, a mount that came or went)
    /// must not be believed: neither what is there, nor what is missing.
    ///
    /// # Errors
    /// A line for people.
    pub(crate) fn check(&self) -> Result<(), String> {
        let shown = self.root.display();
        let there = std::fs::metadata(&self.root).map_err(|error| format!("{shown}: the hot folder is out of reach: {error}"))?;
        let lock = Identity::of(&self.root.join(PRIVATE).join(LOCK));
        let held = self.lock.metadata().map(|meta| id(&meta));
        let same_lock = matches!((&lock, &held), (Ok(lock), Ok(held)) if (lock.dev, lock.ino) == *held);
        if id(&there) != self.id || !same_lock {
            return Err(format!(
                "{shown}: is another folder than at the start (moved, removed or made anew); put it back, or start again"
            ));
        }
        let ids = PARTS.map(|part| std::fs::metadata(self.root.join(part)).ok().map(|meta| id(&meta)));
        for (i, (part, device_then)) in PARTS.iter().zip(self.devices).enumerate() {
            // A part that was removed is made again where it is needed.
            let Some(now) = ids[i] else { continue };
            let part = self.root.join(part);
            if Some(now.0) != device_then {
                return Err(format!("{}: is on another file system than at the start: a mount came or went", part.display()));
            }
            if let Some(other) = ids.iter().take(i).position(|other| *other == Some(now)) {
                return Err(FolderError::Mixed { a: self.root.join(PARTS[other]), b: part }.to_string());
            }
        }
        Ok(())
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

    /// Where the attempts' folders are.
    pub(crate) fn work_root(&self) -> PathBuf {
        self.root.join(PRIVATE).join("work")
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

/// Is a folder a hot one?
pub(crate) fn is_hot(path: &Path) -> bool {
    path.join(PRIVATE).join(LOCK).exists()
}

/// The hot folder in a part of which `root` lies.
fn outer_folder(root: &Path) -> Option<PathBuf> {
    // A folder that is not there yet lies where the one above it does.
    let real = root.ancestors().find_map(|above| Some(above.canonicalize().ok()?.join(root.strip_prefix(above).ok()?)))?;
    let is_outer = |above: &&Path| is_hot(above) && PARTS.iter().any(|part| real.starts_with(above.join(part)));
    real.ancestors().skip(1).find(is_outer).map(Path::to_owned)
}

/// No part may be another one, or lie in it, by links or mounts: what is put into `out/` would appear in `in/`, without end.
fn parts_apart(root: &Path) -> Result<(), FolderError> {
    let places = PARTS.map(|part| {
        let path = root.join(part);
        (path.canonicalize().ok(), std::fs::metadata(&path).ok().map(|meta| id(&meta)))
    });
    for (i, (a, a_id)) in places.iter().enumerate() {
        for (j, (b, b_id)) in places.iter().enumerate().take(i) {
            let nested = a.as_ref().zip(b.as_ref()).is_some_and(|(a, b)| a.starts_with(b) || b.starts_with(a));
            if nested || (a_id.is_some() && a_id == b_id) {
                return Err(FolderError::Mixed { a: root.join(PARTS[j]), b: root.join(PARTS[i]) });
            }
        }
    }
    Ok(())
}

fn device(path: &Path) -> Option<u64> {
    std::fs::metadata(path).ok().map(|meta| meta.dev())
}

/// The lock of the hot folder, which the system releases when the process ends.
fn take_lock(root: &Path) -> Result<File, FolderError> {
    let path = root.join(PRIVATE).join(LOCK);
    let io = |action| {
        let path = path.clone();
        move |source| FolderError::Io { path, action, source }
    };
    let lock = create::lock_file(&path).map_err(io("cannot be opened"))?;
    let asked = Instant::now();
    loop {
        match lock.try_lock() {
            Ok(()) => return Ok(lock),
            Err(TryLockError::WouldBlock) => {
                // A lock without a readable number is a lock all the same.
                let text = std::fs::read_to_string(root.join(PRIVATE).join(PID)).unwrap_or_default();
                let pid = text.trim().parse().ok();
                if !is_fading(pid, asked) {
                    return Err(FolderError::Owned { root: root.to_owned(), pid });
                }
                std::thread::sleep(Duration::from_millis(10));
            }
            Err(TryLockError::Error(source)) => return Err(io("cannot be locked")(source)),
        }
    }
}

/// Is a lock's owner dead, and the lock about to go? A daemon that is killed just as it starts a worker leaves the lock to that
/// process for the moment before it notices.
pub(crate) fn is_fading(pid: Option<u32>, asked: Instant) -> bool {
    let pid = pid.and_then(|pid| i32::try_from(pid).ok()).and_then(rustix::process::Pid::from_raw);
    let dead = pid.is_some_and(|pid| rustix::process::test_kill_process(pid) == Err(rustix::io::Errno::SRCH));
    dead && asked.elapsed() < Duration::from_secs(2)
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

/// Tells names apart. Temporary names are those of browsers, copy programs, editors, office programs and file servers.
pub(crate) fn name_kind(name: &OsStr) -> NameKind {
    let lossy = name.to_string_lossy();
    let lower = lossy.to_ascii_lowercase();
    const ENDINGS: [&str; 9] = [".part", ".tmp", ".temp", ".crdownload", ".partial", ".filepart", ".download", ".swp", "~"];
    const LITTER: [&str; 4] = ["thumbs.db", "desktop.ini", "@eadir", "lost+found"];
    let hidden = lower.starts_with('.') || lower.starts_with("~$") || lower.starts_with('#');
    // What this program puts beside results, and someone copies back with them.
    let ours = lower.ends_with(REPORT) || lower.ends_with(RECEIPT);
    if hidden || ours || ENDINGS.iter().any(|ending| lower.ends_with(ending)) || LITTER.contains(&lower.as_str()) {
        return NameKind::Ignored;
    }
    if lower.ends_with(".stl") { NameKind::Mesh } else { NameKind::Foreign }
}

/// Makes the folder a path will stand in, durably where it is new.
///
/// # Errors
/// As `mkdir` and `fsync`.
pub(crate) fn make_parent(path: &Path) -> io::Result<()> {
    make_folder(fsx::folder_of(path))
}

/// Makes a folder and those above it, each durable in the one it lies in, with its group.
fn make_folder(path: &Path) -> io::Result<()> {
    // Only what the system says is not there is made: an error is no absence.
    match std::fs::metadata(path) {
        Ok(there) if there.is_dir() => return Ok(()),
        Ok(_) => return Err(io::ErrorKind::NotADirectory.into()),
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        Err(_) => {}
    }
    make_parent(path)?;
    rights::make_folder(path)?;
    fsx::sync_dir(fsx::folder_of(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_litter_and_the_rest() {
        for mesh in ["part.stl", "PART.STL", "a b$.Stl", "CON.stl"] {
            assert_eq!(name_kind(OsStr::new(mesh)), NameKind::Mesh, "{mesh}");
        }
        for ignored in [
            ".part.stl",
            "part.stl.crdownload",
            "part.stl.part",
            "part.stl.report.json",
            "part.stl.suture.json",
            "~$part.stl",
            "part.stl~",
            "Thumbs.db",
            "@eaDir",
            "x.TMP",
        ] {
            assert_eq!(name_kind(OsStr::new(ignored)), NameKind::Ignored, "{ignored}");
        }
        for foreign in ["part.obj", "notes.txt", "stl"] {
            assert_eq!(name_kind(OsStr::new(foreign)), NameKind::Foreign, "{foreign}");
        }
    }

    #[test]
    fn a_folder_has_one_owner() {
        let dir = tempfile::tempdir().unwrap();
        let config =
            FolderConfig { name: "a".into(), path: dir.path().into(), profile: "default".into(), leave_originals: false };
        let first = Folder::open(&config).unwrap();
        assert!(first.inbox().is_dir() && first.out().is_dir());
        match Folder::open(&config) {
            Err(FolderError::Owned { pid, .. }) => assert_eq!(pid, Some(std::process::id())),
            other => panic!("{other:?}"),
        }
        drop(first);
        Folder::open(&config).unwrap();
    }

    /// D5: neither a folder that was made anew under the old name nor a store that was removed is taken for the one that was opened.
    #[test]
    fn a_folder_is_told_by_its_identity() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        let config = FolderConfig { name: "a".into(), path: at("hot"), profile: "default".into(), leave_originals: false };
        let folder = Folder::open(&config).unwrap();
        folder.check().unwrap();
        std::fs::remove_dir(at("hot/out")).unwrap();
        folder.check().expect("a part may be made again");
        std::fs::rename(at("hot"), at("old")).unwrap();
        assert!(folder.check().unwrap_err().contains("out of reach"));
        std::fs::create_dir(at("hot")).unwrap();
        assert!(folder.check().unwrap_err().contains("another folder"));
        Folder::open(&config).expect("it is another folder, and another daemon's to serve");
        assert!(folder.check().is_err());
        std::fs::remove_dir_all(at("hot")).unwrap();
        std::fs::rename(at("old"), at("hot")).unwrap();
        folder.check().expect("it is back");
        std::fs::remove_dir_all(at("hot/.suture")).unwrap();
        std::fs::create_dir_all(at("hot/.suture/work")).unwrap();
        assert!(folder.check().is_err(), "the store went with it");
    }

    /// `out/` or `done/` that leads to `in/` made results of results, without end.
    #[test]
    fn a_part_that_leads_to_another_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let config =
            FolderConfig { name: "a".into(), path: dir.path().into(), profile: "default".into(), leave_originals: false };
        for (part, target) in [("out", "in"), ("done", "in"), ("failed", "in/deep")] {
            std::fs::create_dir_all(dir.path().join("in/deep")).unwrap();
            std::os::unix::fs::symlink(target, dir.path().join(part)).unwrap();
            assert!(matches!(Folder::open(&config), Err(FolderError::Mixed { .. })), "{part} -> {target}");
            std::fs::remove_file(dir.path().join(part)).unwrap();
        }
        let folder = Folder::open(&config).unwrap();
        std::fs::remove_dir(dir.path().join("out")).unwrap();
        std::os::unix::fs::symlink("in", dir.path().join("out")).unwrap();
        assert!(folder.check().unwrap_err().contains("results would be taken for drops"), "while it is served, too");
    }

    /// A hot folder in a part of another one, each with a daemon of its own: both would take its files.
    #[test]
    fn a_folder_within_a_hot_one_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let config = |path: PathBuf| FolderConfig { name: "a".into(), path, profile: "default".into(), leave_originals: false };
        let _outer = Folder::open(&config(dir.path().into())).unwrap();
        for inner in ["in", "in/sub/deeper", "out"] {
            let opened = Folder::open(&config(dir.path().join(inner)));
            assert!(matches!(opened, Err(FolderError::Within { .. })), "{inner}: {opened:?}");
            assert!(!dir.path().join("in/sub").exists(), "nothing was made");
        }
        Folder::open(&config(dir.path().join("beside"))).expect("not in a part");
    }

    #[test]
    fn a_sub_folder_names_the_profile() {
        let of = |text: &str| Folder::profile_folder(&RelPath::new(text.as_bytes()).unwrap());
        assert_eq!(of("a.stl"), None);
        assert_eq!(of("scan/a.stl").as_deref(), Some("scan"));
        assert_eq!(of("scan/order 7/a.stl").as_deref(), Some("scan"));
    }
}
