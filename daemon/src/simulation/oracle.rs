//! What was dropped, and what must be so: each original in one place, each result once, nothing computed twice, nothing begun when nothing may be.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use suture_store::job::{Kind, Withdrawal};
use suture_store::{Job, JobId, Query, State};

use super::matter::{Fate, Matter};
use super::plan::FOLDERS;
use super::stage::Stage;
use crate::control::JobsWish;
use crate::world::Share;

/// A file that was dropped.
#[derive(Clone, Debug)]
pub(super) struct Version {
    pub folder: usize,
    /// Below `in/`.
    pub name: PathBuf,
    pub matter: Matter,
    pub ino: u64,
    /// Whoever dropped it took it away, or put another in its place.
    pub gone: bool,
}

/// A result that lies in `out/`.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    pub matter: Matter,
    pub folder: usize,
    pub job: JobId,
    /// What the clock on the wall showed when it was seen first.
    pub since: u64,
}

/// A content in a hot folder.
pub(super) type Key = (usize, Matter);

/// What is known of everything that was dropped.
#[derive(Default)]
pub(super) struct Oracle {
    pub versions: Vec<Version>,
    /// By content, results that may be there beyond those of files that are: of files that were taken away, renamed, or retried meanwhile.
    pub slack: BTreeMap<Key, u64>,
    pub results: BTreeMap<PathBuf, Seen>,
    /// Results that retention let go.
    pub swept: BTreeMap<Key, u64>,
    /// Where results of each content are.
    pub standing: BTreeMap<Matter, BTreeSet<PathBuf>>,
    /// How often someone approved what is not good by itself.
    pub approved: BTreeMap<Key, u64>,
    /// How often someone wanted to, and nobody knows whether the store has it: a kill came, or it was too late.
    pub perhaps_approved: BTreeMap<Key, u64>,
    serials: u32,
    ticks: u64,
    kills: u64,
    runs: BTreeMap<u32, u64>,
    retries: BTreeMap<u32, u64>,
    /// In work: beside others, and alone.
    busy: [u64; 2],
}

impl Oracle {
    pub(super) fn new_matter(&mut self, fate: Fate, large: bool) -> Matter {
        self.serials += 1;
        Matter { fate, serial: self.serials, large }
    }

    /// The content of one of the files that were dropped.
    pub(super) fn some_earlier(&self, index: &mut dyn FnMut(usize) -> usize) -> Option<Matter> {
        (!self.versions.is_empty()).then(|| self.versions[index(self.versions.len())].matter)
    }

    /// A number that is another one at each call.
    pub(super) fn tick(&mut self) -> u64 {
        self.ticks += 1;
        self.ticks % 1_000_000
    }

    pub(super) fn killed(&mut self) {
        self.kills += 1;
        self.busy = [0, 0];
    }

    /// The file of this inode is no more.
    pub(super) fn destroyed(&mut self, folder: usize, ino: u64) {
        if let Some(version) =
            self.versions.iter_mut().rev().find(|version| (version.folder, version.ino, version.gone) == (folder, ino, false))
        {
            version.gone = true;
            let key = (version.folder, version.matter);
            *self.slack.entry(key).or_default() += 1;
        }
    }

    pub(super) fn renamed(&mut self, number: usize, name: PathBuf) {
        let version = &mut self.versions[number];
        version.name = name;
        *self.slack.entry((version.folder, version.matter)).or_default() += 1;
    }

    pub(super) fn rewritten(&mut self, number: usize, matter: Matter) {
        let version = &mut self.versions[number];
        *self.slack.entry((version.folder, version.matter)).or_default() += 1;
        version.matter = matter;
    }

    /// An operator wants to approve this result. A kill may come before the store has it, or before anyone hears that it has.
    pub(super) fn would_approve(&mut self, key: Key) {
        *self.perhaps_approved.entry(key).or_default() += 1;
    }

    /// The store has it.
    pub(super) fn has_approved(&mut self, key: Key) {
        self.perhaps_approved.entry(key).and_modify(|count| *count -= 1);
        *self.approved.entry(key).or_default() += 1;
    }

    /// An operator's wish was granted.
    pub(super) fn wished(&mut self, job: &Job, wish: &JobsWish) {
        let mut versions = self.versions.iter().rev();
        let version = versions.find(|version| version.ino == job.source.ino && FOLDERS[version.folder] == job.source.folder);
        if let (Some(version), JobsWish::Retry(_)) = (version, wish) {
            *self.retries.entry(version.matter.serial).or_default() += 1;
        }
    }

    /// So often this was approved, and at most so often.
    pub(super) fn approvals(&self, key: &Key) -> (u64, u64) {
        let [surely, perhaps] = [&self.approved, &self.perhaps_approved].map(|counts| counts.get(key).copied().unwrap_or(0));
        (surely, surely + perhaps)
    }

    /// A worker begins: may it? Returns how often one did with this content.
    pub(super) fn begins(&mut self, stage: &Stage, matter: Matter, share: Share) -> u64 {
        let life = stage.life();
        let config = life.context.settings.now();
        assert!(!stage.sky.is_full(), "{matter:?}: nothing begins while the disk is full");
        let alone = usize::from(!share.many);
        assert!(
            self.busy[1] == 0 && (alone == 0 || self.busy[0] == 0),
            "{matter:?}: a large file, and a suspect, run alone: {:?}",
            self.busy
        );
        self.busy[alone] += 1;
        assert!(self.busy[0] <= config.workers as u64, "no more workers than there may be");
        if stage.away.get().is_none() && !self.retries.contains_key(&matter.serial) {
            self.is_needed(stage, matter);
        }
        if stage.scale.watch_order {
            self.is_next(stage, matter);
        }
        let runs = self.runs.entry(matter.serial).or_default();
        *runs += 1;
        *runs
    }

    /// The worker's work is over.
    pub(super) fn rests(&mut self, share: Share) {
        self.busy[usize::from(!share.many)] -= 1;
    }

    /// Nothing is computed of which there is a good result, but for a comparison.
    fn is_needed(&self, stage: &Stage, matter: Matter) {
        let running = stage.life().store().list(&Query { kinds: vec![Kind::Running], ..Query::default() }).unwrap();
        if running.iter().max_by_key(|job| job.work).is_some_and(|job| job.witness.is_some()) {
            return;
        }
        for path in self.standing.get(&matter).into_iter().flatten() {
            let Some(seen) = self.results.get(path) else { continue };
            let job = stage.life().store().get(seen.job).unwrap();
            let stands = path.exists() && job.is_some_and(|job| job.kind() == Kind::Done);
            assert!(!stands, "{matter:?} is computed once more, though {} stands", path.display());
        }
    }

    /// Who has waited for as long as makes them the most urgent goes before all of their folder who came later; folders take turns.
    fn is_next(&self, stage: &Stage, matter: Matter) {
        let life = stage.life();
        let now = life.context.world.wall();
        let running = life.store().list(&Query { kinds: vec![Kind::Running], ..Query::default() }).unwrap();
        let Some(taken) = running.iter().max_by_key(|job| job.work) else { return };
        let small = |job: &Job| job.source.size < life.context.settings.now().large && !job.must_run_alone();
        if taken.source.size != matter.dropped().len() as u64 || !small(taken) {
            return;
        }
        for job in life.store().list(&Query { kinds: vec![Kind::Queued], ..Query::default() }).unwrap() {
            let is_beside = job.source.folder == taken.source.folder;
            let first = is_beside
                && job.priority >= taken.priority
                && job.id < taken.id
                && job.retried.is_none()
                && taken.retried.is_none();
            let ready = matches!(job.state, State::Queued { not_before: None }) && job.is_due(now) && small(&job);
            let same = taken.attempts.0 == 1;
            // Who came with the same priority, or a higher one, and sooner, is never behind.
            assert!(!(first && ready && same) || job.submitted > taken.submitted, "{} waits longer than {}", job.id, taken.id);
        }
    }

    /// Files for which no one is to be asked for a second look: how often one that kills its worker may have run.
    pub(super) fn check_runs(&self) -> Result<(), String> {
        let mut owed: BTreeMap<u32, (Fate, u64)> = BTreeMap::new();
        for version in &self.versions {
            owed.entry(version.matter.serial).or_insert((version.matter.fate, 0)).1 += 1;
        }
        for (serial, (fate, versions)) in owed {
            let names = self.slack.iter().filter(|((_, matter), _)| matter.serial == serial).map(|(_, slack)| slack).sum::<u64>();
            let tries = versions + names + self.retries.get(&serial).copied().unwrap_or(0);
            let runs = self.runs.get(&serial).copied().unwrap_or(0);
            if matches!(fate, Fate::Kills | Fate::Hangs) && runs > 2 * tries + self.kills {
                return Err(format!("{serial} killed its worker {runs} times in {tries} jobs"));
            }
        }
        Ok(())
    }
}

/// Is this a job that an operator took back, so that its file stays where it is?
pub(super) fn is_taken_back(job: &Job) -> bool {
    matches!(job.state, State::Cancelled { why: Withdrawal::Operator })
}
