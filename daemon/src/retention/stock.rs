//! What lies in a hot folder and may go. The evidence is on the disk: a result or a report is what a receipt beside it says it is, so that
//! nothing else in these folders is ever taken for one. What is there and is no such thing may be an original.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};

use suture_store::{RelPath, Time};

use super::archive::is_aside;
use super::plan::{Piece, What};
use crate::config::keep::Keep;
use crate::folder::{NameKind, is_hot, name_kind};
use crate::fsx::{self, Identity};
use crate::names::{best_of, with_suffix};
use crate::orders::summary;
use crate::receipt::{self, RECEIPT, REPORT, Told};

/// Sub-folders are searched to this depth.
const DEPTH: usize = 64;
/// Result and receipt are put in their places one after the other. A best attempt that was renamed, linked or given away later than this
/// may be someone's by now: it may even have been dropped again.
const TOGETHER_NS: i64 = 60_000_000_000;

/// Where originals of each result go, and results.
const OUT: &str = "out";
const DONE: &str = "done";
const MIXED: [&str; 2] = ["failed", "quarantine"];

/// The files of a hot folder that may go.
#[derive(Debug, Default)]
pub(crate) struct Stock {
    /// In no order.
    pub pieces: Vec<Piece>,
    /// Originals that a kill left under a hidden name on their way to the archive.
    pub aside: Vec<PathBuf>,
}

impl Stock {
    /// That of the hot folder at `root`, as far as `keep` bounds it.
    ///
    /// # Errors
    /// When a folder cannot be read: what is in it is not known then.
    pub(crate) fn of(root: &Path, keep: &Keep) -> io::Result<Self> {
        let results = !(keep.results.is_open() && keep.reports.is_open());
        let originals = keep.archive().is_some();
        let mut stock = Self::default();
        if results || originals {
            let out = Area::read(root, OUT)?;
            if results {
                out.receipts().for_each(|(base, receipt)| out.told_by(&base, &receipt, &mut stock.pieces));
                out.summaries(&mut stock.pieces);
            }
            if originals {
                let done = Area::read(root, DONE)?;
                done.originals(&[], &mut stock);
                done.went_along(&out, &mut stock);
            }
        }
        for name in MIXED.iter().filter(|_| results || originals) {
            let area = Area::read(root, name)?;
            let mut told = Vec::new();
            area.receipts().for_each(|(base, receipt)| area.told_by(&base, &receipt, &mut told));
            if originals {
                area.originals(&told, &mut stock);
                area.went_along(&area, &mut stock);
            }
            if results {
                stock.pieces.extend(told);
            }
        }
        Ok(stock)
    }
}

/// Originals of the hot folder at `root` that a kill left under a hidden name, below it.
///
/// # Errors
/// When a folder cannot be read.
pub(crate) fn left_aside(root: &Path) -> io::Result<Vec<PathBuf>> {
    let mut all = Vec::new();
    for name in [DONE, MIXED[0], MIXED[1]] {
        let area = Area::read(root, name)?;
        let hidden = area.files.into_keys().filter(|path| path.file_name().is_some_and(is_aside));
        all.extend(hidden.map(|path| Path::new(name).join(path)));
    }
    Ok(all)
}

/// The files of one part of a hot folder.
struct Area {
    name: &'static str,
    root: PathBuf,
    /// By their names below it.
    files: BTreeMap<PathBuf, Identity>,
}

impl Area {
    fn read(root: &Path, name: &'static str) -> io::Result<Self> {
        let mut area = Self { name, root: root.join(name), files: BTreeMap::new() };
        area.walk(Path::new(""), DEPTH)?;
        Ok(area)
    }

    fn walk(&mut self, below: &Path, depth: usize) -> io::Result<()> {
        let entries = match std::fs::read_dir(self.root.join(below)) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            entries => entries?,
        };
        for entry in entries {
            let entry = entry?;
            let path = below.join(entry.file_name());
            let kind = entry.file_type()?;
            if kind.is_dir() {
                if depth > 0 && !is_hot(&self.root.join(&path))? {
                    self.walk(&path, depth - 1)?;
                }
            } else if kind.is_file()
                && let Some(found) = fsx::look(&self.root.join(&path))?
            {
                self.files.insert(path, found);
            }
        }
        Ok(())
    }

    /// Names that receipts stand beside, and what these say. One that cannot be read, or is of another version, says nothing.
    fn receipts(&self) -> impl Iterator<Item = (PathBuf, Told)> {
        self.files.keys().filter_map(|path| {
            let base = path.to_str()?.strip_suffix(RECEIPT)?;
            Some((PathBuf::from(base), receipt::read(&self.root.join(path))?))
        })
    }

    /// The files that a receipt beside `base` speaks of: its result, its report, and itself once the result is gone.
    fn told_by(&self, base: &Path, receipt: &Told, pieces: &mut Vec<Piece>) {
        let beside = with_suffix(base, RECEIPT);
        let Some(own) = self.files.get(&beside) else { return };
        let since = time(own.mtime_ns);
        let mut add = |what, path: &Path, bytes, hash| {
            pieces.push(Piece { what, path: Path::new(self.name).join(path), bytes, since, hash });
        };
        // A receipt that was moved elsewhere speaks of nothing here.
        let result = receipt.output.as_ref().zip(receipt.output_blake3).filter(|(output, _)| self.is_name_of(output, base));
        let there = result.and_then(|(output, hash)| Some((output.to_path(), hash, self.files.get(&output.to_path())?)));
        if let Some((path, hash, found)) = &there
            && self.is_no_original(path, found, own)
        {
            add(What::Result, path, found.size, Some(*hash));
        }
        let report = with_suffix(base, REPORT);
        if let Some((found, hash)) = self.files.get(&report).zip(receipt.report_blake3) {
            add(What::Report, &report, found.size, Some(hash));
        }
        if there.is_none() {
            add(What::Receipt, &beside, own.size, None);
        }
    }

    /// Summaries of orders, which no receipt speaks of.
    fn summaries(&self, pieces: &mut Vec<Piece>) {
        for (path, found) in &self.files {
            let name = path.file_name().unwrap_or_default().as_encoded_bytes();
            if name.starts_with(b"order.report") && name.ends_with(b".json") && summary::read(&self.root.join(path)).is_some() {
                let (path, since) = (Path::new(self.name).join(path), time(found.mtime_ns));
                pieces.push(Piece { what: What::Report, path, bytes: found.size, since, hash: None });
            }
        }
    }

    /// Is that how the result of `base` is called here?
    fn is_name_of(&self, output: &RelPath, base: &Path) -> bool {
        let Ok(base) = RelPath::from_path(base) else { return false };
        *output == if self.name == OUT { base } else { best_of(&base) }
    }

    /// Originals lie where best attempts do, and one may have been dropped again.
    fn is_no_original(&self, path: &Path, found: &Identity, receipt: &Identity) -> bool {
        let has_receipt = self.files.contains_key(&with_suffix(path, RECEIPT));
        self.name == OUT || (!has_receipt && found.ctime_ns <= receipt.ctime_ns.saturating_add(TOGETHER_NS))
    }

    /// Every mesh here that is none of `told`, and those that were left aside.
    fn originals(&self, told: &[Piece], stock: &mut Stock) {
        let told: BTreeSet<&Path> = told.iter().map(|piece| piece.path.as_path()).collect();
        for (path, found) in &self.files {
            let name = path.file_name().unwrap_or_default();
            let path = Path::new(self.name).join(path);
            if is_aside(name) {
                stock.aside.push(path);
            } else if name_kind(name) == NameKind::Mesh && !told.contains(path.as_path()) {
                // Moving it here changed its inode, and nothing else of it.
                let since = time(found.ctime_ns);
                stock.pieces.push(Piece { what: What::Original, path, bytes: found.size, since, hash: None });
            }
        }
    }
}

impl Area {
    /// Files here that are no meshes, and of which a receipt in the area `told` says that they went along with one.
    fn went_along(&self, told: &Self, stock: &mut Stock) {
        let mut known = BTreeSet::new();
        for (_, receipt) in told.receipts() {
            let Some(path) = receipt.original.as_ref().filter(|_| !receipt.stays).map(RelPath::to_path) else { continue };
            let is_other = path.file_name().is_some_and(|name| name_kind(name) == NameKind::Foreign);
            let is_it = |found: &&Identity| (found.size, Some(found.mtime_ns)) == (receipt.source_bytes, receipt.source_mtime_ns);
            let Some(found) = self.files.get(&path).filter(|_| is_other).filter(is_it) else { continue };
            let path = Path::new(self.name).join(path);
            if known.insert(path.clone()) {
                stock.pieces.push(Piece {
                    what: What::Original,
                    path,
                    bytes: found.size,
                    since: time(found.ctime_ns),
                    hash: None,
                });
            }
        }
    }
}

fn time(ns: i64) -> Time {
    Time(u64::try_from(ns / 1_000_000).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::keep::Bound;

    fn put(root: &Path, name: &str, bytes: &[u8]) {
        std::fs::create_dir_all(root.join(name).parent().unwrap()).unwrap();
        std::fs::write(root.join(name), bytes).unwrap();
    }

    fn receipt(root: &Path, base: &str, output: &str, content: &[u8]) {
        let hash = blake3::hash(content).to_hex();
        let text = format!(
            "{{\"receipt_version\":1,\"job\":1,\"output\":\"{output}\",\"output_blake3\":\"{hash}\",\"report_blake3\":\"{hash}\"}}"
        );
        put(root, &format!("{base}.suture.json"), text.as_bytes());
    }

    fn found(root: &Path) -> Vec<(What, String)> {
        let bound = Bound { age: Some(std::time::Duration::ZERO), size: None };
        let keep = Keep { results: bound, reports: bound, originals: bound, archive: Some("/a".into()), ..Keep::default() };
        let stock = Stock::of(root, &keep).unwrap();
        let mut found: Vec<_> = stock.pieces.into_iter().map(|piece| (piece.path.display().to_string(), piece.what)).collect();
        found.sort_by(|a, b| a.0.cmp(&b.0));
        found.into_iter().map(|(path, what)| (what, path)).collect()
    }

    #[test]
    fn only_what_a_receipt_speaks_of_is_a_result_or_a_report() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path();
        for name in
            ["out/a.stl", "out/a.stl.report.json", "out/mine.stl", "out/mine.stl.report.json", "done/a.stl", "done/notes.txt"]
        {
            put(root, name, b"x");
        }
        receipt(root, "out/a.stl", "a.stl", b"x");
        // A receipt that speaks of another name, or of one elsewhere; and one of nobody's.
        receipt(root, "out/b.stl", "mine.stl", b"x");
        receipt(root, "out/c.stl", "../done/a.stl", b"x");
        put(root, "out/d.stl.suture.json", b"{\"job\":1}");
        let expected =
            [(What::Result, "out/a.stl"), (What::Report, "out/a.stl.report.json"), (What::Receipt, "out/b.stl.suture.json")];
        let all = found(root);
        assert_eq!(all[0], (What::Original, "done/a.stl".into()));
        assert_eq!(all[1..], expected.map(|(what, name)| (what, name.to_owned())));
    }

    /// A best attempt that a person has moved back to `in/`, and that failed again, is an original.
    #[test]
    fn an_original_is_not_taken_for_a_best_attempt() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path();
        let best = |again: bool| {
            put(root, "failed/a.stl", b"original");
            put(root, "failed/a.best.stl", b"best");
            receipt(root, "failed/a.stl", "a.best.stl", b"best");
            if again {
                receipt(root, "failed/a.best.stl", "a.best.best.stl", b"other");
            }
            found(root).into_iter().find(|(_, path)| path == "failed/a.best.stl").unwrap().0
        };
        assert_eq!((best(false), best(true)), (What::Result, What::Original));
        // Touched long after its receipt.
        let area = Area::read(root, "failed").unwrap();
        let own = area.files[Path::new("a.stl.suture.json")];
        let touched = Identity { ctime_ns: own.ctime_ns + TOGETHER_NS + 1, ..own };
        assert!(!area.is_no_original(Path::new("x.stl"), &touched, &own));
        assert!(area.is_no_original(Path::new("x.stl"), &own, &own));
    }

    /// A texture is an original where a receipt says so, and it is the file that the receipt is of.
    #[test]
    fn files_that_went_along_are_originals() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path();
        let mtime_ns = |name: &str| fsx::look(&root.join(name)).unwrap().unwrap().mtime_ns;
        for name in ["done/a.png", "done/b.png", "done/mine.png", "failed/c.png"] {
            put(root, name, b"wood");
        }
        for (receipt, original, mtime_ns) in [
            ("out/a.png", "a.png", mtime_ns("done/a.png")),
            ("out/b.png", "b.png", mtime_ns("done/b.png") - 1),
            ("out/d.png", "../failed/c.png", mtime_ns("failed/c.png")),
            ("failed/c.png", "c.png", mtime_ns("failed/c.png")),
        ] {
            let text = format!(
                "{{\"receipt_version\":1,\"ending\":\"carried\",\"original\":\"{original}\",\"source_bytes\":4,\"source_mtime_ns\":{mtime_ns}}}"
            );
            put(root, &format!("{receipt}.suture.json"), text.as_bytes());
        }
        let originals: Vec<_> =
            found(root).into_iter().filter(|(what, _)| *what == What::Original).map(|(_, path)| path).collect();
        assert_eq!(originals, ["done/a.png", "failed/c.png"]);
    }

    #[test]
    fn a_receipt_stays_as_long_as_its_result() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path();
        put(root, "out/sub/a.stl", b"x");
        receipt(root, "out/sub/a.stl", "sub/a.stl", b"x");
        assert_eq!(found(root), [(What::Result, "out/sub/a.stl".into())]);
        std::fs::remove_file(root.join("out/sub/a.stl")).unwrap();
        assert_eq!(found(root), [(What::Receipt, "out/sub/a.stl.suture.json".into())]);
    }

    #[test]
    fn a_folder_that_is_not_there_is_empty_and_one_that_cannot_be_read_is_an_error() {
        let dir = tempfile::tempdir().unwrap();
        assert!(found(dir.path()).is_empty());
        put(dir.path(), "out", b"no folder");
        let keep = Keep { results: Bound { age: None, size: Some(1) }, ..Keep::default() };
        assert!(Stock::of(dir.path(), &keep).is_err());
        assert!(Stock::of(dir.path(), &Keep::default()).unwrap().pieces.is_empty(), "what has no bound is not looked at");
    }
}
