//! Bringing a finished job's files into place, so that whatever happens in between, there is exactly one result:
//!
//! ```text
//! files durable under temporary names ─► intent durable in the store ─► output renamed ─► report ─► receipt ─► folder synced
//!   ─► published ─► original moved ─► both folders synced ─► done ─► attempt's folder removed
//! ```
//! Nothing is ever replaced. The first of the renames decides who owns a name; who loses it chooses another and says so in a new
//! intent. Each step looks at what is there before it acts, so that the same code finishes what a killed daemon began.

use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;
use suture_core::Report;
use suture_core::report::Outcome;
use suture_store::{Claim, Ending, Hash, Job, JobStore, Publication, RelPath, State, Step, StoreError, crash_point};

use crate::folder::{Folder, make_parent};
use crate::fsx::{self, Identity};
use crate::receipt::{NoReport, RECEIPT, REPORT, Receipt};

/// Names of an attempt's files in its folder. Plain, whatever the dropped file is called.
pub(crate) const CLAIMED: &str = "in.stl";
pub(crate) const OUTPUT: &str = "out.stl";
const REPORT_FILE: &str = "report.json";
const RECEIPT_FILE: &str = "receipt.json";
/// What the longest companion adds to a name.
const COMPANION: usize = RECEIPT.len();
/// Marks the best attempt at a file that could not be made good.
const BEST: &str = ".best";
/// Free names are looked for this far.
const VERSIONS: u32 = 100_000;

/// Why a job could not be brought further.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PublishError {
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The state says what is to be done; it can be tried again at any time.
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: io::Error },
}

fn io_at(path: &Path) -> impl FnOnce(io::Error) -> PublishError {
    let path = path.to_owned();
    move |source| PublishError::Io { path, source }
}

/// What came of the work, before names are chosen.
pub(crate) enum Conclusion {
    /// The engine's report; the output, if any, is in the attempt's folder.
    Report(Box<Report>),
    /// No report of the engine's.
    None { ending: Ending, reason: String },
}

/// One job at the end of its way.
pub(crate) struct Desk<'a> {
    pub store: &'a dyn JobStore,
    pub folder: &'a Folder,
    pub claim: &'a Claim,
}

impl Desk<'_> {
    fn work(&self, job: &Job) -> PathBuf {
        self.folder.work(job.work.unwrap_or(self.claim.token))
    }

    /// Writes report and receipt, chooses names, and makes the intent durable.
    pub(crate) fn intend(&self, job: &Job, result: &Conclusion) -> Result<Job, PublishError> {
        let work = self.work(job);
        std::fs::create_dir_all(&work).map_err(io_at(&work))?;
        let publication = self.prepare(job, result)?;
        fsx::sync_dir(&work).map_err(io_at(&work))?;
        crash_point("daemon.result_durable");
        let job = self.store.advance(self.claim, Step::Intend(publication))?;
        crash_point("daemon.intent_durable");
        Ok(job)
    }

    /// The intent; its files are in the attempt's folder, synced.
    fn prepare(&self, job: &Job, result: &Conclusion) -> Result<Publication, PublishError> {
        let work = self.work(job);
        let (ending, reason, output_hash, input_hash) = match result {
            Conclusion::None { ending, reason } => (*ending, reason.clone(), None, None),
            Conclusion::Report(report) => {
                let ending = ending_of(report);
                let reason = if ending.is_good() { String::new() } else { report.verdict.reasons.join("; ") };
                let output = report.output.as_ref().and_then(|facts| facts.blake3.parse::<Hash>().ok());
                (ending, reason, output, report.input.blake3.parse::<Hash>().ok())
            }
        };
        let reason = suture_store::job::one_line(&reason);
        let names = self.names(job, ending, output_hash.is_some())?;
        let target = if ending.is_good() { self.folder.out() } else { self.folder.area(ending.area()) };
        let shown_source = self.folder.inbox().join(job.source.path.to_path()).display().to_string();
        let report_path = work.join(REPORT_FILE);
        match result {
            Conclusion::None { .. } => rewrite(&report_path, &NoReport::new(job, shown_source, ending, &reason))?,
            Conclusion::Report(report) => {
                let mut report = report.clone();
                report.input.path = shown_source.into();
                if let (Some(facts), Some(name)) = (&mut report.output, &names.output) {
                    facts.path = target.join(name.to_path()).display().to_string().into();
                }
                rewrite(&report_path, &report)?;
            }
        }
        let report_hash = hash_of(&report_path)?;
        let publication = Publication {
            ending,
            reason,
            output: names.output,
            output_hash,
            report_hash: Some(report_hash),
            original: Some(names.original),
        };
        self.write_receipt(job, &publication, input_hash)?;
        Ok(publication)
    }

    fn write_receipt(&self, job: &Job, p: &Publication, source_blake3: Option<Hash>) -> Result<(), PublishError> {
        let hold = job.hold().copied();
        let receipt = Receipt {
            receipt_version: 1,
            job: job.id.0,
            attempt: job.attempts.0,
            epoch: hold.map_or(0, |hold| hold.epoch.0),
            engine_version: env!("CARGO_PKG_VERSION"),
            ending: p.ending,
            reason: &p.reason,
            folder: &job.source.folder,
            source: job.source.path.to_string(),
            source_bytes: job.source.size,
            source_blake3,
            profile: &job.source.profile,
            output: p.output.as_ref().map(ToString::to_string),
            output_blake3: p.output_hash,
            report_blake3: p.report_hash,
        };
        rewrite(&self.work(job).join(RECEIPT_FILE), &receipt)
    }

    /// The first free names for a result.
    fn names(&self, job: &Job, ending: Ending, output: bool) -> Result<Names, PublishError> {
        let (now_area, now_path) = job.original();
        let area = self.folder.area(ending.area());
        let here = |path: &RelPath| now_area == ending.area() && now_path == path;
        let original_free = |path: &RelPath| here(path) || !fsx::exists(&area.join(path.to_path()));
        let alone = |base: &Path, path: &RelPath| companions(path).iter().all(|name| !fsx::exists(&base.join(name)));
        if ending.is_good() {
            let out = self.folder.out();
            let free = |path: &RelPath| !fsx::exists(&out.join(path.to_path())) && alone(&out, path);
            let result = first(&job.source.path, COMPANION, free)?;
            return Ok(Names { output: Some(result), original: first(&job.source.path, 0, original_free)? });
        }
        let path = if now_area == ending.area() { now_path } else { &job.source.path };
        let original = first(path, COMPANION + BEST.len(), |path| {
            original_free(path) && alone(&area, path) && !fsx::exists(&area.join(best_of(path).to_path()))
        })?;
        Ok(Names { output: output.then(|| best_of(&original)), original })
    }

    /// Renames the files of the intent into place.
    pub(crate) fn place(&self, job: &Job) -> Result<Job, PublishError> {
        let State::Publishing { publication, .. } = &job.state else { return Ok(job.clone()) };
        let work = self.work(job);
        let (area, base) = self.base(job, publication);
        let beside = |suffix: &str| area.join(with_suffix(&base, suffix));
        let mut items = Vec::new();
        if let (Some(output), Some(hash)) = (&publication.output, publication.output_hash) {
            items.push((work.join(OUTPUT), area.join(output.to_path()), Some(hash), "daemon.output_placed"));
        }
        items.push((work.join(REPORT_FILE), beside(REPORT), publication.report_hash, "daemon.report_placed"));
        items.push((work.join(RECEIPT_FILE), beside(RECEIPT), None, "daemon.receipt_placed"));
        for (i, (from, to, hash, point)) in items.iter().enumerate() {
            make_parent(to).map_err(io_at(to))?;
            match place_one(from, to, *hash)? {
                Placed::Now => crash_point(point),
                Placed::Before => {}
                Placed::Taken if i == 0 => return self.choose_again(job, publication),
                Placed::Taken => self.place_beside(from, to)?,
                Placed::Missing if i == 0 => return Ok(self.store.advance(self.claim, Step::Lost)?),
                // Renamed by an earlier life, and taken away since.
                Placed::Missing => {}
            }
        }
        if let Some((_, to, ..)) = items.first() {
            let folder = fsx::folder_of(to);
            fsx::sync_dir(folder).map_err(io_at(folder))?;
        }
        crash_point("daemon.folder_synced");
        let job = self.store.advance(self.claim, Step::Placed)?;
        crash_point("daemon.published");
        Ok(job)
    }

    /// Someone took the name of the intent: another one, said in a new intent. Report and receipt are written anew, since they
    /// name it.
    fn choose_again(&self, job: &Job, old: &Publication) -> Result<Job, PublishError> {
        let names = self.names(job, old.ending, old.output.is_some())?;
        let work = self.work(job);
        let path = work.join(REPORT_FILE);
        let mut report: serde_json::Value =
            std::fs::read(&path).and_then(|bytes| Ok(serde_json::from_slice(&bytes)?)).map_err(io_at(&path))?;
        let (area, _) = self.base(job, old);
        if let (Some(shown), Some(name)) = (report.pointer_mut("/output/path"), &names.output) {
            *shown = area.join(name.to_path()).display().to_string().into();
        }
        let input_hash = report.pointer("/input/blake3").and_then(|v| v.as_str()).and_then(|text| text.parse().ok());
        rewrite(&path, &report)?;
        let publication = Publication {
            output: names.output,
            original: Some(names.original),
            report_hash: Some(hash_of(&path)?),
            ..old.clone()
        };
        self.write_receipt(job, &publication, input_hash)?;
        fsx::sync_dir(&work).map_err(io_at(&work))?;
        let job = self.store.advance(self.claim, Step::Intend(publication))?;
        crash_point("daemon.intent_renewed");
        Ok(job)
    }

    /// A stranger has the name of a report or receipt: the next free one.
    fn place_beside(&self, from: &Path, to: &Path) -> Result<(), PublishError> {
        let name = to.file_name().unwrap_or_default();
        for n in 2..VERSIONS {
            let to = to.with_file_name(fsx::versioned(name, n, 0));
            if let Placed::Now = place_one(from, &to, None)? {
                tracing::warn!(file = %to.display(), "The name of a report was taken; it got another.");
                return Ok(());
            }
        }
        Err(no_free_name(to))
    }

    /// Where the result's files stand, and the name that report and receipt are named after.
    fn base(&self, job: &Job, p: &Publication) -> (PathBuf, PathBuf) {
        let original = || p.original.as_ref().unwrap_or(&job.source.path).to_path();
        match (&p.output, p.ending.is_good()) {
            (Some(output), true) => (self.folder.out(), output.to_path()),
            (None, true) => (self.folder.out(), original()),
            (_, false) => (self.folder.area(p.ending.area()), original()),
        }
    }

    /// Moves the original to the area of the ending. Only the file that was worked on is moved: what took its name meanwhile is
    /// a new drop, and then the claimed link is the original.
    pub(crate) fn move_original(&self, job: &Job) -> Result<Job, PublishError> {
        let State::Published { publication, .. } = &job.state else { return Ok(job.clone()) };
        let Some(wanted) = &publication.original else { return Ok(self.store.advance(self.claim, Step::Finished)?) };
        let (from_area, from_path) = job.original();
        let from = self.folder.area(from_area).join(from_path.to_path());
        let area = self.folder.area(publication.ending.area());
        let to = area.join(wanted.to_path());
        if from != to {
            make_parent(&to).map_err(io_at(&to))?;
            match self.move_one(job, &from, &to) {
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {
                    let other = first(wanted, 0, |path| !fsx::exists(&area.join(path.to_path())))?;
                    return Ok(self.store.advance(self.claim, Step::Redirect { original: other })?);
                }
                other => other.map_err(io_at(&to))?,
            }
            crash_point("daemon.original_moved");
            for folder in [fsx::folder_of(&to), fsx::folder_of(&from)] {
                match fsx::sync_dir(folder) {
                    Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(io_at(folder)(e)),
                    _ => {}
                }
            }
        }
        crash_point("daemon.original_durable");
        let job = self.store.advance(self.claim, Step::Finished)?;
        crash_point("daemon.done");
        Ok(job)
    }

    fn move_one(&self, job: &Job, from: &Path, to: &Path) -> io::Result<()> {
        let ours = |path: &Path| Identity::of(path).is_ok_and(|found| is_source(&found, job));
        if ours(to) {
            // Moved by an earlier life of the daemon; where moving is linking and unlinking, perhaps not to its end.
            return if ours(from) { std::fs::remove_file(from) } else { Ok(()) };
        }
        if ours(from) {
            fsx::rename_new(from, to)?;
            if ours(to) {
                return Ok(());
            }
            // Someone replaced it in the instant between. It is theirs: back with it.
            fsx::rename_new(to, from)?;
        }
        let claimed = self.work(job).join(CLAIMED);
        if fsx::exists(&claimed) {
            return fsx::rename_new(&claimed, to);
        }
        tracing::warn!(file = %from.display(), "The original is gone; someone took it away.");
        Ok(())
    }
}

struct Names {
    output: Option<RelPath>,
    original: RelPath,
}

/// Is this the file that the job was submitted for?
pub(crate) fn is_source(found: &Identity, job: &Job) -> bool {
    let source = &job.source;
    (found.dev, found.ino, found.size, found.mtime_ns) == (source.dev, source.ino, source.size, source.mtime_ns)
}

/// What the engine's outcome means for the file.
fn ending_of(report: &Report) -> Ending {
    match report.outcome {
        Outcome::Clean => Ending::Clean,
        Outcome::Repaired => Ending::Repaired,
        Outcome::NeedsReview => Ending::NeedsReview,
        Outcome::NotGood => Ending::NotGood,
    }
}

enum Placed {
    Now,
    Before,
    Taken,
    Missing,
}

/// Gives one file its name, unless it has it already. A file that still has its temporary name was not placed, whatever stands
/// under the other: equal bytes may be another job's.
fn place_one(from: &Path, to: &Path, hash: Option<Hash>) -> Result<Placed, PublishError> {
    let Ok(temporary) = Identity::of(from) else {
        if !fsx::exists(to) {
            return Ok(Placed::Missing);
        }
        let same = match hash {
            Some(hash) => hash_of(to)? == hash,
            None => true,
        };
        return Ok(if same { Placed::Before } else { Placed::Missing });
    };
    if let Some(hash) = hash
        && hash_of(from)? != hash
    {
        return Ok(Placed::Missing);
    }
    fsx::fit_in(from, fsx::folder_of(to)).map_err(io_at(from))?;
    match fsx::rename_new(from, to) {
        Ok(()) => Ok(Placed::Now),
        Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {
            if Identity::of(to).is_ok_and(|found| (found.dev, found.ino) == (temporary.dev, temporary.ino)) {
                // Linked, but not yet unlinked.
                std::fs::remove_file(from).map_err(io_at(from))?;
                return Ok(Placed::Before);
            }
            Ok(Placed::Taken)
        }
        Err(e) => Err(io_at(to)(e)),
    }
}

fn hash_of(path: &Path) -> Result<Hash, PublishError> {
    let text = fsx::hash(path).map_err(io_at(path))?;
    text.parse().map_err(|reason: &str| io_at(path)(io::Error::other(reason)))
}

fn rewrite<T: Serialize>(path: &Path, value: &T) -> Result<(), PublishError> {
    fsx::remove_if_there(path).and_then(|()| fsx::write_new_json(path, value, true)).map_err(io_at(path))
}

/// The first version of a name that is free; `reserve` bytes are left for what is appended to it.
fn first(path: &RelPath, reserve: usize, free: impl Fn(&RelPath) -> bool) -> Result<RelPath, PublishError> {
    let full = path.to_path();
    for n in 1..VERSIONS {
        let name = fsx::versioned(full.file_name().unwrap_or_default(), n, reserve);
        let Ok(candidate) = RelPath::from_path(&full.with_file_name(name)) else { break };
        if free(&candidate) {
            return Ok(candidate);
        }
    }
    Err(no_free_name(&full))
}

fn no_free_name(path: &Path) -> PublishError {
    io_at(path)(io::Error::new(io::ErrorKind::AlreadyExists, "no free name is left"))
}

/// Names of the report and the receipt of `path`.
fn companions(path: &RelPath) -> [PathBuf; 2] {
    [REPORT, RECEIPT].map(|suffix| with_suffix(&path.to_path(), suffix))
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

/// `part.stl` → `part.best.stl`.
fn best_of(path: &RelPath) -> RelPath {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::FolderConfig;
    use std::sync::Arc;
    use suture_store::{Filter, MemoryStore, Source, Submission, SystemClock};

    /// A hot folder with one dropped file, claimed and linked, as an attempt leaves it to the desk.
    struct Scene {
        _dir: tempfile::TempDir,
        folder: Folder,
        store: MemoryStore,
        claim: Claim,
    }

    const ORIGINAL: &[u8] = b"as dropped";
    const REPAIRED: &[u8] = b"as repaired";

    impl Scene {
        fn new() -> Self {
            let dir = tempfile::tempdir().unwrap();
            let config = FolderConfig { name: "hot".into(), path: dir.path().into(), profile: "default".into() };
            let folder = Folder::open(&config).unwrap();
            let path = folder.inbox().join("part.stl");
            fsx::write_new(&path, ORIGINAL).unwrap();
            let found = Identity::of(&path).unwrap();
            let source = Source {
                folder: "hot".into(),
                path: RelPath::new(*b"part.stl").unwrap(),
                dev: found.dev,
                ino: found.ino,
                size: found.size,
                mtime_ns: found.mtime_ns,
                profile: "default".into(),
            };
            let store = MemoryStore::new(Arc::new(SystemClock));
            store.submit(&[Submission { source, foreign: None }]).unwrap();
            let claim = store.claim(&Filter::default()).unwrap().unwrap();
            let work = folder.work(claim.token);
            std::fs::create_dir(&work).unwrap();
            std::fs::hard_link(&path, work.join(CLAIMED)).unwrap();
            Self { _dir: dir, folder, store, claim }
        }

        fn desk(&self) -> Desk<'_> {
            Desk { store: &self.store, folder: &self.folder, claim: &self.claim }
        }

        /// A good result, intended.
        fn intended(&self) -> Job {
            let output = self.folder.work(self.claim.token).join(OUTPUT);
            fsx::write_new(&output, REPAIRED).unwrap();
            let mut report = crate::table::tests::sample(Outcome::Repaired);
            report.output.as_mut().unwrap().blake3 = fsx::hash(&output).unwrap();
            self.desk().intend(&self.claim.job, &Conclusion::Report(Box::new(report))).unwrap()
        }

        /// Does what is owed until nothing is.
        fn finish(&self, mut job: Job) -> Job {
            loop {
                job = match &job.state {
                    State::Publishing { .. } => self.desk().place(&job).unwrap(),
                    State::Published { .. } => self.desk().move_original(&job).unwrap(),
                    _ => return job,
                };
            }
        }

        fn read(&self, path: &str) -> Vec<u8> {
            std::fs::read(self.folder.root.join(path)).unwrap_or_default()
        }
    }

    #[test]
    fn a_good_result_with_report_and_receipt() {
        let scene = Scene::new();
        let job = scene.finish(scene.intended());
        assert_eq!(job.kind(), suture_store::job::Kind::Done);
        assert_eq!(scene.read("out/part.stl"), REPAIRED);
        assert_eq!(scene.read("done/part.stl"), ORIGINAL);
        assert!(!fsx::exists(&scene.folder.inbox().join("part.stl")));
        let report: Report = serde_json::from_slice(&scene.read("out/part.stl.report.json")).unwrap();
        assert_eq!(report.output.unwrap().path, scene.folder.out().join("part.stl"));
        let receipt: serde_json::Value = serde_json::from_slice(&scene.read("out/part.stl.suture.json")).unwrap();
        assert_eq!(receipt["output"], "part.stl");
        assert_eq!(receipt["output_blake3"], fsx::hash(&scene.folder.out().join("part.stl")).unwrap());
    }

    /// The name is taken after it was chosen, even by the very same bytes: they are someone else's.
    #[test]
    fn a_name_that_is_taken_meanwhile_is_not_touched() {
        let scene = Scene::new();
        let job = scene.intended();
        fsx::write_new(&scene.folder.out().join("part.stl"), REPAIRED).unwrap();
        fsx::write_new(&scene.folder.area(suture_store::job::Area::Done).join("part.stl"), b"earlier").unwrap();
        let job = scene.finish(job);
        assert_eq!(scene.read("out/part~2.stl"), REPAIRED);
        assert_eq!(scene.read("done/part.stl"), b"earlier");
        assert_eq!(scene.read("done/part~2.stl"), ORIGINAL);
        let report: Report = serde_json::from_slice(&scene.read("out/part~2.stl.report.json")).unwrap();
        assert_eq!(report.output.unwrap().path, scene.folder.out().join("part~2.stl"));
        let State::Ended { publication } = job.state else { panic!("{:?}", job.state) };
        assert_eq!(publication.output.unwrap().name(), b"part~2.stl");
    }

    /// A new drop of the same name while the old one is worked on: each is its own.
    #[test]
    fn a_new_drop_of_the_same_name_stays() {
        let scene = Scene::new();
        let job = scene.intended();
        let path = scene.folder.inbox().join("part.stl");
        std::fs::remove_file(&path).unwrap();
        fsx::write_new(&path, b"another").unwrap();
        scene.finish(job);
        assert_eq!(scene.read("in/part.stl"), b"another");
        assert_eq!(scene.read("done/part.stl"), ORIGINAL);
    }

    /// What a killed daemon had begun is found, not begun anew.
    #[test]
    fn placing_twice_is_placing_once() {
        let scene = Scene::new();
        let job = scene.intended();
        let work = scene.folder.work(scene.claim.token);
        fsx::rename_new(&work.join(OUTPUT), &scene.folder.out().join("part.stl")).unwrap();
        let done = scene.finish(job);
        assert_eq!(done.kind(), suture_store::job::Kind::Done);
        assert_eq!(std::fs::read_dir(scene.folder.out()).unwrap().count(), 3, "mesh, report, receipt");
    }

    /// Neither under its temporary name nor in place: the work is done again.
    #[test]
    fn a_lost_result_is_made_again() {
        let scene = Scene::new();
        let job = scene.intended();
        std::fs::remove_file(scene.folder.work(scene.claim.token).join(OUTPUT)).unwrap();
        let job = scene.finish(job);
        assert!(job.kind().is_queued(), "{:?}", job.state);
        assert_eq!(scene.read("in/part.stl"), ORIGINAL);
    }

    #[test]
    fn a_file_without_a_result_fails_with_a_reason() {
        let scene = Scene::new();
        let conclusion = Conclusion::None { ending: Ending::Unreadable, reason: "a picture".into() };
        let job = scene.finish(scene.desk().intend(&scene.claim.job, &conclusion).unwrap());
        assert_eq!(job.kind(), suture_store::job::Kind::Failed);
        assert_eq!(scene.read("failed/part.stl"), ORIGINAL);
        let report: serde_json::Value = serde_json::from_slice(&scene.read("failed/part.stl.report.json")).unwrap();
        assert_eq!((&report["outcome"], &report["reason"]), (&"unreadable".into(), &"a picture".into()));
        assert_eq!(std::fs::read_dir(scene.folder.out()).unwrap().count(), 0);
    }
}
