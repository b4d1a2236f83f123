//! The only place of this program that opens anything for writing. Each file is new: it did not exist before, no link is followed,
//! and nothing is ever truncated, so that no original, nor anything linked to one, can be written to. A test searches the sources for
//! every other way to write.

use std::ffi::{CStr, OsString};
use std::fs::{File, Metadata, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use rustix::fs::{CWD, Mode, OFlags};
use serde::Serialize;

use crate::fsx;
use crate::rights;

/// A file that this call makes; an existing one, or a link of that name, is an error of kind `AlreadyExists`.
///
/// # Errors
/// As `open`.
pub(crate) fn create(path: &Path) -> io::Result<File> {
    OpenOptions::new().write(true).create_new(true).custom_flags(flags(OFlags::NOFOLLOW)).open(path)
}

/// The same for a name of this program's own: what an interrupted run left under it is unlinked first.
///
/// # Errors
/// As `unlink` and `open`.
pub(crate) fn create_anew(path: &Path) -> io::Result<File> {
    fsx::remove_if_there(path)?;
    create(path)
}

/// A file without a name in `folder`.
///
/// # Errors
/// As `open`; file systems that know nothing of it have several ways to say so.
pub(crate) fn nameless(folder: &Path) -> rustix::io::Result<File> {
    let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
    rustix::fs::open(folder, flags, Mode::RUSR | Mode::WUSR).map(File::from)
}

/// Writes a new file whole and synced.
///
/// # Errors
/// As [`create`], `write` and `fsync`.
pub(crate) fn write_new(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Gives a small file of this program's own a new content: a new file takes its name.
///
/// # Errors
/// As [`write_new`] and `rename`.
pub(crate) fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".tmp");
    let temporary = path.with_file_name(name);
    let mut file = create_anew(&temporary)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    std::fs::rename(&temporary, path)
}

/// Writes a file that a person asked for, whole or not at all; what has the name is replaced only by force.
///
/// # Errors
/// As [`write_new`] and `rename`; [`io::ErrorKind::AlreadyExists`] where the name is taken.
pub(crate) fn place(path: &Path, bytes: &[u8], force: bool) -> io::Result<()> {
    if force {
        return replace(path, bytes);
    }
    let temporary = temporary_in(fsx::folder_of(path));
    let placed = write_new(&temporary, bytes).and_then(|()| fsx::rename_new(&temporary, path));
    if placed.is_err() {
        let _ = fsx::remove_if_there(&temporary);
    }
    placed
}

/// Makes an empty file that need not survive the machine; one that is there already will do.
///
/// # Errors
/// As `open`.
pub(crate) fn mark(path: &Path) -> io::Result<()> {
    match create(path) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => Err(error),
        _ => Ok(()),
    }
}

/// The same in a signal handler: one system call, nothing allocated, no lock taken.
pub(crate) fn mark_in_handler(name: &CStr) {
    let flags = OFlags::CREATE | OFlags::EXCL | OFlags::NOFOLLOW | OFlags::WRONLY | OFlags::CLOEXEC;
    // Whoever looks for the file can do without it.
    let _ = rustix::fs::openat(CWD, name, flags, Mode::RUSR | Mode::WUSR);
}

/// Writes `value` as JSON, with a final newline, into a new file; synced if `sync` says so. A nameless file that is open elsewhere, and
/// known by a path below `/proc`, is as good as a new one.
///
/// # Errors
/// As [`write_new`].
pub(crate) fn write_new_json<T: Serialize>(path: &Path, value: &T, sync: bool) -> io::Result<()> {
    let file = if path.starts_with("/proc") { OpenOptions::new().write(true).open(path)? } else { create(path)? };
    let mut out = io::BufWriter::new(file);
    serde_json::to_writer_pretty(&mut out, value)?;
    out.write_all(b"\n")?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    if sync { file.sync_all() } else { Ok(()) }
}

/// Copies an open file into a new one, sharing its blocks where the file system can; last modification and, as far as permitted,
/// owner and mode are the original's. Not synced.
///
/// # Errors
/// As [`create_anew`], `read` and `write`. A part that was written goes away.
pub(crate) fn copy_new(from: &File, to: &Path) -> io::Result<File> {
    let copy = copy_content(from, to)?;
    match from.metadata().and_then(|original| rights::like_original(&copy, &original)) {
        Ok(()) => Ok(copy),
        Err(error) => {
            let _ = fsx::remove_if_there(to);
            Err(error)
        }
    }
}

/// The same without the original's time, owner and mode.
///
/// # Errors
/// As [`copy_new`].
pub(crate) fn copy_content(mut from: &File, to: &Path) -> io::Result<File> {
    let mut copy = create_anew(to)?;
    if rustix::fs::ioctl_ficlone(&copy, from).is_ok() {
        return Ok(copy);
    }
    match io::copy(&mut from, &mut copy) {
        Ok(_) => Ok(copy),
        Err(error) => {
            let _ = fsx::remove_if_there(to);
            Err(error)
        }
    }
}

/// A file that can be locked, and not written to: it is open for writing, which an exclusive lock needs on NFS (flock(2)), and nothing of it shows that.
#[derive(Debug)]
pub(crate) struct LockFile(File);

impl LockFile {
    /// Opens one, made when missing.
    ///
    /// # Errors
    /// As `open`.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        mark(path)?;
        Self::of(path)
    }

    /// Opens one that is there.
    ///
    /// # Errors
    /// As `open`.
    pub(crate) fn open_if_there(path: &Path) -> io::Result<Option<Self>> {
        fsx::if_there(Self::of(path))
    }

    fn of(path: &Path) -> io::Result<Self> {
        let flags = flags(OFlags::NOFOLLOW | OFlags::NONBLOCK);
        match OpenOptions::new().read(true).write(true).custom_flags(flags).open(path) {
            // Another user's: on a local file system the right to read does for a lock.
            Err(error) if error.kind() == io::ErrorKind::PermissionDenied => open_to_read(path).map(Self),
            opened => opened.map(Self),
        }
    }

    /// Locks it against everyone else.
    ///
    /// # Errors
    /// As `flock`.
    pub(crate) fn try_lock(&self) -> Result<(), TryLockError> {
        self.0.try_lock()
    }

    /// Lets go of it.
    ///
    /// # Errors
    /// As `flock`.
    pub(crate) fn unlock(&self) -> io::Result<()> {
        self.0.unlock()
    }

    /// Locks it with others.
    ///
    /// # Errors
    /// As `flock`.
    pub(crate) fn try_lock_shared(&self) -> Result<(), TryLockError> {
        self.0.try_lock_shared()
    }

    /// As `fstat`.
    ///
    /// # Errors
    /// As `fstat`.
    pub(crate) fn metadata(&self) -> io::Result<Metadata> {
        self.0.metadata()
    }
}

/// Opens what is there for reading, and for nothing else. A link of that name is not followed, a pipe not waited for.
///
/// # Errors
/// As `open`.
pub(crate) fn open_to_read(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).custom_flags(flags(OFlags::NOFOLLOW | OFlags::NONBLOCK)).open(path)
}

/// Tells the kernel something about this process, through a file of `/proc/self`.
///
/// # Errors
/// As `open` and `write`.
pub(crate) fn tell_kernel(name: &str, text: &str) -> io::Result<()> {
    OpenOptions::new().write(true).open(Path::new("/proc/self").join(name))?.write_all(text.as_bytes())
}

/// A name in `folder` that no one else uses, and that every scan ignores.
pub(crate) fn temporary_in(folder: &Path) -> PathBuf {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    loop {
        let n = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = folder.join(OsString::from(format!(".suture-{}-{n}.tmp", std::process::id())));
        // An earlier process of that number may have been killed over it.
        if !fsx::exists(&name).unwrap_or(false) {
            return name;
        }
    }
}

/// As the standard library takes them: small positive constants.
fn flags(flags: OFlags) -> i32 {
    flags.bits() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// D1: no way to write goes to what is there already, be it a file, a link to one, or a second name of it.
    #[test]
    fn nothing_that_exists_is_opened_for_writing() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::write(at("original"), b"customer's").unwrap();
        std::fs::hard_link(at("original"), at("link")).unwrap();
        std::os::unix::fs::symlink(at("original"), at("symlink")).unwrap();
        std::os::unix::fs::symlink(at("nowhere"), at("dangling")).unwrap();
        for name in ["original", "link", "symlink", "dangling"] {
            let path = at(name);
            assert_eq!(create(&path).unwrap_err().kind(), io::ErrorKind::AlreadyExists, "{name}");
            assert_eq!(write_new(&path, b"x").unwrap_err().kind(), io::ErrorKind::AlreadyExists, "{name}");
            assert!(write_new_json(&path, &1, false).is_err(), "{name}");
            mark(&path).unwrap();
        }
        // What a process that was killed left of it is in no one's way.
        std::fs::write(at(".link.tmp"), b"half").unwrap();
        replace(&at("link"), b"ours").unwrap();
        assert_eq!(std::fs::read(at("link")).unwrap(), b"ours");
        create_anew(&at("symlink")).unwrap();
        let other = File::open(at("link")).unwrap();
        std::fs::hard_link(at("original"), at("again")).unwrap();
        copy_new(&other, &at("again")).unwrap();
        assert_eq!(std::fs::read(at("again")).unwrap(), b"ours");
        assert_eq!(std::fs::read(at("original")).unwrap(), b"customer's");
        assert!(!at("nowhere").exists());
    }

    #[test]
    fn a_copy_has_content_and_time_of_the_original() {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a"), dir.path().join("b"));
        std::fs::write(&a, vec![7; 100_000]).unwrap();
        let from = File::open(&a).unwrap();
        let copy = copy_new(&from, &b).unwrap();
        assert_eq!(std::fs::read(&b).unwrap(), vec![7; 100_000]);
        assert_eq!(copy.metadata().unwrap().modified().unwrap(), from.metadata().unwrap().modified().unwrap());
    }

    /// Every other module of the program, and every line of it that could open a file for writing or make a second name of one.
    #[test]
    fn no_other_module_opens_anything_for_writing() {
        const WAYS: [&str; 13] = [
            "OpenOptions",
            "File::options",
            "File::create",
            "fs::write",
            "fs::copy",
            "hard_link",
            "linkat",
            "rustix::fs::open",
            ".set_len(",
            "ftruncate",
            "truncate(",
            "fallocate",
            "copy_file_range",
        ];
        // Where a second name is made of a file that has none (`draft`), or of an original (`claim`, `fsx::rename_new`).
        const NAMES_ONLY: [(&str, &str); 3] = [("claim.rs", "linkat"), ("draft.rs", "linkat"), ("fsx.rs", "linkat")];
        let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let mut files = 0;
        for entry in std::fs::read_dir(&sources).unwrap().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            // The folders hold tests.
            let Ok(text) = std::fs::read_to_string(entry.path()) else { continue };
            let product = text.split("#[cfg(test)]\nmod tests").next().unwrap();
            files += 1;
            for (line, way) in product.lines().flat_map(|line| WAYS.map(|way| (line, way))) {
                let allowed = name == "create.rs" || NAMES_ONLY.contains(&(name.as_str(), way));
                assert!(allowed || !line.contains(way), "{name} may write: {line}");
            }
        }
        assert!(files > 25, "the sources were not found");
    }
}
