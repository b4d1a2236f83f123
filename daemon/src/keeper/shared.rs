//! Which folders this daemon keeps, and the beginning of that. A folder that others serve, too, has one keeper; when that is gone, another daemon takes
//! its place, and takes up what it left. The others look whether the folder is in reach, and no more.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use suture_store::job::{Area, Kind};
use suture_store::{Control, Job, Query, Role, StoreError};

use super::{Keeper, Kept, LOOK_FOR, control};
use crate::attempt::Context;
use crate::attempt::clear::clear;
use crate::fsx;
use crate::past::each_job;
use crate::sentinel::Answer;
use crate::uploads;

/// Time between looks which jobs of a shared folder have ended elsewhere, of which nothing is heard; at least so many times as long as a look takes.
const ASK_EVERY: Duration = Duration::from_secs(5);
const ASK_TIMES: u32 = 50;
/// Time between looks for what dead workers left there.
const CLEAR_EVERY: Duration = Duration::from_secs(30);

impl Keeper {
    /// Takes up what earlier lives, or another daemon, left in the folders that this one begins to keep.
    ///
    /// # Errors
    /// When the store failed.
    pub(super) fn take_up(&mut self, now: Instant) -> Result<(), StoreError> {
        let context = &self.context;
        let new: Vec<bool> = self.folders.iter_mut().map(|kept| kept.begins_to_keep(context, now)).collect();
        self.announce();
        let context = &self.context;
        // All jobs are read for it.
        if new.contains(&true) {
            let mut new: Vec<&mut Kept> =
                self.folders.iter_mut().zip(new).filter_map(|(kept, new)| new.then_some(kept)).collect();
            remember_live(context, &mut new)?;
            each_job(&*context.store, &mut |job| new.iter_mut().for_each(|kept| kept.remember(job, now)))?;
            forget_noticed(context, &new)?;
        }
        self.hear_of_ends(now)?;
        self.folders.iter_mut().try_for_each(|kept| kept.clear(&self.context, now))
    }

    /// Asks now and then which jobs of shared folders have ended on other machines.
    fn hear_of_ends(&mut self, now: Instant) -> Result<(), StoreError> {
        let pause = ASK_EVERY.max(self.hearing_takes * ASK_TIMES);
        let mut shared: Vec<&mut Kept> = self.folders.iter_mut().filter(|kept| kept.is_kept && kept.folder.is_shared).collect();
        if shared.is_empty() || !is_due(self.heard, now, pause) {
            return Ok(());
        }
        self.heard = Some(now);
        let kinds = Kind::ALL.into_iter().filter(|kind| kind.is_live()).collect();
        let live = self.context.store.list(&Query { kinds, ..Query::default() })?;
        shared.iter_mut().try_for_each(|kept| kept.hear_of_ends(&self.context, &live, now))?;
        self.hearing_takes = self.context.world.steady().duration_since(now);
        Ok(())
    }
}

fn is_due(then: Option<Instant>, now: Instant, every: Duration) -> bool {
    then.is_none_or(|then| now.duration_since(then) >= every)
}

impl Kept {
    /// Does this daemon begin to keep the folder? It asks now and then, as long as another one does.
    fn begins_to_keep(&mut self, context: &Context, now: Instant) -> bool {
        let kept = self.is_kept;
        if kept && self.folder.keeps() {
            return false;
        }
        self.is_kept = !self.folder.is_shared;
        let (may, is_due) = (self.folder.is_shared && context.has(Role::Intake), is_due(self.asked, now, LOOK_FOR));
        // No other folder waits for a share that hangs.
        let asks = may && is_due && self.folder.answers() == Answer::Yes;
        if asks {
            self.asked = Some(now);
            self.is_kept = self.folder.try_keep();
        }
        if !self.is_kept && (asks || !may) && !std::mem::replace(&mut self.is_told, true) {
            tracing::info!(folder = %self.folder.root.display(), "Another daemon looks for drops in the shared folder.");
        }
        if self.is_kept && self.folder.is_shared {
            tracing::info!(folder = %self.folder.root.display(), "This daemon keeps the shared folder: it looks for drops.");
            (self.dirty, self.cleared) = (true, None);
            self.answering.clear();
            // The one that kept it before is gone, and with it whoever sent it files.
            uploads::clear(&self.folder);
        }
        self.is_kept && !kept
    }

    /// Looks whether a folder that another daemon keeps is in reach.
    pub(super) fn visit(&mut self, context: &Context, now: Instant, here: Result<(), String>) -> Result<(), StoreError> {
        match here {
            Ok(()) => {
                self.looked_at(context, now, Vec::new());
                self.is_back(context);
                Ok(())
            }
            Err(why) => self.tell_away(context, now, why),
        }
    }

    /// A file that lies in `in/` while its job has ended elsewhere, and answers for it no longer, is a new drop. Orders with jobs that live are summed up
    /// once more.
    fn hear_of_ends(&mut self, context: &Context, all: &[Job], now: Instant) -> Result<(), StoreError> {
        let mut live = BTreeSet::new();
        for job in all.iter().filter(|job| job.source.folder == self.folder.name) {
            self.orders.came(&job.source.path, job.id, now);
            live.insert(job.id);
        }
        for (path, id) in self.reconciler.with_jobs() {
            if live.contains(&id) || self.answering.contains(&id) {
                continue;
            }
            match context.store.get(id)? {
                Some(job) if job.kind().is_live() => {}
                Some(job) if job.answers_for_source() => drop(self.answering.insert(id)),
                _ => {
                    self.reconciler.ended(&path);
                    self.orders.ended(&path, id, now);
                    self.dirty = true;
                }
            }
        }
        Ok(())
    }

    /// Clears away now and then what dead workers left in a shared folder.
    fn clear(&mut self, context: &Context, now: Instant) -> Result<(), StoreError> {
        if !self.is_kept || !self.folder.is_shared || !is_due(self.cleared, now, CLEAR_EVERY) {
            return Ok(());
        }
        if self.folder.answers() == Answer::Yes && self.folder.check().is_ok() {
            self.cleared = Some(now);
            clear(context, &self.folder)?;
        }
        Ok(())
    }
}

/// Jobs of earlier lives whose files still wait in `in/`.
fn remember_live(context: &Context, new: &mut [&mut Kept]) -> Result<(), StoreError> {
    let kinds = Kind::ALL.into_iter().filter(|kind| kind.is_live()).collect();
    for job in context.store.list(&Query { kinds, ..Query::default() })? {
        if let Some(kept) = new.iter_mut().find(|kept| kept.folder.name == job.source.folder)
            && job.original().0 == Area::In
        {
            kept.reconciler.known(&job.source, job.id, Some(job.priority));
        }
    }
    Ok(())
}

/// Files that were noticed in an earlier life and are gone now.
fn forget_noticed(context: &Context, new: &[&mut Kept]) -> Result<(), StoreError> {
    for job in context.store.list(&Query { kinds: vec![Kind::Noticed], ..Query::default() })? {
        if let Some(kept) = new.iter().find(|kept| kept.folder.name == job.source.folder)
            && kept.folder.check().is_ok()
            && fsx::is_folder(&kept.folder.inbox()).is_ok_and(|there| there)
            && fsx::exists(&kept.folder.inbox().join(job.source.path.to_path())).is_ok_and(|there| !there)
        {
            control(context, job.id, Control::Forget)?;
        }
    }
    Ok(())
}
