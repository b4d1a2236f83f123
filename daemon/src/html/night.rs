//! `suture night`: what became of the files of a night, for whoever comes in the morning: a page for a browser, or a table for a spreadsheet.

use std::path::Path;

use maud::{Markup, html};
use suture_store::{Job, Kind, Time};

use super::page;
use super::words::{advice, how_many_need_you, mark, of_which_kind, prose, state, time};
use crate::cli::service::NightArgs;
use crate::create;
use crate::exit::Exit;
use crate::left::result_path;
use crate::night::{Part, part};
use crate::say::{complain, plain};
use crate::shown::{self, hint, reason};
use crate::units::show_count;
use crate::world::{Machine, World};

/// All jobs of a hot folder, or a line for people.
type All<'a> = &'a dyn Fn(&Path) -> Result<Vec<Job>, (String, Exit)>;

/// Writes the page, or the table.
pub(crate) fn run(args: &NightArgs, all: All<'_>) -> Exit {
    match write(args, all) {
        Ok(()) => Exit::Good,
        Err((line, exit)) => {
            complain(&line);
            exit
        }
    }
}

fn write(args: &NightArgs, all: All<'_>) -> Result<(), (String, Exit)> {
    let ending = args.output.extension().unwrap_or_default().to_ascii_lowercase();
    let make: fn(&Night) -> String = match ending.to_str() {
        Some("html" | "htm") => |night| whole(night).into_string(),
        Some("csv") => |night| table(&[night.need.as_slice(), &night.ended].concat()),
        _ => return Err((format!("{}: name it .html or .csv", args.output.display()), Exit::Refused)),
    };
    let since = Time(Machine.wall().0.saturating_sub(u64::try_from(args.since.as_millis()).unwrap_or(u64::MAX)));
    let night = Night::of(all(&args.dir)?, since);
    create::place(&args.output, make(&night).as_bytes(), args.force)
        .map_err(|error| (format!("{}: cannot be written: {error}", args.output.display()), Exit::Refused))
}

/// The jobs of a night, the latest first.
struct Night {
    since: Time,
    /// Jobs that need a person, however old.
    need: Vec<Job>,
    /// Others that ended in the night.
    ended: Vec<Job>,
    /// How many are not over.
    live: u64,
    /// Are they of several folders, so that a name does not say which file it is?
    of_folders: bool,
}

impl Night {
    fn of(mut jobs: Vec<Job>, since: Time) -> Self {
        jobs.reverse();
        let of_folders = jobs.first().is_some_and(|first| jobs.iter().any(|job| job.source.folder != first.source.folder));
        let mut of = |wanted| jobs.extract_if(.., |job| part(job, &(since..)) == Some(wanted)).collect::<Vec<_>>();
        let (need, ended, live) = (of(Part::NeedsSomeone), of(Part::Ended), of(Part::Lives).len() as u64);
        Self { since, need, ended, live, of_folders }
    }
}

fn whole(night: &Night) -> Markup {
    let Night { since, need, ended, live, of_folders } = night;
    let count = |kind: Kind| ended.iter().filter(|job| job.kind() == kind).count() as u64;
    let (noted, others): (Vec<&Job>, Vec<&Job>) = ended.iter().partition(|job| hint(job).is_some());
    page(
        "The night",
        &html! {
            h1 { "The night" }
            div class={ "outcome " (if need.is_empty() { "good" } else { "review" }) } role="status" {
                strong { (how_many_need_you(need.len() as u64)) }
                @if !need.is_empty() { p { (of_which_kind(|kind| need.iter().filter(|job| job.kind() == kind).count() as u64)) "." } }
                p { "Since " (time(*since)) ": " (show_count(count(Kind::Done))) " done, " @if count(Kind::Carried) > 0 { (show_count(count(Kind::Carried))) " carried along, " } (show_count(count(Kind::Rejected))) " rejected, " (show_count(count(Kind::Cancelled))) " cancelled." }
                @if *live > 0 { p { (show_count(*live)) " not over yet: they wait or are in work." } }
            }
            @if !need.is_empty() {
                h2 { "What needs you" }
                (rows(need, *of_folders, "Why", true))
                @if need.iter().any(|job| job.kind() == Kind::NeedsReview) {
                    p { "Where to decide: on the daemon’s page of that job, or with " code { "suture jobs approve" } " or " code { "suture jobs reject" } " and the job’s number." }
                }
            }
            @if !noted.is_empty() { h2 { "Good, with a note" } (rows(noted, *of_folders, "Note", true)) }
            @if !others.is_empty() { h2 { "What else ended" } (rows(others, *of_folders, "Why", false)) }
        },
    )
}

/// `said`: what is to be said of each; `is_advised`: with what to do.
fn rows<'a>(jobs: impl IntoIterator<Item = &'a Job>, of_folders: bool, said: &str, is_advised: bool) -> Markup {
    html! {
        div class="wide" { table {
            thead { tr {
                th scope="col" class="n" { "Job" } th scope="col" { "File" } @if of_folders { th scope="col" { "Folder" } } th scope="col" { "State" } th scope="col" { "Since" } th scope="col" { (said) }
                @if is_advised { th scope="col" { "What to do" } }
            } }
            tbody { @for job in jobs { tr {
                td class="n" { (job.id) } td class="file" { (plain(&job.source.path.to_string())) } @if of_folders { td { (plain(&job.source.folder)) } } td { (mark(job)) } td class="time" { (time(job.changed)) } td class="why" { (prose(&reason(job))) }
                @if is_advised { td class="why" { (plain(&advice(job))) } }
            } } }
        } }
    }
}

/// As RFC 4180 has it.
fn table(jobs: &[Job]) -> String {
    const HEAD: &str = "job,folder,file,state,words,dropped,changed,bytes,attempts,profile,reason,result,decision\r\n";
    jobs.iter().fold(HEAD.to_owned(), |mut text, job| {
        // Below its hot folder, whose name stands beside it: a store may serve several.
        let result = result_path(Path::new(""), job).map(|path| path.display().to_string()).unwrap_or_default();
        let decision = job.decision().map(ToString::to_string).unwrap_or_default();
        let fields = [
            job.id.to_string(),
            job.source.folder.clone(),
            job.source.path.to_string(),
            job.kind().name().to_owned(),
            state(job).0.to_owned(),
            shown::when(job.submitted),
            shown::when(job.changed),
            job.source.size.to_string(),
            job.attempts.0.to_string(),
            job.source.profile.clone(),
            reason(job),
            result,
            decision,
        ];
        text += &fields.map(|field| cell(&field)).join(",");
        text + "\r\n"
    })
}

/// A cell that no spreadsheet takes for a formula: names of files are other people's.
fn cell(text: &str) -> String {
    let text = plain(text);
    let guarded = if text.starts_with(['=', '+', '-', '@']) { format!("'{text}") } else { text };
    if guarded.contains([',', '"', '\r', '\n']) { format!("\"{}\"", guarded.replace('"', "\"\"")) } else { guarded }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_hold_what_they_are_given_and_no_formula() {
        for (text, cell_of_it) in [
            ("part.stl", "part.stl"),
            ("a,b", "\"a,b\""),
            ("say \"x\"", "\"say \"\"x\"\"\""),
            ("=1+1", "'=1+1"),
            ("-5,@", "\"'-5,@\""),
        ] {
            assert_eq!(cell(text), cell_of_it);
        }
    }
}
