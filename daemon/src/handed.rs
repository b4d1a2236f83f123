//! A file that someone hands over by name: it is whole, they say, and they wait for the number of its job. The thread that looks after the folders
//! answers, so that no file is submitted by two.

use suture_store::{Priority, RelPath, Submitted};
use tokio::sync::oneshot;

use crate::fsx::Identity;

/// A file that is handed over.
#[derive(Debug)]
pub(crate) struct Handed {
    /// The hot folder's name, and the file's below its `in/`.
    pub folder: String,
    pub path: RelPath,
    /// The file that this program has put there itself: whatever became of it since, its job is wanted.
    pub placed: Option<Identity>,
    /// How soon it is wanted, if someone says so.
    pub priority: Option<Priority>,
    reply: oneshot::Sender<Result<Submitted, Untaken>>,
}

/// Why there is no job.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Untaken {
    #[error("there is no such file in the folder for drops")]
    Missing,
    #[error("the file is not complete, or a program has it open for writing")]
    Unfinished,
    #[error("it is {0}")]
    NoMesh(String),
    /// It cannot be recorded.
    #[error("{0}")]
    Refused(String),
    /// For now.
    #[error("{0}")]
    Unavailable(String),
}

/// Where the answer comes.
pub(crate) type Answer = oneshot::Receiver<Result<Submitted, Untaken>>;

impl Handed {
    /// With the place where the answer comes.
    pub(crate) fn new(folder: String, path: RelPath, placed: Option<Identity>, priority: Option<Priority>) -> (Self, Answer) {
        let (reply, answer) = oneshot::channel();
        (Self { folder, path, placed, priority, reply }, answer)
    }

    /// Answers; whoever waits for it no longer finds the job by itself.
    pub(crate) fn answer(self, answer: Result<Submitted, Untaken>) {
        let _ = self.reply.send(answer);
    }
}
