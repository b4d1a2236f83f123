//! The names of what a job leaves: of each the first version that is free, `part.stl`, `part~2.stl`, ….

use std::ffi::{OsStr, OsString};
use std::io;
use std::path::{Path, PathBuf};

use suture_store::RelPath;

use crate::fsx;
use crate::publish_error::{PublishError, io_at};
use crate::receipt::{RECEIPT, REPORT};

/// What the longest companion adds to a name.
pub(crate) const COMPANION: usize = RECEIPT.len();
/// Marks the best attempt at a file that could not be made good.
pub(crate) const BEST: &str = ".best";
/// Free names are looked for this far.
pub(crate) const VERSIONS: u32 = 100_000;

/// What a result and its original are to be called.
pub(crate) struct Names {
    pub output: Option<RelPath>,
    pub original: RelPath,
}

/// The first version of a name that is free; `reserve` bytes are left for what is appended to it. A name that is too long for a
/// record with its version is cut.
pub(crate) fn first(
    path: &RelPath,
    reserve: usize,
    free: impl Fn(&RelPath) -> io::Result<bool>,
) -> Result<RelPath, PublishError> {
    let full = path.to_path();
    let name = full.file_name().unwrap_or_default();
    for n in 1..VERSIONS {
        let fits = (0..fsx::NAME_MAX).find_map(|cut| {
            let name = fsx::versioned(name, n, reserve + cut);
            RelPath::from_path(&full.with_file_name(name)).ok()
        });
        let Some(candidate) = fits else { break };
        if free(&candidate).map_err(io_at(&full))? {
            return Ok(candidate);
        }
    }
    Err(no_free_name(&full))
}

pub(crate) fn no_free_name(path: &Path) -> PublishError {
    io_at(path)(io::Error::new(io::ErrorKind::AlreadyExists, "no free name is left"))
}

/// Names of the report and the receipt of `path`.
pub(crate) fn companions(path: &RelPath) -> [PathBuf; 2] {
    [REPORT, RECEIPT].map(|suffix| with_suffix(&path.to_path(), suffix))
}

pub(crate) fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

/// `part.stl` → `part.best.stl`.
pub(crate) fn best_of(path: &RelPath) -> RelPath {
    let full = path.to_path();
    let mut name = full.file_stem().unwrap_or_default().to_owned();
    name.push(BEST);
    if let Some(extension) = full.extension() {
        name.push(".");
        name.push(extension);
    }
    // Room for it was reserved; a path that is too long for a record keeps its plain name.
    RelPath::from_path(&full.with_file_name(name)).unwrap_or_else(|_| path.clone())
}

/// The name of a result whose format has this ending: with it, if the name has another one.
pub(crate) fn with_ending(path: &RelPath, ending: &OsStr) -> RelPath {
    let full = path.to_path();
    if full.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending)) {
        return path.clone();
    }
    RelPath::from_path(&full.with_extension(ending)).unwrap_or_else(|_| path.clone())
}

/// The ending of a name, which may be none.
pub(crate) fn ending_of_name(path: &RelPath) -> OsString {
    path.to_path().extension().unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use suture_store::path::MAX_SOURCE;

    #[test]
    fn a_result_has_the_ending_of_its_format() {
        let of = |name: &str| with_ending(&RelPath::new(name.as_bytes()).unwrap(), OsStr::new("stl")).to_path();
        let names = ["a/part.stl", "PART.STL", "a.b/part.v2.obj", "part"].map(of);
        assert_eq!(names, ["a/part.stl", "PART.STL", "a.b/part.v2.stl", "part.stl"].map(PathBuf::from));
    }

    /// D2: the longest path that is taken, dropped again and again, finds a name each time; so does one of another encoding.
    #[test]
    fn f23_the_longest_paths_have_many_names() {
        let folder = "d".repeat(MAX_SOURCE - 6);
        let long = RelPath::new(format!("{folder}/a.stl")).unwrap();
        let odd = RelPath::new([vec![0xE9; 200], b"/".to_vec(), vec![0xE9; 80], b".stl".to_vec()].concat()).unwrap();
        let whole = RelPath::new(format!("{}/{}.stl", "d".repeat(400), "n".repeat(MAX_SOURCE - 405))).unwrap();
        for path in [long, odd, whole] {
            for taken in [0, 1, 9, 99, 999] {
                let asked = std::cell::Cell::new(0);
                let free = |_: &RelPath| Ok(asked.replace(asked.get() + 1) >= taken);
                let found = first(&path, COMPANION + BEST.len(), free).unwrap();
                assert_eq!(found == path, taken == 0);
                assert_ne!(best_of(&found), found);
            }
        }
    }
}
