//! The small files that stand beside a result: the receipt (which job made it, from what, into what), and the report of a file
//! for which the engine has none to give. With them the file system alone tells what was done, whatever becomes of the store.

use std::io::{self, BufReader};
use std::path::Path;

use serde::{Deserialize, Serialize};
use suture_core::Report;
use suture_core::report::SCHEMA_VERSION;
use suture_store::job::Area;
use suture_store::{Decision, Ending, Hash, Job, JobId, RelPath, Token};

use crate::create;

/// Appended to the result's name.
pub(crate) const RECEIPT: &str = ".suture.json";
/// Appended to the result's name.
pub(crate) const REPORT: &str = ".report.json";

/// What a job left.
#[derive(Debug, Serialize)]
pub(crate) struct Receipt<'a> {
    pub receipt_version: u32,
    pub job: u64,
    pub attempt: u32,
    pub epoch: u64,
    pub engine_version: &'a str,
    pub ending: Ending,
    #[serde(skip_serializing_if = "str::is_empty")]
    pub reason: &'a str,
    /// Name of the hot folder, and of the file below its `in/`.
    pub folder: &'a str,
    pub source: String,
    pub source_bytes: u64,
    /// Its last modification, in nanoseconds since 1970.
    pub source_mtime_ns: i64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source_blake3: Option<Hash>,
    pub profile: &'a str,
    /// Where the original was, if that is not where it was dropped (after a retry).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moved_from: &'a Option<(Area, RelPath)>,
    /// Where it goes: its name in the area of the ending, unless it stays where it was dropped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub original: Option<&'a RelPath>,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub stays: bool,
    /// The folder of `.suture/work/` in which the attempt's files are until each is in its place.
    pub work: Token,
    /// Name of the result: below `out/` when it is good, else beside this receipt.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub output: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub output_blake3: Option<Hash>,
    pub report_blake3: Option<Hash>,
    /// The job whose result was copied: nothing was computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reused: Option<JobId>,
    /// Who approved a result that was not found good.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decision: Option<&'a Decision>,
}

/// A report of the engine's on a result that was not computed: it is the earlier job's, with the names of this one.
#[derive(Debug, Serialize)]
pub(crate) struct ReusedReport<'a> {
    #[serde(flatten)]
    pub report: &'a Report,
    pub reused: &'a ReusedFrom,
}

/// Where a result comes from that was not computed.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct ReusedFrom {
    pub job: JobId,
    /// Its hot folder, and the name of its result below `out/`.
    pub folder: String,
    pub output: String,
}

/// The version of a [`Receipt`].
pub(crate) const RECEIPT_VERSION: u32 = 1;
/// No receipt is as long, in bytes.
const LONGEST: u64 = 64 << 10;

/// A receipt that was read again, as far as anyone needs it.
#[derive(Debug, Deserialize)]
pub(crate) struct Told {
    receipt_version: u32,
    #[serde(default)]
    pub job: u64,
    #[serde(default)]
    pub folder: String,
    #[serde(default)]
    pub source: Option<RelPath>,
    pub output: Option<RelPath>,
    pub output_blake3: Option<Hash>,
    pub report_blake3: Option<Hash>,
    #[serde(default)]
    pub attempt: u32,
    pub ending: Option<Ending>,
    #[serde(default)]
    pub reason: String,
    #[serde(default)]
    pub source_bytes: u64,
    pub source_mtime_ns: Option<i64>,
    pub source_blake3: Option<Hash>,
    #[serde(default)]
    pub profile: String,
    pub moved_from: Option<(Area, RelPath)>,
    pub original: Option<RelPath>,
    #[serde(default)]
    pub stays: bool,
    pub work: Option<Token>,
    pub reused: Option<JobId>,
    pub decision: Option<Box<Decision>>,
}

/// The receipt in a file; `None` where there is none, or one of another version. A link is not followed.
pub(crate) fn read(path: &Path) -> Option<Told> {
    try_read(path).ok()
}

/// The same, and why there is none.
///
/// # Errors
/// As `open` and `read`; of kind `InvalidData` or `UnexpectedEof` where the file is no receipt of this version.
pub(crate) fn try_read(path: &Path) -> io::Result<Told> {
    let file = create::open_to_read(path)?;
    let meta = file.metadata()?;
    if !meta.is_file() || meta.len() > LONGEST {
        return Err(damaged("it is no receipt"));
    }
    of_version(serde_json::from_reader(BufReader::new(file))?)
}

/// The receipt that was read from elsewhere.
///
/// # Errors
/// As [`try_read`].
pub(crate) fn from_bytes(bytes: &[u8]) -> io::Result<Told> {
    of_version(serde_json::from_slice(bytes)?)
}

fn of_version(told: Told) -> io::Result<Told> {
    match told.receipt_version {
        RECEIPT_VERSION => Ok(told),
        other => Err(damaged(&format!("it has version {other}; this program knows version {RECEIPT_VERSION}"))),
    }
}

fn damaged(why: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, why.to_owned())
}

/// The report of a file without one of the engine's: unreadable, refused, put off for good, quarantined, or without a name for its result.
#[derive(Debug, Serialize)]
pub(crate) struct NoReport<'a> {
    schema_version: u32,
    engine_version: &'static str,
    task: &'static str,
    /// `unreadable`, `refused`, `environment`, `quarantined`, `name_taken` or `skipped`.
    outcome: Ending,
    input: NoReportInput,
    reason: &'a str,
    /// How an operator gets it worked on again.
    next: String,
    attempts: u32,
    /// Attempts in which the worker died of the file, and deaths of the daemon beside it.
    worker_deaths: u32,
    daemon_deaths: u32,
    /// Deaths of the machine meanwhile, for which no file is to blame.
    machine_deaths: u32,
}

#[derive(Debug, Serialize)]
struct NoReportInput {
    path: String,
    bytes: u64,
}

impl<'a> NoReport<'a> {
    pub(crate) fn new(job: &Job, shown: String, ending: Ending, reason: &'a str, next: String) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            engine_version: env!("CARGO_PKG_VERSION"),
            task: "repair",
            outcome: ending,
            input: NoReportInput { path: shown, bytes: job.source.size },
            reason,
            next,
            attempts: job.attempts.0,
            worker_deaths: job.blame.charges,
            daemon_deaths: job.blame.deaths,
            machine_deaths: job.blame.machine,
        }
    }
}
