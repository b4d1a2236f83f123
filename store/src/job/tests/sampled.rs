//! What one attempt leaves for the next to compare with.

use super::*;
use crate::id::Recipe;

pub(super) fn witness(hash: u8) -> Witness {
    Witness::new("a:/state", "1.0.0", Recipe(7), Hash([hash; 32]))
}

/// A witness comes from the first attempt that made a result, stays as it is, and goes when the job is at rest or an operator begins anew.
pub(super) fn check_witness(before: &Job, event: &Event, after: &Job) -> Result<(), TestCaseError> {
    prop_assert!(after.witness.is_none() || after.duty() != Duty::Rest, "it is over");
    match (&before.witness, &after.witness) {
        (None, Some(_)) => {
            let by = matches!(event, Event::Step { step: Step::Sampled(_), .. });
            prop_assert!(by && before.kind() == Kind::Running && matches!(after.kind(), Kind::Queued | Kind::Alone));
            prop_assert_eq!((after.attempts, after.blame), (before.attempts, before.blame));
        }
        (Some(earlier), Some(later)) => prop_assert_eq!(earlier, later),
        (Some(_), None) => prop_assert!(after.duty() == Duty::Rest || matches!(event, Event::Retry)),
        (None, None) => {}
    }
    Ok(())
}

fn sample(token: Token) -> Event {
    Event::Step { token, step: Step::Sampled(Box::new(witness(1))) }
}

#[test]
fn a_sampled_job_waits_for_whoever_comes_and_is_blamed_for_nothing() {
    let job = run(&fresh(), sample);
    assert_eq!((job.kind(), job.blame), (Kind::Queued, Blame::default()));
    let kept = job.witness.clone().unwrap();
    assert_eq!(*kept, Witness { at: job.changed, ..witness(1) }, "with the time of the store");
    assert!(kept.is_by("a:/state") && !kept.is_by("a:/stat"));
    let again = run(&job, |token| Event::Step { token, step: Step::HandOn });
    assert_eq!((again.kind(), again.pause()), (Kind::Waiting, Some(again.changed.plus_ms(HAND_ON_MS))));
    assert_eq!((again.witness, again.blame), (job.witness, Blame::default()));
}

/// Only who works on it may say so, once; and nobody hands on what was not sampled.
#[test]
fn only_what_runs_is_sampled_and_only_once() {
    let now = Time(1);
    let claimed = |job: &Job| {
        let now = job.changed.plus_ms(BACKOFF_CAP_MS);
        job.after(&Event::Claim { epoch: Epoch(1), token: Token(9), boot: Boot(1) }, now).unwrap()
    };
    assert_eq!(fresh().after(&sample(Token(9)), now), Err(Illegal::Fenced));
    let running = claimed(&fresh());
    assert_eq!(running.after(&sample(Token(8)), now), Err(Illegal::Fenced));
    let hand_on = Event::Step { token: Token(9), step: Step::HandOn };
    assert!(matches!(running.after(&hand_on, now), Err(Illegal::State { event: "handed on", .. })));
    let sampled = running.after(&sample(Token(9)), now).unwrap();
    assert!(matches!(claimed(&sampled).after(&sample(Token(9)), now), Err(Illegal::State { event: "sampled", .. })));
    let intend = Event::Step { token: Token(9), step: Step::Intend(publication(Ending::Clean, 1)) };
    for event in [&sample(Token(9)), &hand_on] {
        assert!(running.after(&intend, now).unwrap().after(event, now).is_err(), "it is being published");
    }
    let cancelled = running.after(&Event::Cancel, now).unwrap().after(&sample(Token(9)), now).unwrap();
    assert_eq!((cancelled.kind(), cancelled.witness), (Kind::Cancelled, None));
}

/// Whatever the second attempt comes to, the third one has something to compare with.
#[test]
fn a_witness_outlives_the_second_attempt_and_not_the_job() {
    let sampled = run(&fresh(), sample);
    type Fate = fn(Token) -> Event;
    let fates: [Fate; 5] = [
        |token| Event::Step { token, step: Step::Wait { reason: "no room".into() } },
        |token| Event::Step { token, step: Step::HandBack },
        |token| Event::Step { token, step: Step::NeedsAll },
        |token| Event::Step { token, step: Step::Died(Death::Signal(11)) },
        |_| Event::Interrupted { alone: false, testimony: Testimony::None },
    ];
    for fate in fates {
        assert_eq!(run(&sampled, fate).witness, sampled.witness);
    }
    let intend = |token| Event::Step { token, step: Step::Intend(publication(Ending::Clean, 1)) };
    let publishing = run(&sampled, intend);
    let token = publishing.hold().unwrap().token;
    let step = |job: &Job, step| job.after(&Event::Step { token, step }, job.changed).unwrap();
    assert_eq!(step(&publishing, Step::Lost).witness, sampled.witness, "its result was lost, and is made again");
    let done = step(&step(&publishing, Step::Placed), Step::Finished);
    assert_eq!((done.kind(), done.witness), (Kind::Done, None));
    assert_eq!(sampled.after(&Event::Cancel, Time(1)).unwrap().witness, None);
    assert_eq!(sampled.after(&Event::Retry, Time(1)).unwrap().witness, None, "begun anew");
}

/// Who ends a job without a result says that there was one.
#[test]
fn a_file_that_is_condemned_after_a_result_says_so() {
    let mut job = run(&fresh(), sample);
    for _ in 0..2 {
        job = run(&job, dies(Death::Signal(11)));
    }
    let State::Concluded { ending: Ending::Quarantined, reason, .. } = &job.state else { panic!("{:?}", job.state) };
    assert!(
        reason.contains("signal 11")
            && reason.contains("an earlier attempt, by a:/state with version 1.0.0, made a result (BLAKE3 0101")
    );
}
