//! How the daemon stands, at a glance: what it does, what came last, what a person should look at, and what keeps it from work.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError};

use serde::{Deserialize, Serialize};
use suture_store::{Host, Job, JobId, JobStore, Kind, Look, Query, Roles, StoreError, Time};

use crate::attempt::Context;
use crate::course::show_whole;
use crate::folder::Folder;
use crate::hosts;
use crate::say::plain;
use crate::schedule::{Hold, Standing};
use crate::units::{show_count, show_when};

/// So many jobs of a sort are named.
const NAMED: usize = 5;
/// What ended last is looked for among so many that came last.
const LATEST: usize = 50;

/// A daemon, or the store of one that does not run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Glance {
    pub version: String,
    /// The daemon's life began then; `None`: none runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub since: Option<Time>,
    pub ready: bool,
    /// Why not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    #[serde(flatten)]
    pub standing: Standing,
    /// How many jobs there are of each kind.
    pub jobs: BTreeMap<Kind, u64>,
    /// Jobs in work.
    pub work: Vec<Work>,
    /// What ended last, the latest first.
    pub last: Vec<Job>,
    /// What a person should look at, the latest first.
    pub review: Vec<Job>,
    pub folders: Vec<Served>,
    pub store_bytes: u64,
    /// The parts of the work that this daemon does.
    #[serde(default)]
    pub roles: Roles,
    /// The daemons that share its store, if others can.
    #[serde(default)]
    pub hosts: Vec<Host>,
}

/// A job in work.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Work {
    pub job: JobId,
    pub folder: String,
    pub file: String,
    pub kind: Kind,
    /// Bytes of the file.
    pub size: u64,
    pub seconds: u64,
    /// As the engine calls it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stage: Option<String>,
    /// The work of this moment, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub doing: Option<String>,
    /// Of the whole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub percent: Option<u8>,
    /// About so many are left.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seconds_left: Option<u64>,
}

impl Work {
    /// How far it is, in words.
    pub(crate) fn words(&self) -> String {
        let doing = match (&self.doing, self.percent) {
            (Some(doing), Some(percent)) => format!("{}, {percent} %", plain(doing)),
            _ => self.kind.name().into(),
        };
        let left = self.seconds_left.map(|left| format!(", about {} left", show_whole(left as f64))).unwrap_or_default();
        format!("{doing}, for {}{left}", show_whole(self.seconds as f64))
    }
}

/// A hot folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Served {
    pub name: String,
    pub path: PathBuf,
    pub reachable: bool,
    /// Bytes that results may still fill; of a folder out of reach nobody knows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub free_bytes: Option<u64>,
}

impl Glance {
    /// Of a daemon that runs.
    ///
    /// # Errors
    /// When the store failed.
    pub(crate) fn of(context: &Context) -> Result<Self, StoreError> {
        let (store, config) = (&context.store, context.settings.now());
        let (reason, hosts) = (unready(context), store.hosts()?);
        let held = Kind::ALL.into_iter().filter(|kind| kind.is_held()).collect();
        let of = |kinds, limit| Ok::<_, StoreError>(store.page(&Look { kinds, limit, ..Look::default() })?.jobs);
        Ok(Self {
            version: env!("CARGO_PKG_VERSION").into(),
            since: Some(Time(context.bus.life)),
            ready: reason.is_none(),
            reason,
            standing: standing_among(context, &hosts)?,
            jobs: counts(context)?,
            work: store.list(&Query { kinds: held, ..Query::default() })?.iter().map(|job| work(context, job)).collect(),
            last: latest(of(Kind::ALL.into_iter().filter(|kind| kind.is_at_rest()).collect(), LATEST)?),
            review: of(vec![Kind::NeedsReview], NAMED)?,
            folders: folders(context),
            store_bytes: size_of(&config.state),
            roles: config.roles,
            hosts,
        })
    }

    /// Of these jobs, of a store that no daemon has; of a shared one no room on a disk is known.
    pub(crate) fn of_jobs(mut jobs: Vec<Job>, held: Vec<String>, state: Option<&Path>) -> Self {
        let mut counts: BTreeMap<Kind, u64> = Kind::ALL.map(|kind| (kind, 0)).into();
        jobs.iter().for_each(|job| *counts.entry(job.kind()).or_default() += 1);
        jobs.retain(|job| job.kind().is_at_rest());
        jobs.reverse();
        let review = jobs.iter().filter(|job| job.kind() == Kind::NeedsReview).take(NAMED).cloned().collect();
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            standing: Standing { held, ..Standing::default() },
            jobs: counts,
            last: latest(jobs.into_iter().take(LATEST).collect()),
            review,
            store_bytes: state.map_or(0, size_of),
            ..Self::default()
        }
    }
}

fn latest(mut jobs: Vec<Job>) -> Vec<Job> {
    jobs.sort_by_key(|job| std::cmp::Reverse(job.changed));
    jobs.into_iter().take(NAMED).collect()
}

fn work(context: &Context, job: &Job) -> Work {
    let seconds = context.world.wall().0.saturating_sub(job.changed.0) / 1000;
    let progress = context.bus.progress_of(job.id).filter(|_| job.kind() == Kind::Running);
    Work {
        job: job.id,
        folder: job.source.folder.clone(),
        file: job.source.path.to_string(),
        kind: job.kind(),
        size: job.source.size,
        seconds,
        stage: progress.as_ref().map(|progress| progress.stage.clone()),
        doing: progress.as_ref().map(|progress| progress.doing.to_owned()),
        percent: progress.as_ref().map(|progress| progress.percent),
        seconds_left: progress.and_then(|_| context.bus.left(job.id, seconds)),
    }
}

/// How many jobs there are of each kind.
///
/// # Errors
/// When the store failed.
pub(crate) fn counts(context: &Context) -> Result<BTreeMap<Kind, u64>, StoreError> {
    Ok(context.store.counts()?.into_iter().collect())
}

/// The hot folders, as they are now.
pub(crate) fn folders(context: &Context) -> Vec<Served> {
    let served = |folder: &Arc<Folder>| {
        let reachable = folder.check().is_ok();
        let free_bytes = reachable.then(|| context.room(folder)).filter(|room| *room < u64::MAX);
        Served { name: folder.name.clone(), path: folder.place().to_owned(), reachable, free_bytes }
    };
    context.folders.iter().map(served).collect()
}

/// What keeps the daemon from work.
///
/// # Errors
/// When the store failed.
pub(crate) fn standing(context: &Context) -> Result<Standing, StoreError> {
    standing_among(context, &context.store.hosts()?)
}

/// The same, where the daemons that share its store are known.
fn standing_among(context: &Context, hosts: &[Host]) -> Result<Standing, StoreError> {
    let away: Vec<String> = context.away.lock().unwrap_or_else(PoisonError::into_inner).values().flatten().cloned().collect();
    let mut full = Vec::new();
    // Where every disk is full, that is said already.
    if context.schedule.held(Hold::Disk).is_none() {
        let names = context.full.lock().unwrap_or_else(PoisonError::into_inner);
        let folders = context.folders.iter().filter(|folder| names.contains(&folder.name));
        full.extend(folders.map(|folder| format!("{}; nothing new is taken there", folder.nearly_full())));
    }
    let words = |(name, why): (String, String)| {
        let events = match context.store.backlog(&name)? {
            1 => "one event".to_owned(),
            more => format!("{} events", show_count(more)),
        };
        Ok(format!("the webhook `{name}` has not heard of {events}: {why}"))
    };
    let untold = context.pulse.all_troubles().into_iter().map(words).collect::<Result<_, StoreError>>()?;
    let folders: Vec<String> = context.folders.iter().map(|folder| folder.name.clone()).collect();
    let stranded = hosts::stranded(&*context.store, &hosts::or_this(hosts.to_vec(), context), &folders)?;
    Ok(Standing { away, full, untold, stranded, ..context.schedule.standing() })
}

/// That the job database does not answer, and since when, in words.
pub(crate) fn away(store: &dyn JobStore) -> Option<String> {
    store.away().map(|since| format!("the job database has not answered since {}", show_when(since.0)))
}

/// Why the daemon is not ready for files, in words.
pub(crate) fn unready(context: &Context) -> Option<String> {
    if context.pulse.is_ending() {
        return Some("the daemon ends".into());
    }
    if let Some(why) = away(&*context.store) {
        return Some(why);
    }
    if context.has_failed() || context.store.check().is_err() {
        return Some("the job store is to be opened again".into());
    }
    if let Some(folder) = context.folders.iter().find(|folder| context.pulse.scan_of(&folder.name).is_none()) {
        return Some(format!("the folder `{}` was not looked at yet", folder.name));
    }
    let away = context.away.lock().unwrap_or_else(PoisonError::into_inner);
    if context.folders.iter().all(|folder| folder.check().is_err() && away.get(&folder.name).is_some_and(|why| !why.is_empty())) {
        return Some("every folder is out of reach".into());
    }
    context.schedule.held(Hold::Disk)
}

/// Bytes of all files of a small folder.
pub(crate) fn size_of(folder: &Path) -> u64 {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let size = |entry: std::fs::DirEntry| match entry.metadata() {
        Ok(meta) if meta.is_dir() => size_of(&entry.path()),
        Ok(meta) => meta.len(),
        Err(_) => 0,
    };
    entries.map(size).sum()
}
