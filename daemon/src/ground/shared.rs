//! A hot folder that daemons on several machines serve, on a share of a network. One of them at a time *keeps* it: that one has the folder's lock, looks
//! for drops, and does all that one has to do alone. The others *visit* it: they work on its jobs. When the keeper is gone, another one takes the lock.
//!
//! `.suture/shared` is locked by all of them together, and against them by a daemon that serves the folder alone. `.suture/shared.inode` is the number
//! that the first of them saw of the folder's mark: jobs tell files by their numbers, so every machine must see the same.

use std::fs::TryLockError;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use crate::create::{self, LockFile};
use crate::folder_error::{FolderError, failed};
use crate::fsx;
use crate::parts::{MARK, PRIVATE};

const SHARED: &str = "shared";
const INODE: &str = "shared.inode";

fn path(root: &Path) -> PathBuf {
    root.join(PRIVATE).join(SHARED)
}

/// Joins the daemons that share the folder, as long as the file lives. `owner` is the folder's lock: the first one of them has it meanwhile, so that no
/// daemon serves the folder alone that knew of none.
///
/// # Errors
/// When a daemon serves it alone, or it cannot be locked.
pub(super) fn join(root: &Path, owner: &LockFile) -> Result<LockFile, FolderError> {
    let path = path(root);
    let is_there = || fsx::exists(&path).map_err(FolderError::unseen(&path));
    let is_first = !is_there()?;
    if is_first {
        match owner.try_lock() {
            Ok(()) => {}
            // One that came just before has it, or one that serves the folder alone.
            Err(TryLockError::WouldBlock) if is_there()? => {}
            Err(TryLockError::WouldBlock) => return Err(FolderError::Owned { root: root.to_owned(), pid: None }),
            Err(TryLockError::Error(source)) => return Err(failed(&path, "cannot be locked")(source)),
        }
    }
    let file = LockFile::open(&path).map_err(failed(&path, "cannot be opened"))?;
    let locked = file.try_lock_shared();
    if is_first {
        // What cannot be given back is kept, until whoever asks ends.
        let _ = owner.unlock();
    }
    match locked {
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

/// Does this machine see the same numbers of files as the others? The first one notes what it sees.
///
/// # Errors
/// When it does not.
pub(super) fn same_numbers(root: &Path) -> Result<(), FolderError> {
    let (mark, noted) = (root.join(PRIVATE).join(MARK), root.join(PRIVATE).join(INODE));
    let seen = std::fs::metadata(&mark).map_err(FolderError::unseen(&mark))?.ino();
    let others = fsx::text_if_there(&noted).map_err(FolderError::unseen(&noted))?;
    match others.map(|text| text.trim().parse() == Ok(seen)) {
        Some(true) => Ok(()),
        Some(false) => Err(FolderError::Numbers { root: root.to_owned(), noted }),
        None => create::replace(&noted, format!("{seen}\n").as_bytes()).map_err(failed(&noted, "cannot be written")),
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
        let (mut one, mut two) = (Ground::visit(root).unwrap(), Ground::visit(root).unwrap());
        assert!(one.try_keep().unwrap() && one.try_keep().unwrap());
        assert!(!two.try_keep().unwrap());
        assert!(matches!(Ground::take(root), Err(FolderError::Owned { .. })));
        two.check(root).unwrap();
        drop(one);
        assert!(matches!(Ground::take(root), Err(FolderError::Shared { .. })), "it has a visitor");
        assert!(two.try_keep().unwrap());
        drop(two);
        let alone = Ground::take(root).unwrap();
        assert!(matches!(Ground::visit(root), Err(FolderError::Owned { .. })));
        drop(alone);
        Ground::visit(root).unwrap();
    }

    /// One that serves it alone may have begun when nobody shared it.
    #[test]
    fn a_folder_that_one_serves_alone_is_not_shared() {
        let dir = tempfile::tempdir().unwrap();
        let alone = Ground::take(dir.path()).unwrap();
        for _ in 0..2 {
            assert!(matches!(Ground::visit(dir.path()), Err(FolderError::Owned { .. })));
        }
        drop(alone);
        let mut one = Ground::visit(dir.path()).unwrap();
        assert!(one.try_keep().unwrap(), "nobody has it by then");
    }

    /// As by a file system that numbers files on each machine anew.
    #[test]
    fn a_machine_that_sees_other_numbers_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        drop(Ground::visit(dir.path()).unwrap());
        std::fs::write(dir.path().join(".suture/shared.inode"), "7\n").unwrap();
        let refused = Ground::visit(dir.path()).unwrap_err();
        assert!(matches!(refused, FolderError::Numbers { .. }) && !refused.passes(), "{refused}");
        assert!(refused.to_string().contains("shared.inode"), "{refused}");
    }
}
