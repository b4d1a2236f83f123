//! News of the service for whoever is to hear of them: hot folders that go and come back, and the ends of nights. The store knows what was told, so that
//! neither another look nor another life tells it again.

use std::time::{Duration, Instant};

use suture_store::{News, StoreError, Time};

use crate::attempt::Context;
use crate::config::events::Occasion;
use crate::retention::turns::{Moment, Turns};
use crate::{deliver, night};

/// The end of a night is looked for this often.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// An end that lies farther ahead was told by a clock that was wrong.
const AHEAD_MS: u64 = 24 * 3600 * 1000;

/// The ends of nights.
pub(super) struct Nights {
    looked: Option<Instant>,
    /// The clock is believed when it has gone steadily for a while.
    steady: Turns,
}

impl Nights {
    /// The clock is seen for the first time.
    pub(super) fn new(context: &Context) -> Self {
        Self { looked: None, steady: Turns::new(moment(context)) }
    }

    /// Has it told when a night is over, one that ended while no daemon ran, too.
    ///
    /// # Errors
    /// When the store failed.
    pub(super) fn look(&mut self, context: &Context, now: Instant) -> Result<(), StoreError> {
        if self.looked.is_some_and(|then| now.duration_since(then) < LOOK_EVERY) {
            return Ok(());
        }
        self.looked = Some(now);
        let (config, here) = (context.settings.now(), moment(context));
        let is_steady = self.steady.is_due(here);
        let Some(end) = config.run_window.closed(config.night_ends, &context.world.local()) else { return Ok(()) };
        match due(context.store.last_night()?, end, here.wall, is_steady) {
            Due::Nothing => Ok(()),
            Due::Begin => context.store.begin_night(here.wall),
            Due::Over { since } => over(context, since, end),
        }
    }
}

/// Work to be done of nights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Due {
    Nothing,
    /// The next night is counted from now.
    Begin,
    /// A night is to be told of.
    Over {
        since: Time,
    },
}

/// `last`: the end that was told last; `end`: the last one by the clock on the wall, which shows `wall`, and has gone steadily, or not.
fn due(last: Option<Time>, end: Time, wall: Time, is_steady: bool) -> Due {
    match last {
        // Nothing was repaired here before.
        None => Due::Begin,
        Some(last) if last.0 > wall.0.saturating_add(AHEAD_MS) && is_steady => Due::Begin,
        Some(last) if last >= end => Due::Nothing,
        Some(last) => Due::Over { since: last },
    }
}

fn moment(context: &Context) -> Moment {
    Moment { steady: context.world.steady(), wall: context.world.wall() }
}

/// A night is over.
fn over(context: &Context, since: Time, until: Time) -> Result<(), StoreError> {
    let store = &*context.store;
    if !deliver::is_wanted(context, Occasion::Night) {
        return store.begin_night(until);
    }
    store.tell(&News::Night { since, until, jobs: night::count(store, &(since..until))? }).map(drop)
}

/// Where a hot folder stands, as far as this life has told it.
#[derive(Default)]
pub(super) struct Told {
    away: Option<bool>,
}

impl Told {
    /// Has it told that the folder of this name is away, for this reason, or served again.
    ///
    /// # Errors
    /// When the store failed.
    pub(super) fn tell(&mut self, context: &Context, folder: &str, away: Option<&str>) -> Result<(), StoreError> {
        if self.away == Some(away.is_some()) {
            return Ok(());
        }
        let folder = folder.to_owned();
        let news = match away {
            Some(reason) => News::FolderAway { folder, reason: reason.to_owned() },
            None => News::FolderBack { folder },
        };
        match context.store.tell(&news) {
            Err(error) if !error.is_callers() => return Err(error),
            Err(error) => tracing::warn!(%error, "Nobody can be told where the folder stands; give it a shorter `name`."),
            Ok(_) => {}
        }
        self.away = Some(away.is_some());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOUR: u64 = 3600 * 1000;

    /// A clock that goes back, by a little or to 1970 at a start, tells no night twice; an end that a wrong clock has noted, far ahead, keeps no later
    /// night from being told.
    #[test]
    fn f15_a_clock_that_jumps_tells_no_night_twice_and_keeps_none_back() {
        let at = |hour: u64| Time(hour * HOUR);
        assert_eq!(due(None, at(1007), at(1009), true), Due::Begin);
        assert_eq!(due(Some(at(1003)), at(1007), at(1007), false), Due::Over { since: at(1003) });
        assert_eq!(due(Some(at(1007)), at(1007), at(1008), true), Due::Nothing);
        for (wall, end) in [(1006, 983), (990, 983), (5, 0)] {
            assert_eq!(due(Some(at(1007)), at(end), at(wall), false), Due::Nothing, "back to {wall}");
        }
        assert_eq!(due(Some(at(9999)), at(1007), at(1008), false), Due::Nothing, "the clock may be wrong now");
        assert_eq!(due(Some(at(9999)), at(1007), at(1008), true), Due::Begin);
        assert_eq!(due(Some(at(1030)), at(1007), at(1008), true), Due::Nothing, "it is not far ahead");
    }
}
