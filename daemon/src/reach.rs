//! The way of `suture jobs` to the jobs of a hot folder: through its daemon while one runs, else through the store itself.
//!
//! While a daemon starts it has the store and does not answer yet, and while one ends, or a worker outlives a killed one, the store is
//! held for a moment longer than anyone answers. Whoever asks then waits for [`PATIENCE`], and asks again.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::io::{self, ErrorKind};
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use suture_store::{Address, Job, SledStore, StoreError};

use crate::config::default_state;
use crate::control::{DaemonWish, GlanceWish, JobsWish, Refusal, Wish, answer, ask};
use crate::exit::Exit;
use crate::folder::must_answer;
use crate::fsx;
use crate::glance::{Glance, Work};
use crate::ground::shared::is_for_many;
use crate::schedule::Standing;
use crate::shared::{daemon_name, noted, visit};
use crate::{hosts, standstill, watch, watchdog};

/// How long a store that is held while no one answers is waited for.
const PATIENCE: Duration = Duration::from_secs(10);
/// How often it is asked for meanwhile.
const ASK_EVERY: Duration = Duration::from_millis(50);

/// What the end of the other side looks like.
const CUT_OFF: [ErrorKind; 3] = [ErrorKind::UnexpectedEof, ErrorKind::ConnectionReset, ErrorKind::BrokenPipe];

/// Why nothing came of it: a line for people, and how the program ends.
#[derive(Debug)]
pub(crate) struct Failure {
    pub line: String,
    pub exit: Exit,
}

impl Failure {
    fn try_again(line: String) -> Self {
        Self { line, exit: Exit::TryAgain }
    }
}

impl From<Refusal> for Failure {
    fn from(Refusal { line, exit_code }: Refusal) -> Self {
        let exit = match exit_code {
            73 => Exit::Owned,
            75 => Exit::TryAgain,
            _ => Exit::Refused,
        };
        Self { line, exit }
    }
}

impl From<StoreError> for Failure {
    fn from(error: StoreError) -> Self {
        Refusal::from(error).into()
    }
}

/// Does what is wished of the jobs of a hot folder.
///
/// # Errors
/// When `dir` is no hot folder, there is no such job, or neither a daemon answers nor the store can be opened.
pub(crate) fn jobs(dir: &Path, wish: &JobsWish) -> Result<Vec<Job>, Failure> {
    Ok(match daemon_or_store(dir, wish, wish)? {
        Answered::Daemon(jobs) | Answered::Store(jobs) => jobs,
    })
}

/// The same of the jobs of a shared store, whoever serves their folders.
///
/// # Errors
/// When there is no such job or store, or its database does not answer.
pub(crate) fn shared_jobs(address: &Address, wish: &JobsWish) -> Result<Vec<Job>, Failure> {
    Ok(answer(&*visit(address, &daemon_name(Path::new(".")))?, wish)?)
}

/// Who answered: only the store's answer says that no daemon ran.
enum Answered<A> {
    Daemon(A),
    Store(Vec<Job>),
}

/// Asks the daemon for `asked`; while none answers, the store for `instead`, until one of them can tell.
fn daemon_or_store<W: Wish>(dir: &Path, asked: &W, instead: &JobsWish) -> Result<Answered<W::Answer>, Failure> {
    if let Some(answer) = through_daemon(dir, asked)? {
        return Ok(Answered::Daemon(answer));
    }
    let state = state_of(dir).map_err(|error| unseen(dir, &error))?;
    if !fsx::is_folder(&state).map_err(|error| unseen(&state, &error))? {
        return Ok(Answered::Store(Vec::new()));
    }
    watched()?;
    let began = Instant::now();
    loop {
        match through_store(&state, instead) {
            Ok(jobs) => return Ok(Answered::Store(jobs)),
            Err(Unread::Failed(failure)) => return Err(failure),
            Err(Unread::Held(pid)) if began.elapsed() >= PATIENCE => return Err(held(dir, pid)),
            Err(Unread::Held(_)) => std::thread::sleep(ASK_EVERY),
        }
        if let Some(answer) = through_daemon(dir, asked)? {
            return Ok(Answered::Daemon(answer));
        }
    }
}

/// Has a hanging database end this process. Once is enough, however often it is asked.
///
/// # Errors
/// When there is no thread for that.
pub(crate) fn watched() -> Result<(), Failure> {
    static WATCHED: AtomicBool = AtomicBool::new(false);
    let started = if WATCHED.swap(true, Ordering::Relaxed) { Ok(()) } else { watchdog::start(|| watch::end_hanging()) };
    started.map_err(|error| Failure::try_again(format!("no thread can be started: {error}; try again")))
}

/// Does what is wished of the daemon of a hot folder, and says how it stands; without one, notes the wish for the next, and there is no
/// standing.
///
/// # Errors
/// When `dir` is no hot folder, the daemon does not answer, or the wish cannot be noted.
pub(crate) fn daemon(dir: &Path, wish: &DaemonWish) -> Result<Option<Standing>, Failure> {
    if *wish != DaemonWish::Standing && is_for_many(dir).map_err(|error| unseen(dir, &error))? {
        let line = format!(
            "{}: daemons of several machines serve it, and a pause of one keeps no other from work; `suture hosts drain NAME --store …` has a machine rest",
            dir.display()
        );
        return Err(Failure { line, exit: Exit::Refused });
    }
    if let Some(standing) = through_daemon(dir, wish)? {
        return Ok(Some(standing));
    }
    let note = |paused| standstill::set(&state_of(dir)?, paused);
    let noted = match wish {
        DaemonWish::Pause => note(true),
        DaemonWish::Resume => note(false),
        DaemonWish::Standing => return Ok(None),
    };
    noted.map_err(|error| Failure::try_again(format!("the pause cannot be noted: {error}")))?;
    // One that began to answer meanwhile may have looked for a note before there was one.
    through_daemon(dir, wish)
}

/// How the daemon of a hot folder stands, or its store, if none runs.
///
/// # Errors
/// When `dir` is no hot folder, or neither a daemon answers nor the store can be read.
pub(crate) fn glance(dir: &Path, store: Option<&Address>) -> Result<Glance, Failure> {
    if let Some(address) = store {
        return shared_glance(address);
    }
    let jobs = match daemon_or_store(dir, &GlanceWish, &JobsWish::List)? {
        Answered::Daemon(glance) => return Ok(glance),
        Answered::Store(jobs) => jobs,
    };
    let state = state_of(dir).map_err(|error| unseen(dir, &error))?;
    let paused = standstill::is_set(&state).map_err(|error| unseen(&state, &error))?;
    Ok(Glance::of_jobs(jobs, paused.then(|| standstill::WORDS.into()).into_iter().collect(), Some(&state)))
}

fn shared_glance(address: &Address) -> Result<Glance, Failure> {
    let store = visit(address, &daemon_name(Path::new(".")))?;
    let hosts = store.hosts()?;
    let folders: BTreeSet<&String> = hosts.iter().flat_map(|host| &host.folders).collect();
    let stranded = hosts::stranded(&*store, &hosts, &folders.into_iter().cloned().collect::<Vec<_>>())?;
    let glance = Glance::of_jobs(answer(&*store, &JobsWish::List)?, Vec::new(), None);
    Ok(Glance { hosts, standing: Standing { stranded, ..glance.standing }, ..glance })
}

/// The jobs that the daemon of a hot folder has in work; none, if none runs.
///
/// # Errors
/// When `dir` is no hot folder, or the daemon does not answer.
pub(crate) fn work(dir: &Path) -> Result<Vec<Work>, Failure> {
    Ok(through_daemon(dir, &GlanceWish)?.map(|glance| glance.work).unwrap_or_default())
}

/// Where the job store of a hot folder is.
///
/// # Errors
/// When the note of its place cannot be read: another store would answer for other jobs.
pub(crate) fn state_of(dir: &Path) -> io::Result<PathBuf> {
    let noted = fsx::if_there(std::fs::read(dir.join(".suture").join("state-path")))?;
    Ok(noted.map_or_else(|| default_state(dir), |path| OsString::from_vec(path).into()))
}

/// Nothing can be told of a path: try again.
pub(crate) fn unseen(path: &Path, error: &io::Error) -> Failure {
    Failure::try_again(format!("{}: cannot be looked at: {error}; try again", path.display()))
}

/// Refuses what is no hot folder.
///
/// # Errors
/// When it is none, or cannot be looked at.
pub(crate) fn must_be_hot(dir: &Path) -> Result<(), Failure> {
    must_answer(dir).map_err(|error| {
        let line = format!("{error}. If its daemon serves other folders, ask by one of those");
        Failure::try_again(line)
    })?;
    if fsx::is_folder(&dir.join(".suture")).map_err(|error| unseen(dir, &error))? {
        return Ok(());
    }
    Err(Failure { line: format!("{}: is no hot folder (try --dir DIR)", dir.display()), exit: Exit::Refused })
}

/// The running daemon's answer; `None` if none runs.
fn through_daemon<W: Wish>(dir: &Path, wish: &W) -> Result<Option<W::Answer>, Failure> {
    must_be_hot(dir)?;
    match ask(dir, wish) {
        Ok(answer) => Ok(answer.transpose()?),
        Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
            Err(Failure::try_again("the daemon does not answer: it is stopped, or very busy; try again".into()))
        }
        Err(error) if error.kind() == ErrorKind::PermissionDenied => {
            let line =
                format!("{}: no right to ask its daemon ({error}); run this as the daemon's user, or as root", dir.display());
            Err(Failure { line, exit: Exit::Refused })
        }
        // It died over it; what only looks can be asked of the next one.
        Err(error) if CUT_OFF.contains(&error.kind()) && wish.only_looks() => Ok(None),
        Err(error) => {
            let line = format!("the daemon's answer was cut off or cannot be understood: {error}; try again");
            Err(Failure::try_again(line))
        }
    }
}

/// Why the store says nothing.
enum Unread {
    /// Someone has it, who may be about to answer, or to let go of it.
    Held(Option<u32>),
    Failed(Failure),
}

impl<E: Into<Failure>> From<E> for Unread {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

fn through_store(state: &Path, wish: &JobsWish) -> Result<Vec<Job>, Unread> {
    if let Some(address) = noted(state).map_err(|error| unseen(state, &error))? {
        return Err(Unread::Failed(elsewhere(state, &address)));
    }
    let held = |error| match error {
        StoreError::Locked { pid, .. } => Unread::Held(pid),
        error => Unread::from(error),
    };
    // To look needs no right to write, and no room.
    match wish {
        JobsWish::List => SledStore::peek(state).map_err(held),
        JobsWish::Show(id) => {
            let job = SledStore::peek(state).map_err(held)?.into_iter().find(|job| job.id == *id);
            Ok(vec![job.ok_or(StoreError::Unknown(*id))?])
        }
        JobsWish::Retry(_) | JobsWish::Cancel(_) | JobsWish::Rank(..) | JobsWish::Decide(..) => {
            Ok(answer(&SledStore::open(state).map_err(held)?, wish)?)
        }
    }
}

/// The jobs are in a shared store, which no daemon asks for whoever wants to know.
pub(crate) fn elsewhere(state: &Path, address: &str) -> Failure {
    let line = format!(
        "{}: the jobs are in {address}, and no daemon answers here; add --store {address} to look there",
        state.display()
    );
    Failure { line, exit: Exit::Refused }
}

fn held(dir: &Path, pid: Option<u32>) -> Failure {
    let who = pid.map(|pid| format!(" (process {pid})")).unwrap_or_default();
    Failure::try_again(format!(
        "{}: a daemon{who} has had the job store for {} s and does not answer: it is starting, ending or stopped; try again",
        dir.display(),
        PATIENCE.as_secs()
    ))
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead, BufReader};
    use std::os::unix::net::UnixListener;

    use suture_store::Time;

    use super::*;

    fn hot() -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join(".suture")).unwrap();
        dir
    }

    /// The store is let go of after a while, as by a daemon that ends.
    #[test]
    fn a_store_that_is_held_is_waited_for() {
        let dir = hot();
        let store = SledStore::open(&state_of(dir.path()).unwrap()).unwrap();
        let asked = Instant::now();
        let jobs = std::thread::scope(|scope| {
            let asking = scope.spawn(|| jobs(dir.path(), &JobsWish::List));
            std::thread::sleep(Duration::from_millis(300));
            assert!(!asking.is_finished(), "it gave up at once");
            drop(store);
            asking.join().unwrap()
        });
        assert!(jobs.unwrap().is_empty() && asked.elapsed() < PATIENCE);
    }

    /// One line, and what to do.
    #[test]
    fn a_store_that_stays_held_is_said_so() {
        let dir = hot();
        let _store = SledStore::open(&state_of(dir.path()).unwrap()).unwrap();
        let asked = Instant::now();
        let failure = jobs(dir.path(), &JobsWish::List).unwrap_err();
        assert!(asked.elapsed() >= PATIENCE && failure.exit == Exit::TryAgain);
        let pid = std::process::id().to_string();
        assert!(
            failure.line.contains(&pid) && failure.line.ends_with("try again") && !failure.line.contains('\n'),
            "{failure:?}"
        );
    }

    /// A daemon that starts has the store before it answers. Who asks then is told of a daemon that runs.
    #[test]
    fn a_daemon_that_begins_to_answer_is_not_taken_for_none() {
        let dir = hot();
        let _store = SledStore::open(&state_of(dir.path()).unwrap()).unwrap();
        let glance = std::thread::scope(|scope| {
            let asking = scope.spawn(|| glance(dir.path(), None));
            std::thread::sleep(Duration::from_millis(300));
            let listener = UnixListener::bind(dir.path().join(".suture/control.sock")).unwrap();
            let (stream, _) = listener.accept().unwrap();
            BufReader::new(&stream).read_line(&mut String::new()).unwrap();
            let runs = Glance { since: Some(Time(7)), ..Glance::default() };
            serde_json::to_writer(stream, &Ok::<_, Refusal>(runs)).unwrap();
            asking.join().unwrap()
        });
        assert_eq!(glance.unwrap().since, Some(Time(7)));
    }

    #[test]
    fn a_folder_that_is_not_hot_is_refused_at_once() {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(jobs(dir.path(), &JobsWish::List).unwrap_err().exit, Exit::Refused);
        assert_eq!(daemon(dir.path(), &DaemonWish::Pause).unwrap_err().exit, Exit::Refused);
        assert!(!dir.path().join(".suture").exists());
    }
}
