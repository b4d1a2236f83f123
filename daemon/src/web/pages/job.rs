//! `/jobs/{id}`: what became of one file, why, and what a person can do with it.

use std::sync::Arc;

use axum::extract::{Path, State};
use axum::http::HeaderMap;
use axum::response::Response;
use maud::{Markup, html};
use suture_core::Report;
use suture_core::report::Outcome;
use suture_store::job::Withdrawal;
use suture_store::{Job, JobId, Query, State as JobState, StoreError};

use super::actions::forms;
use super::frame::Frame;
use super::night::{self, progress};
use super::places;
use crate::attempt::Context;
use crate::html::report;
use crate::html::words::{advice, prose, state, time};
use crate::left::area;
use crate::say::plain;
use crate::shown::{hint, reason};
use crate::units::show_size;
use crate::web::ask::ask;
use crate::web::jobs::{id_of, job_of};
use crate::web::problem::Problem;
use crate::web::reported::report_of;
use crate::web::shared::Shared;

/// A file that changed is dropped anew at once: its next job is looked for among so many.
const LATER: usize = 500;

/// `GET /jobs/{id}`.
pub(super) async fn job(
    State(shared): State<Arc<Shared>>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let id = id_of(&id)?;
    let job = ask(&shared.context, move |context| job_of(context, id)).await?;
    let has_ended = matches!(job.state, JobState::Ended { .. });
    // A report that is gone, or speaks of no mesh, is no reason to say nothing.
    let report = if has_ended { report_of(&shared, id).await.ok().flatten().map(by_name) } else { None };
    let anew = if is_changed(&job) {
        let changed = job.clone();
        ask(&shared.context, move |context| Ok(drop_after(context, &changed)?)).await?
    } else {
        None
    };
    let frame = Frame::of(&shared, &headers);
    let name = plain(&job.source.path.to_string());
    let reasons = whole_reasons(&job, report.as_ref());
    let body = html! {
        p { a href="/jobs" { "All jobs" } }
        h1 { (name) }
        div id="job" data-live {
            (standing(&job, reasons, report.as_ref()))
            @if let Some(anew) = anew { p { "It was dropped anew as " a href={ "/jobs/" (anew) } { "job " (anew) } "." } }
            @if job.kind().is_held() { p { (progress(&job, &shared.context.bus)) } }
            ul class="actions" { (forms(&frame, &job)) (downloads(&job)) }
        }
        // It stays as it is once it is there, so that no one is disturbed who looks at it.
        div id="report" data-live="once" { @if let Some(report) = &report { (reported(&job, report, !reasons.is_empty())) } }
        div id="facts" data-live { (facts(&job, &night::place_of(&shared.context, &job.source.folder))) }
        script type="module" src="/assets/view.js" {}
    };
    Ok(frame.page("", &format!("{name}: {}", state(&job).0), &body))
}

/// The report with the files' names alone: they have gone elsewhere since, and [`facts`] says where.
fn by_name(mut report: Report) -> Report {
    let files = std::iter::once(&mut report.input).chain(&mut report.output);
    files.for_each(|file| file.path = file.path.file_name().map(Into::into).unwrap_or_default());
    report
}

/// Was the file another one before it was worked on?
fn is_changed(job: &Job) -> bool {
    matches!(job.state, JobState::Cancelled { why: Withdrawal::Changed })
}

/// The job of the same path that came next, if it came soon.
fn drop_after(context: &Context, job: &Job) -> Result<Option<JobId>, StoreError> {
    let later = context.store.list(&Query { after: job.id, limit: LATER, ..Query::default() })?;
    let is_same = |other: &&Job| (&other.source.folder, &other.source.path) == (&job.source.folder, &job.source.path);
    Ok(later.iter().find(is_same).map(|other| other.id))
}

/// The reasons of a report, if they are why the job stands where it stands: the job's own line holds the begin of them only.
fn whole_reasons<'a>(job: &Job, report: Option<&'a Report>) -> &'a [String] {
    let line = reason(job);
    let begin = line.strip_suffix('…').unwrap_or(&line);
    let reasons = report.map_or(&[][..], |report| &report.verdict.reasons);
    if !begin.is_empty() && reasons.join("; ").starts_with(begin) { reasons } else { &[] }
}

/// Where it stands, why, and what to do. Whoever decides on a result is to know its notes before.
fn standing(job: &Job, reasons: &[String], report: Option<&Report>) -> Markup {
    let (words, class) = state(job);
    let (why, advice) = (reason(job), advice(job));
    let notes = report.filter(|_| hint(job).is_none()).map_or(&[][..], |report| &report.hints);
    html! {
        div class={ "outcome " (class) } role="status" {
            strong { (words) }
            @if !reasons.is_empty() { p { "Why:" } (report::reasons(reasons)) } @else if !why.is_empty() { p { (if hint(job).is_some() { "Note: " } else { "Why: " }) (prose(&why)) } }
            @for note in notes { p { "Note: " (prose(&note.text)) "." } }
            @if !advice.is_empty() { p { "What to do: " (plain(&advice)) } }
        }
    }
}

fn downloads(job: &Job) -> Markup {
    let JobState::Ended { publication } = &job.state else { return html! {} };
    html! {
        @if publication.output.is_some() && publication.output_hash.is_some() {
            li { a class="button" href={ "/v1/jobs/" (job.id) "/result" } download { @if publication.ending.is_good() { "Download the result" } @else { "Download the best attempt" } } }
        }
        @if publication.report_hash.is_some() { li { a class="button" href={ "/v1/jobs/" (job.id) "/report" } download { "Download the report (JSON)" } } }
    }
}

/// `place`: where its hot folder is.
fn facts(job: &Job, place: &str) -> Markup {
    let (part, path) = job.original();
    let fact = |name: &str, value: Markup| html! { dt { (name) } dd { (value) } };
    let text = |text: String| html! { (plain(&text)) };
    html! {
        h2 { "The job" }
        dl class="facts" {
            (fact("Number", html! { (job.id) }))
            (fact("Folder", html! { (plain(&job.source.folder)) @if !place.is_empty() { ": " (place) } }))
            @if let JobState::Ended { publication } = &job.state {
                @if let Some(output) = &publication.output {
                    (fact(if publication.ending.is_good() { "Result" } else { "Best attempt" },
                        text(format!("{}/{output}", if publication.ending.is_good() { "out" } else { area(publication.ending.area()) }))))
                }
                @if let Some(other) = publication.reused { (fact("Copied from", html! { a href={ "/jobs/" (other) } { "job " (other) } })) }
            }
            @if let Some(said) = job.decision() {
                (fact("Decision", html! { (plain(&said.to_string())) ", " (time(said.at)) @if !said.note.is_empty() { ": " (plain(&said.note)) } }))
            }
            (fact("Original", text(format!("{}/{path}", area(part)))))
            (fact("Size", text(show_size(job.source.size))))
            (fact("Profile", text(job.source.profile.clone())))
            (fact("Priority", html! { (job.priority) }))
            (fact("Attempts", html! { (job.attempts.0) }))
            (fact("Dropped", time(job.submitted)))
            (fact("Last change", time(job.changed)))
            @if let Some(pause) = job.pause() { (fact("Tried again", time(pause))) }
        }
    }
}

/// `is_explained`: the reasons stand above.
fn reported(job: &Job, report: &Report, is_explained: bool) -> Markup {
    let is_pair = report.output.is_some() && report.outcome != Outcome::Clean;
    let side = if is_pair { "both" } else { "before" };
    html! {
        h2 { "The verdict" }
        @if is_explained { (report::statement(report)) } @else { (report::verdict(report)) }
        h2 { "Pictures" }
        @if report.before.triangles > 0 {
            (report::figure(&format!("/v1/jobs/{}/preview?side={side}", job.id), is_pair))
            (report::behind(&format!("/v1/jobs/{}/preview?side={side}&from=behind", job.id)))
        } @else { p { "There is nothing to draw." } }
        (places::view(job.id, report, is_pair))
        (report::details(report))
    }
}
