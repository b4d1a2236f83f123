//! A hot folder that daemons on several machines serve, on a share of a network. One of them at a time *keeps* it: that one has the folder's lock, looks
//! for drops, and does all that one has to do alone. The others *visit* it: they work on its jobs. When the keeper is gone, another one takes the lock.
//!
//! `.suture/shared` is locked by all of them together, and against them by a daemon that serves the folder alone. `.suture/shared.inode` is the number
//! that the first of them saw of the folder's mark: jobs tell files by their numbers, so every machine must see the same. `.suture/shared.name` is its name,
//! by which they tell jobs of the folder.

use std::fs::TryLockError;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::create::{self, LockFile};
use crate::folder_error::{FolderError, failed};
use crate::fsx;
use crate::parts::{MARK, PRIVATE};

const SHARED: &str = "shared";
const INODE: &str = "shared.inode";
const NAME: &str = "shared.name";
/// The first daemon needs no longer to make a folder one that is shared.
const MOMENT: Duration = Duration::from_secs(2);

fn path(root: &Path) -> PathBuf {
    root.join(PRIVATE).join(SHARED)
}

/// Is this the first daemon ever that shares the folder? Then `owner`, the folder's lock, is held, so that nobody else is, and no daemon that knows of no
/// other serves it alone.
///
/// # Errors
/// When a daemon serves it alone, or it cannot be locked.
pub(super) fn is_first(root: &Path, owner: &LockFile) -> Result<bool, FolderError> {
    let (path, asked) = (path(root), Instant::now());
    let is_there = || fsx::exists(&path).map_err(FolderError::unseen(&path));
    while !is_there()? {
        match owner.try_lock() {
            Ok(()) if !is_there()? => return Ok(true),
            Ok(()) => {
                owner.unlock().map_err(failed(&path, "cannot be locked"))?;
                return Ok(false);
            }
            // The first one has it, for a moment.
            Err(TryLockError::WouldBlock) if asked.elapsed() < MOMENT => std::thread::sleep(Duration::from_millis(10)),
            Err(TryLockError::WouldBlock) => return Err(FolderError::Owned { root: root.to_owned(), pid: None }),
            Err(TryLockError::Error(source)) => return Err(failed(&path, "cannot be locked")(source)),
        }
    }
    Ok(false)
}

/// Joins the daemons that share the folder, as long as the file lives. Whoever finds the file finds the folder's mark, too.
///
/// # Errors
/// When a daemon serves it alone, or it cannot be locked.
pub(super) fn join(root: &Path) -> Result<LockFile, FolderError> {
    let path = path(root);
    let file = LockFile::open(&path).map_err(failed(&path, "cannot be opened"))?;
    match file.try_lock_shared() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(FolderError::Owned { root: root.to_owned(), pid: None }),
        Err(TryLockError::Error(source)) => Err(failed(&path, "cannot be locked")(source)),
    }
}

/// Keeps out whoever would share the folder, as long as the file lives. `None`: it was never shared.
///
/// # Errors
/// When it is shared now, or cannot be locked.
pub(super) fn alone(root: &Path) -> Result<Option<LockFile>, FolderError> {
    let path = path(root);
    let Some(file) = LockFile::open_if_there(&path).map_err(failed(&path, "cannot be opened"))? else {
        return Ok(None);
    };
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Err(FolderError::Shared { root: root.to_owned() }),
        Err(TryLockError::Error(source)) => Err(failed(&path, "cannot be locked")(source)),
    }
}

/// Does this machine see the same numbers of files as the others, and does this daemon call the folder as they do? The first one notes both.
///
/// # Errors
/// When it does not.
pub(super) fn same_view(root: &Path, name: &str) -> Result<(), FolderError> {
    let (mark, noted) = (root.join(PRIVATE).join(MARK), root.join(PRIVATE).join(INODE));
    let seen = std::fs::metadata(&mark).map_err(FolderError::unseen(&mark))?.ino().to_string();
    if agreed(&noted, &seen)?.is_some() {
        return Err(FolderError::Numbers { root: root.to_owned(), noted });
    }
    let noted = root.join(PRIVATE).join(NAME);
    let other = agreed(&noted, name)?;
    other.map_or(Ok(()), |other| Err(FolderError::Called { root: root.to_owned(), name: name.to_owned(), other, noted }))
}

/// The text that another daemon noted, if it differs from `own`, which is noted where there is none.
fn agreed(noted: &Path, own: &str) -> Result<Option<String>, FolderError> {
    let read = || fsx::text_if_there(noted).map_err(FolderError::unseen(noted));
    let mut there = read()?;
    if there.is_none() {
        let written = create::replace(noted, format!("{own}\n").as_bytes());
        // Another daemon may have noted it in the same moment.
        there = read()?;
        if there.is_none() {
            written.map_err(failed(noted, "cannot be written"))?;
        }
    }
    Ok(there.map(|text| text.strip_suffix('\n').unwrap_or(&text).to_owned()).filter(|text| text != own))
}

/// Is the folder one that daemons on several machines serve, or last served?
///
/// # Errors
/// When that cannot be told.
pub(crate) fn is_for_many(root: &Path) -> io::Result<bool> {
    let Some(file) = LockFile::open_if_there(&path(root))? else { return Ok(false) };
    match file.try_lock_shared() {
        Ok(()) => Ok(true),
        // One serves it alone by now.
        Err(TryLockError::WouldBlock) => Ok(false),
        Err(TryLockError::Error(error)) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Ground;
    use super::*;

    /// One keeps it, any number visit, and none serves it alone meanwhile.
    #[test]
    fn a_shared_folder_has_one_keeper_and_is_nobodys_alone() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path();
        let (one, two) = (Ground::visit(root, "hot").unwrap(), Ground::visit(root, "hot").unwrap());
        assert!(one.try_keep().unwrap() && one.try_keep().unwrap());
        assert!(!two.try_keep().unwrap());
        assert!(matches!(Ground::take(root), Err(FolderError::Owned { .. })));
        two.check(root).unwrap();
        drop(one);
        assert!(matches!(Ground::take(root), Err(FolderError::Shared { .. })), "it has a visitor");
        assert!(two.try_keep().unwrap());
        drop(two);
        let alone = Ground::take(root).unwrap();
        assert!(matches!(Ground::visit(root, "hot"), Err(FolderError::Owned { .. })));
        drop(alone);
        Ground::visit(root, "hot").unwrap();
    }

    /// A daemon that serves it alone may have begun when nobody shared it.
    #[test]
    fn a_folder_that_one_serves_alone_is_not_shared() {
        let dir = tempfile::tempdir().unwrap();
        let alone = Ground::take(dir.path()).unwrap();
        for _ in 0..2 {
            assert!(matches!(Ground::visit(dir.path(), "hot"), Err(FolderError::Owned { .. })));
        }
        drop(alone);
        let one = Ground::visit(dir.path(), "hot").unwrap();
        assert!(one.try_keep().unwrap(), "nobody has it by then");
    }

    /// Daemons of a farm begin together, on a share that none of them knows: all of them see one mark.
    #[test]
    fn many_begin_together() {
        for _ in 0..10 {
            let dir = tempfile::tempdir().unwrap();
            let grounds: Vec<Ground> = std::thread::scope(|scope| {
                let all: Vec<_> = (0..8).map(|_| scope.spawn(|| Ground::visit(dir.path(), "hot").unwrap())).collect();
                all.into_iter().map(|one| one.join().unwrap()).collect()
            });
            let first = grounds[0].trace().clone();
            assert!(grounds.iter().all(|ground| *ground.trace() == first));
            assert!(first.leads_here(dir.path()).unwrap());
        }
    }

    /// As by a file system that numbers files on each machine anew.
    #[test]
    fn a_machine_that_sees_other_numbers_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        drop(Ground::visit(dir.path(), "hot").unwrap());
        std::fs::write(dir.path().join(".suture/shared.inode"), "7\n").unwrap();
        let refused = Ground::visit(dir.path(), "hot").unwrap_err();
        assert!(matches!(refused, FolderError::Numbers { .. }) && !refused.passes(), "{refused}");
        assert!(refused.to_string().contains("shared.inode"), "{refused}");
        std::fs::remove_file(dir.path().join(".suture/shared.inode")).unwrap();
        let refused = Ground::visit(dir.path(), "cold").unwrap_err().to_string();
        assert!(refused.contains("is called `hot` by the daemons that share it, and not `cold`"), "{refused}");
        Ground::visit(dir.path(), "hot").unwrap();
    }
}
