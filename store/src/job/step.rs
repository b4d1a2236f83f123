//! Which event may follow which state, and what comes of it.

use super::blame::{Blame, Death, KILLS_FREE, Testimony};
use super::decision::{Decision, Verdict};
use super::hold::Hold;
use super::kind::Kind;
use super::pauses::{BACKOFF_CAP_MS, BACKOFF_MS, ENVIRONMENT_RETRIES, HAND_ON_MS, PARK_CAP_MS, PARK_MS, WAIT_MS};
use super::priority::Priority;
use super::state::{Ending, Job, Parked, Publication, State, Step, Withdrawal};
use super::words::one_line;
use crate::id::{Boot, Epoch, Time, Token};

/// Something that happens to a job.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "each variant says what its fields are")]
pub enum Event {
    /// A worker takes it, or, if it is parked, someone tries to bring its result into place once more.
    Claim { epoch: Epoch, token: Token, boot: Boot },
    /// The holder of the claim `token` reports.
    Step { token: Token, step: Step },
    /// The daemon of the claim's epoch died. `alone`: nothing else ran.
    Interrupted { alone: bool, testimony: Testimony },
    /// The claim goes over to a new life of the daemon, which will bring the result into place.
    Reclaim { epoch: Epoch, token: Token },
    /// An operator wants it tried (again), now.
    Retry,
    /// An operator wants it stopped.
    Cancel,
    /// A file that was only noticed is gone.
    Forget,
    /// A file that was only noticed is wanted after all, this soon.
    Want(Priority),
    /// Its pause is over before its time.
    Hasten,
    /// An operator wants it sooner, or later.
    Rank(Priority),
    /// A person says whether a result that needs review is to be used.
    Decide(Decision),
}

/// An event that cannot happen in this state. Nothing was changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "each variant says what its fields are")]
pub enum Illegal {
    #[error("a job that is {kind} cannot be {event}")]
    State { kind: Kind, event: &'static str },
    /// Too late to take it back.
    #[error("its result is in place already; the rest of it is brought into place as soon as that is possible")]
    Committed,
    /// A person wants it published, and so it is.
    #[error("it was approved, and is being published; that cannot be taken back")]
    Approved,
    /// Nothing of it could be published.
    #[error("it has left no best attempt that could be approved; `suture jobs retry` works on it once more")]
    NoAttempt,
    /// The claim is not the job's current one.
    #[error("the claim is void: the job was given to another worker since")]
    Fenced,
}

impl Event {
    fn name(&self) -> &'static str {
        match self {
            Self::Claim { .. } => "claimed",
            Self::Step { step, .. } => match step {
                Step::Died(_) => "reported dead",
                Step::Environment { .. } => "put off",
                Step::HandBack => "handed back",
                Step::Sampled(_) => "sampled",
                Step::HandOn => "handed on",
                Step::Wait { .. } => "made to wait",
                Step::NeedsAll => "given the whole memory",
                Step::Park { .. } => "parked",
                Step::Cancelled | Step::Withdrawn(_) => "withdrawn",
                Step::Intend(_) => "intended",
                Step::Placed => "placed",
                Step::Redirect { .. } => "redirected",
                Step::Finished => "finished",
                Step::Lost => "lost",
                Step::Unfit { .. } => "found unfit",
            },
            Self::Interrupted { .. } => "interrupted",
            Self::Reclaim { .. } => "claimed again",
            Self::Retry => "retried",
            Self::Cancel => "cancelled",
            Self::Forget => "forgotten",
            Self::Want(_) => "taken after all",
            Self::Hasten => "hastened",
            Self::Rank(_) => "given a priority",
            Self::Decide(decision) => decision.verdict.name(),
        }
    }
}

const NOW: State = State::Queued { not_before: None };

impl Job {
    /// The job after `event` at `now`.
    ///
    /// # Errors
    /// When the event is not possible in the job's state, or comes with a claim that is void.
    pub fn after(&self, event: &Event, now: Time) -> Result<Self, Illegal> {
        let mut next = self.clone();
        next.changed = now;
        let illegal = Illegal::State { kind: self.kind(), event: event.name() };
        match event {
            Event::Claim { epoch, token, boot } => next.claim(*epoch, *token, *boot, now).ok_or(illegal)?,
            Event::Step { token, step } => {
                let hold = *self.hold().ok_or(Illegal::Fenced)?;
                if hold.token != *token {
                    return Err(Illegal::Fenced);
                }
                next.step(hold, step, now).ok_or(illegal)?;
            }
            Event::Interrupted { alone, testimony } => next.interrupt(*alone, *testimony).ok_or(illegal)?,
            Event::Reclaim { .. } if self.rests_parked() => return Err(illegal),
            Event::Reclaim { epoch, token } => next.reclaim(*epoch, *token).ok_or(illegal)?,
            Event::Retry => next.retry(now).ok_or(illegal)?,
            Event::Cancel if next.is_being_approved() => return Err(Illegal::Approved),
            Event::Cancel if next.rests_parked() => next.give_up()?,
            Event::Cancel => match &mut next.state {
                State::Queued { .. } | State::Noticed { .. } => next.state = State::Cancelled { why: Withdrawal::Operator },
                State::Running { cancel, .. } => *cancel = true,
                _ => return Err(illegal),
            },
            Event::Hasten => match &mut next.state {
                State::Queued { not_before } if not_before.is_some() => *not_before = None,
                _ => return Err(illegal),
            },
            Event::Rank(priority) => match next.state {
                State::Queued { .. } => next.priority = *priority,
                _ => return Err(illegal),
            },
            Event::Decide(decision) => next.decide(decision, now).ok_or(illegal)??,
            Event::Forget => match next.state {
                State::Noticed { .. } => next.state = State::Cancelled { why: Withdrawal::Vanished },
                _ => return Err(illegal),
            },
            Event::Want(priority) => match next.state {
                State::Noticed { .. } => (next.state, next.priority) = (NOW, *priority),
                _ => return Err(illegal),
            },
        }
        if matches!(next.state, State::Ended { .. } | State::Cancelled { .. }) {
            next.witness = None;
        }
        Ok(next)
    }

    fn claim(&mut self, epoch: Epoch, token: Token, boot: Boot, now: Time) -> Option<()> {
        if !self.is_due(now) {
            return None;
        }
        if let Some(parked) = &mut self.parked {
            parked.until = None;
            if let State::Approved { .. } = self.state {
                self.work.get_or_insert(token);
            }
            return self.reclaim(epoch, token);
        }
        self.attempts = self.attempts.next();
        self.work = Some(token);
        let hold = Hold { attempt: self.attempts, epoch, token, alone: self.must_run_alone(), boot };
        self.state = State::Running { hold, cancel: false };
        Some(())
    }

    /// An operator gives a parked job up: a result that is not in place is thrown away, an original that cannot be moved stays.
    fn give_up(&mut self) -> Result<(), Illegal> {
        let committed = self.parked.take().is_some_and(|parked| parked.committed);
        match &mut self.state {
            State::Published { publication, .. } => {
                let publication = Publication { original: None, ..publication.clone() };
                self.state = State::Ended { publication };
            }
            _ if committed => return Err(Illegal::Committed),
            _ => self.state = State::Cancelled { why: Withdrawal::Operator },
        }
        Ok(())
    }

    fn reclaim(&mut self, epoch: Epoch, token: Token) -> Option<()> {
        match &mut self.state {
            State::Concluded { hold, .. }
            | State::Approved { hold, .. }
            | State::Publishing { hold, .. }
            | State::Published { hold, .. } => {
                hold.epoch = epoch;
                hold.token = token;
                Some(())
            }
            _ => None,
        }
    }

    /// A step of the holder; `None` when it does not belong to the state.
    fn step(&mut self, hold: Hold, step: &Step, now: Time) -> Option<()> {
        if let Step::Park { reason, committed } = step {
            return self.park(reason, *committed, now);
        }
        self.parked = None;
        let state = std::mem::replace(&mut self.state, NOW);
        self.state = match (state, step) {
            (State::Running { cancel, .. }, Step::Died(death)) => self.died(hold, *death, cancel, now),
            (State::Running { cancel, .. }, Step::Environment { reason }) => self.put_off(hold, reason, cancel, now),
            (State::Running { .. }, Step::Cancelled) => State::Cancelled { why: Withdrawal::Operator },
            (
                State::Running { cancel, .. },
                Step::HandBack | Step::Wait { .. } | Step::NeedsAll | Step::Sampled(_) | Step::HandOn,
            ) => self.hand_back(hold, step, cancel, now)?,
            (State::Running { .. }, Step::Withdrawn(why)) => State::Cancelled { why: *why },
            // A result that is there is not thrown away because a cancel came late. Who is condemned, the machine says.
            (State::Running { .. }, Step::Intend(publication)) if !publication.ending.is_condemned() => {
                publishing(hold, publication)
            }
            // Another name may be chosen, or the result be given up for want of one, but there is no other result.
            (State::Publishing { publication: earlier, .. }, Step::Intend(publication))
                if (publication.ending, publication.output_hash) == (earlier.ending, earlier.output_hash)
                    || publication.gives_way(&earlier) =>
            {
                publishing(hold, publication)
            }
            (State::Concluded { ending, .. }, Step::Intend(publication)) if publication.ending == ending => {
                publishing(hold, publication)
            }
            (State::Approved { publication, .. }, step) => approved(hold, publication, step)?,
            (State::Publishing { publication, .. }, Step::Placed) => State::Published { hold, publication },
            // The file changed before anything of its result was in place.
            (State::Publishing { .. }, Step::Withdrawn(why)) => State::Cancelled { why: *why },
            (State::Publishing { publication, .. }, Step::Lost) if publication.ending.is_condemned() => {
                State::Concluded { hold, ending: publication.ending, reason: publication.reason }
            }
            (State::Publishing { .. }, Step::Lost) => {
                self.put_off(hold, "its result was lost before it was in place", false, now)
            }
            (State::Published { mut publication, .. }, Step::Redirect { original }) if publication.original.is_some() => {
                publication.original = Some(original.clone());
                State::Published { hold, publication }
            }
            (State::Published { publication, .. }, Step::Finished) => {
                self.moved_to = None;
                State::Ended { publication }
            }
            _ => return None,
        };
        Some(())
    }

    /// Back into the queue at no cost, for whatever reason; `None` when there was none for it.
    fn hand_back(&mut self, hold: Hold, step: &Step, cancel: bool, now: Time) -> Option<State> {
        Some(match step {
            _ if cancel => State::Cancelled { why: Withdrawal::Operator },
            Step::Wait { reason } => {
                self.note = one_line(reason);
                State::Queued { not_before: Some(now.plus_ms(WAIT_MS)) }
            }
            Step::NeedsAll if hold.alone => State::Cancelled { why: Withdrawal::Operator },
            Step::NeedsAll => {
                self.needs_all = true;
                self.note = "its share of the memory was too small; it gets all of it".into();
                NOW
            }
            Step::Sampled(witness) if self.witness.is_none() => {
                self.note = "it was computed, and is to be computed once more, for a comparison".into();
                self.witness = Some(Box::new(witness.at(now)));
                NOW
            }
            Step::HandOn if self.witness.is_some() => State::Queued { not_before: Some(now.plus_ms(HAND_ON_MS)) },
            Step::HandBack => NOW,
            _ => return None,
        })
    }

    fn park(&mut self, reason: &str, committed: bool, now: Time) -> Option<()> {
        if matches!(self.state, State::Running { .. }) {
            return None;
        }
        self.note = one_line(reason);
        let earlier = self.parked.unwrap_or(Parked { until: None, tries: 0, committed: false });
        self.parked = Some(Parked {
            until: Some(pause(PARK_MS, PARK_CAP_MS, earlier.tries, now)),
            tries: earlier.tries.saturating_add(1),
            committed: committed || earlier.committed,
        });
        Some(())
    }

    fn died(&mut self, hold: Hold, death: Death, cancel: bool, now: Time) -> State {
        self.note = one_line(&death.to_string());
        if cancel {
            return State::Cancelled { why: Withdrawal::Operator };
        }
        if !death.is_charged() {
            self.blame.kills = self.blame.kills.saturating_add(1);
            let over = self.blame.kills.checked_sub(KILLS_FREE + 1);
            return State::Queued { not_before: over.map(|n| backoff(n, now)) };
        }
        self.blame.charges = self.blame.charges.saturating_add(1);
        self.judge(hold)
    }

    fn put_off(&mut self, hold: Hold, reason: &str, cancel: bool, now: Time) -> State {
        self.note = one_line(reason);
        if cancel {
            return State::Cancelled { why: Withdrawal::Operator };
        }
        let before = self.blame.environment;
        self.blame.environment = before.saturating_add(1);
        if before >= ENVIRONMENT_RETRIES {
            return State::Concluded { hold, ending: Ending::Environment, reason: self.last_words() };
        }
        State::Queued { not_before: Some(backoff(before, now)) }
    }

    fn interrupt(&mut self, alone: bool, testimony: Testimony) -> Option<()> {
        let State::Running { hold, cancel } = self.state else { return None };
        let note = match testimony {
            Testimony::None => "the daemon died while it ran",
            Testimony::Outlived => "the daemon died while it ran, and not of it",
            Testimony::InHand => "the daemon died of its worker's answer",
            Testimony::Machine => "the machine went down while it ran",
        };
        self.note = note.into();
        let blame = &mut self.blame;
        match testimony {
            Testimony::Outlived => {}
            Testimony::Machine => blame.machine = blame.machine.saturating_add(1),
            Testimony::None | Testimony::InHand => {
                blame.deaths = blame.deaths.saturating_add(1);
                let in_hand = testimony == Testimony::InHand;
                blame.in_hand = blame.in_hand.saturating_add(in_hand.into());
                blame.deaths_alone = blame.deaths_alone.saturating_add(u32::from(alone && in_hand));
            }
        }
        self.state = if cancel { State::Cancelled { why: Withdrawal::Operator } } else { self.judge(hold) };
        Some(())
    }

    /// Back into the queue, or condemned.
    fn judge(&self, hold: Hold) -> State {
        if self.blame.is_condemned() {
            State::Concluded { hold, ending: Ending::Quarantined, reason: self.last_words() }
        } else {
            NOW
        }
    }

    /// Why it ends without a result; one that was made once is told of.
    fn last_words(&self) -> String {
        self.witness.as_ref().map_or_else(|| self.note.clone(), |witness| one_line(&format!("{}; {witness}", self.note)))
    }

    /// `None`: there is nothing to decide.
    fn decide(&mut self, decision: &Decision, now: Time) -> Option<Result<(), Illegal>> {
        let State::Ended { publication } = &mut self.state else { return None };
        let is_open = publication.decision.as_ref().is_none_or(|earlier| earlier.verdict != decision.verdict);
        if publication.ending != Ending::NeedsReview || !is_open {
            return None;
        }
        let rejected = decision.verdict == Verdict::Rejected;
        let decision = Some(Box::new(Decision { at: now, ..decision.clone() }));
        if rejected {
            publication.decision = decision;
            return Some(Ok(()));
        }
        if publication.output.is_none() || publication.output_hash.is_none() {
            return Some(Err(Illegal::NoAttempt));
        }
        let publication = Publication { decision, ..publication.clone() };
        if let (Some(original), false) = (&publication.original, publication.stays) {
            self.moved_to = Some((publication.ending.area(), original.clone()));
        }
        self.note.clear();
        self.state = State::Approved { hold: Hold::none(self.attempts), publication };
        // For whoever comes next, now.
        self.parked = Some(Parked { until: Some(Time(0)), tries: 0, committed: false });
        Some(Ok(()))
    }

    fn retry(&mut self, now: Time) -> Option<()> {
        if self.rests_parked() {
            self.parked = self.parked.map(|parked| Parked { until: Some(Time(0)), ..parked });
            return Some(());
        }
        match &self.state {
            State::Queued { .. } | State::Cancelled { why: Withdrawal::Operator } => {}
            State::Ended { publication } if !publication.ending.is_good() => {
                if let (Some(original), false) = (&publication.original, publication.stays) {
                    self.moved_to = Some((publication.ending.area(), original.clone()));
                }
            }
            _ => return None,
        }
        self.blame = Blame::default();
        self.witness = None;
        self.retried = Some(now);
        self.state = NOW;
        Some(())
    }
}

/// What comes of an approved result: exactly what was judged is published, or nothing.
fn approved(hold: Hold, judged: Publication, step: &Step) -> Option<State> {
    match step {
        Step::Intend(publication)
            if publication.ending == Ending::Repaired
                && (publication.output_hash, &publication.decision) == (judged.output_hash, &judged.decision) =>
        {
            Some(publishing(hold, publication))
        }
        Step::Unfit { reason } => {
            let told = judged.reason.strip_prefix(reason.as_str()).unwrap_or(&judged.reason).trim_start_matches("; ");
            let reason = one_line(&if told.is_empty() { reason.clone() } else { format!("{reason}; {told}") });
            Some(State::Ended { publication: Publication { decision: None, reason, ..judged } })
        }
        _ => None,
    }
}

fn publishing(hold: Hold, publication: &Publication) -> State {
    let mut publication = publication.clone();
    publication.reason = one_line(&publication.reason);
    State::Publishing { hold, publication }
}

/// 30 s, 60 s, 120 s … up to half an hour.
fn backoff(earlier: u32, now: Time) -> Time {
    pause(BACKOFF_MS, BACKOFF_CAP_MS, earlier, now)
}

/// The end of a pause that doubles from `first` to `cap`, after so many `earlier` ones.
fn pause(first: u64, cap: u64, earlier: u32, now: Time) -> Time {
    now.plus_ms(first.saturating_mul(1 << earlier.min(16)).min(cap))
}
