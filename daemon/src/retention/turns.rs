//! When a sweep is due: each hour, as long as the clock on the wall goes as fast as time does.
//!
//! Ages are told by that clock. One that has jumped, or is yet to be set right after a start, must not make everything old: then a sweep waits
//! until it has gone steadily for a while.

use std::time::{Duration, Instant};

use suture_store::Time;

const EVERY: Duration = Duration::from_secs(3600);
/// The clock has gone steadily when it did so for this long.
const STEADY: Duration = Duration::from_secs(600);
/// By so much it may differ.
const SLACK: Duration = Duration::from_secs(60);

/// What time it is: by the clock on the wall, and by one that never jumps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    pub steady: Instant,
    pub wall: Time,
}

/// When sweeps are due.
#[derive(Debug)]
pub(crate) struct Turns {
    since: Moment,
    wait: Duration,
}

impl Turns {
    /// The clock is seen for the first time.
    pub(crate) fn new(now: Moment) -> Self {
        Self { since: now, wait: STEADY }
    }

    /// Is one due? If so, the next is an hour later.
    pub(crate) fn is_due(&mut self, now: Moment) -> bool {
        let passed = now.steady.duration_since(self.since.steady);
        let shown = Duration::from_millis(now.wall.0.abs_diff(self.since.wall.0));
        let back = now.wall < self.since.wall && shown > SLACK;
        if back || shown.abs_diff(passed) > SLACK {
            *self = Self::new(now);
            return false;
        }
        let due = passed >= self.wait;
        if due {
            *self = Self { since: now, wait: EVERY };
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: u64 = 1_000_000_000;

    #[test]
    fn f15_each_hour_after_a_while_and_not_after_a_jump() {
        let begin = Instant::now();
        // Seconds by both clocks.
        let at = |steady: u64, wall: i64| Moment {
            steady: begin + Duration::from_secs(steady),
            wall: Time(START.saturating_add_signed(wall * 1000)),
        };
        let mut turns = Turns::new(at(0, 0));
        assert!(!turns.is_due(at(599, 599)) && turns.is_due(at(600, 601)));
        assert!(!turns.is_due(at(4199, 4199)) && turns.is_due(at(4200, 4200)));
        let year = 365 * 24 * 3600;
        for jump in [year, -year / 100, 61, -61] {
            let mut turns = Turns::new(at(0, 0));
            assert!(!turns.is_due(at(600, 600 + jump)), "{jump}");
            assert!(!turns.is_due(at(1199, 1199 + jump)), "{jump}");
            assert!(turns.is_due(at(1200, 1200 + jump)), "it has gone steadily since");
        }
    }
}
