//! Where things of this crate are, and files of others.

use std::path::{Path, PathBuf};

use crate::mesh::{self, Triangle};

/// The folder of this crate.
pub(crate) fn home() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Where raw runs are kept, unless told otherwise.
pub(crate) fn results() -> PathBuf {
    home().join("results")
}

/// The name of a file, as people read it.
pub(super) fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The finite triangles of an STL; a file that is none, or has none, is named.
pub(super) fn read_or_say(path: &Path) -> Option<Vec<Triangle>> {
    let triangles = mesh::read(path).ok().filter(|triangles| !triangles.is_empty());
    if triangles.is_none() {
        eprintln!("{} is no STL, or an empty one", name_of(path));
    }
    triangles
}

/// Where raw runs are, where their pages belong, and the README that has their table.
pub(crate) fn places(asked: Option<&Path>) -> (PathBuf, PathBuf, Option<PathBuf>) {
    match asked {
        Some(raw) => (raw.into(), raw.into(), None),
        None => (results(), home().into(), Some(home().join("../README.md"))),
    }
}
