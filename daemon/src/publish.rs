//! Bringing a finished job's files into place, so that whatever happens in between, there is exactly one result:
//!
//! ```text
//! files durable under temporary names ─► intent durable in the store ─► output renamed ─► report ─► receipt ─► folder synced
//!   ─► published ─► original moved ─► both folders synced ─► done ─► attempt's folder removed
//! ```
//! Nothing is ever replaced. The first of the renames decides who owns a name; who loses it chooses another and says so in a new
//! intent. Each step looks at what is there before it acts, so that the same code finishes what a killed daemon began.

use std::cell::Cell;
use std::ffi::OsStr;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use suture_core::Report;
use suture_core::report::Outcome;
use suture_store::job::Withdrawal;
use suture_store::{Claim, Ending, Hash, Job, JobStore, Publication, State, Step, crash_point};

use crate::claim::{CLAIMED, Original, is_inode, is_source};
use crate::create;
use crate::folder::{Folder, make_parent};
use crate::fsx::{self, Identity};
use crate::left::has_report;
use crate::names::{VERSIONS, ending_of_name, first, no_free_name, with_suffix};
use crate::place::{Item, Move, Placed, stage};
use crate::publish_error::{PublishError, io_at};
use crate::receipt::{NoReport, RECEIPT, RECEIPT_VERSION, REPORT, Receipt, ReusedFrom, ReusedReport};
use crate::reuse::recipe_of;
use crate::rights::Rights;
use crate::superseded;

/// Names of an attempt's files in its folder.
pub(crate) const OUTPUT: &str = "out.stl";
const REPORT_FILE: &str = "report.json";
pub(crate) const RECEIPT_FILE: &str = "receipt.json";

/// What came of the work, before names are chosen.
pub(crate) enum Conclusion {
    /// The engine's report; the output, if any, is in the attempt's folder. `ctime_ns`: last change of the original's inode then.
    /// `reused`: of whose result both are copies.
    Report { report: Box<Report>, ctime_ns: i64, reused: Option<ReusedFrom> },
    /// No report of the engine's.
    None { ending: Ending, reason: String },
}

impl Conclusion {
    /// Is there a result for `out/`?
    fn is_good(&self) -> bool {
        matches!(self, Self::Report { report, .. } if ending_of(report).is_good())
    }

    /// The ending of names of its output's format.
    fn ending(&self) -> Option<&'static OsStr> {
        match self {
            Self::Report { report, .. } => report.output.as_ref()?.format.ending().map(OsStr::new),
            Self::None { .. } => None,
        }
    }
}

/// One job at the end of its way.
pub(crate) struct Desk<'a> {
    pub store: &'a dyn JobStore,
    pub folder: &'a Folder,
    pub claim: &'a Claim,
    /// A file of the result is in its place.
    pub committed: &'a Cell<bool>,
}

/// A file of a result: where it comes from, where it goes to, and the crash point behind it.
struct Piece {
    from: PathBuf,
    to: PathBuf,
    stage: PathBuf,
    hash: Option<Hash>,
    point: &'static str,
}

impl<'a> Desk<'a> {
    pub(crate) fn new(store: &'a dyn JobStore, folder: &'a Folder, claim: &'a Claim, committed: &'a Cell<bool>) -> Self {
        Self { store, folder, claim, committed }
    }

    fn work(&self, job: &Job) -> PathBuf {
        self.folder.work(job.work_token())
    }

    /// Writes report and receipt, chooses names, and makes the intent durable.
    pub(crate) fn intend(&self, job: &Job, result: &Conclusion) -> Result<Job, PublishError> {
        self.begin(job)?;
        superseded::clear(self.folder, job, &|| self.must_hold())?;
        crash_point("daemon.superseded");
        let barred = if result.is_good() { self.barred(job, result.ending())? } else { None };
        let publication = self.prepare(job, barred.as_ref().unwrap_or(result))?;
        self.intend_durably(job, publication)
    }

    /// The attempt's folder, made when there is none.
    fn begin(&self, job: &Job) -> Result<PathBuf, PublishError> {
        let work = self.work(job);
        match std::fs::create_dir(&work) {
            Err(e) if e.kind() != io::ErrorKind::AlreadyExists => Err(io_at(&work)(e)),
            _ => Ok(work),
        }
    }

    /// The intent, the files of which are in the attempt's folder.
    fn intend_durably(&self, job: &Job, publication: Publication) -> Result<Job, PublishError> {
        let work = self.work(job);
        // The files' names in it, and its own: without them the intent would be of nothing.
        for folder in [work.as_path(), fsx::folder_of(&work)] {
            fsx::sync_dir(folder).map_err(io_at(folder))?;
        }
        crash_point("daemon.result_durable");
        let job = self.store.advance(self.claim, Step::Intend(publication))?;
        crash_point("daemon.intent_durable");
        Ok(job)
    }

    /// The intent; its files are in the attempt's folder, synced.
    fn prepare(&self, job: &Job, result: &Conclusion) -> Result<Publication, PublishError> {
        let work = self.work(job);
        let (ending, reason, output_hash, input_hash, source_ctime_ns) = match result {
            Conclusion::None { ending, reason } => (*ending, reason.clone(), None, None, None),
            Conclusion::Report { report, ctime_ns, .. } => {
                let ending = ending_of(report);
                let hints = || report.hints.iter().map(|hint| hint.text.as_str()).collect::<Vec<_>>().join("; ");
                let reason = if ending.is_good() { hints() } else { report.verdict.reasons.join("; ") };
                let output = report.output.as_ref().and_then(|facts| facts.blake3.parse::<Hash>().ok());
                (ending, reason, output, report.input.blake3.parse::<Hash>().ok(), Some(*ctime_ns))
            }
        };
        let reason = suture_store::job::one_line(&reason);
        let names = self.names(job, ending, output_hash.and(result.ending()))?;
        let target = if ending.is_good() { self.folder.out() } else { self.folder.area(ending.area()) };
        let shown_source = self.folder.shown(&self.folder.inbox().join(job.source.path.to_path()));
        let report_path = work.join(REPORT_FILE);
        let (mut recipe, mut copied) = (None, None);
        let report_hash = match result {
            Conclusion::None { .. } => {
                let how = match ending {
                    Ending::Skipped => "take that out of out/, and drop the file again".into(),
                    _ => format!("suture jobs retry {} --dir {} works on it once more", job.id, self.folder.root.display()),
                };
                rewrite(&report_path, &NoReport::new(job, shown_source, ending, &reason, how))?
            }
            Conclusion::Report { report, reused, .. } => {
                recipe = ending.is_good().then(|| recipe_of(report));
                copied = reused.as_ref().map(|from| from.job);
                let mut report = report.clone();
                report.input.path = shown_source.into();
                if let (Some(facts), Some(name)) = (&mut report.output, &names.output) {
                    facts.path = self.folder.shown(&target.join(name.to_path())).into();
                }
                match reused {
                    None => rewrite(&report_path, &report)?,
                    Some(reused) => rewrite(&report_path, &ReusedReport { report: &report, reused })?,
                }
            }
        };
        let publication = Publication {
            ending,
            reason,
            output: names.output,
            output_hash,
            report_hash: Some(report_hash),
            recipe,
            reused: copied,
            source_ctime_ns,
            original: Some(names.original),
            stays: self.folder.leave_originals,
            decision: None,
        };
        self.write_receipt(job, &publication, input_hash)?;
        Ok(publication)
    }

    fn write_receipt(&self, job: &Job, p: &Publication, source_blake3: Option<Hash>) -> Result<(), PublishError> {
        let hold = job.hold().copied();
        let receipt = Receipt {
            receipt_version: RECEIPT_VERSION,
            job: job.id.0,
            attempt: job.attempts.0,
            epoch: hold.map_or(0, |hold| hold.epoch.0),
            engine_version: env!("CARGO_PKG_VERSION"),
            ending: p.ending,
            reason: &p.reason,
            folder: &job.source.folder,
            source: job.source.path.to_string(),
            source_bytes: job.source.size,
            source_mtime_ns: job.source.mtime_ns,
            source_blake3,
            profile: &job.source.profile,
            moved_from: &job.moved_to,
            original: p.original.as_ref().filter(|_| !p.stays),
            stays: p.stays,
            work: job.work_token(),
            output: p.output.as_ref().map(ToString::to_string),
            output_blake3: p.output_hash,
            report_blake3: p.report_hash,
            reused: p.reused,
            decision: p.decision.as_deref(),
        };
        rewrite(&self.work(job).join(RECEIPT_FILE), &receipt).map(drop)
    }

    /// Renames the files of the intent into place.
    pub(crate) fn place(&self, job: &Job) -> Result<Job, PublishError> {
        let State::Publishing { publication, .. } = &job.state else { return Ok(job.clone()) };
        self.committed.set(false);
        let pieces = pieces(self.folder, job, publication);
        // What this claim has written itself, it need not read again.
        let trusted = job.hold().is_some_and(|hold| job.work == Some(hold.token));
        for (i, piece) in pieces.iter().enumerate() {
            self.must_hold_shared()?;
            make_parent(&piece.to).map_err(io_at(&piece.to))?;
            let item = Item { from: &piece.from, to: &piece.to, stage: &piece.stage };
            if let Some(source) = item.source().map_err(io_at(&piece.from))? {
                if i == 0 && !self.content_stands(job, publication)? {
                    discard(self.folder, job);
                    return Ok(self.store.advance(self.claim, Step::Withdrawn(Withdrawal::Changed))?);
                }
                self.share(job, source, &piece.to)?;
            }
            let is_it = |path: &Path| match piece.hash.filter(|_| !trusted) {
                Some(hash) => Ok(fsx::hash(path)? == hash),
                None => Ok(true),
            };
            match self.put(&item, i == 0 && publication.output.is_some(), &is_it)? {
                Placed::Now => crash_point(piece.point),
                Placed::Before => {}
                Placed::Taken if i == 0 && self.was_begun(&pieces)? => {
                    // A report is in place, so the file of that name is this job's output, and what lies in the work folder its double.
                    for left in [&piece.from, &piece.stage] {
                        fsx::remove_if_there(left).map_err(io_at(left))?;
                    }
                }
                Placed::Taken if i == 0 => return self.choose_again(job, publication),
                Placed::Taken => self.place_beside(piece)?,
                Placed::Missing if i == 0 => {
                    self.folder.check().map_err(PublishError::Folder)?;
                    return Ok(self.store.advance(self.claim, Step::Lost)?);
                }
                // Renamed by an earlier life, and taken away since.
                Placed::Missing => {}
            }
            self.committed.set(true);
        }
        if let Some(piece) = pieces.first() {
            let folder = fsx::folder_of(&piece.to);
            fsx::sync_dir(folder).map_err(io_at(folder))?;
        }
        crash_point("daemon.folder_synced");
        let job = self.store.advance(self.claim, Step::Placed)?;
        crash_point("daemon.published");
        Ok(job)
    }

    /// Was the output of this intent in place before a crash? Its report comes after it, and is gone from the work folder then; and the file
    /// of the output's name has its content.
    fn was_begun(&self, pieces: &[Piece]) -> Result<bool, PublishError> {
        let [output, report, ..] = pieces else { return Ok(false) };
        let item = Item { from: &report.from, to: &report.to, stage: &report.stage };
        if item.source().map_err(io_at(&report.from))?.is_some() || !fsx::exists(&report.to).map_err(io_at(&report.to))? {
            return Ok(false);
        }
        if !fsx::exists(&output.to).map_err(io_at(&output.to))? {
            return Ok(false);
        }
        let found = fsx::hash(&output.to).map_err(io_at(&output.to))?;
        Ok(output.hash == Some(found))
    }

    /// Is the content of the original still that of which the result was made? An original that was taken away, or whose name is
    /// another file's by now, did not change.
    fn content_stands(&self, job: &Job, p: &Publication) -> Result<bool, PublishError> {
        let Some(ctime) = p.source_ctime_ns else { return Ok(true) };
        let names = [self.folder.original(job), self.work(job).join(CLAIMED)];
        let is_original = |found: &Identity| job.moved_to.is_some() || is_inode(found, &job.source);
        for path in &names {
            match fsx::look(path).map_err(io_at(path))?.filter(is_original) {
                Some(found) if found.ctime_ns == ctime => return Ok(true),
                Some(found) if p.ending == Ending::Carried => {
                    return Ok(is_source(&found, job) && Some(fsx::hash(path).map_err(io_at(path))?) == p.output_hash);
                }
                Some(found) => return Ok(is_source(&found, job) && self.is_made_of(job, path)?),
                None => {}
            }
        }
        Ok(true)
    }

    /// Did the result come from these bytes?
    fn is_made_of(&self, job: &Job, path: &Path) -> Result<bool, PublishError> {
        let report = self.work(job).join(REPORT_FILE);
        let told = match read_json(&report) {
            // Its report is in place, so that the result was about to be: nothing to compare with.
            Err(PublishError::Io { source, .. }) if source.kind() == io::ErrorKind::NotFound => return Ok(true),
            told => told?,
        };
        let wanted = told.pointer("/input/blake3").and_then(|v| v.as_str()).and_then(|text| text.parse::<Hash>().ok());
        let found = fsx::hash(path).map_err(io_at(path))?;
        Ok(wanted.is_none_or(|wanted| wanted == found))
    }

    /// Gives a file that is about to be placed the rights of the original, and says so if whoever owned that is locked out.
    fn share(&self, job: &Job, file: &Path, to: &Path) -> Result<(), PublishError> {
        let originals = [self.folder.original(job), self.work(job).join(CLAIMED)];
        // Gone, or out of sight: the result keeps the rights it has.
        let Some(original) = originals.iter().find_map(|path| std::fs::symlink_metadata(path).ok()) else { return Ok(()) };
        let rights = Rights::of(&original);
        let open = Original::open(file).map_err(io_at(file))?;
        rights.give(open.file(), fsx::folder_of(to)).map_err(io_at(file))?;
        if open.file().metadata().is_ok_and(|given| !rights.owner_can_read(&given)) {
            tracing::warn!(file = %to.display(), "The owner of the original cannot read the result: this daemon may not give files away.");
        }
        Ok(())
    }

    /// Someone took the name of the intent: another one, said in a new intent, or no result where the folder wants no second one. Report and
    /// receipt are written anew, since they name it. What a person approved is published in any case.
    fn choose_again(&self, job: &Job, old: &Publication) -> Result<Job, PublishError> {
        if let (Ending::Carried, Some(content)) = (old.ending, old.output_hash) {
            return self.choose_again_carried(job, old, content);
        }
        let ending = old.output.as_ref().map(ending_of_name);
        if old.ending.is_good()
            && old.output.is_some()
            && old.decision.is_none()
            && let Some(barred) = self.barred(job, ending.as_deref())?
        {
            discard(self.folder, job);
            let publication = self.prepare(job, &barred)?;
            return self.intend_durably(job, publication);
        }
        let names = self.names(job, old.ending, ending.as_deref())?;
        self.must_hold_shared()?;
        let work = self.work(job);
        let path = work.join(REPORT_FILE);
        let mut report = match read_json(&path) {
            // In place already, under a name that was taken since: the work is done again.
            Err(PublishError::Io { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
                return Ok(self.store.advance(self.claim, Step::Lost)?);
            }
            report => report?,
        };
        let (area, _) = base(self.folder, job, old);
        if let (Some(shown), Some(name)) = (report.pointer_mut("/output/path"), &names.output) {
            *shown = self.folder.shown(&area.join(name.to_path())).into();
        }
        let input_hash = report.pointer("/input/blake3").and_then(|v| v.as_str()).and_then(|text| text.parse().ok());
        let report_hash = rewrite(&path, &report)?;
        let publication =
            Publication { output: names.output, original: Some(names.original), report_hash: Some(report_hash), ..old.clone() };
        self.write_receipt(job, &publication, input_hash)?;
        fsx::sync_dir(&work).map_err(io_at(&work))?;
        let job = self.store.advance(self.claim, Step::Intend(publication))?;
        crash_point("daemon.intent_renewed");
        Ok(job)
    }

    /// A stranger has the name of a report or receipt: the next free one.
    fn place_beside(&self, piece: &Piece) -> Result<(), PublishError> {
        let name = piece.to.file_name().unwrap_or_default();
        for n in 2..VERSIONS {
            let to = piece.to.with_file_name(fsx::versioned(name, n, 0));
            let item = Item { from: &piece.from, to: &to, stage: &piece.stage };
            if let Placed::Now = item.place(&|_| Ok(true)).map_err(io_at(&to))? {
                tracing::warn!(file = %to.display(), "The name of a report was taken; it got another.");
                return Ok(());
            }
        }
        Err(no_free_name(&piece.to))
    }

    /// Moves the original to the area of the ending.
    pub(crate) fn move_original(&self, job: &Job) -> Result<Job, PublishError> {
        let State::Published { publication, .. } = &job.state else { return Ok(job.clone()) };
        let Some(wanted) = publication.original.as_ref().filter(|_| !publication.stays) else {
            return Ok(self.store.advance(self.claim, Step::Finished)?);
        };
        let from = self.folder.original(job);
        let area = self.folder.area(publication.ending.area());
        let to = area.join(wanted.to_path());
        if from != to {
            self.must_hold_shared()?;
            make_parent(&to).map_err(io_at(&to))?;
            let claimed = self.work(job).join(CLAIMED);
            let way = Move { job, work: job.work_token(), from: &from, to: &to, claimed: &claimed };
            match way.run().map_err(io_at(&to))? {
                Placed::Taken => {
                    let other = first(wanted, 0, |path| fsx::exists(&area.join(path.to_path())).map(|there| !there))?;
                    return Ok(self.store.advance(self.claim, Step::Redirect { original: other })?);
                }
                Placed::Missing => {
                    self.folder.check().map_err(PublishError::Folder)?;
                    tracing::warn!(file = %from.display(), "The original was taken away, or changed after its result was published.");
                }
                Placed::Now | Placed::Before => {}
            }
            crash_point("daemon.original_moved");
            for folder in [fsx::folder_of(&to), fsx::folder_of(&from)] {
                match fsx::sync_dir(folder) {
                    Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(io_at(folder)(e)),
                    _ => {}
                }
            }
        }
        crash_point("daemon.original_durable");
        let job = self.store.advance(self.claim, Step::Finished)?;
        crash_point("daemon.done");
        Ok(job)
    }
}

/// Where the result's files stand, and the name that report and receipt are named after.
fn base(folder: &Folder, job: &Job, p: &Publication) -> (PathBuf, PathBuf) {
    let area = if p.ending.is_good() { folder.out() } else { folder.area(p.ending.area()) };
    (area, p.base().unwrap_or(&job.source.path).to_path())
}

/// The files of an intent, the most important first.
fn pieces(folder: &Folder, job: &Job, p: &Publication) -> Vec<Piece> {
    let work = folder.work(job.work_token());
    let (area, base) = base(folder, job, p);
    let piece = |name: &str, to: PathBuf, hash, point| {
        let stage = stage(fsx::folder_of(&to), job.work_token(), name);
        Piece { from: work.join(name), stage, to, hash, point }
    };
    let beside = |suffix: &str| area.join(with_suffix(&base, suffix));
    let output = p.output.as_ref().filter(|_| p.output_hash.is_some());
    let output = output.map(|path| piece(OUTPUT, area.join(path.to_path()), p.output_hash, "daemon.output_placed"));
    let report = piece(REPORT_FILE, beside(REPORT), p.report_hash, "daemon.report_placed");
    let receipt = piece(RECEIPT_FILE, beside(RECEIPT), None, "daemon.receipt_placed");
    output.into_iter().chain(Some(report).filter(|_| has_report(p))).chain([receipt]).collect()
}

/// Removes what `job`, as it was before it was given up, had ready beside its places. There is any only where the result was to cross
/// to another file system.
pub(crate) fn discard(folder: &Folder, job: &Job) {
    for piece in job.publication().into_iter().flat_map(|p| pieces(folder, job, p)) {
        if let Err(error) = fsx::remove_if_there(&piece.stage) {
            tracing::warn!(%error, file = %piece.stage.display(), "A left-over could not be removed.");
        }
    }
}

/// What the engine's outcome means for the file.
fn ending_of(report: &Report) -> Ending {
    match report.outcome {
        Outcome::Clean => Ending::Clean,
        Outcome::Repaired => Ending::Repaired,
        Outcome::NeedsReview => Ending::NeedsReview,
        Outcome::NotGood => Ending::NotGood,
    }
}

fn read_json(path: &Path) -> Result<serde_json::Value, PublishError> {
    std::fs::read(path).and_then(|bytes| Ok(serde_json::from_slice(&bytes)?)).map_err(io_at(path))
}

/// Writes a file of the attempt's, in place of what an interrupted try left; its hash.
fn rewrite<T: Serialize>(path: &Path, value: &T) -> Result<Hash, PublishError> {
    let write = || {
        let mut bytes = serde_json::to_vec_pretty(value)?;
        bytes.push(b'\n');
        let mut file = create::create_anew(path)?;
        file.write_all(&bytes)?;
        file.sync_all()?;
        Ok(Hash(*blake3::hash(&bytes).as_bytes()))
    };
    write().map_err(io_at(path))
}

pub(crate) mod approved;
mod bucket;
#[cfg(test)]
mod bucket_tests;
mod called;
mod carried;
pub(crate) mod litter;
#[cfg(test)]
pub(crate) mod tests;
