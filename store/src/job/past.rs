//! A job whose record was lost, as the files that it left tell of it.

use super::hold::Hold;
use super::state::{Area, Job, Parked, Publication, Source, State};
use crate::id::{Attempt, JobId, Time, Token};
use crate::path::RelPath;

/// How far a job had come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reached {
    /// Its result is on its way into place: as [`State::Publishing`].
    Publishing,
    /// Its result is in place, its original is not: as [`State::Published`].
    Published,
    /// Nothing is to be done: as [`State::Ended`].
    Ended,
}

/// A job whose record was lost.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Past {
    /// The number it had, 0 where that is not known. Another one where that is taken.
    pub id: JobId,
    /// The dropped file; without an inode where nothing tells which it was.
    pub source: Source,
    /// Where its original is, if that is neither where it was dropped nor where it was to go.
    pub moved_to: Option<(Area, RelPath)>,
    /// What it has left, or was to leave.
    pub publication: Publication,
    /// Attempts so far.
    pub attempts: Attempt,
    /// The claim in whose work folder the rest of its files is, if there is one.
    pub work: Option<Token>,
    /// When its receipt was written.
    pub ended: Time,
    /// How far it had come.
    pub reached: Reached,
}

impl Past {
    /// Its job, under this number. What is still to be done waits for whoever claims it.
    pub(crate) fn job(&self, id: JobId) -> Job {
        let publication = self.publication.clone();
        let hold = Hold::none(self.attempts);
        let mut job = Job::queued(id, self.source.clone(), self.ended);
        let committed = self.reached == Reached::Published;
        job.parked = (self.reached != Reached::Ended).then_some(Parked { until: Some(Time(0)), tries: 0, committed });
        job.state = match self.reached {
            Reached::Publishing => State::Publishing { hold, publication },
            Reached::Published => State::Published { hold, publication },
            Reached::Ended => State::Ended { publication },
        };
        job.moved_to = self.moved_to.clone().filter(|_| self.reached != Reached::Ended);
        job.attempts = self.attempts;
        job.work = self.work;
        job
    }
}
