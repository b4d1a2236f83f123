//! Who may read and write a result: the mode of the original without execute bits, the group of the folder it stands in, and the owner
//! of the original where that is permitted. Never the mode of a temporary file.

use std::fs::{File, Metadata, Permissions};
use std::io;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::Path;

use rustix::fs::{Gid, Uid};

use crate::fsx;

/// Read and write, for owner, group and others.
const READ_WRITE: u32 = 0o666;

/// What a result made of one original gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Rights {
    mode: u32,
    uid: u32,
    /// Group of the original: who owned it could read what this group may read.
    gid: u32,
}

impl Rights {
    /// Of what is made of `original`.
    pub(crate) fn of(original: &Metadata) -> Self {
        Self { mode: original.mode() & READ_WRITE, uid: original.uid(), gid: original.gid() }
    }

    /// Gives them to a file that is to stand in `folder`, or, while that is not there, in the nearest folder above. What is not
    /// permitted (another owner, a group this process is no member of) is left as it is.
    ///
    /// # Errors
    /// As `chmod`.
    pub(crate) fn give(self, file: &File, folder: &Path) -> io::Result<()> {
        let now = file.metadata()?;
        let gid = folder.ancestors().map(existing).find_map(|above| std::fs::metadata(above).ok()).map_or(now.gid(), |m| m.gid());
        change_owner(file, &now, self.uid, gid);
        if now.mode() & 0o7777 != self.mode {
            file.set_permissions(Permissions::from_mode(self.mode))?;
        }
        Ok(())
    }

    /// The same by name.
    ///
    /// # Errors
    /// As `open` and `chmod`.
    pub(crate) fn give_named(self, path: &Path, folder: &Path) -> io::Result<()> {
        self.give(&File::open(path)?, folder)
    }

    /// Can whoever owned the original read the file?
    pub(crate) fn owner_can_read(self, file: &Metadata) -> bool {
        let (mode, same_group) = (file.mode(), file.gid() == self.gid);
        self.uid == 0 || (file.uid() == self.uid && mode & 0o400 != 0) || (same_group && mode & 0o040 != 0) || mode & 0o004 != 0
    }
}

/// A relative path's last ancestor is empty, and means the present folder.
fn existing(path: &Path) -> &Path {
    if path.as_os_str().is_empty() { Path::new(".") } else { path }
}

/// Owner and group as near to the wanted ones as permitted.
fn change_owner(file: &File, now: &Metadata, uid: u32, gid: u32) {
    let uid = (now.uid() != uid).then(|| Uid::from_raw(uid));
    let gid = (now.gid() != gid).then(|| Gid::from_raw(gid));
    if uid.is_some() && rustix::fs::fchown(file, uid, gid).is_ok() {
        return;
    }
    if gid.is_some() {
        let _ = rustix::fs::fchown(file, None, gid);
    }
}

/// Gives a copy of an original to who owned that, as far as permitted.
pub(crate) fn like_original(copy: &File, original: &Metadata) -> io::Result<()> {
    change_owner(copy, &copy.metadata()?, original.uid(), original.gid());
    copy.set_permissions(original.permissions())?;
    copy.set_modified(original.modified()?)
}

/// Makes a folder that is missing, with the group of the one it lies in.
///
/// # Errors
/// As `mkdir`.
pub(crate) fn make_folder(path: &Path) -> io::Result<()> {
    match std::fs::create_dir(path) {
        Err(e) if e.kind() == io::ErrorKind::AlreadyExists => return Ok(()),
        other => other?,
    }
    let (folder, above) = (File::open(path)?, std::fs::metadata(fsx::folder_of(path))?);
    change_owner(&folder, &folder.metadata()?, folder.metadata()?.uid(), above.gid());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(dir: &Path, name: &str, mode: u32) -> File {
        std::fs::write(dir.join(name), b"x").unwrap();
        let file = File::open(dir.join(name)).unwrap();
        file.set_permissions(Permissions::from_mode(mode)).unwrap();
        file
    }

    /// D9: neither 0644 for every file, nor what the umask thinks of it, nor the 0600 of a temporary file.
    #[test]
    fn a_result_has_the_mode_of_its_original_without_execute_bits() {
        let dir = tempfile::tempdir().unwrap();
        for (of_original, wanted) in [(0o600, 0o600), (0o664, 0o664), (0o755, 0o644), (0o640, 0o640), (0o4777, 0o666)] {
            let original = made(dir.path(), "original", of_original);
            let result = made(dir.path(), "result", 0o600);
            Rights::of(&original.metadata().unwrap()).give(&result, dir.path()).unwrap();
            assert_eq!(result.metadata().unwrap().mode() & 0o7777, wanted, "{of_original:o}");
        }
    }

    #[test]
    fn a_result_has_the_group_of_its_folder_and_the_owner_of_its_original_where_permitted() {
        let dir = tempfile::tempdir().unwrap();
        let (original, result) = (made(dir.path(), "original", 0o640), made(dir.path(), "result", 0o600));
        let root = rustix::process::geteuid().is_root();
        if root {
            rustix::fs::fchown(&original, Some(Uid::from_raw(4321)), Some(Gid::from_raw(1234))).unwrap();
            rustix::fs::chown(dir.path(), None, Some(Gid::from_raw(1111))).unwrap();
        }
        let rights = Rights::of(&original.metadata().unwrap());
        rights.give(&result, &dir.path().join("not/yet/there")).unwrap();
        let (given, folder) = (result.metadata().unwrap(), std::fs::metadata(dir.path()).unwrap());
        assert_eq!(given.gid(), folder.gid());
        assert_eq!(given.uid(), original.metadata().unwrap().uid());
        assert!(rights.owner_can_read(&given));
    }

    /// Another owner, another group, and nothing for others: the owner of the original is locked out, and that is to be said.
    #[test]
    fn a_result_that_the_owner_of_the_original_cannot_read_is_noticed() {
        let dir = tempfile::tempdir().unwrap();
        let file = made(dir.path(), "result", 0o640).metadata().unwrap();
        let stranger = Rights { mode: 0o640, uid: file.uid() + 1, gid: file.gid() + 1 };
        assert!(!stranger.owner_can_read(&file));
        assert!(Rights { gid: file.gid(), ..stranger }.owner_can_read(&file));
        assert!(Rights { uid: file.uid(), ..stranger }.owner_can_read(&file));
        assert!(stranger.owner_can_read(&made(dir.path(), "open", 0o644).metadata().unwrap()));
    }
}
