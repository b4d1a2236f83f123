//! Requests that S3 knows and `ObjectStore` has no words for: the last step of an upload and a removal under a condition, copies in ranges, and
//! listings in which one odd key does not hide the others.

use std::fmt;
use std::ops::Range;

use bytes::Bytes;
use object_store::multipart::PartId;
use object_store::path::Path as Key;
use object_store::{Attributes, MultipartId, Result};

use super::object::Version;

/// A server that takes them.
#[async_trait::async_trait]
pub(crate) trait Requests: fmt::Debug + Send + Sync {
    /// Some keys that begin with `prefix`, in their order, from where an earlier page ended.
    ///
    /// # Errors
    /// The store's own errors.
    async fn list(&self, prefix: &str, from: Option<&str>) -> Result<Page>;

    /// Removes the object, if it still is that version.
    ///
    /// # Errors
    /// `Precondition` when it is another one.
    async fn delete(&self, key: &Key, version: &Version) -> Result<()>;

    /// Begins an object that is written in parts and has these attributes.
    ///
    /// # Errors
    /// The store's own errors.
    async fn begin(&self, key: &Key, attributes: &Attributes) -> Result<MultipartId>;

    /// Sends a part; `n` counts from 0. Sent again, it takes the place of what was sent before.
    ///
    /// # Errors
    /// The store's own errors.
    async fn put_part(&self, to: &Upload, n: usize, bytes: Bytes) -> Result<PartId>;

    /// The same for bytes of another object, if it still is that version.
    ///
    /// # Errors
    /// `Precondition` when it is another one.
    async fn copy_part(&self, to: &Upload, n: usize, from: (&Key, &Version), range: Range<u64>) -> Result<PartId>;

    /// Makes the object of its parts, if nothing has its name.
    ///
    /// # Errors
    /// `Precondition` when something has it; `NotFound` when there is no such upload, perhaps since it was completed before.
    async fn complete_new(&self, upload: &Upload, parts: &[PartId]) -> Result<()>;

    /// Gives an upload up.
    ///
    /// # Errors
    /// The store's own errors.
    async fn abort(&self, upload: &Upload) -> Result<()>;
}

/// An object that is being written in parts.
#[derive(Clone, Debug)]
#[cfg_attr(not(feature = "buckets"), allow(dead_code, reason = "tests have a store of their own"))]
pub(crate) struct Upload {
    pub key: Key,
    pub id: MultipartId,
}

/// A part of a listing.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Page {
    pub found: Vec<Listed>,
    /// Where the next one begins.
    pub next: Option<String>,
}

/// A key of a listing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Listed {
    pub key: String,
    /// The listing tells this of its version; it serves to be compared alone.
    pub seen: String,
}
