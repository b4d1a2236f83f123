//! A job that is worked on once more: its new result takes the place of what the attempt before left beside the original: report, receipt and
//! best attempt. Without that each retry would choose the next name for everything, `part~2.stl`, then `part~3.stl`, and leave the old ones.
//!
//! The receipt there must be this very job's, and what it speaks of must still have its content. The original is not touched.

use std::path::Path;

use suture_store::job::Area;
use suture_store::{Job, RelPath};

use crate::folder::Folder;
use crate::names::{best_of, with_suffix};
use crate::receipt::{self, RECEIPT, REPORT};
use crate::remove::remove;

/// Removes it. To be called when the new result is durable in its attempt's folder, and before its names are chosen.
pub(crate) fn clear(folder: &Folder, job: &Job) {
    if let Some((area, path)) = &job.moved_to {
        clear_beside(folder, job, *area, path);
    }
}

/// The same for what stands beside the original of this name, or under its name where it stays in `in/`.
pub(crate) fn clear_beside(folder: &Folder, job: &Job, area: Area, path: &RelPath) {
    let root = folder.area(area);
    let base = root.join(path.to_path());
    let receipt = with_suffix(&base, RECEIPT);
    let Some(told) = receipt::read(&receipt) else { return };
    if (told.job, &told.folder, told.source.as_ref()) != (job.id.0, &job.source.folder, Some(&job.source.path)) {
        return;
    }
    let best = told.output.filter(|output: &RelPath| *output == best_of(path)).map(|output| root.join(output.to_path()));
    let gone = |path: &Path, hash| match path.symlink_metadata() {
        Ok(_) => remove(path, hash).inspect_err(|reason| {
            tracing::debug!(file = %path.display(), reason, "What an earlier attempt left stays.");
        }),
        Err(_) => Ok(()),
    };
    let mut all = true;
    if let (Some(best), Some(hash)) = (best, told.output_blake3) {
        all &= gone(&best, Some(hash)).is_ok();
    }
    if let Some(hash) = told.report_blake3 {
        all &= gone(&with_suffix(&base, REPORT), Some(hash)).is_ok();
    }
    // It speaks of what is left.
    if all {
        let _ = gone(&receipt, None);
    }
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
        clear(&folder, &job(8, here.clone()));
        clear(&folder, &job(7, None));
        assert_eq!(left(), all);
        // A person works on the best attempt: it stays, and so does what tells of it.
        put("a.best.stl", "by hand");
        clear(&folder, &job(7, here.clone()));
        assert_eq!(left(), ["a.best.stl", "a.stl", "a.stl.suture.json"]);
        put("a.best.stl", "best");
        clear(&folder, &job(7, here));
        assert_eq!(left(), ["a.stl"]);
    }
}
