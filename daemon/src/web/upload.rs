//! Files that are handed in: as a body, as a form, or by name where they lie in a folder already.
//!
//! A body goes to the disk as it comes, a piece at a time, bounded in length, by the room on the disk, and in time. The answer has the job's number: the
//! thread that looks after the folders gives it ([`crate::handed`]).

use std::io;
use std::path::Path;
use std::sync::Arc;

use axum::Json;
use axum::extract::multipart::Multipart;
use axum::extract::{FromRequest, Request, State};
use axum::http::header::{CONTENT_LENGTH, CONTENT_TYPE, LOCATION};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use suture_store::{JobId, Priority, RelPath};
use tokio::time::timeout;

use crate::attempt::{Context, Event};
use crate::folder::Folder;
use crate::fsx::Identity;
use crate::handed::{Handed, Untaken};
use crate::uploads::{Key, Noted, destination};

use super::ask::{PATIENCE, ask};
use super::intake::{Source, spool};
use super::jobs::{job_of, parameters, wished};
use super::problem::Problem;
use super::seats::Taken;
use super::shared::Shared;
use crate::shown::Shown;

/// Longest key in bytes.
const LONGEST_KEY: usize = 255;
/// Parts of a form before the file.
const MOST_PARTS: usize = 16;

/// Parameters that come with a body.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Wanted {
    /// Needed where several are served.
    folder: Option<String>,
    /// Below the folder's `in/`; needed unless a form says it.
    name: Option<String>,
    priority: Option<Priority>,
}

/// A file that lies in a folder already.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct There {
    folder: Option<String>,
    /// Below the folder's `in/`; or the whole path.
    path: String,
    priority: Option<Priority>,
}

/// `POST /v1/jobs`.
pub(super) async fn submit(State(shared): State<Arc<Shared>>, request: Request) -> Result<Response, Problem> {
    if shared.context.pulse.is_ending() {
        return Err(Problem::unavailable("the daemon ends; try again"));
    }
    let kind = request.headers().get(CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default().to_ascii_lowercase();
    let is = |wanted: &str| kind.split(';').next().is_some_and(|kind| kind.trim() == wanted);
    if is("application/json") {
        return by_name(&shared, wished(request.into_body()).await?).await;
    }
    let wanted: Wanted = parameters(request.uri())?;
    let folder = folder_of(&shared.context, wanted.folder.as_deref())?;
    let key = key_of(request.headers(), &folder)?.map(|key| shared.uploads.take(key)).transpose()?;
    if let Some(answer) = known(&shared, &folder, key.as_ref(), wanted.priority).await? {
        return Ok(answer);
    }
    let _seat =
        shared.uploads.seats.try_acquire().map_err(|_| Problem::unavailable("too many uploads are under way; try again"))?;
    if is("multipart/form-data") {
        return of_form(&shared, folder, wanted, key, request).await;
    }
    let (path, length) = (name_of(wanted.name)?, length_of(request.headers()));
    place(&shared, folder, path, key, wanted.priority, Source::Whole(request.into_body()), length).await
}

fn name_of(name: Option<String>) -> Result<RelPath, Problem> {
    let missing = || Problem::bad("`name` is missing: say `?name=part.stl`, or send a form with a file");
    destination(&name.ok_or_else(missing)?).map_err(Problem::bad)
}

/// The first file of a form, whatever stands before it.
async fn of_form(
    shared: &Shared,
    folder: Arc<Folder>,
    wanted: Wanted,
    key: Option<Taken>,
    request: Request,
) -> Result<Response, Problem> {
    let length = length_of(request.headers());
    let mut form = Multipart::from_request(request, &()).await.map_err(|error| Problem::bad(error.body_text()))?;
    for _ in 0..MOST_PARTS {
        let next = timeout(PATIENCE, form.next_field()).await;
        let next = next.map_err(|_| Problem::new(StatusCode::REQUEST_TIMEOUT, "the form did not come in time"))?;
        let Some(field) = next.map_err(|error| Problem::bad(error.body_text()))? else { break };
        if let Some(name) = field.file_name() {
            let named = name.rsplit(['/', '\\']).next().unwrap_or(name).to_owned();
            let path = name_of(wanted.name.or(Some(named)))?;
            return place(shared, folder, path, key, wanted.priority, Source::Part(Box::new(field)), length).await;
        }
    }
    Err(Problem::bad("the form holds no file"))
}

fn length_of(headers: &HeaderMap) -> Option<u64> {
    headers.get(CONTENT_LENGTH).and_then(|length| length.to_str().ok()?.parse().ok())
}

/// The hot folder of that name, or the only one.
fn folder_of(context: &Context, name: Option<&str>) -> Result<Arc<Folder>, Problem> {
    let names = || context.folders.iter().map(|folder| folder.name.as_str()).collect::<Vec<_>>().join(", ");
    let found = match name {
        Some(name) => context.folders.iter().find(|folder| folder.name == name),
        None => context.folders.first().filter(|_| context.folders.len() == 1),
    };
    let folder = found.cloned().ok_or_else(|| Problem::bad(format!("`folder` must be one of {}", names())))?;
    match &folder.bucket {
        None if folder.keeps() => Ok(folder),
        None => Err(Problem::unavailable(
            "another daemon looks for drops in the folder: send the file there, or put it into its `in/`",
        )),
        Some(shelf) => {
            Err(Problem::bad(format!("the folder lies in a bucket: put the file into {}/in/", shelf.bucket.address())))
        }
    }
}

fn key_of(headers: &HeaderMap, folder: &Folder) -> Result<Option<Key>, Problem> {
    let Some(value) = headers.get("idempotency-key") else { return Ok(None) };
    let text = value.to_str().ok().filter(|text| (1..=LONGEST_KEY).contains(&text.len()));
    let text = text.ok_or_else(|| Problem::bad(format!("an `Idempotency-Key` is 1 to {LONGEST_KEY} plain characters")))?;
    Ok(Some(Key::new(folder, text)))
}

/// The answer that an earlier upload with the same key got, or would have got.
async fn known(
    shared: &Shared,
    folder: &Arc<Folder>,
    key: Option<&Taken>,
    priority: Option<Priority>,
) -> Result<Option<Response>, Problem> {
    let Some(key) = key.map(|taken| taken.key.clone()) else { return Ok(None) };
    let there = Arc::clone(folder);
    let noted = ask(&shared.context, move |_| {
        there.check().map_err(Problem::unavailable)?;
        key.look_up().map_err(|_| Problem::unavailable("the note of this `Idempotency-Key` cannot be read; try again"))
    });
    let Some(Noted { path, identity }) = noted.await? else { return Ok(None) };
    match hand_over(shared, folder, path, Some(identity), priority).await? {
        Ok(id) => answer(shared, id).await.map(Some),
        // It never got its place.
        Err(Untaken::Missing) => Ok(None),
        Err(untaken) => Err(untaken.into()),
    }
}

/// Lets the file come, and gives it its place.
async fn place(
    shared: &Shared,
    folder: Arc<Folder>,
    path: RelPath,
    key: Option<Taken>,
    priority: Option<Priority>,
    source: Source<'_>,
    length: Option<u64>,
) -> Result<Response, Problem> {
    let reserve = shared.context.settings.now().reserve;
    let come = spool(&folder, source, length, shared.api.max_upload, reserve).await?;
    let (identity, hash) = (come.identity, come.hash);
    let there = Arc::clone(&folder);
    let path = ask(&shared.context, move |_| {
        there.check().map_err(Problem::unavailable)?;
        come.place(&there, &path, key.as_ref().map(|taken| &taken.key)).map_err(|error| unplaced(&error))
    })
    .await?;
    tracing::info!(folder = %folder.name, file = %path, bytes = identity.size, blake3 = %hash, "A file came by the web.");
    let id = hand_over(shared, &folder, path, Some(identity), priority).await??;
    answer(shared, id).await
}

fn unplaced(error: &io::Error) -> Problem {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            Problem::new(StatusCode::INSUFFICIENT_STORAGE, "there is no room on the disk; try again later")
        }
        io::ErrorKind::NotADirectory => Problem::conflict("a part of the name is no folder in the folder for drops"),
        io::ErrorKind::AlreadyExists => Problem::conflict("thousands of such names are taken; choose another one"),
        _ => Problem::unavailable(format!("the file cannot be brought into the folder for drops: {}", error.kind())),
    }
}

/// A file that lies in a folder already.
async fn by_name(shared: &Shared, there: There) -> Result<Response, Problem> {
    let asked = Path::new(&there.path);
    let (folder, below) = if asked.is_absolute() {
        let found = shared.context.folders.iter().find_map(|folder| Some((folder, asked.strip_prefix(folder.inbox()).ok()?)));
        let (folder, below) = found.ok_or_else(|| Problem::bad("`path` must lie below `in/` of a folder that is served"))?;
        (Arc::clone(folder), below)
    } else {
        (folder_of(&shared.context, there.folder.as_deref())?, asked)
    };
    let path = RelPath::from_path(below).map_err(|error| Problem::bad(format!("`path`: {error}")))?;
    let id = hand_over(shared, &folder, path, None, there.priority).await??;
    answer(shared, id).await
}

/// Hands a file to the daemon, and waits for the number of its job.
async fn hand_over(
    shared: &Shared,
    folder: &Folder,
    path: RelPath,
    placed: Option<Identity>,
    priority: Option<Priority>,
) -> Result<Result<JobId, Untaken>, Problem> {
    let (handed, answer) = Handed::new(folder.name.clone(), path, placed, priority);
    let silent = || Problem::unavailable("the daemon is busy; the file is there and will be taken; try again to learn its job");
    shared.context.events.send(Event::Handed(handed)).map_err(|_| silent())?;
    let answered = timeout(2 * PATIENCE, answer).await.map_err(|_| silent())?.map_err(|_| silent())?;
    Ok(answered.map(|submitted| submitted.id))
}

impl From<Untaken> for Problem {
    fn from(untaken: Untaken) -> Self {
        let words = untaken.to_string();
        match untaken {
            Untaken::Missing => Self::missing(words),
            Untaken::Unfinished => Self::conflict(words),
            Untaken::NoMesh(_) => Self::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, words),
            Untaken::Refused(_) => Self::bad(words),
            Untaken::Unavailable(_) => Self::unavailable(words),
        }
    }
}

async fn answer(shared: &Shared, id: JobId) -> Result<Response, Problem> {
    let job = ask(&shared.context, move |context| job_of(context, id)).await?;
    let location = [(LOCATION, format!("/v1/jobs/{id}"))];
    Ok((StatusCode::ACCEPTED, location, Json(Shown::from(&job))).into_response())
}
