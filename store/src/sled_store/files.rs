//! The files beside the database: the lock, the mark of how far the store got, and what sled must not find.

use std::fs::{File, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::id::{Epoch, Seq};
use crate::store::StoreError;

/// Turns an I/O error at `path` into a store's.
pub(super) fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> StoreError {
    let path = path.to_owned();
    move |source| StoreError::Io { path, action, source }
}

/// Takes `LOCK`, which ends with the process however it ends.
pub(super) fn lock(state: &Path) -> Result<File, StoreError> {
    let path = state.join("LOCK");
    let mut file =
        File::options().read(true).write(true).create(true).truncate(false).open(&path).map_err(io(&path, "opening the lock"))?;
    match try_patiently(&file) {
        Ok(()) => {
            // Always the same length, in one write: who reads it meanwhile sees a number.
            let text = format!("{:>10}\n", std::process::id());
            let written = file.rewind().and_then(|()| file.write_all(text.as_bytes()));
            written.map_err(io(&path, "writing the process number"))?;
            Ok(file)
        }
        Err(TryLockError::WouldBlock) => {
            let mut text = String::new();
            let pid = file.read_to_string(&mut text).ok().and_then(|_| text.trim().parse().ok());
            Err(StoreError::Locked { path: state.to_owned(), pid })
        }
        Err(TryLockError::Error(source)) => Err(StoreError::Io { path, action: "locking", source }),
    }
}

/// Is `LOCK` in the folder still the one that is held?
pub(super) fn check_lock(state: &Path, held: &File) -> Result<(), StoreError> {
    use std::os::unix::fs::MetadataExt;
    let id = |meta: std::io::Result<std::fs::Metadata>| meta.ok().map(|meta| (meta.dev(), meta.ino()));
    let there = id(std::fs::symlink_metadata(state.join("LOCK")));
    if there.is_some() && there == id(held.metadata()) {
        return Ok(());
    }
    Err(StoreError::Unusable {
        path: state.to_owned(),
        reason: "its folder was moved, removed or made anew while it was in use".into(),
        advice: "put it back, or start again; originals and results are where they were".into(),
    })
}

/// Is the folder owned by a daemon? Its process number, if it says so. Needs no right to write.
pub(super) fn owner(state: &Path) -> Result<Option<Option<u32>>, StoreError> {
    let path = state.join("LOCK");
    let mut file = match File::open(&path) {
        Ok(file) => file,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(StoreError::Io { path, action: "opening the lock", source }),
    };
    match file.try_lock_shared() {
        Ok(()) => Ok(None),
        Err(TryLockError::WouldBlock) => {
            let mut text = String::new();
            Ok(Some(file.read_to_string(&mut text).ok().and_then(|_| text.trim().parse().ok())))
        }
        Err(TryLockError::Error(source)) => Err(StoreError::Io { path, action: "locking", source }),
    }
}

/// A daemon that died while it started a worker holds the lock until that child has become the worker: a moment.
fn try_patiently(file: &File) -> Result<(), TryLockError> {
    for _ in 0..20 {
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(20)),
            other => return other,
        }
    }
    file.try_lock()
}

/// How far the store got, as `SEQ` says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    /// There is no file.
    Missing,
    /// There is one, but it is damaged.
    Damaged,
    /// Everything up to here was durable.
    Reached(Epoch, Seq),
}

/// Reads `SEQ`.
pub(super) fn read_mark(state: &Path) -> Result<Mark, StoreError> {
    let path = state.join("SEQ");
    let bytes = match std::fs::read(&path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Mark::Missing),
        Err(source) => return Err(StoreError::Io { path, action: "reading", source }),
    };
    Ok(parse_mark(&bytes).map_or(Mark::Damaged, |(epoch, seq)| Mark::Reached(epoch, seq)))
}

fn parse_mark(bytes: &[u8]) -> Option<(Epoch, Seq)> {
    let text = std::str::from_utf8(bytes).ok()?.strip_suffix('\n')?;
    let (body, crc) = text.rsplit_once(' ')?;
    if u32::from_str_radix(crc, 16).ok()? != crc32fast::hash(body.as_bytes()) {
        return None;
    }
    let (epoch, seq) = body.strip_prefix("suture-seq 1 ")?.split_once(' ')?;
    Some((Epoch(epoch.parse().ok()?), Seq(seq.parse().ok()?)))
}

/// Writes `SEQ` so that a crash leaves the old or the new one.
pub(super) fn write_mark(state: &Path, epoch: Epoch, seq: Seq) -> Result<(), StoreError> {
    let body = format!("suture-seq 1 {epoch} {seq}");
    let text = format!("{body} {:08x}\n", crc32fast::hash(body.as_bytes()));
    let path = state.join("SEQ");
    let temporary = state.join("SEQ.tmp");
    let mut file = create_new(&temporary)?;
    file.write_all(text.as_bytes()).and_then(|()| file.sync_all()).map_err(io(&temporary, "writing"))?;
    crate::crash::crash_point("store.mark.written");
    std::fs::rename(&temporary, &path).map_err(io(&path, "replacing"))?;
    sync_dir(state)
}

/// A new file of that name: whatever else the name stood for is unlinked, never opened.
fn create_new(path: &Path) -> Result<File, StoreError> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(io(path, "removing")(error)),
        _ => {}
    }
    File::options().write(true).create_new(true).open(path).map_err(io(path, "making"))
}

/// Makes the names in `dir` durable.
pub(super) fn sync_dir(dir: &Path) -> Result<(), StoreError> {
    // Only where a folder can be opened and synced; elsewhere renames are ordered by the file system.
    if cfg!(unix) {
        File::open(dir).and_then(|dir| dir.sync_all()).map_err(io(dir, "syncing the folder"))?;
    }
    Ok(())
}

/// Removes snapshots that a crash left half-written, and tells how many there were.
pub(super) fn remove_torn(db: &Path) -> Result<u32, StoreError> {
    let mut removed = 0;
    for path in list(db)?.into_iter().filter(|path| is_snapshot(path) && path.extension().is_some_and(|ext| ext == "generating"))
    {
        std::fs::remove_file(&path).map_err(io(&path, "removing a torn snapshot"))?;
        removed += 1;
    }
    Ok(removed)
}

/// Is it one of sled's snapshots, whole or torn?
pub(super) fn is_snapshot(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"snap."))
}

/// What is in `dir`; nothing when there is no such folder.
pub(super) fn list(dir: &Path) -> Result<Vec<PathBuf>, StoreError> {
    match std::fs::read_dir(dir) {
        Ok(entries) => {
            let paths: Result<Vec<PathBuf>, _> = entries.map(|entry| Ok(entry?.path())).collect();
            paths.map_err(io(dir, "listing the folder"))
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(source) => Err(StoreError::Io { path: dir.to_owned(), action: "listing the folder", source }),
    }
}

/// Is there anything of that name? An error is no absence.
pub(super) fn is_there(path: &Path) -> Result<bool, StoreError> {
    path.try_exists().map_err(io(path, "looking at"))
}

fn is_folder(path: &Path) -> Result<bool, StoreError> {
    Ok(std::fs::symlink_metadata(path).map_err(io(path, "looking at"))?.is_dir())
}

/// Copies the folder `from`, but for what `leave_out` names, to the new folder `to`.
pub(super) fn copy_dir(from: &Path, to: &Path, leave_out: fn(&Path) -> bool) -> Result<(), StoreError> {
    std::fs::create_dir(to).map_err(io(to, "making the folder"))?;
    for path in list(from)?.into_iter().filter(|path| !leave_out(path)) {
        let Some(name) = path.file_name() else { continue };
        let target = to.join(name);
        if is_folder(&path)? {
            copy_dir(&path, &target, leave_out)?;
        } else {
            copy_file(&path, &target)?;
        }
    }
    Ok(())
}

fn copy_file(from: &Path, to: &Path) -> Result<(), StoreError> {
    let mut file = File::open(from).map_err(io(from, "copying"))?;
    std::io::copy(&mut file, &mut create_new(to)?).map(drop).map_err(io(from, "copying"))
}

/// Copies all that an opening of the store in `from` looks at into the empty folder `to`.
pub(super) fn copy_state(from: &Path, to: &Path) -> Result<(), StoreError> {
    for name in ["db", "db.trial"] {
        if is_there(&from.join(name))? {
            copy_dir(&from.join(name), &to.join(name), |_| false)?;
        }
    }
    if is_there(&from.join("SEQ"))? { copy_file(&from.join("SEQ"), &to.join("SEQ")) } else { Ok(()) }
}

/// Makes a folder and those above it, each durable in the one it lies in.
pub(super) fn make_folder(path: &Path) -> Result<(), StoreError> {
    // Only what the system says is not there is made: an error is no absence.
    match std::fs::metadata(path) {
        Ok(_) => return Ok(()),
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(io(path, "looking at the folder")(error)),
        Err(_) => {}
    }
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    make_folder(parent)?;
    match std::fs::create_dir(path) {
        Err(error) if error.kind() != std::io::ErrorKind::AlreadyExists => return Err(io(path, "making the folder")(error)),
        _ => {}
    }
    sync_dir(parent)
}

/// Makes everything in `dir` durable.
pub(super) fn sync_all(dir: &Path) -> Result<(), StoreError> {
    for path in list(dir)? {
        if is_folder(&path)? {
            sync_all(&path)?;
        } else {
            File::open(&path).and_then(|file| file.sync_all()).map_err(io(&path, "syncing"))?;
        }
    }
    sync_dir(dir)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f05_the_mark_is_whole_or_damaged_never_another() {
        let state = tempfile::tempdir().unwrap();
        assert_eq!(read_mark(state.path()).unwrap(), Mark::Missing);
        write_mark(state.path(), Epoch(3), Seq(1234)).unwrap();
        assert_eq!(read_mark(state.path()).unwrap(), Mark::Reached(Epoch(3), Seq(1234)));
        let path = state.path().join("SEQ");
        let bytes = std::fs::read(&path).unwrap();
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1;
            std::fs::write(&path, &damaged).unwrap();
            assert_eq!(read_mark(state.path()).unwrap(), Mark::Damaged, "byte {at}");
            std::fs::write(&path, &bytes[..at]).unwrap();
            assert_eq!(read_mark(state.path()).unwrap(), Mark::Damaged, "cut at {at}");
        }
    }

    #[test]
    fn f04_only_torn_snapshots_go() {
        let db = tempfile::tempdir().unwrap();
        for name in ["db", "conf", "snap.0000", "snap.0001.generating", "other.generating"] {
            std::fs::write(db.path().join(name), "").unwrap();
        }
        assert_eq!(remove_torn(db.path()).unwrap(), 1);
        assert_eq!(list(db.path()).unwrap().len(), 4);
    }
}
