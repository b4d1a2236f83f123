//! The same content again: a job whose file has the content, the settings and the engine of an earlier good result publishes a copy of
//! that result, under its own name, and nothing is computed.
//!
//! A result is taken for another file only if all of it stands as it was published: the job is done, its report has the recorded hash and
//! names the very content, settings and engine version, and the copy that was made of its file, read back, has the recorded hash. Whatever
//! else is found, or fails, the file is worked on as any other.
//!
//! **A copy, never a second name.** People edit, move and delete what lies in `out/`. With a hard link one result would change with the
//! other, under a receipt that says something else. Blocks are shared where the file system can (a reflink): writing to one of the two gives
//! it blocks of its own, so that this is a copy like any other.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::sync::Arc;

use suture_core::{Profile, Report};
use suture_store::{Hash, Job, JobStore, Recipe, State, StoreError, crash_point};

use crate::claim::Original;
use crate::create;
use crate::folder::Folder;
use crate::fsx::{self, Identity};
use crate::names::companions;
use crate::receipt::ReusedFrom;

/// The engine whose results are taken.
const ENGINE: &str = env!("CARGO_PKG_VERSION");

/// A copy of an earlier result, synced and read back.
pub(crate) struct Copied {
    /// That of the earlier job.
    pub report: Box<Report>,
    pub written: Identity,
    pub from: ReusedFrom,
}

/// What is sought: a result for the content of a claimed file.
pub(crate) struct Sought<'a> {
    pub store: &'a dyn JobStore,
    pub folders: &'a [Arc<Folder>],
    pub job: &'a Job,
    pub profile: &'a Profile,
}

impl Sought<'_> {
    /// Looks for an earlier result for the file `claimed`, and copies it to `to`, a new file. `None`: there is none, it does not stand as it
    /// was published, or `stop` said so. The file is read only if there is a result for one of its size.
    ///
    /// # Errors
    /// Those of the store only.
    pub(crate) fn copy(&self, claimed: &Path, to: &Path, stop: &dyn Fn() -> bool) -> Result<Option<Copied>, StoreError> {
        let size = self.job.source.size;
        if self.store.results(size, None)?.is_empty() {
            return Ok(None);
        }
        // What cannot be read, the engine will say.
        let Ok(content) = hash_unless(claimed, stop) else { return Ok(None) };
        for earlier in self.store.results(size, Some(recipe(&content.to_string(), self.profile, ENGINE)))? {
            match self.take(&earlier, content, to) {
                Ok(Some(copied)) => return Ok(Some(copied)),
                Ok(None) => {}
                Err(error) => tracing::debug!(%error, earlier = earlier.id.0, "An earlier result cannot be reused."),
            }
            if let Err(error) = fsx::remove_if_there(to) {
                tracing::debug!(%error, "The rest of a copy stays until the work folder goes.");
                return Ok(None);
            }
        }
        Ok(None)
    }

    /// Copies the result of this job, if it is what is sought and stands as it was published.
    fn take(&self, earlier: &Job, content: Hash, to: &Path) -> io::Result<Option<Copied>> {
        let State::Ended { publication } = &earlier.state else { return Ok(None) };
        let Some(folder) = self.folders.iter().find(|folder| folder.name == earlier.source.folder) else { return Ok(None) };
        let (Some(output), Some(hash), Some(report_hash)) =
            (&publication.output, publication.output_hash, publication.report_hash)
        else {
            return Ok(None);
        };
        if !publication.ending.is_good() || folder.check().is_err() {
            return Ok(None);
        }
        let [report, _] = companions(output).map(|name| folder.out().join(name));
        let Some(report) = read_report(&report, report_hash)?.filter(|report| self.is_of(report, content, hash)) else {
            return Ok(None);
        };
        let original = Original::open(&folder.out().join(output.to_path()))?;
        create::copy_content(original.file(), to)?.sync_all()?;
        if fsx::hash(to)? != hash {
            return Ok(None);
        }
        crash_point("daemon.reused");
        let from = ReusedFrom { job: earlier.id, folder: folder.name.clone(), output: output.to_string() };
        Ok(Some(Copied { report: Box::new(report), written: Identity::of(to)?, from }))
    }

    /// Is it a report on this content under these settings by this engine, with that result?
    fn is_of(&self, report: &Report, content: Hash, output: Hash) -> bool {
        let written = report.output.as_ref().is_some_and(|facts| facts.blake3.parse() == Ok(output));
        let read = report.input.blake3.parse() == Ok(content);
        written && read && report.outcome.is_good() && report.profile == *self.profile && report.engine_version == ENGINE
    }
}

/// The recipe of the result that a report is on.
pub(crate) fn recipe_of(report: &Report) -> Recipe {
    recipe(&report.input.blake3, &report.profile, &report.engine_version)
}

/// A digest of all that decides a result: the content of the file (its hash), the settings, the engine.
fn recipe(content: &str, profile: &Profile, engine: &str) -> Recipe {
    let settings = serde_json::to_string(profile).unwrap_or_default();
    let mut hasher = blake3::Hasher::new();
    for part in [content, &settings, engine] {
        hasher.update(&(part.len() as u64).to_be_bytes());
        hasher.update(part.as_bytes());
    }
    let [a, b, c, d, e, f, g, h, ..] = *hasher.finalize().as_bytes();
    Recipe(u64::from_be_bytes([a, b, c, d, e, f, g, h]))
}

/// A report as it was published.
fn read_report(path: &Path, hash: Hash) -> io::Result<Option<Report>> {
    let mut bytes = Vec::new();
    create::open_to_read(path)?.read_to_end(&mut bytes)?;
    if blake3::hash(&bytes).as_bytes() != &hash.0 {
        return Ok(None);
    }
    Ok(serde_json::from_slice(&bytes).ok())
}

/// BLAKE3 of a file's bytes; an error of kind `Interrupted` as soon as `stop` says so.
///
/// # Errors
/// As `open` and `read`.
pub(crate) fn hash_unless(path: &Path, stop: &dyn Fn() -> bool) -> io::Result<Hash> {
    let mut hasher = blake3::Hasher::new();
    let mut file = File::open(path)?;
    let mut buffer = vec![0; 1 << 20];
    loop {
        if stop() {
            return Err(io::ErrorKind::Interrupted.into());
        }
        match file.read(&mut buffer)? {
            0 => return Ok(Hash(*hasher.finalize().as_bytes())),
            read => drop(hasher.update(buffer.get(..read).unwrap_or_default())),
        };
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::MetadataExt;

    use suture_core::report::Outcome;
    use suture_store::{Ending, Filter, MemoryStore, Priority, Publication, RelPath, Seen, Source, Step, Submission};

    use super::*;
    use crate::config::FolderConfig;

    const DROPPED: &[u8] = b"as dropped";
    const REPAIRED: &[u8] = b"as repaired";

    fn hash(bytes: &[u8]) -> Hash {
        Hash(*blake3::hash(bytes).as_bytes())
    }

    /// A hot folder with one job that is done, and a claimed file of the same content.
    struct Kitchen {
        dir: tempfile::TempDir,
        folders: Vec<Arc<Folder>>,
        store: MemoryStore,
        profile: Profile,
        job: Job,
    }

    impl Kitchen {
        fn new(ending: Ending, change: impl Fn(&mut Report)) -> Self {
            let dir = tempfile::tempdir().unwrap();
            let folder = Folder::open(&FolderConfig { name: "hot".into(), ..FolderConfig::of(dir.path()) }, None).unwrap();
            let mut report = crate::table::tests::sample(Outcome::Repaired);
            (report.engine_version, report.profile) = (ENGINE.into(), Profile::default());
            report.input.blake3 = hash(DROPPED).to_string();
            report.output.as_mut().unwrap().blake3 = hash(REPAIRED).to_string();
            change(&mut report);
            let report_bytes = serde_json::to_vec(&report).unwrap();
            create::write_new(&folder.out().join("part.stl"), REPAIRED).unwrap();
            create::write_new(&folder.out().join("part.stl.report.json"), &report_bytes).unwrap();
            create::write_new(&dir.path().join("claimed"), DROPPED).unwrap();
            let store = MemoryStore::default();
            let source = Source {
                folder: "hot".into(),
                path: RelPath::new(*b"part.stl").unwrap(),
                dev: 1,
                ino: 2,
                size: DROPPED.len() as u64,
                mtime_ns: 3,
                profile: "default".into(),
            };
            store.submit(&[Submission { source, foreign: None, priority: Priority::default(), seen: Seen::Now }]).unwrap();
            let claim = store.claim(&Filter::default()).unwrap().unwrap();
            let publication = Publication {
                ending,
                reason: String::new(),
                output: Some(claim.job.source.path.clone()),
                output_hash: Some(hash(REPAIRED)),
                report_hash: Some(hash(&report_bytes)),
                recipe: Some(recipe(&hash(DROPPED).to_string(), &Profile::default(), ENGINE)),
                reused: None,
                source_ctime_ns: None,
                original: Some(claim.job.source.path.clone()),
                stays: false,
                decision: None,
            };
            let steps = [Step::Intend(publication), Step::Placed, Step::Finished];
            let [.., job] = steps.map(|step| store.advance(&claim, step).unwrap());
            Self { dir, folders: vec![Arc::new(folder)], store, profile: Profile::default(), job }
        }

        fn good() -> Self {
            Self::new(Ending::Repaired, |_| {})
        }

        fn copy(&self) -> Option<Copied> {
            let sought = Sought { store: &self.store, folders: &self.folders, job: &self.job, profile: &self.profile };
            let copied = sought.copy(&self.dir.path().join("claimed"), &self.to(), &|| false).unwrap();
            assert_eq!(copied.is_some(), self.to().exists(), "no part of a copy is left");
            copied
        }

        fn to(&self) -> std::path::PathBuf {
            self.dir.path().join("copy")
        }

        fn out(&self, name: &str) -> std::path::PathBuf {
            self.dir.path().join("out").join(name)
        }
    }

    #[test]
    fn a_result_that_stands_is_copied_and_never_linked() {
        let kitchen = Kitchen::good();
        let copied = kitchen.copy().unwrap();
        assert_eq!((copied.from.job, copied.from.output.as_str()), (kitchen.job.id, "part.stl"));
        assert_eq!(std::fs::read(kitchen.to()).unwrap(), REPAIRED);
        let (copy, result) = (kitchen.to().metadata().unwrap(), kitchen.out("part.stl").metadata().unwrap());
        assert!(copy.ino() != result.ino() && copy.nlink() == 1 && result.nlink() == 1);
        std::fs::write(kitchen.out("part.stl"), b"edited").unwrap();
        assert_eq!(std::fs::read(kitchen.to()).unwrap(), REPAIRED);
    }

    #[test]
    fn what_does_not_stand_as_it_was_published_is_not_copied() {
        type Harm = fn(&Kitchen);
        let harms: [(&str, Harm); 7] = [
            ("the result is gone", |k| std::fs::remove_file(k.out("part.stl")).unwrap()),
            ("it was edited", |k| std::fs::write(k.out("part.stl"), b"as REPAIRED").unwrap()),
            ("it was cut", |k| std::fs::write(k.out("part.stl"), b"as").unwrap()),
            ("a link has its name", |k| {
                std::fs::rename(k.out("part.stl"), k.out("elsewhere")).unwrap();
                std::os::unix::fs::symlink("elsewhere", k.out("part.stl")).unwrap();
            }),
            ("the report is gone", |k| std::fs::remove_file(k.out("part.stl.report.json")).unwrap()),
            ("the report was edited", |k| {
                let mut bytes = std::fs::read(k.out("part.stl.report.json")).unwrap();
                bytes.push(b' ');
                std::fs::write(k.out("part.stl.report.json"), bytes).unwrap();
            }),
            ("the folder is another one", |k| {
                std::fs::rename(k.dir.path().join("in"), k.dir.path().join("out/in"))
                    .and_then(|()| std::fs::remove_dir_all(k.dir.path().join(".suture")))
                    .unwrap()
            }),
        ];
        for (what, harm) in harms {
            let kitchen = Kitchen::good();
            harm(&kitchen);
            assert!(kitchen.copy().is_none(), "{what}");
        }
    }

    #[test]
    fn only_a_good_result_of_the_same_content_settings_and_engine_is_copied() {
        assert!(Kitchen::new(Ending::NeedsReview, |_| {}).copy().is_none());
        // The digests agree by chance: the report is looked at.
        type Change = fn(&mut Report);
        let changes: [Change; 5] = [
            |report| report.engine_version = "0.0.1".into(),
            |report| report.profile.max_hole_edges += 1,
            |report| report.input.blake3 = hash(b"other").to_string(),
            |report| report.output.as_mut().unwrap().blake3 = hash(b"other").to_string(),
            |report| report.outcome = Outcome::NeedsReview,
        ];
        for (n, change) in changes.into_iter().enumerate() {
            assert!(Kitchen::new(Ending::Repaired, change).copy().is_none(), "{n}");
        }
        let mut other = Kitchen::good();
        other.profile.fill_holes = false;
        assert!(other.copy().is_none());
        let other = Kitchen::good();
        std::fs::write(other.dir.path().join("claimed"), b"AS DROPPED").unwrap();
        assert!(other.copy().is_none());
        let mut elsewhere = Kitchen::good();
        elsewhere.folders.clear();
        assert!(elsewhere.copy().is_none(), "its folder is not served any more");
    }

    #[test]
    fn a_stop_ends_the_search() {
        let kitchen = Kitchen::good();
        let sought = Sought { store: &kitchen.store, folders: &kitchen.folders, job: &kitchen.job, profile: &kitchen.profile };
        assert!(sought.copy(&kitchen.dir.path().join("claimed"), &kitchen.to(), &|| true).unwrap().is_none());
        assert!(kitchen.copy().is_some());
    }
}
