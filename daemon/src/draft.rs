//! A file in the making that has no name until it is whole: whatever ends this process or its worker, nothing half-written is
//! left, not even a temporary name. (`O_TMPFILE`; where a file system has no such thing, a hidden temporary name that is removed.)

use std::fs::File;
use std::io;
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};

use rustix::fs::{AtFlags, CWD};
use rustix::io::Errno;

use crate::create;
use crate::fsx;
use crate::rights::Rights;

/// An unfinished file in a folder. Dropping it makes it go away.
pub(crate) struct Draft {
    kind: Kind,
    folder: PathBuf,
}

enum Kind {
    Nameless(File),
    Named(PathBuf),
}

impl Draft {
    /// A new one, to be placed in `folder`.
    ///
    /// # Errors
    /// As `open`.
    pub(crate) fn new(folder: &Path) -> io::Result<Self> {
        let kind = match create::nameless(folder) {
            Ok(file) => Kind::Nameless(file),
            // How file systems (and old kernels) say that they know nothing of it.
            Err(Errno::OPNOTSUPP | Errno::ISDIR | Errno::INVAL | Errno::NOENT) if fsx::is_folder(folder)? => {
                Kind::Named(create::temporary_in(folder))
            }
            Err(error) => return Err(error.into()),
        };
        Ok(Self { kind, folder: folder.to_owned() })
    }

    /// Where another process of the same user can open it for writing, as long as this value lives. Under a temporary name nothing is
    /// there yet.
    pub(crate) fn path(&self) -> PathBuf {
        match &self.kind {
            Kind::Nameless(file) => format!("/proc/{}/fd/{}", std::process::id(), file.as_raw_fd()).into(),
            Kind::Named(path) => path.clone(),
        }
    }

    /// An error's line, with the name that the draft is to have instead of its own, which says nothing to anybody.
    pub(crate) fn told(&self, error: &suture_core::Error, output: &Path) -> String {
        error.to_string().replace(&*self.path().display().to_string(), &output.display().to_string())
    }

    /// Has anything been written?
    pub(crate) fn is_written(&self) -> bool {
        match &self.kind {
            Kind::Nameless(file) => file.metadata().is_ok_and(|m| m.len() > 0),
            Kind::Named(path) => fsx::exists(path).unwrap_or(false),
        }
    }

    /// Makes its content durable.
    ///
    /// # Errors
    /// As `fsync`.
    pub(crate) fn sync(&self) -> io::Result<()> {
        match &self.kind {
            Kind::Nameless(file) => file.sync_all(),
            Kind::Named(path) => File::open(path)?.sync_all(),
        }
    }

    /// Makes it durable under its name, as [`Draft::place`], with the rights of the file `like`.
    ///
    /// # Errors
    /// As those of [`Draft::sync`] and [`Draft::place`].
    pub(crate) fn place_like(&self, like: &Path, target: &Path, replace: bool) -> io::Result<()> {
        self.sync()?;
        self.place(target, Rights::of(&std::fs::metadata(like)?), replace)?;
        fsx::sync_dir(&self.folder)
    }

    /// Gives it its name, which must lie in its folder, with these rights. An existing file is replaced if `replace` says so; otherwise
    /// it is an error of kind `AlreadyExists`. The name is durable once the folder is synced.
    ///
    /// # Errors
    /// As `link` and `rename`.
    pub(crate) fn place(&self, target: &Path, rights: Rights, replace: bool) -> io::Result<()> {
        match &self.kind {
            Kind::Nameless(file) => {
                rights.give(file, &self.folder)?;
                if !replace {
                    return link(file, target);
                }
                // A link never replaces; the detour over a name of our own does.
                let detour = create::temporary_in(&self.folder);
                link(file, &detour)?;
                std::fs::rename(&detour, target).inspect_err(|_| {
                    let _ = fsx::remove_if_there(&detour);
                })
            }
            Kind::Named(path) => {
                rights.give_named(path, &self.folder)?;
                if replace { std::fs::rename(path, target) } else { fsx::rename_new(path, target) }
            }
        }
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if let Kind::Named(path) = &self.kind {
            // Nothing there after it was placed.
            let _ = fsx::remove_if_there(path);
        }
    }
}

fn link(file: &File, target: &Path) -> io::Result<()> {
    let by_descriptor = format!("/proc/self/fd/{}", file.as_raw_fd());
    Ok(rustix::fs::linkat(CWD, by_descriptor, CWD, target, AtFlags::SYMLINK_FOLLOW)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(folder: &Path, named: bool) -> Draft {
        let draft = if named {
            Draft { kind: Kind::Named(create::temporary_in(folder)), folder: folder.to_owned() }
        } else {
            Draft::new(folder).unwrap()
        };
        assert!(!draft.is_written());
        std::fs::OpenOptions::new().write(true).create(named).truncate(false).open(draft.path()).unwrap();
        std::fs::write(draft.path(), b"new").unwrap();
        assert!(draft.is_written());
        draft.sync().unwrap();
        draft
    }

    /// With a name or without, a draft that is given up leaves nothing, and one that is placed replaces only when told to.
    #[test]
    fn a_draft_has_no_name_until_it_is_placed() {
        for named in [false, true] {
            let dir = tempfile::tempdir().unwrap();
            let target = dir.path().join("part.stl");
            let rights = Rights::of(&std::fs::metadata(dir.path()).unwrap());
            let entries = || std::fs::read_dir(dir.path()).unwrap().count();
            drop(written(dir.path(), named));
            assert_eq!(entries(), 0);
            std::fs::write(&target, b"old").unwrap();
            let error = written(dir.path(), named).place(&target, rights, false).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::AlreadyExists);
            assert_eq!(std::fs::read(&target).unwrap(), b"old");
            written(dir.path(), named).place(&target, rights, true).unwrap();
            assert_eq!(std::fs::read(&target).unwrap(), b"new");
            std::fs::remove_file(&target).unwrap();
            written(dir.path(), named).place(&target, rights, false).unwrap();
            assert_eq!(std::fs::read(&target).unwrap(), b"new");
            assert_eq!(entries(), 1);
        }
    }
}
