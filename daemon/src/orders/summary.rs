//! The summary of one order: what became of each of its files, and where it is. Made of jobs alone, so that it can be made again.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use suture_core::words::Counted;
use suture_store::job::{Area, Kind};
use suture_store::{Job, RelPath, State, Time};

use crate::folder::{Folder, make_parent};
use crate::left::has_report;
use crate::names::VERSIONS;
use crate::receipt::REPORT;
use crate::units::show_count;
use crate::{create, force, fsx};

/// Its name, in the order's folder of `out/`. No result is called so: these are named after meshes.
pub(crate) const SUMMARY: &str = "order.report.json";
const VERSION: u32 = 1;
/// So many files that are not good are named in the log.
const NAMED: usize = 5;

/// What became of an order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Summary {
    order_version: u32,
    /// Name of the hot folder, and of the order below its `in/`.
    folder: String,
    order: RelPath,
    /// When the last of its files was done, in milliseconds since 1970.
    changed: Time,
    /// Files by what became of them.
    counts: BTreeMap<Kind, u64>,
    files: Vec<Line>,
}

/// What became of one file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Line {
    job: u64,
    /// The latest job of a file of the same name that was dropped later, if one was: that one counts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    later: Option<u64>,
    /// Below `in/`.
    source: RelPath,
    kind: Kind,
    /// Why it is not good, or is left alone.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    reason: String,
    /// Below the hot folder, as are those that follow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    result: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    report: Option<String>,
    original: String,
}

impl Line {
    /// Good, or of a format that is not ours to judge, or not what is wanted any more.
    fn is_good(&self) -> bool {
        self.later.is_some() || matches!(self.kind, Kind::Done | Kind::Carried | Kind::Noticed)
    }

    fn of(job: &Job) -> Self {
        let (area, original) = job.original();
        let (mut reason, mut result, mut report) = (String::new(), None, None);
        match &job.state {
            State::Ended { publication } => {
                let good = publication.ending.is_good();
                let place = if good { "out" } else { name(publication.ending.area()) };
                result = publication.output.as_ref().map(|output| format!("{place}/{output}"));
                report = publication.base().filter(|_| has_report(publication)).map(|base| format!("{place}/{base}{REPORT}"));
                reason.clone_from(&publication.reason);
            }
            State::Noticed { reason: what } => reason.clone_from(what),
            _ => {}
        }
        let original = format!("{}/{original}", name(area));
        let source = job.source.path.clone();
        Self { job: job.id.0, later: None, source, kind: job.kind(), reason, result, report, original }
    }
}

fn name(area: Area) -> &'static str {
    match area {
        Area::In => "in",
        Area::Done => "done",
        Area::Failed => "failed",
        Area::Quarantine => "quarantine",
    }
}

impl Summary {
    /// Of all jobs of an order that are known, each at rest or left alone. All files of one name are told of, and the latest counts; a file that
    /// went away is not told of. `None`: nothing was worked on.
    pub(crate) fn of(folder: &str, order: &RelPath, jobs: &[Job]) -> Option<Self> {
        let withdrawn =
            |job: &Job| matches!(&job.state, State::Cancelled { why } if *why != suture_store::job::Withdrawal::Operator);
        let jobs: Vec<_> = jobs.iter().filter(|job| !withdrawn(job)).collect();
        let changed = jobs.iter().filter(|job| matches!(job.state, State::Ended { .. })).map(|job| job.changed).max()?;
        let files = jobs.into_iter().map(Line::of).collect();
        let mut summary =
            Self { order_version: VERSION, folder: folder.into(), order: order.clone(), changed, counts: BTreeMap::new(), files };
        summary.count();
        Some(summary)
    }

    /// Files of one name one after the other, the latest last, which alone is counted.
    fn count(&mut self) {
        self.files.sort_by_cached_key(|line| (force::plain(&line.source), line.job));
        let mut latest = BTreeMap::new();
        for line in &self.files {
            latest.insert(force::plain(&line.source), line.job);
        }
        self.counts.clear();
        for line in &mut self.files {
            line.later = latest.get(&force::plain(&line.source)).copied().filter(|job| *job != line.job);
            if line.later.is_none() {
                *self.counts.entry(line.kind).or_default() += 1;
            }
        }
    }

    /// Takes over what an earlier summary says of files whose jobs the store has forgotten since.
    fn remember(&mut self, earlier: &Self, is_known: &dyn Fn(u64) -> bool) {
        let known: Vec<_> = self.files.iter().map(|line| line.job).collect();
        let is_new = |line: &&Line| !is_known(line.job) && !known.contains(&line.job);
        self.files.extend(earlier.files.iter().filter(is_new).cloned());
        self.count();
    }

    /// Is each of its meshes good?
    pub(crate) fn is_good(&self) -> bool {
        self.files.iter().all(Line::is_good)
    }

    /// In words: `5 files: 4 done, 1 failed (b.stl: not closed)`.
    pub(crate) fn words(&self) -> String {
        let counts: Vec<_> = self.counts.iter().map(|(kind, count)| format!("{} {}", show_count(*count), kind.name())).collect();
        let bad: Vec<_> = self.files.iter().filter(|line| !line.is_good()).collect();
        let mut named: Vec<_> = bad
            .iter()
            .take(NAMED)
            .map(|line| match line.reason.as_str() {
                "" => line.source.to_string(),
                reason => format!("{}: {reason}", line.source),
            })
            .collect();
        if bad.len() > NAMED {
            named.push(format!("and {} more", show_count((bad.len() - NAMED) as u64)));
        }
        let named = if named.is_empty() { String::new() } else { format!(" ({})", named.join("; ")) };
        format!("{}: {}{named}", Counted(self.counts.values().sum(), "file", "files"), counts.join(", "))
    }

    /// Puts it into the order's folder of `out/`, durably, in place of an earlier one of the same order; another file of that name stays,
    /// and the summary gets the next one. Returns where it is, and whether it says something new.
    ///
    /// # Errors
    /// As the file system's.
    pub(crate) fn put(mut self, folder: &Folder, is_known: &dyn Fn(u64) -> bool) -> io::Result<(Self, PathBuf, bool)> {
        let first = folder.out().join(self.order.to_path()).join(SUMMARY);
        make_parent(&first)?;
        for n in 1..VERSIONS {
            let path = first.with_file_name(fsx::versioned(OsStr::new(SUMMARY), n, 0));
            if fsx::exists(&path)? {
                let Some(earlier) = read(&path).filter(|other| (&other.folder, &other.order) == (&self.folder, &self.order))
                else {
                    continue;
                };
                self.remember(&earlier, is_known);
                // That it was said later is nothing new.
                if earlier == (Self { changed: earlier.changed, ..self.clone() }) {
                    return Ok((self, path, false));
                }
            }
            let mut bytes = serde_json::to_vec_pretty(&self)?;
            bytes.push(b'\n');
            create::replace(&path, &bytes)?;
            fsx::sync_dir(fsx::folder_of(&path))?;
            return Ok((self, path, true));
        }
        Err(io::ErrorKind::AlreadyExists.into())
    }
}

/// The summary in a file, if that is one.
pub(crate) fn read(path: &Path) -> Option<Summary> {
    let file = create::open_to_read(path).ok().filter(|file| file.metadata().is_ok_and(|meta| meta.is_file()))?;
    let summary: Summary = serde_json::from_reader(io::BufReader::new(file)).ok()?;
    (summary.order_version == VERSION).then_some(summary)
}

#[cfg(test)]
pub(super) mod tests {
    use suture_store::{Ending, JobId, Publication, Source};

    use super::*;
    use crate::config::FolderConfig;

    /// Of a job whose file was at this path.
    pub(in crate::orders) fn publication(path: RelPath, ending: Ending) -> Publication {
        Publication {
            ending,
            reason: if ending.is_good() { String::new() } else { "not closed".into() },
            output: ending.is_good().then(|| path.clone()),
            output_hash: None,
            report_hash: None,
            source_ctime_ns: None,
            original: Some(path),
            stays: false,
            decision: None,
            recipe: None,
            reused: None,
        }
    }

    fn job(id: u64, path: &str, ending: Option<Ending>) -> Job {
        let path = RelPath::new(path).unwrap();
        let source = Source {
            folder: "hot".into(),
            path: path.clone(),
            dev: 1,
            ino: id,
            size: 84,
            mtime_ns: 1,
            profile: "default".into(),
        };
        let Some(ending) = ending else { return Job::noticed(JobId(id), source, "a .obj file", Time(id)) };
        let publication = publication(path, ending);
        Job { state: State::Ended { publication }, ..Job::queued(JobId(id), source, Time(id)) }
    }

    fn order() -> RelPath {
        RelPath::new(*b"order").unwrap()
    }

    #[test]
    fn each_file_is_told_of_and_the_latest_of_a_name_counts() {
        let jobs = [
            job(1, "order/a.stl", Some(Ending::NotGood)),
            job(2, "order/b.stl", Some(Ending::NotGood)),
            job(3, "order/x.obj", None),
            job(4, "order/a.stl", Some(Ending::Repaired)),
        ];
        let summary = Summary::of("hot", &order(), &jobs).unwrap();
        assert_eq!(summary.words(), "3 files: 1 noticed, 1 done, 1 failed (order/b.stl: not closed)");
        assert_eq!((summary.changed, summary.is_good()), (Time(4), false));
        let places: Vec<_> = summary.files.iter().map(|line| (line.result.as_deref(), line.original.as_str())).collect();
        let expected = [
            (None, "failed/order/a.stl"),
            (Some("out/order/a.stl"), "done/order/a.stl"),
            (None, "failed/order/b.stl"),
            (None, "in/order/x.obj"),
        ];
        assert_eq!(places, expected);
        assert_eq!(summary.files.iter().map(|line| line.later).collect::<Vec<_>>(), [Some(4), None, None, None]);
        assert_eq!(summary.files[2].report.as_deref(), Some("failed/order/b.stl.report.json"));
        assert_eq!(Summary::of("hot", &order(), &jobs[2..3]), None, "nothing was worked on");
    }

    #[test]
    fn it_replaces_its_own_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let config = FolderConfig { name: "hot".into(), ..FolderConfig::of(dir.path()) };
        let folder = Folder::open(&config, None).unwrap();
        let mine = dir.path().join("out/order").join(SUMMARY);
        std::fs::create_dir_all(fsx::folder_of(&mine)).unwrap();
        std::fs::write(&mine, b"{\"mine\": true}").unwrap();
        let first = [job(1, "order/a.stl", Some(Ending::Clean))];
        let put = |jobs: &[Job], known: &[u64]| {
            Summary::of("hot", &order(), jobs).unwrap().put(&folder, &|id| known.contains(&id)).unwrap()
        };
        let (_, path, new) = put(&first, &[1]);
        assert!(new && path.ends_with("order.report~2.json"));
        assert!(!put(&first, &[1]).2, "the same again");
        // The store has forgotten the first job since.
        let (summary, path, new) = put(&[job(2, "order/b.stl", Some(Ending::Clean))], &[2]);
        assert!(new && summary.files.len() == 2 && read(&path) == Some(summary));
        // And a file of the same name came later.
        let (summary, ..) =
            put(&[job(2, "order/b.stl", Some(Ending::Clean)), job(3, "order/a.stl", Some(Ending::NotGood))], &[2, 3]);
        assert_eq!(summary.words(), "2 files: 1 done, 1 failed (order/a.stl: not closed)");
        assert_eq!(
            summary.files.iter().map(|line| (line.job, line.later)).collect::<Vec<_>>(),
            [(1, Some(3)), (3, None), (2, None)]
        );
        assert_eq!(std::fs::read(&mine).unwrap(), b"{\"mine\": true}");
    }
}
