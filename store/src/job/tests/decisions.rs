//! What a person decides.

use super::*;

pub(super) fn said(verdict: Verdict) -> Decision {
    Decision::new(verdict, "Ada", "looks right").unwrap()
}

/// What is intended of a best attempt that was approved then.
pub(super) fn approved(hash: u8, at: Time) -> Publication {
    let decision = Decision { at, ..said(Verdict::Approved) };
    Publication { decision: Some(Box::new(decision)), ..publication(Ending::Repaired, hash) }
}

/// Only what a person approved is published though it was not found good, and exactly that; what is decided is remembered.
pub(super) fn check_decision(before: &Job, event: &Event, after: &Job) -> Result<(), TestCaseError> {
    match (&before.state, &after.state) {
        (State::Approved { publication: judged, .. }, State::Publishing { publication, .. }) => {
            prop_assert_eq!((judged.output_hash, &judged.decision), (publication.output_hash, &publication.decision));
        }
        (State::Ended { publication: judged }, State::Approved { publication, .. }) => {
            let is_open = matches!(before.kind(), Kind::NeedsReview | Kind::Rejected);
            prop_assert!(is_open && matches!(event, Event::Decide(said) if said.verdict == Verdict::Approved));
            let decision = publication.decision.clone();
            prop_assert_eq!(publication, &Publication { decision, ..judged.clone() });
        }
        (State::Ended { publication: judged }, State::Ended { publication }) => {
            prop_assert!(after.kind() == Kind::Rejected && before.kind() == Kind::NeedsReview);
            prop_assert_eq!(judged, &Publication { decision: None, ..publication.clone() });
        }
        (State::Approved { publication: judged, .. }, State::Ended { publication }) => {
            prop_assert!(after.kind() == Kind::NeedsReview && publication.reason.starts_with("someone"));
            let reason = publication.reason.clone();
            prop_assert_eq!(publication, &Publication { decision: None, reason, ..judged.clone() });
        }
        (State::Approved { .. }, State::Approved { .. }) | (_, State::Ended { .. }) => {}
        (_, State::Approved { .. }) | (State::Approved { .. }, _) => {
            return Err(TestCaseError::fail("what is approved is published, or found unfit"));
        }
        _ => {}
    }
    Ok(())
}

/// A job that ended so.
fn ended(ending: Ending) -> Job {
    let event = |step| Event::Step { token: Token(1), step };
    let claim = Event::Claim { epoch: Epoch(1), token: Token(1), boot: Boot(1) };
    let intended = Step::Intend(publication(ending, 1));
    let events = [claim, event(intended), event(Step::Placed), event(Step::Finished)];
    events.iter().fold(fresh(), |job, event| job.after(event, Time(1)).unwrap())
}

#[test]
fn what_needs_review_is_approved_once_and_published_as_it_was_judged() {
    let say = |job: &Job, verdict| job.after(&Event::Decide(said(verdict)), Time(5));
    let job = say(&ended(Ending::NeedsReview), Verdict::Approved).unwrap();
    assert_eq!((job.kind(), job.duty(), job.original().0), (Kind::Parked, Duty::Queue, Area::Failed));
    assert!(say(&job, Verdict::Approved).is_err() && say(&job, Verdict::Rejected).is_err(), "it is on its way");
    assert_eq!(job.after(&Event::Cancel, Time(6)), Err(Illegal::Approved));
    let claimed = job.after(&Event::Claim { epoch: Epoch(2), token: Token(2), boot: Boot(1) }, Time(6)).unwrap();
    assert_eq!((claimed.kind(), claimed.duty(), claimed.attempts), (Kind::Concluded, Duty::Intend, Attempt(1)));
    let step = |job: &Job, step| job.after(&Event::Step { token: Token(2), step }, Time(7));
    assert!(step(&claimed, Step::Intend(approved(2, Time(5)))).is_err(), "other bytes");
    assert!(step(&claimed, Step::Intend(publication(Ending::Repaired, 1))).is_err(), "without a word of who said so");
    let publishing = step(&claimed, Step::Intend(approved(1, Time(5)))).unwrap();
    assert_eq!(publishing.after(&Event::Cancel, Time(7)), Err(Illegal::Approved));
    let done = step(&step(&publishing, Step::Placed).unwrap(), Step::Finished).unwrap();
    assert_eq!((done.kind(), done.original().0, done.offers()), (Kind::Done, Area::Done, None));
    let decision = done.publication().unwrap().decision.clone().unwrap();
    assert_eq!((decision.verdict, decision.by.as_str(), decision.at), (Verdict::Approved, "Ada", Time(5)));
    assert!(say(&done, Verdict::Approved).is_err() && say(&done, Verdict::Rejected).is_err());
    let unfit = step(&claimed, Step::Unfit { reason: "it was edited".into() }).unwrap();
    assert_eq!((unfit.kind(), unfit.original().0), (Kind::NeedsReview, Area::Failed));
    assert!(unfit.publication().unwrap().reason.starts_with("it was edited"));
}

#[test]
fn what_is_rejected_stays_and_can_be_tried_again_or_approved_after_all() {
    let say = |job: &Job, verdict| job.after(&Event::Decide(said(verdict)), Time(5));
    let job = say(&ended(Ending::NeedsReview), Verdict::Rejected).unwrap();
    assert_eq!((job.kind(), job.original().0, job.duty()), (Kind::Rejected, Area::Failed, Duty::Rest));
    assert!(say(&job, Verdict::Rejected).is_err());
    assert_eq!(say(&job, Verdict::Approved).unwrap().kind(), Kind::Parked);
    let again = job.after(&Event::Retry, Time(6)).unwrap();
    assert_eq!((again.kind(), again.publication()), (Kind::Queued, None));
    for ending in [Ending::Clean, Ending::Repaired, Ending::NotGood, Ending::Refused] {
        assert!(say(&ended(ending), Verdict::Approved).is_err() && say(&ended(ending), Verdict::Rejected).is_err(), "{ending:?}");
    }
    let bare = Publication { output: None, output_hash: None, ..publication(Ending::NeedsReview, 1) };
    let bare = Job { state: State::Ended { publication: bare }, ..ended(Ending::NeedsReview) };
    assert_eq!(say(&bare, Verdict::Approved), Err(Illegal::NoAttempt));
    for (by, note) in [("", ""), (" ", ""), (&*"b".repeat(MAX_BY + 1), ""), ("Ada", &*"n".repeat(MAX_REASON + 1))] {
        assert!(Decision::new(Verdict::Approved, by, note).is_err());
    }
}
