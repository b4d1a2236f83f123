//! From one store into another: all that a store holds, as lines of JSON, so that a farm can begin on one machine, grow, and shrink again.
//!
//! The first line is the head, the last one says how many lines there were and what their checksum is: a file that was cut short is refused.
//! Claims do not go over: whoever held a job in the old store is taken for dead in the new one ([`crate::JobStore::recover`]). So the old store
//! is to be at rest.

use std::collections::BTreeMap;
use std::io::{self, BufRead, Write};

use serde::{Deserialize, Serialize};

use crate::id::{Epoch, JobId, Seq, Time};
use crate::job::{Job, State};
use crate::news::{Notice, Word};
use crate::store::{JobStore, StoreError};

/// Of the lines.
const VERSION: u32 = 1;

/// What there is one of in a store.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Marks {
    /// The last job's number.
    pub last_job: JobId,
    /// The last transition that counts: no later one has its number.
    pub seq: Seq,
    /// As [`crate::JobStore::is_unfilled`].
    pub unfilled: bool,
    /// As [`crate::JobStore::last_night`].
    pub night: Option<Time>,
    /// Folders that are out of reach, and since when that was told.
    pub away: BTreeMap<String, Time>,
    /// Who subscribes, and the last transition that each has heard of.
    pub subscribers: BTreeMap<String, Seq>,
}

/// All that a store holds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Holdings {
    /// What there is one of.
    pub marks: Marks,
    /// By number.
    pub jobs: Vec<Job>,
    /// What someone has not heard yet, the oldest first.
    pub notices: Vec<Notice>,
}

/// A store that can be moved out of, and into.
pub trait Transfer {
    /// All that it holds, at one moment.
    ///
    /// # Errors
    /// Store errors only.
    fn holdings(&self) -> Result<Holdings, StoreError>;

    /// Takes all of it over, with its numbers. Where that was cut short, the store is to be thrown away.
    ///
    /// # Errors
    /// [`StoreError::Unusable`] when it holds jobs already: nothing is taken over then.
    fn take_over(&self, holdings: &Holdings) -> Result<(), StoreError>;
}

/// A store that many may have open at a time, as whoever only looks at it sees it.
pub trait SharedStore: JobStore + Transfer {
    /// Looks at every row; a line for each that is damaged, or says something else than its record. Others may go on meanwhile.
    ///
    /// # Errors
    /// Where the database cannot be read, or holds a record of a newer version. A damaged record is a finding, not an error.
    fn verify(&self) -> Result<Vec<String>, StoreError>;
}

/// What goes wrong with a transfer.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says it")]
pub enum TransferError {
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error("the export could not be read or written: {0}")]
    Io(#[from] io::Error),
    #[error("line {line} of the export cannot be understood: {source}")]
    Line { line: usize, source: serde_json::Error },
    #[error("the export has version {found}; this program knows version {VERSION}")]
    Version { found: u32 },
    #[error("the export is not whole: {0}")]
    Torn(&'static str),
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Line {
    Store { version: u32, marks: Marks },
    Job(Box<Job>),
    EndedJob(Box<Job>),
    News(Word),
    End { lines: usize, crc32: u32 },
}

/// Writes all that the store holds; how many jobs.
///
/// # Errors
/// What keeps the store from being read, or the lines from being written.
pub fn export(store: &dyn Transfer, to: &mut dyn Write) -> Result<usize, TransferError> {
    let Holdings { marks, jobs, notices } = store.holdings()?;
    let (mut lines, mut crc) = (0, crc32fast::Hasher::new());
    let count = jobs.len();
    let notices = notices.into_iter().map(|notice| match notice {
        Notice::End(job) => Line::EndedJob(job),
        Notice::Word(word) => Line::News(word),
    });
    let jobs = jobs.into_iter().map(|job| Line::Job(Box::new(job)));
    for line in [Line::Store { version: VERSION, marks }].into_iter().chain(jobs).chain(notices) {
        let mut text = serde_json::to_vec(&line).map_err(io::Error::from)?;
        text.push(b'\n');
        crc.update(&text);
        lines += 1;
        to.write_all(&text)?;
    }
    let mut text = serde_json::to_vec(&Line::End { lines, crc32: crc.finalize() }).map_err(io::Error::from)?;
    text.push(b'\n');
    to.write_all(&text)?;
    to.flush()?;
    Ok(count)
}

/// Reads what [`export`] wrote.
///
/// # Errors
/// When it is not whole, or of another version.
pub fn read(from: &mut dyn BufRead) -> Result<Holdings, TransferError> {
    let (mut holdings, mut lines, mut crc) = (Holdings::default(), 0, crc32fast::Hasher::new());
    let mut text = Vec::new();
    while from.read_until(b'\n', &mut text)? > 0 {
        let line = serde_json::from_slice(&text).map_err(|source| TransferError::Line { line: lines + 1, source })?;
        match line {
            Line::Store { version, .. } if version != VERSION => return Err(TransferError::Version { found: version }),
            Line::Store { marks, .. } if lines == 0 => holdings.marks = marks,
            Line::End { lines: told, crc32 } => {
                let is_whole = told == lines && crc32 == crc.finalize() && lines > 0;
                return if is_whole { Ok(holdings) } else { Err(TransferError::Torn("its checksum is wrong")) };
            }
            _ if lines == 0 => return Err(TransferError::Torn("it does not begin as one")),
            Line::Store { .. } => return Err(TransferError::Torn("it begins twice")),
            Line::Job(job) => holdings.jobs.push(*job),
            Line::EndedJob(job) => holdings.notices.push(Notice::End(job)),
            Line::News(word) => holdings.notices.push(Notice::Word(word)),
        }
        crc.update(&text);
        lines += 1;
        text.clear();
    }
    Err(TransferError::Torn("its end is missing"))
}

/// Has the store take over what [`export`] wrote; how many jobs.
///
/// # Errors
/// As [`read`] and [`Transfer::take_over`]; then nothing was taken over, or the store is to be thrown away.
pub fn import(store: &dyn Transfer, from: &mut dyn BufRead) -> Result<usize, TransferError> {
    let holdings = read(from)?;
    store.take_over(&holdings)?;
    Ok(holdings.jobs.len())
}

/// What the store holds otherwise than `expected` says, a line each: nothing right after an import.
///
/// # Errors
/// Store errors only.
pub fn differences(store: &dyn Transfer, expected: &Holdings) -> Result<Vec<String>, StoreError> {
    let found = store.holdings()?;
    let mut lines = Vec::new();
    let marks = |marks: &Marks| Marks { seq: Seq(0), ..marks.clone() };
    if marks(&found.marks) != marks(&expected.marks) || found.marks.seq < expected.marks.seq {
        lines.push("what there is one of differs".to_owned());
    }
    let by_number = |holdings: &Holdings| holdings.jobs.iter().map(|job| (job.id, orphaned(job))).collect::<BTreeMap<_, _>>();
    let (found_jobs, mut expected_jobs) = (by_number(&found), by_number(expected));
    for (id, job) in found_jobs {
        match expected_jobs.remove(&id) {
            None => lines.push(format!("job {id} is there, and should not be")),
            Some(expected) if expected != job => lines.push(format!("job {id} differs")),
            Some(_) => {}
        }
    }
    lines.extend(expected_jobs.into_keys().map(|id| format!("job {id} is missing")));
    if found.notices != expected.notices {
        lines.push("what is to be told differs".to_owned());
    }
    Ok(lines)
}

/// The job, held by a life before all others of the store.
pub(crate) fn orphaned(job: &Job) -> Job {
    let mut job = job.clone();
    match &mut job.state {
        State::Running { hold, .. }
        | State::Concluded { hold, .. }
        | State::Approved { hold, .. }
        | State::Publishing { hold, .. }
        | State::Published { hold, .. } => hold.epoch = Epoch(0),
        State::Noticed { .. } | State::Queued { .. } | State::Ended { .. } | State::Cancelled { .. } => {}
    }
    job
}

/// The largest number that a claim or a transition of these had: those to come are larger.
pub(crate) fn last_number(holdings: &Holdings) -> Seq {
    let of_job = |job: &Job| job.seq.max(Seq(job.work_token().0)).max(Seq(job.hold().map_or(0, |hold| hold.token.0)));
    let jobs = holdings.jobs.iter().map(of_job);
    let notices = holdings.notices.iter().map(Notice::seq);
    jobs.chain(notices).chain([holdings.marks.seq]).max().unwrap_or_default()
}

/// The error for a store that is no empty one.
pub(crate) fn not_empty() -> StoreError {
    StoreError::Unusable {
        path: "the store that is to take over".into(),
        reason: "it holds jobs, or something to be told, already".into(),
        advice: "begin with an empty one".into(),
    }
}
