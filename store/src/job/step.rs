//! Which event may follow which state, and what comes of it.

use super::{
    BACKOFF_CAP_MS, BACKOFF_MS, Blame, Death, ENVIRONMENT_RETRIES, Ending, Hold, Job, KILLS_FREE, Kind, Publication, State, Step,
    Withdrawal, one_line,
};
use crate::id::{Epoch, Time, Token};

/// Something that happens to a job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A worker takes it.
    Claim { epoch: Epoch, token: Token },
    /// The holder of the claim `token` reports.
    Step { token: Token, step: Step },
    /// The daemon of the claim's epoch died. `alone`: nothing else ran. `innocent`: there is a witness that it was not the file.
    Interrupted { alone: bool, innocent: bool },
    /// The claim goes over to a new life of the daemon, which will bring the result into place.
    Reclaim { epoch: Epoch, token: Token },
    /// An operator wants it tried (again), now.
    Retry,
    /// An operator wants it stopped.
    Cancel,
    /// A file that was only noticed is gone.
    Forget,
}

/// An event that cannot happen in this state. Nothing was changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Illegal {
    #[error("a job that is {kind} cannot be {event}")]
    State { kind: Kind, event: &'static str },
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
                Step::Cancelled | Step::Withdrawn(_) => "withdrawn",
                Step::Intend(_) => "intended",
                Step::Placed => "placed",
                Step::Redirect { .. } => "redirected",
                Step::Finished => "finished",
                Step::Lost => "lost",
            },
            Self::Interrupted { .. } => "interrupted",
            Self::Reclaim { .. } => "claimed again",
            Self::Retry => "retried",
            Self::Cancel => "cancelled",
            Self::Forget => "forgotten",
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
            Event::Claim { epoch, token } => next.claim(*epoch, *token, now).ok_or(illegal)?,
            Event::Step { token, step } => {
                let hold = *self.hold().ok_or(Illegal::Fenced)?;
                if hold.token != *token {
                    return Err(Illegal::Fenced);
                }
                next.step(hold, step, now).ok_or(illegal)?;
            }
            Event::Interrupted { alone, innocent } => next.interrupt(*alone, *innocent).ok_or(illegal)?,
            Event::Reclaim { epoch, token } => next.reclaim(*epoch, *token).ok_or(illegal)?,
            Event::Retry => next.retry().ok_or(illegal)?,
            Event::Cancel => match &mut next.state {
                State::Queued { .. } | State::Noticed { .. } => next.state = State::Cancelled { why: Withdrawal::Operator },
                State::Running { cancel, .. } => *cancel = true,
                _ => return Err(illegal),
            },
            Event::Forget => match next.state {
                State::Noticed { .. } => next.state = State::Cancelled { why: Withdrawal::Vanished },
                _ => return Err(illegal),
            },
        }
        Ok(next)
    }

    fn claim(&mut self, epoch: Epoch, token: Token, now: Time) -> Option<()> {
        if !self.is_due(now) {
            return None;
        }
        self.attempts = self.attempts.next();
        self.work = Some(token);
        let hold = Hold { attempt: self.attempts, epoch, token, alone: self.blame.is_suspect() };
        self.state = State::Running { hold, cancel: false };
        Some(())
    }

    fn reclaim(&mut self, epoch: Epoch, token: Token) -> Option<()> {
        match &mut self.state {
            State::Concluded { hold, .. } | State::Publishing { hold, .. } | State::Published { hold, .. } => {
                hold.epoch = epoch;
                hold.token = token;
                Some(())
            }
            _ => None,
        }
    }

    /// A step of the holder; `None` when it does not belong to the state.
    fn step(&mut self, hold: Hold, step: &Step, now: Time) -> Option<()> {
        let state = std::mem::replace(&mut self.state, NOW);
        self.state = match (state, step) {
            (State::Running { cancel, .. }, Step::Died(death)) => self.died(hold, *death, cancel, now),
            (State::Running { cancel, .. }, Step::Environment { reason }) => self.put_off(hold, reason, cancel, now),
            (State::Running { cancel: false, .. }, Step::HandBack) => NOW,
            (State::Running { .. }, Step::HandBack | Step::Cancelled) => State::Cancelled { why: Withdrawal::Operator },
            (State::Running { .. }, Step::Withdrawn(why)) => State::Cancelled { why: *why },
            // A result that is there is not thrown away because a cancel came late. Who is condemned, the machine says.
            (State::Running { .. }, Step::Intend(publication)) if !publication.ending.is_condemned() => {
                publishing(hold, publication)
            }
            // Another name may be chosen, but not another result.
            (State::Publishing { publication: earlier, .. }, Step::Intend(publication))
                if (publication.ending, publication.output_hash) == (earlier.ending, earlier.output_hash) =>
            {
                publishing(hold, publication)
            }
            (State::Concluded { ending, .. }, Step::Intend(publication)) if publication.ending == ending => {
                publishing(hold, publication)
            }
            (State::Publishing { publication, .. }, Step::Placed) => State::Published { hold, publication },
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
            return State::Concluded { hold, ending: Ending::Environment, reason: self.note.clone() };
        }
        State::Queued { not_before: Some(backoff(before, now)) }
    }

    fn interrupt(&mut self, alone: bool, innocent: bool) -> Option<()> {
        let State::Running { hold, cancel } = self.state else { return None };
        self.note = "the daemon died while it ran".into();
        if !innocent {
            self.blame.deaths = self.blame.deaths.saturating_add(1);
            self.blame.deaths_alone = self.blame.deaths_alone.saturating_add(u32::from(alone));
        }
        self.state = if cancel { State::Cancelled { why: Withdrawal::Operator } } else { self.judge(hold) };
        Some(())
    }

    /// Back into the queue, or condemned.
    fn judge(&self, hold: Hold) -> State {
        if self.blame.is_condemned() {
            State::Concluded { hold, ending: Ending::Quarantined, reason: self.note.clone() }
        } else {
            NOW
        }
    }

    fn retry(&mut self) -> Option<()> {
        match &self.state {
            State::Queued { .. } | State::Cancelled { why: Withdrawal::Operator } => {}
            State::Ended { publication } if !publication.ending.is_good() => {
                if let Some(original) = &publication.original {
                    self.moved_to = Some((publication.ending.area(), original.clone()));
                }
            }
            _ => return None,
        }
        self.blame = Blame::default();
        self.state = NOW;
        Some(())
    }
}

fn publishing(hold: Hold, publication: &Publication) -> State {
    let mut publication = publication.clone();
    publication.reason = one_line(&publication.reason);
    State::Publishing { hold, publication }
}

/// 30 s, 60 s, 120 s … up to half an hour.
fn backoff(earlier: u32, now: Time) -> Time {
    let pause = BACKOFF_MS.checked_shl(earlier.min(16)).unwrap_or(BACKOFF_CAP_MS);
    now.plus_ms(pause.min(BACKOFF_CAP_MS))
}
