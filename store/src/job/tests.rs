//! The machine under every sequence of events, and the rules of blame by example.

use proptest::prelude::*;

use super::*;
use crate::id::{Attempt, Boot, Epoch, Hash, JobId, Time, Token};
use crate::path::RelPath;

mod decisions;
mod sampled;

use decisions::{approved, check_decision, said};
use sampled::{check_witness, witness};

fn fresh() -> Job {
    let source = Source {
        folder: "hot".into(),
        path: RelPath::new(*b"part.stl").unwrap(),
        dev: 1,
        ino: 2,
        size: 84,
        mtime_ns: 3,
        profile: "default".into(),
    };
    Job::queued(JobId(1), source, Time(0))
}

fn publication(ending: Ending, hash: u8) -> Publication {
    let path = RelPath::new(*b"part.stl").unwrap();
    Publication {
        ending,
        reason: String::new(),
        output: Some(path.clone()),
        output_hash: Some(Hash([hash; 32])),
        report_hash: None,
        recipe: None,
        reused: None,
        source_ctime_ns: None,
        original: Some(path),
        stays: false,
        decision: None,
    }
}

fn deaths() -> impl Strategy<Value = Death> {
    prop_oneof![
        Just(Death::Signal(11)),
        Just(Death::Exit(101)),
        Just(Death::TimeLimit),
        Just(Death::MemoryLimit),
        Just(Death::Killed(9)),
    ]
}

fn endings() -> impl Strategy<Value = Ending> {
    prop_oneof![
        Just(Ending::Clean),
        Just(Ending::Repaired),
        Just(Ending::Carried),
        Just(Ending::NeedsReview),
        Just(Ending::NotGood),
        Just(Ending::Unreadable),
        Just(Ending::Refused),
        Just(Ending::Environment),
        Just(Ending::Quarantined),
    ]
}

fn steps() -> impl Strategy<Value = Step> {
    let path = RelPath::new(*b"part~2.stl").unwrap();
    prop_oneof![
        4 => deaths().prop_map(Step::Died),
        2 => Just(Step::Environment { reason: "no space left".into() }),
        1 => Just(Step::HandBack),
        2 => (0_u8..3).prop_map(|hash| Step::Sampled(Box::new(witness(hash)))),
        1 => Just(Step::HandOn),
        1 => Just(Step::NeedsAll),
        1 => Just(Step::Wait { reason: "no room".into() }),
        3 => any::<bool>().prop_map(|committed| Step::Park { reason: "permission denied".into(), committed }),
        1 => Just(Step::Cancelled),
        1 => Just(Step::Withdrawn(Withdrawal::Changed)),
        1 => Just(Step::Withdrawn(Withdrawal::Vanished)),
        4 => (endings(), 0_u8..3).prop_map(|(ending, hash)| Step::Intend(publication(ending, hash))),
        1 => (0_u8..3).prop_map(|hash| Step::Intend(approved(hash, Time(0)))),
        1 => Just(Step::Unfit { reason: "someone has changed it since".into() }),
        4 => Just(Step::Placed),
        1 => Just(Step::Redirect { original: path }),
        4 => Just(Step::Finished),
        1 => Just(Step::Lost),
    ]
}

fn testimonies() -> impl Strategy<Value = Testimony> {
    prop_oneof![Just(Testimony::None), Just(Testimony::Outlived), Just(Testimony::InHand), Just(Testimony::Machine)]
}

/// Tokens and epochs come from `0..9`, so that claims of others are common; those of real claims are made unique below.
fn events() -> impl Strategy<Value = Event> {
    prop_oneof![
        6 => Just(Event::Claim { epoch: Epoch(1), token: Token(0), boot: Boot(1) }),
        12 => (prop::bool::weighted(0.9), steps()).prop_map(|(own, step)| Event::Step { token: Token(u64::from(own)), step }),
        4 => (any::<bool>(), testimonies()).prop_map(|(alone, testimony)| Event::Interrupted { alone, testimony }),
        2 => Just(Event::Reclaim { epoch: Epoch(2), token: Token(0) }),
        1 => Just(Event::Retry),
        1 => Just(Event::Cancel),
        1 => Just(Event::Forget),
        1 => Just(Event::Want(Priority::HIGHEST)),
        1 => Just(Event::Hasten),
        2 => prop_oneof![Just(Verdict::Approved), Just(Verdict::Rejected)].prop_map(|verdict| Event::Decide(said(verdict))),
        1 => (0..=9_i64).prop_map(|n| Event::Rank(Priority::try_from(n).unwrap())),
    ]
}

/// Events with the tokens they would really come with: new ones for claims, for steps the current (`Token(1)`) or a void one.
fn real(event: &Event, job: &Job, next: u64) -> Event {
    match event {
        Event::Claim { epoch, boot, .. } => Event::Claim { epoch: *epoch, token: Token(next), boot: *boot },
        Event::Reclaim { epoch, .. } => Event::Reclaim { epoch: *epoch, token: Token(next) },
        Event::Step { token: Token(1), step } => {
            let mut step = step.clone();
            // What is approved has the time at which it was.
            if let (Step::Intend(Publication { decision: Some(said), .. }), State::Approved { publication, .. }) =
                (&mut step, &job.state)
            {
                said.at = publication.decision.as_ref().map_or(Time(0), |decision| decision.at);
            }
            Event::Step { token: job.hold().map_or(Token(0), |hold| hold.token), step }
        }
        other => other.clone(),
    }
}

fn check_transition(before: &Job, event: &Event, after: &Job) -> Result<(), TestCaseError> {
    let claimed = matches!(event, Event::Claim { .. });
    let again = before.kind() == Kind::Parked;
    let started = u32::from(claimed && !again);
    prop_assert_eq!(after.attempts.0, before.attempts.0 + started, "attempts are counted by claims alone, and stay");
    prop_assert_eq!(claimed && !again, before.kind().is_queued() && after.kind() == Kind::Running);
    check_parking(before, event, after)?;

    // At rest means at rest: only an operator wakes a job, and never one with a good result.
    if before.duty() == Duty::Rest {
        prop_assert!(matches!(event, Event::Retry | Event::Cancel | Event::Forget | Event::Want(_) | Event::Decide(_)));
        prop_assert!(!matches!(before.kind(), Kind::Done | Kind::Carried));
    }
    // What is intended is what is placed and what the job ends with.
    if let (State::Publishing { publication: intent, .. }, State::Published { publication, .. }) = (&before.state, &after.state) {
        prop_assert_eq!(intent, publication);
    }
    check_decision(before, event, after)?;
    check_witness(before, event, after)?;
    if let (State::Ended { publication }, State::Running { .. } | State::Queued { .. } | State::Published { .. }) =
        (&after.state, &before.state)
    {
        let State::Published { publication: placed, .. } = &before.state else {
            return Err(TestCaseError::fail("it ended without having been published"));
        };
        // An operator may leave an original that cannot be moved where it is.
        let original = if matches!(event, Event::Cancel) { None } else { placed.original.clone() };
        prop_assert_eq!(&Publication { original, ..placed.clone() }, publication);
    }
    // Blame.
    let grew = (
        after.blame.charges > before.blame.charges,
        after.blame.deaths > before.blame.deaths,
        after.blame.deaths_alone > before.blame.deaths_alone,
    );
    let charged = matches!(event, Event::Step { step: Step::Died(death), .. } if !matches!(death, Death::Killed(_)));
    let died = matches!(event, Event::Interrupted { testimony: Testimony::None | Testimony::InHand, .. });
    prop_assert!(!grew.0 || charged, "charged by {:?}", event);
    prop_assert!(!grew.1 || died, "suspected by {:?}", event);
    let found = matches!(event, Event::Interrupted { alone: true, testimony: Testimony::InHand });
    prop_assert!(!grew.2 || found, "found alone by {:?}", event);
    if !matches!(event, Event::Retry) {
        prop_assert!(after.blame.charges >= before.blame.charges && after.blame.deaths >= before.blame.deaths);
    }
    check_bounds(after)
}

/// A parked job is no one's, keeps its state and its work, and goes on from there.
fn check_parking(before: &Job, event: &Event, after: &Job) -> Result<(), TestCaseError> {
    let state = |job: &Job| std::mem::discriminant(&job.state);
    if after.kind() == Kind::Parked {
        prop_assert!(after.hold().is_none() && after.duty() == Duty::Queue && after.pause().is_some());
        prop_assert!(before.work == after.work);
        let approved = matches!(after.state, State::Approved { .. });
        prop_assert!(state(before) == state(after) || approved);
        let by = matches!(event, Event::Retry | Event::Decide(_) | Event::Step { step: Step::Park { .. }, .. });
        prop_assert!(by, "parked by {:?}", event);
    }
    if before.kind() == Kind::Parked {
        match event {
            Event::Claim { .. } => prop_assert!(state(before) == state(after) && after.hold().is_some()),
            Event::Retry => {}
            Event::Cancel => prop_assert_eq!(after.duty(), Duty::Rest),
            _ => return Err(TestCaseError::fail("a parked job is no one's")),
        }
    }
    Ok(())
}

fn check_bounds(job: &Job) -> Result<(), TestCaseError> {
    let Blame { charges, deaths_alone, in_hand, deaths, .. } = job.blame;
    prop_assert!(
        charges <= 2
            && deaths_alone <= 3
            && charges + deaths_alone <= 3
            && deaths_alone <= in_hand.into()
            && u32::from(in_hand) <= deaths
    );
    let in_hand = u32::from(in_hand);
    let is_proved = charges + deaths_alone >= 2 && charges + in_hand >= 3;
    if matches!(job.kind(), Kind::Queued | Kind::Waiting | Kind::Alone) {
        prop_assert!(charges <= 1 && !is_proved, "it would be tried too often");
    }
    if let State::Concluded { ending: Ending::Quarantined, .. } = job.state {
        prop_assert!(charges == 2 || is_proved, "quarantined without reason");
    }
    if let State::Running { hold, .. } = &job.state {
        prop_assert_eq!(hold.alone, deaths >= 2 || in_hand > 0 || job.blame.machine > 0 || job.needs_all);
        prop_assert_eq!(hold.attempt, job.attempts);
    }
    Ok(())
}

proptest! {
    #[test]
    fn no_sequence_of_events_breaks_a_promise(events in prop::collection::vec(events(), 1..60)) {
        let mut job = fresh();
        let mut now = Time(0);
        for (at, event) in events.iter().enumerate() {
            now = now.plus_ms(BACKOFF_CAP_MS);
            let event = real(event, &job, 10 + at as u64);
            let held = job.hold().map(|hold| hold.token);
            let after = match job.after(&event, now) {
                Ok(after) => after,
                Err(illegal) => {
                    let void = matches!(&event, Event::Step { token, .. } if Some(*token) != held);
                    prop_assert_eq!(void, illegal == Illegal::Fenced);
                    continue;
                }
            };
            check_transition(&job, &event, &after)?;
            let text = serde_json::to_string(&after).unwrap();
            prop_assert_eq!(&serde_json::from_str::<Job>(&text).unwrap(), &after);
            job = after;
        }
    }

    /// Whatever happens to it, a job whose duty is done each time comes to rest.
    #[test]
    fn doing_ones_duty_ends_every_job(events in prop::collection::vec(events(), 0..40)) {
        let mut job = fresh();
        let mut now = Time(0);
        for (at, event) in events.iter().enumerate() {
            now = now.plus_ms(BACKOFF_CAP_MS);
            job = job.after(&real(event, &job, 10 + at as u64), now).unwrap_or(job);
        }
        for at in 0..6 {
            now = now.plus_ms(BACKOFF_CAP_MS);
            let step = match (job.duty(), &job.state) {
                (Duty::Rest, _) => break,
                (Duty::Queue, _) => {
                    job = job.after(&Event::Claim { epoch: Epoch(9), token: Token(100 + at), boot: Boot(1) }, now).unwrap();
                    continue;
                }
                (Duty::Run, _) => Step::Intend(publication(Ending::Clean, 1)),
                (Duty::Intend, State::Concluded { ending, .. }) => Step::Intend(publication(*ending, 1)),
                (Duty::Intend, State::Approved { publication, .. }) => {
                    Step::Intend(Publication { ending: Ending::Repaired, ..publication.clone() })
                }
                (Duty::Stop, _) => Step::Cancelled,
                (Duty::Place, _) => Step::Placed,
                (Duty::MoveOriginal, _) => Step::Finished,
                (Duty::Intend, _) => return Err(TestCaseError::fail("a duty that does not fit the state")),
            };
            let token = job.hold().unwrap().token;
            job = job.after(&Event::Step { token, step }, now).unwrap();
        }
        prop_assert_eq!(job.duty(), Duty::Rest);
    }
}

/// Claims `job`, and lets `event` happen to it.
fn run(job: &Job, event: impl Fn(Token) -> Event) -> Job {
    let token = Token(u64::from(job.attempts.0) + 1);
    let now = job.changed.plus_ms(BACKOFF_CAP_MS);
    job.after(&Event::Claim { epoch: Epoch(1), token, boot: Boot(1) }, now).unwrap().after(&event(token), now).unwrap()
}

fn dies(death: Death) -> impl Fn(Token) -> Event {
    move |token| Event::Step { token, step: Step::Died(death) }
}

fn daemon_dies(alone: bool, testimony: Testimony) -> impl Fn(Token) -> Event {
    move |_| Event::Interrupted { alone, testimony }
}

#[test]
fn f12_one_crash_and_two_deaths_of_the_daemon_in_its_hands_are_three() {
    let mut job = run(&fresh(), dies(Death::Signal(6)));
    job = run(&job, daemon_dies(true, Testimony::InHand));
    assert_eq!(job.kind(), Kind::Alone);
    job = run(&job, daemon_dies(true, Testimony::InHand));
    assert_eq!((job.kind(), job.attempts), (Kind::Concluded, Attempt(3)));
}

/// Wherever it begins: in company once, or alone from the start.
#[test]
fn f12_a_file_that_kills_the_daemon_has_three_attempts() {
    for alone in [false, true] {
        let mut job = run(&fresh(), daemon_dies(alone, Testimony::InHand));
        for _ in 0..2 {
            assert_eq!(job.kind(), Kind::Alone);
            job = run(&job, daemon_dies(true, Testimony::InHand));
        }
        assert_eq!((job.kind(), job.attempts), (Kind::Concluded, Attempt(3)), "alone at first: {alone}");
    }
}

#[test]
fn company_is_no_proof() {
    let mut job = fresh();
    for _ in 0..10 {
        job = run(&job, daemon_dies(false, Testimony::InHand));
    }
    assert_eq!((job.kind(), job.blame.deaths_alone), (Kind::Alone, 0));
}

/// D8: daemon and worker killed at once, again and again, leave nothing that speaks against the file.
#[test]
fn deaths_without_a_trace_never_condemn() {
    let mut job = fresh();
    for _ in 0..100 {
        job = run(&job, daemon_dies(true, Testimony::None));
    }
    assert_eq!((job.kind(), job.blame.deaths_alone), (Kind::Alone, 0));
}

/// D8: a power cut is never the file's fault; it runs alone afterwards.
#[test]
fn deaths_of_the_machine_never_condemn() {
    let mut job = fresh();
    for _ in 0..100 {
        job = run(&job, daemon_dies(true, Testimony::Machine));
        assert_eq!((job.kind(), job.blame.deaths, job.blame.deaths_alone), (Kind::Alone, 0, 0));
    }
}

#[test]
fn a_witness_clears_even_a_file_that_was_alone() {
    let mut job = fresh();
    for _ in 0..10 {
        job = run(&job, daemon_dies(true, Testimony::Outlived));
    }
    assert_eq!((job.kind(), job.blame), (Kind::Queued, Blame::default()));
}

/// D3: a result that cannot be brought into place waits by itself, ever longer, and goes on where it was.
#[test]
fn a_parked_job_is_tried_again_and_again() {
    let park = |token| Event::Step { token, step: Step::Park { reason: "read-only\nfile system".into(), committed: false } };
    let intend = |token| Event::Step { token, step: Step::Intend(publication(Ending::Clean, 1)) };
    let mut job = run(&fresh(), intend);
    job = job.after(&park(job.hold().unwrap().token), job.changed).unwrap();
    for tries in 2..20 {
        assert_eq!((job.kind(), job.note.as_str()), (Kind::Parked, "read-only file system"));
        let pause = job.pause().unwrap().0 - job.changed.0;
        assert_eq!(pause, (PARK_MS << (tries - 2)).min(PARK_CAP_MS));
        assert!(!job.is_due(Time(job.pause().unwrap().0 - 1)));
        job = run(&job, park);
        assert_eq!((job.parked.unwrap().tries, job.attempts), (tries, Attempt(1)));
    }
    let job = run(&job, |token| Event::Step { token, step: Step::Placed });
    assert_eq!((job.kind(), job.parked), (Kind::Published, None));
}

/// An operator can give a parked job up, unless a part of its result is in place already.
#[test]
fn a_parked_job_can_be_cancelled() {
    let parked = |committed| {
        let job = run(&fresh(), |token| Event::Step { token, step: Step::Intend(publication(Ending::Clean, 1)) });
        let step = Step::Park { reason: "no".into(), committed };
        job.after(&Event::Step { token: job.hold().unwrap().token, step }, job.changed).unwrap()
    };
    let cancelled = parked(false).after(&Event::Cancel, Time(0)).unwrap();
    assert!(cancelled.kind() == Kind::Cancelled && cancelled.answers_for_source());
    assert_eq!(parked(true).after(&Event::Cancel, Time(0)), Err(Illegal::Committed));
    let published = run(&parked(true), |token| Event::Step { token, step: Step::Placed });
    let token = published.hold().unwrap().token;
    let stuck = Event::Step { token, step: Step::Park { reason: "not ours".into(), committed: true } };
    let ended = published.after(&stuck, Time(0)).unwrap().after(&Event::Cancel, Time(0)).unwrap();
    assert!(ended.kind() == Kind::Done && ended.answers_for_source(), "the original stays, and is not taken again");
}

/// A job that waits can be hastened; what is held against it stays, and a job that does not wait is left alone.
#[test]
fn the_pause_of_a_waiting_job_can_be_ended() {
    let waits = run(&fresh(), |token| Event::Step { token, step: Step::Environment { reason: "no disk".into() } });
    assert_eq!(waits.kind(), Kind::Waiting);
    let hastened = waits.after(&Event::Hasten, Time(0)).unwrap();
    assert_eq!((hastened.kind(), hastened.blame), (Kind::Queued, waits.blame));
    assert!(hastened.is_due(Time(0)) && hastened.after(&Event::Hasten, Time(0)).is_err());
}

/// A file that its share of the memory was too small for runs once more, alone, and is blamed for nothing.
#[test]
fn f10_a_file_that_needs_all_memory_runs_alone() {
    let job = run(&fresh(), |token| Event::Step { token, step: Step::NeedsAll });
    assert_eq!((job.kind(), job.blame), (Kind::Alone, Blame::default()));
    let alone = job.after(&Event::Claim { epoch: Epoch(1), token: Token(9), boot: Boot(1) }, job.changed).unwrap();
    let again = alone.after(&Event::Step { token: Token(9), step: Step::NeedsAll }, job.changed);
    assert!(alone.hold().unwrap().alone && again.unwrap().kind() != Kind::Alone, "there is not more than all");
}

#[test]
fn f03_kills_from_outside_slow_a_job_down_but_never_end_it() {
    let mut job = fresh();
    for kill in 1..=100 {
        job = run(&job, dies(Death::Killed(15)));
        assert_eq!(job.kind(), if kill <= KILLS_FREE { Kind::Queued } else { Kind::Waiting }, "kill {kill}");
    }
    assert_eq!(job.blame.charges, 0);
    let State::Queued { not_before: Some(then) } = job.state else { panic!("it waits") };
    assert_eq!(then, job.changed.plus_ms(BACKOFF_CAP_MS));
}

#[test]
fn reasons_are_one_line_and_short() {
    assert_eq!(one_line("a\nb\t\"c\\"), "a b 'c/");
    let long = "é".repeat(MAX_REASON);
    let cut = one_line(&long);
    assert!(cut.ends_with("é…") && cut.len() == MAX_REASON - 1, "never half a character: {cut}");
    assert_eq!(one_line(&format!("x{long}")).len(), MAX_REASON);
    assert_eq!(one_line(&cut), cut, "it is cut once");
}

#[test]
fn only_the_rules_condemn() {
    for ending in [Ending::Quarantined, Ending::Environment] {
        let now = Time(1);
        let running = fresh().after(&Event::Claim { epoch: Epoch(1), token: Token(1), boot: Boot(1) }, now).unwrap();
        let event = Event::Step { token: Token(1), step: Step::Intend(publication(ending, 1)) };
        assert!(matches!(running.after(&event, now), Err(Illegal::State { kind: Kind::Running, .. })));
    }
}
