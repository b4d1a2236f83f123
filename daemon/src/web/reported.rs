//! The report of a job, read for a page: the bytes that were published, or none.

use std::io::Read;

use suture_core::Report;
use suture_store::JobId;
use tokio::task::spawn_blocking;

use super::files::opened;
use super::problem::Problem;
use super::shared::Shared;
use super::verified::Which;

/// No report is longer, in bytes: its lists are bounded.
const LONGEST: u64 = 32 << 20;

/// What the engine said of a job's file; `None` where it never saw a mesh.
///
/// # Errors
/// When the job has left no report, or it is not in its place.
pub(super) async fn report_of(shared: &Shared, id: JobId) -> Result<Option<Report>, Problem> {
    let opened = opened(shared, id, Which::Report).await?;
    let read = move || {
        let mut text = Vec::new();
        (&*opened.file).take(LONGEST).read_to_end(&mut text)?;
        std::io::Result::Ok(serde_json::from_slice(&text).ok())
    };
    let unreadable = || Problem::unavailable("the report cannot be read; try again");
    spawn_blocking(read).await.map_err(|_| unreadable())?.map_err(|_| unreadable())
}
