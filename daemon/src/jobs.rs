//! `suture jobs`: what became of every dropped file, and what an operator may want of it.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use jiff::Timestamp;
use jiff::tz::TimeZone;
use suture_core::Report;
use suture_store::job::{Area, Kind};
use suture_store::{Job, JobId, SledStore, State, StoreError, Time};

use crate::cli::{JobsArgs, JobsCommand};
use crate::config::default_state;
use crate::control::{Answer, Wish, answer, ask};
use crate::exit::Exit;
use crate::receipt::REPORT;
use crate::say::{complain, plain};
use crate::schedule::Standing;
use crate::{standstill, table, watch, watchdog};

/// Does what the command line asks.
pub(crate) fn run(args: &JobsArgs) -> Exit {
    let wish = match &args.command {
        JobsCommand::Pause => return paused(&args.dir, true),
        JobsCommand::Resume => return paused(&args.dir, false),
        JobsCommand::Drain => return drained(&args.dir),
        JobsCommand::List { .. } => Wish::List,
        JobsCommand::Show { id } => Wish::Show(JobId(*id)),
        JobsCommand::Retry { id } => Wish::Retry(JobId(*id)),
        JobsCommand::Cancel { id } => Wish::Cancel(JobId(*id)),
    };
    let mut jobs = match reach(&args.dir, &wish) {
        Ok(Answer::Jobs(jobs)) => jobs,
        Ok(Answer::Standing(_)) => Vec::new(),
        Ok(Answer::Failed { line, exit_code }) => return fail(&line, exit_code),
        Err((line, exit)) => return fail(&line, exit.code()),
    };
    let summary = summary(&jobs);
    if let JobsCommand::List { state, newest } = &args.command {
        jobs.retain(|job| state.is_none_or(|state| job.kind() == state));
        jobs.drain(..jobs.len().saturating_sub(newest.unwrap_or(usize::MAX)));
    }
    let mut text = String::new();
    for job in &jobs {
        if args.json {
            text += &serde_json::to_string(&Shown::new(job)).unwrap_or_default();
            text.push('\n');
        } else {
            text += &match args.command {
                JobsCommand::Show { .. } => show(&args.dir, job),
                _ => line(job),
            };
        }
    }
    if jobs.is_empty() && !args.json {
        text = "no jobs\n".into();
    } else if let (JobsCommand::List { .. }, false) = (&args.command, args.json) {
        text += &format!("{summary}\n");
    }
    if let (JobsCommand::List { .. }, false) = (&args.command, args.json) {
        let Standing { held, away, .. } = standing(&args.dir);
        text.extend(held.iter().map(|why| format!("nothing new is taken: {why}\n")));
        text.extend(away.iter().map(|why| format!("out of reach: {}\n", plain(why))));
    }
    // A reader that has gone away has seen enough.
    let _ = std::io::stdout().write_all(text.as_bytes());
    Exit::Good
}

/// Pauses the daemon of a hot folder, or lets it go on; if none runs, the next one.
fn paused(dir: &Path, paused: bool) -> Exit {
    let how = if paused { "paused: nothing new is taken" } else { "files are taken again" };
    match steer(dir, if paused { &Wish::Pause } else { &Wish::Resume }) {
        Ok(Some(Standing { running, .. })) if paused && running > 0 => say(&format!("{how}; {running} in work will be finished")),
        Ok(Some(_)) => say(how),
        Ok(None) => say(&format!("{how}, when a daemon runs again")),
        Err((line, exit)) => fail(&line, exit.code()),
    }
}

/// Pauses, and waits for the jobs in work.
fn drained(dir: &Path) -> Exit {
    let mut wish = Wish::Pause;
    loop {
        match steer(dir, &wish) {
            Ok(Some(Standing { running: 1.., .. })) => std::thread::sleep(LOOK_EVERY),
            Ok(_) => return say("drained: nothing is in work; `suture jobs resume` goes on"),
            Err((line, exit)) => return fail(&line, exit.code()),
        }
        wish = Wish::Standing;
    }
}

/// How often a drain looks.
const LOOK_EVERY: Duration = Duration::from_millis(200);

fn say(line: &str) -> Exit {
    let _ = writeln!(std::io::stdout(), "{line}");
    Exit::Good
}

/// What keeps a daemon from work, if one runs and something does, or would keep the next one.
fn standing(dir: &Path) -> Standing {
    match steer(dir, &Wish::Standing) {
        Ok(Some(standing)) => standing,
        Ok(None) if standstill::is_set(&state_of(dir)) => {
            Standing { held: vec![standstill::WORDS.into()], ..Standing::default() }
        }
        _ => Standing::default(),
    }
}

/// Asks the daemon of a hot folder; without one, notes the wish for the next, and there is no standing.
fn steer(dir: &Path, wish: &Wish) -> Result<Option<Standing>, (String, Exit)> {
    match asked(dir, wish)? {
        Some(Answer::Standing(standing)) => Ok(Some(standing)),
        Some(Answer::Failed { line, .. }) => Err((line, Exit::TryAgain)),
        Some(Answer::Jobs(_)) => Err(("the daemon's answer cannot be understood".into(), Exit::TryAgain)),
        None => {
            let note = |paused| standstill::set(&state_of(dir), paused);
            let noted = match wish {
                Wish::Pause => note(true),
                Wish::Resume => note(false),
                _ => Ok(()),
            };
            noted.map(|()| None).map_err(|error| (format!("the pause cannot be noted: {error}"), Exit::TryAgain))
        }
    }
}

fn fail(line: &str, code: u8) -> Exit {
    complain(&line);
    match code {
        73 => Exit::Owned,
        75 => Exit::TryAgain,
        _ => Exit::Refused,
    }
}

/// Through the running daemon, or through the store itself.
pub(crate) fn reach(dir: &Path, wish: &Wish) -> Result<Answer, (String, Exit)> {
    if let Some(answer) = asked(dir, wish)? {
        return Ok(answer);
    }
    let state = state_of(dir);
    if !state.is_dir() {
        return Ok(Answer::Jobs(Vec::new()));
    }
    watchdog::start(|| watch::end_hanging()).map_err(|error| (format!("no thread can be started: {error}"), Exit::TryAgain))?;
    let failed = |error: StoreError| (error.to_string(), if error.exit_code() == 73 { Exit::Owned } else { Exit::TryAgain });
    // To look needs no right to write, and no room.
    match wish {
        Wish::List => Ok(Answer::Jobs(SledStore::peek(&state).map_err(failed)?)),
        Wish::Show(id) => {
            let job = SledStore::peek(&state).map_err(failed)?.into_iter().find(|job| job.id == *id);
            let unknown = || Answer::failed(&StoreError::Unknown(*id));
            Ok(job.map_or_else(unknown, |job| Answer::Jobs(vec![job])))
        }
        Wish::Retry(_) | Wish::Cancel(_) | Wish::Pause | Wish::Resume | Wish::Standing => {
            Ok(answer(&SledStore::open(&state).map_err(failed)?, wish))
        }
    }
}

/// All jobs of the store of a hot folder, by number.
///
/// # Errors
/// A line for people, and what it comes to.
pub(crate) fn all(dir: &Path) -> Result<Vec<Job>, (String, Exit)> {
    match reach(dir, &Wish::List)? {
        Answer::Jobs(jobs) => Ok(jobs),
        Answer::Standing(_) => Ok(Vec::new()),
        Answer::Failed { line, .. } => Err((line, Exit::TryAgain)),
    }
}

/// The running daemon's answer; `None` if none runs.
fn asked(dir: &Path, wish: &Wish) -> Result<Option<Answer>, (String, Exit)> {
    if !dir.join(".suture").is_dir() {
        return Err((format!("{}: is no hot folder (try --dir DIR)", dir.display()), Exit::Refused));
    }
    ask(dir, wish).map_err(|error| {
        let silent = matches!(error.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut);
        let line = match silent {
            true => "the daemon does not answer: it is stopped, or very busy; try again".into(),
            false => format!("the daemon's answer was cut off or cannot be understood: {error}; try again"),
        };
        (line, Exit::TryAgain)
    })
}

fn state_of(dir: &Path) -> PathBuf {
    use std::os::unix::ffi::OsStringExt;
    match std::fs::read(dir.join(".suture").join("state-path")) {
        Ok(path) => std::ffi::OsString::from_vec(path).into(),
        Err(_) => default_state(dir),
    }
}

/// A job with what its state implies.
#[derive(serde::Serialize)]
struct Shown<'a> {
    kind: &'static str,
    #[serde(flatten)]
    job: &'a Job,
}

impl<'a> Shown<'a> {
    fn new(job: &'a Job) -> Self {
        Self { kind: job.kind().name(), job }
    }
}

/// What there is to add to a job's state.
fn note(job: &Job) -> String {
    match &job.state {
        State::Noticed { reason } => reason.clone(),
        State::Running { cancel: true, .. } => "being stopped".into(),
        State::Ended { publication } => match (&publication.output, publication.reason.is_empty()) {
            (Some(output), true) => {
                format!("→ {}/{output}", if publication.ending.is_good() { "out" } else { area(publication.ending.area()) })
            }
            _ => publication.reason.clone(),
        },
        State::Cancelled { why } => match why {
            suture_store::job::Withdrawal::Operator => "by an operator".into(),
            suture_store::job::Withdrawal::Changed => "the file changed; it is a new job".into(),
            suture_store::job::Withdrawal::Vanished => "the file is gone".into(),
        },
        _ => job.note.clone(),
    }
}

fn area(area: Area) -> &'static str {
    match area {
        Area::In => "in",
        Area::Done => "done",
        Area::Failed => "failed",
        Area::Quarantine => "quarantine",
    }
}

fn line(job: &Job) -> String {
    let (id, kind, since) = (job.id.0, job.kind().name(), when(job.changed));
    format!("{id:>6}  {since}  {kind:<12} {:<32} {}", job.source.path.to_string(), note(job)).trim_end().to_owned() + "\n"
}

/// Day and time where the machine is.
fn when(time: Time) -> String {
    let zoned = |at: Timestamp| at.to_zoned(TimeZone::system()).strftime("%Y-%m-%d %H:%M:%S").to_string();
    i64::try_from(time.0).ok().and_then(|ms| Timestamp::from_millisecond(ms).ok()).map_or_else(|| "?".into(), zoned)
}

/// How many jobs are in which state.
fn summary(jobs: &[Job]) -> String {
    let count = |kind: Kind| jobs.iter().filter(|job| job.kind() == kind).count();
    let counts = Kind::ALL.into_iter().map(|kind| (kind, count(kind))).filter(|(_, count)| *count > 0);
    counts.map(|(kind, count)| format!("{count} {}", kind.name())).collect::<Vec<_>>().join(", ")
}

fn show(dir: &Path, job: &Job) -> String {
    let (place, path) = job.original();
    let mut text = format!(
        "job {}: {} in {}\n  file      {}/{path}\n  profile   {}\n  attempts  {}\n  came      {}\n  changed   {}\n",
        job.id,
        job.kind(),
        job.source.folder,
        area(place),
        job.source.profile,
        job.attempts,
        when(job.submitted),
        when(job.changed)
    );
    let note = note(job);
    if !note.is_empty() {
        text += &format!("  note      {note}\n");
    }
    // With several folders to a store, it may be in another one.
    if let Some(path) = report_path(dir, job).filter(|path| path.exists()) {
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

/// Where the report of a finished job is.
pub(crate) fn report_path(dir: &Path, job: &Job) -> Option<PathBuf> {
    let State::Ended { publication } = &job.state else { return None };
    let (folder, base) = if publication.ending.is_good() {
        ("out", publication.output.as_ref()?)
    } else {
        (area(publication.ending.area()), publication.original.as_ref()?)
    };
    let mut name = dir.join(folder).join(base.to_path()).into_os_string();
    name.push(REPORT);
    Some(name.into())
}
