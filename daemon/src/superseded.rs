//! A job that is worked on once more: its new result takes the place of what the attempt before left beside the original: report, receipt and
//! best attempt. Without that each retry would choose the next name for everything, `part~2.stl`, then `part~3.stl`, and leave the old ones.
//!
//! The receipt there must be this very job's, and what it speaks of must still have its content. The original is not touched.

use std::path::Path;

use suture_store::job::Area;
use suture_store::{Hash, Job, RelPath};

use crate::bucket::Trouble;
use crate::bucket::calls::Gate;
use crate::folder::Folder;
use crate::names::{best_of, with_suffix};
use crate::receipt::{self, RECEIPT, REPORT};
use crate::remove::remove;
use crate::shelf::Shelf;

/// Removes it. To be called when the new result is durable in its attempt's folder, and before its names are chosen. `gate` is
/// asked before an object of a bucket goes: a worker that lost the job would take what another one has published since for what went before.
///
/// # Errors
/// When the folder lies in a bucket that does not answer. What cannot be removed from a folder on this machine stays.
pub(crate) fn clear(folder: &Folder, job: &Job, gate: Gate) -> Result<(), Trouble> {
    match &job.moved_to {
        Some((area, path)) => clear_beside(folder, job, (*area, path), gate),
        None => Ok(()),
    }
}

/// The same for what stands beside the original of this name, or under its name where it stays in `in/`.
///
/// # Errors
/// As [`clear`].
pub(crate) fn clear_beside(folder: &Folder, job: &Job, (area, path): (Area, &RelPath), gate: Gate) -> Result<(), Trouble> {
    let root = folder.area(area);
    let base = root.join(path.to_path());
    let receipt = with_suffix(&base, RECEIPT);
    let told = match &folder.bucket {
        None => receipt::read(&receipt),
        Some(shelf) => shelf.receipt(&Shelf::key(&folder.root, &receipt)?)?,
    };
    let Some(told) = told else { return Ok(()) };
    if (told.job, &told.folder, told.source.as_ref()) != (job.id.0, &job.source.folder, Some(&job.source.path)) {
        return Ok(());
    }
    let best = told.output.filter(|output: &RelPath| *output == best_of(path)).map(|output| root.join(output.to_path()));
    let mut all = true;
    if let (Some(best), Some(hash)) = (best, told.output_blake3) {
        all &= is_gone(folder, &best, Some(hash), gate)?;
    }
    if let Some(hash) = told.report_blake3 {
        all &= is_gone(folder, &with_suffix(&base, REPORT), Some(hash), gate)?;
    }
    // It speaks of what is left.
    if all {
        is_gone(folder, &receipt, None, gate)?;
    }
    Ok(())
}

/// Removes one of the files, if it still has its content. Returns whether there is none any more.
fn is_gone(folder: &Folder, path: &Path, hash: Option<Hash>, gate: Gate) -> Result<bool, Trouble> {
    let removed = match &folder.bucket {
        None if path.symlink_metadata().is_err() => Ok(()),
        None => remove(path, hash),
        Some(shelf) => shelf.remove(&Shelf::key(&folder.root, path)?, hash, gate)?,
    };
    if let Err(reason) = &removed {
        tracing::debug!(file = folder.shown(path), reason, "What an earlier attempt left stays.");
    }
    Ok(removed.is_ok())
}

#[cfg(test)]
mod tests {
    use suture_store::{JobId, Source, Time};

    use super::*;
    use crate::config::FolderConfig;

    #[test]
    fn only_what_this_very_job_left_goes() {
        let dir = tempfile::tempdir().unwrap();
        let config = FolderConfig { name: "hot".into(), ..FolderConfig::of(dir.path()) };
        let folder = Folder::open(&config, None).unwrap();
        let path = RelPath::new(*b"a.stl").unwrap();
        let (name, profile) = ("hot".into(), "default".into());
        let source = Source { folder: name, path: path.clone(), dev: 1, ino: 2, size: 3, mtime_ns: 4, profile };
        let job = |id, moved| {
            let job = Job::queued(JobId(id), source.clone(), Time(1));
            Job { moved_to: moved, ..job }
        };
        let hash = |content: &str| blake3::hash(content.as_bytes()).to_hex();
        let receipt = format!(
            "{{\"receipt_version\":1,\"job\":7,\"folder\":\"hot\",\"source\":\"a.stl\",\"output\":\"a.best.stl\",\"output_blake3\":\"{}\",\
             \"report_blake3\":\"{}\"}}",
            hash("best"),
            hash("report")
        );
        let failed = dir.path().join("failed");
        let put = |name: &str, content: &str| std::fs::write(failed.join(name), content).unwrap();
        let left = || {
            let mut names: Vec<_> = std::fs::read_dir(&failed).unwrap().flatten().map(|entry| entry.file_name()).collect();
            names.sort();
            names
        };
        let all = ["a.best.stl", "a.stl", "a.stl.report.json", "a.stl.suture.json"];
        for (name, content) in all.into_iter().zip(["best", "original", "report", &receipt]) {
            put(name, content);
        }
        let here = Some((Area::Failed, path.clone()));
        let clear = |job: Job| clear(&folder, &job, &|| Ok(())).unwrap();
        clear(job(8, here.clone()));
        clear(job(7, None));
        assert_eq!(left(), all);
        // A person works on the best attempt: it stays, and so does what tells of it.
        put("a.best.stl", "by hand");
        clear(job(7, here.clone()));
        assert_eq!(left(), ["a.best.stl", "a.stl", "a.stl.suture.json"]);
        put("a.best.stl", "best");
        clear(job(7, here));
        assert_eq!(left(), ["a.stl"]);
    }
}
