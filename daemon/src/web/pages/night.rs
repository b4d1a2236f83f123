//! `/`: how the night went, for whoever comes in the morning. First what needs a person, with what to do; then what goes on; then the figures.

use std::sync::Arc;

use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::Response;
use maud::{Markup, html};
use suture_core::words::Counted;
use suture_store::{Host, Job, Kind, Look};

use super::frame::Frame;
use super::history::{link, list_of, why};
use crate::attempt::Context;
use crate::event_bus::Bus;
use crate::hosts;
use crate::html::words::{brief_advice, how_many_need_you, mark, of_which_kind, time};
use crate::night::NEED_SOMEONE;
use crate::say::plain;
use crate::units::{show_count, show_size};
use crate::web::ask::ask;
use crate::web::problem::Problem;
use crate::web::shared::Shared;
use crate::web::status::{self, Status};
use crate::web::tally::{Ended, Tally};

/// Jobs that someone works on.
const IN_WORK: [Kind; 4] = [Kind::Running, Kind::Concluded, Kind::Publishing, Kind::Published];
const WAITING: [Kind; 3] = [Kind::Queued, Kind::Waiting, Kind::Alone];
/// Rows of a table on this page.
const MOST_ROWS: usize = 25;

struct Night {
    status: Status,
    need_someone: Vec<Job>,
    in_work: Vec<Job>,
    /// Jobs that came back from an attempt, and wait for the next.
    put_off: Vec<Job>,
    ended: Ended,
    hosts: Vec<Host>,
    /// Can others share the store?
    is_shared: bool,
}

impl Night {
    fn of(context: &Arc<Context>, tally: &Arc<Tally>) -> Result<Self, Problem> {
        let latest = |kinds: &[Kind]| {
            let look = Look { kinds: kinds.to_vec(), limit: MOST_ROWS, ..Look::default() };
            context.store.page(&look).map(|page| page.jobs)
        };
        Ok(Self {
            status: status::of(context)?,
            need_someone: latest(&NEED_SOMEONE)?,
            in_work: latest(&IN_WORK)?,
            put_off: latest(&[Kind::Waiting])?,
            ended: tally.of(context)?,
            hosts: hosts::all(context)?,
            is_shared: context.settings.now().store.is_some(),
        })
    }

    fn count(&self, kinds: &[Kind]) -> u64 {
        kinds.iter().filter_map(|kind| self.status.jobs.get(kind.name())).sum()
    }

    /// Does a name of a file not say of which folder it is?
    fn of_folders(&self) -> bool {
        self.status.folders.len() > 1
    }
}

/// `GET /`.
pub(super) async fn night(State(shared): State<Arc<Shared>>, headers: HeaderMap) -> Result<Response, Problem> {
    let all = Arc::clone(&shared);
    let night = ask(&shared.context, move |_| Night::of(&all.context, &all.tally)).await?;
    let frame = Frame::of(&shared, &headers);
    let body = html! {
        h1 { "Overview" }
        div id="night" data-live {
            (standing(&night))
            (need_someone(&night))
            (noted(&night))
            (in_work(&night, &shared.context.bus))
            (put_off(&night))
            (last_day(&night))
            (folders(&night.status, &shared.context))
            (super::hosts::table(&night.hosts, night.is_shared, &frame))
            p class="soft" { "Suture " (night.status.version) }
        }
    };
    Ok(frame.page("/", "Overview", &body))
}

/// In a line: does anything need a person?
fn standing(night: &Night) -> Markup {
    let count = night.count(&NEED_SOMEONE);
    let Status { held, away, full, untold, stranded, reason, .. } = &night.status;
    let is_held = !held.is_empty()
        || !away.is_empty()
        || !full.is_empty()
        || !untold.is_empty()
        || !stranded.is_empty()
        || reason.is_some();
    let (class, words) = match (count, is_held) {
        (0, false) => ("good", how_many_need_you(0)),
        (0, true) => ("review", "No file needs you, but the daemon does not do all of its work.".to_owned()),
        (count, _) => ("review", how_many_need_you(count)),
    };
    html! {
        div class={ "outcome " (class) } role="status" {
            strong { (words) }
            @if count > 0 { p { (of_which_kind(|kind| night.count(&[kind]))) "." } }
            @if is_held { ul {
                @for why in held { li { "Nothing new is taken: " (plain(why)) "." } }
                @for why in away { li { "Out of reach: " (plain(why)) ". Suture goes on with it by itself when that is mended." } }
                @for why in full { li { "Disk full: " (plain(why)) ". Suture goes on by itself when there is room again." } }
                @for who in untold { li { (plain(who)) ". Suture tells it again by itself." } }
                @for what in stranded { li { "No host for it: " (plain(what)) "." } }
                @if let (Some(why), true) = (reason, held.is_empty() && away.is_empty()) { li { "Not ready: " (plain(why)) "." } }
            } }
        }
    }
}

fn need_someone(night: &Night) -> Markup {
    let more = night.count(&NEED_SOMEONE).saturating_sub(night.need_someone.len() as u64);
    html! {
        @if !night.need_someone.is_empty() {
            h2 { "What needs you" }
            (advised(&night.need_someone, night.of_folders(), "Why"))
            @if more > 0 { p { a href=(list_of(&NEED_SOMEONE)) { (show_count(more)) " more" } } }
        }
    }
}

/// Good results of the last day that a person may want to look at first.
fn noted(night: &Night) -> Markup {
    let Ended { noted, latest_noted, .. } = &night.ended;
    let more = noted.saturating_sub(latest_noted.len() as u64);
    html! {
        @if !latest_noted.is_empty() {
            h2 { "Good, with a note" }
            (advised(latest_noted, night.of_folders(), "Note"))
            @if more > 0 { p { a href=(list_of(&[Kind::Done])) { (show_count(more)) " more among all that is done" } } }
        }
    }
}

/// Jobs with what is to be said of each (`said`: what that is), and what to do.
fn advised(jobs: &[Job], of_folders: bool, said: &str) -> Markup {
    html! {
        div class="wide" { table {
            thead { tr { th scope="col" { "File" } @if of_folders { th scope="col" { "Folder" } } th scope="col" { "State" } th scope="col" { "Since" } th scope="col" { (said) } th scope="col" { "What to do" } } }
            tbody { @for job in jobs { tr {
                td class="file" { (link(job)) } @if of_folders { td { (plain(&job.source.folder)) } } td { (mark(job)) } td class="time" { (time(job.changed)) } td class="why" { (why(job)) } td class="why" { (plain(&brief_advice(job))) }
            } } }
        } }
    }
}

/// Jobs that Suture tries again by itself, and why it has to.
fn put_off(night: &Night) -> Markup {
    let more = night.count(&[Kind::Waiting]).saturating_sub(night.put_off.len() as u64);
    html! {
        @if !night.put_off.is_empty() {
            h2 { "Tried again later" }
            div class="wide" { table {
                thead { tr { th scope="col" { "File" } @if night.of_folders() { th scope="col" { "Folder" } } th scope="col" { "Since" } th scope="col" { "Why" } th scope="col" { "Tried again" } } }
                tbody { @for job in &night.put_off { tr {
                    td class="file" { (link(job)) } @if night.of_folders() { td { (plain(&job.source.folder)) } } td class="time" { (time(job.changed)) } td class="why" { (why(job)) } td class="time" { @if let Some(pause) = job.pause() { (time(pause)) } }
                } } }
            } }
            @if more > 0 { p { a href=(list_of(&[Kind::Waiting])) { (show_count(more)) " more" } } }
        }
    }
}

fn in_work(night: &Night, bus: &Bus) -> Markup {
    let waiting = night.count(&WAITING);
    html! {
        h2 { "In work" }
        @if night.in_work.is_empty() { p { "Nothing is in work." } } @else {
            div class="wide" { table {
                thead { tr { th scope="col" { "File" } @if night.of_folders() { th scope="col" { "Folder" } } th scope="col" { "State" } th scope="col" { "Since" } th scope="col" { "Step, and how far" } } }
                tbody { @for job in &night.in_work { tr {
                    td class="file" { (link(job)) } @if night.of_folders() { td { (plain(&job.source.folder)) } } td { (mark(job)) } td class="time" { (time(job.changed)) } td { (progress(job, bus)) }
                } } }
            } }
        }
        p { @if waiting == 0 { "No file waits." } @else {
            a href=(list_of(&WAITING)) { @if waiting == 1 { "One file waits" } @else { (show_count(waiting)) " files wait" } } "."
        } }
    }
}

/// Where a hot folder is.
pub(super) fn place_of(context: &Context, name: &str) -> String {
    let folder = context.folders.iter().find(|folder| folder.name == name);
    let full = folder.map(|folder| std::path::absolute(&folder.root).unwrap_or_else(|_| folder.root.clone()));
    full.map(|path| plain(&path.display().to_string())).unwrap_or_default()
}

/// How far a job in work is; a script keeps it current.
pub(super) fn progress(job: &Job, bus: &Bus) -> Markup {
    let far = bus.progress_of(job.id).filter(|_| job.kind() == Kind::Running);
    let (doing, percent) = match far {
        Some(far) => (far.doing, far.percent),
        None if job.kind() == Kind::Running => ("begun", 0),
        // What is held else is done, but for its way into place.
        None => ("bringing the result into place", 100),
    };
    html! {
        span data-progress=(job.id) {
            progress max="100" value=(percent) aria-label={ "Progress of job " (job.id) } {} " "
            span { (doing) @if (1..100).contains(&percent) { ", " (percent) " %" } }
        }
    }
}

fn last_day(night: &Night) -> Markup {
    let Ended { clean, repaired, skipped, carried, reused, needs_review, rejected, failed, quarantined, .. } = night.ended;
    let entry = |count: u64, class: &str, words: &str, kind: Kind| {
        html! { li class=[(count > 0).then_some(class)] { b { (show_count(count)) } @if count > 0 { a href=(list_of(&[kind])) { (words) } } @else { (words) } } }
    };
    html! {
        h2 { "Ended in the last 24 hours" }
        ul class="counts" {
            (entry(clean, "good", "clean", Kind::Done))
            (entry(repaired, "good", "repaired", Kind::Done))
            @if skipped > 0 { (entry(skipped, "good", "skipped", Kind::Done)) }
            @if carried > 0 { (entry(carried, "", "carried along", Kind::Carried)) }
            (entry(needs_review, "review", "need review", Kind::NeedsReview))
            @if rejected > 0 { (entry(rejected, "", "rejected", Kind::Rejected)) }
            (entry(failed, "bad", "failed", Kind::Failed))
            (entry(quarantined, "bad", "in quarantine", Kind::Quarantined))
        }
        @if reused > 0 { p { (Counted(reused, "result is a copy", "results are copies")) " of earlier ones." } }
    }
}

fn folders(status: &Status, context: &Context) -> Markup {
    html! {
        h2 { "Folders" }
        div class="wide" { table {
            thead { tr { th scope="col" { "Folder" } th scope="col" { "Where" } th scope="col" { "In reach" } th scope="col" class="n" { "Free for results" } } }
            tbody { @for folder in &status.folders { tr {
                th scope="row" { (plain(&folder.name)) }
                td class="file" { (place_of(context, &folder.name)) }
                td { @if folder.reachable { "yes" } @else { span class="state bad" { "no" } } }
                td class="n" { (folder.free_bytes.map_or_else(|| "–".to_owned(), show_size)) }
            } } }
        } }
    }
}
