//! `/jobs`: every job, the latest first.

use std::fmt::Write as _;
use std::sync::Arc;

use axum::extract::State;
use axum::http::{HeaderMap, Uri};
use axum::response::Response;
use maud::{Markup, html};
use suture_store::{Job, JobId, Kind};

use super::frame::Frame;
use crate::escape::escaped;
use crate::html::words::{mark, prose, time};
use crate::say::plain;
use crate::shown::reason;
use crate::units::show_count;
use crate::web::ask::ask;
use crate::web::jobs::{Wanted, page_of, parameters};
use crate::web::problem::Problem;
use crate::web::shared::Shared;

/// Choices of states: words, and names with commas.
const CHOICES: [(&str, &[Kind]); 10] = [
    ("Need review", &[Kind::NeedsReview]),
    ("Rejected", &[Kind::Rejected]),
    ("Failed", &[Kind::Failed]),
    ("In quarantine", &[Kind::Quarantined]),
    ("Done", &[Kind::Done]),
    ("Carried along", &[Kind::Carried]),
    ("In work", &[Kind::Running, Kind::Concluded, Kind::Publishing, Kind::Published]),
    ("Waiting", &[Kind::Queued, Kind::Waiting, Kind::Alone]),
    ("Held up or not taken", &[Kind::Parked, Kind::Noticed]),
    ("Cancelled", &[Kind::Cancelled]),
];

/// The address of a list of these states.
pub(super) fn list_of(kinds: &[Kind]) -> String {
    let names: Vec<_> = kinds.iter().map(|kind| kind.name()).collect();
    address(Some(&names.join(",")), None, None)
}

fn address(state: Option<&str>, folder: Option<&str>, cursor: Option<JobId>) -> String {
    let mut text = "/jobs".to_owned();
    let pairs =
        [("state", state.map(str::to_owned)), ("folder", folder.map(escaped)), ("cursor", cursor.map(|id| id.to_string()))];
    for (name, value) in pairs.into_iter().filter_map(|(name, value)| Some((name, value?))) {
        // Names of states are letters and commas.
        let _ = write!(text, "{}{name}={value}", if text.contains('?') { '&' } else { '?' });
    }
    text
}

/// `GET /jobs`.
pub(super) async fn history(State(shared): State<Arc<Shared>>, headers: HeaderMap, uri: Uri) -> Result<Response, Problem> {
    let wanted: Wanted = parameters(&uri)?;
    let asked = wanted.clone();
    let (page, counts) = ask(&shared.context, move |context| Ok((page_of(context, asked)?, context.store.counts()?))).await?;
    let folders: Vec<_> = shared.context.folders.iter().map(|folder| folder.name.as_str()).collect();
    let older = page.next.map(|next| address(wanted.state.as_deref(), wanted.folder.as_deref(), Some(next)));
    let body = html! {
        h1 { "All jobs" }
        (filters(&wanted, &counts, &folders))
        div id="list" data-live {
            @if page.jobs.is_empty() { p { @if older.is_some() { "None here; see the older ones." } @else { "There are none." } } } @else { (table(&page.jobs, folders.len() > 1)) }
            ul class="filters" {
                @if wanted.cursor.is_some() { li { a href=(address(wanted.state.as_deref(), wanted.folder.as_deref(), None)) { "Latest" } } }
                @if let Some(older) = older { li { a href=(older) rel="next" { "Older" } } }
            }
        }
    };
    Ok(Frame::of(&shared, &headers).page("/jobs", "All jobs", &body))
}

fn filters(wanted: &Wanted, counts: &[(Kind, u64)], folders: &[&str]) -> Markup {
    let folder = wanted.folder.as_deref();
    let entry = |words: &str, address: String, is_here: bool| html! { li { a href=(address) aria-current=[is_here.then_some("true")] { (words) } } };
    let count = |kinds: &[Kind]| counts.iter().filter(|(kind, _)| kinds.contains(kind)).map(|(_, count)| count).sum::<u64>();
    html! {
        nav aria-label="States" { ul class="filters" {
            (entry(&format!("All ({})", show_count(counts.iter().map(|(_, count)| count).sum())), address(None, folder, None), wanted.state.is_none()))
            @for (words, kinds) in CHOICES {
                @let names = kinds.iter().map(|kind| kind.name()).collect::<Vec<_>>().join(",");
                (entry(&format!("{words} ({})", show_count(count(kinds))), address(Some(&names), folder, None), wanted.state.as_ref() == Some(&names)))
            }
        } }
        @if folders.len() > 1 {
            nav aria-label="Folders" { ul class="filters" {
                (entry("Every folder", address(wanted.state.as_deref(), None, None), folder.is_none()))
                @for name in folders { (entry(&plain(name), address(wanted.state.as_deref(), Some(name), None), folder == Some(*name))) }
            } }
        }
    }
}

fn table(jobs: &[Job], of_folders: bool) -> Markup {
    html! {
        div class="wide" { table {
            thead { tr {
                th scope="col" class="n" { "Job" } th scope="col" { "File" } @if of_folders { th scope="col" { "Folder" } }
                th scope="col" { "State" } th scope="col" { "Since" } th scope="col" { "Why, or a note" }
            } }
            tbody { @for job in jobs { tr {
                td class="n" { (job.id) }
                td class="file" { (link(job)) }
                @if of_folders { td { (plain(&job.source.folder)) } }
                td { (mark(job)) }
                td class="time" { (time(job.changed)) }
                td class="why" { (why(job)) @if let Some(other) = job.publication().and_then(|publication| publication.reused) { " Copy of the result of " a href={ "/jobs/" (other) } { "job " (other) } "." } }
            } } }
        } }
    }
}

/// Why a job stands where it stands. What was too long to be kept is whole on its page.
pub(super) fn why(job: &Job) -> Markup {
    let reason = prose(&reason(job));
    html! { (reason) @if reason.ends_with('…') { " " a href={ "/jobs/" (job.id) } { "All of it" } } }
}

/// The file's name, which leads to its job.
pub(super) fn link(job: &Job) -> Markup {
    html! { a href={ "/jobs/" (job.id) } { (plain(&job.source.path.to_string())) } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_keep_what_was_chosen() {
        assert_eq!(address(None, None, None), "/jobs");
        assert_eq!(address(Some("done,failed"), Some("a&b"), Some(JobId(7))), "/jobs?state=done,failed&folder=a%26b&cursor=7");
        assert_eq!(list_of(&[Kind::Failed, Kind::NeedsReview]), "/jobs?state=failed,needs_review");
    }

    #[test]
    fn every_state_can_be_chosen() {
        assert!(Kind::ALL.iter().all(|kind| CHOICES.iter().any(|(_, kinds)| kinds.contains(kind))));
    }
}
