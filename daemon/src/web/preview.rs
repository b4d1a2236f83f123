//! What a job's meshes look like: a picture, and a mesh with few triangles for a view that can be turned.

use std::sync::Arc;

use axum::extract::{Path, State};
use axum::http::{HeaderMap, Uri};
use axum::response::Response;
use serde::Deserialize;
use suture_store::{Job, JobId, State as JobState};

use super::ask::ask;
use super::drawing::{What, drawing};
use super::files::{Known, answer, folder_of};
use super::jobs::{id_of, job_of, parameters};
use super::problem::Problem;
use super::reported::report_of;
use super::shared::Shared;
use super::verified::Which;
use crate::left::{area, has_report, result_path};

/// Which of the two meshes is shown.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
enum Side {
    /// As it came.
    Before,
    /// The result, or the best attempt.
    After,
    /// Side by side.
    Both,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    side: Option<Side>,
    /// Only of a picture.
    from: Option<From>,
}

/// Where the eye is.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
enum From {
    /// Where most of what changed is seen.
    Front,
    /// Opposite to that.
    Behind,
}

/// `GET /v1/jobs/{id}/preview`: a picture.
pub(super) async fn preview(
    State(shared): State<Arc<Shared>>,
    Path(id): Path<String>,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let Asked { side, from } = parameters(&uri)?;
    let what = if from == Some(From::Behind) { What::Behind } else { What::Picture };
    show(&shared, &id, what, side, &headers).await
}

/// `GET /v1/jobs/{id}/view`: a mesh with few triangles, as [`crate::picture`] writes it.
pub(super) async fn view(
    State(shared): State<Arc<Shared>>,
    Path(id): Path<String>,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let Asked { side, from } = parameters(&uri)?;
    if from.is_some() {
        return Err(Problem::bad("a view can be turned: `from` is for pictures"));
    }
    if side == Some(Side::Both) {
        return Err(Problem::bad("a view is of one mesh: `side` is `before` or `after`"));
    }
    show(&shared, &id, What::Mesh, side, &headers).await
}

async fn show(shared: &Shared, id: &str, what: What, side: Option<Side>, headers: &HeaderMap) -> Result<Response, Problem> {
    let id = id_of(id)?;
    let job = ask(&shared.context, move |context| job_of(context, id)).await?;
    let after = after(shared, &job)?;
    let usual = match (&after, what) {
        (None, _) => Side::Before,
        (Some(_), What::Picture | What::Behind) => Side::Both,
        (Some(_), What::Mesh) => Side::After,
    };
    let missing = || Problem::missing(format!("job {id} has left no mesh"));
    let of = match side.unwrap_or(usual) {
        Side::Before => vec![before(shared, &job).await?],
        Side::After => vec![after.ok_or_else(missing)?],
        Side::Both => vec![before(shared, &job).await?, after.ok_or_else(missing)?],
    };
    let (opened, name) = drawing(shared, id, what, &of).await?;
    let kind = if what == What::Mesh { "application/octet-stream" } else { "image/png" };
    Ok(answer(opened, format!("\"{name}\""), kind, None, headers))
}

/// The file as it came. What its bytes were, its report says.
async fn before(shared: &Shared, job: &Job) -> Result<Known, Problem> {
    let missing = || no_mesh(job.id);
    let report = report_of(shared, job.id).await?.ok_or_else(missing)?;
    let hash = report.input.blake3.parse().map_err(|_| missing())?;
    let (place, path) = job.original();
    let root = &folder_of(&shared.context, job)?.root;
    Ok(Known { which: Which::Original, path: root.join(area(place)).join(path.to_path()), hash })
}

fn after(shared: &Shared, job: &Job) -> Result<Option<Known>, Problem> {
    let JobState::Ended { publication } = &job.state else {
        return Err(Problem::conflict(format!("job {} is {}; there is nothing to show yet", job.id, job.kind())));
    };
    if !has_report(publication) {
        return Err(no_mesh(job.id));
    }
    let path = result_path(&folder_of(&shared.context, job)?.root, job);
    Ok(path.zip(publication.output_hash).map(|(path, hash)| Known { which: Which::Result, path, hash }))
}

fn no_mesh(id: JobId) -> Problem {
    Problem::missing(format!("the file of job {id} was not read as a mesh; there is nothing to show"))
}
