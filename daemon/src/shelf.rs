//! A hot folder's bucket, and what this machine has of it: paths of the scratch stand for keys below the prefix.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use suture_store::{Hash, Job};

use crate::bucket::address::BucketAddress;
use crate::bucket::cache::Cache;
use crate::bucket::calls::Gate;
use crate::bucket::{Bucket, Object, Trouble};
use crate::ground::FolderError;
use crate::receipt::{self, Told};

/// The bucket of a hot folder.
#[derive(Debug)]
pub(crate) struct Shelf {
    pub bucket: Bucket,
    /// Its address, in the shape of a path.
    pub place: PathBuf,
    pub cache: Cache,
    /// It was looked through in this life.
    pub was_polled: AtomicBool,
}

impl Shelf {
    /// Asks once whether the bucket is ours to use; where it does not answer, that is found out later. `cache`: bytes of drops that are kept for another
    /// attempt.
    ///
    /// # Errors
    /// When it is not there, refuses us or cannot do what it must, or the scratch cannot be made.
    pub(crate) fn open(address: &BucketAddress, scratch: &Path, cache: u64) -> Result<Self, FolderError> {
        let io = |source| FolderError::Io { path: scratch.to_owned(), action: "cannot be made", source };
        std::fs::create_dir_all(scratch).map_err(io)?;
        let bucket = Bucket::open(address).map_err(FolderError::Bucket)?;
        match bucket.prove() {
            Err(Trouble::Denied(line)) => Err(FolderError::Bucket(line)),
            _ => Ok(Self::of(bucket, scratch, cache)),
        }
    }

    pub(crate) fn of(bucket: Bucket, scratch: &Path, cache: u64) -> Self {
        let (place, cache) = (bucket.address().to_string().into(), Cache::new(scratch.join("cache"), cache));
        Self { bucket, place, cache, was_polled: AtomicBool::new(false) }
    }

    /// The key, below the prefix, for which a path of the scratch stands.
    ///
    /// # Errors
    /// When it is no text.
    pub(crate) fn key(root: &Path, path: &Path) -> io::Result<String> {
        let below = path.strip_prefix(root).ok().and_then(Path::to_str);
        below.map(str::to_owned).ok_or_else(|| io::Error::other("a key of a bucket is text"))
    }

    /// Is there an object of that name?
    ///
    /// # Errors
    /// When the store does not answer.
    pub(crate) fn has(&self, root: &Path, path: &Path) -> io::Result<bool> {
        self.bucket.stat(&Self::key(root, path)?).map(|found| found.is_some()).map_err(io::Error::other)
    }

    /// The receipt of that key, if there is one.
    ///
    /// # Errors
    /// When the store does not answer.
    pub(crate) fn receipt(&self, key: &str) -> Result<Option<Told>, Trouble> {
        let Some(found) = self.bucket.stat(key)? else { return Ok(None) };
        Ok(self.bucket.bytes(key, &found.version)?.and_then(|bytes| receipt::from_bytes(&bytes).ok()))
    }

    /// Removes an object if it still has the content that its receipt speaks of; else why not, in words. `gate` is asked right before.
    ///
    /// # Errors
    /// When the store does not answer.
    pub(crate) fn remove(&self, key: &str, hash: Option<Hash>, gate: Gate) -> Result<Result<(), String>, Trouble> {
        let Some(found) = self.bucket.stat(key)? else { return Ok(Ok(())) };
        if hash.map(|hash| Ok::<_, Trouble>(self.bucket.hash(key, &found.version)? != hash)).transpose()? == Some(true) {
            return Ok(Err("someone has changed it since".into()));
        }
        let is_gone = self.bucket.remove_if(key, &found.version, gate)?;
        Ok(if is_gone { Ok(()) } else { Err("another one has taken its name".into()) })
    }

    /// The address of an object, for people.
    pub(crate) fn shown(&self, root: &Path, path: &Path) -> String {
        Self::key(root, path).map_or_else(|_| path.display().to_string(), |key| format!("{}/{key}", self.bucket.address()))
    }

    /// Is there no drop any more, in its bucket, for which the job answers? `false` while nobody knows.
    pub(crate) fn is_gone(&self, inbox: &Path, root: &Path, job: &Job) -> bool {
        if self.bucket.trouble().is_some() {
            return false;
        }
        let found =
            Self::key(root, &inbox.join(job.source.path.to_path())).map_err(Trouble::from).and_then(|key| self.bucket.stat(&key));
        let is_other = |found: &Object| found.version.numbers() != (job.source.dev, job.source.ino);
        found.is_ok_and(|found| found.as_ref().is_none_or(is_other)) && self.bucket.must_be_there().is_ok()
    }

    /// Is this the object that the job was submitted for? After this program has moved it, its size must do.
    pub(crate) fn is_source(found: &Object, job: &Job) -> bool {
        let is_same = || found.version.numbers() == (job.source.dev, job.source.ino);
        found.version.size == job.source.size && (job.moved_to.is_some() || is_same())
    }
}
