//! A job as it is shown to programs: what it is, where it stands, and what it has left. The names and words stay as they are.

use jiff::Timestamp;
use serde::Serialize;
use suture_store::job::Withdrawal;
use suture_store::{Decision, Ending, Hash, Job, JobId, Kind, Priority, State, Time, Verdict};

use crate::event_bus::{Bus, Progress};

/// A job.
#[derive(Serialize)]
pub(crate) struct Shown {
    id: JobId,
    state: &'static str,
    folder: String,
    /// Below the folder's `in/`.
    file: String,
    profile: String,
    priority: Priority,
    /// Bytes of the dropped file.
    size: u64,
    attempts: u32,
    submitted: String,
    changed: String,
    /// An operator wants it stopped, and it is still in work.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    stopping: bool,
    /// How far a job in work is, once it says so.
    #[serde(skip_serializing_if = "Option::is_none")]
    progress: Option<Progress>,
    /// It is tried again then.
    #[serde(skip_serializing_if = "Option::is_none")]
    not_before: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ending: Option<Ending>,
    /// A line for people.
    #[serde(skip_serializing_if = "String::is_empty")]
    reason: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    result: Option<Left>,
    /// The job of whose result its own is a copy.
    #[serde(skip_serializing_if = "Option::is_none")]
    reused: Option<JobId>,
    /// What a person said of a result that needed review.
    #[serde(skip_serializing_if = "Option::is_none")]
    decision: Option<Said>,
}

/// A person's decision.
#[derive(Serialize)]
struct Said {
    verdict: Verdict,
    by: String,
    #[serde(skip_serializing_if = "String::is_empty")]
    note: String,
    at: String,
}

impl From<&Decision> for Said {
    fn from(said: &Decision) -> Self {
        Self { verdict: said.verdict, by: said.by.clone(), note: said.note.clone(), at: when(said.at) }
    }
}

/// The mesh that a job has left.
#[derive(Serialize)]
struct Left {
    /// Below the folder's `out/` where it is good.
    name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    blake3: Option<Hash>,
}

impl From<&Job> for Shown {
    fn from(job: &Job) -> Self {
        let ended = match &job.state {
            State::Ended { publication } => Some(publication),
            _ => None,
        };
        let left = ended.and_then(|publication| {
            Some(Left { name: publication.output.as_ref()?.to_string(), blake3: publication.output_hash })
        });
        Self {
            id: job.id,
            state: job.kind().name(),
            folder: job.source.folder.clone(),
            file: job.source.path.to_string(),
            profile: job.source.profile.clone(),
            priority: job.priority,
            size: job.source.size,
            attempts: job.attempts.0,
            submitted: when(job.submitted),
            changed: when(job.changed),
            stopping: matches!(job.state, State::Running { cancel: true, .. }),
            progress: None,
            not_before: job.pause().map(when),
            ending: ended.map(|publication| publication.ending),
            reason: reason(job),
            result: left,
            reused: ended.and_then(|publication| publication.reused),
            decision: job.decision().map(Said::from),
        }
    }
}

impl Shown {
    /// With what is known of work that goes on.
    pub(crate) fn now(job: &Job, bus: &Bus) -> Self {
        let progress = bus.progress_of(job.id).filter(|_| job.kind() == Kind::Running);
        Self { progress, ..Self::from(job) }
    }
}

/// Why it stands where it stands: a line for people, empty where there is nothing to say.
pub(crate) fn reason(job: &Job) -> String {
    match &job.state {
        State::Noticed { reason } => reason.clone(),
        State::Ended { publication } => publication.reason.clone(),
        State::Cancelled { why } => match why {
            Withdrawal::Operator => "by an operator".into(),
            Withdrawal::Changed => "the file changed; it is a new job".into(),
            Withdrawal::Vanished => "the file is gone".into(),
        },
        _ => job.note.clone(),
    }
}

/// The note on a good result, for a person to read before it is printed.
pub(crate) fn hint(job: &Job) -> Option<&str> {
    let State::Ended { publication } = &job.state else { return None };
    Some(publication.reason.as_str())
        .filter(|reason| publication.output.is_some() && publication.ending.is_good() && !reason.is_empty())
}

/// Day and time as RFC 3339 writes them, in UTC.
pub(crate) fn when(time: Time) -> String {
    let stamp = i64::try_from(time.0).ok().and_then(|ms| Timestamp::from_millisecond(ms).ok());
    stamp.unwrap_or(Timestamp::UNIX_EPOCH).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use suture_store::{RelPath, Source};

    #[test]
    fn a_job_that_waits_says_little() {
        let source = Source {
            folder: "hot".into(),
            path: RelPath::new(*b"a\nb.stl").unwrap(),
            dev: 1,
            ino: 2,
            size: 84,
            mtime_ns: 4,
            profile: "default".into(),
        };
        let job = Job::queued(JobId(7), source, Time(1_700_000_000_123));
        let shown = serde_json::to_value(Shown::from(&job)).unwrap();
        let expected = serde_json::json!({
            "id": 7, "state": "queued", "folder": "hot", "file": "a%0Ab.stl", "profile": "default", "priority": 5, "size": 84,
            "attempts": 0, "submitted": "2023-11-14T22:13:20.123Z", "changed": "2023-11-14T22:13:20.123Z",
        });
        assert_eq!(shown, expected);
    }
}
