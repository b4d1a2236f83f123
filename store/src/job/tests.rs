//! The machine under every sequence of events, and the rules of blame by example.

use proptest::prelude::*;

use super::*;

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
        original: Some(path),
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
        1 => Just(Step::Cancelled),
        1 => Just(Step::Withdrawn(Withdrawal::Changed)),
        1 => Just(Step::Withdrawn(Withdrawal::Vanished)),
        4 => (endings(), 0_u8..3).prop_map(|(ending, hash)| Step::Intend(publication(ending, hash))),
        4 => Just(Step::Placed),
        1 => Just(Step::Redirect { original: path }),
        4 => Just(Step::Finished),
        1 => Just(Step::Lost),
    ]
}

/// Tokens and epochs come from `0..9`, so that claims of others are common; those of real claims are made unique below.
fn events() -> impl Strategy<Value = Event> {
    prop_oneof![
        6 => Just(Event::Claim { epoch: Epoch(1), token: Token(0) }),
        12 => (prop::bool::weighted(0.9), steps()).prop_map(|(own, step)| Event::Step { token: Token(u64::from(own)), step }),
        4 => any::<(bool, bool)>().prop_map(|(alone, innocent)| Event::Interrupted { alone, innocent }),
        2 => Just(Event::Reclaim { epoch: Epoch(2), token: Token(0) }),
        1 => Just(Event::Retry),
        1 => Just(Event::Cancel),
        1 => Just(Event::Forget),
    ]
}

/// Events with the tokens they would really come with: new ones for claims, for steps the current (`Token(1)`) or a void one.
fn real(event: &Event, job: &Job, next: u64) -> Event {
    match event {
        Event::Claim { epoch, .. } => Event::Claim { epoch: *epoch, token: Token(next) },
        Event::Reclaim { epoch, .. } => Event::Reclaim { epoch: *epoch, token: Token(next) },
        Event::Step { token: Token(1), step } => {
            Event::Step { token: job.hold().map_or(Token(0), |hold| hold.token), step: step.clone() }
        }
        other => other.clone(),
    }
}

fn check_transition(before: &Job, event: &Event, after: &Job) -> Result<(), TestCaseError> {
    let claimed = matches!(event, Event::Claim { .. });
    prop_assert_eq!(after.attempts.0, before.attempts.0 + u32::from(claimed), "attempts are counted by claims alone, and stay");
    prop_assert_eq!(claimed, before.kind().is_queued() && after.kind() == Kind::Running);

    // At rest means at rest: only an operator wakes a job, and never one with a good result.
    if before.duty() == Duty::Rest {
        prop_assert!(matches!(event, Event::Retry | Event::Cancel | Event::Forget));
        prop_assert!(before.kind() != Kind::Done);
    }
    // What is intended is what is placed and what the job ends with.
    if let (State::Publishing { publication: intent, .. }, State::Published { publication, .. }) = (&before.state, &after.state) {
        prop_assert_eq!(intent, publication);
    }
    if let State::Ended { publication } = &after.state {
        let State::Published { publication: placed, .. } = &before.state else {
            return Err(TestCaseError::fail("it ended without having been published"));
        };
        prop_assert_eq!(placed, publication);
    }
    // Blame.
    let grew = (
        after.blame.charges > before.blame.charges,
        after.blame.deaths > before.blame.deaths,
        after.blame.deaths_alone > before.blame.deaths_alone,
    );
    let charged = matches!(event, Event::Step { step: Step::Died(death), .. } if !matches!(death, Death::Killed(_)));
    let died = matches!(event, Event::Interrupted { innocent: false, .. });
    prop_assert!(!grew.0 || charged, "charged by {:?}", event);
    prop_assert!(!grew.1 || died, "suspected by {:?}", event);
    let died_alone = matches!(event, Event::Interrupted { alone: true, innocent: false });
    prop_assert!(!grew.2 || died_alone, "found alone by {:?}", event);
    if !matches!(event, Event::Retry) {
        prop_assert!(after.blame.charges >= before.blame.charges && after.blame.deaths >= before.blame.deaths);
    }
    check_bounds(after)
}

fn check_bounds(job: &Job) -> Result<(), TestCaseError> {
    let Blame { charges, deaths_alone, deaths, .. } = job.blame;
    prop_assert!(charges <= 2 && deaths_alone <= 3 && charges + deaths_alone <= 3 && deaths_alone <= deaths);
    if matches!(job.kind(), Kind::Queued | Kind::Waiting | Kind::Suspect) {
        prop_assert!(charges <= 1 && charges + deaths_alone <= 2, "it would be tried too often");
    }
    if let State::Concluded { ending: Ending::Quarantined, .. } = job.state {
        prop_assert!(charges == 2 || charges + deaths_alone == 3, "quarantined without reason");
    }
    if let State::Running { hold, .. } = &job.state {
        prop_assert_eq!(hold.alone, deaths >= 2);
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
        for at in 0..5 {
            now = now.plus_ms(BACKOFF_CAP_MS);
            let step = match (job.duty(), &job.state) {
                (Duty::Rest, _) => break,
                (Duty::Queue, _) => {
                    job = job.after(&Event::Claim { epoch: Epoch(9), token: Token(100 + at) }, now).unwrap();
                    continue;
                }
                (Duty::Run, _) => Step::Intend(publication(Ending::Clean, 1)),
                (Duty::Intend, State::Concluded { ending, .. }) => Step::Intend(publication(*ending, 1)),
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
    job.after(&Event::Claim { epoch: Epoch(1), token }, now).unwrap().after(&event(token), now).unwrap()
}

fn dies(death: Death) -> impl Fn(Token) -> Event {
    move |token| Event::Step { token, step: Step::Died(death) }
}

fn daemon_dies(alone: bool, innocent: bool) -> impl Fn(Token) -> Event {
    move |_| Event::Interrupted { alone, innocent }
}

#[test]
fn one_crash_and_two_deaths_of_the_daemon_alone_are_three() {
    let mut job = run(&fresh(), dies(Death::Signal(6)));
    job = run(&job, daemon_dies(true, false));
    assert_eq!(job.kind(), Kind::Queued);
    job = run(&job, daemon_dies(true, false));
    assert_eq!((job.kind(), job.attempts), (Kind::Concluded, Attempt(3)));
}

#[test]
fn company_is_no_proof() {
    let mut job = fresh();
    for _ in 0..10 {
        job = run(&job, daemon_dies(false, false));
    }
    assert_eq!((job.kind(), job.blame.deaths_alone), (Kind::Suspect, 0));
}

#[test]
fn a_witness_clears_even_a_file_that_was_alone() {
    let mut job = fresh();
    for _ in 0..10 {
        job = run(&job, daemon_dies(true, true));
    }
    assert_eq!((job.kind(), job.blame), (Kind::Queued, Blame::default()));
}

#[test]
fn kills_from_outside_slow_a_job_down_but_never_end_it() {
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
    assert_eq!(one_line(&long).len(), MAX_REASON);
    assert_eq!(one_line(&format!("x{long}")).len(), MAX_REASON - 1, "never half a character");
}

#[test]
fn only_the_rules_condemn() {
    for ending in [Ending::Quarantined, Ending::Environment] {
        let now = Time(1);
        let running = fresh().after(&Event::Claim { epoch: Epoch(1), token: Token(1) }, now).unwrap();
        let event = Event::Step { token: Token(1), step: Step::Intend(publication(ending, 1)) };
        assert!(matches!(running.after(&event, now), Err(Illegal::State { kind: Kind::Running, .. })));
    }
}
