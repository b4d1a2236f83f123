//! The archive: the only place an original goes to, and only as a copy that was read back and compared.
//!
//! ```text
//! copied to a hidden name in the archive ─► synced ─► read back, hashes compared ─► renamed, never replacing ─► folder synced
//!   ─► original set aside under a hidden name ─► is it what was copied? ─► removed ─► folder synced
//! ```
//! Until the last step the original is there, and a kill at any point leaves at worst both, or the original under its hidden name, which
//! [`give_back`] undoes. A copy that is there already, of the same content, is believed once it was read and synced.
//!
//! An archive is told by a file `.suture-archive` in it, which a person makes: the bare folder that a disk was mounted on must not be taken
//! for the disk.

use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use rustix::fs::Advice;
use suture_store::Hash;
use suture_store::crash_point;

use crate::claim::Original;
use crate::create;
use crate::folder::make_parent;
use crate::fsx::{self, Identity};
use crate::names::VERSIONS;
use crate::units::show_size;

/// The file that makes a folder an archive.
const MARKER: &str = ".suture-archive";
/// A copy on its way.
const STAGE: &str = ".suture-archive.tmp";
/// Begins the name of an original that is about to be removed.
const ASIDE: &str = ".suture-archived-";

/// An archive that was found in its place.
pub(crate) struct Archive {
    root: PathBuf,
}

/// Why an original stays.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Stays {
    /// This one: others may go.
    #[error("{0}")]
    This(String),
    /// All of them, for now.
    #[error("{0}")]
    All(String),
}

impl Archive {
    /// The archive at `root`.
    ///
    /// # Errors
    /// A line for people, if there is none.
    pub(crate) fn open(root: &Path) -> Result<Self, String> {
        let archive = Self { root: root.to_owned() };
        archive.check().map(|()| archive)
    }

    fn check(&self) -> Result<(), String> {
        let shown = self.root.display();
        match fsx::exists(&self.root.join(MARKER)) {
            Ok(true) => Ok(()),
            Ok(false) => Err(format!(
                "the archive {shown} is not there: it has no file `{MARKER}`; mount it, or make that file in it if it is new"
            )),
            Err(error) => Err(format!("the archive {shown} is out of reach: {error}")),
        }
    }

    /// Moves the original at `from` here, to `at` or the next free version of that name. Returns where it is.
    ///
    /// # Errors
    /// When it stays where it is, and why.
    pub(crate) fn take(&self, from: &Path, at: &Path) -> Result<PathBuf, Stays> {
        self.check().map_err(Stays::All)?;
        let this = |what: &'static str| move |error: io::Error| Stays::This(format!("{what}: {error}"));
        let name = from.file_name().unwrap_or_default();
        if name.len() + ASIDE.len() > fsx::NAME_MAX {
            return Err(Stays::This("its name is too long".into()));
        }
        let original = Original::open(from).map_err(this("it cannot be opened"))?;
        let identity = original.identity().map_err(this("it cannot be looked at"))?;
        let (needed, free) = (identity.size, fsx::free_space(&self.root, 0));
        if free <= needed {
            return Err(Stays::All(format!("the archive has room for {} more", show_size(free))));
        }
        let hash = hash_of(original.file()).map_err(this("it cannot be read"))?;
        let to = self.root.join(at);
        let copied = make_parent(&to).and_then(|()| self.copy(&original, &to, hash));
        let to = copied.map_err(|error| Stays::All(format!("the archive cannot be written: {error}")))?;
        crash_point("retention.archived");
        remove(from, &identity).map_err(this("it is in the archive, but cannot be removed here"))?;
        Ok(to)
    }

    /// A copy under a name that no other content has, durable and read back.
    fn copy(&self, original: &Original, to: &Path, hash: Hash) -> io::Result<PathBuf> {
        let (folder, name) = (fsx::folder_of(to), to.file_name().unwrap_or_default());
        let stage = folder.join(STAGE);
        let mut staged = false;
        for n in 1..VERSIONS {
            let to = folder.join(fsx::versioned(name, n, 0));
            if fsx::exists(&to)? {
                let there = Original::open(&to).and_then(|there| Ok((hash_synced(there.file())?, there)));
                if there.is_ok_and(|(found, _)| found == hash) {
                    fsx::sync_dir(folder)?;
                    fsx::remove_if_there(&stage)?;
                    return Ok(to);
                }
                continue;
            }
            if !staged {
                create::copy_new(original.file(), &stage)?;
                let copy = Original::open(&stage)?;
                if hash_synced(copy.file())? != hash {
                    fsx::remove_if_there(&stage)?;
                    return Err(io::Error::other("the copy is not what was copied"));
                }
                staged = true;
                crash_point("retention.staged");
            }
            match fsx::rename_new(&stage, &to) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
                Ok(()) => return fsx::sync_dir(folder).map(|()| to),
            }
        }
        Err(io::ErrorKind::AlreadyExists.into())
    }
}

/// Of what the file holds on the disk: it is synced, and what memory has of it is dropped first, as far as the system does that.
fn hash_synced(file: &File) -> io::Result<Hash> {
    file.sync_all()?;
    let _ = rustix::fs::fadvise(file, 0, None, Advice::DontNeed);
    hash_of(file)
}

/// Of the whole file, wherever its handle stands; the handle stands at its beginning afterwards.
fn hash_of(mut file: &File) -> io::Result<Hash> {
    use std::io::{Seek, SeekFrom};
    file.seek(SeekFrom::Start(0))?;
    let hash = fsx::hash_of(file)?;
    file.seek(SeekFrom::Start(0))?;
    Ok(hash)
}

/// Removes the file that was copied, and no other that has taken its name.
fn remove(from: &Path, copied: &Identity) -> io::Result<()> {
    let aside = aside(from);
    fsx::rename_new(from, &aside)?;
    crash_point("retention.aside");
    if !Identity::of(&aside)?.same_content(copied) {
        fsx::rename_new(&aside, from)?;
        return Err(io::Error::other("another file has taken its name"));
    }
    std::fs::remove_file(&aside)?;
    fsx::sync_dir(fsx::folder_of(from))
}

fn aside(from: &Path) -> PathBuf {
    let mut name = OsString::from(ASIDE);
    name.push(from.file_name().unwrap_or_default());
    from.with_file_name(name)
}

/// Is that the name of an original that was set aside?
pub(crate) fn is_aside(name: &OsStr) -> bool {
    name.as_encoded_bytes().starts_with(ASIDE.as_bytes())
}

/// If this is the hidden name of an original that a kill left aside, it gets its name back, or the next version of it.
///
/// # Errors
/// As `rename`.
pub(crate) fn give_back(path: &Path) -> io::Result<bool> {
    use std::os::unix::ffi::OsStrExt;
    let Some(name) = path.file_name().and_then(|name| name.as_bytes().strip_prefix(ASIDE.as_bytes())) else { return Ok(false) };
    for n in 1..VERSIONS {
        match fsx::rename_new(path, &path.with_file_name(fsx::versioned(OsStr::from_bytes(name), n, 0))) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            renamed => return renamed.map(|()| true),
        }
    }
    Ok(false)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Scene {
        dir: tempfile::TempDir,
        archive: Archive,
    }

    impl Scene {
        fn new() -> Self {
            let dir = tempfile::tempdir().unwrap();
            std::fs::create_dir_all(dir.path().join("archive")).unwrap();
            std::fs::create_dir_all(dir.path().join("done")).unwrap();
            std::fs::write(dir.path().join("archive").join(MARKER), b"").unwrap();
            let archive = Archive::open(&dir.path().join("archive")).unwrap();
            Self { dir, archive }
        }

        fn at(&self, name: &str) -> PathBuf {
            self.dir.path().join(name)
        }

        fn take(&self, content: &[u8]) -> Result<PathBuf, Stays> {
            std::fs::write(self.at("done/a.stl"), content).unwrap();
            self.archive.take(&self.at("done/a.stl"), Path::new("hot/done/a.stl"))
        }

        fn names(&self, folder: &str) -> Vec<String> {
            let entries = std::fs::read_dir(self.at(folder)).unwrap().flatten();
            let mut names: Vec<_> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
            names.sort();
            names
        }
    }

    #[test]
    fn an_original_moves_and_nothing_is_replaced() {
        let scene = Scene::new();
        for (content, name) in [(b"one", "a.stl"), (b"two", "a~2.stl"), (b"one", "a.stl")] {
            let to = scene.take(content).unwrap();
            assert_eq!(to, scene.at("archive/hot/done").join(name));
            assert_eq!(std::fs::read(to).unwrap(), content);
            assert!(scene.names("done").is_empty());
        }
        assert_eq!(scene.names("archive/hot/done"), ["a.stl", "a~2.stl"], "the same content is there once, and no stage is left");
    }

    #[test]
    fn the_copy_has_the_time_of_the_original() {
        let scene = Scene::new();
        std::fs::write(scene.at("done/a.stl"), b"old").unwrap();
        let then = std::time::UNIX_EPOCH + std::time::Duration::from_secs(1_000_000_000);
        File::open(scene.at("done/a.stl")).unwrap().set_modified(then).unwrap();
        let to = scene.archive.take(&scene.at("done/a.stl"), Path::new("a.stl")).unwrap();
        assert_eq!(std::fs::metadata(to).unwrap().modified().unwrap(), then);
    }

    #[test]
    fn without_its_marker_nothing_is_an_archive() {
        let scene = Scene::new();
        std::fs::remove_file(scene.at("archive").join(MARKER)).unwrap();
        assert!(matches!(scene.take(b"one"), Err(Stays::All(why)) if why.contains("mount it")));
        assert_eq!((scene.names("done"), scene.names("archive")), (vec!["a.stl".to_owned()], vec![]));
        assert!(Archive::open(&scene.at("nowhere")).is_err());
    }

    #[test]
    fn an_archive_that_cannot_be_written_leaves_the_original() {
        let scene = Scene::new();
        std::fs::write(scene.at("archive/hot"), b"no folder").unwrap();
        assert!(matches!(scene.take(b"one"), Err(Stays::All(_))));
        assert_eq!(scene.names("done"), ["a.stl"]);
    }

    #[test]
    fn another_file_of_that_name_is_not_removed() {
        let scene = Scene::new();
        std::fs::write(scene.at("done/a.stl"), b"copied").unwrap();
        let copied = Identity::of(&scene.at("done/a.stl")).unwrap();
        std::fs::rename(scene.at("done/a.stl"), scene.at("other")).unwrap();
        std::fs::write(scene.at("done/a.stl"), b"another").unwrap();
        assert!(remove(&scene.at("done/a.stl"), &copied).is_err());
        assert_eq!(std::fs::read(scene.at("done/a.stl")).unwrap(), b"another");
        assert_eq!(scene.names("done"), ["a.stl"]);
    }

    /// Killed between the last two steps.
    #[test]
    fn an_original_that_was_left_aside_gets_its_name_back() {
        let scene = Scene::new();
        let path = scene.at("done/a.stl");
        std::fs::write(&path, b"later").unwrap();
        std::fs::write(aside(&path), b"aside").unwrap();
        assert!(give_back(&aside(&path)).unwrap() && !give_back(&path).unwrap());
        assert_eq!(
            (std::fs::read(&path).unwrap(), std::fs::read(scene.at("done/a~2.stl")).unwrap()),
            (b"later".to_vec(), b"aside".to_vec())
        );
    }
}
