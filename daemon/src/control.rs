//! How `suture jobs` reaches the jobs: through a socket in the hot folder while its daemon runs (the store has one owner), else
//! by opening the store ([`crate::reach`]). Either way the same [`JobsWish`] is answered alike; a [`DaemonWish`] only a daemon can answer.

use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
use std::net::Shutdown;
use std::os::fd::AsRawFd;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use suture_store::patience::brief;
use suture_store::{Control, Decision, Ending, Job, JobId, JobStore, Kind, Priority, Query, StoreError, Verdict};

use crate::attempt::Context;
use crate::force::folder_for;
use crate::fsx::Identity;
use crate::glance::{Glance, standing};
use crate::left::{area, result_path};
use crate::publish::approved::{NO_ATTEMPT, unfit};
use crate::schedule::{Hold, Standing};
use crate::standstill;

/// A request is one line of at most this many bytes.
const LONGEST_WISH: u64 = 4096;
/// How long either side waits for the other.
const PATIENCE: Duration = Duration::from_secs(10);
/// The same where nobody else can be served meanwhile.
const SHORT_PATIENCE: Duration = Duration::from_millis(500);
/// How often the daemon's side looks whether it is to end.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// Requests answered at the same time; further ones wait.
const AT_ONCE: usize = 16;

/// What is asked of the jobs: whoever has the store can answer ([`answer`]).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum JobsWish {
    List,
    Show(JobId),
    Retry(JobId),
    Cancel(JobId),
    /// It is wanted sooner, or later.
    Rank(JobId, Priority),
    /// A person says whether a result that needs review is to be used.
    Decide(JobId, Decision),
}

/// What is asked of a daemon: only one that runs can answer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum DaemonWish {
    /// Nothing new is to be taken.
    Pause,
    /// It is to be taken again.
    Resume,
    /// What keeps it from work?
    Standing,
}

/// A look at all of a daemon.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct GlanceWish;

/// One line on the socket.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Request {
    Jobs(JobsWish),
    Daemon(DaemonWish),
    Glance(GlanceWish),
}

impl From<JobsWish> for Request {
    fn from(wish: JobsWish) -> Self {
        Self::Jobs(wish)
    }
}

impl From<DaemonWish> for Request {
    fn from(wish: DaemonWish) -> Self {
        Self::Daemon(wish)
    }
}

impl From<GlanceWish> for Request {
    fn from(wish: GlanceWish) -> Self {
        Self::Glance(wish)
    }
}

/// A wish, and what is answered to it.
pub(crate) trait Wish: Clone + Into<Request> {
    type Answer: DeserializeOwned;

    /// Does it leave everything as it is?
    fn only_looks(&self) -> bool;
}

impl Wish for JobsWish {
    type Answer = Vec<Job>;

    fn only_looks(&self) -> bool {
        matches!(self, Self::List | Self::Show(_))
    }
}

impl Wish for DaemonWish {
    type Answer = Standing;

    fn only_looks(&self) -> bool {
        *self == Self::Standing
    }
}

impl Wish for GlanceWish {
    type Answer = Glance;

    fn only_looks(&self) -> bool {
        true
    }
}

/// A wish that cannot be granted: a line for people, and the exit code for it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Refusal {
    pub line: String,
    pub exit_code: u8,
}

impl From<StoreError> for Refusal {
    fn from(error: StoreError) -> Self {
        Self { line: error.to_string(), exit_code: error.exit_code() }
    }
}

/// Does what is wished of jobs.
///
/// # Errors
/// When there is no such job, or the store cannot do it.
pub(crate) fn answer(store: &dyn JobStore, wish: &JobsWish) -> Result<Vec<Job>, Refusal> {
    let one = match wish {
        JobsWish::List => return Ok(store.list(&Query::default())?),
        JobsWish::Show(id) => store.get(*id)?.ok_or(StoreError::Unknown(*id))?,
        JobsWish::Retry(id) => {
            unless_done(&store.get(*id)?.ok_or(StoreError::Unknown(*id))?)?;
            store.control(*id, Control::Retry)?
        }
        JobsWish::Cancel(id) => store.control(*id, Control::Cancel)?,
        JobsWish::Rank(id, priority) => store.control(*id, Control::Rank(*priority))?,
        JobsWish::Decide(id, decision) => {
            store.get(*id)?.ok_or(StoreError::Unknown(*id)).map_err(Refusal::from).and_then(|job| open_to(&job, decision))?;
            store.control(*id, Control::Decide(decision.clone()))?
        }
    };
    Ok(vec![one])
}

/// Refuses to try a job again whose result is in place, and says how its file is repaired anew: people use that result, and receipt and report speak of it.
fn unless_done(job: &Job) -> Result<(), Refusal> {
    let Some(publication) = job.publication().filter(|_| job.kind() == Kind::Done) else { return Ok(()) };
    let ((place, original), id) = (job.original(), job.id);
    if publication.ending == Ending::Skipped {
        let line = format!(
            "job {id} was skipped ({}); take that out of out/, and drop a copy of {}/{original} into in/",
            publication.reason,
            area(place)
        );
        return Err(Refusal { line, exit_code: 2 });
    }
    let Some(output) = &publication.output else { return Ok(()) };
    let line = format!(
        "job {id} is done, and its result is out/{output}; to have the file repaired anew, drop a copy of {}/{original} (if it is not there, of the \
         one in the archive) into in/{}/",
        area(place),
        folder_for(&job.source.path)
    );
    Err(Refusal { line, exit_code: 2 })
}

/// Refuses a decision over a job of which the same was said before, or of which there is nothing to decide, in words that tell why.
fn open_to(job: &Job, decision: &Decision) -> Result<(), Refusal> {
    let refuse = |line: String| Err(Refusal { line, exit_code: 2 });
    match (job.decision(), job.kind()) {
        (Some(said), _) if said.verdict == Verdict::Approved || said.verdict == decision.verdict => {
            refuse(format!("job {} was {} already, by {}", job.id, said.verdict.name(), said.by))
        }
        (_, Kind::NeedsReview | Kind::Rejected) => Ok(()),
        (_, kind) => refuse(format!("job {} is {kind}; only what needs review can be {}", job.id, decision.verdict.name())),
    }
}

/// Is the best attempt of a job that needs review still what was judged? Looked at now, so that whoever approves it hears of it.
///
/// # Errors
/// When it is not, or cannot be looked at.
fn is_as_judged(context: &Context, job: &Job) -> Result<(), Refusal> {
    let folder = context.folders.iter().find(|folder| folder.name == job.source.folder);
    let path = folder.and_then(|folder| result_path(&folder.root, job));
    let (Kind::NeedsReview | Kind::Rejected, Some(path), Some(hash)) =
        (job.kind(), path, job.publication().and_then(|publication| publication.output_hash))
    else {
        return Ok(());
    };
    let there = match folder.filter(|folder| folder.bucket.is_some()) {
        None => unfit(&path, hash),
        // Its bytes are compared when they are fetched, which may take longer than who asks waits.
        Some(folder) => folder.has(&path).map(|there| (!there).then_some(NO_ATTEMPT)),
    };
    let why = match there {
        Ok(None) => return Ok(()),
        Ok(Some(why)) => why.to_owned(),
        Err(error) => format!("{}: {error}", path.display()),
    };
    Err(Refusal { line: format!("job {} cannot be approved: {why}", job.id), exit_code: 2 })
}

/// Pauses the daemon or lets it go on, if that is wished, and says how it stands.
///
/// # Errors
/// When the pause cannot be noted.
pub(crate) fn steer(context: &Context, wish: &DaemonWish) -> Result<Standing, Refusal> {
    if let DaemonWish::Pause | DaemonWish::Resume = wish {
        let paused = *wish == DaemonWish::Pause;
        standstill::set(&context.settings.now().state, paused)
            .map_err(|error| Refusal { line: format!("the pause cannot be noted: {error}"), exit_code: 75 })?;
        if context.schedule.hold(Hold::Operator, paused.then(|| standstill::WORDS.into())) {
            tracing::info!(paused, "An operator's wish.");
        }
    }
    Ok(standing(context)?)
}

/// Does what is wished of jobs while the daemon works on them.
///
/// # Errors
/// As [`answer`].
pub(crate) fn change(context: &Context, wish: &JobsWish) -> Result<Vec<Job>, Refusal> {
    let before = if let JobsWish::Cancel(id) = wish { context.store.get(*id).ok().flatten() } else { None };
    if let JobsWish::Decide(id, Decision { verdict: Verdict::Approved, .. }) = wish {
        context.store.get(*id)?.map_or(Ok(()), |job| is_as_judged(context, &job))?;
    }
    let jobs = answer(&*context.store, wish)?;
    if let Some(before) = &before {
        context.sweep(before);
    }
    if let JobsWish::Retry(_) | JobsWish::Cancel(_) | JobsWish::Rank(..) | JobsWish::Decide(..) = wish {
        context.schedule.news();
    }
    Ok(jobs)
}

fn socket(root: &Path) -> PathBuf {
    root.join(".suture").join("control.sock")
}

/// A socket's address is at most 107 bytes long, a folder's name is not: the address goes by way of an open folder.
fn short<T>(path: &Path, use_it: impl FnOnce(&Path) -> io::Result<T>) -> io::Result<T> {
    let folder = std::fs::File::open(crate::fsx::folder_of(path))?;
    let name = path.file_name().unwrap_or_default();
    use_it(&Path::new("/proc/self/fd").join(folder.as_raw_fd().to_string()).join(name))
}

/// The daemon's side for one hot folder.
pub(crate) struct Door {
    listener: UnixListener,
    path: PathBuf,
    /// What the name stood for when it was made: another daemon's socket may have it by now.
    made: Option<Identity>,
}

impl Door {
    /// Opens the socket. The folder's lock is held, so that one that is there already was left by a daemon that died.
    ///
    /// # Errors
    /// As `bind`.
    pub(crate) fn open(root: &Path) -> io::Result<Self> {
        let path = socket(root);
        crate::fsx::remove_if_there(&path)?;
        let listener = short(&path, |path| UnixListener::bind(path))?;
        // Whoever knocked may be gone before the door is opened.
        listener.set_nonblocking(true)?;
        let made = Identity::of(&path).ok();
        Ok(Self { listener, path, made })
    }

    /// Serves whoever knocks until `end`, each by a thread of its own: one that says nothing keeps no one waiting. Needs no knock to
    /// end: the socket's name may be gone by then.
    pub(crate) fn serve(&self, context: &Context, end: &dyn Fn() -> bool) {
        let busy = AtomicUsize::new(0);
        let mut open: VecDeque<Arc<UnixStream>> = VecDeque::new();
        std::thread::scope(|scope| {
            while !end() {
                if busy.load(Ordering::Acquire) >= AT_ONCE {
                    std::thread::sleep(LOOK_EVERY);
                    continue;
                }
                if !self.someone_knocks() {
                    continue;
                }
                let Ok((stream, _)) = self.listener.accept() else {
                    std::thread::sleep(LOOK_EVERY);
                    continue;
                };
                let stream = Arc::new(stream);
                // At most so many are still open.
                open.push_back(Arc::clone(&stream));
                while open.len() > AT_ONCE {
                    open.pop_front();
                }
                busy.fetch_add(1, Ordering::AcqRel);
                let (busy, other) = (&busy, Arc::clone(&stream));
                let serve = move || {
                    attend(context, &other, PATIENCE);
                    busy.fetch_sub(1, Ordering::AcqRel);
                };
                if std::thread::Builder::new().spawn_scoped(scope, serve).is_err() {
                    // No thread to be had: here, as long as that holds up no one who knocks.
                    attend(context, &stream, SHORT_PATIENCE);
                    busy.fetch_sub(1, Ordering::AcqRel);
                }
            }
            // Whoever has not said what they want by now keeps no one from ending.
            for stream in &open {
                let _ = stream.shutdown(Shutdown::Read);
            }
        });
    }

    /// Has its name gone, as with a folder that was unmounted, so that nobody can knock?
    pub(crate) fn is_lost(&self) -> bool {
        let there = Identity::of(&self.path).ok().zip(self.made);
        there.is_none_or(|(now, made)| (now.dev, now.ino) != (made.dev, made.ino))
    }

    /// Waits a while for a knock.
    fn someone_knocks(&self) -> bool {
        let mut knocks = [PollFd::new(&self.listener, PollFlags::IN)];
        let wait = Timespec { tv_sec: 0, tv_nsec: i64::from(LOOK_EVERY.subsec_nanos()) };
        match poll(&mut knocks, Some(&wait)) {
            Ok(knocks) => knocks > 0,
            Err(_) => {
                std::thread::sleep(LOOK_EVERY);
                false
            }
        }
    }
}

impl Drop for Door {
    fn drop(&mut self) {
        // A left-over socket is recognised by nobody answering.
        if !self.is_lost() {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// Serves one who knocked, and sees them off.
fn attend(context: &Context, stream: &UnixStream, patience: Duration) {
    if let Err(error) = brief(|| serve_one(context, stream, patience)) {
        tracing::debug!(%error, "A request on the control socket was not understood.");
    }
    // Whoever asked reads to the end, and another handle of the stream is kept.
    let _ = stream.shutdown(Shutdown::Both);
}

fn serve_one(context: &Context, stream: &UnixStream, patience: Duration) -> io::Result<()> {
    stream.set_nonblocking(false)?;
    stream.set_read_timeout(Some(patience))?;
    stream.set_write_timeout(Some(patience))?;
    let mut line = String::new();
    BufReader::new(stream.take(LONGEST_WISH)).read_line(&mut line)?;
    let request: Request = serde_json::from_str(&line)?;
    let mut out = io::BufWriter::new(stream);
    match request {
        Request::Jobs(wish) => serde_json::to_writer(&mut out, &change(context, &wish))?,
        Request::Daemon(wish) => serde_json::to_writer(&mut out, &steer(context, &wish))?,
        Request::Glance(GlanceWish) => serde_json::to_writer(&mut out, &Glance::of(context).map_err(Refusal::from))?,
    }
    out.flush()
}

/// Asks the daemon of a hot folder; `None` when none answers.
///
/// # Errors
/// When it cannot be told whether one runs, or one does and answers in no way that can be understood.
pub(crate) fn ask<W: Wish>(root: &Path, wish: &W) -> io::Result<Option<Result<W::Answer, Refusal>>> {
    let mut stream = match short(&socket(root), |path| UnixStream::connect(path)) {
        Ok(stream) => stream,
        // No socket, or one that a daemon left behind. Any other error says nothing of a daemon.
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::ConnectionRefused) => return Ok(None),
        Err(error) => return Err(error),
    };
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let request: Request = wish.clone().into();
    let mut line = serde_json::to_vec(&request)?;
    line.push(b'\n');
    stream.write_all(&line)?;
    Ok(Some(serde_json::from_reader(BufReader::new(stream))?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use suture_store::testkit::{dropped, result_of};
    use suture_store::{Ending, Filter, MemoryStore, RelPath, Seen, Source, Step, Submission, SystemClock};

    #[test]
    fn wishes_are_answered_or_refused_with_a_code() {
        let store = MemoryStore::new(Arc::new(SystemClock));
        let source = Source {
            folder: "hot".into(),
            path: RelPath::new(*b"a.stl").unwrap(),
            dev: 1,
            ino: 2,
            size: 3,
            mtime_ns: 4,
            profile: "default".into(),
        };
        store.submit(&[Submission { source, foreign: None, priority: Priority::default(), seen: Seen::Now }]).unwrap();
        let id = JobId(1);
        assert!(answer(&store, &JobsWish::List).is_ok_and(|jobs| jobs.len() == 1 && jobs[0].id == id));
        let refused = |wish| answer(&store, &wish).is_err_and(|refusal| refusal.exit_code == 2);
        assert!(refused(JobsWish::Show(JobId(9))));
        let ranked = answer(&store, &JobsWish::Rank(id, Priority::HIGHEST)).unwrap();
        assert_eq!(ranked[0].priority, Priority::HIGHEST);
        answer(&store, &JobsWish::Cancel(id)).unwrap();
        assert!(refused(JobsWish::Rank(id, Priority::LOWEST)), "it waits no longer");
        assert!(refused(JobsWish::Cancel(id)), "it is cancelled already");
    }

    /// A result that is in place stays; whoever wants another one is told how.
    #[test]
    fn what_is_done_is_not_tried_again_and_it_is_said_what_to_do() {
        let store = MemoryStore::default();
        store.submit(&[dropped("part.stl", 84).unwrap()]).unwrap();
        let claim = store.claim(&Filter::default()).unwrap().unwrap();
        store.advance(&claim, Step::Intend(result_of(&claim.job, Ending::Clean))).unwrap();
        store.advance(&claim, Step::Placed).unwrap();
        let done = store.advance(&claim, Step::Finished).unwrap();
        let refused = answer(&store, &JobsWish::Retry(done.id)).unwrap_err();
        for words in ["job 1 is done, and its result is out/part.stl", "drop a copy of done/part.stl", "into in/!force/"] {
            assert!(refused.line.contains(words), "{}", refused.line);
        }
        assert_eq!((refused.exit_code, store.get(done.id).unwrap()), (2, Some(done)));
    }

    #[test]
    fn no_daemon_no_answer() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join(".suture")).unwrap();
        assert!(ask(dir.path(), &JobsWish::List).unwrap().is_none());
        // A socket that was left behind: no one listens there.
        drop(UnixListener::bind(socket(dir.path())).unwrap());
        assert!(ask(dir.path(), &JobsWish::List).unwrap().is_none());
        // A file that is no socket, and a folder that cannot be looked into, tell nothing.
        let elsewhere = tempfile::tempdir().unwrap();
        std::fs::write(elsewhere.path().join(".suture"), b"").unwrap();
        assert!(ask(elsewhere.path(), &JobsWish::List).is_err());
    }
}
