//! What a person approved: the best attempt is published as any result is, and only the very bytes that were judged.
//!
//! ```text
//! approved (store) ─► best attempt copied into the attempt's folder, compared with the hash that was judged ─► report with the signature
//!   ─► both synced ─► what lies in `failed/` goes ─► intent durable ─► as always
//! ```
//! The copy is a file of its own: a person may have the best attempt open. From a kill on, either lies in `failed/` as it was, or the copy is whole.

use std::io;
use std::path::{Path, PathBuf};

use suture_store::job::one_line;
use suture_store::{Decision, Ending, Hash, Job, Publication, Step, crash_point};

use super::{Desk, OUTPUT, REPORT_FILE, base, read_json, rewrite};
use crate::claim::Original;
use crate::create;
use crate::folder::make_parent;
use crate::fsx;
use crate::names::{ending_of_name, with_suffix};
use crate::publish_error::{PublishError, io_at};
use crate::receipt::REPORT;
use crate::remove::ours;
use crate::shelf::Shelf;
use crate::superseded;

/// Why the best attempt of a job cannot be published, if that is so: it is not there, or not as it was judged.
///
/// # Errors
/// As `open` and `read`.
pub(crate) fn unfit(path: &Path, hash: Hash) -> io::Result<Option<&'static str>> {
    let is_file = fsx::look(path)?.map(|_| fsx::is_file(path)).transpose()?;
    Ok(match is_file {
        None => Some(NO_ATTEMPT),
        Some(true) if ours(path, Some(hash))?.is_some() => None,
        Some(_) => Some("the best attempt was changed since it was judged; `suture jobs retry` makes a new one"),
    })
}

/// The notes of a report, as a good result of it keeps them.
fn notes(report: &serde_json::Value) -> String {
    let hints = report["hints"].as_array().map_or(&[][..], Vec::as_slice);
    hints.iter().filter_map(|hint| hint["text"].as_str()).collect::<Vec<_>>().join("; ")
}

impl Desk<'_> {
    /// Makes the intent to publish what a person approved durable, or says that it is not what was judged.
    pub(crate) fn intend_approved(&self, job: &Job, judged: &Publication) -> Result<Job, PublishError> {
        let work = self.begin(job)?;
        let brought = self.bring(job, judged)?;
        let unfit = self.fetch(job, judged)?;
        for path in &brought {
            fsx::remove_if_there(path).map_err(io_at(path))?;
        }
        if let Some(reason) = unfit {
            return Ok(self.store.advance(self.claim, Step::Unfit { reason: reason.into() })?);
        }
        fsx::sync_dir(&work).map_err(io_at(&work))?;
        crash_point("daemon.approved_copied");
        let original = judged.original.as_ref().unwrap_or(&job.source.path);
        superseded::clear_beside(self.folder, job, (Ending::NeedsReview.area(), original), &|| self.must_hold())?;
        crash_point("daemon.superseded");
        let path = work.join(REPORT_FILE);
        let mut report = read_json(&path)?;
        let ending = ending_of_name(judged.output.as_ref().unwrap_or(&job.source.path));
        let names = self.names(job, Ending::Repaired, Some(&ending))?;
        if let (Some(shown), Some(name)) = (report.pointer_mut("/output/path"), &names.output) {
            *shown = self.folder.shown(&self.folder.out().join(name.to_path())).into();
        }
        let input_hash = report.pointer("/input/blake3").and_then(|v| v.as_str()).and_then(|text| text.parse().ok());
        let publication = Publication {
            ending: Ending::Repaired,
            reason: one_line(&notes(&report)),
            output: names.output,
            report_hash: Some(rewrite(&path, &report)?),
            // Nobody has a copy of it without a person's word.
            recipe: None,
            source_ctime_ns: None,
            original: Some(names.original),
            ..judged.clone()
        };
        self.write_receipt(job, &publication, input_hash)?;
        self.intend_durably(job, publication)
    }

    /// Fetches best attempt and report from the folder's bucket, if it lies in one, to where they would lie on this machine; there is nothing else.
    fn bring(&self, job: &Job, judged: &Publication) -> Result<Vec<PathBuf>, PublishError> {
        let Some(shelf) = &self.folder.bucket else { return Ok(Vec::new()) };
        let (area, base) = base(self.folder, job, judged);
        let best = judged.output.as_ref().map(|name| area.join(name.to_path()));
        let mut brought = Vec::new();
        for path in best.into_iter().chain([area.join(with_suffix(&base, REPORT))]) {
            let key = Shelf::key(&self.folder.root, &path).map_err(io_at(&path))?;
            if let Some(found) = shelf.bucket.stat(&key)? {
                make_parent(&path).map_err(io_at(&path))?;
                shelf.bucket.fetch(&key, &found.version, &path)?;
                brought.push(path);
            }
        }
        Ok(brought)
    }

    /// Has best attempt and report in the attempt's folder, synced, be it from an interrupted try; why not, if that cannot be.
    fn fetch(&self, job: &Job, judged: &Publication) -> Result<Option<&'static str>, PublishError> {
        let (area, base) = base(self.folder, job, judged);
        let (Some(name), Some(hash)) = (&judged.output, judged.output_hash) else {
            return Ok(Some("there is no best attempt; `suture jobs retry` makes one"));
        };
        let (best, copy) = (area.join(name.to_path()), self.work(job).join(OUTPUT));
        if unfit(&copy, hash).map_err(io_at(&copy))?.is_some() {
            if let Some(why) = unfit(&best, hash).map_err(io_at(&best))? {
                return Ok(Some(why));
            }
            let original = Original::open(&best).map_err(io_at(&best))?;
            create::copy_content(original.file(), &copy).and_then(|file| file.sync_all()).map_err(io_at(&copy))?;
            if let Some(why) = unfit(&copy, hash).map_err(io_at(&copy))? {
                return Ok(Some(why));
            }
        }
        let report = self.work(job).join(REPORT_FILE);
        let of_it = |path: &Path| match read_json(path) {
            Err(PublishError::Io { source, .. }) if source.kind() == io::ErrorKind::NotFound => Ok(None),
            told => told.map(Some),
        };
        let is_signed = |told: &serde_json::Value| told.get(SIGNATURE).is_some();
        if of_it(&report)?.is_some_and(|told| is_signed(&told)) {
            return Ok(None);
        }
        let earlier = area.join(with_suffix(&base, REPORT));
        let Some(told_hash) = judged.report_hash else { return Ok(Some(NO_REPORT)) };
        if fsx::if_there(ours(&earlier, Some(told_hash))).map_err(io_at(&earlier))?.flatten().is_none() {
            return Ok(Some(NO_REPORT));
        }
        let Some(mut told) = of_it(&earlier)? else { return Ok(Some(NO_REPORT)) };
        sign(&mut told, judged.decision.as_deref());
        rewrite(&report, &told)?;
        Ok(None)
    }
}

/// Why there is nothing to approve.
pub(crate) const NO_ATTEMPT: &str = "the best attempt is not there any more; `suture jobs retry` makes a new one";
const NO_REPORT: &str = "its report is not there any more as it was judged; `suture jobs retry` makes a new one";
/// Where a report says who approved its result. The verdict stays what the engine found.
const SIGNATURE: &str = "decision";

fn sign(report: &mut serde_json::Value, decision: Option<&Decision>) {
    if let (Some(report), Ok(decision)) = (report.as_object_mut(), serde_json::to_value(decision)) {
        report.insert(SIGNATURE.into(), decision);
    }
}
