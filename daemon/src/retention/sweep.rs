//! A sweep: looks what is to go, and lets it go, one file after the other. Whatever cannot go stays, and is told of once.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use suture_store::job::{Area, Kind};
use suture_store::{Job, JobStore, Query, Role, StoreError, Time};

use super::archive::{Archive, Stays, give_back};
use super::history::past;
use super::plan::{Going, What, going};
use super::stock::{Stock, left_aside};
use super::turns::{Moment, Turns};
use crate::config::keep::Keep;
use crate::folder::Folder;
use crate::fsx::{self, Identity};
use crate::left::approved;
use crate::remove::remove;
use crate::settings::Settings;

/// How often a sweeper looks whether it is its turn, or is to end.
const LOOK_EVERY: Duration = Duration::from_millis(200);

/// How often ended jobs are counted between sweeps.
const COUNT_EVERY: Duration = Duration::from_secs(60);

/// Lets go what is to go of some hot folders and their store.
pub(crate) struct Sweeper {
    store: Arc<dyn JobStore>,
    folders: Vec<Arc<Folder>>,
    settings: Arc<Settings>,
    /// Files that stayed, as they were then: they are not looked at again until they change.
    stayed: BTreeMap<PathBuf, Identity>,
    /// Lines of the last sweep that need not be said again.
    told: BTreeSet<String>,
    turns: Turns,
    /// Hot folders in which this sweeper has given originals their names back.
    righted: BTreeSet<String>,
    /// When ended jobs were counted last.
    counted: Instant,
}

/// What a sweep did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Swept {
    pub removed: u64,
    /// Originals, to the archive.
    pub moved: u64,
    /// Records of jobs.
    pub forgotten: u64,
}

impl Sweeper {
    pub(crate) fn new(store: Arc<dyn JobStore>, folders: Vec<Arc<Folder>>, settings: Arc<Settings>, now: Moment) -> Self {
        let (stayed, told, righted, turns) = (BTreeMap::new(), BTreeSet::new(), BTreeSet::new(), Turns::new(now));
        let mut sweeper = Self { store, folders, settings, stayed, told, turns, righted, counted: now.steady };
        // Before a sweep asks for the time: a file that gets its name back is as old as that.
        sweeper.set_right();
        sweeper
    }

    /// Sweeps whenever it is time to, until `ended`.
    ///
    /// # Errors
    /// Store errors only.
    pub(crate) fn tend(&mut self, clock: &dyn Fn() -> Moment, ended: &dyn Fn() -> bool) -> Result<(), StoreError> {
        while !ended() {
            std::thread::sleep(LOOK_EVERY);
            self.look(clock(), ended)?;
        }
        Ok(())
    }

    /// Sweeps if it is time to, until `ended`.
    ///
    /// # Errors
    /// Store errors only.
    pub(crate) fn look(&mut self, now: Moment, ended: &dyn Fn() -> bool) -> Result<(), StoreError> {
        self.set_right();
        if self.turns.is_due(now) {
            self.sweep(now.wall, ended)?;
        } else if now.steady.duration_since(self.counted) >= COUNT_EVERY {
            self.counted = now.steady;
            self.count(now.wall)?;
        }
        Ok(())
    }

    /// Originals that an earlier life left under a hidden name on their way to the archive get their names back, whether they are to go there still or
    /// not: at once, since no one else would find them.
    fn set_right(&mut self) {
        for folder in &self.folders {
            if self.righted.contains(&folder.name) || !folder.keeps() || folder.check().is_err() {
                continue;
            }
            // What cannot be done now is tried at the next look.
            let set_right = |left: Vec<PathBuf>| left.iter().all(|path| give_back(&folder.root.join(path)).is_ok());
            if left_aside(&folder.root).is_ok_and(set_right) {
                self.righted.insert(folder.name.clone());
            }
        }
    }

    /// Keeps the store bounded between two sweeps, however many jobs end: by their number, which no clock tells.
    fn count(&self, now: Time) -> Result<u64, StoreError> {
        let keep = Keep { history: None, ..self.settings.now().keep.clone() };
        let ended: u64 = self.store.counts()?.iter().filter(|(kind, _)| kind.is_at_rest()).map(|(_, count)| count).sum();
        if ended > keep.history_jobs.saturating_add(keep.history_jobs / 10) { self.forget(&keep, now) } else { Ok(0) }
    }

    fn forget(&self, keep: &Keep, now: Time) -> Result<u64, StoreError> {
        let mut forgotten = 0;
        if !self.settings.now().roles.has(Role::Control) {
            return Ok(forgotten);
        }
        for past in past(&*self.store, keep, now, &|job| self.is_needed(job))? {
            let jobs = self.store.forget(&past.ids)?;
            tracing::info!(jobs, reason = past.why, "Old jobs are forgotten; their files stay as they are.");
            forgotten += jobs;
        }
        Ok(forgotten)
    }

    /// One sweep of everything, until `stop`.
    ///
    /// # Errors
    /// Store errors only.
    pub(crate) fn sweep(&mut self, now: Time, stop: &dyn Fn() -> bool) -> Result<Swept, StoreError> {
        // Of this sweep to its end, whatever is read meanwhile.
        let keep = self.settings.now().keep.clone();
        let (mut swept, busy, said) = (Swept::default(), self.busy()?, std::mem::take(&mut self.told));
        for folder in self.folders.clone().iter().filter(|folder| folder.keeps()) {
            if let Err(line) = self.files(folder, &keep, now, &busy, stop, &mut swept) {
                if !said.contains(&line) {
                    tracing::warn!(folder = %folder.root.display(), reason = line, "Retention: nothing more goes for now.");
                }
                self.told.insert(line);
            }
        }
        if !stop() {
            swept.forgotten = self.forget(&keep, now)?;
        }
        Ok(swept)
    }

    /// Originals outside of `in/` that are to be worked on once more, and best attempts that are to be published, with their reports.
    fn busy(&self) -> Result<BTreeSet<PathBuf>, StoreError> {
        let kinds = Kind::ALL.into_iter().filter(|kind| kind.is_live()).collect();
        let jobs = self.store.list(&Query { kinds, ..Query::default() })?;
        let places = |job: &Job| {
            let folder = self.folders.iter().find(|folder| folder.name == job.source.folder)?;
            let original = (job.original().0 != Area::In).then(|| folder.original(job));
            Some(approved(&folder.root, job).into_iter().flatten().chain(original))
        };
        Ok(jobs.iter().filter_map(places).flatten().collect())
    }

    /// Does a file lie in `in/` for which this job answers, as far as is known?
    fn is_needed(&self, job: &Job) -> bool {
        let folder = self.folders.iter().find(|folder| folder.name == job.source.folder);
        job.answers_for_source() && folder.is_none_or(|folder| !is_gone(folder, job))
    }

    /// The files of one hot folder. Fails with a line when nothing more can go there.
    fn files(
        &mut self,
        folder: &Folder,
        keep: &Keep,
        now: Time,
        busy: &BTreeSet<PathBuf>,
        stop: &dyn Fn() -> bool,
        swept: &mut Swept,
    ) -> Result<(), String> {
        folder.check()?;
        let look = || Stock::of(&folder.root, keep).map_err(|error| format!("it cannot be read: {error}"));
        let mut stock = look()?;
        if !stock.aside.is_empty() {
            for path in &stock.aside {
                give_back(&folder.root.join(path)).map_err(|error| format!("{}: {error}", path.display()))?;
            }
            stock = look()?;
        }
        let mut archive = keep.archive().map(Archive::open);
        for going in going(stock.pieces, keep, now) {
            let path = folder.root.join(&going.piece.path);
            if stop() {
                return Ok(());
            }
            if busy.contains(&path) || self.stays(&path) {
                continue;
            }
            // What is there is believed of the right folder only.
            folder.check()?;
            match let_go(folder, &going, &path, archive.as_ref()) {
                Ok(to) => tell(folder, &going, to.as_deref(), swept),
                Err(Stays::All(line)) => {
                    // Results and reports may go all the same.
                    archive = Some(Err(line));
                }
                Err(Stays::This(reason)) => self.stayed(folder, &going, path, &reason),
            }
        }
        match archive {
            Some(Err(line)) => Err(line),
            _ => Ok(()),
        }
    }

    /// Did it stay before, and is it the same still?
    fn stays(&self, path: &Path) -> bool {
        self.stayed.get(path).is_some_and(|then| Identity::of(path).is_ok_and(|now| now == *then))
    }

    fn stayed(&mut self, folder: &Folder, going: &Going, path: PathBuf, reason: &str) {
        let (folder, file, why) = (&folder.name, going.piece.path.display(), &going.why);
        tracing::warn!(%folder, %file, what = going.piece.what.word(), why, reason, "Retention: a file was to go, and stays.");
        if let Ok(identity) = Identity::of(&path) {
            self.stayed.insert(path, identity);
        }
    }
}

/// Is the file gone from `in/` for which a job answers? What cannot be seen is not gone.
pub(crate) fn is_gone(folder: &Folder, job: &Job) -> bool {
    if let Some(shelf) = &folder.bucket {
        return shelf.is_gone(&folder.inbox(), &folder.root, job);
    }
    let source = &job.source;
    let found = fsx::look(&folder.inbox().join(source.path.to_path()));
    // Its disk may be another device since.
    let same = |found: &Identity| (found.ino, found.size, found.mtime_ns) == (source.ino, source.size, source.mtime_ns);
    folder.check().is_ok()
        && fsx::is_folder(&folder.inbox()).is_ok_and(|there| there)
        && found.is_ok_and(|found| found.as_ref().is_none_or(|found| !same(found)))
}

/// Lets one file go; where it is now, if it is an original.
fn let_go(
    folder: &Folder,
    going: &Going,
    path: &Path,
    archive: Option<&Result<Archive, String>>,
) -> Result<Option<PathBuf>, Stays> {
    if going.piece.what != What::Original {
        return remove(path, going.piece.hash).map(|()| None).map_err(Stays::This);
    }
    match archive {
        Some(Ok(archive)) => archive.take(path, &Path::new(&folder.name).join(&going.piece.path)).map(Some),
        Some(Err(line)) => Err(Stays::All(line.clone())),
        None => Err(Stays::This("there is no archive".into())),
    }
}

fn tell(folder: &Folder, going: &Going, to: Option<&Path>, swept: &mut Swept) {
    let (folder, file, bytes, reason) = (&folder.name, going.piece.path.display(), going.piece.bytes, &going.why);
    match to {
        Some(to) => {
            swept.moved += 1;
            tracing::info!(%folder, %file, bytes, reason, to = %to.display(), "Retention: an original moved to the archive.");
        }
        None => {
            swept.removed += 1;
            tracing::info!(%folder, %file, bytes, reason, what = going.piece.what.word(), "Retention: a file was removed.");
        }
    }
}

#[cfg(test)]
mod tests {
    use suture_store::{Clock, MemoryStore, Priority, RelPath, Seen, Source, Submission, SystemClock};

    use super::*;
    use crate::config::keep::Bound;
    use crate::config::{Config, FolderConfig};

    const DAY: u64 = 24 * 3600 * 1000;

    /// A hot folder with a result, an original and an archive, and all that is known of it.
    struct Scene {
        dir: tempfile::TempDir,
        folders: Vec<Arc<Folder>>,
        store: Arc<MemoryStore>,
    }

    impl Scene {
        fn new() -> Self {
            let dir = tempfile::tempdir().unwrap();
            let folder = Folder::open(&FolderConfig::of(&dir.path().join("hot")), None).unwrap();
            let scene = Self { dir, folders: vec![Arc::new(folder)], store: Arc::new(MemoryStore::new(Arc::new(SystemClock))) };
            let hash = blake3::hash(b"result").to_hex();
            let receipt = format!(
                "{{\"receipt_version\":1,\"output\":\"a.stl\",\"output_blake3\":\"{hash}\",\"report_blake3\":\"{hash}\"}}"
            );
            for (name, content) in [
                ("hot/out/a.stl", "result"),
                ("hot/out/a.stl.report.json", "result"),
                ("hot/out/a.stl.suture.json", &receipt),
                ("hot/done/a.stl", "original"),
                ("hot/in/new.stl", "dropped"),
                ("archive/.suture-archive", ""),
            ] {
                std::fs::create_dir_all(fsx::folder_of(&scene.at(name))).unwrap();
                std::fs::write(scene.at(name), content).unwrap();
            }
            scene
        }

        fn at(&self, name: &str) -> PathBuf {
            self.dir.path().join(name)
        }

        fn sweeper(&self, config: Config) -> Sweeper {
            let store = Arc::<MemoryStore>::clone(&self.store);
            let now = Moment { steady: Instant::now(), wall: SystemClock.now() };
            Sweeper::new(store, self.folders.clone(), Arc::new(Settings::fixed(config)), now)
        }

        fn sweeps(&self, keep: &Keep, days: &[u64]) -> Vec<Swept> {
            let mut config = Config::for_folder(&self.at("hot"));
            config.keep = keep.clone();
            let mut sweeper = self.sweeper(config);
            let later = |days: &u64| SystemClock.now().plus_ms(days * DAY + 1000);
            days.iter().map(|days| sweeper.sweep(later(days), &|| false).unwrap()).collect()
        }

        fn everything(&self) -> Keep {
            let bound = Bound { age: Some(Duration::from_millis(DAY)), size: None };
            Keep { results: bound, reports: bound, originals: bound, archive: Some(self.at("archive")), ..Keep::default() }
        }

        fn is_there(&self, name: &str) -> bool {
            self.at(name).exists()
        }
    }

    fn swept(removed: u64, moved: u64) -> Swept {
        Swept { removed, moved, forgotten: 0 }
    }

    #[test]
    fn what_is_old_goes_each_in_its_way() {
        let scene = Scene::new();
        let all = scene.sweeps(&scene.everything(), &[0, 1, 1, 1]);
        // The receipt goes when its result is gone.
        assert_eq!(all, [swept(0, 0), swept(2, 1), swept(1, 0), swept(0, 0)]);
        assert_eq!(std::fs::read(scene.at("archive/hot/done/a.stl")).unwrap(), b"original");
        assert!(!scene.is_there("hot/done/a.stl") && scene.is_there("hot/in/new.stl"), "what was dropped is not touched");
    }

    #[test]
    fn nothing_goes_unless_it_is_said() {
        let scene = Scene::new();
        assert_eq!(scene.sweeps(&Keep::default(), &[9999]), [swept(0, 0)]);
    }

    /// A kill left it under a hidden name, and the archive is none any more.
    #[test]
    fn an_original_that_was_left_aside_is_given_back_at_once() {
        let scene = Scene::new();
        std::fs::rename(scene.at("hot/done/a.stl"), scene.at("hot/done/.suture-archived-a.stl")).unwrap();
        let mut sweeper = scene.sweeper(Config::for_folder(&scene.at("hot")));
        let now = Moment { steady: Instant::now(), wall: SystemClock.now() };
        sweeper.look(now, &|| false).unwrap();
        assert_eq!(std::fs::read(scene.at("hot/done/a.stl")).unwrap(), b"original");
        assert!(!scene.is_there("hot/done/.suture-archived-a.stl"));
    }

    /// Neither is a disk that is not mounted an archive, nor does it keep results from going.
    #[test]
    fn originals_stay_without_their_archive() {
        let scene = Scene::new();
        std::fs::remove_file(scene.at("archive/.suture-archive")).unwrap();
        assert_eq!(scene.sweeps(&scene.everything(), &[1, 1]), [swept(2, 0), swept(1, 0)]);
        assert!(scene.is_there("hot/done/a.stl"));
    }

    #[test]
    fn a_result_that_someone_changed_stays() {
        let scene = Scene::new();
        std::fs::write(scene.at("hot/out/a.stl"), b"edited").unwrap();
        assert_eq!(scene.sweeps(&scene.everything(), &[1, 1]), [swept(1, 1), swept(0, 0)]);
        assert!(scene.is_there("hot/out/a.stl") && scene.is_there("hot/out/a.stl.suture.json"));
    }

    /// A folder that was moved, and another made under its name.
    #[test]
    fn another_folder_is_not_swept() {
        let scene = Scene::new();
        std::fs::rename(scene.at("hot"), scene.at("old")).unwrap();
        std::fs::create_dir_all(scene.at("hot/out")).unwrap();
        std::fs::copy(scene.at("old/out/a.stl.suture.json"), scene.at("hot/out/a.stl.suture.json")).unwrap();
        std::fs::write(scene.at("hot/out/a.stl"), b"result").unwrap();
        assert_eq!(scene.sweeps(&scene.everything(), &[99]), [swept(0, 0)]);
        assert!(scene.is_there("hot/out/a.stl") && scene.is_there("old/out/a.stl"));
    }

    #[test]
    fn the_store_is_bounded_between_sweeps() {
        let scene = Scene::new();
        let mut config = Config::for_folder(&scene.at("hot"));
        config.keep.history_jobs = 10;
        let sweeper = scene.sweeper(config);
        for n in 1..=12 {
            let (path, folder, profile) = (RelPath::new(format!("{n}.stl")).unwrap(), "hot".into(), "default".into());
            let source = Source { folder, path, dev: 1, ino: n, size: 84, mtime_ns: 1, profile };
            let id = scene
                .store
                .submit(&[Submission { source, foreign: None, priority: Priority::default(), seen: Seen::Now }])
                .unwrap()[0]
                .id;
            scene.store.control(id, suture_store::Control::Cancel).unwrap();
            // One more than a tenth too many, and it is back at its bound.
            assert_eq!(sweeper.count(Time(0)).unwrap(), if n == 12 { 2 } else { 0 });
        }
    }

    /// Without its record, a cancelled file that still lies there would be taken again.
    #[test]
    fn a_file_that_still_lies_there_is_remembered() {
        let scene = Scene::new();
        let found = Identity::of(&scene.at("hot/in/new.stl")).unwrap();
        let job = |name: &str, ino| {
            let (path, folder, profile) = (RelPath::new(name).unwrap(), "hot".into(), "default".into());
            let source = Source { folder, path, dev: found.dev + 1, ino, size: found.size, mtime_ns: found.mtime_ns, profile };
            let id = scene
                .store
                .submit(&[Submission { source, foreign: None, priority: Priority::default(), seen: Seen::Now }])
                .unwrap()[0]
                .id;
            scene.store.control(id, suture_store::Control::Cancel).unwrap();
            id
        };
        let (there, _) = (job("new.stl", found.ino), job("gone.stl", 1));
        let keep = Keep { history: Some(Duration::ZERO), ..Keep::default() };
        assert_eq!(scene.sweeps(&keep, &[1])[0].forgotten, 1);
        let left: Vec<_> = scene.store.list(&Query::default()).unwrap().iter().map(|job| job.id).collect();
        assert_eq!(left, [there]);
        std::fs::remove_file(scene.at("hot/in/new.stl")).unwrap();
        assert_eq!(scene.sweeps(&keep, &[1])[0].forgotten, 1);
    }
}
