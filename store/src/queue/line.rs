//! Who is next: every job that may be claimed, in memory, in the order in which it is its turn.
//!
//! **Order.** Parked jobs whose pause is over first: there is little to do for them. Then the higher priority; of one priority the folder whose turn it is
//! ([`crate::share`]), and of one folder, or of folders whose turns begin together, the lower number, which is the older job.
//!
//! **Ageing.** A job counts for one step of priority more after each [`AGEING_MS`] since it was dropped (or retried), up to the highest: so
//! it is behind fewer and fewer others, and no flood of urgent files keeps it waiting for ever. Its age is counted by a clock that only
//! goes forward. The wall clock tells only how old a job was when this life of the daemon began; wherever it jumps, that is never less
//! than nothing, nor more than what makes it the highest, and only the order depends on it.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use super::index::class;
use super::turn::Turns;
use crate::id::{JobId, Time};
use crate::job::{AGEING_MS, BACKOFF_CAP_MS, Job, Kind, Priority};
use crate::share::Shares;
use crate::store::{Filter, Waiting};

/// Longest age that makes a difference.
const OLDEST_MS: u64 = AGEING_MS * 9;

/// The time of day, and that of the clock that only goes forward.
#[derive(Clone, Copy, Debug)]
pub(super) struct Now {
    pub wall: Time,
    pub ticks: u64,
}

/// Where a job stands in line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// In work: it is in nobody's way, but gets no younger.
    Held,
    Ready,
    Resting(Time),
    Parked(Time),
}

#[derive(Clone, Debug)]
struct Entry {
    place: Place,
    /// Its hot folder's place among [`Line::folders`].
    folder: usize,
    alone: bool,
    size: u64,
    base: Priority,
    /// What it counts as, while it is ready.
    aged: Priority,
    /// From when on its age is counted, by the wall clock: tells a retry.
    from: Time,
    /// How old it was when it came into this line, and when that was.
    age: u64,
    came: u64,
}

impl Entry {
    fn age(&self, ticks: u64) -> u64 {
        self.age.saturating_add(ticks.saturating_sub(self.came))
    }

    fn aged(&self, ticks: u64) -> Priority {
        self.base.raised(self.age(ticks) / AGEING_MS)
    }

    fn fits(&self, want: &Filter) -> bool {
        self.alone == want.alone && (want.size.0..=want.size.1).contains(&self.size)
    }
}

/// Ready jobs by one of their priorities, with their sizes.
#[derive(Default)]
struct Order(BTreeMap<(bool, Reverse<Priority>, u8, JobId), u64>);

impl Order {
    fn key(id: JobId, entry: &Entry, priority: Priority) -> (bool, Reverse<Priority>, u8, JobId) {
        (entry.alone, Reverse(priority), class(entry.size), id)
    }

    /// The highest priority of those that `want` allows, and the oldest job of it. Looks at one job for each class of sizes of each
    /// priority that there is.
    fn first(&self, want: &Filter) -> Option<(Priority, JobId)> {
        let mut level = Reverse(Priority::HIGHEST);
        loop {
            let from = (want.alone, level, 0, JobId(0));
            let to = (want.alone, Reverse(Priority::LOWEST), u8::MAX, JobId(u64::MAX));
            level = self.0.range(from..=to).next()?.0.1;
            if let Some(id) = self.oldest(want, level) {
                return Some((level.0, id));
            }
            level = Reverse(level.0.lowered()?);
        }
    }

    fn oldest(&self, want: &Filter, level: Reverse<Priority>) -> Option<JobId> {
        let (least, most) = want.size;
        let (mut from, last) = (class(least), class(most));
        let mut best: Option<JobId> = None;
        while from <= last {
            let at = |class, id| (want.alone, level, class, JobId(id));
            let Some((key, _)) = self.0.range(at(from, 0)..=at(last, u64::MAX)).next() else { break };
            let here = key.2;
            let fits = |(_, size): &(_, &u64)| (least..=most).contains(*size);
            let found = self.0.range(at(here, 0)..=at(here, u64::MAX)).find(fits).map(|(key, _)| key.3);
            best = [best, found].into_iter().flatten().min();
            from = here + 1;
        }
        best
    }
}

/// The ready jobs of a hot folder.
#[derive(Default)]
struct Folder {
    name: String,
    /// By their own priority, and by what they count as.
    by_base: Order,
    by_aged: Order,
    turns: Turns,
}

/// All jobs that are not at rest.
#[derive(Default)]
pub(super) struct Line {
    entries: BTreeMap<JobId, Entry>,
    /// Few: each look goes over them.
    folders: Vec<Folder>,
    /// Names of folders of which no job is claimed, those without a job too.
    shut: BTreeSet<String>,
    /// Of folders of which something is said.
    shares: Shares,
    /// When the latest turn of any folder began.
    latest: u64,
    /// When a ready one counts for one step more.
    rises: BTreeSet<(u64, JobId)>,
    resting: BTreeSet<(Time, JobId)>,
    parked: BTreeSet<(Time, JobId)>,
}

impl Line {
    /// A job came, or changed.
    pub(super) fn update(&mut self, job: &Job, now: Now) {
        let before = self.entries.remove(&job.id).inspect(|entry| self.leave(job.id, entry));
        if !job.kind().is_live() {
            return;
        }
        let place = match (job.kind(), job.pause()) {
            (Kind::Parked, pause) => Place::Parked(pause.unwrap_or_default()),
            (kind, Some(then)) if kind.is_queued() => Place::Resting(then),
            (kind, _) if kind.is_queued() => Place::Ready,
            _ => Place::Held,
        };
        let from = job.waits_since();
        let (age, came) = match before.filter(|before| before.from == from) {
            Some(before) => (before.age, before.came),
            None => (now.wall.0.saturating_sub(from.0).min(OLDEST_MS), now.ticks),
        };
        let (alone, size, base) = (job.must_run_alone(), job.source.size, job.priority);
        let folder = self.folder(&job.source.folder);
        let mut entry = Entry { place, folder, alone, size, base, aged: base, from, age, came };
        entry.aged = entry.aged(now.ticks);
        self.enter(job.id, &entry, now.ticks);
        self.entries.insert(job.id, entry);
    }

    fn folder(&mut self, name: &str) -> usize {
        self.folders.iter().position(|folder| folder.name == name).unwrap_or_else(|| {
            let turns = Turns::of(self.shares.get(name).copied().unwrap_or_default());
            self.folders.push(Folder { name: name.to_owned(), turns, ..Folder::default() });
            self.folders.len() - 1
        })
    }

    /// Has no job of these hot folders claimed until others, or none, are shut.
    pub(super) fn shut(&mut self, folders: &BTreeSet<String>) {
        self.shut.clone_from(folders);
    }

    /// Has folders share the work so.
    pub(super) fn share(&mut self, shares: &Shares) {
        self.shares.clone_from(shares);
        for folder in &mut self.folders {
            folder.turns.share = shares.get(&folder.name).copied().unwrap_or_default();
        }
    }

    /// The job is about to be claimed: its folder has its turn, unless there is nothing to compute.
    pub(super) fn begin_turn(&mut self, id: JobId) {
        let Some(entry) = self.entries.get(&id).filter(|entry| !matches!(entry.place, Place::Parked(_))) else { return };
        if let Some(folder) = self.folders.get_mut(entry.folder) {
            self.latest = folder.turns.begin(self.latest);
        }
    }

    /// Folders of which a job may be claimed.
    fn open(&self) -> impl Iterator<Item = &Folder> {
        self.folders.iter().filter(|folder| !self.shut.contains(&folder.name) && folder.turns.has_room())
    }

    /// Is it a job of a folder that is open?
    fn is_open(&self, id: JobId) -> bool {
        let folder = self.entries.get(&id).and_then(|entry| self.folders.get(entry.folder));
        folder.is_some_and(|folder| !self.shut.contains(&folder.name))
    }

    fn enter(&mut self, id: JobId, entry: &Entry, ticks: u64) {
        match entry.place {
            Place::Held => self.folders.get_mut(entry.folder).into_iter().for_each(|folder| folder.turns.held += 1),
            Place::Ready => {
                if let Some(folder) = self.folders.get_mut(entry.folder) {
                    folder.by_base.0.insert(Order::key(id, entry, entry.base), entry.size);
                    folder.by_aged.0.insert(Order::key(id, entry, entry.aged), entry.size);
                }
                if entry.aged < Priority::HIGHEST {
                    self.rises.insert((rise(entry, ticks), id));
                }
            }
            Place::Resting(then) => drop(self.resting.insert((then, id))),
            Place::Parked(then) => drop(self.parked.insert((then, id))),
        }
    }

    fn leave(&mut self, id: JobId, entry: &Entry) {
        match entry.place {
            Place::Held => self
                .folders
                .get_mut(entry.folder)
                .into_iter()
                .for_each(|folder| folder.turns.held = folder.turns.held.saturating_sub(1)),
            Place::Ready => {
                if let Some(folder) = self.folders.get_mut(entry.folder) {
                    folder.by_base.0.remove(&Order::key(id, entry, entry.base));
                    folder.by_aged.0.remove(&Order::key(id, entry, entry.aged));
                }
                if entry.aged < Priority::HIGHEST {
                    self.rises.remove(&(rise_after(entry, entry.aged.above(entry.base)), id));
                }
            }
            Place::Resting(then) => drop(self.resting.remove(&(then, id))),
            Place::Parked(then) => drop(self.parked.remove(&(then, id))),
        }
    }

    /// Lets ready jobs rise that have waited for long enough.
    fn age(&mut self, ticks: u64) {
        while let Some((at, id)) = self.rises.first().copied().filter(|(at, _)| *at <= ticks) {
            self.rises.remove(&(at, id));
            let Some(entry) = self.entries.get_mut(&id) else { continue };
            let Some(folder) = self.folders.get_mut(entry.folder) else { continue };
            folder.by_aged.0.remove(&Order::key(id, entry, entry.aged));
            entry.aged = entry.aged(ticks);
            folder.by_aged.0.insert(Order::key(id, entry, entry.aged), entry.size);
            if entry.aged < Priority::HIGHEST {
                self.rises.insert((rise(entry, ticks), id));
            }
        }
    }

    /// The job that is to be claimed next of those that `want` allows, and whose folder is open.
    pub(super) fn first(&mut self, want: &Filter, now: Now) -> Option<JobId> {
        self.age(now.ticks);
        if let Some(id) = self.unparked(now) {
            return Some(id);
        }
        let turn = |folder: &Folder| Reverse(folder.turns.next(self.latest));
        let rested = self
            .rested(want, now)
            .filter_map(|(id, entry)| Some((entry.aged(now.ticks), turn(self.folders.get(entry.folder)?), Reverse(id))));
        let ready = |folder: &Folder| folder.by_aged.first(want).map(|(priority, id)| (priority, turn(folder), Reverse(id)));
        rested.chain(self.open().filter_map(ready)).max().map(|(_, _, Reverse(id))| id)
    }

    /// May a parked job be tried again?
    pub(super) fn has_parked(&self, now: Now) -> bool {
        self.unparked(now).is_some()
    }

    fn unparked(&self, now: Now) -> Option<JobId> {
        over(&self.parked, now.wall).map(|(_, id)| *id).find(|id| self.is_open(*id))
    }

    /// How soon those that `want` allows are wanted; parked ones left out.
    pub(super) fn waiting(&mut self, want: &Filter, now: Now) -> Option<Waiting> {
        self.age(now.ticks);
        let ready = |folder: &Folder| Some((folder.by_base.first(want)?.0, folder.by_aged.first(want)?.0));
        let ready = self.open().filter_map(ready);
        let all = self.rested(want, now).map(|(_, entry)| (entry.base, entry.aged(now.ticks))).chain(ready);
        let highest = all.reduce(|(base, aged), (other, other_aged)| (base.max(other), aged.max(other_aged)));
        highest.map(|(highest, aged)| Waiting { highest, aged })
    }

    /// Jobs whose pause is over, of folders of which one may be claimed.
    fn rested(&self, want: &Filter, now: Now) -> impl Iterator<Item = (JobId, &Entry)> {
        let has_room = |entry: &&Entry| self.folders.get(entry.folder).is_some_and(|folder| folder.turns.has_room());
        let entry =
            move |(_, id): &(Time, JobId)| Some((*id, self.entries.get(id).filter(has_room).filter(|_| self.is_open(*id))?));
        over(&self.resting, now.wall).filter_map(entry).filter(|(_, entry)| entry.fits(want))
    }
}

/// When it rises next.
fn rise(entry: &Entry, ticks: u64) -> u64 {
    rise_after(entry, entry.age(ticks) / AGEING_MS)
}

/// When it rises after so many steps.
fn rise_after(entry: &Entry, steps: u64) -> u64 {
    entry.came.saturating_add(((steps + 1) * AGEING_MS).saturating_sub(entry.age))
}

/// Those whose pause is over: it ended, or it ends later than any pause may (the clock has jumped).
fn over(pauses: &BTreeSet<(Time, JobId)>, now: Time) -> impl Iterator<Item = &(Time, JobId)> {
    let last = JobId(u64::MAX);
    let beyond = (now.plus_ms(BACKOFF_CAP_MS), last);
    pauses.range(..=(now, last)).chain(pauses.range((std::ops::Bound::Excluded(beyond), std::ops::Bound::Unbounded)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::share::{Share, Weight};
    use crate::testkit::dropped;

    fn at(ms: u64) -> Now {
        Now { wall: Time(1_000_000_000 + ms), ticks: ms }
    }

    fn job(id: u64, size: u64, priority: i64, came: u64) -> Job {
        let source = dropped(&format!("{id}.stl"), size).unwrap().source;
        let mut job = Job::queued(JobId(id), source, at(came).wall);
        job.priority = Priority::try_from(priority).unwrap();
        job
    }

    fn line(jobs: &[Job]) -> Line {
        let mut line = Line::default();
        jobs.iter().for_each(|job| line.update(job, Now { wall: job.submitted, ticks: job.submitted.0 - at(0).wall.0 }));
        line
    }

    /// Takes all that are in line, one after the other.
    fn order(line: &mut Line, want: &Filter, ms: u64) -> Vec<u64> {
        let taken = std::iter::from_fn(|| {
            let id = line.first(want, at(ms))?;
            let entry = line.entries.remove(&id).unwrap();
            line.leave(id, &entry);
            Some(id.0)
        });
        taken.collect()
    }

    fn any() -> Filter {
        Filter::default()
    }

    #[test]
    fn the_higher_priority_goes_first_and_of_one_the_older() {
        let jobs = [job(1, 10, 5, 0), job(2, 9000, 0, 0), job(3, 7, 9, 0), job(4, 100_000, 5, 0), job(5, 7, 9, 0)];
        assert_eq!(order(&mut line(&jobs), &any(), 1), [3, 5, 1, 4, 2]);
        let small = Filter { size: (0, 9000), alone: false };
        assert_eq!(order(&mut line(&jobs), &small, 1), [3, 5, 1, 2]);
        let mut line = line(&jobs);
        assert_eq!(order(&mut line, &Filter { alone: true, ..any() }, 1), [0; 0]);
        assert_eq!(order(&mut line, &Filter { size: (9000, 9000), alone: false }, 1), [2]);
    }

    /// A folder whose disk is full holds up no other, whatever waits there.
    #[test]
    fn a_folder_that_is_shut_lets_the_others_go_on() {
        let of = |folder: &str, mut job: Job| {
            job.source.folder = folder.into();
            job
        };
        let jobs = [of("full", job(1, 10, 9, 0)), of("other", job(2, 10, 5, 0)), of("full", job(3, 10, 5, 0))];
        let mut line = line(&jobs);
        line.shut(&["full", "late"].map(String::from).into());
        assert_eq!(line.waiting(&any(), at(1)).map(|waiting| waiting.highest), Some(Priority::try_from(5).unwrap()));
        assert_eq!((line.first(&any(), at(1)), line.has_parked(at(1))), (Some(JobId(2)), false));
        line.update(&of("late", job(4, 10, 9, 0)), at(1));
        assert_eq!(line.first(&any(), at(1)), Some(JobId(2)), "it was shut before it had a job");
        // What rose meanwhile has its place when the folder is open again.
        line.shut(&BTreeSet::from(["late".into()]));
        assert_eq!(order(&mut line, &any(), 9 * AGEING_MS), [1, 2, 3]);
        assert!(line.first(&any(), at(1)).is_none() && line.waiting(&any(), at(1)).is_none());
    }

    /// A flood of urgent files cannot keep one waiting for ever: after nine steps it is as high as any, and older.
    #[test]
    fn whoever_waits_rises_step_by_step() {
        let patient = job(1, 10, 0, 0);
        for steps in 0..=9_i64 {
            let came = steps.unsigned_abs() * AGEING_MS;
            let urgent = [job(2, 10, 9, came), job(3, 10, steps, came), job(4, 10, (steps + 1).min(9), came)];
            let mut line = line(&[std::slice::from_ref(&patient), &urgent].concat());
            let expected = if steps == 9 { [1, 2, 3, 4] } else { [2, 4, 1, 3] };
            assert_eq!(order(&mut line, &any(), came), expected, "after {steps} steps");
        }
    }

    /// It rises in a line that goes on, too, and not before its time.
    #[test]
    fn a_step_comes_after_its_time_and_not_before() {
        let mut line = line(&[job(1, 10, 5, 0), job(2, 10, 6, 1)]);
        assert_eq!(line.first(&any(), at(AGEING_MS - 1)), Some(JobId(2)));
        assert_eq!(line.first(&any(), at(AGEING_MS)), Some(JobId(1)));
        assert_eq!(line.first(&any(), at(AGEING_MS + 1)), Some(JobId(2)), "it has risen, too");
        assert_eq!(line.waiting(&any(), at(2 * AGEING_MS)), Some(Waiting { highest: priority(6), aged: priority(7) }));
        assert_eq!(order(&mut line, &any(), 100 * AGEING_MS), [1, 2]);
        let is_empty = |folder: &Folder| folder.by_base.0.is_empty() && folder.by_aged.0.is_empty();
        assert!(line.rises.is_empty() && line.folders.iter().all(is_empty));
    }

    fn priority(number: i64) -> Priority {
        Priority::try_from(number).unwrap()
    }

    /// A clock that is set back or forward changes no age that was counted, and one that was wrong at the start does not keep anyone from
    /// rising.
    #[test]
    fn f15_clocks_that_jump_keep_no_one_waiting() {
        for wall in [Time(0), Time(u64::MAX)] {
            let mut line = line(&[job(1, 10, 0, 0)]);
            let waiting = |line: &mut Line, ticks| line.waiting(&any(), Now { wall, ticks }).unwrap().aged;
            assert_eq!(waiting(&mut line, AGEING_MS - 1), priority(0));
            assert_eq!(waiting(&mut line, AGEING_MS), priority(1));
        }
        // Dropped in a year that is still to come, as seen from this life of the daemon.
        let mut line = Line::default();
        line.update(&job(1, 10, 0, 0), Now { wall: Time(0), ticks: 7 });
        let now = |ticks| Now { wall: Time(0), ticks };
        assert_eq!(line.waiting(&any(), now(7)).unwrap().aged, priority(0));
        assert_eq!(line.waiting(&any(), now(7 + AGEING_MS)).unwrap().aged, priority(1));
    }

    /// Attempts and pauses make no job younger, a retry does; its size and its suspicion may change on the way.
    #[test]
    fn a_job_that_comes_back_is_as_old_as_before() {
        let mut patient = job(1, 10, 5, 0);
        let mut line = line(std::slice::from_ref(&patient));
        patient.state = crate::job::State::Queued { not_before: Some(at(AGEING_MS + 5).wall) };
        line.update(&patient, at(10));
        assert_eq!(line.first(&any(), at(AGEING_MS)), None, "it rests");
        assert_eq!(line.waiting(&any(), at(AGEING_MS + 5)).unwrap().aged, priority(6));
        patient.needs_all = true;
        patient.state = crate::job::State::Queued { not_before: None };
        line.update(&patient, at(AGEING_MS + 5));
        let alone = Filter { alone: true, ..any() };
        assert_eq!(
            (line.waiting(&any(), at(AGEING_MS + 5)), line.waiting(&alone, at(AGEING_MS + 5)).unwrap().aged),
            (None, priority(6))
        );
        patient.retried = Some(at(AGEING_MS + 6).wall);
        line.update(&patient, at(AGEING_MS + 6));
        assert_eq!(line.waiting(&alone, at(AGEING_MS + 7)).unwrap().aged, priority(5));
        patient.state = crate::job::State::Cancelled { why: crate::job::Withdrawal::Operator };
        line.update(&patient, at(AGEING_MS + 8));
        assert!(line.entries.is_empty() && line.rises.is_empty());
    }

    /// However the weights are, and whoever is first, each folder that always has jobs gets its part, but for one turn.
    #[test]
    fn turns_go_by_weights() {
        for (weights, claims) in [([1, 1], 40), ([100, 1], 505), ([3, 7], 100), ([10, 40], 50)] {
            let mut line = Line::default();
            let names = ["a", "b"];
            let share = |weight| Share { weight: Weight::try_from(weight).unwrap(), most_running: None };
            line.share(&names.into_iter().map(str::to_owned).zip(weights.map(share)).collect());
            for id in 0..2 * claims {
                let mut job = job(id + 1, 10, 5, 0);
                job.source.folder = names[usize::from(id >= claims)].into();
                line.update(&job, at(0));
            }
            let mut counts = [0.0; 2];
            for n in 1..=claims {
                let id = line.first(&any(), at(1)).unwrap();
                line.begin_turn(id);
                let entry = line.entries.remove(&id).unwrap();
                line.leave(id, &entry);
                counts[entry.folder] += 1.0;
                let fair = weights.map(|weight| n as f64 * weight as f64 / weights.iter().sum::<i64>() as f64);
                assert!(
                    counts.iter().zip(fair).all(|(count, fair)| (count - fair).abs() <= 1.01),
                    "{weights:?}: {counts:?}, not {fair:?}"
                );
            }
        }
    }
}
