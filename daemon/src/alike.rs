//! Names that differ, and that other systems take for the same: by upper and lower case, or by how an accent is spelt (Windows, macOS, what
//! Samba shows of a folder). Of two such results one would hide the other there, so that the second one gets another name.
//!
//! A folder is not read for each name: what is in it is known by digests of names, of which one that is said to be there is looked for, and all
//! are read anew after so many looks that reading costs little for each. What this daemon puts there it knows at once.

use std::collections::HashMap;
use std::ffi::OsStr;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use unicode_normalization::UnicodeNormalization;

use crate::fsx;

/// A folder is read anew when so many of its names were there for each look.
const NAMES_A_LOOK: usize = 16;
/// More folders are forgotten, and read when they are asked for.
const MOST_FOLDERS: usize = 256;

/// The results' folders of a hot folder.
#[derive(Debug, Default)]
pub(crate) struct Alike(Mutex<Known>);

#[derive(Debug, Default)]
struct Known {
    folders: HashMap<PathBuf, Listed>,
    /// Names that files are about to get: folder, what is alike, how often.
    held: HashMap<(PathBuf, u64), (u64, u32)>,
}

/// The names in a folder: for all that are alike, the digest of one.
#[derive(Debug, Default)]
struct Listed {
    names: HashMap<u64, u64>,
    looks: usize,
}

/// A name that nobody else gets one like, as long as this lives.
#[derive(Debug)]
pub(crate) struct Held<'a> {
    alike: &'a Alike,
    key: (PathBuf, u64),
}

impl Alike {
    fn known(&self) -> MutexGuard<'_, Known> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Is there another name like that of `path` in its folder, or about to be?
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub(crate) fn has_twin(&self, path: &Path) -> io::Result<bool> {
        self.known().has_twin(fsx::folder_of(path), digests(path.file_name().unwrap_or_default()))
    }

    /// Takes the name of `path`, for a file that gets it next; `None` where there is another one like it.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub(crate) fn hold(&self, path: &Path) -> io::Result<Option<Held<'_>>> {
        let (folder, name) = (fsx::folder_of(path), path.file_name().unwrap_or_default());
        let (alike, exact) = digests(name);
        let mut known = self.known();
        if known.has_twin(folder, (alike, exact))? {
            return Ok(None);
        }
        if let Some(listed) = known.folders.get_mut(folder) {
            listed.names.insert(alike, exact);
        }
        let key = (folder.to_owned(), alike);
        known.held.entry(key.clone()).or_insert((exact, 0)).1 += 1;
        Ok(Some(Held { alike: self, key }))
    }
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        let mut known = self.alike.known();
        if let Some((_, count)) = known.held.get_mut(&self.key) {
            *count -= 1;
            if *count == 0 {
                known.held.remove(&self.key);
            }
        }
    }
}

impl Known {
    fn has_twin(&mut self, folder: &Path, (alike, exact): (u64, u64)) -> io::Result<bool> {
        if self.held.get(&(folder.to_owned(), alike)).is_some_and(|(held, _)| *held != exact) {
            return Ok(true);
        }
        if self.folders.len() > MOST_FOLDERS {
            self.folders.clear();
        }
        let mut is_new = false;
        if !self.folders.contains_key(folder) {
            self.folders.insert(folder.to_owned(), Listed::read(folder)?);
            is_new = true;
        }
        let Some(listed) = self.folders.get_mut(folder) else { return Ok(false) };
        listed.looks += 1;
        let is_other = |listed: &Listed| listed.names.get(&alike).is_some_and(|there| *there != exact);
        if !is_new && (is_other(listed) || listed.looks * NAMES_A_LOOK > listed.names.len()) {
            *listed = Listed::read(folder)?;
        }
        Ok(is_other(listed))
    }
}

impl Listed {
    fn read(folder: &Path) -> io::Result<Self> {
        let mut names = HashMap::new();
        for entry in fsx::if_there(std::fs::read_dir(folder))?.into_iter().flatten() {
            let (alike, exact) = digests(&entry?.file_name());
            names.insert(alike, exact);
        }
        Ok(Self { names, looks: 0 })
    }
}

/// Of all names that are alike, and of this very name.
fn digests(name: &OsStr) -> (u64, u64) {
    (digest(&folded(name)), digest(name.as_encoded_bytes()))
}

fn digest(bytes: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    bytes.hash(&mut hasher);
    hasher.finish()
}

/// The same for names that are alike. Of a name that is no text, only the letters of ASCII have a case.
pub(crate) fn folded(name: &OsStr) -> Vec<u8> {
    let Some(text) = name.to_str() else { return name.as_encoded_bytes().to_ascii_lowercase() };
    if text.is_ascii() {
        return text.to_ascii_lowercase().into_bytes();
    }
    let folded: String = text.nfd().flat_map(char::to_uppercase).flat_map(char::to_lowercase).nfc().collect();
    folded.into_bytes()
}

#[cfg(test)]
mod tests {
    use std::os::unix::ffi::OsStrExt;

    use super::*;

    #[test]
    fn f23_names_that_differ_by_case_or_spelling_are_alike() {
        for (a, b) in [
            ("part.stl", "PART.Stl"),
            ("\u{e9}t\u{e9}.stl", "e\u{301}te\u{301}.stl"),
            ("\u{c9}T\u{c9}.stl", "e\u{301}te\u{301}.stl"),
            ("K\u{f6}rper.stl", "KO\u{308}RPER.STL"),
            ("stra\u{df}e.stl", "STRASSE.stl"),
            ("\u{3a3}.stl", "\u{3c2}.stl"),
        ] {
            assert_eq!(folded(OsStr::new(a)), folded(OsStr::new(b)), "{a} {b}");
        }
        let odd = |bytes: &'static [u8]| folded(OsStr::from_bytes(bytes));
        assert_eq!(odd(b"K\xf6rper.stl"), odd(b"k\xf6RPER.stl"));
        for (a, b) in [("part.stl", "part~2.stl"), ("e.stl", "\u{e9}.stl"), ("o.stl", "\u{f6}.stl")] {
            assert_ne!(folded(OsStr::new(a)), folded(OsStr::new(b)), "{a} {b}");
        }
        assert_ne!(odd(b"\xf6.stl"), odd(b"\xe9.stl"));
    }

    #[test]
    fn f23_a_name_has_a_twin_while_that_is_there_or_about_to_be() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        let alike = Alike::default();
        assert!(!alike.has_twin(&at("part.stl")).unwrap());
        let held = alike.hold(&at("part.stl")).unwrap().unwrap();
        assert!(alike.has_twin(&at("Part.stl")).unwrap() && alike.hold(&at("PART.stl")).unwrap().is_none());
        assert!(!alike.has_twin(&at("part.stl")).unwrap(), "it is the very name");
        drop(held);
        assert!(!alike.has_twin(&at("Part.stl")).unwrap(), "nothing has that name after all");
        std::fs::write(at("part.stl"), b"").unwrap();
        assert!(alike.has_twin(&at("Part.stl")).unwrap());
        std::fs::remove_file(at("part.stl")).unwrap();
        assert!(!alike.has_twin(&at("Part.stl")).unwrap());
        assert!(!alike.has_twin(&at("none/Part.stl")).unwrap(), "no folder, no twin");
    }

    /// A name that someone else puts into a full folder is seen after some looks, and a name of this daemon at once.
    #[test]
    fn f23_a_full_folder_is_not_read_for_each_name() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        for n in 0..10 * NAMES_A_LOOK {
            std::fs::write(at(&format!("{n}.stl")), b"").unwrap();
        }
        let alike = Alike::default();
        assert!(!alike.has_twin(&at("other.stl")).unwrap());
        std::fs::write(at("theirs.stl"), b"").unwrap();
        drop(alike.hold(&at("ours.stl")).unwrap().unwrap());
        std::fs::write(at("ours.stl"), b"").unwrap();
        assert!(alike.has_twin(&at("Ours.stl")).unwrap());
        let looks = (0..20).take_while(|_| !alike.has_twin(&at("Theirs.stl")).unwrap()).count();
        assert!(looks < 20);
    }
}
