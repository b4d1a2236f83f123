//! Moments in which this daemon claims nothing, so that other daemons claim first. A job that is handed on rests for a while, and all daemons look for
//! work equally often: without this, the daemon that has handed it on may be the first to look after each rest.

use std::ops::Range;
use std::time::{Duration, Instant};

use suture_store::HAND_ON_MS;

/// Of each job that was handed on: when it may be claimed, until when that is left to others.
#[derive(Debug, Default)]
pub(crate) struct Yielded(Vec<Range<Instant>>);

impl Yielded {
    /// A job was handed on between these two moments. Others have `for_others` to claim it, from the end of its rest on.
    pub(crate) fn hand_on(&mut self, handed: Range<Instant>, for_others: Duration) {
        let rest = Duration::from_millis(HAND_ON_MS);
        self.0.retain(|moment| moment.end > handed.end);
        self.0.push(handed.start + rest..handed.end + rest + for_others);
    }

    /// Is it the turn of others?
    pub(crate) fn holds(&self, now: Instant) -> bool {
        self.0.iter().any(|moment| moment.contains(&now))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    /// While the job rests, and after the time of the others, the daemon goes on with whatever there is.
    #[test]
    fn others_have_their_time_after_the_rest_of_each_job() {
        let (began, mut yielded) = (Instant::now(), Yielded::default());
        let rest = Duration::from_millis(HAND_ON_MS);
        let told = Duration::from_millis(20);
        yielded.hand_on(began..began + told, SECOND);
        let holds = |yielded: &Yielded, after: Duration| yielded.holds(began + after);
        let moment = Duration::from_millis(1);
        let last = rest + told + SECOND;
        assert_eq!(
            [rest - moment, rest, last - moment, last].map(|after| holds(&yielded, after)),
            [false, true, true, false],
            "one job"
        );
        let second = began + rest;
        yielded.hand_on(second..second, SECOND);
        assert!(holds(&yielded, rest) && !holds(&yielded, 2 * rest - moment) && holds(&yielded, 2 * rest), "two jobs");
        yielded.hand_on(began + last..began + last, SECOND);
        assert_eq!(yielded.0.len(), 2, "what is over is forgotten");
    }
}
