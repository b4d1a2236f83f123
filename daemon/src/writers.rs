//! Is someone writing to a file? A copier that sets the final size first, and then pauses, leaves a file that looks at rest: right in
//! length, the rest of it zeros. But it has the file open.

use std::collections::BTreeSet;
use std::fs::File;
use std::os::fd::AsRawFd;
use std::os::unix::fs::MetadataExt;

use crate::fsx::Identity;

/// What is known of who writes, for one round of looks.
#[derive(Default)]
pub(crate) struct Writers {
    /// Files that a process we can see has open for writing, by device and inode; asked for once, where the system does not tell.
    seen: Option<BTreeSet<(u64, u64)>>,
}

impl Writers {
    /// Has any process `file`, which is open for reading, open for writing?
    pub(crate) fn has(&mut self, file: &File, identity: &Identity) -> bool {
        match lease(file) {
            Lease::Granted => false,
            Lease::Refused => true,
            Lease::Unknown => self.seen.get_or_insert_with(open_for_writing).contains(&(identity.dev, identity.ino)),
        }
    }
}

/// `linux/fcntl.h`.
const F_SETSIG: libc::c_int = 10;

enum Lease {
    Granted,
    Refused,
    /// No leases here: another owner's file, a network file system.
    Unknown,
}

/// A read lease is granted only while no one has the file open for writing, on this machine (`fcntl(2)`). It is given back at once.
fn lease(file: &File) -> Lease {
    let fd = file.as_raw_fd();
    // Should someone open the file in between, the system tells us by a signal: one that does nothing, instead of one that kills.
    // SAFETY: `fd` is open while `file` is borrowed; these commands take and give integers.
    let granted =
        unsafe { libc::fcntl(fd, F_SETSIG, libc::SIGURG) == 0 && libc::fcntl(fd, libc::F_SETLEASE, libc::F_RDLCK) == 0 };
    if granted {
        // SAFETY: as above.
        unsafe { libc::fcntl(fd, libc::F_SETLEASE, libc::F_UNLCK) };
        return Lease::Granted;
    }
    match std::io::Error::last_os_error().raw_os_error() {
        Some(libc::EAGAIN) => Lease::Refused,
        _ => Lease::Unknown,
    }
}

/// All files that processes we can see have open for writing.
fn open_for_writing() -> BTreeSet<(u64, u64)> {
    let processes = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let numbered = processes.filter(|entry| entry.file_name().to_string_lossy().bytes().all(|b| b.is_ascii_digit()));
    numbered.flat_map(|entry| written_by(&entry.path())).collect()
}

fn written_by(process: &std::path::Path) -> Vec<(u64, u64)> {
    let descriptors = std::fs::read_dir(process.join("fd")).into_iter().flatten().flatten();
    descriptors
        .filter_map(|fd| {
            let info = std::fs::read_to_string(process.join("fdinfo").join(fd.file_name())).ok()?;
            let flags = info.lines().find_map(|line| line.strip_prefix("flags:"))?;
            let flags = i32::from_str_radix(flags.trim(), 8).ok()?;
            if flags & libc::O_ACCMODE == libc::O_RDONLY {
                return None;
            }
            std::fs::metadata(fd.path()).ok().filter(std::fs::Metadata::is_file).map(|meta| (meta.dev(), meta.ino()))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// D6: both ways of asking agree, before, while and after someone writes.
    #[test]
    fn a_writer_is_noticed() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("part.stl");
        let writer = File::create(&path).unwrap();
        let reader = File::open(&path).unwrap();
        let identity = Identity::of(&path).unwrap();
        let inode = (identity.dev, identity.ino);
        assert!(Writers::default().has(&reader, &identity));
        assert!(open_for_writing().contains(&inode));
        drop(writer);
        assert!(!Writers::default().has(&reader, &identity));
        assert!(!open_for_writing().contains(&inode));
        // Nothing is left behind that a writer would have to wait for.
        File::options().write(true).open(&path).unwrap();
    }
}
