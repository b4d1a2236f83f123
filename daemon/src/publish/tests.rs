//! A result on its way, without a worker and without a daemon.

use super::*;
use crate::config::FolderConfig;
use crate::config::taken::OnTaken;
use std::sync::Arc;
use suture_store::{Filter, MemoryStore, Priority, RelPath, Seen, Source, Submission, SystemClock};

/// A hot folder with one dropped file, claimed in the store.
pub(crate) struct Scene {
    _dir: tempfile::TempDir,
    pub(crate) folder: Folder,
    store: MemoryStore,
    pub(crate) claim: Claim,
    committed: Cell<bool>,
}

const ORIGINAL: &[u8] = b"as dropped";
const REPAIRED: &[u8] = b"as repaired";

impl Scene {
    /// Taken into work, as an attempt leaves it to the desk.
    fn new() -> Self {
        Self::new_where(OnTaken::Version)
    }

    fn new_where(on_taken: OnTaken) -> Self {
        Self::claimed("part.stl", ORIGINAL, on_taken)
    }

    pub(crate) fn dropped() -> Self {
        Self::dropped_where(OnTaken::Version)
    }

    fn dropped_where(on_taken: OnTaken) -> Self {
        Self::dropped_as("part.stl", ORIGINAL, on_taken)
    }

    /// A file of this name and content, taken into work.
    pub(in crate::publish) fn claimed(name: &str, content: &[u8], on_taken: OnTaken) -> Self {
        let scene = Self::dropped_as(name, content, on_taken);
        crate::claim::claim(&scene.folder, &scene.claim.job, &scene.folder.work(scene.claim.token), u64::MAX).unwrap();
        scene
    }

    fn dropped_as(name: &str, content: &[u8], on_taken: OnTaken) -> Self {
        let dir = tempfile::tempdir().unwrap();
        let config = FolderConfig { name: "hot".into(), on_taken, ..FolderConfig::of(dir.path()) };
        let folder = Folder::open(&config, None).unwrap();
        let path = folder.inbox().join(name);
        create::write_new(&path, content).unwrap();
        let found = Identity::of(&path).unwrap();
        let source = Source {
            folder: "hot".into(),
            path: RelPath::new(name).unwrap(),
            dev: found.dev,
            ino: found.ino,
            size: found.size,
            mtime_ns: found.mtime_ns,
            profile: "default".into(),
        };
        let store = MemoryStore::new(Arc::new(SystemClock));
        store.submit(&[Submission { source, foreign: None, priority: Priority::default(), seen: Seen::Now }]).unwrap();
        let claim = store.claim(&Filter::default()).unwrap().unwrap();
        Self { _dir: dir, folder, store, claim, committed: Cell::new(false) }
    }

    pub(in crate::publish) fn desk(&self) -> Desk<'_> {
        Desk::new(&self.store, &self.folder, &self.claim, &self.committed)
    }

    /// A good result, intended.
    fn intended(&self) -> Job {
        let output = self.folder.work(self.claim.token).join(OUTPUT);
        create::write_new(&output, REPAIRED).unwrap();
        let mut report = crate::table::tests::sample(Outcome::Repaired);
        report.output.as_mut().unwrap().blake3 = fsx::hash(&output).unwrap().to_string();
        report.input.blake3 = Hash(*blake3::hash(ORIGINAL).as_bytes()).to_string();
        let ctime_ns = Identity::of(&self.folder.work(self.claim.token).join(CLAIMED)).unwrap().ctime_ns;
        self.desk().intend(&self.claim.job, &Conclusion::Report { report: Box::new(report), ctime_ns, reused: None }).unwrap()
    }

    /// Does what is owed until nothing is.
    pub(in crate::publish) fn finish(&self, mut job: Job) -> Job {
        loop {
            job = match &job.state {
                State::Publishing { .. } => self.desk().place(&job).unwrap(),
                State::Published { .. } => self.desk().move_original(&job).unwrap(),
                _ => return job,
            };
        }
    }

    pub(in crate::publish) fn read(&self, path: &str) -> Vec<u8> {
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
    assert!(!fsx::exists(&scene.folder.inbox().join("part.stl")).unwrap());
    let report: Report = serde_json::from_slice(&scene.read("out/part.stl.report.json")).unwrap();
    assert_eq!(report.output.unwrap().path, scene.folder.out().join("part.stl"));
    let receipt: serde_json::Value = serde_json::from_slice(&scene.read("out/part.stl.suture.json")).unwrap();
    assert_eq!(receipt["output"], "part.stl");
    assert_eq!(receipt["output_blake3"], fsx::hash(&scene.folder.out().join("part.stl")).unwrap().to_string());
}

/// The name is taken after it was chosen, even by the very same bytes: they are someone else's.
#[test]
fn a_name_that_is_taken_meanwhile_is_not_touched() {
    let scene = Scene::new();
    let job = scene.intended();
    create::write_new(&scene.folder.out().join("part.stl"), REPAIRED).unwrap();
    create::write_new(&scene.folder.area(suture_store::job::Area::Done).join("part.stl"), b"earlier").unwrap();
    let job = scene.finish(job);
    assert_eq!(scene.read("out/part~2.stl"), REPAIRED);
    assert_eq!(scene.read("done/part.stl"), b"earlier");
    assert_eq!(scene.read("done/part~2.stl"), ORIGINAL);
    let report: Report = serde_json::from_slice(&scene.read("out/part~2.stl.report.json")).unwrap();
    assert_eq!(report.output.unwrap().path, scene.folder.out().join("part~2.stl"));
    let State::Ended { publication } = job.state else { panic!("{:?}", job.state) };
    assert_eq!(publication.output.unwrap().name(), b"part~2.stl");
}

/// Where no second result is wanted, one whose name is taken after it was chosen is given up: what is there stays, and so does the original.
#[test]
fn f23_a_name_that_is_taken_meanwhile_fails_or_is_skipped_as_the_folder_says() {
    for (on_taken, ending, report) in [
        (OnTaken::Fail, Ending::NameTaken, "failed/part.stl.report.json"),
        (OnTaken::Skip, Ending::Skipped, "out/part~2.stl.report.json"),
    ] {
        for killed in [false, true] {
            let scene = Scene::new_where(on_taken);
            let mut job = scene.intended();
            let theirs = scene.folder.out().join("part.stl");
            create::write_new(&theirs, b"theirs").unwrap();
            if killed {
                // The new intent is durable, and a later life goes on from there.
                job = scene.desk().place(&job).unwrap();
                assert!(matches!(&job.state, State::Publishing { publication, .. } if publication.ending == ending));
            }
            let job = scene.finish(job);
            let State::Ended { publication } = &job.state else { panic!("{:?}", job.state) };
            assert_eq!((publication.ending, &publication.output), (ending, &None));
            assert!(publication.reason.contains("out/part.stl is there already"), "{}", publication.reason);
            assert_eq!(scene.read("out/part.stl"), b"theirs");
            let place = if on_taken == OnTaken::Skip { "done/part~2.stl" } else { "failed/part.stl" };
            assert_eq!(scene.read(place), ORIGINAL);
            let told: serde_json::Value = serde_json::from_slice(&scene.read(report)).unwrap();
            assert_eq!(told["reason"], publication.reason.as_str());
            let receipt: serde_json::Value = serde_json::from_slice(&scene.read(&report.replace("report", "suture"))).unwrap();
            assert_eq!(receipt["output"], serde_json::Value::Null);
        }
    }
}

/// Two results whose names a system that is blind to case takes for the same, chosen at the same time: the second to be placed gets another.
#[test]
fn f23_a_name_like_one_that_was_placed_meanwhile_is_not_taken() {
    let scene = Scene::new();
    let job = scene.intended();
    create::write_new(&scene.folder.out().join("PART.stl"), b"theirs").unwrap();
    let job = scene.finish(job);
    assert_eq!((scene.read("out/PART.stl"), scene.read("out/part.stl")), (b"theirs".to_vec(), Vec::new()));
    assert_eq!((scene.read("out/part~2.stl"), scene.read("done/part.stl")), (REPAIRED.to_vec(), ORIGINAL.to_vec()));
    assert_eq!(job.publication().unwrap().output.as_ref().unwrap().name(), b"part~2.stl");
}

/// A new drop of the same name while the old one is worked on: each is its own.
#[test]
fn f22_a_new_drop_of_the_same_name_stays() {
    let scene = Scene::new();
    let job = scene.intended();
    let path = scene.folder.inbox().join("part.stl");
    std::fs::remove_file(&path).unwrap();
    create::write_new(&path, b"another").unwrap();
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

/// D6: a copier that goes on after its pause keeps inode and size, and may set the time back: the result of the half is not published.
#[test]
fn f22_a_file_that_changed_before_its_result_is_placed_is_withdrawn() {
    let scene = Scene::new();
    let job = scene.intended();
    let path = scene.folder.inbox().join("part.stl");
    let modified = std::fs::metadata(&path).unwrap().modified().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(20));
    std::fs::write(&path, b"AS DROPPED").unwrap();
    std::fs::File::options().write(true).open(&path).unwrap().set_modified(modified).unwrap();
    let job = scene.finish(job);
    assert_eq!(job.state, State::Cancelled { why: Withdrawal::Changed });
    assert_eq!(std::fs::read_dir(scene.folder.out()).unwrap().count(), 0);
    assert_eq!(scene.read("in/part.stl"), b"AS DROPPED");
}

/// Renaming or linking a file changes its inode's time, not its content.
#[test]
fn a_file_that_was_only_renamed_is_published() {
    let scene = Scene::new();
    let job = scene.intended();
    std::fs::rename(scene.folder.inbox().join("part.stl"), scene.folder.inbox().join("mine.stl")).unwrap();
    scene.finish(job);
    assert_eq!(scene.read("out/part.stl"), REPAIRED);
    assert_eq!((scene.read("done/part.stl"), scene.read("in/mine.stl")), (ORIGINAL.to_vec(), ORIGINAL.to_vec()));
}

/// A power cut may keep the output's new name and its old one, as two files: its report in place says whose it is.
#[test]
fn an_output_that_was_placed_before_a_power_cut_is_not_placed_again() {
    let scene = Scene::new();
    let job = scene.intended();
    let work = scene.folder.work(scene.claim.token);
    fsx::rename_new(&work.join(REPORT_FILE), &scene.folder.out().join("part.stl.report.json")).unwrap();
    create::write_new(&scene.folder.out().join("part.stl"), REPAIRED).unwrap();
    let done = scene.finish(job);
    assert_eq!(done.kind(), suture_store::job::Kind::Done);
    assert_eq!(std::fs::read_dir(scene.folder.out()).unwrap().count(), 3, "mesh, report, receipt");
    assert!(!fsx::exists(&work.join(OUTPUT)).unwrap());
}
