//! A hot folder that lies in a bucket of an object store. Each call has a time limit and is repeated with growing pauses ([`calls`]); what ends in vain is
//! an outage ([`weather`]), in which jobs wait. Nothing of a listing is believed: it says where to look, and [`Bucket::stat`] what is there.
//!
//! **In:** paths below the prefix (`in/part.stl`), files of the scratch. **Out:** objects, and what tells their versions. **Promise:** a name is written
//! at most once ([`Bucket::put_new`], [`Bucket::copy_new`]); an object goes only as the version that was looked at ([`Bucket::remove_if`]), as far as
//! the server keeps conditions, which [`prove`] finds out.

use std::io::{Read, Write};
use std::path::Path;
use std::sync::Arc;

use bytes::Bytes;
use object_store::multipart::PartId;
use object_store::path::Path as Key;
use object_store::{Attributes, GetOptions, GetRange, GetResult, ObjectStore, PutMode, PutOptions, PutPayload};
use suture_store::Hash;

use crate::{create, fsx};

pub(crate) mod address;
pub(crate) mod cache;
pub(crate) mod calls;
#[cfg(feature = "buckets")]
mod connect;
#[cfg(test)]
pub(crate) mod faulty;
#[cfg(feature = "buckets")]
mod listing;
mod object;
pub(crate) mod prove;
pub(crate) mod requests;
#[cfg(feature = "buckets")]
mod s3;
#[cfg(test)]
pub(crate) mod tests;
mod weather;

use address::BucketAddress;
use calls::{Caller, Failed, Gate};
use object::OWNER;
pub(crate) use object::{Object, Put, Trouble, Version};
use requests::{Listed, Requests, Upload};

/// Bytes of one call: what is larger is read in ranges, and written in parts.
#[cfg(feature = "buckets")]
const PART: u64 = 16 << 20;
/// An object has no more parts.
const MOST_PARTS: u64 = 10_000;
/// Parts of a copy within the store are so many times larger: nothing of them goes through this machine.
const COPIED_AT_ONCE: u64 = 32;
/// Receipts and notes are no larger.
const SMALL: u64 = 64 << 10;

/// A prefix of a bucket.
#[derive(Debug)]
pub(crate) struct Bucket {
    caller: Caller,
    store: Arc<dyn ObjectStore>,
    requests: Arc<dyn Requests>,
    part: u64,
}

/// Sends a part of an object.
type Send<'a> = &'a mut dyn FnMut(&Upload, usize, std::ops::Range<u64>) -> Result<PartId, Failed>;

impl Bucket {
    /// Makes the client; nothing is asked yet.
    ///
    /// # Errors
    /// A line for people.
    #[cfg(feature = "buckets")]
    pub(crate) fn open(address: &BucketAddress) -> Result<Self, String> {
        let s3 = connect::connect(address, calls::CALL)?;
        Self::over(Arc::new(s3.store.clone()), s3, address, PART)
    }

    /// As above, in a program that was built without buckets.
    ///
    /// # Errors
    /// Always.
    #[cfg(not(feature = "buckets"))]
    pub(crate) fn open(address: &BucketAddress) -> Result<Self, String> {
        Err(format!("{address}: this program was built without buckets; take one that was built with the feature `buckets`"))
    }

    #[cfg_attr(not(feature = "buckets"), allow(dead_code, reason = "tests have a store of their own"))]
    fn over(
        store: Arc<dyn ObjectStore>,
        requests: Arc<dyn Requests>,
        address: &BucketAddress,
        part: u64,
    ) -> Result<Self, String> {
        Ok(Self { caller: Caller::new(address)?, store, requests, part })
    }

    pub(crate) fn address(&self) -> &BucketAddress {
        &self.caller.address
    }

    /// Why it is out of reach; `None`: it answers, as far as anyone knows.
    pub(crate) fn trouble(&self) -> Option<String> {
        self.caller.trouble()
    }

    fn key(&self, below: &str) -> Result<Key, Trouble> {
        Key::parse(self.address().key(below)).map_err(|error| std::io::Error::other(error).into())
    }

    /// Keys below a path, relative to it, in their order. They may be gone, and others may be there.
    ///
    /// # Errors
    /// When the store does not answer, or the bucket is not there.
    pub(crate) fn list(&self, below: &str) -> Result<Vec<Listed>, Trouble> {
        let prefix = format!("{}/", self.address().key(below));
        let (mut all, mut from) = (Vec::new(), None::<String>);
        loop {
            let page =
                self.caller.call(|| self.requests.list(&prefix, from.as_deref())).map_err(|failed| self.caller.gone(failed))?;
            let below = |one: Listed| Some(Listed { key: one.key.strip_prefix(&prefix)?.to_owned(), ..one });
            all.extend(page.found.into_iter().filter_map(below));
            match page.next {
                // A server that goes round in a circle would be asked without end.
                Some(next) if from.as_ref() != Some(&next) => from = Some(next),
                _ => return Ok(all),
            }
        }
    }

    /// Looks at an object.
    ///
    /// # Errors
    /// When the store does not answer.
    pub(crate) fn stat(&self, below: &str) -> Result<Option<Object>, Trouble> {
        match self.head(&self.key(below)?, GetOptions::default()) {
            Ok(found) => {
                let owner = found.attributes.get(&OWNER).map(|owner| owner.to_string());
                Ok(Some(Object { version: Version::of(&found.meta), owner }))
            }
            Err(Failed::Absent) => Ok(None),
            Err(other) => Err(other.or_changed()),
        }
    }

    /// The facts of an object, and what was said of it.
    fn head(&self, key: &Key, options: GetOptions) -> Result<GetResult, Failed> {
        self.caller.call(|| self.store.get_opts(key, GetOptions { head: true, ..options.clone() }))
    }

    /// Reads that version, range by range.
    fn read(&self, below: &str, version: &Version, each: &mut dyn FnMut(&[u8]) -> std::io::Result<()>) -> Result<(), Trouble> {
        let (key, mut from) = (self.key(below)?, 0);
        while from < version.size {
            let to = version.size.min(from + self.part);
            let options = || GetOptions {
                if_match: version.etag.clone(),
                version: version.id.clone(),
                range: Some(GetRange::Bounded(from..to)),
                ..GetOptions::default()
            };
            let bytes = self.caller.call(|| async {
                let bytes = self.store.get_opts(&key, options()).await?.bytes().await?;
                if bytes.len() as u64 == to - from { Ok(bytes) } else { Err(cut()) }
            });
            each(&bytes.map_err(Failed::or_changed)?)?;
            from = to;
        }
        Ok(())
    }

    /// The hash of that version's bytes.
    ///
    /// # Errors
    /// When the store does not answer, or has another version.
    pub(crate) fn hash(&self, below: &str, version: &Version) -> Result<Hash, Trouble> {
        let mut hasher = blake3::Hasher::new();
        self.read(below, version, &mut |bytes| {
            hasher.update(bytes);
            Ok(())
        })?;
        Ok(Hash(*hasher.finalize().as_bytes()))
    }

    /// A small object of ours; `None` if it is none.
    ///
    /// # Errors
    /// As [`Bucket::hash`].
    pub(crate) fn bytes(&self, below: &str, version: &Version) -> Result<Option<Vec<u8>>, Trouble> {
        if version.size > SMALL {
            return Ok(None);
        }
        let mut all = Vec::new();
        self.read(below, version, &mut |bytes| all.write_all(bytes))?;
        Ok(Some(all))
    }

    /// Fetches that version into a new file.
    ///
    /// # Errors
    /// When the store does not answer, has another version, or the file cannot be written.
    pub(crate) fn fetch(&self, below: &str, version: &Version, to: &Path) -> Result<(), Trouble> {
        let mut file = create::create_anew(to)?;
        let fetched = self.read(below, version, &mut |bytes| file.write_all(bytes)).and_then(|()| Ok(file.sync_all()?));
        // A part of a large file would hold its room until the daemon begins anew.
        fetched.inspect_err(|_| drop(fsx::remove_if_there(to)))
    }

    /// Writes a file under a name that nothing has. `gate` is asked right before the call that commits.
    ///
    /// # Errors
    /// When the store does not answer, or the file cannot be read. Then the object may be there all the same.
    pub(crate) fn put_new(&self, from: &Path, below: &str, owner: &str, gate: Gate) -> Result<Put, Trouble> {
        let mut file = create::open_to_read(from)?;
        let size = file.metadata()?.len();
        if size <= self.part {
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes)?;
            return self.put_bytes_new(bytes, below, owner, gate);
        }
        self.in_parts(below, &by(owner), gate, (size, self.part), &mut |to, n, range| {
            let mut bytes = Vec::new();
            (&mut file).take(range.end - range.start).read_to_end(&mut bytes)?;
            let bytes = Bytes::from(bytes);
            self.caller.call(|| self.requests.put_part(to, n, bytes.clone()))
        })
    }

    /// The same for bytes at hand.
    ///
    /// # Errors
    /// As [`Bucket::put_new`].
    pub(crate) fn put_bytes_new(&self, bytes: impl Into<Bytes>, below: &str, owner: &str, gate: Gate) -> Result<Put, Trouble> {
        self.put_whole_new(bytes.into(), below, &by(owner), gate)
    }

    fn put_whole_new(&self, bytes: Bytes, below: &str, attributes: &Attributes, gate: Gate) -> Result<Put, Trouble> {
        let (key, payload) = (self.key(below)?, PutPayload::from(bytes));
        let options = || PutOptions { mode: PutMode::Create, attributes: attributes.clone(), ..PutOptions::default() };
        self.written(self.caller.call_at(gate, || self.store.put_opts(&key, payload.clone(), options())).map(drop))
    }

    /// Copies that version of an object, within the store, to a name that nothing has. It keeps what whoever put it said of it: its type, and words of
    /// their own.
    ///
    /// # Errors
    /// When the store does not answer, or the object is another one by now. Then the copy may be there all the same.
    pub(crate) fn copy_new(&self, from: (&str, &Version), to: &str, owner: &str, gate: Gate) -> Result<Put, Trouble> {
        let (source, version) = (self.key(from.0)?, from.1);
        let as_it_was = GetOptions { if_match: version.etag.clone(), version: version.id.clone(), ..GetOptions::default() };
        let mut attributes = self.head(&source, as_it_was).map_err(Failed::or_changed)?.attributes;
        attributes.insert(OWNER, owner.to_owned().into());
        if version.size == 0 {
            // No part is empty.
            return self.put_whole_new(Bytes::new(), to, &attributes, gate);
        }
        let part = self.part.saturating_mul(COPIED_AT_ONCE);
        self.in_parts(to, &attributes, gate, (version.size, part), &mut |to, n, range| {
            self.caller.call(|| self.requests.copy_part(to, n, (&source, version), range.clone()))
        })
    }

    /// Writes an object of that size in parts. Nobody sees it before the last step, which has the condition.
    fn in_parts(
        &self,
        below: &str,
        attributes: &Attributes,
        gate: Gate,
        (size, part): (u64, u64),
        send: Send,
    ) -> Result<Put, Trouble> {
        let (key, part) = (self.key(below)?, part.max(size.div_ceil(MOST_PARTS)));
        let id = self.caller.call(|| self.requests.begin(&key, attributes)).map_err(|failed| self.caller.gone(failed))?;
        let upload = Upload { key, id };
        let mut write = || {
            let (mut parts, mut from) = (Vec::new(), 0);
            while from < size {
                let to = size.min(from + part);
                parts.push(send(&upload, parts.len(), from..to).map_err(|failed| Failed::Trouble(failed.or_changed()))?);
                from = to;
            }
            self.caller.call_at(gate, || self.requests.complete_new(&upload, &parts))
        };
        let done = write();
        if !matches!(done, Ok(())) {
            // The lifecycle rule removes an upload that stays.
            let _ = self.caller.call(|| self.requests.abort(&upload));
        }
        match done {
            // Completed before, and not told: whoever looks finds out.
            Err(Failed::Absent) => Ok(Put::There),
            done => self.written(done),
        }
    }

    fn written(&self, done: Result<(), Failed>) -> Result<Put, Trouble> {
        match done {
            Ok(()) => Ok(Put::Now),
            Err(Failed::Unmet) => Ok(Put::There),
            Err(other) => Err(self.caller.gone(other)),
        }
    }

    /// Removes an object, if it still is that version. Returns whether it is gone. It is looked at once more right before, for a server that removes
    /// without regard to conditions.
    ///
    /// # Errors
    /// When the store does not answer.
    pub(crate) fn remove_if(&self, below: &str, version: &Version, gate: Gate) -> Result<bool, Trouble> {
        match self.stat(below)? {
            None => Ok(true),
            Some(found) if found.version == *version => self.delete(below, version, gate),
            Some(_) => Ok(false),
        }
    }

    /// Where the bucket keeps versions, a drop that was replaced comes to light again when the one that replaced it is removed. It is put out of
    /// sight, and stays as a version. `put`: when the removed one was put, in nanoseconds since 1970; what is no older may be a new drop.
    ///
    /// # Errors
    /// When the store does not answer.
    pub(crate) fn hide_earlier(&self, below: &str, put: i64, gate: Gate) -> Result<(), Trouble> {
        let is_earlier = |found: &Object| found.version.id.is_some() && found.version.mtime_ns < put;
        if let Some(found) = self.stat(below)?.filter(is_earlier) {
            // Without the name of a version, the store removes none, and says from then on that there is no object.
            self.delete(below, &Version { id: None, ..found.version }, gate)?;
        }
        Ok(())
    }

    /// Removes an object that nobody else writes, as what it is: where the bucket keeps versions, none of it stays.
    ///
    /// # Errors
    /// When the store does not answer.
    pub(crate) fn remove(&self, below: &str) -> Result<(), Trouble> {
        match self.stat(below)? {
            Some(found) => self.delete(below, &found.version, &|| Ok(())).map(drop),
            None => Ok(()),
        }
    }

    fn delete(&self, below: &str, version: &Version, gate: Gate) -> Result<bool, Trouble> {
        let key = self.key(below)?;
        match self.caller.call_at(gate, || self.requests.delete(&key, version)) {
            Ok(()) | Err(Failed::Absent) => Ok(true),
            Err(Failed::Unmet) => Ok(false),
            Err(Failed::Trouble(trouble)) => Err(trouble),
        }
    }
}

/// The attributes of an object of that owner.
fn by(owner: &str) -> Attributes {
    Attributes::from_iter([(OWNER, owner.to_owned())])
}

/// An answer that is shorter than what was asked for.
fn cut() -> object_store::Error {
    object_store::Error::Generic { store: "suture", source: "the answer was cut".into() }
}
