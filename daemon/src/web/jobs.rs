//! Jobs: lists, one of them, and what an operator may want of it. What is wished is done by [`crate::control`], as for `suture jobs`.

use std::sync::Arc;

use axum::body::{Body, Bytes, to_bytes};
use axum::extract::{Path, Query, State};
use axum::http::{StatusCode, Uri};
use axum::{Extension, Json};
use serde::{Deserialize, Serialize};
use suture_store::{Decision, Job, JobId, Kind, Look, Priority, StoreError, Verdict};
use tokio::time::timeout;

use crate::attempt::Context;
use crate::control::{JobsWish, change};
use crate::retention::sweep::is_gone;

use super::ask::{PATIENCE, ask};
use super::problem::Problem;
use super::shared::Shared;
use super::tokens::Caller;
use crate::shown::Shown;

/// Jobs on a page unless someone asks for another number, and at most.
const PAGE: usize = 50;
const LONGEST_PAGE: usize = 500;
/// Longest body of a wish in bytes.
const LONGEST_WISH: usize = 64 << 10;

/// Which jobs are asked for.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Wanted {
    /// Names of states, with commas.
    pub state: Option<String>,
    pub folder: Option<String>,
    limit: Option<usize>,
    /// The `next` of the page before.
    pub cursor: Option<JobId>,
}

impl Wanted {
    fn look(self) -> Result<Look, Problem> {
        let limit = self.limit.unwrap_or(PAGE);
        if !(1..=LONGEST_PAGE).contains(&limit) {
            return Err(Problem::bad(format!("`limit` must be from 1 to {LONGEST_PAGE}")));
        }
        let kind = |name: &str| Kind::ALL.into_iter().find(|kind| kind.name() == name);
        let names: Vec<_> = Kind::ALL.into_iter().map(Kind::name).collect();
        let wrong = |name: &str| Problem::bad(format!("there is no state `{name}`; name some of {}", names.join(", ")));
        let states = self.state.iter().flat_map(|states| states.split(','));
        let kinds = states.map(|name| kind(name).ok_or_else(|| wrong(name))).collect::<Result<_, _>>()?;
        Ok(Look { kinds, folder: self.folder, before: self.cursor, limit })
    }
}

#[derive(Serialize)]
pub(super) struct Page {
    jobs: Vec<Shown>,
    /// The `cursor` of the next page; absent after the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<String>,
}

/// The parameters of a question.
///
/// # Errors
/// When one is unknown, or wrong.
pub(super) fn parameters<T: serde::de::DeserializeOwned>(uri: &Uri) -> Result<T, Problem> {
    Query::try_from_uri(uri).map(|Query(wanted)| wanted).map_err(|error| Problem::bad(error.body_text()))
}

/// `GET /v1/jobs`: a page of jobs, the latest first.
pub(super) async fn list(State(shared): State<Arc<Shared>>, uri: Uri) -> Result<Json<Page>, Problem> {
    let wanted = parameters::<Wanted>(&uri)?;
    let page = ask(&shared.context, move |context| page_of(context, wanted)).await?;
    Ok(Json(Page {
        jobs: page.jobs.iter().map(|job| Shown::now(job, &shared.context.bus)).collect(),
        next: page.next.map(|id| id.to_string()),
    }))
}

/// The jobs that are asked for.
///
/// # Errors
/// When the question is wrong, or the store does not answer.
pub(super) fn page_of(context: &Context, wanted: Wanted) -> Result<suture_store::Page, Problem> {
    let look = wanted.look()?;
    let known = |name: &String| context.folders.iter().any(|folder| folder.name == *name);
    if let Some(name) = look.folder.as_ref().filter(|name| !known(name)) {
        return Err(Problem::bad(format!("there is no folder `{name}`")));
    }
    Ok(context.store.page(&look)?)
}

/// The number in a path.
///
/// # Errors
/// When there is no such job, since that is no number.
pub(super) fn id_of(text: &str) -> Result<JobId, Problem> {
    let plain = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    plain.then(|| text.parse().ok()).flatten().ok_or_else(|| Problem::missing("there is no such job; a job has a number"))
}

/// The job of that number.
///
/// # Errors
/// When there is none.
pub(super) fn job_of(context: &Context, id: JobId) -> Result<Job, Problem> {
    Ok(context.store.get(id)?.ok_or(StoreError::Unknown(id))?)
}

/// `GET /v1/jobs/{id}`: one job.
pub(super) async fn show(State(shared): State<Arc<Shared>>, Path(id): Path<String>) -> Result<Json<Shown>, Problem> {
    let id = id_of(&id)?;
    let job = ask(&shared.context, move |context| job_of(context, id)).await?;
    Ok(Json(Shown::now(&job, &shared.context.bus)))
}

/// Does what is wished of a job that is there; the job afterwards.
///
/// # Errors
/// When there is no such job, or the wish does not fit it.
pub(super) async fn grant(
    shared: &Shared,
    id: &str,
    of: impl FnOnce(&Job) -> Result<JobsWish, Problem> + Send + 'static,
) -> Result<Job, Problem> {
    let id = id_of(id)?;
    ask(&shared.context, move |context| {
        let wish = of(&job_of(context, id)?)?;
        let changed = change(context, &wish)?;
        changed.into_iter().next().ok_or_else(|| StoreError::Unknown(id).into())
    })
    .await
}

/// The same, and the job as it is shown.
async fn wish(
    shared: &Shared,
    id: &str,
    of: impl FnOnce(&Job) -> Result<JobsWish, Problem> + Send + 'static,
) -> Result<Json<Shown>, Problem> {
    let job = grant(shared, id, of).await?;
    Ok(Json(Shown::now(&job, &shared.context.bus)))
}

/// `POST /v1/jobs/{id}/retry`: it is tried again.
pub(super) async fn retry(State(shared): State<Arc<Shared>>, Path(id): Path<String>) -> Result<Json<Shown>, Problem> {
    wish(&shared, &id, |job| Ok(JobsWish::Retry(job.id))).await
}

/// `POST /v1/jobs/{id}/cancel`: it is stopped.
pub(super) async fn cancel(State(shared): State<Arc<Shared>>, Path(id): Path<String>) -> Result<Json<Shown>, Problem> {
    wish(&shared, &id, |job| Ok(JobsWish::Cancel(job.id))).await
}

/// `POST /v1/jobs/{id}/release`: it leaves the quarantine, and is tried again.
pub(super) async fn release(State(shared): State<Arc<Shared>>, Path(id): Path<String>) -> Result<Json<Shown>, Problem> {
    wish(&shared, &id, released).await
}

/// What releases a job.
///
/// # Errors
/// When it is not in quarantine.
pub(super) fn released(job: &Job) -> Result<JobsWish, Problem> {
    match job.kind() {
        Kind::Quarantined => Ok(JobsWish::Retry(job.id)),
        kind => Err(Problem::conflict(format!("job {} is {kind}, not in quarantine", job.id))),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Rank {
    priority: Priority,
}

/// `POST /v1/jobs/{id}/priority`: it is taken sooner, or later.
pub(super) async fn rank(State(shared): State<Arc<Shared>>, Path(id): Path<String>, body: Body) -> Result<Json<Shown>, Problem> {
    let Rank { priority } = wished(body).await?;
    wish(&shared, &id, move |job| Ok(JobsWish::Rank(job.id, priority))).await
}

/// Who decides, and what they add.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Said {
    #[serde(default = "someone")]
    by: String,
    #[serde(default)]
    note: String,
}

fn someone() -> String {
    "local".into()
}

/// `POST /v1/jobs/{id}/approve`: its best attempt is published, as it was judged.
pub(super) async fn approve(
    State(shared): State<Arc<Shared>>,
    Path(id): Path<String>,
    Extension(caller): Extension<Caller>,
    body: Body,
) -> Result<Json<Shown>, Problem> {
    decide(&shared, &id, &caller, body, Verdict::Approved).await
}

/// `POST /v1/jobs/{id}/reject`: its result is not to be used.
pub(super) async fn reject(
    State(shared): State<Arc<Shared>>,
    Path(id): Path<String>,
    Extension(caller): Extension<Caller>,
    body: Body,
) -> Result<Json<Shown>, Problem> {
    decide(&shared, &id, &caller, body, Verdict::Rejected).await
}

async fn decide(shared: &Shared, id: &str, caller: &Caller, body: Body, verdict: Verdict) -> Result<Json<Shown>, Problem> {
    let Said { by, note } = match short(body).await? {
        // Nothing need be said.
        bytes if bytes.is_empty() => Said { by: someone(), note: String::new() },
        bytes => understood(&bytes)?,
    };
    let decision =
        Decision::new(verdict, caller.name().unwrap_or(&by), &note).map_err(|error| Problem::bad(error.to_string()))?;
    wish(shared, id, move |job| Ok(JobsWish::Decide(job.id, decision))).await
}

/// A small body of JSON.
///
/// # Errors
/// When it is too long, comes too slowly, or does not say what it should.
pub(super) async fn wished<T: serde::de::DeserializeOwned>(body: Body) -> Result<T, Problem> {
    understood(&short(body).await?)
}

fn understood<T: serde::de::DeserializeOwned>(bytes: &[u8]) -> Result<T, Problem> {
    serde_json::from_slice(bytes).map_err(|error| Problem::bad(format!("the request is not the JSON that is needed: {error}")))
}

/// A small body, whole.
///
/// # Errors
/// When it is too long, or comes too slowly.
pub(super) async fn short(body: Body) -> Result<Bytes, Problem> {
    let too_slow = || Problem::new(StatusCode::REQUEST_TIMEOUT, "the request did not come in time");
    let read = timeout(PATIENCE, to_bytes(body, LONGEST_WISH)).await.map_err(|_| too_slow())?;
    read.map_err(|_| {
        Problem::new(StatusCode::PAYLOAD_TOO_LARGE, format!("the request is longer than {LONGEST_WISH} bytes, or was cut off"))
    })
}

/// `DELETE /v1/jobs/{id}`: the record of a job at rest goes; its files stay.
pub(super) async fn forget(State(shared): State<Arc<Shared>>, Path(id): Path<String>) -> Result<StatusCode, Problem> {
    let id = id_of(&id)?;
    ask(&shared.context, move |context| {
        let job = job_of(context, id)?;
        if !job.kind().is_at_rest() {
            return Err(Problem::conflict(format!("job {id} is {}; only what is at rest can be forgotten", job.kind())));
        }
        let folder = context.folders.iter().find(|folder| folder.name == job.source.folder);
        // Without its record the file would be taken once more.
        if job.answers_for_source() && folder.is_none_or(|folder| !is_gone(folder, &job)) {
            return Err(Problem::conflict(format!(
                "job {id} stands for a file that may still lie where it was dropped; move that first"
            )));
        }
        match context.store.forget(&[id])? {
            0 => Err(Problem::conflict(format!("job {id} is at rest no longer"))),
            _ => Ok(()),
        }
    })
    .await?;
    tracing::info!(job = id.0, "The job is forgotten, as was wished.");
    Ok(StatusCode::NO_CONTENT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_question_is_refused() {
        let look = |query: &str| parameters::<Wanted>(&format!("/v1/jobs?{query}").parse().unwrap()).and_then(Wanted::look);
        let asked = look("state=done,queued_alone&limit=7&cursor=9&folder=a%20b").unwrap();
        let kinds = vec![Kind::Done, Kind::Alone];
        assert_eq!(asked, Look { kinds, folder: Some("a b".into()), before: Some(JobId(9)), limit: 7 });
        for wrong in ["state=good", "state=", "limit=0", "limit=501", "limit=x", "cursor=-1", "sort=up", "limit=1&limit=2"] {
            assert!(look(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn f28_a_job_has_a_number() {
        assert!(id_of("12").is_ok());
        for wrong in ["", "+1", "1x", "../1", "..", "%2e%2e", "99999999999999999999999", "1/result"] {
            assert!(id_of(wrong).is_err(), "{wrong}");
        }
    }
}
