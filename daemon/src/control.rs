//! How `suture jobs` reaches the jobs: through a socket in the hot folder while its daemon runs (the store has one owner), else
//! by opening the store. Either way the same [`Wish`] gets the same [`Answer`].

use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::Shutdown;
use std::os::fd::AsRawFd;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, PoisonError};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde::{Deserialize, Serialize};
use suture_store::{Control, Job, JobId, JobStore, Query, StoreError};

use crate::attempt::Context;
use crate::fsx::Identity;
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

/// What an operator wants.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Wish {
    List,
    Show(JobId),
    Retry(JobId),
    Cancel(JobId),
    /// Nothing new is to be taken.
    Pause,
    /// It is to be taken again.
    Resume,
    /// What keeps the daemon from work?
    Standing,
}

/// What comes of it.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Answer {
    Jobs(Vec<Job>),
    Standing(Standing),
    Failed { line: String, exit_code: u8 },
}

/// Does what is wished of jobs; what is wished of a daemon, one has to do ([`steer`]).
pub(crate) fn answer(store: &dyn JobStore, wish: &Wish) -> Answer {
    let result = match wish {
        Wish::List => store.list(&Query::default()),
        Wish::Show(id) => store.get(*id).and_then(|job| job.map(|job| vec![job]).ok_or(StoreError::Unknown(*id))),
        Wish::Retry(id) => store.control(*id, Control::Retry).map(|job| vec![job]),
        Wish::Cancel(id) => store.control(*id, Control::Cancel).map(|job| vec![job]),
        Wish::Pause | Wish::Resume | Wish::Standing => Ok(Vec::new()),
    };
    match result {
        Ok(jobs) => Answer::Jobs(jobs),
        Err(error) => Answer::failed(&error),
    }
}

impl Answer {
    pub(crate) fn failed(error: &StoreError) -> Self {
        Self::Failed { line: error.to_string(), exit_code: error.exit_code() }
    }
}

/// Pauses the daemon or lets it go on, if that is wished, and says how it stands.
fn steer(context: &Context, wish: &Wish) -> Answer {
    if let Wish::Pause | Wish::Resume = wish {
        let paused = *wish == Wish::Pause;
        if let Err(error) = standstill::set(&context.settings.now().state, paused) {
            return Answer::Failed { line: format!("the pause cannot be noted: {error}"), exit_code: 75 };
        }
        if context.schedule.hold(Hold::Operator, paused.then(|| standstill::WORDS.into())) {
            tracing::info!(paused, "An operator's wish.");
        }
    }
    let away = context.away.lock().unwrap_or_else(PoisonError::into_inner).values().flatten().cloned().collect();
    Answer::Standing(Standing { away, ..context.schedule.standing() })
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
    if let Err(error) = serve_one(context, stream, patience) {
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
    let wish: Wish = serde_json::from_str(&line)?;
    let before = if let Wish::Cancel(id) = &wish { context.store.get(*id).ok().flatten() } else { None };
    let answer = match wish {
        Wish::Pause | Wish::Resume | Wish::Standing => steer(context, &wish),
        _ => answer(&*context.store, &wish),
    };
    if let (Some(before), Answer::Jobs(_)) = (&before, &answer) {
        context.sweep(before);
    }
    if let (Wish::Retry(id) | Wish::Cancel(id), Answer::Jobs(_)) = (&wish, &answer) {
        tracing::info!(job = id.0, ?wish, "An operator's wish.");
        context.schedule.news();
    }
    let mut out = io::BufWriter::new(stream);
    serde_json::to_writer(&mut out, &answer)?;
    out.flush()
}

/// Asks the daemon of a hot folder; `None` when none answers.
///
/// # Errors
/// When one does, but not in a way that can be understood.
pub(crate) fn ask(root: &Path, wish: &Wish) -> io::Result<Option<Answer>> {
    let Ok(mut stream) = short(&socket(root), |path| UnixStream::connect(path)) else { return Ok(None) };
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let mut line = serde_json::to_vec(wish)?;
    line.push(b'\n');
    stream.write_all(&line)?;
    Ok(Some(serde_json::from_reader(BufReader::new(stream))?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use suture_store::{MemoryStore, RelPath, Source, Submission, SystemClock};

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
        store.submit(&[Submission { source, foreign: None }]).unwrap();
        let id = JobId(1);
        assert!(matches!(answer(&store, &Wish::List), Answer::Jobs(jobs) if jobs.len() == 1 && jobs[0].id == id));
        assert!(matches!(answer(&store, &Wish::Show(JobId(9))), Answer::Failed { exit_code: 2, .. }));
        assert!(matches!(answer(&store, &Wish::Cancel(id)), Answer::Jobs(_)));
        assert!(matches!(answer(&store, &Wish::Cancel(id)), Answer::Failed { exit_code: 2, .. }), "it is cancelled already");
    }

    #[test]
    fn no_daemon_no_answer() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join(".suture")).unwrap();
        assert!(ask(dir.path(), &Wish::List).unwrap().is_none());
    }
}
