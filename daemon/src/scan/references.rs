//! The files that the OBJs in `in/` name, as far as these and their libraries were read. Each is read once, and again when it has changed.
//!
//! **In:** paths below `in/`, and who is there. **Out:** the companions of each OBJ, and which of them have gone along already. **Promise:** reads
//! [`BEGINNING`] bytes of a file at most, and of no other file than an OBJ or a library that one names; an OBJ has [`MOST`] companions at most.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::companions::{BEGINNING, MOST, libraries, textures};
use crate::claim::Original;
use crate::fsx::Identity;

/// A file that was read.
#[derive(Debug)]
struct Known {
    of: Identity,
    names: Vec<PathBuf>,
}

/// Who names whom.
#[derive(Debug, Default)]
pub(super) struct References {
    objs: BTreeMap<PathBuf, Known>,
    libraries: BTreeMap<PathBuf, Known>,
    /// Companions that have a job, or had one, while an OBJ that names them is in `in/`.
    gone_along: BTreeSet<PathBuf>,
}

impl References {
    /// Has this OBJ been read as it is?
    pub(super) fn knows(&self, obj: &Path, identity: &Identity) -> bool {
        self.objs.get(obj).is_some_and(|known| known.of.same_but_for_device(identity))
    }

    /// Reads an OBJ of `inbox`, and its libraries, as far as they are there, and not known as they are. `find`: a file that is there, and may be a
    /// library. What cannot be read names nothing for now.
    pub(super) fn read(&mut self, inbox: &Path, obj: &Path, identity: &Identity, find: &dyn Fn(&Path) -> Option<Identity>) {
        if !self.knows(obj, identity) {
            let Ok(text) = beginning(&inbox.join(obj)) else { return };
            self.objs.insert(obj.to_owned(), Known { of: *identity, names: libraries(&text, obj) });
        }
        let Some(known) = self.objs.get(obj) else { return };
        for library in &known.names {
            let Some(of) = find(library) else { continue };
            if self.libraries.get(library).is_some_and(|known| known.of.same_but_for_device(&of)) {
                continue;
            }
            if let Ok(text) = beginning(&inbox.join(library)) {
                self.libraries.insert(library.clone(), Known { of, names: textures(&text, library) });
            }
        }
    }

    /// The companions of an OBJ, as far as it is known: its libraries, then their textures.
    pub(super) fn of(&self, obj: &Path) -> impl Iterator<Item = &Path> {
        let libraries = self.objs.get(obj).map_or(&[][..], |known| &known.names);
        let textures = libraries.iter().filter_map(|library| self.libraries.get(library)).flat_map(|known| &known.names);
        libraries.iter().chain(textures).take(MOST).map(PathBuf::as_path)
    }

    /// This companion has a job now.
    pub(super) fn goes_along(&mut self, companion: &Path) {
        self.gone_along.insert(companion.to_owned());
    }

    /// Need nobody wait for it?
    pub(super) fn has_gone_along(&self, companion: &Path) -> bool {
        self.gone_along.contains(companion)
    }

    /// Forgets the OBJs that are not there any more, and what they alone name.
    pub(super) fn keep(&mut self, is_there: impl Fn(&Path) -> bool) {
        let before = self.objs.len();
        self.objs.retain(|obj, _| is_there(obj));
        if self.objs.len() == before {
            return;
        }
        let named: BTreeSet<&PathBuf> = self.objs.values().flat_map(|known| &known.names).collect();
        self.libraries.retain(|library, _| named.contains(library));
        let textures = self.libraries.values().flat_map(|known| &known.names);
        let named: BTreeSet<&PathBuf> = named.into_iter().chain(textures).collect();
        self.gone_along.retain(|companion| named.contains(companion));
    }
}

/// The beginning of a regular file, to the end of a line where it is longer.
fn beginning(path: &Path) -> io::Result<Vec<u8>> {
    let original = Original::open(path)?;
    let mut text = Vec::new();
    original.file().take(BEGINNING).read_to_end(&mut text)?;
    if text.len() as u64 == BEGINNING {
        // A name that is cut is another name.
        let end = text.iter().rposition(|byte| *byte == b'\n').unwrap_or(0);
        text.truncate(end);
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(references: &References, obj: &str) -> Vec<String> {
        references.of(Path::new(obj)).map(|path| path.display().to_string()).collect()
    }

    #[test]
    fn an_obj_is_read_again_when_it_changed_and_its_library_when_it_comes() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            std::fs::write(dir.path().join(name), text).unwrap();
            Identity::of(&dir.path().join(name)).unwrap()
        };
        let find = |path: &Path| Identity::of(&dir.path().join(path)).ok();
        let mut references = References::default();
        let obj = Path::new("a.obj");
        let was = write("a.obj", "mtllib a.mtl\n");
        references.read(dir.path(), obj, &was, &find);
        assert!(references.knows(obj, &was));
        assert_eq!(names(&references, "a.obj"), ["a.mtl"]);
        write("a.mtl", "map_Kd wood.png\n");
        references.read(dir.path(), obj, &was, &find);
        assert_eq!(names(&references, "a.obj"), ["a.mtl", "wood.png"]);
        references.goes_along(Path::new("wood.png"));
        // The library has gone along; its textures are known still.
        std::fs::remove_file(dir.path().join("a.mtl")).unwrap();
        references.read(dir.path(), obj, &was, &find);
        assert_eq!(names(&references, "a.obj"), ["a.mtl", "wood.png"]);
        let is = write("a.obj", "mtllib a.mtl\nmtllib b.mtl\n");
        assert!(!references.knows(obj, &is));
        references.read(dir.path(), obj, &is, &find);
        assert_eq!(names(&references, "a.obj"), ["a.mtl", "b.mtl", "wood.png"]);
        references.keep(|_| true);
        assert!(references.has_gone_along(Path::new("wood.png")));
        references.keep(|_| false);
        assert!(names(&references, "a.obj").is_empty() && !references.has_gone_along(Path::new("wood.png")));
    }

    /// A row beyond the beginning, and one that it cuts, name nothing.
    #[test]
    fn only_the_beginning_is_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.obj");
        let length = usize::try_from(BEGINNING).unwrap();
        let first = b"mtllib first.mtl\n";
        let comment = [b"#".as_slice(), &vec![b' '; length - first.len() - 12], b"\n"].concat();
        std::fs::write(&path, [first, &comment[..], b"mtllib cut.mtl.mtl\nmtllib beyond.mtl\n"].concat()).unwrap();
        let mut references = References::default();
        references.read(dir.path(), Path::new("a.obj"), &Identity::of(&path).unwrap(), &|_| None);
        assert_eq!(names(&references, "a.obj"), ["first.mtl"]);
    }
}
