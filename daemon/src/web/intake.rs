//! A body on its way to the disk.

use std::future::poll_fn;
use std::pin::Pin;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::{Body, Bytes};
use axum::extract::multipart::Field;
use axum::http::StatusCode;
use hyper::body::Body as _;
use tokio::task::spawn_blocking;
use tokio::time::timeout;

use crate::folder::Folder;
use crate::fsx;
use crate::units::show_size;
use crate::uploads::{Come, Coming};

use super::problem::Problem;

/// Bytes that are written at a time.
const PIECE: usize = 256 << 10;
/// Nothing at all may come for so long.
const SILENCE: Duration = Duration::from_secs(30);
/// After a while, so many bytes must come a second, over all.
const START: Duration = Duration::from_secs(60);
const SLOWEST: u64 = 8 << 10;
/// A result needs room, too, and so does what the engine puts aside.
const ROOM: u64 = 3;

/// Where the bytes come from.
pub(super) enum Source<'a> {
    Whole(Body),
    Part(Box<Field<'a>>),
}

impl Source<'_> {
    /// More of it; `None` at the end.
    async fn next(&mut self) -> Result<Option<Bytes>, Problem> {
        let cut = || Problem::bad("the upload was cut off");
        let next = async {
            match self {
                Self::Part(field) => field.chunk().await.map_err(|_| cut()),
                Self::Whole(body) => loop {
                    match poll_fn(|cx| Pin::new(&mut *body).poll_frame(cx)).await {
                        None => return Ok(None),
                        Some(Err(_)) => return Err(cut()),
                        // Trailers say nothing of the file.
                        Some(Ok(frame)) => {
                            if let Ok(bytes) = frame.into_data() {
                                return Ok(Some(bytes));
                            }
                        }
                    }
                },
            }
        };
        timeout(SILENCE, next).await.map_err(|_| too_slow())?
    }
}

fn too_slow() -> Problem {
    Problem::new(StatusCode::REQUEST_TIMEOUT, "the upload came too slowly")
}

fn too_large(most: u64) -> Problem {
    let words = format!("the file has more than {}; see `max_upload` in `[api]` of the configuration", show_size(most));
    Problem::new(StatusCode::PAYLOAD_TOO_LARGE, words)
}

fn no_room() -> Problem {
    Problem::new(StatusCode::INSUFFICIENT_STORAGE, "there is no room on the disk for the file and its result; try again later")
}

/// Writes it all to the folder's private part, synced. `length`: as the client says; `most`: bytes that it may have; `reserve`: bytes that stay free.
///
/// # Errors
/// When it is too large, comes too slowly or not whole, or there is no room.
pub(super) async fn spool(
    folder: &Arc<Folder>,
    mut source: Source<'_>,
    length: Option<u64>,
    most: u64,
    reserve: u64,
) -> Result<Come, Problem> {
    // A form has a little more around the file.
    let around = if matches!(source, Source::Part(_)) { 16 << 10 } else { 0 };
    if length.is_some_and(|length| length > most.saturating_add(around)) {
        return Err(too_large(most));
    }
    let there = Arc::clone(folder);
    let mut coming = on_disk(move || {
        there.check().map_err(Problem::unavailable)?;
        if fsx::free_space(&there.root, reserve) < length.unwrap_or(1).saturating_mul(ROOM) {
            return Err(no_room());
        }
        Coming::begin(&there).map_err(|error| unwritten(&error))
    })
    .await?;
    let (began, mut total, mut piece) = (Instant::now(), 0, Vec::with_capacity(PIECE));
    loop {
        let next = source.next().await?;
        let bytes = next.as_deref().unwrap_or_default();
        total += bytes.len() as u64;
        if total > most {
            return Err(too_large(most));
        }
        if began.elapsed() > START + Duration::from_secs(total / SLOWEST) {
            return Err(too_slow());
        }
        piece.extend_from_slice(bytes);
        if piece.len() >= PIECE || (next.is_none() && !piece.is_empty()) {
            let (there, full) = (Arc::clone(folder), std::mem::replace(&mut piece, Vec::with_capacity(PIECE)));
            coming = on_disk(move || {
                if fsx::free_space(&there.root, reserve) == 0 {
                    return Err(no_room());
                }
                coming.write(&full).map_err(|error| unwritten(&error))?;
                Ok(coming)
            })
            .await?;
        }
        if next.is_none() {
            break;
        }
    }
    if total == 0 {
        return Err(Problem::bad("the file is empty"));
    }
    on_disk(move || coming.finish().map_err(|error| unwritten(&error))).await
}

fn unwritten(error: &std::io::Error) -> Problem {
    match error.kind() {
        std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded => no_room(),
        kind => Problem::unavailable(format!("the upload cannot be written: {kind}")),
    }
}

async fn on_disk<T: Send + 'static>(work: impl FnOnce() -> Result<T, Problem> + Send + 'static) -> Result<T, Problem> {
    let failed = |_| Problem::new(StatusCode::INTERNAL_SERVER_ERROR, "an internal error; the log says more");
    spawn_blocking(work).await.map_err(failed)?
}
