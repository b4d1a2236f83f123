//! A hot folder's turns, and how many of its jobs are in work: see [`crate::share`].

use crate::share::Share;

#[derive(Default)]
pub(super) struct Turns {
    pub(super) share: Share,
    /// How many are in work.
    pub(super) held: u32,
    /// When its last turn began, if it had one.
    began: Option<u64>,
}

impl Turns {
    /// Of a folder that had none.
    pub(super) fn of(share: Share) -> Self {
        Self { share, ..Self::default() }
    }

    /// May one more of its jobs be in work?
    pub(super) fn has_room(&self) -> bool {
        self.share.most_running.is_none_or(|most| self.held < most.get())
    }

    /// When its next turn begins; `latest`: when the latest one of any folder began.
    pub(super) fn next(&self, latest: u64) -> u64 {
        self.began.map_or(0, |began| began.saturating_add(self.share.weight.turn())).max(latest)
    }

    /// Its next turn begins; when.
    pub(super) fn begin(&mut self, latest: u64) -> u64 {
        *self.began.insert(self.next(latest))
    }
}
