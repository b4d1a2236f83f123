//! The files that a finished job has left in its hot folder.

use std::path::{Path, PathBuf};

use suture_store::job::Area;
use suture_store::{Ending, Job, Publication, State};

use crate::receipt::REPORT;

/// The folder of an area, below its hot folder.
pub(crate) fn area(area: Area) -> &'static str {
    match area {
        Area::In => "in",
        Area::Done => "done",
        Area::Failed => "failed",
        Area::Quarantine => "quarantine",
    }
}

/// Where the result of a finished job of the hot folder `dir` is: a good one in `out/`, else the best attempt beside the original.
pub(crate) fn result_path(dir: &Path, job: &Job) -> Option<PathBuf> {
    let State::Ended { publication } = &job.state else { return None };
    result_of(dir, publication)
}

/// The best attempt and the report that a person approved, and that are still to be published, below the hot folder `dir`.
pub(crate) fn approved(dir: &Path, job: &Job) -> [Option<PathBuf>; 2] {
    let State::Approved { publication, .. } = &job.state else { return [None, None] };
    [result_of(dir, publication), report_of(dir, publication)]
}

fn result_of(dir: &Path, publication: &Publication) -> Option<PathBuf> {
    let output = publication.output.as_ref()?;
    let folder = if publication.ending.is_good() { "out" } else { area(publication.ending.area()) };
    Some(dir.join(folder).join(output.to_path()))
}

/// Where the report of a finished job of the hot folder `dir` is.
pub(crate) fn report_path(dir: &Path, job: &Job) -> Option<PathBuf> {
    let State::Ended { publication } = &job.state else { return None };
    report_of(dir, publication)
}

/// Is there a report? Of a file that was carried nothing was judged.
pub(crate) fn has_report(publication: &Publication) -> bool {
    publication.ending != Ending::Carried
}

fn report_of(dir: &Path, publication: &Publication) -> Option<PathBuf> {
    if !has_report(publication) {
        return None;
    }
    let folder = if publication.ending.is_good() { "out" } else { area(publication.ending.area()) };
    let mut name = dir.join(folder).join(publication.base()?.to_path()).into_os_string();
    name.push(REPORT);
    Some(name.into())
}
