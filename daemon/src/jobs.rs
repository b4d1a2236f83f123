//! `suture jobs`: what became of every dropped file, and what an operator may want of it.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

use suture_core::Report;
use suture_store::job::Kind;
use suture_store::{Address, Decision, Job, JobId, State, Verdict};

use crate::cli::{JobsArgs, JobsCommand, Said};
use crate::control::{DaemonWish, JobsWish};
use crate::exit::Exit;
use crate::fsx;
use crate::glance::Work;
use crate::left::{area, report_path};
use crate::reach::{self, Failure};
use crate::rebuild::{Rebuilt, rebuild};
use crate::say::{complain, plain, print};
use crate::schedule::Standing;
use crate::shown::hint;
use crate::units::{show_count, show_when};
use crate::{standstill, table};

/// Does what the command line asks.
pub(crate) fn run(args: &JobsArgs) -> Exit {
    let wish = match &args.command {
        JobsCommand::Pause => return paused(&args.dir, true),
        JobsCommand::Resume => return paused(&args.dir, false),
        JobsCommand::Drain => return drained(&args.dir),
        JobsCommand::Rebuild => return rebuilt(&args.dir),
        JobsCommand::List { .. } => JobsWish::List,
        JobsCommand::Show { id } => JobsWish::Show(JobId(*id)),
        JobsCommand::Retry { id } => JobsWish::Retry(JobId(*id)),
        JobsCommand::Cancel { id } => JobsWish::Cancel(JobId(*id)),
        JobsCommand::Approve { id, said } => match decided(*id, Verdict::Approved, said) {
            Ok(wish) => wish,
            Err(failure) => return fail(&failure),
        },
        JobsCommand::Reject { id, said } => match decided(*id, Verdict::Rejected, said) {
            Ok(wish) => wish,
            Err(failure) => return fail(&failure),
        },
        JobsCommand::Priority { id, priority } => JobsWish::Rank(JobId(*id), *priority),
    };
    let asked = match &args.store {
        Some(address) => reach::shared_jobs(address, &wish),
        None => reach::jobs(&args.dir, &wish),
    };
    let mut jobs = match asked {
        Ok(jobs) => jobs,
        Err(failure) => return fail(&failure),
    };
    let (folders, mut summary) = (Folders::of(&jobs), String::new());
    if let JobsCommand::List { state, folder, newest } = &args.command {
        if let Some(name) = folder.as_ref().filter(|name| !jobs.is_empty() && !folders.0.contains(*name)) {
            return fail(&Failure { line: folders.has_no(name), exit: Exit::Refused });
        }
        jobs.retain(|job| folder.as_ref().is_none_or(|name| job.source.folder == *name));
        summary = summary_of(&jobs);
        jobs.retain(|job| state.is_none_or(|state| job.kind() == state));
        jobs.drain(..jobs.len().saturating_sub(newest.unwrap_or(usize::MAX)));
    }
    // A daemon knows of its own work alone.
    let is_shared = args.store.is_some();
    let work = if is_shared { Vec::new() } else { at_work(&args.dir, &jobs) };
    let mut text = String::new();
    for job in &jobs {
        let work = work_of(job, &work);
        text += &match &args.command {
            _ if args.json => as_json(job, work),
            JobsCommand::Show { .. } => show(&args.dir, job, work),
            _ => folders.line(job, work),
        };
    }
    if jobs.is_empty() && !args.json {
        text = "no jobs\n".into();
    } else if let (JobsCommand::List { .. }, false) = (&args.command, args.json) {
        text += &format!("{summary}\n");
    }
    if let (JobsCommand::List { .. }, false, false) = (&args.command, args.json, is_shared) {
        text += &trouble(&args.dir);
    }
    print(text.as_bytes(), Exit::Good)
}

/// The troubles that keep a daemon from work, in lines.
fn trouble(dir: &Path) -> String {
    let Standing { held, away, full, untold, stranded, .. } = standing(dir);
    let mut text: String = held.iter().map(|why| format!("nothing new is taken: {why}\n")).collect();
    text.extend(untold.iter().map(|who| format!("not told yet: {}\n", plain(who))));
    text.extend(away.iter().map(|why| format!("out of reach: {}\n", plain(why))));
    text.extend(full.iter().map(|why| format!("disk full: {}\n", plain(why))));
    text.extend(stranded.iter().map(|what| format!("no host for it: {}\n", plain(what))));
    text
}

/// How far those of these jobs are that are in work, as far as a daemon says so.
fn at_work(dir: &Path, jobs: &[Job]) -> Vec<Work> {
    let any = jobs.iter().any(|job| job.kind() == Kind::Running);
    if any { reach::work(dir).unwrap_or_default() } else { Vec::new() }
}

fn work_of<'a>(job: &Job, work: &'a [Work]) -> Option<&'a Work> {
    work.iter().find(|work| work.job == job.id)
}

/// A job as a line of JSON.
fn as_json(job: &Job, work: Option<&Work>) -> String {
    serde_json::to_string(&Shown::new(job, work)).unwrap_or_default() + "\n"
}

/// All jobs of a hot folder, as `list --json` prints them.
///
/// # Errors
/// As [`reach::jobs`].
pub(crate) fn all_as_json(dir: &Path, store: Option<&Address>) -> Result<String, Failure> {
    if let Some(address) = store {
        return Ok(reach::shared_jobs(address, &JobsWish::List)?.iter().map(|job| as_json(job, None)).collect());
    }
    let jobs = reach::jobs(dir, &JobsWish::List)?;
    let work = at_work(dir, &jobs);
    Ok(jobs.iter().map(|job| as_json(job, work_of(job, &work))).collect())
}

/// A person's decision.
fn decided(id: u64, verdict: Verdict, said: &Said) -> Result<JobsWish, Failure> {
    let decision = Decision::new(verdict, &said.by, &said.note);
    let decision = decision.map_err(|error| Failure { line: error.to_string(), exit: Exit::Refused })?;
    Ok(JobsWish::Decide(JobId(id), decision))
}

/// Pauses the daemon of a hot folder, or lets it go on; if none runs, the next one.
fn paused(dir: &Path, paused: bool) -> Exit {
    let how = if paused { "paused: nothing new is taken" } else { "files are taken again" };
    match reach::daemon(dir, &if paused { DaemonWish::Pause } else { DaemonWish::Resume }) {
        Ok(Some(Standing { running, .. })) if paused && running > 0 => say(&format!("{how}; {running} in work will be finished")),
        Ok(Some(_)) => say(how),
        Ok(None) => say(&format!("{how}, when a daemon runs again")),
        Err(failure) => fail(&failure),
    }
}

/// Pauses, and waits for the jobs in work.
fn drained(dir: &Path) -> Exit {
    let mut wish = DaemonWish::Pause;
    loop {
        match reach::daemon(dir, &wish) {
            Ok(Some(Standing { running: 1.., .. })) => std::thread::sleep(LOOK_EVERY),
            Ok(_) => return say("drained: nothing is in work; `suture jobs resume` goes on"),
            Err(failure) => return fail(&failure),
        }
        wish = DaemonWish::Standing;
    }
}

/// Begins a new store in the place of a damaged one.
fn rebuilt(dir: &Path) -> Exit {
    match rebuild(dir) {
        Ok(Rebuilt { aside, jobs }) => say(&format!(
            "{} jobs came back from receipts; the damaged store is kept in {}. The next `suture watch` takes up what waits in in/",
            show_count(jobs as u64),
            plain(&aside.display().to_string())
        )),
        Err(failure) => fail(&failure),
    }
}

/// How often a drain looks.
const LOOK_EVERY: Duration = Duration::from_millis(200);

fn say(line: &str) -> Exit {
    print(format!("{line}\n").as_bytes(), Exit::Good)
}

fn fail(failure: &Failure) -> Exit {
    complain(&failure.line);
    failure.exit
}

/// What keeps a daemon from work, if one runs and something does, or would keep the next one.
fn standing(dir: &Path) -> Standing {
    match reach::daemon(dir, &DaemonWish::Standing) {
        Ok(Some(standing)) => standing,
        Ok(None) if reach::state_of(dir).and_then(|state| standstill::is_set(&state)).is_ok_and(|paused| paused) => {
            Standing { held: vec![standstill::WORDS.into()], ..Standing::default() }
        }
        _ => Standing::default(),
    }
}

/// All jobs of the store of a hot folder, by number.
///
/// # Errors
/// A line for people, and what it comes to.
pub(crate) fn all(dir: &Path) -> Result<Vec<Job>, (String, Exit)> {
    reach::jobs(dir, &JobsWish::List).map_err(|failure| (failure.line, failure.exit))
}

/// A job with what its state implies.
#[derive(serde::Serialize)]
struct Shown<'a> {
    kind: &'static str,
    /// The job of whose result its own is a copy.
    #[serde(skip_serializing_if = "Option::is_none")]
    reused: Option<JobId>,
    /// How far its work is, once that is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    progress: Option<Far<'a>>,
    #[serde(flatten)]
    job: &'a Job,
}

/// How far work is.
#[derive(serde::Serialize)]
struct Far<'a> {
    stage: &'a str,
    doing: &'a str,
    /// Of the whole.
    percent: u8,
    #[serde(skip_serializing_if = "Option::is_none")]
    seconds_left: Option<u64>,
}

impl<'a> Shown<'a> {
    fn new(job: &'a Job, work: Option<&'a Work>) -> Self {
        let far = |work: &'a Work| {
            let Work { stage, doing, percent, seconds_left, .. } = work;
            Some(Far { stage: stage.as_ref()?, doing: doing.as_ref()?, percent: (*percent)?, seconds_left: *seconds_left })
        };
        Self { kind: job.kind().name(), reused: reused(job), progress: work.and_then(far), job }
    }
}

/// The job of whose result this one's is a copy.
fn reused(job: &Job) -> Option<JobId> {
    job.publication().and_then(|publication| publication.reused)
}

/// What there is to add to a job's state.
fn note(job: &Job) -> String {
    match &job.state {
        State::Noticed { reason } => reason.clone(),
        State::Running { cancel: true, .. } => "being stopped".into(),
        State::Ended { publication } => match (&publication.output, publication.reason.is_empty()) {
            (Some(output), is_all) if is_all || publication.ending.is_good() => {
                let copied = publication.reused.map(|job| format!(", reused from job {job}")).unwrap_or_default();
                let note = hint(job).map(|note| format!("; note: {note}")).unwrap_or_default();
                format!(
                    "→ {}/{output}{copied}{note}",
                    if publication.ending.is_good() { "out" } else { area(publication.ending.area()) }
                )
            }
            _ => publication.reason.clone(),
        },
        State::Approved { .. } if job.note.is_empty() => "approved; it is published next, by the daemon that runs".into(),
        State::Cancelled { why } => match why {
            suture_store::job::Withdrawal::Operator => "by an operator".into(),
            suture_store::job::Withdrawal::Changed => "the file changed; it is a new job".into(),
            suture_store::job::Withdrawal::Vanished => "the file is gone".into(),
        },
        _ => job.note.clone(),
    }
}

/// Who decided, in words.
fn decision(job: &Job) -> String {
    let word = |said: &Decision| {
        let note = if said.note.is_empty() { String::new() } else { format!(": {}", said.note) };
        format!("{said} at {}{note}", show_when(said.at.0))
    };
    job.decision().map(word).unwrap_or_default()
}

/// The hot folders of jobs, by name. Of several, each line says its own.
pub(crate) struct Folders(BTreeSet<String>);

impl Folders {
    pub(crate) fn of<'a>(jobs: impl IntoIterator<Item = &'a Job>) -> Self {
        Self(jobs.into_iter().map(|job| job.source.folder.clone()).collect())
    }

    /// A job in one line, with how far it is.
    pub(crate) fn line(&self, job: &Job, work: Option<&Work>) -> String {
        let width = self.0.iter().map(|name| name.chars().count()).max().filter(|_| self.0.len() > 1);
        line_of(job, &width.map(|width| format!("{:<width$}  ", job.source.folder)).unwrap_or_default(), work)
    }

    fn has_no(&self, name: &str) -> String {
        let names = self.0.iter().map(|name| format!("`{}`", plain(name))).collect::<Vec<_>>().join(", ");
        format!("no job is of a folder `{name}`; there are jobs of {names}")
    }
}

fn line_of(job: &Job, folder: &str, work: Option<&Work>) -> String {
    let (id, kind, since) = (job.id.0, job.kind().name(), show_when(job.changed.0));
    let priority = if job.priority.is_default() { String::new() } else { format!("priority {}  ", job.priority) };
    let words = [work.map(Work::words).unwrap_or_default(), note(job)];
    let note = words.iter().filter(|words| !words.is_empty()).map(String::as_str).collect::<Vec<_>>().join(", ");
    let said = job.decision().map(|said| format!("{}{said}", if note.is_empty() { "" } else { ", " }));
    let line = format!(
        "{id:>6}  {since}  {kind:<12} {folder}{:<32} {priority}{note}{}",
        job.source.path.to_string(),
        said.unwrap_or_default()
    );
    line.trim_end().to_owned() + "\n"
}

/// How many jobs are in which state, and of how many of them the result is a copy.
fn summary_of(jobs: &[Job]) -> String {
    let count =
        |kind: Kind, copied: bool| jobs.iter().filter(|job| job.kind() == kind && (!copied || reused(job).is_some())).count();
    let show = |count: usize| show_count(count as u64);
    let words = |kind: Kind| match (count(kind, false), count(kind, true)) {
        (0, _) => None,
        (all, 0) => Some(format!("{} {}", show(all), kind.name())),
        (all, copies) => Some(format!("{} {} ({} reused)", show(all), kind.name(), show(copies))),
    };
    Kind::ALL.into_iter().filter_map(words).collect::<Vec<_>>().join(", ")
}

fn show(dir: &Path, job: &Job, work: Option<&Work>) -> String {
    let (place, path) = job.original();
    let mut text = format!(
        "job {}: {} in {}\n  file      {}/{path}\n  profile   {}\n  priority  {}\n  attempts  {}\n  came      {}\n  changed   {}\n",
        job.id,
        job.kind(),
        job.source.folder,
        area(place),
        job.source.profile,
        job.priority,
        job.attempts,
        show_when(job.submitted.0),
        show_when(job.changed.0)
    );
    let progress = work.map(Work::words).unwrap_or_default();
    for (name, words) in [("progress", progress), ("note", note(job)), ("decision", decision(job))] {
        if !words.is_empty() {
            text += &format!("  {name:<8}  {words}\n");
        }
    }
    // With several folders to a store, it may be in another one.
    if let Some(path) = report_path(dir, job).filter(|path| fsx::exists(path).unwrap_or(false)) {
        text += &format!("  report    {}\n", plain(&path.display().to_string()));
        if let Ok(bytes) = std::fs::read(&path)
            && let Ok(report) = serde_json::from_slice::<Report>(&bytes)
        {
            text.push('\n');
            text += &table::render(&report);
        }
    }
    text
}
