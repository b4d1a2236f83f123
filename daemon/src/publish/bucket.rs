//! A finished job's files, put into a bucket; the table of places in ARCHITECTURE.md says what each step may meet. The row alone says that a result is
//! there. Files of the attempt stay in its folder until then, so that each step can be done again; what comes to nothing is [`super::litter`]'s.

use std::path::Path;

use suture_store::job::{Illegal, Withdrawal};
use suture_store::{Hash, Job, Lease, Publication, State, Step, StoreError, crash_point};

use super::litter::{self, owner};
use super::{CLAIMED, Desk, Piece, pieces};
use crate::bucket::{Object, Put, Trouble};
use crate::fsx;
use crate::names::{VERSIONS, first, no_free_name};
use crate::place::Placed;
use crate::publish_error::{PublishError, io_at};
use crate::shelf::Shelf;

/// A bucket that does not do what it should is out of reach, and no file's fault.
impl From<Trouble> for PublishError {
    fn from(trouble: Trouble) -> Self {
        match trouble {
            Trouble::Store(error) => Self::Store(error),
            other => Self::Folder(other.to_string()),
        }
    }
}

impl Desk<'_> {
    /// Puts the files of the intent into place, if the original is still the one that they were made of.
    pub(crate) fn place_in(&self, shelf: &Shelf, job: &Job) -> Result<Job, PublishError> {
        let State::Publishing { publication, .. } = &job.state else { return Ok(job.clone()) };
        self.committed.set(false);
        let pieces = pieces(self.folder, job, publication);
        let keys = litter::keys(self.folder, &pieces)?;
        // Known before anything is put: whatever becomes of this attempt, its objects are found.
        let is_first = litter::note(shelf, job, &keys, &|| self.must_hold())? == Put::Now;
        for (i, piece) in pieces.iter().enumerate() {
            if i == 0 && (is_first || !self.is_ours(shelf, job, &piece.to)?) && !self.stands(shelf, job)? {
                litter::undo(shelf, job, &keys, &|| self.must_hold())?;
                return Ok(self.store.advance(self.claim, Step::Withdrawn(Withdrawal::Changed))?);
            }
            match self.put_in(shelf, job, piece, &piece.to)? {
                Placed::Now => crash_point(piece.point),
                Placed::Before => {}
                Placed::Taken if i == 0 => {
                    litter::undo(shelf, job, &keys, &|| self.must_hold())?;
                    return self.choose_again(job, publication);
                }
                Placed::Taken => self.put_beside(shelf, job, piece)?,
                // Another machine had it, and made it; this one makes it anew.
                Placed::Missing => {
                    litter::undo(shelf, job, &keys, &|| self.must_hold())?;
                    return Ok(self.store.advance(self.claim, Step::Lost)?);
                }
            }
            self.committed.set(true);
        }
        let job = self.store.advance(self.claim, Step::Placed)?;
        crash_point("daemon.published");
        Ok(job)
    }

    /// A worker that lost the claim touches nothing.
    pub(super) fn must_hold(&self) -> Result<(), Trouble> {
        match self.store.heartbeat(self.claim)? {
            Lease::Lost => Err(StoreError::Illegal { id: self.claim.id, source: Illegal::Fenced }.into()),
            Lease::Held | Lease::Cancel => Ok(()),
        }
    }

    /// The same of a folder that daemons on other machines serve, too: one of them may have the job by now. On a machine of its own a claim is lost by no
    /// pause, however long.
    ///
    /// # Errors
    /// As [`Desk::must_hold`].
    pub(super) fn must_hold_shared(&self) -> Result<(), PublishError> {
        if self.folder.is_shared { Ok(self.must_hold()?) } else { Ok(()) }
    }

    fn key(&self, path: &Path) -> Result<String, PublishError> {
        Shelf::key(&self.folder.root, path).map_err(io_at(path))
    }

    fn original_key(&self, job: &Job) -> Result<String, PublishError> {
        self.key(&self.folder.original(job))
    }

    fn stands(&self, shelf: &Shelf, job: &Job) -> Result<bool, PublishError> {
        Ok(shelf.bucket.stat(&self.original_key(job)?)?.is_none_or(|found| Shelf::is_source(&found, job)))
    }

    /// Is there an object of that name which this attempt has put?
    fn is_ours(&self, shelf: &Shelf, job: &Job, to: &Path) -> Result<bool, PublishError> {
        Ok(shelf.bucket.stat(&self.key(to)?)?.is_some_and(|found| found.owner == Some(owner(job))))
    }

    /// One file, under that name.
    fn put_in(&self, shelf: &Shelf, job: &Job, piece: &Piece, to: &Path) -> Result<Placed, PublishError> {
        let key = self.key(to)?;
        if !fsx::exists(&piece.from).map_err(io_at(&piece.from))? {
            return Ok(match self.found(shelf, job, &key, piece.hash)? {
                Some(true) => Placed::Before,
                _ => Placed::Missing,
            });
        }
        let content = fsx::hash(&piece.from).map_err(io_at(&piece.from))?;
        if piece.hash.is_some_and(|wanted| wanted != content) {
            return Ok(Placed::Missing);
        }
        let put = shelf.bucket.put_new(&piece.from, &key, &owner(job), &|| self.must_hold())?;
        // Read back in any case: what is there is the result, not what was sent.
        match self.found(shelf, job, &key, Some(content))? {
            Some(true) => Ok(if put == Put::Now { Placed::Now } else { Placed::Before }),
            Some(false) if put == Put::There => Ok(Placed::Taken),
            _ => Err(PublishError::Folder(format!("{}: what was written there cannot be read back", self.folder.shown(to)))),
        }
    }

    /// Is there an object of that name, and is it ours? Fails for one of ours with other bytes: nothing is known of it then.
    fn found(&self, shelf: &Shelf, job: &Job, key: &str, content: Option<Hash>) -> Result<Option<bool>, PublishError> {
        let Some(object) = shelf.bucket.stat(key)? else { return Ok(None) };
        if object.owner != Some(owner(job)) {
            return Ok(Some(false));
        }
        match content {
            Some(content) if shelf.bucket.hash(key, &object.version)? != content => {
                Err(PublishError::Folder(format!("{}/{key}: it is not what was written there", shelf.bucket.address())))
            }
            _ => Ok(Some(true)),
        }
    }

    /// A stranger has the name of a report or receipt: the next free one.
    fn put_beside(&self, shelf: &Shelf, job: &Job, piece: &Piece) -> Result<(), PublishError> {
        let name = piece.to.file_name().unwrap_or_default();
        for n in 2..VERSIONS {
            let to = piece.to.with_file_name(fsx::versioned(name, n, 0));
            litter::note(shelf, job, &[self.key(&to)?], &|| self.must_hold())?;
            if let Placed::Now | Placed::Before = self.put_in(shelf, job, piece, &to)? {
                tracing::warn!(file = self.folder.shown(&to), "The name of a report was taken; it got another.");
                return Ok(());
            }
        }
        Err(no_free_name(&piece.to))
    }

    /// Moves the original to the area of the ending: copied, compared, and only then removed.
    pub(crate) fn move_in(&self, shelf: &Shelf, job: &Job) -> Result<Job, PublishError> {
        let State::Published { publication, .. } = &job.state else { return Ok(job.clone()) };
        // The row names the objects now, so that nobody need look for them.
        let keys = litter::keys(self.folder, &pieces(self.folder, job, publication))?;
        litter::forget(shelf, job, &keys)?;
        if let Some(other) = self.copy_and_remove(shelf, job, publication)? {
            return Ok(self.store.advance(self.claim, Step::Redirect { original: other })?);
        }
        let job = self.store.advance(self.claim, Step::Finished)?;
        crash_point("daemon.done");
        Ok(job)
    }

    /// The original's way. Another name for it, if someone has the one that was chosen.
    fn copy_and_remove(
        &self,
        shelf: &Shelf,
        job: &Job,
        publication: &Publication,
    ) -> Result<Option<suture_store::RelPath>, PublishError> {
        let Some(wanted) = publication.original.as_ref().filter(|_| !publication.stays) else { return Ok(None) };
        let (bucket, from) = (&shelf.bucket, self.original_key(job)?);
        let area = self.folder.area(publication.ending.area());
        let path = area.join(wanted.to_path());
        let to = self.key(&path)?;
        if from == to {
            return Ok(None);
        }
        let Some(Object { version, .. }) = bucket.stat(&from)?.filter(|found| Shelf::is_source(found, job)) else {
            if bucket.stat(&to)?.is_none() {
                bucket.must_be_there()?;
                tracing::warn!(file = from, "The original was taken away, or changed after its result was published.");
            } else {
                // An earlier life removed it, and may have died before the next step.
                bucket.hide_earlier(&from, job.source.mtime_ns, &|| self.must_hold())?;
            }
            return Ok(None);
        };
        let put = bucket.copy_new((&from, &version), &to, &owner(job), &|| self.must_hold())?;
        crash_point("daemon.original_staged");
        let copy = bucket.stat(&to)?;
        match copy {
            Some(copy) if copy.owner == Some(owner(job)) => {
                if copy.version.size != version.size
                    || bucket.hash(&to, &copy.version)? != self.original_hash(shelf, job, &from)?
                {
                    return Err(PublishError::Folder(format!("{}: the copy is another one", self.folder.shown(&path))));
                }
            }
            Some(_) if put == Put::There => {
                let other = first(wanted, 0, |path| self.folder.has(&area.join(path.to_path())).map(|there| !there))?;
                return Ok(Some(other));
            }
            _ => return Err(PublishError::Folder(format!("{}: the copy is not there", self.folder.shown(&path)))),
        }
        if !bucket.remove_if(&from, &version, &|| self.must_hold())? {
            tracing::warn!(file = from, "The original was replaced after its result was published; the new one is a new drop.");
        }
        if version.id.is_some() {
            bucket.hide_earlier(&from, version.mtime_ns, &|| self.must_hold())?;
        }
        crash_point("daemon.original_moved");
        Ok(None)
    }

    /// Of the bytes that were fetched, which are that very version's; where they are gone, they are read again.
    fn original_hash(&self, shelf: &Shelf, job: &Job, from: &str) -> Result<Hash, PublishError> {
        let claimed = self.folder.work(job.work_token()).join(CLAIMED);
        if let Some(hash) = fsx::if_there(fsx::hash(&claimed)).map_err(io_at(&claimed))? {
            return Ok(hash);
        }
        let found = shelf.bucket.stat(from)?.filter(|found| Shelf::is_source(found, job)).ok_or(Trouble::Changed)?;
        Ok(shelf.bucket.hash(from, &found.version)?)
    }
}
