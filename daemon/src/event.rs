//! Events of jobs and folders: each thing that happens is one value, which writes its line of the log and counts in the metrics, so that the two never differ, and
//! which says what those who listen are told.

use serde_json::{Value, json};
use suture_core::Report;
use suture_core::report::Defects;
use suture_store::job::Death;
use suture_store::{Control, Ending, Job, JobId, Kind, Publication, State, Step, Submission};

use crate::event_metrics::{Count, Metrics, Timing};
use crate::sample::Compared;

/// Something that happened.
#[derive(Debug)]
pub(crate) enum Happening<'a> {
    /// A file was found, and has a job.
    Came { id: JobId, submission: &'a Submission },
    /// A worker has it.
    Began { job: &'a Job },
    /// The engine has made a result of it.
    Reported { report: &'a Report },
    /// It was computed for the second time, and compared with the first.
    Compared { job: &'a Job, compared: &'a Compared },
    /// It went on by this step, to where it stands now.
    Moved { job: &'a Job, step: &'a Step },
    /// An operator, or the daemon itself, wanted this of it.
    Wished { job: &'a Job, wish: &'a Control },
    /// Its record is gone.
    Forgotten { id: JobId },
    /// A target was told of an event.
    Delivered { parcel: Parcel<'a>, note: &'a str },
    /// It has not yet, after so many tries.
    NotDelivered { parcel: Parcel<'a>, why: &'a str, tries: u32 },
    /// It never will.
    GivenUp { parcel: Parcel<'a>, why: &'a str },
    /// A hot folder is out of reach.
    FolderAway { name: &'a str, root: &'a std::path::Path, why: &'a str },
    /// It is back.
    FolderBack { name: &'a str, root: &'a std::path::Path },
    /// The job store came back.
    StoreRecovered(Recovery<'a>),
}

/// From what the job store came back, and how.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Recovery<'a> {
    /// A kill had left half a snapshot of the database. The store itself has logged that.
    TornSnapshot,
    /// The database was damaged, and made anew from its own log, or from nothing where nothing had been in it. Logged by the store, too.
    Damage,
    /// It was lost, or kept aside: so many jobs came back from receipts in this folder.
    Receipts { folder: &'a std::path::Path, jobs: usize },
    /// A daemon ended in the midst of so many jobs.
    Unfinished { jobs: usize },
    /// `suture jobs rebuild` has put a new one in its place since the last daemon; the damaged one is here.
    Rebuilt { aside: &'a std::path::Path },
}

impl Recovery<'_> {
    const KINDS: [&'static str; 5] = ["torn_snapshot", "damage", "receipts", "unfinished", "rebuilt"];

    fn kind(self) -> &'static str {
        let [torn_snapshot, damage, receipts, unfinished, rebuilt] = Self::KINDS;
        match self {
            Self::TornSnapshot => torn_snapshot,
            Self::Damage => damage,
            Self::Receipts { .. } => receipts,
            Self::Unfinished { .. } => unfinished,
            Self::Rebuilt { .. } => rebuilt,
        }
    }

    fn log(self) {
        match self {
            Self::TornSnapshot | Self::Damage => {}
            Self::Receipts { folder, jobs } => {
                let folder = folder.display();
                tracing::info!(%folder, jobs, "The job store is a new one; what earlier ones knew was read from receipts.");
            }
            Self::Unfinished { jobs } => tracing::info!(jobs, "The daemon ended without finishing; its jobs go on."),
            Self::Rebuilt { aside } => {
                tracing::info!(aside = %aside.display(), "The job store was rebuilt since the last daemon; the damaged one is kept.");
            }
        }
    }
}

/// Counts from nothing what is rare, so that the first time is a change that alerts see.
pub(crate) fn begin(metrics: &Metrics) {
    for kind in Recovery::KINDS {
        metrics.add(Count::StoreRecoveries, &[("kind", kind)], 0);
    }
    for result in Compared::WORDS {
        metrics.add(Count::Samples, &[("result", result)], 0);
    }
}

/// Word of an event, on its way out.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parcel<'a> {
    /// Name of a webhook, or `on_done`.
    pub target: &'a str,
    pub event: &'static str,
    /// The job that it is of.
    pub job: Option<JobId>,
}

/// A word to those who listen: a name, and what there is to say.
pub(crate) type Told = (&'static str, Value);

impl Happening<'_> {
    /// Writes the line of the log, if there is one.
    pub(crate) fn log(&self) {
        match self {
            Self::Came { id, submission } => {
                if let Some(what) = &submission.foreign {
                    tracing::warn!(job = id.0, file = %submission.source.path, what, "Left where it is.");
                }
            }
            Self::Compared { job, compared } => log_compared(job, compared),
            Self::Moved { job, step } => log_moved(job, step),
            Self::Wished { job, wish } => {
                if matches!(wish, Control::Retry | Control::Cancel | Control::Rank(_) | Control::Decide(_)) {
                    tracing::info!(job = job.id.0, ?wish, "An operator's wish.");
                }
            }
            Self::FolderAway { root, why, .. } => {
                tracing::error!(folder = %root.display(), error = why, "The folder cannot be served for now.");
            }
            Self::StoreRecovered(how) => how.log(),
            Self::FolderBack { root, .. } => tracing::info!(folder = %root.display(), "The folder is back."),
            Self::Delivered { parcel: Parcel { target, event, job }, note } => {
                tracing::info!(job = number(job), event, target_name = target, note, "An event was told.");
            }
            Self::GivenUp { parcel: Parcel { target, event, job }, why } => {
                let job = number(job);
                tracing::error!(job, event, target_name = target, reason = why, "An event could not be told; it is given up.");
            }
            // Said once; metrics and `suture jobs list` tell of it for as long as it lasts.
            Self::NotDelivered { parcel: Parcel { target, event, job }, why, tries: 1 } => {
                let job = number(job);
                tracing::warn!(job, event, target_name = target, reason = why, "An event could not be told; it is tried again.");
            }
            Self::Began { .. } | Self::Reported { .. } | Self::Forgotten { .. } | Self::NotDelivered { .. } => {}
        }
    }

    /// Counts.
    pub(crate) fn count(&self, metrics: &Metrics) {
        match self {
            Self::Began { job } if matches!(job.state, State::Running { .. }) => {
                metrics.add(Count::JobAttempts, &[], 1);
                let waited = job.changed.0.saturating_sub(job.waits_since().0);
                metrics.observe(Timing::JobDuration, &[("stage", "queue")], waited as f64 / 1000.0);
            }
            Self::Reported { report } => count_report(metrics, report),
            Self::Compared { compared, .. } => metrics.add(Count::Samples, &[("result", compared.word())], 1),
            Self::Moved { job, step } => {
                if let Some(reason) = failure(step) {
                    metrics.add(Count::JobFailures, &[("reason", reason)], 1);
                }
                if let State::Ended { publication } = &job.state {
                    count_ended(metrics, job, publication);
                }
            }
            Self::Delivered { parcel, .. } => count_parcel(metrics, parcel, "delivered"),
            Self::NotDelivered { parcel, .. } => count_parcel(metrics, parcel, "retried"),
            Self::GivenUp { parcel, .. } => count_parcel(metrics, parcel, "given_up"),
            Self::StoreRecovered(how) => metrics.add(Count::StoreRecoveries, &[("kind", how.kind())], 1),
            // Given up, when its result was in place already.
            Self::Wished { job, wish: Control::Cancel } => {
                if let State::Ended { publication } = &job.state {
                    count_ended(metrics, job, publication);
                }
            }
            _ => {}
        }
    }

    /// The word to listeners, if there is one.
    pub(crate) fn told(&self) -> Option<Told> {
        Some(match self {
            Self::Came { id, submission } => {
                let state = if submission.foreign.is_some() { Kind::Noticed } else { Kind::Queued };
                let source = &submission.source;
                ("job", json!({"job": id, "state": state.name(), "folder": source.folder, "file": source.path}))
            }
            Self::Began { job } | Self::Moved { job, .. } | Self::Wished { job, .. } => ("job", of_job(job)),
            Self::Forgotten { id } => ("forgotten", json!({"job": id})),
            Self::FolderAway { name, .. } => ("folder", json!({"folder": name, "reachable": false})),
            Self::FolderBack { name, .. } => ("folder", json!({"folder": name, "reachable": true})),
            Self::Reported { .. }
            | Self::Compared { .. }
            | Self::Delivered { .. }
            | Self::NotDelivered { .. }
            | Self::GivenUp { .. }
            | Self::StoreRecovered(_) => return None,
        })
    }
}

fn number(job: &Option<JobId>) -> Option<u64> {
    job.map(|job| job.0)
}

fn of_job(job: &Job) -> Value {
    let mut told = json!({"job": job.id, "state": job.kind().name(), "folder": job.source.folder, "file": job.source.path});
    if let (State::Ended { publication }, Some(told)) = (&job.state, told.as_object_mut()) {
        told.insert("ending".into(), json!(publication.ending));
        told.insert("reason".into(), json!(publication.reason));
    }
    told
}

/// Logs the comparison of a job that was computed twice.
fn log_compared(job: &Job, compared: &Compared) {
    let first = job.witness.as_ref().map(|witness| witness.daemon.as_str());
    let (job, result) = (job.id.0, compared.word());
    match compared {
        Compared::Equal => tracing::info!(job, result, first, "Computed twice: both results are the same."),
        Compared::Different(reason) => tracing::error!(job, result, first, reason, "Computed twice: the results differ."),
        Compared::OtherVersion => tracing::info!(job, result, first, "Computed twice, by two versions: nothing is compared."),
        Compared::Unlike => tracing::info!(job, result, first, "A second attempt cannot be compared with the first."),
    }
}

/// The end of an attempt, of a job, or of what was to be its end.
fn log_moved(job: &Job, step: &Step) {
    match &job.state {
        State::Ended { publication } if publication.ending == Ending::Skipped => {
            tracing::info!(ending = ?publication.ending, reason = publication.reason, "Skipped.");
        }
        State::Ended { publication } if publication.ending == Ending::Carried => {
            let output = publication.output.as_ref().map(tracing::field::display);
            tracing::info!(ending = ?publication.ending, output, reason = publication.reason, "Carried along with a mesh.");
        }
        State::Ended { publication } if publication.ending.is_good() => {
            let output = publication.output.as_ref().map(tracing::field::display);
            tracing::info!(ending = ?publication.ending, output, reused = publication.reused.map(|job| job.0), "Done.");
        }
        State::Ended { publication } => {
            tracing::warn!(ending = ?publication.ending, reason = publication.reason, "Ended without a good result.");
        }
        State::Cancelled { why } => tracing::info!(?why, "Taken back."),
        State::Queued { .. } => tracing::info!(reason = job.note, "Back in the queue."),
        // Said once; `suture jobs` tells of every further try.
        _ if matches!(step, Step::Park { .. }) && job.parked.is_some_and(|parked| parked.tries == 1) => {
            tracing::error!(reason = job.note, "The result cannot be brought into place; it is kept, and tried again.");
        }
        _ => {}
    }
}

/// Why an attempt came to nothing, in a word.
fn failure(step: &Step) -> Option<&'static str> {
    match step {
        Step::Died(death) => Some(match death {
            Death::TimeLimit => "timeout",
            Death::MemoryLimit => "memory",
            _ => "signal",
        }),
        Step::Environment { .. } => Some("io"),
        Step::Intend(publication) => match publication.ending {
            Ending::Unreadable => Some("parse"),
            Ending::Refused => Some("refused"),
            Ending::NameTaken => Some("name_taken"),
            Ending::NotGood => Some("verify"),
            _ => None,
        },
        _ => None,
    }
}

fn count_ended(metrics: &Metrics, job: &Job, publication: &Publication) {
    let result = match publication.ending {
        _ if publication.reused.is_some() => "reused",
        Ending::Clean => "ok",
        Ending::Skipped => "skipped",
        Ending::Carried => "carried",
        Ending::Repaired => "repaired",
        Ending::NeedsReview => "needs_review",
        Ending::Quarantined => "quarantined",
        Ending::NotGood | Ending::Unreadable | Ending::Refused | Ending::NameTaken | Ending::Environment => "failed",
    };
    let (folder, profile) = (job.source.folder.as_str(), job.source.profile.as_str());
    metrics.add(Count::JobsFinished, &[("folder", folder), ("profile", profile), ("result", result)], 1);
    if publication.ending != Ending::Carried {
        metrics.add(Count::InputBytes, &[], job.source.size);
    }
}

fn count_parcel(metrics: &Metrics, parcel: &Parcel<'_>, result: &str) {
    metrics.add(Count::Deliveries, &[("target", parcel.target), ("result", result)], 1);
}

fn count_report(metrics: &Metrics, report: &Report) {
    metrics.add(Count::Triangles, &[("direction", "in")], report.input.triangles);
    if let Some(output) = &report.output {
        metrics.add(Count::Triangles, &[("direction", "out")], output.triangles);
        metrics.add(Count::OutputBytes, &[], output.bytes);
    }
    for (kind, count) in defects(&report.before) {
        metrics.add(Count::DefectsFound, &[("kind", kind)], count);
    }
    for (kind, count) in report.after.iter().flat_map(defects) {
        metrics.add(Count::DefectsLeft, &[("kind", kind)], count);
    }
    for stage in &report.stages {
        metrics.observe(Timing::JobDuration, &[("stage", &stage.name)], stage.seconds);
    }
    metrics.observe(Timing::WorkerMaxRss, &[], report.cost.peak_resident_bytes as f64);
}

/// Kinds of defects, and how many there are.
fn defects(of: &Defects) -> [(&'static str, u64); 9] {
    [
        ("boundary_loop", of.boundary_loops),
        ("nonmanifold_edge", of.nonmanifold_edges),
        ("nonmanifold_vertex", of.nonmanifold_vertices),
        ("inconsistent_edge", of.inconsistent_edges),
        ("inverted_component", of.inverted_components),
        ("degenerate", of.degenerate_index + of.degenerate_area),
        ("duplicate", of.duplicates_same + of.duplicates_opposite),
        ("nonfinite", of.nonfinite),
        ("self_intersection", of.self_intersections.as_ref().map_or(0, |found| found.triangles)),
    ]
}
