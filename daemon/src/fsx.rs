//! Names in the file system as this program uses them: nothing is overwritten, everything is synced, and names may be any bytes.
//! What is written is written by [`crate::create`].

use std::ffi::{OsStr, OsString};
use std::fs::{File, Metadata};
use std::io;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use rustix::fs::{AtFlags, CWD, RenameFlags};
use serde::{Deserialize, Serialize};
use suture_store::Hash;

/// Longest file name in bytes on the file systems we meet.
pub(crate) const NAME_MAX: usize = 255;

/// The device of a file on a share, as a job notes it: none, since each machine has a number of its own for it.
pub(crate) const NO_DEVICE: u64 = 0;

/// What tells whether a file is still the one that was looked at. Renaming and linking change `ctime`, so it is compared only
/// between two looks with neither in between.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Identity {
    pub dev: u64,
    pub ino: u64,
    pub size: u64,
    pub mtime_ns: i64,
    pub ctime_ns: i64,
}

impl Identity {
    /// Of the name itself: a symbolic link is not followed.
    ///
    /// # Errors
    /// As `lstat`.
    pub(crate) fn of(path: &Path) -> io::Result<Self> {
        Ok(Self::from(&std::fs::symlink_metadata(path)?))
    }

    /// The same, seen under the same path, where the file system may have been mounted anew in between: as another device.
    pub(crate) fn same_but_for_device(&self, other: &Self) -> bool {
        (self.ino, self.size, self.mtime_ns) == (other.ino, other.size, other.mtime_ns)
    }

    /// The same file with the same content, as far as can be told when it was renamed in between.
    pub(crate) fn same_content(&self, other: &Self) -> bool {
        (self.dev, self.ino, self.size, self.mtime_ns) == (other.dev, other.ino, other.size, other.mtime_ns)
    }
}

impl From<&Metadata> for Identity {
    fn from(m: &Metadata) -> Self {
        let ns = |seconds: i64, nanos: i64| seconds.saturating_mul(1_000_000_000).saturating_add(nanos);
        Self {
            dev: m.dev(),
            ino: m.ino(),
            size: m.size(),
            mtime_ns: ns(m.mtime(), m.mtime_nsec()),
            ctime_ns: ns(m.ctime(), m.ctime_nsec()),
        }
    }
}

/// Renames within a file system; an existing `to` is an error of kind `AlreadyExists`, never replaced.
///
/// # Errors
/// As `renameat2`; on file systems without it, as `link` and `unlink`.
pub(crate) fn rename_new(from: &Path, to: &Path) -> io::Result<()> {
    use rustix::io::Errno;
    match rustix::fs::renameat_with(CWD, from, CWD, to, RenameFlags::NOREPLACE) {
        Err(Errno::INVAL | Errno::NOSYS | Errno::NOTSUP) => {
            // No such flag here (NFS, some FUSE): a link never replaces either. A crash in between leaves both names of one
            // file, which recovery takes for published.
            rustix::fs::linkat(CWD, from, CWD, to, AtFlags::empty())?;
            Ok(rustix::fs::unlink(from)?)
        }
        other => Ok(other?),
    }
}

/// Makes the folder's entries durable.
///
/// # Errors
/// As `open` and `fsync`.
pub(crate) fn sync_dir(path: &Path) -> io::Result<()> {
    File::open(path)?.sync_all()
}

/// The folder a path stands in (`.` for a bare name).
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Removes a file that may be gone already.
///
/// # Errors
/// As `unlink`.
pub(crate) fn remove_if_there(path: &Path) -> io::Result<()> {
    match std::fs::remove_file(path) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => Err(e),
        _ => Ok(()),
    }
}

/// BLAKE3 of a file's bytes. Reads, never maps: the file may be cut short meanwhile.
///
/// # Errors
/// As `open` and `read`.
pub(crate) fn hash(path: &Path) -> io::Result<Hash> {
    hash_of(&File::open(path)?)
}

/// The same of a file that is open, from where its handle stands.
///
/// # Errors
/// As `read`.
pub(crate) fn hash_of(file: &File) -> io::Result<Hash> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(file)?;
    Ok(Hash(*hasher.finalize().as_bytes()))
}

/// Bytes that may still be written to a folder's file system when `reserve` bytes, but at most a twentieth of it, are to stay
/// free; boundless where the file system does not say.
pub(crate) fn free_space(folder: &Path, reserve: u64) -> u64 {
    let Ok(fs) = rustix::fs::statvfs(folder) else { return u64::MAX };
    let reserve = reserve.min(fs.f_blocks.saturating_mul(fs.f_frsize) / 20);
    fs.f_bavail.saturating_mul(fs.f_frsize).saturating_sub(reserve)
}

/// Does the folder lie on a network or user-space file system, whose changes the kernel does not tell us of?
pub(crate) fn needs_polling(folder: &Path) -> bool {
    // The field's type differs between platforms; the magic numbers are 32 bits wide.
    rustix::fs::statfs(folder).is_ok_and(|fs| is_remote(fs.f_type as u32))
}

/// Is that the magic number of a file system that others change behind the kernel's back?
fn is_remote(f_type: u32) -> bool {
    // By `linux/magic.h` and the file systems' own headers.
    const REMOTE: [u32; 18] = [
        0x6969,      // NFS
        0x517B,      // SMB
        0xFE53_4D42, // SMB2
        0xFF53_4D42, // CIFS
        0x6573_5546, // FUSE
        0x0102_1997, // 9P
        0x00C3_6400, // Ceph
        0x5346_414F, // OpenAFS
        0x6B41_4653, // AFS
        0x7375_7245, // Coda
        0x564C,      // NCP
        0x7461_636F, // OCFS2
        0x0116_1970, // GFS2
        0x0BD0_0BD0, // Lustre
        0x4750_4653, // GPFS
        0x1983_0326, // BeeGFS
        0x786F_4256, // folders of a VirtualBox host
        0xBACB_ACBC, // folders of a VMware host
    ];
    REMOTE.contains(&f_type)
}

/// `part.stl`, `part~2.stl`, `part~3.stl`, …: the `n`-th name for a file, `n` from 1, cut so that `reserve` more bytes fit into
/// what a name may be long.
pub(crate) fn versioned(name: &OsStr, n: u32, reserve: usize) -> OsString {
    let path = Path::new(name);
    let stem = path.file_stem().unwrap_or(name).as_bytes();
    let tilde = if n > 1 { format!("~{n}") } else { String::new() };
    let extension = path.extension().map_or_else(Vec::new, |e| [b".", e.as_bytes()].concat());
    let room = NAME_MAX.saturating_sub(tilde.len() + extension.len() + reserve);
    let mut end = stem.len().min(room);
    // Cut between characters where it is text.
    while end < stem.len() && end > 0 && stem.get(end).is_some_and(|b| b & 0xC0 == 0x80) {
        end -= 1;
    }
    let stem = stem.get(..end).unwrap_or(stem);
    OsString::from_vec([stem, tilde.as_bytes(), &extension].concat())
}

/// The answer of a call; `None` where the system says that nothing is there. An error is no absence.
///
/// # Errors
/// The call's, all others.
pub(crate) fn if_there<T>(answer: io::Result<T>) -> io::Result<Option<T>> {
    match answer {
        Ok(there) => Ok(Some(there)),
        Err(e) if matches!(e.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => Ok(None),
        Err(e) => Err(e),
    }
}

/// What is under that name, be it a dangling link; `None` where there is nothing. That nothing is there is said by the system, never
/// taken from an error.
///
/// # Errors
/// As `lstat`.
pub(crate) fn look(path: &Path) -> io::Result<Option<Identity>> {
    if_there(Identity::of(path))
}

/// The file or folder that the path leads to, links followed; `None` where that is nothing.
///
/// # Errors
/// As `stat`.
pub(crate) fn behind(path: &Path) -> io::Result<Option<Metadata>> {
    if_there(std::fs::metadata(path))
}

/// The text in a file; `None` where there is no such file.
///
/// # Errors
/// As `open` and `read`, and when it is no text.
pub(crate) fn text_if_there(path: &Path) -> io::Result<Option<String>> {
    if_there(std::fs::read_to_string(path))
}

/// Does the path lead to a folder?
///
/// # Errors
/// As [`behind`].
pub(crate) fn is_folder(path: &Path) -> io::Result<bool> {
    Ok(behind(path)?.is_some_and(|found| found.is_dir()))
}

/// Does the path lead to a regular file?
///
/// # Errors
/// As [`behind`].
pub(crate) fn is_file(path: &Path) -> io::Result<bool> {
    Ok(behind(path)?.is_some_and(|found| found.is_file()))
}

/// Is there anything of that name?
///
/// # Errors
/// As [`look`].
pub(crate) fn exists(path: &Path) -> io::Result<bool> {
    Ok(look(path)?.is_some())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::create;

    /// As `statfs` says them: of what others change, and of disks and memory here.
    #[test]
    fn f18_what_others_change_is_polled() {
        for remote in [0x6969, 0xFE53_4D42, 0xFF53_4D42, 0x6573_5546, 0x0102_1997, 0x786F_4256] {
            assert!(is_remote(remote), "{remote:x}");
        }
        // ext4, XFS, Btrfs, tmpfs, overlay, F2FS, ZFS, exFAT, NTFS.
        for here in
            [0xEF53, 0x5846_5342, 0x9123_683E, 0x0102_1994, 0x794C_7630, 0xF2F5_2010, 0x2FC1_2FC1, 0x2011_BAB0, 0x5346_544E]
        {
            assert!(!is_remote(here), "{here:x}");
        }
        assert!(!needs_polling(Path::new("/proc")) && !needs_polling(Path::new("/nowhere/at/all")));
    }

    #[test]
    fn renaming_never_replaces() {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a"), dir.path().join("b"));
        create::write_new(&a, b"new").unwrap();
        create::write_new(&b, b"old").unwrap();
        assert_eq!(rename_new(&a, &b).unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(std::fs::read(&b).unwrap(), b"old");
        std::fs::remove_file(&b).unwrap();
        rename_new(&a, &b).unwrap();
        assert_eq!(std::fs::read(&b).unwrap(), b"new");
        assert!(!exists(&a).unwrap());
    }

    #[test]
    fn f23_names_count_up_and_fit() {
        assert_eq!(versioned(OsStr::new("part.stl"), 1, 12), "part.stl");
        assert_eq!(versioned(OsStr::new("part.stl"), 2, 12), "part~2.stl");
        assert_eq!(versioned(OsStr::new("part.STL"), 3, 12), "part~3.STL");
        assert_eq!(versioned(OsStr::new("part"), 2, 0), "part~2");
        let long = OsString::from(format!("{}.stl", "ä".repeat(125)));
        let cut = versioned(&long, 12, 20);
        assert!(cut.len() + 20 <= NAME_MAX);
        assert!(cut.to_str().unwrap().ends_with("ä~12.stl"), "cut between characters, extension kept");
        let odd = OsString::from_vec([vec![0xE9; 251], b".stl".to_vec()].concat());
        assert_eq!(versioned(&odd, 2, 0).len(), NAME_MAX);
    }

    #[test]
    fn identity_survives_a_rename_but_not_a_write() {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a"), dir.path().join("b"));
        create::write_new(&a, b"x").unwrap();
        let before = Identity::of(&a).unwrap();
        rename_new(&a, &b).unwrap();
        assert!(before.same_content(&Identity::of(&b).unwrap()));
        std::fs::write(&b, b"longer").unwrap();
        assert!(!before.same_content(&Identity::of(&b).unwrap()));
    }
}
