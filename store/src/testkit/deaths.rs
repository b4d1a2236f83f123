//! Deaths of workers, of the daemon and of the machine, and what an operator wants.

use crate::id::{Attempt, JobId};
use crate::job::{Area, BACKOFF_CAP_MS, Death, Duty, Ending, Kind, State, Step, Testimony};
use crate::store::{Control, Filter, Lease, StoreError};

use super::tools::{ManualClock, Subject, claim_any, finish, job, named, no_one_is_innocent, result_of, submit_one};

pub(super) fn a_crash_is_retried_once(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
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

pub(super) fn the_operators_wishes(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
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

pub(super) fn death_of_the_daemon(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
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

pub(super) fn suspects_run_alone(subject: &mut dyn Subject, clock: &ManualClock) -> Result<(), StoreError> {
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

/// A file that kills the daemon in company, and the next two times alone: three attempts. Who ran beside it runs beside others again, but for one
/// whose answer was read in the same instant: that one has its next run alone, and is cleared by it.
pub(super) fn who_ran_beside_a_killer_is_innocent(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let names = ["killer.stl", "read.stl", "beside.stl"];
    for name in names {
        submit_one(subject.store(), name, 84)?;
        claim_any(subject.store())?;
    }
    let [killer, read, beside] = [JobId(1), JobId(2), JobId(3)];
    subject.restart();
    subject.store().recover(&|job| if job.id == beside { Testimony::None } else { Testimony::InHand })?;
    let store = subject.store();
    let kinds = [killer, read, beside].map(|id| job(store, id).map(|job| job.kind()).ok());
    assert_eq!(kinds, [Some(Kind::Alone), Some(Kind::Alone), Some(Kind::Queued)]);
    let suspects = Filter { alone: true, ..Filter::default() };
    for death in 2..=3 {
        let claim = subject.store().claim(&suspects)?.ok_or(StoreError::Unknown(killer))?;
        assert_eq!((claim.id, claim.job.attempts), (killer, Attempt(death)));
        subject.restart();
        subject.store().recover(&|_| Testimony::InHand)?;
    }
    let store = subject.store();
    assert_eq!(job(store, killer)?.kind(), Kind::Concluded);
    let claim = store.claim(&suspects)?.ok_or(StoreError::Unknown(read))?;
    assert_eq!((claim.id, finish(store, &claim, Ending::Clean, true)?.kind()), (read, Kind::Done));
    assert_eq!(claim_any(store)?.id, beside);
    Ok(())
}

/// Whatever a witness says, another life of the machine is not the file's doing.
pub(super) fn power_cuts_blame_no_one(subject: &mut dyn Subject, clock: &ManualClock) -> Result<(), StoreError> {
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
