//! A file that goes along with an OBJ: its copy is published as any result is, with a receipt and without a report, since nothing was judged. From the
//! receipt alone a lost store knows all of it: ending, reason, content and names.
//!
//! Has `out/` a file of its name with the same bytes, there is no second one. Has it another file, its folder says what is done (`on_taken`); where
//! the copy gets the next name, its reason tells that meshes that name it get the other file.

use suture_store::job::one_line;
use suture_store::{Ending, Hash, Job, Publication, RelPath, Step, crash_point};

use super::{Desk, discard};
use crate::force::plain;
use crate::fsx;
use crate::publish_error::{PublishError, io_at};
use crate::remove::ours;
use crate::superseded;

impl Desk<'_> {
    /// Makes the intent durable to publish the copy in the attempt's folder, whose bytes have this hash. `ctime_ns`: last change of the original's
    /// inode then.
    ///
    /// # Errors
    /// Those of the store, and the file system's.
    pub(crate) fn intend_carried(&self, job: &Job, content: Hash, ctime_ns: i64) -> Result<Job, PublishError> {
        self.begin(job)?;
        superseded::clear(self.folder, job, &|| self.must_hold())?;
        crash_point("daemon.superseded");
        let publication = self.prepare_carried(job, content, Some(ctime_ns))?;
        self.intend_durably(job, publication)
    }

    /// Someone took the name of the intent: another one, none where it is the same file, or no result where the folder wants no second one.
    pub(super) fn choose_again_carried(&self, job: &Job, old: &Publication, content: Hash) -> Result<Job, PublishError> {
        let publication = self.prepare_carried(job, content, old.source_ctime_ns)?;
        if publication.output.is_none() {
            discard(self.folder, job);
        }
        let work = self.work(job);
        fsx::sync_dir(&work).map_err(io_at(&work))?;
        let job = self.store.advance(self.claim, Step::Intend(publication))?;
        crash_point("daemon.intent_renewed");
        Ok(job)
    }

    /// The intent; its receipt is in the attempt's folder, synced.
    fn prepare_carried(&self, job: &Job, content: Hash, source_ctime_ns: Option<i64>) -> Result<Publication, PublishError> {
        let dropped = plain(&job.source.path);
        let is_there = self.has_in_out(&dropped, job.source.size, content);
        if !is_there && let Some(barred) = self.barred(job, None)? {
            return self.prepare(job, &barred);
        }
        // Without a copy, only a receipt is named after the original: as of a file that was skipped.
        let names = self.names(job, if is_there { Ending::Skipped } else { Ending::Carried }, None)?;
        let reason = match &names.output {
            None => format!("out/{dropped} is there already, with the same bytes"),
            Some(name) if *name == dropped => String::new(),
            Some(name) => format!("out/{dropped} was taken, and meshes that name it do not get this file, which is out/{name}"),
        };
        let publication = Publication {
            ending: Ending::Carried,
            reason: one_line(&reason),
            output: names.output,
            output_hash: Some(content),
            report_hash: None,
            recipe: None,
            reused: None,
            source_ctime_ns,
            original: Some(names.original),
            stays: self.folder.leave_originals,
            decision: None,
        };
        self.write_receipt(job, &publication, Some(content))?;
        Ok(publication)
    }

    /// Is there a file of that name and size in `out/`, and are these its bytes? A link is none, and what cannot be read is another file.
    fn has_in_out(&self, name: &RelPath, size: u64, content: Hash) -> bool {
        let path = self.folder.out().join(name.to_path());
        let is_alike = std::fs::symlink_metadata(&path).is_ok_and(|meta| meta.is_file() && meta.len() == size);
        is_alike && ours(&path, Some(content)).is_ok_and(|found| found.is_some())
    }
}

#[cfg(test)]
mod tests {
    use suture_store::State;

    use super::super::tests::Scene;
    use super::super::{CLAIMED, OUTPUT};
    use super::*;
    use crate::config::taken::OnTaken;
    use crate::create;
    use crate::fsx::Identity;

    const LIBRARY: &[u8] = b"newmtl red\n";

    fn scene(on_taken: OnTaken) -> Scene {
        Scene::claimed("part.mtl", LIBRARY, on_taken)
    }

    /// Copied and intended.
    fn intended(scene: &Scene) -> Job {
        let work = scene.folder.work(scene.claim.token);
        let content = crate::carry::copy(&work.join(CLAIMED), &work.join(OUTPUT), &|| false).unwrap();
        let ctime_ns = Identity::of(&work.join(CLAIMED)).unwrap().ctime_ns;
        scene.desk().intend_carried(&scene.claim.job, content, ctime_ns).unwrap()
    }

    fn published(job: &Job) -> &Publication {
        let State::Ended { publication } = &job.state else { panic!("{:?}", job.state) };
        publication
    }

    fn names(scene: &Scene, folder: &str) -> Vec<String> {
        let entries = std::fs::read_dir(scene.folder.root.join(folder)).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_copy_and_a_receipt() {
        let scene = scene(OnTaken::Fail);
        let job = scene.finish(intended(&scene));
        assert_eq!((job.kind(), published(&job).reason.as_str()), (suture_store::Kind::Carried, ""));
        assert_eq!((scene.read("out/part.mtl"), scene.read("done/part.mtl")), (LIBRARY.to_vec(), LIBRARY.to_vec()));
        assert_eq!(names(&scene, "out"), ["part.mtl", "part.mtl.suture.json"]);
        assert!(names(&scene, "in").is_empty());
        let receipt: serde_json::Value = serde_json::from_slice(&scene.read("out/part.mtl.suture.json")).unwrap();
        let hash = blake3::hash(LIBRARY).to_hex().to_string();
        assert_eq!((&receipt["ending"], &receipt["output_blake3"]), (&"carried".into(), &hash.clone().into()));
        assert_eq!(receipt["source_blake3"], hash);
    }

    /// The same bytes need no second name, whatever the folder wants, before the name is chosen and after it.
    #[test]
    fn the_same_bytes_are_not_put_there_twice() {
        for on_taken in [OnTaken::Version, OnTaken::Fail, OnTaken::Skip] {
            for is_late in [false, true] {
                let scene = scene(on_taken);
                let put = || create::write_new(&scene.folder.out().join("part.mtl"), LIBRARY).unwrap();
                let job = if is_late {
                    let job = intended(&scene);
                    put();
                    job
                } else {
                    put();
                    intended(&scene)
                };
                let job = scene.finish(job);
                let told = published(&job);
                assert_eq!((told.ending, &told.output), (Ending::Carried, &None), "{on_taken:?}, late: {is_late}");
                assert!(told.reason.contains("out/part.mtl is there already, with the same bytes"), "{}", told.reason);
                assert_eq!(names(&scene, "out"), ["part.mtl", "part~2.mtl.suture.json"]);
                assert_eq!(names(&scene, "done"), ["part~2.mtl"]);
            }
        }
    }

    /// Other bytes of that name stay, and the folder says what becomes of these.
    #[test]
    fn another_file_of_that_name_stays() {
        for is_late in [false, true] {
            for (on_taken, ending, place) in [
                (OnTaken::Version, Ending::Carried, "done/part.mtl"),
                (OnTaken::Fail, Ending::NameTaken, "failed/part.mtl"),
                (OnTaken::Skip, Ending::Skipped, "done/part~2.mtl"),
            ] {
                let scene = scene(on_taken);
                let put = || create::write_new(&scene.folder.out().join("part.mtl"), b"theirs").unwrap();
                let job = if is_late {
                    let job = intended(&scene);
                    put();
                    job
                } else {
                    put();
                    intended(&scene)
                };
                let job = scene.finish(job);
                let told = published(&job);
                assert_eq!(told.ending, ending, "late: {is_late}");
                assert_eq!((scene.read("out/part.mtl"), scene.read(place)), (b"theirs".to_vec(), LIBRARY.to_vec()), "{ending:?}");
                if on_taken == OnTaken::Version {
                    assert_eq!(scene.read("out/part~2.mtl"), LIBRARY);
                    assert!(told.reason.contains(
                        "out/part.mtl was taken, and meshes that name it do not get this file, which is out/part~2.mtl"
                    ));
                }
            }
        }
    }

    /// The bytes changed under a time that was set back: nothing of them is published.
    #[test]
    fn a_file_that_changed_is_withdrawn() {
        let scene = scene(OnTaken::Version);
        let job = intended(&scene);
        let path = scene.folder.inbox().join("part.mtl");
        let modified = std::fs::metadata(&path).unwrap().modified().unwrap();
        std::thread::sleep(std::time::Duration::from_millis(20));
        std::fs::write(&path, LIBRARY.to_ascii_uppercase()).unwrap();
        std::fs::File::options().write(true).open(&path).unwrap().set_modified(modified).unwrap();
        let job = scene.finish(job);
        assert_eq!(job.state, State::Cancelled { why: suture_store::job::Withdrawal::Changed });
        assert!(names(&scene, "out").is_empty());
    }
}
