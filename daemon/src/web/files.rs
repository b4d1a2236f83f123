//! The files that a job has left, and only those: a name in a hot folder is anyone's to take, so that bytes are sent only after their digest was found to be
//! the published one. That is remembered for as long as the file is not touched.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::PathBuf;
use std::sync::Arc;

use axum::body::{Body, Bytes};
use axum::extract::{Path, State};
use axum::http::header::{CONTENT_DISPOSITION, CONTENT_LENGTH, CONTENT_TYPE, ETAG, IF_NONE_MATCH};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use suture_store::{Hash, Job, JobId, State as JobState};
use tokio::sync::mpsc::{Sender, channel};
use tokio::task::spawn_blocking;

use crate::attempt::Context;
use crate::create;
use crate::escape::escaped;
use crate::folder::Folder;
use crate::fsx::Identity;
use crate::left::{report_path, result_path};

use super::ask::ask;
use super::flow::Flow;
use super::jobs::{id_of, job_of};
use super::problem::Problem;
use super::shared::Shared;
use super::verified::Which;

/// Bytes that are read at a time, and those that are hashed.
const CHUNK: usize = 256 << 10;
const HASHED: usize = 4 << 20;
/// How often a file that changes meanwhile is read.
const TRIES: u32 = 3;

/// A file of a job, and the digest of its bytes.
#[derive(Clone, Debug)]
pub(super) struct Known {
    pub which: Which,
    pub path: PathBuf,
    pub hash: Hash,
}

/// A file that is open, and how it was found.
pub(super) struct Opened {
    pub file: Arc<File>,
    pub found: Identity,
    published: Hash,
    name: String,
}

/// `GET /v1/jobs/{id}/result`: the mesh that a job has left.
pub(super) async fn result(
    State(shared): State<Arc<Shared>>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    send(&shared, &id, Which::Result, &headers).await
}

/// `GET /v1/jobs/{id}/report`: what was wrong with it, and what was done.
pub(super) async fn report(
    State(shared): State<Arc<Shared>>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    send(&shared, &id, Which::Report, &headers).await
}

/// The file that a job has left, found to be the published one.
///
/// # Errors
/// When it has left none, or it is not in its place.
pub(super) async fn opened(shared: &Shared, id: JobId, which: Which) -> Result<Opened, Problem> {
    let known = ask(&shared.context, move |context| {
        let job = job_of(context, id)?;
        let (path, hash) = place(&folder_of(context, &job)?.root, &job, which)?;
        Ok(Known { which, path, hash })
    });
    opened_as(shared, id, known.await?).await
}

/// The file of a job that is known, found to have those bytes.
///
/// # Errors
/// When it is not in its place.
pub(super) async fn opened_as(shared: &Shared, id: JobId, known: Known) -> Result<Opened, Problem> {
    let key = (id, known.which);
    for _ in 0..TRIES {
        let known = known.clone();
        let opened = ask(&shared.context, move |_| open(known.path, known.hash)).await?;
        if shared.verified.has(key, &opened.found) {
            return Ok(opened);
        }
        if hash(&opened).await.map_err(unreadable)? != opened.published {
            break;
        }
        // Another name of it may have come or gone meanwhile, as in the work folder of a job that has just ended.
        if look(&opened.file).map_err(unreadable)? == opened.found {
            shared.verified.add(key, opened.found);
            return Ok(opened);
        }
    }
    Err(Problem::conflict(format!("the file of that name is not any more what job {id} has left")))
}

/// The hot folder of a job.
///
/// # Errors
/// When it is not served any more, or out of reach.
pub(super) fn folder_of<'a>(context: &'a Context, job: &Job) -> Result<&'a Folder, Problem> {
    let id = job.id;
    let folder = context.folders.iter().find(|folder| folder.name == job.source.folder);
    let folder = folder.ok_or_else(|| Problem::missing(format!("the folder of job {id} is not served any more")))?;
    folder.check().map_err(|_| Problem::unavailable(format!("the folder of job {id} is out of reach")))?;
    Ok(folder)
}

/// The media type of a mesh of this name, where its format has one (RFC 2077, and those registered since).
fn kind_of(name: &str) -> &'static str {
    match name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase()).as_deref() {
        Some("stl") => "model/stl",
        Some("3mf") => "model/3mf",
        Some("obj") => "model/obj",
        _ => "application/octet-stream",
    }
}

async fn send(shared: &Shared, id: &str, which: Which, headers: &HeaderMap) -> Result<Response, Problem> {
    let opened = opened(shared, id_of(id)?, which).await?;
    let kind = if which == Which::Report { "application/json" } else { kind_of(&opened.name) };
    let (tag, name) = (format!("\"{}\"", opened.published), escaped(&opened.name));
    Ok(answer(opened, tag, kind, Some(format!("attachment; filename*=UTF-8''{name}")), headers))
}

/// An answer of a file's bytes, unless the client has them. `tag`: no other bytes have it.
pub(super) fn answer(
    opened: Opened,
    tag: String,
    kind: &'static str,
    disposition: Option<String>,
    headers: &HeaderMap,
) -> Response {
    let has_it = headers.get(IF_NONE_MATCH).and_then(|value| value.to_str().ok()).is_some_and(|known| known.contains(&tag));
    if has_it {
        return (StatusCode::NOT_MODIFIED, [(ETAG, tag)]).into_response();
    }
    let head = [(ETAG, tag), (CONTENT_TYPE, kind.to_owned()), (CONTENT_LENGTH, opened.found.size.to_string())];
    let disposition = disposition.map(|words| [(CONTENT_DISPOSITION, words)]);
    (head, disposition, Body::new(flow_of(opened))).into_response()
}

fn unreadable(error: io::Error) -> Problem {
    Problem::unavailable(format!("the file cannot be read: {}", error.kind()))
}

/// Where the file is, and the digest of its bytes.
fn place(root: &std::path::Path, job: &Job, which: Which) -> Result<(PathBuf, Hash), Problem> {
    let JobState::Ended { publication } = &job.state else {
        return Err(Problem::conflict(format!("job {} is {}; it has left nothing yet", job.id, job.kind())));
    };
    let (path, hash) = match which {
        Which::Result => (result_path(root, job), publication.output_hash),
        Which::Report => (report_path(root, job), publication.report_hash),
        Which::Original => (None, None),
    };
    path.zip(hash).ok_or_else(|| Problem::missing(format!("job {} has left no such file", job.id)))
}

/// Opens a file that is to have these bytes.
///
/// # Errors
/// When it is not there, or no file.
pub(super) fn open(path: PathBuf, published: Hash) -> Result<Opened, Problem> {
    let gone = |_| Problem::new(StatusCode::GONE, "the file is not in its place any more");
    let file = create::open_to_read(&path).map_err(gone)?;
    let meta = file.metadata().map_err(unreadable)?;
    if !meta.is_file() {
        return Err(Problem::new(StatusCode::GONE, "the file is not in its place any more"));
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Opened { file: Arc::new(file), found: Identity::from(&meta), published, name })
}

fn look(file: &File) -> io::Result<Identity> {
    Ok(Identity::from(&file.metadata()?))
}

/// Of all bytes, a few at a time, so that no large file keeps others waiting.
async fn hash(opened: &Opened) -> io::Result<Hash> {
    let (mut hasher, mut at) = (blake3::Hasher::new(), 0);
    while at < opened.found.size {
        let (file, mut so_far) = (Arc::clone(&opened.file), hasher);
        let chunk = spawn_blocking(move || {
            let bytes = read(&file, at, HASHED)?;
            so_far.update(&bytes);
            Ok::<_, io::Error>((bytes.len(), so_far))
        });
        let (length, next) = chunk.await.map_err(io::Error::other)??;
        if length == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        (hasher, at) = (next, at + length as u64);
    }
    Ok(Hash(*hasher.finalize().as_bytes()))
}

/// At most so many bytes from there on; none at the end.
fn read(file: &File, at: u64, most: usize) -> io::Result<Vec<u8>> {
    let mut bytes = vec![0; most];
    let length = file.read_at(&mut bytes, at)?;
    bytes.truncate(length);
    Ok(bytes)
}

/// The file, read while it is sent.
fn flow_of(opened: Opened) -> Flow {
    let (sender, pieces) = channel(1);
    let length = opened.found.size;
    tokio::spawn(async move {
        if let Err(error) = feed(&opened, &sender).await {
            // The client sees an answer that is cut off.
            let _ = sender.send(Err(error)).await;
        }
    });
    Flow::new(pieces, Some(length))
}

async fn feed(opened: &Opened, sender: &Sender<io::Result<Bytes>>) -> io::Result<()> {
    let mut at = 0;
    while at < opened.found.size {
        let file = Arc::clone(&opened.file);
        let most = CHUNK.min(usize::try_from(opened.found.size - at).unwrap_or(CHUNK));
        let chunk = spawn_blocking(move || Ok::<_, io::Error>((read(&file, at, most)?, look(&file)?)));
        let (bytes, now) = chunk.await.map_err(io::Error::other)??;
        // Renaming it changes nothing of its bytes.
        if bytes.is_empty() || !now.same_content(&opened.found) {
            return Err(io::Error::other("the file changed while it was sent"));
        }
        at += bytes.len() as u64;
        if sender.send(Ok(bytes.into())).await.is_err() {
            // The client has gone.
            return Ok(());
        }
    }
    Ok(())
}
