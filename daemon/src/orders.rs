//! Orders: the files of one sub-folder of `in/` belong together (`in/order-123/`, with all that is below it; in a sub-folder that chooses a
//! profile, the one below: `in/scan/order-123/`). When all of them are done, and nothing comes any more, one [`summary`] tells what became
//! of each; when another file comes later, it is made anew.
//!
//! An order is *pending* from the first change of one of its jobs until its summary is durable. Which transitions of the store are in
//! summaries is marked in `.suture/orders` whenever none is pending, so that the next life of a daemon makes those that this one did not come to.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use suture_store::{Job, JobId, JobStore, RelPath, Seq, StoreError};

use crate::folder::Folder;
use crate::settings::Settings;
use crate::{create, force, fsx};
use summary::Summary;

pub(crate) mod summary;

/// Of more orders than this, those that are done are not kept in memory.
const MOST: usize = 10_000;

/// The orders of a hot folder.
pub(crate) struct Orders {
    folder: Arc<Folder>,
    settings: Arc<Settings>,
    /// Jobs of each.
    members: BTreeMap<RelPath, BTreeSet<JobId>>,
    /// Those without a summary of what is so now, and since when nothing has changed.
    pending: BTreeMap<RelPath, Instant>,
    /// Of those, whose summary could not be written; said once.
    stuck: BTreeSet<RelPath>,
    /// All transitions up to this one are in summaries.
    mark: Seq,
    /// The last transition that was seen.
    seen: Seq,
}

impl Orders {
    pub(crate) fn new(folder: Arc<Folder>, settings: Arc<Settings>) -> Self {
        // Of a folder that is away, every order is summed up once more, and says the same.
        let mark = folder.check().map_or(Seq(0), |()| read_mark(&mark_of(&folder)));
        let (members, pending) = (BTreeMap::new(), BTreeMap::new());
        Self { folder, settings, members, pending, stuck: BTreeSet::new(), mark, seen: mark }
    }

    /// The order of a file: the first sub-folder, or the second if the first one's name is a profile's.
    fn order_of(&self, path: &RelPath) -> Option<RelPath> {
        let path = force::without(&path.to_path());
        let mut parts = path.parent()?.components();
        let first = Path::new(parts.next()?.as_os_str());
        let config = self.settings.now();
        let is_profile = first.to_str().is_some_and(|name| config.profile(name).is_some());
        let order = if is_profile { first.join(parts.next()?) } else { first.to_owned() };
        RelPath::from_path(&order).ok()
    }

    /// A job of an earlier life.
    pub(crate) fn remember(&mut self, job: &Job, now: Instant) {
        if let Some(order) = self.order_of(&job.source.path) {
            self.members.entry(order.clone()).or_default().insert(job.id);
            if job.seq > self.mark {
                self.pending.insert(order, now);
            }
            self.seen = self.seen.max(job.seq);
        }
    }

    /// A file has a job now.
    pub(crate) fn came(&mut self, path: &RelPath, id: JobId, now: Instant) {
        if let Some(order) = self.order_of(path) {
            self.members.entry(order.clone()).or_default().insert(id);
            self.pending.insert(order, now);
        }
    }

    /// The job of a file ended.
    pub(crate) fn ended(&mut self, path: &Path, id: JobId, now: Instant) {
        if let Ok(path) = RelPath::from_path(path) {
            self.came(&path, id, now);
        }
    }

    /// Sums up the orders that are done, and of which nothing changed for `rest`. `is_settling`: is a file below this folder of `in/` on its
    /// way?
    ///
    /// # Errors
    /// Store errors only.
    pub(crate) fn sum_up(
        &mut self,
        store: &dyn JobStore,
        now: Instant,
        rest: Duration,
        is_settling: &dyn Fn(&Path) -> bool,
    ) -> Result<(), StoreError> {
        let due = |since: &Instant| now.duration_since(*since) >= rest;
        let orders: Vec<_> = self.pending.iter().filter(|(_, since)| due(since)).map(|(order, _)| order.clone()).collect();
        for order in orders {
            if !is_settling(&order.to_path()) && self.is_summed_up(store, &order)? {
                self.pending.remove(&order);
                self.stuck.remove(&order);
            } else {
                self.pending.insert(order, now);
            }
        }
        if self.members.len() > MOST {
            // Summaries on the disk tell of their files; what comes later is added.
            self.members.retain(|order, _| self.pending.contains_key(order));
        }
        if self.pending.is_empty() && self.seen > self.mark && self.folder.check().is_ok() {
            match write_mark(&mark_of(&self.folder), self.seen) {
                Ok(()) => self.mark = self.seen,
                // Summaries are made once more, and say the same.
                Err(error) => tracing::debug!(%error, "How far orders are summed up could not be noted."),
            }
        }
        Ok(())
    }

    /// `false`: something of it is to be done still, or the summary cannot be written now.
    fn is_summed_up(&mut self, store: &dyn JobStore, order: &RelPath) -> Result<bool, StoreError> {
        let Some(members) = self.members.get_mut(order) else { return Ok(true) };
        let (mut jobs, mut forgotten) = (Vec::new(), BTreeSet::new());
        for id in members.iter() {
            match store.get(*id)? {
                Some(job) if job.kind().is_live() => return Ok(false),
                Some(job) => jobs.push(job),
                None => {
                    forgotten.insert(*id);
                }
            }
        }
        members.retain(|id| !forgotten.contains(id));
        self.seen = jobs.iter().map(|job| job.seq).max().unwrap_or_default().max(self.seen);
        let Some(summary) = Summary::of(&self.folder.name, order, &jobs) else { return Ok(true) };
        let known: BTreeSet<u64> = jobs.iter().map(|job| job.id.0).collect();
        let put = self
            .folder
            .check()
            .and_then(|()| summary.put(&self.folder, &|id| known.contains(&id)).map_err(|error| error.to_string()));
        match put {
            Ok((summary, path, true)) => tell(order, &summary, &path),
            Ok(_) => {}
            Err(error) => {
                if self.stuck.insert(order.clone()) {
                    tracing::warn!(%order, error, "The summary of an order cannot be written; it is tried again.");
                }
                return Ok(false);
            }
        }
        Ok(true)
    }
}

fn tell(order: &RelPath, summary: &Summary, path: &Path) {
    let (summed, path) = (summary.words(), path.display());
    if summary.is_good() {
        tracing::info!(%order, summary = summed, report = %path, "An order is done.");
    } else {
        tracing::warn!(%order, summary = summed, report = %path, "An order is done, and not all of it is good.");
    }
}

fn mark_of(folder: &Folder) -> PathBuf {
    folder.root.join(".suture").join("orders")
}

/// Forgets which transitions are in summaries: they were another store's.
///
/// # Errors
/// As `unlink`.
pub(crate) fn forget_mark(folder: &Folder) -> io::Result<()> {
    fsx::remove_if_there(&mark_of(folder))
}

/// Nothing, where none can be read: then all orders are looked at.
fn read_mark(path: &Path) -> Seq {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    Seq(text.trim().parse().unwrap_or(0))
}

fn write_mark(path: &Path, seq: Seq) -> io::Result<()> {
    create::replace(path, format!("{seq}\n").as_bytes())?;
    fsx::sync_dir(fsx::folder_of(path))
}

#[cfg(test)]
mod tests {
    use suture_store::{Control, Filter, MemoryStore, Priority, Seen, Source, Step, Submission, SystemClock};

    use super::*;
    use crate::config::{Config, FolderConfig};

    fn orders_at(root: &Path) -> Orders {
        let folder = Folder::open(&FolderConfig { name: "hot".into(), ..FolderConfig::of(root) }, None).unwrap();
        Orders::new(Arc::new(folder), Arc::new(Settings::fixed(Config::for_folder(root))))
    }

    fn submit(store: &MemoryStore, path: &str) -> (RelPath, JobId) {
        let path = RelPath::new(path).unwrap();
        let (folder, profile, ino) = ("hot".into(), "default".into(), path.as_bytes().len() as u64);
        let source = Source { folder, path: path.clone(), dev: 1, ino, size: 84, mtime_ns: 1, profile };
        let id =
            store.submit(&[Submission { source, foreign: None, priority: Priority::default(), seen: Seen::Now }]).unwrap()[0].id;
        (path, id)
    }

    fn finish(store: &MemoryStore) {
        let claim = store.claim(&Filter::default()).unwrap().unwrap();
        let publication = summary::tests::publication(claim.job.source.path.clone(), suture_store::Ending::Clean);
        for step in [Step::Intend(publication), Step::Placed, Step::Finished] {
            store.advance(&claim, step).unwrap();
        }
    }

    const REST: Duration = Duration::from_secs(5);

    #[test]
    fn the_order_is_the_first_folder_that_is_no_profile() {
        let dir = tempfile::tempdir().unwrap();
        let orders = orders_at(dir.path());
        let order = |path: &str| orders.order_of(&RelPath::new(path).unwrap()).map(|order| order.to_string());
        for (path, expected) in [
            ("a.stl", None),
            ("order/a.stl", Some("order")),
            ("order/deep/a.stl", Some("order")),
            ("scan/a.stl", None),
            ("scan/order/deep/a.stl", Some("scan/order")),
        ] {
            assert_eq!(order(path).as_deref(), expected, "{path}");
        }
    }

    #[test]
    fn an_order_is_summed_up_when_all_is_done_and_quiet() {
        let dir = tempfile::tempdir().unwrap();
        let store = MemoryStore::new(Arc::new(SystemClock));
        let mut orders = orders_at(dir.path());
        let summed = || dir.path().join("out/order/order.report.json").exists();
        let start = Instant::now();
        for path in ["order/a.stl", "order/bc.stl"] {
            let (path, id) = submit(&store, path);
            orders.came(&path, id, start);
        }
        let look = |store: &MemoryStore, orders: &mut Orders, seconds: u64, settling: bool| {
            orders.sum_up(store, start + Duration::from_secs(seconds), REST, &|_| settling).unwrap();
            summed()
        };
        finish(&store);
        assert!(!look(&store, &mut orders, 10, false), "one waits still");
        finish(&store);
        orders.ended(Path::new("order/bc.stl"), JobId(2), start + Duration::from_secs(11));
        assert!(!look(&store, &mut orders, 15, false), "not quiet for long enough");
        assert!(!look(&store, &mut orders, 17, true), "another one is on its way");
        assert!(look(&store, &mut orders, 30, false));
        // The next life makes what this one did not come to, and no more.
        std::fs::remove_file(dir.path().join("out/order/order.report.json")).unwrap();
        drop(orders);
        for again in [false, true] {
            let mut next = orders_at(dir.path());
            if again {
                let (_, id) = submit(&store, "order/def.stl");
                store.control(id, Control::Cancel).unwrap();
            }
            store.list(&suture_store::Query::default()).unwrap().iter().for_each(|job| next.remember(job, start));
            assert_eq!(look(&store, &mut next, 60, false), again);
        }
    }
}
