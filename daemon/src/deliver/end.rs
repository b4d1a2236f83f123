//! The message of a job that has ended: all of it is of the job as it stood then, and of the files that it has left.

use std::io::Read;
use std::path::{Path, PathBuf};

use serde::Serialize;
use suture_core::Report;
use suture_core::report::Certificate;
use suture_store::{Hash, Job, Seq, Time};

use crate::config::events::Occasion;
use crate::create;
use crate::fsx;
use crate::left::{area, report_path, result_path};
use crate::shown::{Shown, when};

/// No report that counts is as long, in bytes.
const LONGEST_REPORT: u64 = 256 << 20;

/// The end of a job, as it is told.
pub(super) struct End<'a> {
    pub id: String,
    pub event: Occasion,
    pub job: &'a Job,
    pub paths: Paths,
}

/// The files that the job has left, by their full names; what there is none of is missing.
#[derive(Default, Serialize)]
pub(super) struct Paths {
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "lossy")]
    pub output: Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "lossy")]
    pub report: Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "lossy")]
    pub original: Option<PathBuf>,
}

/// A path as it is written for programs.
pub(super) fn lossy<S: serde::Serializer>(path: &Option<PathBuf>, to: S) -> Result<S::Ok, S::Error> {
    path.as_ref().map(|path| path.to_string_lossy()).serialize(to)
}

/// As it is sent.
#[derive(Serialize)]
struct Body<'a> {
    id: &'a str,
    event: Occasion,
    time: String,
    /// As `GET /v1/jobs/ID` has it.
    job: Shown,
    /// Of the result; missing where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    certificate: Option<Half>,
    paths: &'a Paths,
}

/// The half of a certificate that says whether the file is printable.
#[derive(Serialize)]
struct Half {
    printable: bool,
    /// Rules that were not passed, or not looked at.
    missing: Vec<String>,
    blake3: String,
}

/// Tells a message from all others. A store that is begun anew counts from the start, but the time goes on.
pub(super) fn id(at: Time, seq: Seq) -> String {
    format!("{:x}-{}", at.0, seq.0)
}

impl<'a> End<'a> {
    /// Of a job as it stood at its end; `None` where it stood at none. `root`: the absolute path or the address of its hot folder, if that is still served.
    pub(super) fn of(job: &'a Job, root: Option<&Path>) -> Option<Self> {
        let paths = root.map_or_else(Paths::default, |root| {
            let (place, name) = job.original();
            let original = Some(root.join(area(place)).join(name.to_path()));
            Paths { output: result_path(root, job), report: report_path(root, job), original }
        });
        Some(Self { id: id(job.changed, job.seq), event: Occasion::of(job)?, job, paths })
    }

    /// The message of it, as JSON.
    pub(super) fn body(&self) -> Vec<u8> {
        let half = |of: Certificate| Half { printable: of.printable, missing: of.missing, blake3: of.blake3 };
        let body = Body {
            id: &self.id,
            event: self.event,
            time: when(self.job.changed),
            job: Shown::from(self.job),
            certificate: self.certificate().ok().map(half),
            paths: &self.paths,
        };
        // Names, numbers and words can always be written.
        serde_json::to_vec(&body).unwrap_or_default()
    }

    /// The certificate in the report that the job has left.
    fn certificate(&self) -> Result<Certificate, String> {
        let publication = self.job.publication();
        let published = publication.and_then(|publication| publication.report_hash);
        let path = self.paths.report.as_deref().ok_or("it has left no report")?;
        let file = as_published(path, published).map_err(|why| format!("its report {why}"))?;
        let report: Report = serde_json::from_reader(std::io::BufReader::new(file.take(LONGEST_REPORT)))
            .map_err(|error| format!("its report cannot be read: {error}"))?;
        report.certificate.ok_or_else(|| "its report has no certificate".into())
    }

    /// Is the result good, does its certificate say of every rule that it passed, and is it of the bytes that stand there now? If not, why.
    pub(super) fn holds(&self) -> Result<(), String> {
        let publication = self.job.publication().filter(|publication| publication.ending.is_good());
        let (publication, path) = publication.zip(self.paths.output.as_deref()).ok_or("it has no good result")?;
        let certificate = self.certificate()?;
        if !certificate.printable {
            return Err(format!("its certificate lacks {}", certificate.missing.join(", ")));
        }
        if publication.output_hash.map(|hash| hash.to_string()).as_deref() != Some(&certificate.blake3) {
            return Err("its certificate is of other bytes".into());
        }
        as_published(path, publication.output_hash).map(drop).map_err(|why| format!("its result {why}"))
    }
}

/// The file of that name, at its beginning, if it has the content that was published.
fn as_published(path: &Path, published: Option<Hash>) -> Result<std::fs::File, String> {
    use std::io::Seek;
    let gone = |error: std::io::Error| format!("is not in its place any more: {error}");
    let mut file = create::open_to_read(path).map_err(gone)?;
    if !file.metadata().map_err(gone)?.is_file() {
        return Err("is no file any more".into());
    }
    let found = fsx::hash_of(&file).map_err(gone)?;
    if Some(found) != published {
        return Err("was changed since".into());
    }
    file.rewind().map_err(gone)?;
    Ok(file)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use suture_store::{Ending, JobId, Publication, RelPath, Source, State};

    /// A job of `a\nb.stl` that has ended, with files of its own in `out/` and `done/`.
    pub(in crate::deliver) fn ended(ending: Ending, output_hash: Option<Hash>, report_hash: Option<Hash>) -> Job {
        let path = RelPath::new(*b"a\nb.stl").unwrap();
        let source =
            Source { folder: "hot".into(), path: path.clone(), dev: 1, ino: 2, size: 84, mtime_ns: 4, profile: "default".into() };
        let mut job = Job::queued(JobId(7), source, Time(1_700_000_000_123));
        let publication = Publication {
            ending,
            reason: String::new(),
            output: Some(path.clone()),
            output_hash,
            report_hash,
            recipe: None,
            reused: None,
            source_ctime_ns: None,
            original: Some(path),
            stays: false,
            decision: None,
        };
        job.state = State::Ended { publication };
        job.seq = Seq(9);
        job
    }

    #[test]
    fn a_message_says_what_what_of_and_where() {
        let job = ended(Ending::Repaired, None, None);
        let end = End::of(&job, Some(Path::new("/srv/hot"))).unwrap();
        let body: serde_json::Value = serde_json::from_slice(&end.body()).unwrap();
        assert_eq!(end.id, "18bcfe5687b-9");
        assert_eq!((&body["id"], &body["event"]), (&"18bcfe5687b-9".into(), &"finished".into()));
        assert_eq!((&body["job"]["id"], &body["job"]["file"]), (&7.into(), &"a%0Ab.stl".into()));
        assert_eq!(body["time"], "2023-11-14T22:13:20.123Z");
        assert_eq!(body["paths"]["output"], "/srv/hot/out/a\nb.stl");
        assert_eq!(body["paths"]["report"], "/srv/hot/out/a\nb.stl.report.json");
        assert_eq!(body["paths"]["original"], "/srv/hot/done/a\nb.stl");
        assert!(body.get("certificate").is_none());
        let queued = Job::queued(job.id, job.source.clone(), job.changed);
        assert!(End::of(&queued, None).is_none(), "it has not ended");
    }

    /// Whoever has changed a result, or its report, runs no command with it.
    #[test]
    fn only_the_bytes_that_were_published_hold() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        std::fs::create_dir(&out).unwrap();
        let hash = |bytes: &[u8]| Hash(*blake3::hash(bytes).as_bytes());
        let holds = |report: &[u8], result: &[u8], ending| {
            std::fs::write(out.join("a\nb.stl"), result).unwrap();
            std::fs::write(out.join("a\nb.stl.report.json"), report).unwrap();
            let job = ended(ending, Some(hash(b"mesh")), Some(hash(REPORT.as_bytes())));
            End::of(&job, Some(dir.path())).unwrap().holds()
        };
        assert!(holds(b"{}", b"mesh", Ending::Repaired).unwrap_err().contains("its report was changed since"));
        assert!(holds(REPORT.as_bytes(), b"mesh", Ending::NeedsReview).unwrap_err().contains("no good result"));
        assert!(holds(REPORT.as_bytes(), b"mesh", Ending::Repaired).unwrap_err().contains("cannot be read"));
        std::fs::remove_file(out.join("a\nb.stl.report.json")).unwrap();
        std::os::unix::fs::symlink("/etc/hostname", out.join("a\nb.stl.report.json")).unwrap();
        let job = ended(Ending::Repaired, None, None);
        let why = End::of(&job, Some(dir.path())).unwrap().holds().unwrap_err();
        assert!(why.contains("not in its place"), "{why}");
    }

    const REPORT: &str = "{\"certificate\": 7}";
}
