//! What is taken in, and who may claim it when.

use crate::id::{Attempt, Hash, JobId, Recipe, Time};
use crate::job::{
    AGEING_MS, Area, BACKOFF_CAP_MS, BACKOFF_MS, Death, Duty, ENVIRONMENT_RETRIES, Ending, HAND_ON_MS, Illegal, Job, Kind,
    Priority, State, Step, Withdrawal, Witness,
};
use crate::path::RelPath;
use crate::store::{Control, Filter, JobStore, Lease, Query, Seen, StoreError, Submission};

use super::tools::{ManualClock, Subject, claim_any, finish, job, named, no_one_is_innocent, result_of, submit_one};

pub(super) fn submission_is_idempotent(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
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

pub(super) fn a_file_that_came_back_is_new(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
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

/// Whoever looks at a drop while it is moved learns that its job has ended, and makes no second one of it.
pub(super) fn a_file_that_may_be_gone_is_looked_at_again(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let seen =
        |after: Option<u64>| Ok::<_, StoreError>([Submission { seen: Seen::After(after.map(JobId)), ..named("a.stl", 84)? }]);
    let answer = |after| Ok::<_, StoreError>(store.submit(&seen(after)?)?.first().map(|told| (told.id.0, told.new, told.ended)));
    assert_eq!(answer(None)?, Some((1, true, false)));
    assert_eq!(answer(None)?, Some((1, false, false)), "it waits");
    finish(store, &claim_any(store)?, Ending::Clean, true)?;
    assert_eq!(answer(None)?, Some((1, false, true)));
    assert_eq!(store.claim(&Filter::default())?, None, "no second job was made");
    assert_eq!(answer(Some(1))?, Some((2, true, false)), "it was there after that end: the same file was dropped again");
    store.advance(&claim_any(store)?, Step::Withdrawn(Withdrawal::Vanished))?;
    assert_eq!(answer(Some(1))?, Some((2, false, true)));
    assert_eq!(answer(Some(2))?, Some((3, true, false)));
    finish(store, &claim_any(store)?, Ending::Clean, false)?;
    assert_eq!(answer(None)?, Some((3, false, false)), "its original stays, and it answers for it");
    Ok(())
}

/// A mesh that names it may come later: then the same job is queued, once, as urgent as the mesh. What an operator took back stays back.
pub(super) fn what_was_only_noticed_may_be_wanted_later(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let foreign = |name: &str| Ok::<_, StoreError>(Submission { foreign: Some("a .mtl file".into()), ..named(name, 9)? });
    let wanted = |name: &str| Ok::<_, StoreError>(Submission { priority: Priority::HIGHEST, ..named(name, 9)? });
    store.submit(&[foreign("a.mtl")?, foreign("b.mtl")?])?;
    store.control(JobId(2), Control::Cancel)?;
    assert_eq!(store.claim(&Filter::default())?, None);
    let answers = store.submit(&[wanted("a.mtl")?, wanted("b.mtl")?, wanted("a.mtl")?, wanted("c.mtl")?])?;
    let answers: Vec<_> = answers.iter().map(|answer| (answer.id.0, answer.new)).collect();
    assert_eq!(answers, [(1, true), (2, false), (1, false), (3, true)]);
    subject.restart();
    let store = subject.store();
    assert_eq!(
        [1, 2, 3].map(|id| job(store, JobId(id)).map(|job| job.kind()).ok()),
        [Kind::Queued, Kind::Cancelled, Kind::Queued].map(Some)
    );
    assert!(
        store
            .submit(&[foreign("a.mtl")?, wanted("a.mtl")?])?
            .iter()
            .all(|answer| *answer == crate::store::Submitted { id: JobId(1), new: false, ended: false })
    );
    let claim = claim_any(store)?;
    assert_eq!((claim.id, claim.job.priority), (JobId(1), Priority::HIGHEST));
    assert_eq!(finish(store, &claim, Ending::Carried, true)?.kind(), Kind::Carried);
    Ok(())
}

pub(super) fn the_oldest_that_fits_is_claimed(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
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

/// Under every store, and over restarts: the line is made anew then.
pub(super) fn the_more_urgent_goes_first(subject: &mut dyn Subject, clock: &ManualClock) -> Result<(), StoreError> {
    let priority = |number: i64| Priority::try_from(number).unwrap_or_default();
    let submit = |store: &dyn JobStore, name: &str, number| {
        store.submit(&[Submission { priority: priority(number), ..named(name, 84)? }]).map(|_| ())
    };
    let store = subject.store();
    for (name, number) in [("1.stl", 5), ("2.stl", 0), ("3.stl", 9), ("4.stl", 5)] {
        submit(store, name, number)?;
    }
    let fits = |store: &dyn JobStore| store.waiting(&Filter::default()).map(|waiting| waiting.map(|waiting| waiting.highest));
    assert_eq!(fits(store)?, Some(priority(9)));
    assert_eq!(claim_any(store)?.id, JobId(3));
    assert_eq!(fits(store)?, Some(priority(5)));
    assert_eq!(store.control(JobId(4), Control::Rank(priority(6)))?.priority, priority(6));
    subject.restart();
    let store = subject.store();
    store.recover(&no_one_is_innocent)?;
    assert_eq!((job(store, JobId(3))?.priority, job(store, JobId(4))?.priority), (priority(9), priority(6)));
    // What waits rises, also over a restart; what comes later is behind it.
    clock.pass(3 * AGEING_MS);
    subject.restart();
    let store = subject.store();
    submit(store, "5.stl", 4)?;
    submit(store, "6.stl", 3)?;
    let mut order = Vec::new();
    while let Some(claim) = store.claim(&Filter::default())? {
        order.push(claim.id.0);
        let late = store.control(claim.id, Control::Rank(priority(9)));
        assert!(matches!(late, Err(StoreError::Illegal { source: Illegal::State { .. }, .. })), "{late:?}");
    }
    assert_eq!(order, [3, 4, 1, 5, 2, 6], "9, 6 + 3, 5 + 3, 4, 0 + 3, 3");
    assert_eq!(store.waiting(&Filter::default())?, None);
    Ok(())
}

pub(super) fn the_whole_way(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
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

pub(super) fn claims_are_fenced(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
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

/// What the first attempt made is known to whoever comes next, in whatever life, and nothing of it is left in the end.
pub(super) fn a_sampled_job_keeps_its_witness(subject: &mut dyn Subject, clock: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let id = submit_one(store, "part.stl", 84)?;
    let witness = Witness::new("a:/state", "1.0.0", Recipe(u64::MAX), Hash([7; 32]));
    let waits = store.advance(&claim_any(store)?, Step::Sampled(Box::new(witness.clone())))?;
    let kept = Some(Box::new(Witness { at: waits.changed, ..witness.clone() }));
    assert_eq!((waits.kind(), &waits.witness), (Kind::Queued, &kept));
    clock.pass(7);
    let claim = claim_any(store)?;
    assert_eq!((&claim.job.witness, claim.job.changed), (&kept, waits.changed.plus_ms(7)));
    let again = store.advance(&claim, Step::Sampled(Box::new(witness)));
    assert!(matches!(again, Err(StoreError::Illegal { source: Illegal::State { .. }, .. })), "{again:?}");
    assert_eq!(store.advance(&claim, Step::HandOn)?.kind(), Kind::Waiting);
    assert_eq!(store.claim(&Filter::default())?, None, "it rests for a moment");
    clock.pass(HAND_ON_MS);
    claim_any(store)?;
    subject.restart();
    let store = subject.store();
    store.recover(&no_one_is_innocent)?;
    let claim = claim_any(store)?;
    assert_eq!((claim.job.witness.clone(), claim.job.attempts), (kept, Attempt(4)));
    assert_eq!(finish(store, &claim, Ending::Repaired, true)?.witness, None);
    assert_eq!(job(store, id)?.witness, None);
    Ok(())
}

pub(super) fn pauses_are_kept(subject: &mut dyn Subject, clock: &ManualClock) -> Result<(), StoreError> {
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
