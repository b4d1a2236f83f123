//! The ground that a hot folder stands on: what its path stood for when it was taken, so that another folder under that path is never
//! believed. A path may lead elsewhere at any time: renamed and made anew, a mount that came or went. An unmounted folder looks like an empty one.
//!
//! A folder is told by device and inode while a daemon serves it, and by a mark of its own, `.suture/id`, when it comes back after it was
//! away: a disk that is mounted again may have another device. A folder without its mark that lies on another mount than before is one whose mount
//! is missing; on the same mount it was removed and made anew.

use std::collections::BTreeMap;
use std::fs::{Metadata, TryLockError};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::fs::{AtFlags, CWD, StatxAttributes, StatxFlags};
use serde::{Deserialize, Serialize};

use crate::create::{self, LockFile};
pub(crate) use crate::folder_error::FolderError;
use crate::folder_error::failed;
use crate::fsx::{self, Identity};
pub(crate) use crate::parts::{LOCK, PARTS, PRIVATE};
use crate::parts::{MARK, PID};
use crate::rights;

pub(crate) mod shared;

/// What tells a hot folder again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Trace {
    /// Its own mark.
    mark: String,
    /// The mount it lies on.
    mount: PathBuf,
    /// Parts of it that are on other file systems.
    #[serde(default)]
    apart: Vec<String>,
    /// The file that it was read from.
    #[serde(skip)]
    noted: Option<PathBuf>,
}

impl Trace {
    /// The trace of a folder that another daemon serves, as far as can be seen.
    ///
    /// # Errors
    /// As the file system's.
    pub(crate) fn of_other(root: &Path) -> io::Result<Self> {
        let here = device(root)?;
        let mut apart = Vec::new();
        for part in PARTS {
            let there = device(&root.join(part))?;
            if there.is_some() && there != here {
                apart.push(part.to_owned());
            }
        }
        Ok(Self { mark: read_mark(root)?.unwrap_or_default(), mount: mount_of(root)?, apart, noted: None })
    }

    /// Is it this folder that the path leads to?
    ///
    /// # Errors
    /// When the folder's mark cannot be read: that is no answer.
    pub(crate) fn leads_here(&self, root: &Path) -> io::Result<bool> {
        Ok(read_mark(root)?.is_some_and(|mark| mark == self.mark))
    }

    /// Why the folder is not there, or not whole: a mount is gone that it, or a part of it, lay on, or nobody can tell. `None` where all is
    /// there, or was made anew.
    pub(crate) fn missing(&self, root: &Path) -> Option<String> {
        self.gone(root).unwrap_or_else(|error| Some(format!("{}: the hot folder cannot be looked at: {error}", root.display())))
    }

    /// Is it certain that the mount is gone?
    pub(crate) fn is_unmounted(&self, root: &Path) -> bool {
        self.gone(root).is_ok_and(|gone| gone.is_some())
    }

    fn gone(&self, root: &Path) -> io::Result<Option<String>> {
        let noted = self.noted.as_ref().map_or("`folders` beside the job store".into(), |noted| noted.display().to_string());
        let todo = format!("mount it, or remove the file {noted} if this is another folder");
        if self.leads_here(root)? {
            let here = device(root)?;
            for part in &self.apart {
                let part = root.join(part);
                let there = device(&part)?;
                if there.is_none() || there == here {
                    return Ok(Some(format!("{}: the file system is not there that it was; {todo}", part.display())));
                }
            }
            return Ok(None);
        }
        let gone = mount_of(root)? != self.mount;
        let (shown, was) = (root.display(), self.mount.display());
        Ok(gone.then(|| format!("{shown}: the mount {was} is not there that it lay on; {todo}")))
    }
}

/// A hot folder that was taken: it is served by this process as long as this lives.
#[derive(Debug)]
pub(crate) struct Ground {
    id: (u64, u64),
    /// File systems of the parts at the start.
    devices: [u64; PARTS.len()],
    trace: Trace,
    lock: LockFile,
    /// Held with all that share the folder, or against them.
    _shared: Option<LockFile>,
}

pub(crate) fn id(meta: &Metadata) -> (u64, u64) {
    (meta.dev(), meta.ino())
}

impl Ground {
    /// Makes the parts that are missing and takes the folder's lock, which the system releases when the process ends.
    ///
    /// # Errors
    /// When another daemon serves it, or it cannot be made.
    pub(crate) fn take(root: &Path) -> Result<Self, FolderError> {
        make_parts(root)?;
        let lock = take_lock(root)?;
        let shared = shared::alone(root)?;
        let pid = format!("{}\n", std::process::id());
        let path = root.join(PRIVATE).join(PID);
        create::replace(&path, pid.as_bytes()).map_err(failed(&path, "cannot be written"))?;
        Self::at(root, lock, shared)
    }

    /// Makes the parts that are missing, and serves the folder with others; see [`shared`]. Who keeps it is told by [`Ground::try_keep`].
    ///
    /// # Errors
    /// When another daemon serves it alone, it cannot be made, this machine sees other numbers of files, or the others call it otherwise.
    pub(crate) fn visit(root: &Path, name: &str) -> Result<Self, FolderError> {
        make_parts(root)?;
        let path = root.join(PRIVATE).join(LOCK);
        let lock = LockFile::open(&path).map_err(failed(&path, "cannot be opened"))?;
        let is_first = shared::is_first(root, &lock)?;
        let mut ground = Self::at(root, lock, None)?;
        shared::same_view(root, name)?;
        ground._shared = Some(shared::join(root)?);
        if is_first {
            ground.lock.unlock().map_err(failed(&path, "cannot be unlocked"))?;
        }
        // A number of a process says nothing on another machine.
        let pid = root.join(PRIVATE).join(PID);
        fsx::remove_if_there(&pid).map_err(failed(&pid, "cannot be removed"))?;
        Ok(ground)
    }

    fn at(root: &Path, lock: LockFile, shared: Option<LockFile>) -> Result<Self, FolderError> {
        let id = id(&std::fs::metadata(root).map_err(FolderError::unseen(root))?);
        let mut devices = [id.0; PARTS.len()];
        for (device, part) in devices.iter_mut().zip(PARTS) {
            let path = root.join(part);
            *device = std::fs::metadata(&path).map_err(FolderError::unseen(&path))?.dev();
        }
        let mount = mount_of(root).map_err(FolderError::unseen(root))?;
        let path = root.join(PRIVATE).join(MARK);
        let mark = mark(root, id).map_err(failed(&path, "cannot be written"))?;
        let apart = PARTS.iter().zip(devices).filter(|(_, device)| *device != id.0).map(|(part, _)| (*part).to_owned());
        let trace = Trace { mark, mount, apart: apart.collect(), noted: None };
        Ok(Self { id, devices, trace, lock, _shared: shared })
    }

    /// Takes the lock of a folder that is shared, if nobody has it.
    ///
    /// # Errors
    /// When it cannot be locked.
    pub(crate) fn try_keep(&self) -> io::Result<bool> {
        match self.lock.try_lock() {
            Ok(()) => Ok(true),
            Err(TryLockError::WouldBlock) => Ok(false),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }

    /// What tells it again.
    pub(crate) fn trace(&self) -> &Trace {
        &self.trace
    }

    /// Is the folder still the one that was taken?
    ///
    /// # Errors
    /// A line for people.
    pub(crate) fn check(&self, root: &Path) -> Result<(), String> {
        self.leads_here(root).map_err(|line| self.trace.missing(root).unwrap_or(line))?;
        let mut seen: Vec<(PathBuf, (u64, u64))> = Vec::with_capacity(PARTS.len());
        for (part, device_then) in PARTS.iter().zip(self.devices) {
            let part = root.join(part);
            let found = fsx::behind(&part).map_err(|error| format!("{}: cannot be looked at: {error}", part.display()))?;
            // A part that was removed is made again where it is needed.
            let Some(now) = found.map(|meta| id(&meta)) else { continue };
            if now.0 != device_then {
                return Err(format!("{}: is on another file system than at the start: a mount came or went", part.display()));
            }
            if let Some((other, _)) = seen.iter().find(|(_, id)| *id == now) {
                return Err(FolderError::Mixed { a: other.clone(), b: part }.to_string());
            }
            seen.push((part, now));
        }
        Ok(())
    }
}

impl Ground {
    /// Does the path lead to the folder that was taken?
    ///
    /// # Errors
    /// A line for people.
    fn leads_here(&self, root: &Path) -> Result<(), String> {
        let shown = root.display();
        let there = std::fs::metadata(root).map_err(|error| format!("{shown}: the hot folder is out of reach: {error}"))?;
        let lock = Identity::of(&root.join(PRIVATE).join(LOCK));
        let held = self.lock.metadata().map(|meta| id(&meta));
        let same_lock = matches!((&lock, &held), (Ok(lock), Ok(held)) if (lock.dev, lock.ino) == *held);
        if id(&there) != self.id || !same_lock {
            return Err(format!(
                "{shown}: is another folder than at the start (moved, removed or made anew); put it back, or restart the daemon to serve this one"
            ));
        }
        Ok(())
    }

    /// Is it away, and another one to be taken for it when that has its mark?
    pub(crate) fn is_left(&self, root: &Path) -> bool {
        self.leads_here(root).is_err()
    }
}

/// The file system a path leads to, if it leads anywhere.
fn device(path: &Path) -> io::Result<Option<u64>> {
    Ok(fsx::behind(path)?.map(|found| found.dev()))
}

fn read_mark(root: &Path) -> io::Result<Option<String>> {
    Ok(fsx::text_if_there(&root.join(PRIVATE).join(MARK))?.map(|text| text.trim().to_owned()))
}

/// The folder's mark, made if it has none. It need not be secret, only another than that of any folder that may come under the same path.
fn mark(root: &Path, id: (u64, u64)) -> io::Result<String> {
    if let Some(mark) = read_mark(root)?.filter(|mark| !mark.is_empty()) {
        return Ok(mark);
    }
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default().as_nanos();
    let mark = blake3::hash(format!("{id:?} {now} {} {}", std::process::id(), root.display()).as_bytes()).to_hex();
    let mark = mark.as_str().get(..32).unwrap_or_default().to_owned();
    let path = root.join(PRIVATE).join(MARK);
    create::replace(&path, format!("{mark}\n").as_bytes())?;
    fsx::sync_dir(fsx::folder_of(&path))?;
    Ok(mark)
}

/// The root of the mount that a path lies on, or would lie on if it were there.
fn mount_of(path: &Path) -> io::Result<PathBuf> {
    let mut there = None;
    for above in path.ancestors() {
        match above.canonicalize() {
            Ok(real) => {
                there = Some(real);
                break;
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(error),
        }
    }
    let there = there.unwrap_or_else(|| "/".into());
    for above in there.ancestors() {
        if is_mount_root(above)? {
            return Ok(above.to_owned());
        }
    }
    Ok("/".into())
}

fn is_mount_root(path: &Path) -> io::Result<bool> {
    let here = rustix::fs::statx(CWD, path, AtFlags::empty(), StatxFlags::BASIC_STATS)?;
    if here.stx_attributes_mask.contains(StatxAttributes::MOUNT_ROOT) {
        return Ok(here.stx_attributes.contains(StatxAttributes::MOUNT_ROOT));
    }
    // An older system: a mount of part of the same file system goes unnoticed.
    let Some(above) = path.parent() else { return Ok(true) };
    Ok(device(above)? != device(path)?)
}

/// The lock of the hot folder, which the system releases when the process ends.
fn take_lock(root: &Path) -> Result<LockFile, FolderError> {
    let path = root.join(PRIVATE).join(LOCK);
    let lock = LockFile::open(&path).map_err(failed(&path, "cannot be opened"))?;
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
            Err(TryLockError::Error(source)) => return Err(failed(&path, "cannot be locked")(source)),
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

/// Makes the parts of a hot folder that are missing.
fn make_parts(root: &Path) -> Result<(), FolderError> {
    PARTS.iter().try_for_each(|part| {
        let path = root.join(part);
        make_folder(&path).map_err(failed(&path, "cannot be made"))
    })
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

/// Hot folders by their names, as they were served last.
pub(crate) type Traces = BTreeMap<String, Trace>;

/// Where they are written, for the next daemon of a job store.
fn traces_of(state: &Path) -> PathBuf {
    state.with_file_name("folders")
}

/// The traces that were noted beside a job store; none, where nothing was noted.
///
/// # Errors
/// When they cannot be read: without them a bare folder under a mount would be taken for the hot folder.
pub(crate) fn read_traces(state: &Path) -> Result<Traces, FolderError> {
    let path = traces_of(state);
    let io = |action| move |source| FolderError::Io { path: traces_of(state), action, source };
    let Some(text) = fsx::text_if_there(&path).map_err(io("cannot be read"))? else { return Ok(Traces::new()) };
    let mut traces: Traces = serde_json::from_str(&text)
        .map_err(|error| io("is damaged; remove it once all hot folders are mounted")(error.into()))?;
    traces.values_mut().for_each(|trace| trace.noted = Some(path.clone()));
    Ok(traces)
}

/// Notes them beside a job store.
///
/// # Errors
/// As the file system's.
pub(crate) fn note_traces(state: &Path, traces: &Traces) -> io::Result<()> {
    let path = traces_of(state);
    let text = serde_json::to_string_pretty(traces)?;
    if fsx::text_if_there(&path).is_ok_and(|noted| noted.as_ref() == Some(&text)) {
        return Ok(());
    }
    create::replace(&path, text.as_bytes())?;
    fsx::sync_dir(fsx::folder_of(&path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_a_mark_of_its_own_that_stays() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| dir.path().join(name));
        let trace = |root: &Path| Ground::take(root).unwrap().trace().clone();
        let (first, other) = (trace(&a), trace(&b));
        assert_eq!(first, trace(&a));
        assert_ne!(first.mark, other.mark);
        assert!(first.leads_here(&a).unwrap() && !first.leads_here(&b).unwrap());
        std::fs::rename(&a, dir.path().join("moved")).unwrap();
        assert!(!first.leads_here(&a).unwrap() && first.leads_here(&dir.path().join("moved")).unwrap());
    }

    /// Made anew on the same mount is one thing, a mount that is gone another.
    #[test]
    fn f25_a_mount_that_is_gone_is_told_from_a_folder_that_was_made_anew() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().join("hot");
        let trace = Ground::take(&root).unwrap().trace().clone();
        let elsewhere = Trace { mount: "/mnt/of a disk".into(), ..trace.clone() };
        assert!(trace.apart.is_empty());
        let apart = Trace { apart: vec!["out".into()], ..trace.clone() };
        assert!(apart.missing(&root).unwrap().contains("hot/out: the file system is not there"), "the bare folder under a mount");
        assert_eq!((trace.missing(&root), elsewhere.missing(&root)), (None, None), "its mark is there");
        std::fs::remove_dir_all(&root).unwrap();
        assert_eq!(trace.missing(&root), None);
        assert!(elsewhere.missing(&root).unwrap().contains("the mount /mnt/of a disk is not there"));
        std::fs::create_dir_all(root.join("in")).unwrap();
        assert!(elsewhere.missing(&root).is_some(), "the bare folder under a mount is not the folder");
    }

    #[test]
    fn mounts_are_found_above_what_is_not_there() {
        assert_eq!(mount_of(Path::new("/proc/self/nothing/at/all")).unwrap(), Path::new("/proc"));
        assert!(is_mount_root(Path::new("/")).unwrap() && is_mount_root(Path::new("/proc")).unwrap());
        let dir = tempfile::tempdir().unwrap();
        assert!(!is_mount_root(dir.path()).unwrap());
    }

    #[test]
    fn traces_are_noted_beside_the_store() {
        let dir = tempfile::tempdir().unwrap();
        let state = dir.path().join("state");
        assert!(read_traces(&state).unwrap().is_empty());
        let trace = Trace { mark: "m".into(), mount: "/mnt".into(), apart: vec!["out".into()], noted: None };
        // Read back, it knows where it was noted.
        let traces = Traces::from([("hot".to_owned(), Trace { noted: Some(traces_of(&state)), ..trace })]);
        note_traces(&state, &traces).unwrap();
        assert_eq!(read_traces(&state).unwrap(), traces);
        std::fs::write(traces_of(&state), "{").unwrap();
        assert!(read_traces(&state).unwrap_err().to_string().contains("folders: is damaged; remove it"), "never none");
    }
}
