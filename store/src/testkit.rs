//! What every [`JobStore`] must do, as one suite; and the small things that tests of store and daemon need.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::id::{Attempt, Boot, Clock, Hash, JobId, Time};
use crate::job::{
    Area, BACKOFF_CAP_MS, BACKOFF_MS, Death, Duty, ENVIRONMENT_RETRIES, Ending, Illegal, Job, Kind, Publication, Source, State,
    Step, Testimony, Withdrawal,
};
use crate::path::{PathError, RelPath};
use crate::store::{Claim, Control, Filter, JobStore, Lease, Query, StoreError, Submission};

/// A clock that stands still until it is set.
#[derive(Debug)]
pub struct ManualClock {
    now: AtomicU64,
    boot: AtomicU64,
}

impl ManualClock {
    /// A clock at `now`.
    pub fn new(now: Time) -> Self {
        Self { now: AtomicU64::new(now.0), boot: AtomicU64::new(1) }
    }

    /// Sets it, forwards or backwards.
    pub fn set(&self, now: Time) {
        self.now.store(now.0, Ordering::SeqCst);
    }

    /// Lets `ms` pass.
    pub fn pass(&self, ms: u64) {
        self.now.fetch_add(ms, Ordering::SeqCst);
    }

    /// The machine goes down and comes up again.
    pub fn reboot(&self) {
        self.boot.fetch_add(1, Ordering::SeqCst);
    }
}

impl Clock for ManualClock {
    fn now(&self) -> Time {
        Time(self.now.load(Ordering::SeqCst))
    }

    fn boot(&self) -> Boot {
        Boot(self.boot.load(Ordering::SeqCst))
    }
}

/// A store under test.
pub trait Subject {
    /// It, in its present life.
    fn store(&self) -> &dyn JobStore;
    /// The daemon dies, and another opens the same store.
    fn restart(&mut self);
}

/// A dropped file of the name `name` and `size` bytes; its inode is a checksum of the name.
///
/// # Errors
/// When `name` is no plain relative path.
pub fn dropped(name: &str, size: u64) -> Result<Submission, PathError> {
    let source = Source {
        folder: "hot".into(),
        path: RelPath::new(name)?,
        dev: 1,
        ino: u64::from(crc32fast::hash(name.as_bytes())),
        size,
        mtime_ns: 1_700_000_000_000_000_000,
        profile: "default".into(),
    };
    Ok(Submission { source, foreign: None })
}

/// A result of `ending` under the names of the source.
pub fn result_of(job: &Job, ending: Ending) -> Publication {
    Publication {
        ending,
        reason: String::new(),
        output: Some(job.source.path.clone()),
        output_hash: Some(Hash([7; 32])),
        report_hash: Some(Hash([8; 32])),
        source_ctime_ns: None,
        original: Some(job.source.path.clone()),
    }
}

type Check = fn(&mut dyn Subject, &ManualClock) -> Result<(), StoreError>;

/// Runs every check on a fresh store from `make`.
///
/// # Panics
/// When the store does not do what [`JobStore`] promises.
pub fn conformance(make: &dyn Fn(Arc<dyn Clock>) -> Box<dyn Subject>) {
    let checks: [(&str, Check); 15] = [
        ("submission is idempotent", submission_is_idempotent),
        ("a file that came back is new", a_file_that_came_back_is_new),
        ("the oldest that fits is claimed", the_oldest_that_fits_is_claimed),
        ("the whole way", the_whole_way),
        ("claims are fenced", claims_are_fenced),
        ("pauses are kept", pauses_are_kept),
        ("a crash is retried once", a_crash_is_retried_once),
        ("the operator's wishes", the_operators_wishes),
        ("death of the daemon", death_of_the_daemon),
        ("suspects run alone", suspects_run_alone),
        ("power cuts blame no one", power_cuts_blame_no_one),
        ("a result that cannot be placed is parked", a_result_that_cannot_be_placed_is_parked),
        ("results on their way are finished", results_on_their_way_are_finished),
        ("lists and counts agree", lists_and_counts_agree),
        ("threads get different jobs", threads_get_different_jobs),
    ];
    for (name, check) in checks {
        let clock = Arc::new(ManualClock::new(Time(1_000_000)));
        let mut subject = make(Arc::<ManualClock>::clone(&clock));
        if let Err(error) = check(subject.as_mut(), &clock) {
            panic!("{name}: {error}");
        }
    }
}

fn named(name: &str, size: u64) -> Result<Submission, StoreError> {
    dropped(name, size).map_err(|error| StoreError::TooLong { what: error.to_string() })
}

fn submit_one(store: &dyn JobStore, name: &str, size: u64) -> Result<JobId, StoreError> {
    let answers = store.submit(&[named(name, size)?])?;
    assert_eq!(answers.len(), 1);
    answers.first().map(|answer| answer.id).ok_or(StoreError::Unknown(JobId(0)))
}

fn claim_any(store: &dyn JobStore) -> Result<Claim, StoreError> {
    store.claim(&Filter::default())?.ok_or(StoreError::Unknown(JobId(0)))
}

fn job(store: &dyn JobStore, id: JobId) -> Result<Job, StoreError> {
    store.get(id)?.ok_or(StoreError::Unknown(id))
}

fn no_one_is_innocent(_: &Job) -> Testimony {
    Testimony::None
}

fn submission_is_idempotent(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let (a, b) = (named("a.stl", 84)?, named("b.stl", 84)?);
    let first = store.submit(&[a.clone(), b.clone(), a.clone()])?;
    assert_eq!(first.iter().map(|x| (x.id, x.new)).collect::<Vec<_>>(), [(JobId(1), true), (JobId(2), true), (JobId(1), false)]);
    let again = store.submit(&[b, a.clone()])?;
    assert_eq!(again.iter().map(|x| (x.id, x.new)).collect::<Vec<_>>(), [(JobId(2), false), (JobId(1), false)]);
    // Other bytes (another size), another file (another inode), another time, another folder: another drop.
    let mut others = [a.clone(), a.clone(), a.clone(), a.clone()];
    let [size, inode, time, folder] = &mut others;
    size.source.size += 1;
    inode.source.ino += 1;
    time.source.mtime_ns += 1;
    folder.source.folder = "other".into();
    assert!(store.submit(&others)?.iter().all(|x| x.new));
    // A name that fits no record is refused with all that came with it.
    let mut long = a;
    long.source.profile = "p".repeat(200);
    let refused = store.submit(&[named("c.stl", 84)?, long]);
    assert!(matches!(refused, Err(StoreError::TooLong { .. })), "{refused:?}");
    assert_eq!(store.list(&Query::default())?.len(), 6);
    subject.restart();
    assert_eq!(subject.store().list(&Query::default())?.len(), 6);
    let answers = subject.store().submit(&[named("b.stl", 84)?, named("d.stl", 84)?])?;
    assert_eq!(answers.iter().map(|x| (x.id, x.new)).collect::<Vec<_>>(), [(JobId(2), false), (JobId(7), true)]);
    Ok(())
}

fn a_file_that_came_back_is_new(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    // Its original went to done/, and someone moved it back into in/: same identity, but a new drop.
    let moved = submit_one(store, "moved.stl", 84)?;
    finish(store, &claim_any(store)?, Ending::Clean, true)?;
    assert_ne!(submit_one(store, "moved.stl", 84)?, moved);
    finish(store, &claim_any(store)?, Ending::Clean, true)?;
    // Where originals stay in in/, a scan finds them again and again: the same drop.
    let stays = submit_one(store, "stays.stl", 84)?;
    finish(store, &claim_any(store)?, Ending::Clean, false)?;
    assert_eq!(submit_one(store, "stays.stl", 84)?, stays);
    // Changed under our hands: whatever is found there later is new.
    let changed = submit_one(store, "changed.stl", 84)?;
    store.advance(&claim_any(store)?, Step::Withdrawn(Withdrawal::Changed))?;
    assert_ne!(submit_one(store, "changed.stl", 84)?, changed);
    Ok(())
}

/// Takes a claim to its end; `moves`: the original leaves `in/`.
fn finish(store: &dyn JobStore, claim: &Claim, ending: Ending, moves: bool) -> Result<Job, StoreError> {
    let mut publication = result_of(&claim.job, ending);
    if !moves {
        publication.original = None;
    }
    store.advance(claim, Step::Intend(publication))?;
    store.advance(claim, Step::Placed)?;
    store.advance(claim, Step::Finished)
}

fn the_oldest_that_fits_is_claimed(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let sizes = [5000, 100, 4096, 4095, 1, 0, 70_000];
    for (at, size) in sizes.into_iter().enumerate() {
        submit_one(store, &format!("{at}.stl"), size)?;
    }
    let take = |least, most| {
        let claim = store.claim(&Filter { size: (least, most), alone: false })?;
        Ok::<_, StoreError>(claim.map(|claim| claim.id.0))
    };
    assert_eq!(take(1, 99)?, Some(5));
    assert_eq!(take(4096, 5000)?, Some(1), "bounds are included, and the oldest goes first");
    assert_eq!(take(4096, 4999)?, Some(3));
    assert_eq!(take(4096, 4999)?, None);
    assert_eq!(take(0, u64::MAX)?, Some(2));
    assert_eq!(take(0, u64::MAX)?, Some(4));
    assert_eq!(take(0, 0)?, Some(6));
    assert_eq!(take(0, u64::MAX)?, Some(7));
    assert_eq!(take(0, u64::MAX)?, None);
    Ok(())
}

fn the_whole_way(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let id = submit_one(store, "part.stl", 84)?;
    let claim = claim_any(store)?;
    assert_eq!((claim.id, claim.job.attempts, claim.job.duty()), (id, Attempt(1), Duty::Run));
    let wrong = store.advance(&claim, Step::Finished);
    assert!(matches!(wrong, Err(StoreError::Illegal { source: Illegal::State { .. }, .. })), "{wrong:?}");
    let mut publication = result_of(&claim.job, Ending::Repaired);
    assert_eq!(store.advance(&claim, Step::Intend(publication.clone()))?.duty(), Duty::Place);
    // The name was taken meanwhile.
    publication.output = RelPath::new("part~2.stl").ok();
    assert_eq!(store.advance(&claim, Step::Intend(publication.clone()))?.duty(), Duty::Place);
    assert_eq!(store.advance(&claim, Step::Placed)?.duty(), Duty::MoveOriginal);
    let original = publication.output.clone().ok_or(StoreError::Unknown(id))?;
    store.advance(&claim, Step::Redirect { original: original.clone() })?;
    assert_eq!(store.advance(&claim, Step::Finished)?.duty(), Duty::Rest);
    publication.original = Some(original.clone());
    subject.restart();
    let job = job(subject.store(), id)?;
    assert_eq!(job.state, State::Ended { publication });
    assert_eq!((job.kind(), job.original()), (Kind::Done, (Area::Done, &original)));
    assert_eq!(subject.store().recover(&no_one_is_innocent)?, []);
    assert_eq!(subject.store().claim(&Filter::default())?, None);
    Ok(())
}

fn claims_are_fenced(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    submit_one(store, "part.stl", 84)?;
    let old = claim_any(store)?;
    assert_eq!(store.heartbeat(&old)?, Lease::Held);
    store.advance(&old, Step::HandBack)?;
    let fenced = |result: Result<Job, StoreError>| {
        assert!(matches!(result, Err(StoreError::Illegal { source: Illegal::Fenced, .. })), "{result:?}");
    };
    assert_eq!(store.heartbeat(&old)?, Lease::Lost);
    fenced(store.advance(&old, Step::Died(Death::TimeLimit)));
    let new = claim_any(store)?;
    assert!(new.token > old.token);
    assert_eq!(new.job.attempts, Attempt(2), "handed back costs nothing, but is counted");
    assert_eq!(store.heartbeat(&old)?, Lease::Lost);
    fenced(store.advance(&old, Step::Intend(result_of(&old.job, Ending::Clean))));
    subject.restart();
    // Void even before anyone recovers it.
    assert_eq!(subject.store().heartbeat(&new)?, Lease::Lost);
    fenced(subject.store().advance(&new, Step::Intend(result_of(&new.job, Ending::Clean))));
    Ok(())
}

fn pauses_are_kept(subject: &mut dyn Subject, clock: &ManualClock) -> Result<(), StoreError> {
    let id = submit_one(subject.store(), "part.stl", 84)?;
    let mut pause = BACKOFF_MS;
    for _ in 0..ENVIRONMENT_RETRIES {
        let store = subject.store();
        store.advance(&claim_any(store)?, Step::Environment { reason: "no space\nleft".into() })?;
        let job = job(store, id)?;
        assert_eq!((job.kind(), job.note.as_str()), (Kind::Waiting, "no space left"));
        clock.pass(pause - 1);
        assert_eq!(store.claim(&Filter::default())?, None, "a pause of {pause} ms");
        clock.pass(1);
        pause = (2 * pause).min(BACKOFF_CAP_MS);
        subject.restart();
    }
    let store = subject.store();
    let claim = claim_any(store)?;
    let end = store.advance(&claim, Step::Environment { reason: "no space left".into() })?;
    assert_eq!((end.kind(), end.duty()), (Kind::Concluded, Duty::Intend));
    assert_eq!(finish(store, &claim, Ending::Environment, true)?.kind(), Kind::Failed);

    // A clock that jumps back does not make a pause endless.
    let id = submit_one(store, "other.stl", 84)?;
    store.advance(&claim_any(store)?, Step::Environment { reason: "no space left".into() })?;
    clock.set(Time(1000));
    assert_eq!(claim_any(store)?.id, id);
    Ok(())
}

fn a_crash_is_retried_once(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let id = submit_one(subject.store(), "part.stl", 84)?;
    // Kills from outside are no one's fault and cost nothing.
    for _ in 0..3 {
        let store = subject.store();
        assert_eq!(store.advance(&claim_any(store)?, Step::Died(Death::Killed(9)))?.kind(), Kind::Queued);
    }
    let store = subject.store();
    assert_eq!(store.advance(&claim_any(store)?, Step::Died(Death::Signal(11)))?.kind(), Kind::Queued);
    subject.restart();
    let store = subject.store();
    let claim = claim_any(store)?;
    let end = store.advance(&claim, Step::Died(Death::MemoryLimit))?;
    assert_eq!((end.kind(), end.duty()), (Kind::Concluded, Duty::Intend));
    let other = store.advance(&claim, Step::Intend(result_of(&end, Ending::Clean)));
    assert!(matches!(other, Err(StoreError::Illegal { .. })), "{other:?}");
    let end = finish(store, &claim, Ending::Quarantined, true)?;
    assert_eq!((end.id, end.kind(), end.attempts), (id, Kind::Quarantined, Attempt(5)));
    assert_eq!(end.original().0, Area::Quarantine);
    Ok(())
}

fn the_operators_wishes(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    assert!(matches!(store.control(JobId(9), Control::Cancel), Err(StoreError::Unknown(JobId(9)))));
    // Cancelled in the queue: stays where it is, and is not taken again.
    let id = submit_one(store, "part.stl", 84)?;
    assert_eq!(store.control(id, Control::Cancel)?.kind(), Kind::Cancelled);
    assert_eq!(submit_one(store, "part.stl", 84)?, id);
    assert_eq!(store.claim(&Filter::default())?, None);
    assert_eq!(store.control(id, Control::Retry)?.kind(), Kind::Queued);
    // Cancelled while it runs: the worker is stopped first.
    let claim = claim_any(store)?;
    assert_eq!(store.control(id, Control::Cancel)?.duty(), Duty::Stop);
    assert_eq!(store.heartbeat(&claim)?, Lease::Cancel);
    assert_eq!(store.advance(&claim, Step::Cancelled)?.kind(), Kind::Cancelled);
    assert_eq!(store.heartbeat(&claim)?, Lease::Lost);
    // Failed, and tried again from where its original is now.
    store.control(id, Control::Retry)?;
    assert_eq!(finish(store, &claim_any(store)?, Ending::NotGood, true)?.kind(), Kind::Failed);
    let again = store.control(id, Control::Retry)?;
    assert_eq!((again.kind(), again.original()), (Kind::Queued, (Area::Failed, &again.source.path)));
    let claim = claim_any(store)?;
    assert_eq!(finish(store, &claim, Ending::Repaired, true)?.original().0, Area::Done);
    // What is good stays.
    assert!(matches!(store.control(id, Control::Retry), Err(StoreError::Illegal { .. })));
    assert!(matches!(store.control(id, Control::Cancel), Err(StoreError::Illegal { .. })));
    // A foreign file is listed until it is gone.
    let mut foreign = named("scene.blend", 9)?;
    foreign.foreign = Some("a Blender scene".into());
    let noticed = store.submit(&[foreign])?;
    let id = noticed.first().map(|answer| answer.id).unwrap_or_default();
    assert_eq!(job(store, id)?.state, State::Noticed { reason: "a Blender scene".into() });
    assert_eq!(store.claim(&Filter::default())?, None);
    assert_eq!(store.control(id, Control::Forget)?.kind(), Kind::Cancelled);
    Ok(())
}

fn death_of_the_daemon(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let (innocent, guilty, stopped) =
        (submit_one(store, "a.stl", 84)?, submit_one(store, "b.stl", 84)?, submit_one(store, "c.stl", 84)?);
    for _ in 0..3 {
        claim_any(store)?;
    }
    store.control(stopped, Control::Cancel)?;
    let waiting = submit_one(store, "d.stl", 84)?;
    assert_eq!(store.recover(&no_one_is_innocent)?, [], "a daemon that lives has lost nothing");
    subject.restart();
    let store = subject.store();
    let recovered = store.recover(&|job| if job.id == innocent { Testimony::Outlived } else { Testimony::None })?;
    assert_eq!(recovered.iter().map(|one| one.job.id).collect::<Vec<_>>(), [innocent, guilty, stopped]);
    assert!(recovered.iter().all(|one| one.claim.is_none() && one.job.work == Some(one.void)));
    assert_eq!(job(store, innocent)?.blame, crate::job::Blame::default());
    let blame = job(store, guilty)?.blame;
    assert_eq!((blame.deaths, blame.deaths_alone, blame.charges), (1, 0, 0));
    assert_eq!(job(store, stopped)?.kind(), Kind::Cancelled);
    assert_eq!(job(store, waiting)?.attempts, Attempt(0));
    assert_eq!(store.recover(&no_one_is_innocent)?, [], "once is enough");
    // Who ran while another's result was on its way was not alone.
    for id in [innocent, guilty] {
        let claim = claim_any(store)?;
        assert_eq!(claim.id, id);
        if id == innocent {
            store.advance(&claim, Step::Intend(result_of(&claim.job, Ending::Clean)))?;
        }
    }
    subject.restart();
    assert_eq!(subject.store().recover(&no_one_is_innocent)?.len(), 2);
    let blame = job(subject.store(), guilty)?.blame;
    assert_eq!((blame.deaths, blame.deaths_alone), (2, 0));
    Ok(())
}

fn suspects_run_alone(subject: &mut dyn Subject, clock: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let (poison, bystander) = (submit_one(store, "poison.stl", 84)?, submit_one(store, "bystander.stl", 84)?);
    for _ in 0..2 {
        claim_any(subject.store())?;
        claim_any(subject.store())?;
        subject.restart();
        subject.store().recover(&no_one_is_innocent)?;
    }
    let store = subject.store();
    assert_eq!(job(store, poison)?.kind(), Kind::Alone);
    assert_eq!(store.claim(&Filter::default())?, None, "suspects do not run beside others");
    let suspects = Filter { alone: true, ..Filter::default() };
    // Not even after a pause.
    let claim = store.claim(&suspects)?.ok_or(StoreError::Unknown(poison))?;
    store.advance(&claim, Step::Environment { reason: "no space left".into() })?;
    clock.pass(BACKOFF_CAP_MS);
    assert_eq!(store.claim(&Filter::default())?, None, "nor after a pause");
    for death in 1..=3 {
        let store = subject.store();
        let claim = store.claim(&suspects)?.ok_or(StoreError::Unknown(poison))?;
        assert_eq!(claim.id, poison);
        assert!(claim.job.hold().is_some_and(|hold| hold.alone));
        subject.restart();
        let recovered = subject.store().recover(&|_| Testimony::InHand)?;
        let one = recovered.first().ok_or(StoreError::Unknown(poison))?;
        assert_eq!(one.job.blame.deaths_alone, death);
        assert_eq!(one.job.kind(), if death < 3 { Kind::Alone } else { Kind::Concluded });
        if let Some(claim) = &one.claim {
            assert_eq!(finish(subject.store(), claim, Ending::Quarantined, true)?.kind(), Kind::Quarantined);
        }
    }
    let store = subject.store();
    assert_eq!(job(store, poison)?.kind(), Kind::Quarantined);
    let claim = store.claim(&suspects)?.ok_or(StoreError::Unknown(bystander))?;
    assert_eq!(finish(store, &claim, Ending::Clean, true)?.kind(), Kind::Done);
    // An operator who releases it gives it a clean slate.
    assert_eq!(store.control(poison, Control::Retry)?.kind(), Kind::Queued);
    Ok(())
}

/// Whatever a witness says, another life of the machine is not the file's doing.
fn power_cuts_blame_no_one(subject: &mut dyn Subject, clock: &ManualClock) -> Result<(), StoreError> {
    let id = submit_one(subject.store(), "long.stl", 84)?;
    for cut in 0..5 {
        let want = Filter { alone: cut > 0, ..Filter::default() };
        let claim = subject.store().claim(&want)?.ok_or(StoreError::Unknown(id))?;
        assert_eq!(claim.job.hold().map(|hold| hold.alone), Some(cut > 0), "alone before it is suspected");
        subject.restart();
        clock.reboot();
        subject.store().recover(&|_| Testimony::InHand)?;
        let blame = job(subject.store(), id)?.blame;
        assert_eq!((blame.machine, blame.deaths, blame.deaths_alone, blame.charges), (cut + 1, 0, 0, 0));
    }
    Ok(())
}

fn a_result_that_cannot_be_placed_is_parked(subject: &mut dyn Subject, clock: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let (id, other) = (submit_one(store, "part.stl", 84)?, submit_one(store, "other.stl", 84)?);
    let claim = claim_any(store)?;
    let publication = result_of(&claim.job, Ending::Clean);
    store.advance(&claim, Step::Intend(publication))?;
    let park = Step::Park { reason: "permission denied".into(), committed: false };
    let parked = store.advance(&claim, park.clone())?;
    assert_eq!((parked.kind(), parked.note.as_str()), (Kind::Parked, "permission denied"));
    let void = store.advance(&claim, Step::Placed);
    assert!(matches!(void, Err(StoreError::Illegal { source: Illegal::Fenced, .. })), "its claim is void: {void:?}");
    assert_eq!(store.heartbeat(&claim)?, Lease::Lost);
    // Others go on meanwhile; when its pause is over, it is given to whoever asks.
    let between = claim_any(store)?;
    assert_eq!(between.id, other);
    assert_eq!(store.claim(&Filter::default())?, None);
    clock.pass(crate::job::PARK_MS);
    let again = store.claim(&Filter { size: (1 << 40, u64::MAX), alone: false })?.ok_or(StoreError::Unknown(id))?;
    assert_eq!((again.id, again.job.duty(), again.job.attempts), (id, Duty::Place, Attempt(1)));
    assert_eq!(again.job.work, Some(claim.token), "the work folder is still that of the worker");
    store.advance(&again, park)?;
    // A new daemon tries at once.
    subject.restart();
    let store = subject.store();
    assert_eq!(store.recover(&no_one_is_innocent)?.len(), 1, "parked jobs are no one's");
    let again = claim_any(store)?;
    assert_eq!(again.id, id);
    store.advance(&again, Step::Placed)?;
    assert_eq!(store.advance(&again, Step::Finished)?.kind(), Kind::Done);
    Ok(())
}

fn results_on_their_way_are_finished(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let id = submit_one(store, "part.stl", 84)?;
    let claim = claim_any(store)?;
    let publication = result_of(&claim.job, Ending::Clean);
    store.advance(&claim, Step::Intend(publication.clone()))?;
    let mut void = claim.token;
    for (duty, step) in [(Duty::Place, Step::Placed), (Duty::MoveOriginal, Step::Finished)] {
        subject.restart();
        let store = subject.store();
        let recovered = store.recover(&no_one_is_innocent)?;
        let one = recovered.first().ok_or(StoreError::Unknown(id))?;
        assert_eq!((one.job.duty(), one.void, one.job.attempts), (duty, void, Attempt(1)));
        assert_eq!(one.job.work, Some(claim.token), "the work folder is still that of the worker");
        let claim = one.claim.clone().ok_or(StoreError::Unknown(id))?;
        void = claim.token;
        store.advance(&claim, step)?;
    }
    let done = job(subject.store(), id)?;
    assert_eq!(done.state, State::Ended { publication });
    assert_eq!(done.blame, crate::job::Blame::default());
    // A result that was lost on its way is made again.
    let store = subject.store();
    submit_one(store, "lost.stl", 84)?;
    let claim = claim_any(store)?;
    store.advance(&claim, Step::Intend(result_of(&claim.job, Ending::Clean)))?;
    assert_eq!(store.advance(&claim, Step::Lost)?.kind(), Kind::Waiting);
    Ok(())
}

fn lists_and_counts_agree(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let found: Result<Vec<_>, _> = (0..2500).map(|at| named(&format!("{at}.stl"), at)).collect();
    assert_eq!(store.submit(&found?)?.len(), 2500);
    for ending in [Ending::Clean, Ending::NeedsReview, Ending::Unreadable, Ending::Repaired] {
        finish(store, &claim_any(store)?, ending, true)?;
    }
    claim_any(store)?;
    subject.restart();
    let store = subject.store();
    let all = store.list(&Query::default())?;
    assert!(all.iter().map(|job| job.id.0).eq(1..=2500));
    for (kind, count) in store.counts()? {
        let listed = store.list(&Query { kinds: vec![kind], ..Query::default() })?;
        assert!(listed.iter().eq(all.iter().filter(|job| job.kind() == kind)), "{kind}");
        assert_eq!(listed.len() as u64, count, "{kind}");
    }
    assert_eq!(store.counts()?.iter().map(|(_, count)| count).sum::<u64>(), 2500);
    let page = store.list(&Query { kinds: vec![Kind::Queued, Kind::Done], after: JobId(2), limit: 3 })?;
    assert!(page.iter().map(|job| job.id.0).eq([4, 6, 7]));
    let page = store.list(&Query { kinds: Vec::new(), after: JobId(2), limit: 3 })?;
    assert!(page.iter().map(|job| job.id.0).eq([3, 4, 5]));
    Ok(())
}

fn threads_get_different_jobs(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let found: Result<Vec<_>, _> = (0..64).map(|at| named(&format!("{at}.stl"), at)).collect();
    store.submit(&found?)?;
    let work = || -> Result<Vec<JobId>, StoreError> {
        let mut done = Vec::new();
        while let Some(claim) = store.claim(&Filter::default())? {
            finish(store, &claim, Ending::Clean, true)?;
            done.push(claim.id);
        }
        Ok(done)
    };
    let results: Vec<Result<Vec<JobId>, StoreError>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(work)).collect();
        threads.into_iter().filter_map(|thread| thread.join().ok()).collect()
    });
    let mut taken = Vec::new();
    for result in results {
        taken.extend(result?);
    }
    assert_eq!(taken.len(), 64);
    assert_eq!(taken.iter().collect::<BTreeSet<_>>().len(), 64, "no job twice");
    let seqs: BTreeSet<_> = store.list(&Query::default())?.iter().map(|job| job.seq).collect();
    assert_eq!(seqs.len(), 64, "every transition has its own number");
    Ok(())
}
