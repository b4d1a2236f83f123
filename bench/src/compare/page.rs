//! The published page, and the short table of the README.

use std::fmt::Write;

use super::book::{Book, did_its_work};
use super::child::Cost;
use super::machine::Machine;
use super::markdown::{self, or_dash};
use super::page_arrays;
use super::page_closing;
use super::page_damage;
use super::page_formats;
use super::page_meaning;
use super::page_outlines;
use super::page_simplify;
use super::page_skin;
use super::page_solids;
use super::page_stores;
use super::record::{Input, Judged, is_good};
use super::sides::{LICENCES, Side};
use super::statistics::{Spread, number, short as short_number, spaced};
use super::way::{Cache, Way};

const ABOUT: &str = "\
Written by `suture-bench publish` from the raw runs in `results/`: every single process is there, with its command, place in the order,
wall and CPU time, memory and what it said. Nothing here is typed by hand. How to run any of it again is in [README.md](README.md).

Each program runs as a whole process over the same file, in alternation, forwards and backwards by turns. *Warm*: the input was read
into the page cache just before. *Cold*: it was synced and dropped from there (`posix_fadvise`); a virtual disk may still have it in
memory of its own. Before each start everything dirty is written back, and the time ends when the output is synced to the disk.
Times are medians with the range over the runs in brackets; × is the median of the ratios of runs that followed each other. CPU is
user and system time. *Resident* is the largest resident set, in which a mapped input counts although the system can take it back;
*anonymous* is memory that it cannot take back, looked at every few milliseconds.

The outputs of all programs are judged by the same check, which shares no code with Suture (`src/judge`): *good* is closed,
manifold and consistently oriented, with the sound model's volume within 1 %. Self-intersection is not looked at by this check. *Kept*
is the share of input records that stand in the output byte for byte and in order; where another program writes its own normals or
attributes, the share by corners alone follows.
";

/// The whole page, in Markdown. `plots` are file names and captions.
pub(super) fn page(book: &Book, plots: &[(String, String)]) -> String {
    let mut page = format!("# Suture beside its peers\n\n{ABOUT}");
    for (name, caption) in plots {
        let _ = write!(page, "\n![{caption}](plots/{name})\n\n*{caption}*\n");
    }
    page += &targets(book);
    page += &page_damage::damage(book);
    page += &flat(book);
    page += &searches(book);
    page += &page_closing::shapes(book);
    page += &page_closing::files(book);
    page += &page_meaning::meaning(book);
    page += &page_skin::skin(book);
    page += &page_solids::solids(book);
    page += &page_arrays::arrays(book);
    page += &page_formats::formats(book);
    page += &page_outlines::outlines(book);
    page += &page_simplify::simplify(book);
    page += &page_stores::stores(book);
    for input in book.inputs() {
        page += &of_input(book, input);
    }
    page += &peers(book);
    page += &sessions(book);
    page
}

/// The programs that were measured, and under which licence each comes.
fn peers(book: &Book) -> String {
    let mut page = String::from("\n## What ran\n\n| name | what it is | licence |\n|---|---|---|\n");
    let inputs = book.inputs();
    for side in Side::ALL {
        let ran = book.chapters.iter().flat_map(|chapter| chapter.solved()).any(|line| line.side == side)
            || book.chapters.iter().flat_map(|chapter| chapter.understood()).any(|line| line.side == side)
            || book.chapters.iter().flat_map(|chapter| chapter.transfers()).any(|line| line.way.side == side)
            || inputs.iter().any(|input| book.ways(input).iter().any(|way| way.side == side));
        let name = side.facts().name;
        let licence = LICENCES.iter().find(|(peer, _)| name.starts_with(peer)).map_or("", |(_, licence)| licence);
        if ran {
            let _ = writeln!(page, "| {name} | {} | {licence} |", side.facts().about);
        }
    }
    page += "\nPeers are installed by the command and run as processes of their own; no part of any is in Suture.\n";
    let mut skipped: Vec<_> = book.chapters.iter().flat_map(|chapter| chapter.skipped()).collect();
    skipped.sort_unstable();
    skipped.dedup();
    for (side, reason) in skipped {
        let _ = writeln!(page, "\nLeft out in a session: {}, since {reason}.", side.facts().name);
    }
    page
}

/// Where and when.
fn sessions(book: &Book) -> String {
    let mut page = String::from("\n## Sessions\n\nWhere two sessions measured the same, the later one is shown.\n");
    for chapter in &book.chapters {
        for session in chapter.sessions() {
            let Machine { processor, processors, memory_bytes, kernel, file_system, load, disk, versions } = &session.machine;
            let gigabytes = *memory_bytes as f64 / 1e9;
            let _ = write!(page, "\n### {}, {}\n\n```\n{}\n```\n\n", chapter.name, date(session.began), session.command);
            let _ =
                writeln!(page, "* {processor}, {processors} processors, {gigabytes:.1} GB; {kernel}; load {load} at the start");
            let disk = disk
                .map(|disk| format!(", which writes {:.0} MB/s synced and reads {:.0} MB/s", disk.write / 1e6, disk.read / 1e6));
            let _ = writeln!(page, "* files on {file_system}{}\n* {}", disk.unwrap_or_default(), versions.join(", "));
        }
    }
    page
}

/// Year, month, day, hour and minute of seconds since 1970, UTC; by Hinnant's `civil_from_days`, whose year begins in March.
fn date(seconds: u64) -> String {
    let days = seconds / 86_400 + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let march_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * march_month + 2) / 5 + 1;
    let month = if march_month < 10 { march_month + 3 } else { march_month - 9 };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    format!("{year}-{month:02}-{day:02} {:02}:{:02} UTC", seconds / 3600 % 24, seconds / 60 % 60)
}

/// Size and kind of an input, and a line for each way that ran over it.
fn of_input(book: &Book, input: &Input) -> String {
    let name = if input.seed.is_some() { input.case.clone() } else { format!("`{}`", input.case) };
    let files = if input.files > 1 { format!(", {} files", spaced(input.files)) } else { String::new() };
    let mut page = format!("\n## {name}{files}, {} triangles", spaced(input.triangles));
    let rate = if input.files > 1 { "files/s" } else { "million triangles/s" };
    let _ = write!(
        page,
        "\n\n| | wall s | {rate} | CPU s | resident MB | anonymous MB | × suture | × suture-no-si | runs | output | kept |\n"
    );
    page += "|---|---:|---:|---:|---:|---:|---:|---:|---:|---|---|\n";
    for way in book.ways(input).into_iter().filter(|way| !way.side.is_of_arrays()) {
        let wall = book.wall(input, &way);
        let amount = if input.files > 1 { input.files as f64 } else { input.triangles as f64 / 1e6 };
        let memory = |value: fn(&Cost) -> Option<u64>| {
            or_dash(
                book.spread(input, &way, |cost| value(cost).map(|bytes| bytes as f64 / 1e6)).map(|spread| number(spread.most)),
            )
        };
        let beside = |side| {
            let other = Way { side, threads: None, memory: None, ..way.clone() };
            or_dash(book.wall_ratio(input, &way, &other).map(|ratio| number(ratio.median)))
        };
        let runs = book.runs(input, &way);
        let failed = runs.iter().find(|run| !did_its_work(input, run)).map(|run| run.cost.end.clone());
        let row = [
            way.name(),
            wall.map(Spread::text).or(failed).unwrap_or_default(),
            or_dash(wall.map(|wall| number(amount / wall.median))),
            or_dash(book.spread(input, &way, |cost| Some(cost.cpu_seconds)).map(|spread| number(spread.median))),
            memory(|cost| Some(cost.peak_resident_bytes)),
            memory(|cost| cost.peak_anonymous_bytes),
            beside(Side::Suture),
            beside(Side::SutureNoSi),
            runs.len().to_string(),
            or_dash(book.outcome(input, way.side).map(|outcome| outcome.verdict(input))),
            or_dash(book.outcome(input, way.side).and_then(|outcome| outcome.judged.as_ref()).map(kept)),
        ];
        page += &markdown::row(&row);
    }
    for way in book.ways(input) {
        let held = book.spread(input, &way, |cost| cost.facts.get("cgroup peak bytes").map(|bytes| *bytes as f64 / 1e6));
        if let Some(held) = held {
            let _ = writeln!(page, "\n{}: the cgroup held at most {} MB, page cache included.", way.name(), number(held.most));
        }
    }
    if let Some(same) = book.sameness(input) {
        let files =
            if same.distinct == 1 { "one and the same file".into() } else { format!("{} different files", same.distinct) };
        let _ = write!(page, "\n{} runs of suture wrote {files}", same.outputs);
        if same.counted > 0 {
            let _ = write!(page, "; its counts of the input were the generator's in {} of {} runs", same.right, same.counted);
        }
        page += ".\n";
    }
    page
}

/// Share of records kept; by corners, too, where that is another number.
fn kept(judged: &Judged) -> String {
    // Never rounded up to all.
    let percent = |share: f64| format!("{:.2} %", (share * 1e4).floor() / 100.0);
    let (records, corners) = (percent(judged.records.share()), percent(judged.corners.share()));
    if records == corners { records } else { format!("{records} (corners {corners})") }
}

/// The ratios that the project asks of itself, beside those that were measured.
fn targets(book: &Book) -> String {
    let asked = [
        (Side::PymeshlabCompetent, Side::SutureNoSi, "at least 150"),
        (Side::PymeshlabPlain, Side::SutureNoSi, "at least 45"),
        (Side::SutureNoSi, Side::CpSynced, "at most 4"),
        (Side::PymeshlabCompetentSi, Side::Suture, "at least 60"),
        (Side::Meshlib, Side::Suture, "at least 8"),
    ];
    let mut rows = String::new();
    for input in book.inputs() {
        let large = input.size >= 9_000_000 && ["mixed", "clean"].contains(&input.case.as_str()) && input.files == 1;
        for (slow, fast, limit) in asked.into_iter().filter(|_| large) {
            if let Some(ratio) = book.wall_ratio(input, &Way::plain(slow), &Way::plain(fast)) {
                let (slow, fast) = (slow.facts().name, fast.facts().name);
                let name = format!("{}, {}", input.case, short_number(input.size));
                let _ = writeln!(rows, "| {slow} / {fast} | {name} | {limit} | {} | {} |", ratio.text(), ratio.count);
            }
        }
        for peer in [Side::PymeshlabPlain, Side::PymeshlabCompetent].into_iter().filter(|_| input.files > 1) {
            if let Some(ratio) = book.wall_ratio(input, &Way::plain(peer), &Way::plain(Side::Suture)) {
                let name = format!("{} files of {}", spaced(input.files), short_number(input.size));
                let _ = writeln!(
                    rows,
                    "| {} / suture | {name} | at least 20 | {} | {} |",
                    peer.facts().name,
                    ratio.text(),
                    ratio.count
                );
            }
        }
        for side in [Side::Suture, Side::SutureNoSi].into_iter().filter(|_| input.files == 1) {
            let threads = |threads| Way { threads: Some(threads), ..Way::plain(side) };
            if let Some(ratio) = book.wall_ratio(input, &threads(1), &threads(2)) {
                let name = format!("{}, {}", input.case, short_number(input.size));
                let what = format!("{}: 1 thread / 2 threads", side.facts().name);
                let _ = writeln!(rows, "| {what} | {name} | at least 1.7 | {} | {} |", ratio.text(), ratio.count);
            }
        }
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "\n## What is asked of it\n\n| ratio of wall times | input | asked | measured | pairs |\n|---|---|---|---:|---:|\n{rows}"
    )
}

/// Is the rate the same at every size?
fn flat(book: &Book) -> String {
    let mut rows = String::new();
    let inputs = book.inputs();
    for case in ["mixed", "clean"] {
        for side in [Side::Suture, Side::SutureNoSi] {
            for cache in [Cache::Warm, Cache::Cold] {
                let way = Way { cache, ..Way::plain(side) };
                let of_case = inputs.iter().filter(|input| input.case == case && input.files == 1 && input.size >= 1_000_000);
                let rates: Vec<_> = of_case
                    .filter_map(|input| Some((input.size, input.triangles as f64 / 1e6 / book.wall(input, &way)?.median)))
                    .collect();
                let Some(middle) = Spread::of(rates.iter().map(|(_, rate)| *rate)).filter(|spread| spread.count > 1) else {
                    continue;
                };
                let least = 100.0 * (middle.least / middle.median - 1.0);
                let most = 100.0 * (middle.most / middle.median - 1.0);
                let list: Vec<_> =
                    rates.iter().map(|(size, rate)| format!("{} at {}", number(*rate), short_number(*size))).collect();
                let _ = writeln!(rows, "| {case} | {} | {} | {least:+.0} % to {most:+.0} % |", way.name(), list.join(", "));
            }
        }
    }
    if rows.is_empty() {
        return rows;
    }
    let head = "| case | | million triangles/s | beside their median |\n|---|---|---|---:|\n";
    format!("\n## Flat\n\nAsked: 1 M, 10 M, 50 M and 100 M triangles within ±30 %.\n\n{head}{rows}")
}

/// The search for self-intersections alone.
fn searches(book: &Book) -> String {
    let mut rows = String::new();
    for input in book.inputs() {
        let Some([ours, theirs, ratio]) = book.search(input) else { continue };
        let count = |side| or_dash(book.fact(input, side, "pairs").map(spaced));
        let row = [
            input.case.clone(),
            spaced(input.triangles),
            ours.text(),
            theirs.text(),
            ratio.text(),
            ratio.count.to_string(),
            count(Side::Inspect),
            count(Side::MeshlibDetect),
        ];
        rows += &markdown::row(&row);
    }
    if rows.is_empty() {
        return rows;
    }
    let head = "| input | triangles | suture s | MeshLib s | ratio | rounds | pairs, suture | pairs, MeshLib |\n\
                |---|---:|---:|---:|---:|---:|---:|---:|\n";
    let text = "What the search adds to `suture inspect` (with it, less without it, in one round), beside the call of \
                `findSelfCollidingTriangles` alone over a mesh that MeshLib has loaded; both build their trees within that time, on all \
                processors. Pairs are counted by each one's own rules of what is mere contact. Asked: a ratio of at least 4.";
    format!("\n## Self-intersections, the search alone\n\n{text}\n\n{head}{rows}")
}

/// The README's table: seconds of the main programs over the main inputs.
pub(super) fn short(book: &Book) -> String {
    let sides = [Side::SutureNoSi, Side::Suture, Side::PymeshlabPlain, Side::PymeshlabCompetent, Side::Meshlib, Side::CpSynced];
    let inputs: Vec<_> = book.inputs().into_iter().filter(|input| input.seed.is_some() && input.files == 1).collect();
    let inputs = inputs.iter().filter(|input| input.size >= 1_000_000);
    let mut rows: Vec<_> = inputs.filter(|input| book.wall(input, &Way::plain(Side::PymeshlabPlain)).is_some()).collect();
    rows.sort_by_key(|input| std::cmp::Reverse(input.size));
    let shown: Vec<_> =
        sides.into_iter().filter(|side| rows.iter().any(|input| book.wall(input, &Way::plain(*side)).is_some())).collect();
    let names: Vec<_> = shown.iter().map(|side| side.facts().name).collect();
    let mut text = format!("| seconds | {} |\n|---|{}\n", names.join(" | "), "---:|".repeat(names.len()));
    for input in rows {
        let _ = write!(text, "| {}, {} |", input.case, short_number(input.size));
        for side in &shown {
            let seconds = book.wall(input, &Way::plain(*side)).map(|wall| number(wall.median));
            let good = book.outcome(input, *side).and_then(|outcome| outcome.judged.as_ref());
            let mark = good.is_some_and(|judged| !is_good(&judged.judgement, input.volume));
            let _ = write!(text, " {}{} |", or_dash(seconds), if mark { " ✗" } else { "" });
        }
        text += "\n";
    }
    text
}

/// Puts `text` between the marks of a page; `None` when the marks are not there.
pub(super) fn put_in(page: &str, text: &str) -> Option<String> {
    let begin = "<!-- begin: written by suture-bench publish -->\n";
    let end = "<!-- end: written by suture-bench publish -->";
    let (before, rest) = page.split_once(begin)?;
    let (_, after) = rest.split_once(end)?;
    Some(format!("{before}{begin}{text}{end}{after}"))
}

#[cfg(test)]
mod tests {
    use super::super::book::tests::{chapter, input};
    use super::*;

    #[test]
    fn days_are_named() {
        assert_eq!(date(0), "1970-01-01 00:00 UTC");
        assert_eq!(date(951_827_696), "2000-02-29 12:34 UTC");
        assert_eq!(date(1_798_761_599), "2026-12-31 23:59 UTC");
    }

    #[test]
    fn only_what_is_between_the_marks_changes() {
        let mark = |word| format!("<!-- {word}: written by suture-bench publish -->\n");
        let page = format!("a\n{}old\n{}b\n", mark("begin"), mark("end"));
        assert_eq!(put_in(&page, "new\n").unwrap(), page.replace("old", "new"));
        assert_eq!(put_in("no marks", "new"), None);
    }

    #[test]
    fn a_page_has_a_line_for_each_way_and_says_what_is_asked() {
        let input = input("mixed", 10_000_000);
        let runs =
            [(Side::SutureNoSi, 1.0, 0), (Side::PymeshlabPlain, 50.0, 0), (Side::Trimesh, 9.0, 1), (Side::SutureNoSi, 1.5, 0)];
        let book = Book { chapters: vec![chapter(&input, &runs)] };
        let page = page(&book, &[("a.svg".into(), "what it shows".into())]);
        assert!(page.contains("| pymeshlab-plain / suture-no-si | mixed, 10 M | at least 45 | 50.0 | 1 |"), "{page}");
        assert!(page.contains("| suture-no-si | 1.25 (1.00–1.50) | 8.00 |"), "{page}");
        assert!(page.contains("| trimesh | exit 1 | – |"), "{page}");
        assert!(page.contains("2 runs of suture wrote one and the same file"), "{page}");
        assert!(page.contains("![what it shows](plots/a.svg)"));
        assert_eq!(
            short(&book),
            "| seconds | suture-no-si | pymeshlab-plain |\n|---|---:|---:|\n| mixed, 10 M | 1.25 | 50.0 |\n"
        );
    }

    #[test]
    fn rates_of_several_sizes_are_set_beside_their_median() {
        let inputs = [input("clean", 1_000_000), input("clean", 10_000_000)];
        let chapters = inputs.iter().map(|input| chapter(input, &[(Side::Suture, input.size as f64 / 1e7 + 0.1, 0)]));
        let page = flat(&Book { chapters: chapters.collect() });
        assert!(page.contains("| clean | suture | 5.00 at 1 M, 9.09 at 10 M | -29 % to +29 % |"), "{page}");
    }
}
