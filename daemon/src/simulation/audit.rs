//! The look at the disk and at the store, once nothing is going on: the invariants G1 to G5 of the research on unattended work, by what was dropped.

use std::collections::{BTreeMap, BTreeSet};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};

use suture_store::job::Kind;
use suture_store::{Clock, Job, JobId, Query};

use super::matter::Matter;
use super::oracle::{Key, Oracle, Seen, is_taken_back};
use super::plan::{FOLDERS, LEFT};
use super::stage::Stage;
use crate::receipt;

/// Where originals are.
const AREAS: [&str; 4] = ["in", "done", "failed", "quarantine"];

/// No age counts unless the clock has gone steadily for so long.
const STEADY: Duration = Duration::from_secs(600);

/// How many originals of a content lie in each area.
type Places = BTreeMap<Key, [u64; AREAS.len()]>;

/// Every file below a folder, by its path.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    let Ok(entries) = std::fs::read_dir(folder) else { return all };
    for entry in entries.flatten() {
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            all.extend(files(&entry.path()));
        } else {
            all.push(entry.path());
        }
    }
    all.sort();
    all
}

fn is_mesh(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "stl")
}

fn with(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.to_owned().into_os_string();
    name.push(suffix);
    name.into()
}

impl Stage {
    /// If it is time to: gives new results the time that the simulated clock shows, has the sweeper look, and sees what it let go.
    pub(super) fn tend(&self) {
        let passed = self.sky.passed();
        if passed - self.tended.get() < self.scale.tend {
            return;
        }
        self.tended.set(passed);
        self.note_results();
        let age = self.life().context.settings.now().keep.results.age;
        self.sweep.set(Some((self.sky.now().0, age.map_or(u64::MAX, |age| age.as_millis() as u64))));
        self.life().sweep();
        self.judge_sweep();
    }

    /// Looks at what the last sweep let go, be it that the daemon was killed in the midst of it.
    pub(super) fn judge_sweep(&self) {
        let Some((now, bound)) = self.sweep.take() else { return };
        let mut oracle = self.oracle.borrow_mut();
        let away = self.away.get();
        let gone: Vec<PathBuf> = oracle
            .results
            .iter()
            .filter(|(path, seen)| Some(seen.folder) != away && !path.exists())
            .map(|(path, _)| path.clone())
            .collect();
        for path in gone {
            let Some(seen) = oracle.results.remove(&path) else { continue };
            assert!(now.saturating_sub(seen.since) > bound, "{} went before its time", path.display());
            assert!(self.sky.steady_for() >= STEADY, "{} went by a clock that jumped", path.display());
            *oracle.swept.entry((seen.folder, seen.matter)).or_default() += 1;
            let left = oracle.standing.get_mut(&seen.matter).is_some_and(|paths| paths.remove(&path) && !paths.is_empty());
            if !left {
                oracle.standing.remove(&seen.matter);
            }
        }
    }

    /// Results with their receipts that were not seen before: each is whole, and what its receipt says.
    fn note_results(&self) {
        let now = self.sky.now().0;
        for folder in 0..FOLDERS.len() {
            let areas = ["out", "failed", "quarantine"].map(|area| self.place.root(folder).join(area));
            for path in areas.iter().flat_map(|area| files(area)) {
                self.stamp(&path, now);
                if !is_mesh(&path) || !path.starts_with(&areas[0]) || self.oracle.borrow().results.contains_key(&path) {
                    continue;
                }
                let Some(told) = receipt::read(&with(&path, receipt::RECEIPT)) else { continue };
                let bytes = std::fs::read(&path).unwrap();
                let (matter, _) = Matter::read(&bytes).unwrap_or_else(|| panic!("{} is no whole result", path.display()));
                let is_wanted = matter.fate.is_good() || self.oracle.borrow().approvals(&(folder, matter)).1 > 0;
                assert!(bytes == matter.result() && is_wanted, "{} is no good result: {matter:?}", path.display());
                let hash = blake3::hash(&bytes).to_hex().to_string();
                assert_eq!(told.output_blake3.map(|hash| hash.to_string()), Some(hash), "{}", path.display());
                let mut oracle = self.oracle.borrow_mut();
                // What was approved is nobody else's.
                if matter.fate.is_good() {
                    oracle.standing.entry(matter).or_default().insert(path.clone());
                }
                oracle.results.insert(path, Seen { matter, folder, job: JobId(told.job), since: now });
            }
        }
    }

    /// Files that the daemon made have the time of the machine until they are seen.
    fn stamp(&self, path: &Path, now: u64) {
        let Ok(file) = std::fs::File::open(path) else { return };
        let Ok(meta) = file.metadata() else { return };
        // The simulation is in another century.
        if meta.mtime() < 4_000_000_000 {
            file.set_modified(UNIX_EPOCH + Duration::from_millis(now)).unwrap();
        }
    }

    /// Everything must be in its place.
    ///
    /// # Errors
    /// What is not.
    pub(super) fn audit(&self) -> Result<(), String> {
        self.note_results();
        let jobs = self.life().store().list(&Query::default()).unwrap();
        self.check_counts(&jobs)?;
        self.check_left_overs()?;
        let places = self.places()?;
        self.check_inbox(&jobs)?;
        self.check_originals(&places)?;
        self.check_results(&places)?;
        self.oracle.borrow().check_runs()
    }

    /// G5: counters, records and files agree.
    fn check_counts(&self, jobs: &[Job]) -> Result<(), String> {
        for (kind, count) in self.life().store().counts().unwrap() {
            let listed = jobs.iter().filter(|job| job.kind() == kind).count() as u64;
            if listed != count {
                return Err(format!("{count} jobs are said to be {kind}, and {listed} are"));
            }
        }
        let oracle = self.oracle.borrow();
        let known: BTreeSet<JobId> = oracle.results.values().map(|seen| seen.job).collect();
        if known.len() != oracle.results.len() {
            return Err("a job has two results".into());
        }
        let without = |job: &&Job| {
            let folder = FOLDERS.iter().position(|name| *name == job.source.folder);
            let swept =
                oracle.swept.keys().any(|(at, matter)| Some(*at) == folder && matter.dropped().len() as u64 == job.source.size);
            job.kind() == Kind::Done && !known.contains(&job.id) && !swept
        };
        jobs.iter().find(without).map_or(Ok(()), |job| Err(format!("job {} is done, and there is no result of it", job.id)))
    }

    /// G3: no work folder, no hidden file, no temporary name is left.
    fn check_left_overs(&self) -> Result<(), String> {
        for folder in 0..FOLDERS.len() {
            let root = self.place.root(folder);
            if let Some(left) = std::fs::read_dir(root.join(".suture/work")).unwrap().flatten().next() {
                return Err(format!("{} is left", left.path().display()));
            }
            let areas = ["out", "done", "failed", "quarantine"].iter().flat_map(|area| files(&root.join(area)));
            let hidden = |path: &PathBuf| path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."));
            if let Some(left) = areas.into_iter().find(hidden) {
                return Err(format!("{} is left", left.display()));
            }
        }
        Ok(())
    }

    /// Where the originals are.
    fn places(&self) -> Result<Places, String> {
        let mut places = Places::new();
        for folder in 0..FOLDERS.len() {
            for (number, area) in AREAS.iter().enumerate() {
                let root = self.place.root(folder).join(area);
                for path in files(&root).into_iter().filter(|path| is_mesh(path)) {
                    let bytes = std::fs::read(&path).unwrap();
                    let Some((matter, is_result)) = Matter::read(&bytes) else {
                        return Err(format!("{} is not whole", path.display()));
                    };
                    if is_result {
                        // A best attempt.
                        let fits = matter.fate.outcome().is_good() || *area != "failed";
                        if fits {
                            return Err(format!("{} has no business there", path.display()));
                        }
                        continue;
                    }
                    let known = places.entry((folder, matter)).or_default();
                    known[number] += 1;
                }
            }
        }
        Ok(places)
    }

    /// G1: what still lies in `in/` lies there for a reason.
    fn check_inbox(&self, jobs: &[Job]) -> Result<(), String> {
        for (folder, name) in FOLDERS.iter().enumerate() {
            for path in files(&self.place.inbox(folder)).into_iter().filter(|path| is_mesh(path)) {
                let found = std::fs::metadata(&path).unwrap();
                let of_it =
                    |job: &&Job| job.source.folder == *name && job.source.ino == found.ino() && job.source.size == found.len();
                let reason = |job: &Job| is_taken_back(job) || (folder == LEFT && job.kind().is_at_rest());
                if !jobs.iter().filter(of_it).any(reason) {
                    return Err(format!("{} lies there, and no job says why", path.display()));
                }
            }
        }
        Ok(())
    }

    /// G1 and G4: each original is in one place, byte for byte, or in the archive.
    fn check_originals(&self, places: &Places) -> Result<(), String> {
        let oracle = self.oracle.borrow();
        let owed = oracle.owed();
        let archived: BTreeSet<Matter> = files(&self.place.archive())
            .iter()
            .filter_map(|path| Matter::read(&std::fs::read(path).ok()?))
            .map(|(matter, _)| matter)
            .collect();
        for key in owed.keys().chain(places.keys()) {
            let (wanted, slack) = (owed.get(key).copied().unwrap_or(0), oracle.slack.get(key).copied().unwrap_or(0));
            let at = places.get(key).copied().unwrap_or_default();
            let found: u64 = at.iter().sum();
            if found > wanted + slack {
                return Err(format!("{key:?}: {wanted} originals were dropped, and {found} are there: {at:?}"));
            }
            if found < wanted && !archived.contains(&key.1) {
                return Err(format!(
                    "{key:?}: {wanted} originals were dropped, {found} are there: {at:?}, and none in the archive"
                ));
            }
            for (area, count) in AREAS.iter().zip(at).skip(1) {
                let approved = if *area == "done" { oracle.approvals(key).1 } else { 0 };
                if count > approved && *area != key.1.fate.area() {
                    return Err(format!("{key:?} came to {area}"));
                }
            }
        }
        Ok(())
    }

    /// G2: as many results as originals that are done.
    fn check_results(&self, places: &Places) -> Result<(), String> {
        let oracle = self.oracle.borrow();
        let mut results: BTreeMap<Key, u64> = oracle.swept.clone();
        for seen in oracle.results.values() {
            *results.entry((seen.folder, seen.matter)).or_default() += 1;
        }
        let owed = oracle.owed();
        for key in owed.keys().chain(results.keys()) {
            let (made, slack) = (results.get(key).copied().unwrap_or(0), oracle.slack.get(key).copied().unwrap_or(0));
            let wanted = owed.get(key).copied().unwrap_or(0);
            // What an operator took back stays in `in/`, where originals stay all are.
            let waits = places.get(key).map_or(0, |at| at[0]);
            let (surely, perhaps) = oracle.approvals(key);
            let least = if key.1.fate.is_good() { wanted.saturating_sub(waits) } else { surely };
            let most = if key.1.fate.is_good() { wanted + slack } else { perhaps };
            if made < least || made > most {
                return Err(format!("{key:?}: {made} results of {least} to {most}"));
            }
        }
        Ok(())
    }
}

impl Oracle {
    /// Originals that must be somewhere.
    fn owed(&self) -> BTreeMap<Key, u64> {
        let mut owed = BTreeMap::new();
        for version in self.versions.iter().filter(|version| !version.gone) {
            *owed.entry((version.folder, version.matter)).or_default() += 1;
        }
        owed
    }
}
