//! A sub-folder `!force` of `in/`: whatever is dropped below it is worked on anew, also where a good result of the same content stands. It is a
//! word to the daemon, not a place: profile, settings, order and the names of results are those of the path without it.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use suture_store::RelPath;

/// The name of such a folder. Upper case is the same: some systems that drop files do not tell it from lower case.
const FORCE: &str = "!force";

fn is_word(part: &OsStr) -> bool {
    part.eq_ignore_ascii_case(FORCE)
}

/// Is a file of `in/` to be worked on anew?
pub(crate) fn is_forced(path: &RelPath) -> bool {
    path.to_path().components().any(|part| is_word(part.as_os_str()))
}

/// The path by which a file of `in/` is judged and named.
pub(crate) fn plain(path: &RelPath) -> RelPath {
    RelPath::from_path(&without(&path.to_path())).unwrap_or_else(|_| path.clone())
}

/// Where a copy of a file of `in/` is dropped, below that, to be worked on anew as it was.
pub(crate) fn folder_for(path: &RelPath) -> RelPath {
    RelPath::from_path(&without(&path.to_path()).with_file_name(FORCE)).unwrap_or_else(|_| path.clone())
}

/// A path below `in/` without such folders.
pub(crate) fn without(path: &Path) -> PathBuf {
    path.components().filter(|part| !is_word(part.as_os_str())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_a_word_wherever_it_stands_and_no_part_of_a_name() {
        let of = |text: &str| {
            let path = RelPath::new(text.as_bytes()).unwrap();
            (is_forced(&path), plain(&path).to_string())
        };
        for (path, forced, plain) in [
            ("a.stl", false, "a.stl"),
            ("!force/a.stl", true, "a.stl"),
            ("scan/!force/order 7/a.stl", true, "scan/order 7/a.stl"),
            ("!force/scan/!force/a.stl", true, "scan/a.stl"),
            ("!forced/a!force.stl", false, "!forced/a!force.stl"),
            ("!FORCE/a.stl", true, "a.stl"),
        ] {
            assert_eq!(of(path), (forced, plain.to_owned()), "{path}");
            let again = folder_for(&RelPath::new(path).unwrap()).to_path().join("a.stl");
            assert_eq!(without(&again), Path::new(plain).with_file_name("a.stl"), "{path}");
        }
    }
}
