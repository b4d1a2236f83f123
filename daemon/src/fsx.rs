//! The file system as this program uses it: nothing is overwritten, everything is synced, and names may be any bytes.

use std::ffi::{OsStr, OsString};
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use rustix::fs::{AtFlags, CWD, Gid, RenameFlags};
use serde::{Deserialize, Serialize};

/// Longest file name in bytes on the file systems we meet.
const NAME_MAX: usize = 255;

/// What tells whether a file is still the one that was looked at. Renaming and linking change `ctime`, so it is compared only
/// between two looks with neither in between.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Identity {
    pub dev: u64,
    pub ino: u64,
    pub size: u64,
    pub mtime_ns: i128,
    pub ctime_ns: i128,
}

impl From<&std::fs::Metadata> for Identity {
    fn from(m: &std::fs::Metadata) -> Self {
        let ns = |seconds: i64, nanos: i64| i128::from(seconds) * 1_000_000_000 + i128::from(nanos);
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

/// A name in `folder` that no one else uses, and that every scan ignores.
pub(crate) fn temporary_in(folder: &Path) -> PathBuf {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    let n = NEXT.fetch_add(1, Ordering::Relaxed);
    folder.join(format!(".suture-{}-{n}.tmp", std::process::id()))
}

/// Writes `value` as JSON, with a final newline, into a new synced file.
///
/// # Errors
/// As [`write_new`].
pub(crate) fn write_new_json<T: Serialize>(path: &Path, value: &T) -> io::Result<()> {
    let file = OpenOptions::new().write(true).create_new(true).open(path)?;
    let mut out = io::BufWriter::new(file);
    serde_json::to_writer_pretty(&mut out, value)?;
    out.write_all(b"\n")?;
    out.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
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

/// Gives a new file its folder's group and the mode of any new file here, whatever its maker's taste.
///
/// # Errors
/// As `chmod`. A group we may not give is left as it is.
pub(crate) fn fit_in(path: &Path, folder: &Path) -> io::Result<()> {
    let (file, parent) = (std::fs::symlink_metadata(path)?, std::fs::metadata(folder)?);
    if file.gid() != parent.gid() {
        // Not a member of that group, or a file system without owners.
        let _ = rustix::fs::chown(path, None, Some(Gid::from_raw(parent.gid())));
    }
    let mode = 0o644 & !umask();
    if file.mode() & 0o7777 != mode {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode))?;
    }
    Ok(())
}

/// The process's file mode mask, read without changing it (another thread may be creating a file).
fn umask() -> u32 {
    static MASK: OnceLock<u32> = OnceLock::new();
    *MASK.get_or_init(|| {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let mask = status.lines().find_map(|line| line.strip_prefix("Umask:"));
        mask.and_then(|mask| u32::from_str_radix(mask.trim(), 8).ok()).unwrap_or(0o022)
    })
}

/// `part.stl`, `part~2.stl`, `part~3.stl`, …: the `n`-th name for a file, `n` from 1, with `suffix` appended; cut to what a
/// name may be long.
pub(crate) fn versioned(name: &OsStr, n: u32, suffix: &str) -> OsString {
    let path = Path::new(name);
    let stem = path.file_stem().unwrap_or(name).as_bytes();
    let tilde = if n > 1 { format!("~{n}") } else { String::new() };
    let extension = path.extension().map_or_else(Vec::new, |e| [b".", e.as_bytes()].concat());
    let room = NAME_MAX.saturating_sub(tilde.len() + extension.len() + suffix.len());
    let mut end = stem.len().min(room);
    // Cut between characters where it is text.
    while end < stem.len() && end > 0 && stem.get(end).is_some_and(|b| b & 0xC0 == 0x80) {
        end -= 1;
    }
    let stem = stem.get(..end).unwrap_or(stem);
    OsString::from_vec([stem, tilde.as_bytes(), &extension, suffix.as_bytes()].concat())
}

/// Is there anything of that name, be it a dangling link?
pub(crate) fn exists(path: &Path) -> bool {
    std::fs::symlink_metadata(path).is_ok()
}
