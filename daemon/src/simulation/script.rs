//! What happens: people drop files and meddle with them, operators steer, the machine fails. All of it by chance.

use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};

use suture_store::job::Kind;
use suture_store::{Clock, Decision, Job, JobId, Priority, Query, Verdict};

use super::matter::{FATES, Fate, Matter};
use super::oracle::{Key, Version};
use super::plan::{FOLDERS, LEFT, Plan};
use super::stage::Stage;
use crate::control::{DaemonWish, JobsWish, change, steer};
use crate::left::result_path;

/// Names that are dropped again and again.
const NAMES: u64 = 14;
const DAY_MS: i64 = 24 * 3_600_000;

/// The name of a file.
fn shown(path: &Path) -> String {
    path.file_name().unwrap_or_default().display().to_string()
}

impl Stage {
    /// Something that people do in the hot folders.
    pub(super) fn user(&self) {
        if self.is_closing.get() {
            return;
        }
        self.active.set(self.sky.passed());
        match self.chance(|chance| chance.below(10)) {
            0..=4 => self.drop_files(1),
            5 => self.rename_one(),
            6 => self.remove_one(),
            7 => self.rewrite_one(),
            8 => self.drop_foreign(),
            _ => {
                let most = self.chance(|chance| chance.between(2, 8));
                self.drop_files(most);
            }
        }
    }

    /// Drops so many files.
    pub(super) fn drop_files(&self, count: u64) {
        for _ in 0..count {
            let (folder, name) = self.chance(|chance| {
                let folder = if chance.one_in(5) { LEFT } else { 0 };
                let order = match chance.below(6) {
                    0 => format!("order-{}/", chance.below(4)),
                    _ => String::new(),
                };
                (folder, PathBuf::from(format!("{order}part-{}.stl", chance.below(NAMES))))
            });
            self.drop_file(folder, name, self.some_matter());
        }
    }

    /// A new content, or one that was dropped before.
    fn some_matter(&self) -> Matter {
        let earlier = self.oracle.borrow().some_earlier(&mut |len| self.chance(|chance| chance.index(len)));
        self.chance(|chance| match earlier.filter(|_| chance.one_in(5)) {
            Some(matter) => matter,
            None => {
                let fate = if chance.one_in(2) { Fate::Repaired } else { chance.pick(&FATES).0 };
                self.oracle.borrow_mut().new_matter(fate, chance.one_in(10))
            }
        })
    }

    /// Puts a file into a hot folder, whole, under a name that may be in use.
    pub(super) fn drop_file(&self, folder: usize, name: PathBuf, matter: Matter) {
        if self.away.get() == Some(folder) {
            return;
        }
        let path = self.place.inbox(folder).join(&name);
        let made = std::fs::create_dir_all(path.parent().unwrap());
        // A sub-folder's name may be a file's by now.
        if made.is_err() || path.is_dir() {
            return;
        }
        let part = path.with_extension("part");
        std::fs::write(&part, matter.dropped()).unwrap();
        let ino = self.touch(&part);
        self.destroy(folder, &path);
        std::fs::rename(&part, &path).unwrap();
        self.say(|| format!("drop {} {matter:?} in {folder}", name.display()));
        self.oracle.borrow_mut().versions.push(Version { folder, name, matter, ino, gone: false });
    }

    /// Gives a file the time that the simulated clock shows; its inode.
    fn touch(&self, path: &Path) -> u64 {
        let file = std::fs::File::open(path).unwrap();
        // No two changes at the same time.
        let nanos = self.oracle.borrow_mut().tick();
        file.set_modified(UNIX_EPOCH + Duration::from_millis(self.sky.now().0) + Duration::from_nanos(nanos)).unwrap();
        file.metadata().unwrap().ino()
    }

    /// Whoever puts something else at this path destroys what is there.
    fn destroy(&self, folder: usize, path: &Path) {
        if let Ok(found) = std::fs::symlink_metadata(path) {
            self.oracle.borrow_mut().destroyed(folder, found.ino());
        }
    }

    /// A dropped file that still lies where it was put: its number, and where.
    fn some_dropped(&self) -> Option<(usize, PathBuf)> {
        let oracle = self.oracle.borrow();
        let recent = oracle.versions.len().min(30);
        if recent == 0 {
            return None;
        }
        // Whoever meddles with files does it, as luck has it, with the one that is in work.
        let held = self.in_hand.borrow();
        let is_held = |version: &Version| held.iter().any(|path| *path == self.place.inbox(version.folder).join(&version.name));
        let in_hand = oracle.versions.iter().rposition(is_held).filter(|_| self.chance(|chance| chance.one_in(2)));
        let number = in_hand.unwrap_or_else(|| oracle.versions.len() - 1 - self.chance(|chance| chance.index(recent)));
        let version = &oracle.versions[number];
        if self.away.get() == Some(version.folder) || version.gone {
            return None;
        }
        let path = self.place.inbox(version.folder).join(&version.name);
        let there = std::fs::symlink_metadata(&path).is_ok_and(|found| found.ino() == version.ino);
        there.then_some((number, path))
    }

    fn rename_one(&self) {
        let Some((number, path)) = self.some_dropped() else { return };
        let other = path.with_file_name(format!("renamed-{}.stl", self.chance(|chance| chance.below(NAMES))));
        if other.exists() {
            return;
        }
        self.say(|| format!("rename {} to {}", shown(&path), shown(&other)));
        std::fs::rename(&path, &other).unwrap();
        let mut oracle = self.oracle.borrow_mut();
        let folder = oracle.versions[number].folder;
        oracle.renamed(number, other.strip_prefix(self.place.inbox(folder)).unwrap().to_owned());
    }

    fn remove_one(&self) {
        let Some((number, path)) = self.some_dropped() else { return };
        self.say(|| format!("remove {}", shown(&path)));
        let (folder, ino) = {
            let oracle = self.oracle.borrow();
            (oracle.versions[number].folder, oracle.versions[number].ino)
        };
        self.oracle.borrow_mut().destroyed(folder, ino);
        std::fs::remove_file(&path).unwrap();
    }

    /// Another content in the same file.
    fn rewrite_one(&self) {
        let Some((number, path)) = self.some_dropped() else { return };
        let matter = self.some_matter();
        self.say(|| format!("rewrite {} to {matter:?}", shown(&path)));
        std::fs::write(&path, matter.dropped()).unwrap();
        self.touch(&path);
        self.oracle.borrow_mut().rewritten(number, matter);
    }

    fn drop_foreign(&self) {
        if self.away.get() != Some(0) {
            let name = format!("note-{}.txt", self.chance(|chance| chance.below(3)));
            std::fs::write(self.place.inbox(0).join(name), "words").unwrap();
        }
    }

    /// Something that operators or the machine do, between the steps of the daemon.
    pub(super) fn trouble(&self) {
        match self.chance(|chance| chance.below(17)) {
            0 | 1 => self.pause(None),
            2 => self.wish(&Kind::ALL, JobsWish::Cancel),
            3 => self.wish(&[Kind::Failed, Kind::Rejected, Kind::Quarantined, Kind::Cancelled], JobsWish::Retry),
            4 => {
                let priority = self.chance(|chance| Priority::try_from(chance.below(10) as i64).unwrap());
                self.wish(&[Kind::Queued], |id| JobsWish::Rank(id, priority));
            }
            5 => {
                let full = !self.sky.is_full();
                self.say(|| format!("the disk is full: {full}"));
                self.sky.set_full(full);
            }
            6 => self.take_away(),
            7 => {
                let reboot = self.chance(|chance| chance.one_in(3));
                self.say(|| "the daemon is killed at rest".into());
                self.rise(reboot);
            }
            8 | 9 => {
                let passes = self.chance(|chance| chance.between(1, 60)) as u32;
                self.say(|| format!("a kill after {passes} crash points"));
                self.until_kill.set(passes);
            }
            10 | 11 => self.jump(),
            12 => self.reload(),
            13 | 14 => self.decide(Verdict::Approved),
            15 => self.decide(Verdict::Rejected),
            _ => {
                let strikes = self.chance(|chance| chance.between(1, 4)) as u32;
                self.say(|| format!("{strikes} workers cannot be started"));
                self.sky.strike(strikes);
            }
        }
    }

    /// A person has looked at what needs review.
    fn decide(&self, verdict: Verdict) {
        let said = Decision::new(verdict, "Ada", "").unwrap();
        self.wish(&[Kind::NeedsReview, Kind::Rejected], |id| JobsWish::Decide(id, said.clone()));
    }

    /// Such trouble as a week has: what is reloaded says the same.
    pub(super) fn trouble_of_a_week(&self) {
        match self.chance(|chance| chance.below(3)) {
            0 => {
                let reboot = self.chance(|chance| chance.one_in(3));
                self.rise(reboot);
            }
            1 => self.take_away(),
            _ => {
                self.sky.set_full(true);
                self.until_kill.set(self.chance(|chance| chance.between(1, 200)) as u32);
            }
        }
    }

    /// Pauses the daemon, lets it go on, or the other of the two.
    pub(super) fn pause(&self, wanted: Option<bool>) {
        let life = self.life();
        let paused = crate::standstill::is_set(&self.place.state()).unwrap();
        let wanted = wanted.unwrap_or(!paused);
        if wanted != paused {
            self.say(|| format!("paused: {wanted}"));
            let wish = if wanted { DaemonWish::Pause } else { DaemonWish::Resume };
            steer(&life.context, &wish).unwrap();
        }
    }

    /// An operator's wish, of one of the jobs of these kinds.
    fn wish(&self, kinds: &[Kind], wish: impl Fn(JobId) -> JobsWish) {
        let life = self.life();
        let jobs = life.store().list(&Query { kinds: kinds.to_vec(), ..Query::default() }).unwrap();
        if jobs.is_empty() {
            return;
        }
        let job = &jobs[self.chance(|chance| chance.index(jobs.len()))];
        let wish = wish(job.id);
        let approves = matches!(&wish, JobsWish::Decide(_, said) if said.verdict == Verdict::Approved);
        let approved = if approves { self.judged(job) } else { None };
        if let Some(key) = approved {
            self.oracle.borrow_mut().would_approve(key);
        }
        // It may be too late for it.
        if change(&life.context, &wish).is_ok() {
            self.say(|| format!("{wish:?}, {}", job.source.path));
            let mut oracle = self.oracle.borrow_mut();
            oracle.wished(job, &wish);
            if let Some(key) = approved {
                oracle.has_approved(key);
            }
        }
    }

    /// The result that a person looks at. (The original may be another one by now, and its inode another file's.)
    fn judged(&self, job: &Job) -> Option<Key> {
        let folder = FOLDERS.iter().position(|name| *name == job.source.folder)?;
        let roots = [self.place.root(folder), self.place.away(folder)];
        let best = roots.iter().filter_map(|root| std::fs::read(result_path(root, job)?).ok()).next()?;
        Some((folder, Matter::read(&best)?.0))
    }

    fn take_away(&self) {
        if self.away.get().is_some() {
            return self.bring_back();
        }
        let folder = self.chance(|chance| chance.index(2));
        self.say(|| format!("folder {folder} is away"));
        std::fs::rename(self.place.root(folder), self.place.away(folder)).unwrap();
        self.away.set(Some(folder));
    }

    pub(super) fn jump(&self) {
        let ms = self.chance(|chance| {
            let longest = chance.pick(&[120_000, 7_200_000, DAY_MS, 365 * DAY_MS]);
            chance.between(0, 2 * longest as u64) as i64 - longest
        });
        self.say(|| format!("the clock jumps by {} s", ms / 1000));
        self.sky.jump(ms);
    }

    fn reload(&self) {
        if self.chance(|chance| chance.one_in(3)) {
            self.say(|| "the configuration is spoilt".into());
            self.place.spoil();
        } else {
            let plan = self.chance(Plan::new);
            self.say(|| format!("{plan:?}"));
            self.place.write(&plan);
            *self.plan.borrow_mut() = plan;
        }
        self.life().reload();
    }

    /// Ends the machine's trouble.
    pub(super) fn end_trouble(&self) {
        self.sky.set_full(false);
        self.sky.strike(0);
        self.bring_back();
    }

    /// Ends all trouble.
    pub(super) fn calm(&self) {
        self.until_kill.set(0);
        self.end_trouble();
        self.pause(Some(false));
        self.place.write(&self.plan.borrow());
        self.life().reload();
    }
}
