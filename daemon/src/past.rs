//! A job store that was begun anew: what earlier ones knew is read from what they left in the hot folders, before anything is taken there.
//! So a file that is finished is not done again, and one whose result was on its way is finished, not begun anew.
//!
//! A new store says that it lacks its past until every folder was read, over any number of lives, so that an older store costs nothing at a
//! start. Reading twice adds nothing: a receipt whose job is there is passed over. What is kept in memory is a path and two numbers for each
//! receipt; the time is that of reading each twice, and of a look at three names.

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use suture_store::job::Area;
use suture_store::{Job, JobId, JobStore, Past, Publication, Query, Reached, RelPath, StoreError, Token};

use crate::event::{Happening, Recovery};
use crate::event_bus::Bus;
use crate::folder::{Folder, is_hot};
use crate::fsx;
use crate::orders;
use crate::publish::RECEIPT_FILE;
use crate::publish_error::{PublishError, io_at};
use crate::receipt::{self, RECEIPT, Told};
use evidence::Evidence;

mod evidence;

/// Jobs that are read or taken in at a time.
const PAGE: usize = 1000;
/// Sub-folders are searched to this depth.
const DEPTH: usize = 64;

/// Hot folders in which an earlier store may have left something that was not read yet.
#[derive(Debug, Default)]
pub(crate) struct Unread(Mutex<BTreeSet<String>>);

/// Which jobs are taken in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Which {
    All,
    /// Those of which nothing is left to do: what is, is the daemon's, which knows how the folder is served.
    AtRest,
}

impl Unread {
    /// All of them, if the store was begun anew.
    ///
    /// # Errors
    /// Store errors only.
    pub(crate) fn of(store: &dyn JobStore, folders: &[Arc<Folder>]) -> Result<Self, StoreError> {
        let names =
            if store.is_unfilled()? { folders.iter().map(|folder| folder.name.clone()).collect() } else { BTreeSet::new() };
        Ok(Self(Mutex::new(names)))
    }

    fn names(&self) -> MutexGuard<'_, BTreeSet<String>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Is there anything in this folder that was not read?
    pub(crate) fn has(&self, folder: &Folder) -> bool {
        self.names().contains(&folder.name)
    }

    /// Reads what is in this folder, if that was not done; how many jobs came back. To be called when the folder is known to be there, and
    /// before anything of it is taken.
    ///
    /// # Errors
    /// Those of the store; where the folder cannot be read it is to be tried again, since what cannot be seen may be finished.
    pub(crate) fn read(&self, store: &dyn JobStore, folder: &Folder, bus: &Bus) -> Result<usize, PublishError> {
        if !self.has(folder) {
            return Ok(0);
        }
        orders::forget_mark(folder).map_err(io_at(&folder.root))?;
        let jobs = fill(store, folder, Which::All)?;
        if jobs > 0 {
            bus.tell(&Happening::StoreRecovered(Recovery::Receipts { folder: &folder.root, jobs }));
        }
        let mut names = self.names();
        names.remove(&folder.name);
        if names.is_empty() {
            store.set_filled()?;
        }
        Ok(jobs)
    }
}

/// Every job of a store, by number.
///
/// # Errors
/// Store errors only.
pub(crate) fn each_job(store: &dyn JobStore, each: &mut dyn FnMut(&Job)) -> Result<(), StoreError> {
    let mut after = JobId(0);
    loop {
        let page = store.list(&Query { after, limit: PAGE, ..Query::default() })?;
        let Some(last) = page.last() else { return Ok(()) };
        after = last.id;
        page.iter().for_each(&mut *each);
    }
}

/// The key that tells the result of a job from all others of its folder: the area, and the name that report and receipt are named after.
fn key(source: &RelPath, p: &Publication) -> (&'static str, RelPath) {
    (place_of(p.ending.area()), p.base().unwrap_or(source).clone())
}

/// Where results go whose originals go to this area.
fn place_of(area: Area) -> &'static str {
    match area {
        Area::In | Area::Done => "out",
        Area::Failed => "failed",
        Area::Quarantine => "quarantine",
    }
}

/// Takes the jobs of earlier stores in, as far as what lies in this folder tells of them, and they are not there; how many.
///
/// # Errors
/// As [`Unread::read`].
pub(crate) fn fill(store: &dyn JobStore, folder: &Folder, which: Which) -> Result<usize, PublishError> {
    let mut known = BTreeSet::new();
    each_job(store, &mut |job| {
        if job.source.folder == folder.name {
            // A job that is worked on once more has its receipt still.
            let earlier = job.moved_to.as_ref().map(|(area, path)| (place_of(*area), path.clone()));
            known.extend(job.publication().map(|publication| key(&job.source.path, publication)).into_iter().chain(earlier));
        }
    })?;
    let mut filling = Filling { store, folder, which, known, waiting: Vec::new(), taken: 0 };
    filling.placed()?;
    if which == Which::All {
        filling.on_the_way()?;
    }
    filling.take_in()?;
    Ok(filling.taken)
}

/// A receipt that was found: of a result whose original goes to `area`, by its path below where such results are.
struct Found {
    job: u64,
    written_ns: i64,
    area: Area,
    path: PathBuf,
}

struct Filling<'a> {
    store: &'a dyn JobStore,
    folder: &'a Folder,
    which: Which,
    known: BTreeSet<(&'static str, RelPath)>,
    waiting: Vec<Past>,
    taken: usize,
}

impl Filling<'_> {
    /// Those whose receipts are in their places.
    fn placed(&mut self) -> Result<(), PublishError> {
        let mut found = Vec::new();
        for area in [Area::Done, Area::Failed, Area::Quarantine] {
            receipts(&self.folder.root.join(place_of(area)), area, &mut found)?;
        }
        // Who had a number first keeps it.
        found.sort_by(|a, b| (a.job, a.written_ns, &a.path).cmp(&(b.job, b.written_ns, &b.path)));
        let mut seen = BTreeSet::from([0]);
        let (first, again): (Vec<_>, Vec<_>) = found.into_iter().partition(|found| seen.insert(found.job));
        let again = again.into_iter().map(|found| Found { job: 0, ..found });
        for Found { job, written_ns, area, path } in first.into_iter().chain(again) {
            let place = place_of(area);
            let full = self.folder.root.join(place).join(&path);
            let Some(base) = base_of(&path).filter(|base| !self.known.contains(&(place, base.clone()))) else { continue };
            let Some(told) = told(&full)? else { continue };
            let evidence = Evidence { folder: self.folder, told: &told, number: JobId(job), written_ns };
            if let Some(past) = evidence.of_placed(area, &base).map_err(io_at(&full))? {
                self.add(past)?;
            }
        }
        Ok(())
    }

    /// Those whose receipts are in the folders of their attempts still.
    fn on_the_way(&mut self) -> Result<(), PublishError> {
        let root = self.folder.work_root();
        let entries: Vec<_> = match std::fs::read_dir(&root).and_then(Iterator::collect) {
            // It is made where it is needed.
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            entries => entries.map_err(io_at(&root))?,
        };
        for entry in entries {
            let Some(token) = entry.file_name().to_str().and_then(|name| name.parse().ok()).map(Token) else { continue };
            let path = entry.path().join(RECEIPT_FILE);
            let Some(written) = fsx::look(&path).map_err(io_at(&path))? else { continue };
            let Some(told) = told(&path)?.filter(|told| told.work == Some(token)) else { continue };
            let evidence = Evidence { folder: self.folder, told: &told, number: JobId(told.job), written_ns: written.mtime_ns };
            if let Some(past) = evidence.of_attempt(token).map_err(io_at(&path))? {
                self.add(past)?;
            }
        }
        Ok(())
    }

    fn add(&mut self, past: Past) -> Result<(), PublishError> {
        let is_wanted = self.which == Which::All || past.reached == Reached::Ended;
        if !is_wanted || !self.known.insert(key(&past.source.path, &past.publication)) {
            return Ok(());
        }
        self.waiting.push(past);
        if self.waiting.len() >= PAGE { self.take_in() } else { Ok(()) }
    }

    fn take_in(&mut self) -> Result<(), PublishError> {
        let past = std::mem::take(&mut self.waiting);
        match self.store.restore(&past) {
            Ok(ids) => self.taken += ids.len(),
            Err(error) if error.is_callers() => {
                // One by one, to find out which.
                for one in past {
                    match self.store.restore(std::slice::from_ref(&one)) {
                        Ok(ids) => self.taken += ids.len(),
                        Err(error) if error.is_callers() => {
                            tracing::warn!(file = %one.source.path, %error, "A receipt's job is left out.");
                        }
                        Err(error) => return Err(error.into()),
                    }
                }
            }
            Err(error) => return Err(error.into()),
        }
        Ok(())
    }
}

/// The receipts below `root`.
fn receipts(root: &Path, area: Area, found: &mut Vec<Found>) -> Result<(), PublishError> {
    let mut paths = Vec::new();
    walk(root, Path::new(""), DEPTH, &mut paths).map_err(io_at(root))?;
    for path in paths {
        let full = root.join(&path);
        let written = fsx::look(&full).map_err(io_at(&full))?;
        if let (Some(told), Some(written)) = (told(&full)?, written) {
            found.push(Found { job: told.job, written_ns: written.mtime_ns, area, path });
        }
    }
    Ok(())
}

/// The receipt in a file. One that says nothing is named once; one that cannot be read now is an error.
fn told(path: &Path) -> Result<Option<Told>, PublishError> {
    use io::ErrorKind::{InvalidData, NotFound, PermissionDenied, UnexpectedEof};
    match receipt::try_read(path) {
        Ok(told) => Ok(Some(told)),
        Err(error) if error.kind() == NotFound => Ok(None),
        Err(error) if matches!(error.kind(), InvalidData | PermissionDenied | UnexpectedEof) => {
            tracing::warn!(file = %path.display(), %error, "A receipt is left out: it cannot be understood.");
            Ok(None)
        }
        Err(error) => Err(io_at(path)(error)),
    }
}

/// The name that a receipt of this name is of.
fn base_of(receipt: &Path) -> Option<RelPath> {
    let bytes = RelPath::from_path(receipt).ok()?;
    RelPath::new(bytes.as_bytes().strip_suffix(RECEIPT.as_bytes())?).ok()
}

/// The names of receipts below a folder, none where there is no such folder. O(names in it).
fn walk(root: &Path, below: &Path, depth: usize, found: &mut Vec<PathBuf>) -> io::Result<()> {
    let entries = match std::fs::read_dir(root.join(below)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied && !below.as_os_str().is_empty() => {
            tracing::warn!(folder = %root.join(below).display(), %error, "Receipts in a sub-folder are left out.");
            return Ok(());
        }
        entries => entries?,
    };
    for entry in entries {
        let entry = entry?;
        let path = below.join(entry.file_name());
        let kind = entry.file_type()?;
        if kind.is_dir() && depth > 0 && !is_hot(&root.join(&path))? {
            walk(root, &path, depth - 1, found)?;
        } else if kind.is_file() && path.as_os_str().as_encoded_bytes().ends_with(RECEIPT.as_bytes()) {
            found.push(path);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
