//! A job as a row: its record, and beside it the columns that statements look at.
//!
//! **Claims.** A claim is one statement, and no statement can make a record. So the row of a claim keeps the record of before, and the claim in
//! columns of its own; whoever reads the row lets the state machine take that one step. The next step writes a record that knows of it.

use sha2::{Digest, Sha256};
use sqlx::Row;
use sqlx::postgres::PgRow;

use super::database::Failure;
use crate::id::{Boot, Epoch, JobId, Seq, Time, Token};
use crate::job::{Event, Job, Kind, Source, State};
use crate::record;
use crate::store::StoreError;
use crate::tables::Table;

/// A number as the database keeps it: beyond its range, the largest.
pub(super) fn int(number: u64) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

/// A number of the database's; none is below nothing.
pub(super) fn number(int: i64) -> u64 {
    u64::try_from(int).unwrap_or(0)
}

/// A job, and who holds its row.
#[derive(Clone)]
pub(super) struct Stored {
    pub(super) job: Job,
    /// The bytes of the record; a claim may have come since.
    pub(super) record: Vec<u8>,
    pub(super) epoch: Option<Epoch>,
    /// `None` as well where the holder's life is over.
    pub(super) token: Option<Token>,
}

impl Stored {
    /// Reads a row with the columns `id, seq, record, epoch, token, claim_token, claim_boot, claim_at`.
    pub(super) fn read(row: &PgRow) -> Result<Self, Failure> {
        let id = JobId(number(row.try_get("id")?));
        let bytes: Vec<u8> = row.try_get("record")?;
        let epoch: Option<i64> = row.try_get("epoch")?;
        let token: Option<i64> = row.try_get("token")?;
        let claim: Option<i64> = row.try_get("claim_token")?;
        let key = id.0.to_be_bytes();
        let mut job: Job = record::decode(Table::Jobs, &key, &bytes)?;
        if job.id != id {
            return Err(record::corrupt(&format!("job {id}"), "it is another job's").into());
        }
        let epoch = epoch.map(|epoch| Epoch(number(epoch)));
        if let Some(token) = claim {
            let boot: Option<i64> = row.try_get("claim_boot")?;
            let at: Option<i64> = row.try_get("claim_at")?;
            let boot = Boot(boot.unwrap_or_default().cast_unsigned());
            let event = Event::Claim { epoch: epoch.unwrap_or_default(), token: Token(number(token)), boot };
            let claimed = job.after(&event, Time(number(at.unwrap_or_default())));
            job = claimed
                .map_err(|error| record::corrupt(&format!("job {id}"), &format!("its claim and its record disagree: {error}")))?;
        }
        job.seq = Seq(number(row.try_get("seq")?));
        Ok(Self { job, record: bytes, epoch, token: token.map(|token| Token(number(token))) })
    }
}

impl Stored {
    /// With the job as its record has it, whoever may have claimed it since.
    pub(super) fn written(self) -> Result<Self, StoreError> {
        let job: Job = record::decode(Table::Jobs, &self.job.id.0.to_be_bytes(), &self.record)?;
        Ok(Self { job: Job { seq: self.job.seq, ..job }, ..self })
    }
}

/// The columns of a job.
pub(super) struct Columns {
    pub(super) id: i64,
    pub(super) record: Vec<u8>,
    pub(super) kind: &'static str,
    pub(super) kind_claimed: Option<&'static str>,
    pub(super) folder: String,
    pub(super) size: i64,
    pub(super) priority: i16,
    pub(super) since: i64,
    pub(super) not_before: Option<i64>,
    pub(super) alone: bool,
    pub(super) cancel: bool,
    pub(super) recipe: Option<i64>,
    pub(super) file_key: Option<Vec<u8>>,
    /// It has neither rested nor moved yet.
    pub(super) is_fresh: bool,
}

impl Columns {
    pub(super) fn of(job: &Job) -> Result<Self, StoreError> {
        let kind = job.kind();
        let is_fresh = !kind.is_at_rest() && job.moved_to.is_none();
        Ok(Self {
            id: int(job.id.0),
            record: record::encode_job(&job.id.0.to_be_bytes(), job)?,
            kind: kind.name(),
            kind_claimed: kind_claimed(job).map(Kind::name),
            folder: job.source.folder.clone(),
            size: int(job.source.size),
            priority: i16::try_from(i64::from(job.priority)).unwrap_or_default(),
            since: int(job.waits_since().0),
            not_before: matches!(kind, Kind::Waiting | Kind::Parked).then(|| job.pause().map(|then| int(then.0))).flatten(),
            alone: job.must_run_alone(),
            cancel: matches!(job.state, State::Running { cancel: true, .. }),
            recipe: job.offers().map(|recipe| recipe.0.cast_signed()),
            file_key: file_key(&job.source).map(|key| key.to_vec()),
            is_fresh,
        })
    }
}

/// The kind of the job after a claim; `None` where it cannot be claimed.
fn kind_claimed(job: &Job) -> Option<Kind> {
    match job.kind() {
        kind if kind.is_queued() => Some(Kind::Running),
        Kind::Parked => Some(Job { parked: None, ..job.clone() }.kind()),
        _ => None,
    }
}

/// What makes a file that file, the profile left out; `None`: nothing tells which it was.
pub(super) fn file_key(source: &Source) -> Option<[u8; 32]> {
    (source.ino != 0).then(|| identity(source))
}

/// The same of any file.
pub(super) fn identity(source: &Source) -> [u8; 32] {
    let Source { folder, path, dev, ino, size, mtime_ns, profile: _ } = source;
    let mut digest = Sha256::new();
    [*dev, *ino, *size, mtime_ns.cast_unsigned(), folder.len() as u64].iter().for_each(|part| digest.update(part.to_be_bytes()));
    digest.update(folder.as_bytes());
    digest.update(path.as_bytes());
    digest.finalize().into()
}
