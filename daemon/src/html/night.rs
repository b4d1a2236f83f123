//! `suture night`: what became of the files of a night, for whoever comes in the morning: a page for a browser, or a table for a spreadsheet.

use std::path::Path;

use maud::{Markup, html};
use suture_store::{Job, Kind, Time};

use super::page;
use super::words::{advice, how_many_need_you, mark, state, time};
use crate::cli::service::NightArgs;
use crate::create;
use crate::exit::Exit;
use crate::left::result_path;
use crate::night::{Part, part};
use crate::say::{complain, plain};
use crate::shown::{self, reason};
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
    let make: fn(&Path, &[Job], &[Job]) -> String = match ending.to_str() {
        Some("html" | "htm") => |_, need, ended| whole(need, ended).into_string(),
        Some("csv") => |dir, need, ended| table(dir, &[need, ended].concat()),
        _ => return Err((format!("{}: name it .html or .csv", args.output.display()), Exit::Refused)),
    };
    let since = Time(Machine.wall().0.saturating_sub(u64::try_from(args.since.as_millis()).unwrap_or(u64::MAX)));
    let (need, ended) = parted(all(&args.dir)?, since);
    create::place(&args.output, make(&args.dir, &need, &ended).as_bytes(), args.force)
        .map_err(|error| (format!("{}: cannot be written: {error}", args.output.display()), Exit::Refused))
}

/// Jobs that need a person, however old; and others that ended since then. The latest first.
fn parted(mut jobs: Vec<Job>, since: Time) -> (Vec<Job>, Vec<Job>) {
    jobs.reverse();
    let mut of = |wanted| jobs.extract_if(.., |job| part(job, &(since..)) == Some(wanted)).collect();
    (of(Part::NeedsSomeone), of(Part::Ended))
}

fn whole(need: &[Job], ended: &[Job]) -> Markup {
    let count = |kind: Kind| ended.iter().filter(|job| job.kind() == kind).count() as u64;
    page(
        "The night",
        &html! {
            h1 { "The night" }
            div class={ "outcome " (if need.is_empty() { "good" } else { "review" }) } role="status" {
                strong { (how_many_need_you(need.len() as u64)) }
                p { (show_count(count(Kind::Done))) " done, " (show_count(count(Kind::Rejected))) " rejected, " (show_count(count(Kind::Cancelled))) " cancelled." }
            }
            @if !need.is_empty() { h2 { "What needs you" } (rows(need, true)) }
            @if !ended.is_empty() { h2 { "What else ended" } (rows(ended, false)) }
        },
    )
}

/// `is_advised`: with what to do.
fn rows(jobs: &[Job], is_advised: bool) -> Markup {
    html! {
        table {
            thead { tr {
                th scope="col" { "File" } th scope="col" { "State" } th scope="col" { "Since" } th scope="col" { "Why" }
                @if is_advised { th scope="col" { "What to do" } }
            } }
            tbody { @for job in jobs { tr {
                td { (plain(&job.source.path.to_string())) } td { (mark(job)) } td { (time(job.changed)) } td { (plain(&reason(job))) }
                @if is_advised { td { (plain(&advice(job))) } }
            } } }
        }
    }
}

/// As RFC 4180 has it.
fn table(dir: &Path, jobs: &[Job]) -> String {
    const HEAD: &str = "job,folder,file,state,words,dropped,changed,bytes,attempts,profile,reason,result,decision\r\n";
    jobs.iter().fold(HEAD.to_owned(), |mut text, job| {
        let result = result_path(dir, job).map(|path| path.display().to_string()).unwrap_or_default();
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
