//! What an answer means, and when to try again: longer pauses each time, none of them as long as another's, so that a receiver that comes back is
//! not met by all at once.

use std::time::Duration;

/// The pause after the first try, and the longest.
const FIRST: Duration = Duration::from_secs(1);
const LONGEST: Duration = Duration::from_secs(600);
/// A receiver may ask for so much.
const LONGEST_ASKED: Duration = Duration::from_secs(3600);
/// A receiver that refuses a message is asked so often.
const REFUSALS: u32 = 5;

/// What came of a try.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// It is done. `note`: a word on it for the log.
    Delivered { note: String },
    /// It is to be tried again; not before the receiver wants it.
    Again { why: String, after: Option<Duration> },
    /// It was refused: tried again a few times only.
    Refused { why: String },
    /// It will never be done.
    Never { why: String },
    /// The daemon ends; nothing is known of it.
    Cut,
}

impl Outcome {
    /// Of an answer with this status.
    pub(crate) fn of(status: u16, after: Option<Duration>) -> Self {
        let why = format!("the receiver answered with {status}");
        match status {
            200..300 => Self::Delivered { note: String::new() },
            408 | 425 | 429 | 500.. => Self::Again { why, after },
            300..400 => Self::Refused { why: format!("{why}, which is another address; name that one in `url`") },
            _ => Self::Refused { why },
        }
    }

    /// What is to be done after this many tries, this one included.
    pub(crate) fn after(self, tries: u32, id: &str) -> Next {
        match self {
            Self::Delivered { note } => Next::Done { note },
            Self::Never { why } => Next::GiveUp { why },
            Self::Refused { why } if tries >= REFUSALS => Next::GiveUp { why },
            Self::Refused { why } => Next::Wait { why, pause: pause(tries, id, None) },
            Self::Again { why, after } => Next::Wait { why, pause: pause(tries, id, after) },
            Self::Cut => Next::Stop,
        }
    }
}

/// What is to be done now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Next {
    Done { note: String },
    GiveUp { why: String },
    Wait { why: String, pause: Duration },
    Stop,
}

/// The pause after so many tries. `id`: of what is tried, to tell its pauses from those of others.
fn pause(tries: u32, id: &str, asked: Option<Duration>) -> Duration {
    let doubled = 2_u32.checked_pow(tries.saturating_sub(1)).unwrap_or(u32::MAX);
    let plain = FIRST.saturating_mul(doubled).min(LONGEST);
    // From four fifths to six fifths of that.
    let [chance, ..] = *blake3::hash(format!("{id} {tries}").as_bytes()).as_bytes();
    let some = plain.mul_f64(0.8 + 0.4 * f64::from(chance) / 255.0);
    asked.map_or(some, |asked| asked.min(LONGEST_ASKED).max(some))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_mean_what_they_say() {
        for status in [200, 202, 204, 299] {
            assert!(matches!(Outcome::of(status, None), Outcome::Delivered { .. }), "{status}");
        }
        for status in [408, 425, 429, 500, 503, 599] {
            assert!(matches!(Outcome::of(status, None), Outcome::Again { .. }), "{status}");
        }
        for status in [301, 307, 400, 401, 404, 410, 499] {
            assert!(matches!(Outcome::of(status, None), Outcome::Refused { .. }), "{status}");
        }
    }

    #[test]
    fn who_refuses_is_asked_a_few_times_and_who_fails_for_ever() {
        let refused = |tries| Outcome::of(404, None).after(tries, "a");
        assert!((1..5).all(|tries| matches!(refused(tries), Next::Wait { .. })));
        assert!(matches!(refused(5), Next::GiveUp { .. }));
        assert!(matches!(Outcome::of(503, None).after(u32::MAX, "a"), Next::Wait { .. }));
    }

    #[test]
    fn pauses_grow_to_a_bound_and_differ() {
        for (tries, plain) in [(1, 1.0), (2, 2.0), (5, 16.0), (10, 512.0), (11, 600.0), (99, 600.0), (u32::MAX, 600.0)] {
            let all: Vec<f64> = (0..64).map(|n| pause(tries, &format!("{n}"), None).as_secs_f64()).collect();
            assert!(all.iter().all(|pause| (0.8 * plain - 1e-6..=1.2 * plain + 1e-6).contains(pause)), "{tries}: {all:?}");
            assert!(all.iter().any(|pause| *pause < 0.95 * plain) && all.iter().any(|pause| *pause > 1.05 * plain), "{tries}");
        }
    }

    #[test]
    fn a_receiver_may_ask_for_a_longer_pause_but_not_for_any() {
        let asked = |seconds| pause(1, "a", Some(Duration::from_secs(seconds)));
        assert_eq!(asked(90), Duration::from_secs(90));
        assert_eq!(asked(1 << 40), LONGEST_ASKED);
        assert_eq!(asked(0), pause(1, "a", None));
    }
}
