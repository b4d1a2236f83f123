//! An object of a bucket: its version, who wrote it, and why nothing may be known of it.

use object_store::{Attribute, ObjectMeta};
use suture_store::StoreError;

/// Names the job and the work that wrote an object.
pub(super) const OWNER: Attribute = Attribute::Metadata(std::borrow::Cow::Borrowed("suture"));

/// Why a call came to nothing.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Trouble {
    /// The store does not answer: nothing is known, and it is tried again later.
    #[error("{0}")]
    Away(String),
    /// The bucket is not there, or is not ours to use.
    #[error("{0}")]
    Denied(String),
    /// The object is another one by now, or gone.
    #[error("the object changed")]
    Changed,
    /// A file of this machine, or a name that no object has.
    #[error(transparent)]
    Local(#[from] std::io::Error),
    /// The caller has lost the job, or the store of jobs is away.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// These facts tell the versions of an object apart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Version {
    pub etag: Option<String>,
    pub id: Option<String>,
    pub size: u64,
    /// When it was put, to the second: the same bytes have the same ETag.
    pub mtime_ns: i64,
}

impl Version {
    pub(super) fn of(meta: &ObjectMeta) -> Self {
        let mtime_ns = meta.last_modified.timestamp().saturating_mul(1_000_000_000);
        Self { etag: meta.e_tag.clone(), id: meta.version.clone(), size: meta.size, mtime_ns }
    }

    /// Two numbers that stand for it, as device and inode do for a file.
    pub(crate) fn numbers(&self) -> (u64, u64) {
        let hash = blake3::hash(format!("{:?} {:?} {} {}", self.etag, self.id, self.size, self.mtime_ns).as_bytes());
        let mut halves = hash.as_bytes().chunks_exact(8).filter_map(|half| half.try_into().ok()).map(u64::from_le_bytes);
        // A database has no unsigned numbers.
        let mut half = || halves.next().unwrap_or_default() >> 1;
        (half(), half())
    }
}

/// An object that is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Object {
    pub version: Version,
    /// Who wrote it, if a daemon did.
    pub owner: Option<String>,
}

/// The fate of an object that was to be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Put {
    Now,
    /// Something has the name: ours, from a call whose answer was lost, or another's.
    There,
}
