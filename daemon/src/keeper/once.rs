//! With `--once` the daemon ends by itself: when everything that came to rest is finished, or waits for what no waiting here brings.

use std::sync::PoisonError;
use std::sync::atomic::Ordering;

use suture_store::job::Kind;
use suture_store::{Job, Query, StoreError};

use super::{Keeper, Kept};
use crate::folder::is_meant;

/// A result that cannot be brought into place is tried so often before it is left for the next run.
const TRIES_ONCE: u32 = 4;
/// Jobs that a slot may take.
const QUEUED: [Kind; 2] = [Kind::Queued, Kind::Alone];

impl Keeper {
    /// With `--once`: is everything that came to rest finished?
    pub(super) fn is_finished(&self) -> Result<bool, StoreError> {
        let rests = |kept: &Kept| !kept.dirty && (kept.unavailable || !kept.reconciler.is_settling());
        let folders_rest = self.folders.iter().all(rests);
        let buckets = self.context.folders.iter().filter_map(|folder| folder.bucket.as_ref());
        let were_polled = buckets.into_iter().all(|shelf| shelf.was_polled.load(Ordering::Acquire));
        let counts = self.context.store.counts()?;
        if !were_polled || !folders_rest || self.context.schedule.busy() > 0 || !self.inbox.is_empty() {
            return Ok(false);
        }
        // A slot that began or ended between these looks changed the counts: what it did is to be heard of first.
        if self.context.store.counts()? != counts {
            return Ok(false);
        }
        let of = |wanted: fn(Kind) -> bool| counts.iter().filter(|(kind, _)| wanted(*kind)).map(|(_, n)| n).sum::<u64>();
        let queued = of(|kind| QUEUED.contains(&kind));
        if queued > 0 && !self.context.schedule.is_paused() && self.may_begin(queued)? {
            return Ok(false);
        }
        if of(|kind| kind == Kind::Parked) > 0 && !self.context.schedule.is_paused() && self.may_move_on()? {
            return Ok(false);
        }
        let waiting = of(Kind::is_live);
        if waiting > 0 || self.folders.iter().any(|kept| kept.unavailable) || self.is_a_bucket_away() {
            tracing::warn!(
                jobs = waiting,
                "Some work is left for the next run: jobs that wait after errors, a full disk, a pause, the hours of work, or folders out of reach."
            );
            self.context.not_good.store(true, Ordering::Relaxed);
        }
        for kept in self.folders.iter().filter(|kept| !kept.is_kept) {
            tracing::warn!(folder = %kept.folder.root.display(), "Another daemon looks for drops in this folder; they are left to it.");
            self.context.not_good.store(true, Ordering::Relaxed);
        }
        self.tell_of_foreign()?;
        Ok(true)
    }

    /// Did a bucket not answer when it was looked through?
    fn is_a_bucket_away(&self) -> bool {
        let away = self.context.away.lock().unwrap_or_else(PoisonError::into_inner);
        let is_away = |name| away.get(name).is_some_and(|why| !why.is_empty());
        self.context.folders.iter().any(|folder| folder.bucket.is_some() && is_away(&folder.name))
    }

    /// With `--once`: files that someone meant to have repaired, and that are left where they are, are not good.
    fn tell_of_foreign(&self) -> Result<(), StoreError> {
        let noticed = self.context.store.list(&Query { kinds: vec![Kind::Noticed], ..Query::default() })?;
        let meant = |job: &&Job| job.source.path.to_path().file_name().is_some_and(is_meant);
        let left_out = self.folders.iter().map(|kept| kept.reconciler.left_out().len()).sum::<usize>();
        let files = noticed.iter().filter(meant).count() + left_out;
        if files > 0 {
            tracing::warn!(files, "Files are left where they are; `suture jobs list --state noticed` says why.");
            self.context.not_good.store(true, Ordering::Relaxed);
        }
        Ok(())
    }

    /// Is one of so many queued jobs of a folder whose disk has room, or taken by now?
    fn may_begin(&self, queued: u64) -> Result<bool, StoreError> {
        let full = self.context.full.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if full.is_empty() {
            return Ok(true);
        }
        let jobs = self.context.store.list(&Query { kinds: QUEUED.into(), ..Query::default() })?;
        Ok(jobs.len() as u64 != queued || jobs.iter().any(|job| !full.contains(&job.source.folder)))
    }

    /// Is a parked job tried once more, with `--once`? What an earlier run left was tried often; but the world may be another one now.
    fn may_move_on(&self) -> Result<bool, StoreError> {
        let now = self.context.world.wall();
        let parked = self.context.store.list(&Query { kinds: vec![Kind::Parked], ..Query::default() })?;
        let full = self.context.full.lock().unwrap_or_else(PoisonError::into_inner);
        let mut parked = parked.iter().filter(|job| !full.contains(&job.source.folder));
        Ok(parked.any(|job| job.is_due(now) || job.parked.is_some_and(|parked| parked.tries < TRIES_ONCE)))
    }
}
