//! An object store in memory that fails by a seed: errors of the server before or after the deed (a lost answer), cut bodies, stale listings; and that
//! stops for good after so many calls, as if the daemon had died there. What an upload sends before its last step dies with it.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::sync::{Arc, Mutex};

use bytes::Bytes;
use futures_util::TryStreamExt;
use futures_util::stream::BoxStream;
use object_store::memory::InMemory;
use object_store::multipart::PartId;
use object_store::path::Path as Key;
use object_store::*;

use super::object::Version;
use super::requests::{Listed, Page, Requests, Upload};

/// The store.
#[derive(Debug, Default)]
pub(crate) struct Faulty {
    inner: Arc<InMemory>,
    state: Mutex<State>,
    is_careless: bool,
    is_forgetful: bool,
    refuses: bool,
}

#[derive(Debug, Default)]
struct State {
    seed: u64,
    /// Of 256 calls so many fail.
    rate: u64,
    /// Calls until all fail; `None`: never.
    left: Option<u32>,
    /// The last listing said this.
    listed: Vec<Listed>,
    /// Their attributes, and parts by number.
    uploads: BTreeMap<String, (Attributes, BTreeMap<usize, Bytes>)>,
    /// Uploads so far.
    begun: u32,
}

/// The end of a call.
#[derive(PartialEq)]
enum Fate {
    Good,
    Before,
    After,
}

impl Faulty {
    pub(crate) fn over(inner: &Arc<InMemory>, seed: u64, rate: u64, left: Option<u32>) -> Self {
        Self {
            inner: Arc::clone(inner),
            state: Mutex::new(State { seed, rate, left, ..State::default() }),
            is_careless: false,
            is_forgetful: false,
            refuses: false,
        }
    }

    /// It does as it is told without regard to conditions.
    pub(crate) fn careless(self) -> Self {
        Self { is_careless: true, ..self }
    }

    /// It keeps nothing but bytes.
    pub(crate) fn forgetful(self) -> Self {
        Self { is_forgetful: true, ..self }
    }

    /// All is refused with 403.
    pub(crate) fn refusing(self) -> Self {
        Self { refuses: true, ..self }
    }

    fn chance(&self) -> u64 {
        let mut state = self.state.lock().unwrap();
        // SplitMix64.
        state.seed = state.seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state.seed ^ (state.seed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb) >> 20
    }

    fn fate(&self) -> Fate {
        let chance = self.chance();
        let mut state = self.state.lock().unwrap();
        match &mut state.left {
            Some(0) => return Fate::Before,
            Some(left) => *left -= 1,
            None => {}
        }
        match chance % 256 < state.rate {
            false => Fate::Good,
            true if chance & 256 == 0 => Fate::Before,
            true => Fate::After,
        }
    }

    /// The call, with its fate.
    async fn told<T>(&self, call: impl Future<Output = Result<T>>) -> Result<T> {
        if self.refuses {
            return Err(Error::PermissionDenied { path: String::new(), source: "403".into() });
        }
        match self.fate() {
            Fate::Before => Err(broken()),
            Fate::Good => call.await,
            Fate::After => call.await.and(Err(broken())),
        }
    }
}

fn broken() -> Error {
    Error::Generic { store: "faulty", source: "500".into() }
}

impl fmt::Display for Faulty {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("faulty")
    }
}

#[async_trait::async_trait]
impl ObjectStore for Faulty {
    async fn put_opts(&self, at: &Key, payload: PutPayload, mut opts: PutOptions) -> Result<PutResult> {
        if self.is_careless {
            opts.mode = PutMode::Overwrite;
        }
        if self.is_forgetful {
            opts.attributes = Attributes::new();
        }
        self.told(self.inner.put_opts(at, payload, opts)).await
    }

    async fn put_multipart_opts(&self, at: &Key, opts: PutMultipartOptions) -> Result<Box<dyn MultipartUpload>> {
        self.inner.put_multipart_opts(at, opts).await
    }

    async fn get_opts(&self, at: &Key, mut options: GetOptions) -> Result<GetResult> {
        // A cut body: the end of what was asked for is left out.
        if let (Some(GetRange::Bounded(Range { start, end })), Fate::After) = (&options.range, self.fate()) {
            options.range = Some(GetRange::Bounded(*start..(*end - 1).max(start + 1)));
        }
        self.told(self.inner.get_opts(at, options)).await
    }

    fn delete_stream(&self, at: BoxStream<'static, Result<Key>>) -> BoxStream<'static, Result<Key>> {
        self.inner.delete_stream(at)
    }

    fn list(&self, prefix: Option<&Key>) -> BoxStream<'static, Result<ObjectMeta>> {
        self.inner.list(prefix)
    }

    async fn list_with_delimiter(&self, prefix: Option<&Key>) -> Result<ListResult> {
        self.inner.list_with_delimiter(prefix).await
    }

    async fn copy_opts(&self, from: &Key, to: &Key, options: CopyOptions) -> Result<()> {
        self.inner.copy_opts(from, to, options).await
    }
}

#[async_trait::async_trait]
impl Requests for Faulty {
    async fn list(&self, prefix: &str, from: Option<&str>) -> Result<Page> {
        let fate = self.fate();
        if fate == Fate::Before {
            return Err(broken());
        }
        let found: Vec<ObjectMeta> = self.told(async { self.inner.list(None).try_collect().await }).await?;
        let seen = |meta: &ObjectMeta| format!("{:?} {}", meta.e_tag, meta.size);
        let mut listed: Vec<_> = found.iter().map(|meta| Listed { key: meta.location.to_string(), seen: seen(meta) }).collect();
        listed.sort_by(|a, b| a.key.cmp(&b.key));
        let mut state = self.state.lock().unwrap();
        let earlier = std::mem::replace(&mut state.listed, listed.clone());
        // The store says again what it said before.
        let said = if fate == Fate::After { earlier } else { listed };
        let mut found: Vec<_> =
            said.into_iter().filter(|one| one.key.starts_with(prefix) && from.is_none_or(|from| *one.key > *from)).collect();
        // A page has two keys.
        let next = (found.len() > 2).then(|| found[1].key.clone());
        found.truncate(2);
        Ok(Page { found, next })
    }

    async fn delete(&self, key: &Key, version: &Version) -> Result<()> {
        self.told(async {
            let there = self.inner.head(key).await?;
            if version.etag != there.e_tag && !self.is_careless {
                return Err(unmet(key));
            }
            self.inner.delete(key).await
        })
        .await
    }

    async fn begin(&self, _: &Key, attributes: &Attributes) -> Result<MultipartId> {
        self.told(async {
            let mut state = self.state.lock().unwrap();
            state.begun += 1;
            let id = state.begun.to_string();
            state.uploads.insert(id.clone(), (attributes.clone(), BTreeMap::new()));
            Ok(id)
        })
        .await
    }

    async fn put_part(&self, to: &Upload, n: usize, bytes: Bytes) -> Result<PartId> {
        self.told(async {
            self.state.lock().unwrap().uploads.get_mut(&to.id).unwrap().1.insert(n, bytes);
            Ok(PartId { content_id: n.to_string() })
        })
        .await
    }

    async fn copy_part(&self, to: &Upload, n: usize, from: (&Key, &Version), range: Range<u64>) -> Result<PartId> {
        let options = GetOptions { if_match: from.1.etag.clone(), range: Some(range.into()), ..GetOptions::default() };
        let bytes = self.inner.get_opts(from.0, options).await?.bytes().await?;
        self.put_part(to, n, bytes).await
    }

    async fn complete_new(&self, upload: &Upload, parts: &[PartId]) -> Result<()> {
        self.told(async {
            let Some((attributes, sent)) = self.state.lock().unwrap().uploads.get(&upload.id).cloned() else {
                return Err(Error::NotFound { path: upload.key.to_string(), source: "no such upload".into() });
            };
            assert_eq!(sent.len(), parts.len());
            let mode = if self.is_careless { PutMode::Overwrite } else { PutMode::Create };
            let options = PutOptions { mode, attributes, ..PutOptions::default() };
            self.inner.put_opts(&upload.key, sent.into_values().collect(), options).await?;
            self.state.lock().unwrap().uploads.remove(&upload.id);
            Ok(())
        })
        .await
    }

    async fn abort(&self, _: &Upload) -> Result<()> {
        self.told(async { Ok(()) }).await
    }
}

fn unmet(key: &Key) -> Error {
    Error::Precondition { path: key.to_string(), source: "412".into() }
}
