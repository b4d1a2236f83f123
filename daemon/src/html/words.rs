//! A job in words for people: where it stands, and what to do.

use maud::{Markup, html};
use suture_store::job::Withdrawal;
use suture_store::{Ending, Job, Kind, State, Time};

use crate::left::area;
use crate::night::NEED_SOMEONE;
use crate::sample::is_difference;
use crate::say::plain;
use crate::shown::{hint, when};
use crate::units::{show_count, show_when};

/// How many of these there are, as the first line of a morning.
pub(crate) fn how_many_need_you(count: u64) -> String {
    match count {
        0 => "Nothing needs you.".into(),
        1 => "One file needs you.".into(),
        count => format!("{} files need you.", show_count(count)),
    }
}

/// How many of them are of which kind, in a line: pictures among the drops are no reason to hurry.
pub(crate) fn of_which_kind(count: impl Fn(Kind) -> u64) -> String {
    let counts = NEED_SOMEONE.map(|kind| (kind, count(kind)));
    let some = counts.iter().filter(|(_, count)| *count > 0);
    some.map(|(kind, count)| format!("{}: {}", label(*kind), show_count(*count))).collect::<Vec<_>>().join("; ")
}

/// Where a job stands, and the class of that.
pub(crate) fn state(job: &Job) -> (&'static str, &'static str) {
    match (job.kind(), &job.state) {
        (Kind::Done, State::Ended { publication }) if publication.ending == Ending::Clean => ("Clean", "good"),
        (Kind::Done, State::Ended { publication }) if publication.ending == Ending::Skipped => ("Skipped", "good"),
        (Kind::Done, _) => ("Repaired", "good"),
        (kind, _) => (label(kind), class(kind)),
    }
}

/// A state in words.
pub(crate) fn label(kind: Kind) -> &'static str {
    match kind {
        Kind::Noticed => "Not taken",
        Kind::Queued => "Waiting",
        Kind::Waiting => "Waiting, tried again later",
        Kind::Alone => "Waiting to run alone",
        Kind::Running => "In work",
        Kind::Concluded | Kind::Publishing | Kind::Published => "Almost done",
        Kind::Parked => "Ready, but held up",
        Kind::Done => "Done",
        Kind::Carried => "Carried along",
        Kind::Failed => "Failed",
        Kind::NeedsReview => "Needs review",
        Kind::Rejected => "Rejected",
        Kind::Quarantined => "In quarantine",
        Kind::Cancelled => "Cancelled",
    }
}

/// Is it good, to be looked at, or bad?
pub(crate) fn class(kind: Kind) -> &'static str {
    match kind {
        Kind::Done | Kind::Carried => "good",
        Kind::Noticed | Kind::Parked | Kind::NeedsReview => "review",
        Kind::Failed | Kind::Quarantined => "bad",
        _ => "",
    }
}

/// The state as a mark.
pub(crate) fn mark(job: &Job) -> Markup {
    let (words, class) = state(job);
    html! { span class={ "state " (class) } { (words) } }
}

/// What a person does with it now; empty: nothing.
pub(crate) fn advice(job: &Job) -> String {
    match (&job.state, job.kind()) {
        (_, Kind::Rejected) => "Ask for a better file. Choose “Approve” if you want the result after all.".into(),
        (State::Ended { publication }, _) => ended(job, publication.ending),
        (_, Kind::Noticed) => "Suture does not read this format. Move the file out of in/, or export it as STL or 3MF and drop it again.".into(),
        (_, Kind::Parked) => {
            "The result is ready, but cannot be put in its place. Remove the reason (free space, rights of the folder); Suture tries again by itself.".into()
        }
        (_, Kind::Waiting) => "Nothing, unless the reason stays. Suture tries again by itself.".into(),
        (State::Cancelled { why }, _) => match why {
            Withdrawal::Operator => "Nothing. Choose “Try again” if you want it after all.".into(),
            Withdrawal::Changed => "Nothing. The file as it is now has a job of its own.".into(),
            Withdrawal::Vanished => "Nothing. Drop the file again if you miss its result.".into(),
        },
        _ => String::new(),
    }
}

/// The same beside a link to the job's page, which says all of it.
pub(crate) fn brief_advice(job: &Job) -> String {
    match job.kind() {
        Kind::NeedsReview if !has_two_results(job) => "Open it and look at the pictures; then approve or reject it.".into(),
        _ => advice(job),
    }
}

/// Was it computed twice, with two results?
fn has_two_results(job: &Job) -> bool {
    job.publication().is_some_and(|publication| is_difference(&publication.reason))
}

fn ended(job: &Job, ending: Ending) -> String {
    match ending {
        Ending::Clean | Ending::Repaired if hint(job).is_some() => "Read the note. If the part is as it was meant, print the result.".into(),
        Ending::Clean | Ending::Repaired => "Print the result.".into(),
        Ending::NeedsReview if has_two_results(job) => {
            "Use neither result. Do what the reason says to find the cause, then try again.".into()
        }
        Ending::NeedsReview => {
            let best = job.publication().and_then(|publication| publication.output.as_ref());
            let best = best.map_or_else(|| "the result".to_owned(), |name| format!("{}/{name}", area(ending.area())));
            format!("Look at the pictures and the reasons. If {best} is what the file was meant to be, approve it: then it is published. If not, reject it, and ask for a better file.")
        }
        Ending::Carried if hint(job).is_some() => "Read the note. A mesh that names this file gets another one of that name.".into(),
        Ending::Carried => "Nothing. It lies beside the result of the mesh that names it.".into(),
        Ending::Skipped => "Use what is there. If that is not it, take it out of out/, and drop this file again.".into(),
        Ending::NameTaken => "Look at what has that name in out/. Take it away, then try again; or give the file another name, and drop it again.".into(),
        Ending::NotGood => "Do not print it. Its report says what is wrong, and where. Ask for another file, or repair it under other settings, if a reason names one.".into(),
        Ending::Unreadable => "It is not a mesh that Suture can read. Open the file, or ask for it again.".into(),
        Ending::Refused => "It needs more than this machine allows (see the reason). Raise that limit and try again, or ask for a simpler file.".into(),
        Ending::Environment => "The file is not to blame. Remove the reason (disk, rights), then try again.".into(),
        Ending::Quarantined => {
            "Its repair came to no end (see the reason). Release it to try once more, for example after an update or with a longer limit; else ask for another file.".into()
        }
    }
}

/// Text as a page shows it: no line ends within a number.
pub(crate) fn prose(text: &str) -> String {
    let text: Vec<char> = plain(text).chars().collect();
    let is_digit = |place: usize| text.get(place).is_some_and(char::is_ascii_digit);
    let is_gap = |place: usize| place > 0 && is_digit(place - 1) && (place + 1..place + 4).all(is_digit) && !is_digit(place + 4);
    (0..).zip(&text).map(|(place, &c)| if c == ' ' && is_gap(place) { '\u{a0}' } else { c }).collect()
}

/// A time, for people and for programs.
pub(crate) fn time(time: Time) -> Markup {
    html! { time datetime=(when(time)) { (show_when(time.0)) } }
}

#[cfg(test)]
mod tests {
    use suture_store::job::Parked;
    use suture_store::{JobId, Publication, RelPath, Source};

    use super::*;

    fn job() -> Job {
        let path = RelPath::new(*b"a.stl").unwrap();
        let source = Source { folder: "hot".into(), path, dev: 1, ino: 2, size: 84, mtime_ns: 4, profile: "default".into() };
        Job::queued(JobId(7), source, Time(0))
    }

    fn ended(ending: Ending) -> Job {
        let output = Some(RelPath::new(*b"a.best.stl").unwrap());
        let publication = Publication {
            ending,
            reason: String::new(),
            output,
            output_hash: None,
            report_hash: None,
            recipe: None,
            reused: None,
            source_ctime_ns: None,
            original: None,
            stays: false,
            decision: None,
        };
        Job { state: State::Ended { publication }, ..job() }
    }

    #[test]
    fn no_line_ends_within_a_number() {
        let text = "of 12 345 678 edges, 8 014 178 more; 2 bodies, 1 2345, 12 3";
        let kept = "of 12\u{a0}345\u{a0}678 edges, 8\u{a0}014\u{a0}178 more; 2 bodies, 1 2345, 12 3";
        assert_eq!(prose(text), kept);
        assert_eq!(prose(" 123 \u{1b}"), plain(" 123 \u{1b}"));
    }

    /// Whoever comes in the morning knows of each file what to do with it.
    #[test]
    fn whatever_has_come_to_rest_has_advice() {
        use Ending::{
            Carried, Clean, Environment, NameTaken, NeedsReview, NotGood, Quarantined, Refused, Repaired, Skipped, Unreadable,
        };
        let all =
            [Clean, Repaired, NeedsReview, NotGood, Unreadable, Refused, Environment, Quarantined, Skipped, NameTaken, Carried]
                .map(ended);
        let noticed = Job::noticed(JobId(1), job().source, "a picture", Time(0));
        let parked = Job { parked: Some(Parked { until: Some(Time(9)), tries: 1, committed: false }), ..job() };
        let cancelled = Job { state: State::Cancelled { why: Withdrawal::Operator }, ..job() };
        for job in all.iter().chain([&noticed, &parked, &cancelled]) {
            assert!(!advice(job).is_empty(), "{:?}", job.state);
        }
        assert_eq!(parked.kind(), Kind::Parked);
        assert!(advice(&all[2]).contains("failed/a.best.stl"));
        let State::Ended { mut publication } = all[2].state.clone() else { panic!("it has ended") };
        publication.reason = "computed twice, with two results: a made one".into();
        let differs = Job { state: State::Ended { publication }, ..job() };
        assert!(advice(&differs).starts_with("Use neither result.") && brief_advice(&differs) == advice(&differs));
        assert_eq!(advice(&job()), "", "what waits needs no one");
        // What is good, to be looked at, or bad is told by more than its colour.
        let words: std::collections::BTreeSet<_> = Kind::ALL.iter().map(|kind| (label(*kind), class(*kind))).collect();
        assert_eq!(words.iter().map(|(word, _)| word).collect::<std::collections::BTreeSet<_>>().len(), words.len());
    }
}
