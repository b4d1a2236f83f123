//! Files that come by the web, on their way into `in/`: written and synced in the hot folder's private part, then renamed into place, so that they count at
//! once, as whatever a careful program puts there.
//!
//! `.suture/upload/*.part` are files that are not whole yet; what a daemon that died left of them goes at the next start. `.suture/upload/keys/` holds a
//! note for each key that came with an upload: under which name, and as which file, it was to get its place. The note is durable before the file has its
//! place, so that the same key leads to the same job, whatever was killed when; it is kept for a week.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use serde::{Deserialize, Serialize};
use suture_store::{Hash, RelPath, crash_point};

use crate::create;
use crate::folder::{Folder, NameKind, endings, make_parent, name_kind};
use crate::fsx::{self, Identity};

/// How long a key is remembered.
const KEPT_FOR: Duration = Duration::from_secs(7 * 24 * 3600);
/// Names that are tried for a file whose own is taken.
const MOST_NAMES: u32 = 10_000;

fn keys(folder: &Folder) -> PathBuf {
    folder.uploads().join("keys")
}

/// Removes what an earlier life left half done, and notes that are old.
pub(crate) fn clear(folder: &Folder) {
    if folder.check().is_err() {
        return;
    }
    let names = |path: PathBuf| std::fs::read_dir(path).into_iter().flatten().flatten();
    let half = names(folder.uploads()).filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_file()));
    let is_old = |entry: &std::fs::DirEntry| {
        let changed = entry.metadata().and_then(|meta| meta.modified());
        changed.is_ok_and(|then| SystemTime::now().duration_since(then).is_ok_and(|age| age > KEPT_FOR))
    };
    for entry in half.chain(names(keys(folder)).filter(is_old)) {
        if let Err(error) = fsx::remove_if_there(&entry.path()) {
            tracing::warn!(%error, file = %entry.path().display(), "What is left of an upload could not be removed; the next start does it.");
        }
    }
}

/// A file that is coming. It goes if it does not come to its end.
pub(crate) struct Coming {
    file: File,
    path: PathBuf,
    hasher: blake3::Hasher,
    /// It has another name by now.
    placed: bool,
}

/// A file that has come, whole and synced.
pub(crate) struct Come {
    coming: Coming,
    pub identity: Identity,
    pub hash: Hash,
}

impl Coming {
    /// Begins one.
    ///
    /// # Errors
    /// As `mkdir` and `open`.
    pub(crate) fn begin(folder: &Folder) -> io::Result<Self> {
        let path = create::temporary_in(&folder.uploads()).with_extension("part");
        make_parent(&path)?;
        Ok(Self { file: create::create_anew(&path)?, path, hasher: blake3::Hasher::new(), placed: false })
    }

    /// More of it.
    ///
    /// # Errors
    /// As `write`.
    pub(crate) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.hasher.update(bytes);
        self.file.write_all(bytes)
    }

    /// That was all.
    ///
    /// # Errors
    /// As `fsync`.
    pub(crate) fn finish(self) -> io::Result<Come> {
        self.file.sync_all()?;
        crash_point("daemon.upload_durable");
        let identity = Identity::from(&self.file.metadata()?);
        Ok(Come { hash: Hash(*self.hasher.finalize().as_bytes()), identity, coming: self })
    }
}

impl Drop for Coming {
    fn drop(&mut self) {
        if !self.placed {
            // If it stays, the next start removes it.
            let _ = fsx::remove_if_there(&self.path);
        }
    }
}

impl Come {
    /// Gives it its place: below `in/`, under its own name or the next one that is free, which is returned. With a `key`, that is noted first.
    ///
    /// # Errors
    /// As `mkdir`, `rename` and `fsync`; of kind `AlreadyExists` when thousands of such names are taken.
    pub(crate) fn place(mut self, folder: &Folder, path: &RelPath, key: Option<&Key>) -> io::Result<RelPath> {
        let wanted = path.to_path();
        let name = wanted.file_name().unwrap_or_default();
        make_way(&folder.inbox(), wanted.parent().unwrap_or(Path::new("")))?;
        for n in 1..=MOST_NAMES {
            let path = RelPath::from_path(&wanted.with_file_name(fsx::versioned(name, n, 0))).map_err(io::Error::other)?;
            let to = folder.inbox().join(path.to_path());
            if fsx::exists(&to)? {
                continue;
            }
            if let Some(key) = key {
                key.note(&Noted { path: path.clone(), identity: self.identity })?;
                crash_point("daemon.upload_noted");
            }
            match fsx::rename_new(&self.coming.path, &to) {
                Ok(()) => {
                    self.coming.placed = true;
                    crash_point("daemon.upload_placed");
                    fsx::sync_dir(fsx::folder_of(&to))?;
                    return Ok(path);
                }
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Err(ErrorKind::AlreadyExists.into())
    }
}

/// Makes the sub-folders of `in/` that are missing; a link is none.
fn make_way(inbox: &Path, below: &Path) -> io::Result<()> {
    let mut way = inbox.to_owned();
    for part in below.components() {
        way.push(part);
        match std::fs::symlink_metadata(&way) {
            Ok(meta) if meta.is_dir() => {}
            Ok(_) => return Err(ErrorKind::NotADirectory.into()),
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => return Err(error),
        }
    }
    make_parent(&way.join("file"))
}

/// Where a file is to be found below `in/`: a plain way to a name of a mesh, nothing of it hidden or temporary.
///
/// # Errors
/// A line for people.
pub(crate) fn destination(text: &str) -> Result<RelPath, String> {
    let path = RelPath::new(text.as_bytes()).map_err(|error| format!("`name`: {error}"))?;
    let parts = || text.split('/').map(OsStr::new);
    if parts().any(|part| part.len() > fsx::NAME_MAX) {
        return Err(format!("`name`: a file name has {} bytes at most", fsx::NAME_MAX));
    }
    if text.chars().any(char::is_control) {
        return Err("`name`: it holds control characters".into());
    }
    if parts().any(|part| name_kind(part) == NameKind::Ignored) {
        return Err("`name`: hidden and temporary names are not taken".into());
    }
    match parts().next_back().map(name_kind) {
        Some(NameKind::Mesh) => Ok(path),
        _ => Err(format!("`name`: it must end as those of meshes do: {}", endings())),
    }
}

/// The note of a key.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Noted {
    /// Below `in/`.
    pub path: RelPath,
    pub identity: Identity,
}

/// A key that a client gave, for one hot folder.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Key(PathBuf);

impl Key {
    /// `text` is anything; it is not kept.
    pub(crate) fn new(folder: &Folder, text: &str) -> Self {
        Self(keys(folder).join(blake3::hash(text.as_bytes()).to_hex().as_str()))
    }

    /// The note of it, if there is one.
    ///
    /// # Errors
    /// When that cannot be read: then no one knows.
    pub(crate) fn look_up(&self) -> io::Result<Option<Noted>> {
        let text = fsx::text_if_there(&self.0)?;
        text.map(|text| serde_json::from_str(&text).map_err(io::Error::other)).transpose()
    }

    fn note(&self, noted: &Noted) -> io::Result<()> {
        make_parent(&self.0)?;
        create::replace(&self.0, &serde_json::to_vec(noted)?)?;
        fsx::sync_dir(fsx::folder_of(&self.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::FolderConfig;

    fn come(folder: &Folder, bytes: &[u8]) -> Come {
        let mut coming = Coming::begin(folder).unwrap();
        coming.write(bytes).unwrap();
        coming.finish().unwrap()
    }

    fn hot() -> (tempfile::TempDir, Folder) {
        let dir = tempfile::tempdir().unwrap();
        let folder = Folder::open(&FolderConfig::of(dir.path()), None).unwrap();
        (dir, folder)
    }

    #[test]
    fn each_gets_a_name_of_its_own_and_nothing_is_left() {
        let (_dir, folder) = hot();
        let path = destination("order-1/part.stl").unwrap();
        let key = Key::new(&folder, "once");
        assert_eq!(key.look_up().unwrap(), None);
        for (bytes, name) in [(b"one", "order-1/part.stl"), (b"two", "order-1/part~2.stl")] {
            let come = come(&folder, bytes);
            assert_eq!(come.hash, Hash(*blake3::hash(bytes).as_bytes()));
            let identity = come.identity;
            let placed = come.place(&folder, &path, Some(&key)).unwrap();
            assert_eq!(placed.to_string(), name);
            assert_eq!(std::fs::read(folder.inbox().join(name)).unwrap(), bytes);
            assert_eq!(key.look_up().unwrap(), Some(Noted { path: placed.clone(), identity }));
            assert!(
                identity.same_content(&Identity::of(&folder.inbox().join(name)).unwrap()),
                "the rename changes nothing of that"
            );
        }
        assert_eq!(std::fs::read_dir(folder.uploads()).unwrap().count(), 1, "the notes alone");
        let plain = come(&folder, b"three").place(&folder, &destination("part.stl").unwrap(), None).unwrap();
        assert_eq!(plain.to_string(), "part.stl");
        let _half = std::mem::ManuallyDrop::new(Coming::begin(&folder).unwrap());
        drop(Coming::begin(&folder).unwrap());
        assert_eq!(std::fs::read_dir(folder.uploads()).unwrap().count(), 2);
        clear(&folder);
        assert_eq!(std::fs::read_dir(folder.uploads()).unwrap().count(), 1);
        assert!(key.look_up().unwrap().is_some());
    }

    #[test]
    fn f28_no_name_leads_out_of_the_folder() {
        for wrong in [
            "",
            "/a.stl",
            "../a.stl",
            "a/../../b.stl",
            "a//b.stl",
            "./a.stl",
            ".a.stl",
            ".git/a.stl",
            "a.stl/",
            "a\\..\0.stl",
            "a\n.stl",
            "a.step",
            "a.stl.part",
            "stl",
        ] {
            assert!(destination(wrong).is_err(), "{wrong:?}");
        }
        assert!(destination(&format!("{}.stl", "a".repeat(252))).is_err());
        let (dir, folder) = hot();
        let outside = tempfile::tempdir().unwrap();
        std::os::unix::fs::symlink(outside.path(), dir.path().join("in/link")).unwrap();
        assert!(come(&folder, b"x").place(&folder, &destination("link/a.stl").unwrap(), None).is_err());
        assert!(come(&folder, b"x").place(&folder, &destination("link/sub/a.stl").unwrap(), None).is_err());
        assert_eq!(std::fs::read_dir(outside.path()).unwrap().count(), 0);
    }
}
