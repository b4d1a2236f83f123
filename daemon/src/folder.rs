//! One hot folder on disk: its parts, its owner, and what its names mean.

use std::ffi::OsStr;
use std::fs::{File, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use suture_store::job::Area;
use suture_store::{RelPath, Token};

use crate::config::FolderConfig;
use crate::fsx;

/// Part of a hot folder that holds results.
const OUT: &str = "out";
/// Work in progress and the job store; on the same file system as the rest, so that results appear by renaming.
const PRIVATE: &str = ".suture";

/// A hot folder that this process serves: it holds the lock as long as it lives.
#[derive(Debug)]
pub(crate) struct Folder {
    pub name: String,
    pub root: PathBuf,
    /// Profile of files that lie in no sub-folder.
    pub profile: String,
    _lock: File,
}

/// Why a folder cannot be served.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FolderError {
    #[error("{} is served by another daemon{}", root.display(), pid.map(|pid| format!(" (process {pid})")).unwrap_or_default())]
    Owned { root: PathBuf, pid: Option<u32> },
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
        for part in ["in", OUT, "done", "failed", "quarantine", ".suture/work"] {
            let path = root.join(part);
            std::fs::create_dir_all(&path).map_err(io(&path, "cannot be made"))?;
        }
        let path = root.join(PRIVATE).join("owner");
        let mut lock = File::options()
            .create(true)
            .truncate(false)
            .read(true)
            .write(true)
            .open(&path)
            .map_err(io(&path, "cannot be opened"))?;
        let asked = Instant::now();
        loop {
            match lock.try_lock() {
                Ok(()) => break,
                Err(TryLockError::WouldBlock) => {
                    let mut text = String::new();
                    // A lock without a readable pid is a lock all the same.
                    let _ = lock.rewind().and_then(|()| lock.read_to_string(&mut text));
                    let pid = text.trim().parse().ok();
                    if !is_fading(pid, asked) {
                        return Err(FolderError::Owned { root, pid });
                    }
                    std::thread::sleep(Duration::from_millis(10));
                }
                Err(TryLockError::Error(source)) => return Err(io(&path, "cannot be locked")(source)),
            }
        }
        let pid = format!("{}\n", std::process::id());
        lock.set_len(0)
            .and_then(|()| lock.rewind())
            .and_then(|()| lock.write_all(pid.as_bytes()))
            .map_err(io(&path, "cannot be written"))?;
        Ok(Self { name: config.name.clone(), root, profile: config.profile.clone(), _lock: lock })
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
    if hidden || ENDINGS.iter().any(|ending| lower.ends_with(ending)) || LITTER.contains(&lower.as_str()) {
        return NameKind::Ignored;
    }
    if lower.ends_with(".stl") { NameKind::Mesh } else { NameKind::Foreign }
}

/// Makes the folder a path will stand in, durably where it is new.
///
/// # Errors
/// As `mkdir` and `fsync`.
pub(crate) fn make_parent(path: &Path) -> io::Result<()> {
    let parent = fsx::folder_of(path);
    if parent.is_dir() {
        return Ok(());
    }
    make_parent(parent)?;
    match std::fs::create_dir(parent) {
        Err(e) if e.kind() != io::ErrorKind::AlreadyExists => return Err(e),
        _ => {}
    }
    fsx::sync_dir(fsx::folder_of(parent))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_litter_and_the_rest() {
        for mesh in ["part.stl", "PART.STL", "a b$.Stl", "CON.stl"] {
            assert_eq!(name_kind(OsStr::new(mesh)), NameKind::Mesh, "{mesh}");
        }
        for ignored in
            [".part.stl", "part.stl.crdownload", "part.stl.part", "~$part.stl", "part.stl~", "Thumbs.db", "@eaDir", "x.TMP"]
        {
            assert_eq!(name_kind(OsStr::new(ignored)), NameKind::Ignored, "{ignored}");
        }
        for foreign in ["part.obj", "notes.txt", "stl"] {
            assert_eq!(name_kind(OsStr::new(foreign)), NameKind::Foreign, "{foreign}");
        }
    }

    #[test]
    fn a_folder_has_one_owner() {
        let dir = tempfile::tempdir().unwrap();
        let config = FolderConfig { name: "a".into(), path: dir.path().into(), profile: "default".into() };
        let first = Folder::open(&config).unwrap();
        assert!(first.inbox().is_dir() && first.out().is_dir());
        match Folder::open(&config) {
            Err(FolderError::Owned { pid, .. }) => assert_eq!(pid, Some(std::process::id())),
            other => panic!("{other:?}"),
        }
        drop(first);
        Folder::open(&config).unwrap();
    }

    #[test]
    fn a_sub_folder_names_the_profile() {
        let of = |text: &str| Folder::profile_folder(&RelPath::new(text.as_bytes()).unwrap());
        assert_eq!(of("a.stl"), None);
        assert_eq!(of("scan/a.stl").as_deref(), Some("scan"));
        assert_eq!(of("scan/order 7/a.stl").as_deref(), Some("scan"));
    }
}
