//! A report as a table for the terminal: what was wrong before and after, what was done, the verdict, what it cost. A clean file
//! says so in one line.

use std::fmt::Write as _;

use suture_core::Report;
use suture_core::report::{Defects, Format, Outcome, SelfIntersections, Task};
use suture_core::words::triangles;

use crate::say::plain;
use crate::shaped;
use crate::units::{show_box, show_count, show_number, show_point, show_seconds, show_size};

/// Boundary loops, and pairs that intersect, listed before the table refers to the report.
const LOOPS_SHOWN: usize = 5;
const PAIRS_SHOWN: usize = 3;

/// A row's name and where to find its count.
type Row = (&'static str, fn(&Defects) -> u64);

/// The defects in the order of the table; rows that are zero on both sides are left out.
const ROWS: [Row; 19] = [
    ("non-finite triangles", |d| d.nonfinite),
    ("degenerate (two equal corners)", |d| d.degenerate_index),
    ("degenerate (no area)", |d| d.degenerate_area),
    ("duplicate triangles", |d| d.duplicates_same),
    ("opposite duplicates", |d| d.duplicates_opposite),
    ("boundary edges", |d| d.boundary_edges),
    ("boundary loops", |d| d.boundary_loops),
    ("vertices to weld", |d| d.weldable_vertices),
    ("T-junctions", |d| d.noncommon_vertices),
    ("non-manifold edges", |d| d.nonmanifold_edges),
    ("non-manifold vertices", |d| d.nonmanifold_vertices),
    ("edges whose triangles face opposite ways", |d| d.inconsistent_edges),
    ("inside-out components", |d| d.inverted_components),
    ("enclosed bodies", |d| d.nested_positive),
    ("self-intersecting triangles", |d| found(d).map_or(0, |s| if s.given_up { TOO_MANY } else { s.triangles })),
    ("pairs that cross", |d| found(d).map_or(0, |s| s.crossing_pairs)),
    ("pairs that overlap", |d| found(d).map_or(0, |s| s.overlapping_pairs)),
    ("components", |d| d.components),
    ("bodies", |d| d.bodies),
];
/// Rows from here on describe; they are no defects, and shown only beside some.
const FIRST_DESCRIPTION: usize = 17;
/// Stands for a count that was given up.
const TOO_MANY: u64 = u64::MAX;

fn found(defects: &Defects) -> Option<&SelfIntersections> {
    defects.self_intersections.as_ref()
}

/// A count for people.
fn shown(count: u64) -> String {
    if count == TOO_MANY { "too many".into() } else { show_count(count) }
}

/// A count of the file as it came, which was not made of all that a weld in the stream set right first.
fn counted_before(report: &Report, of: fn(&Defects) -> u64) -> String {
    let count = of(&report.before);
    if count == 0 && !report.before.at_least.is_empty() { "not counted".into() } else { shown(count) }
}

/// The whole table, with a final newline.
pub(crate) fn render(report: &Report) -> String {
    let mut out = String::new();
    let name = report.input.path.display().to_string();
    if report.outcome == Outcome::Clean && report.input.findings.is_empty() {
        let copied = if report.output.is_some() { ", copied byte for byte" } else { "" };
        line(&mut out, format_args!("{name}: clean{copied} ({}; {}; {})", size(report), report.verdict.statement, rate(report)));
        features(&mut out, report);
        shaping(&mut out, report);
        hints(&mut out, report);
        return out;
    }
    line(&mut out, format_args!("{name}: {} ({})", headline(report), size(report)));
    for finding in &report.input.findings {
        item(&mut out, "file", finding);
    }
    defects(&mut out, report);
    loops(&mut out, report);
    for repair in &report.repairs {
        let times = if repair.count == 1 { String::new() } else { format!(" × {}", show_count(repair.count)) };
        let note = if repair.note.is_empty() { String::new() } else { format!(": {}", repair.note) };
        item(&mut out, "done", &format!("{}{times}{note}", repair.name.as_str().replace('_', " ")));
    }
    features(&mut out, report);
    shaping(&mut out, report);
    for left in report.loops_left.iter().take(LOOPS_SHOWN) {
        let what = format!("loop of {} edges at {}: {}", show_count(left.edges), show_point(&left.at), left.reason);
        item(&mut out, "left", &what);
    }
    if report.loops_left.len() > LOOPS_SHOWN {
        item(
            &mut out,
            "left",
            &format!("{} more loops, listed in the report", show_count((report.loops_left.len() - LOOPS_SHOWN) as u64)),
        );
    }
    wraps(&mut out, report);
    pairs_left(&mut out, report);
    if report.task == Task::Repair && report.outcome != Outcome::Clean && report.profile.repair {
        item(&mut out, "edit", &edit(report));
    }
    let judged = if report.verdict.good { "good" } else { "not good" };
    item(&mut out, "verdict", &format!("{judged}: {}", report.verdict.statement));
    for reason in &report.verdict.reasons {
        item(&mut out, "", reason);
    }
    if let Some(certificate) = report.certificate.as_ref().filter(|c| report.verdict.good && !c.printable) {
        item(&mut out, "", &format!("not certified, for want of: {}", certificate.missing.join(", ").replace('_', " ")));
    }
    hints(&mut out, report);
    item(&mut out, "cost", &rate(report));
    if let Some(output) = &report.output {
        item(&mut out, "wrote", &format!("{} ({})", output.path.display(), show_size(output.bytes)));
    } else if report.task == Task::Repair {
        item(&mut out, "wrote", "nothing");
    }
    out
}

fn hints(out: &mut String, report: &Report) {
    for hint in &report.hints {
        item(out, "hint", &hint.text);
    }
}

/// Residue, smoothing, fewer triangles.
fn shaping(out: &mut String, report: &Report) {
    for (word, line) in shaped::lines(report) {
        item(out, word, &line);
    }
}

/// Features that were removed or left, those with a reason first.
fn features(out: &mut String, report: &Report) {
    let Some(features) = &report.features else { return };
    let counted = |count: u64, words: &str| format!("{} {words}", show_count(count));
    let gone = format!("{} gone, {} added", triangles(features.triangles_gone), show_count(features.triangles_added));
    item(out, "feature", &format!("{}, {}: {gone}", counted(features.removed, "removed"), counted(features.left, "left")));
    if let Some(reason) = &features.why_not {
        item(out, "", reason);
    }
    let (left, removed): (Vec<_>, Vec<_>) = features.listed.iter().partition(|feature| feature.left.is_some());
    for feature in left.into_iter().chain(removed).take(LOOPS_SHOWN) {
        let place = show_point(&feature.centre.map(|x| x as f32));
        let fate = feature.left.as_ref().map_or_else(|| "removed".to_owned(), |reason| format!("left, since {reason}"));
        item(out, "", &format!("{} of {} at {place}: {fate}", feature.kind.replace('-', " "), show_number(feature.size)));
    }
    if features.listed.len() > LOOPS_SHOWN {
        let more = show_count(features.removed + features.left - LOOPS_SHOWN as u64);
        item(out, "", &format!("{more} more, listed in the report"));
    }
}

/// The largest regions that were wrapped, or would have been.
fn wraps(out: &mut String, report: &Report) {
    for wrap in report.wraps.iter().take(LOOPS_SHOWN) {
        let what = format!(
            "{} from {}, {:.1} % of the surface",
            triangles(wrap.replaced),
            show_box(&wrap.bounds),
            wrap.area_share * 100.0
        );
        match &wrap.left {
            Some(reason) => item(out, "left", &format!("no solid: {what}: {reason}")),
            None => item(out, "wrapped", &format!("{what}, moved by up to {}", show_number(wrap.moved))),
        }
    }
    if report.wraps.len() > LOOPS_SHOWN {
        item(out, "", &format!("{} more regions, listed in the report", show_count((report.wraps.len() - LOOPS_SHOWN) as u64)));
    }
}

/// The kinds of the input's boundary loops; for an inspection also the first of them.
fn loops(out: &mut String, report: &Report) {
    let loops = &report.loops;
    if loops.listed.is_empty() {
        return;
    }
    let classes: Vec<String> = loops.classes.iter().map(|(class, n)| format!("{} {}", show_count(*n), class.name())).collect();
    item(out, "loops", &classes.join(", "));
    if report.task == Task::Inspect || !report.profile.repair {
        for l in loops.listed.iter().take(LOOPS_SHOWN) {
            let edges = show_count(l.vertices);
            let what = format!("{} of {edges} edges at {}: {}", l.class.name(), show_point(&l.at), l.rule);
            item(out, "loop", &what);
        }
    }
}

/// One line of what was wrong and what was done, for lists.
pub(crate) fn summary(report: &Report) -> (String, String) {
    let wrong: Vec<String> = ROWS
        .iter()
        .take(FIRST_DESCRIPTION)
        .filter(|(_, of)| of(&report.before) > 0)
        .map(|(name, of)| format!("{} {name}", shown(of(&report.before))))
        .chain(report.input.findings.iter().cloned())
        .collect();
    let done: Vec<String> = report
        .repairs
        .iter()
        .map(|repair| format!("{} × {}", repair.name.as_str().replace('_', " "), show_count(repair.count)))
        .collect();
    let or = |list: Vec<String>, none: &str| if list.is_empty() { none.to_owned() } else { list.join(", ") };
    (or(wrong, "nothing"), or(done, if report.outcome == Outcome::Clean { "copied byte for byte" } else { "nothing" }))
}

/// Triangles that still intersect, by their numbers in the file that was judged.
fn pairs_left(out: &mut String, report: &Report) {
    let Some(left) = found(report.after.as_ref().unwrap_or(&report.before)) else { return };
    let all = left.crossing_pairs + left.overlapping_pairs;
    let pairs: Vec<String> = left.listed.iter().take(PAIRS_SHOWN).map(|[a, b]| format!("{a} and {b}")).collect();
    if !pairs.is_empty() {
        let more = all.saturating_sub(pairs.len() as u64);
        let rest = if more > 0 { format!(", and {} more", show_count(more)) } else { String::new() };
        item(out, "pairs", &format!("triangles {}{rest} (numbered from 0)", pairs.join(", ")));
    }
}

fn headline(report: &Report) -> &'static str {
    match (report.task, report.outcome) {
        (Task::Repair, Outcome::NotGood) if !report.profile.repair => "NOT GOOD, and nothing was repaired",
        (_, Outcome::Clean) => "clean",
        (_, Outcome::Repaired) => "repaired",
        (_, Outcome::NeedsReview) => "NEEDS REVIEW: repaired, but changed more than the profile allows",
        (Task::Inspect, Outcome::NotGood) => "NOT GOOD",
        (Task::Repair, Outcome::NotGood) => "NOT GOOD after repair",
    }
}

fn size(report: &Report) -> String {
    let facts = &report.input;
    format!("{}, {}, {}", triangles(facts.triangles), show_size(facts.bytes), format_name(facts.format))
}

/// The name of a format, for people.
pub(crate) fn format_name(format: Format) -> &'static str {
    match format {
        Format::BinaryStl => "binary STL",
        Format::AsciiStl => "ASCII STL",
        Format::ThreeMf => "3MF",
        Format::Amf => "AMF",
        Format::Obj => "OBJ",
        Format::Ply => "PLY",
        Format::Off => "OFF",
        // The command line reads files only.
        _ => "no file",
    }
}

fn rate(report: &Report) -> String {
    let cost = &report.cost;
    let speed = if cost.triangles_per_second.is_finite() { cost.triangles_per_second.max(0.0) as u64 } else { 0 };
    format!(
        "{}, {} triangles/s, peak {} ({} with mapped files)",
        show_seconds(cost.wall_seconds),
        show_count(speed),
        show_size(cost.peak_anonymous_bytes),
        show_size(cost.peak_resident_bytes)
    )
}

fn edit(report: &Report) -> String {
    let e = &report.edit;
    let mut parts = vec![format!("{} untouched", triangles(e.untouched))];
    for (count, what) in [(e.deleted, "deleted"), (e.flipped, "flipped"), (e.moved, "moved"), (e.added, "added")] {
        if count > 0 {
            parts.push(format!("{} {what}", show_count(count)));
        }
    }
    if e.max_move > 0.0 {
        parts.push(format!("largest move {}", show_number(e.max_move)));
    }
    parts.join(", ")
}

/// A count before and after; `None` where there is no other file afterwards.
pub(crate) struct Counted {
    pub(crate) name: &'static str,
    pub(crate) before: String,
    pub(crate) after: Option<String>,
}

/// The counts that are worth a row.
pub(crate) fn rows(report: &Report) -> Vec<Counted> {
    let after = report.after.as_ref().filter(|_| report.task == Task::Repair);
    let differs = |of: fn(&Defects) -> u64| after.is_some_and(|after| of(after) != of(&report.before));
    ROWS.iter()
        .enumerate()
        .filter(|(i, (_, of))| if *i < FIRST_DESCRIPTION { of(&report.before) > 0 || differs(*of) } else { differs(*of) })
        .map(|(_, (name, of))| Counted { name, before: counted_before(report, *of), after: after.map(|after| shown(of(after))) })
        .collect()
}

fn defects(out: &mut String, report: &Report) {
    let rows = rows(report);
    let width = rows.iter().map(|row| row.name.chars().count()).max().unwrap_or(0);
    if rows.iter().any(|row| row.after.is_some()) {
        line(out, format_args!("  {:width$}  {:>14} {:>14}", "", "before", "after"));
    }
    for Counted { name, before, after } in rows {
        match after {
            Some(after) => line(out, format_args!("  {name:width$}  {before:>14} {after:>14}")),
            None => line(out, format_args!("  {name:width$}  {before:>14}")),
        }
    }
}

fn item(out: &mut String, label: &str, text: &str) {
    line(out, format_args!("  {label:<8}{text}"));
}

fn line(out: &mut String, text: std::fmt::Arguments) {
    // Writing to a string cannot fail.
    let _ = writeln!(out, "{}", plain(&text.to_string()));
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use suture_core::{Limits, Mesh, Profile, Quiet};

    /// Of a file of 12 triangles to which nothing was done.
    pub(crate) fn sample(outcome: Outcome) -> Report {
        let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mesh = Mesh::new(corners, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).unwrap();
        let mut report = suture_core::inspect_mesh(&mesh, &Profile::default(), &Limits::default(), &Quiet).unwrap();
        (report.task, report.outcome) = (Task::Repair, outcome);
        (report.input.path, report.input.bytes, report.input.triangles) = ("part.stl".into(), 684, 12);
        report.input.format = Format::BinaryStl;
        report.output = Some(report.input.clone());
        report.before = Defects::default();
        report.after = Some(Defects::default());
        report.verdict.good = outcome.is_good();
        report.certificate = None;
        report.hints.clear();
        report
    }

    #[test]
    fn hints_are_given_of_clean_files_too() {
        for outcome in [Outcome::Clean, Outcome::Repaired] {
            let mut report = sample(outcome);
            report.hints.push(serde_json::from_str(r#"{"kind": "inches", "text": "it is small"}"#).unwrap());
            assert!(render(&report).contains("\n  hint    it is small\n"), "{}", render(&report));
        }
    }

    #[test]
    fn a_clean_file_is_one_line() {
        let text = render(&sample(Outcome::Clean));
        assert_eq!(text.lines().count(), 1, "{text}");
        assert!(text.starts_with("part.stl: clean, copied byte for byte (12 triangles, 684 B, binary STL; closed"), "{text}");
    }

    #[test]
    fn only_what_was_wrong_or_changed_has_a_row() {
        let mut report = sample(Outcome::Repaired);
        report.before.boundary_edges = 3;
        report.before.components = 2;
        report.after.as_mut().unwrap().components = 2;
        let fill = r#"{"name": "fill", "count": 1, "note": "one hole", "seconds": 0.0}"#;
        report.repairs.push(serde_json::from_str(fill).unwrap());
        let text = render(&report);
        assert!(text.contains("boundary edges"), "{text}");
        assert!(!text.contains("duplicate") && !text.contains("components"), "{text}");
        assert!(text.contains("done    fill: one hole"), "{text}");
        let (wrong, done) = summary(&report);
        assert_eq!((wrong.as_str(), done.as_str()), ("3 boundary edges", "fill × 1"));
    }

    /// Counts before and after, and where the first that are left are; a search that was given up is no count.
    #[test]
    fn self_intersections_are_shown_before_and_after() {
        let pairs = |n: u32| {
            let mut counts = SelfIntersections::default();
            counts.listed = (0..n).map(|k| [k, k + 10]).collect();
            (counts.triangles, counts.crossing_pairs) = (u64::from(2 * n), u64::from(n));
            let mut defects = Defects::default();
            defects.self_intersections = Some(counts);
            defects
        };
        let mut report = sample(Outcome::NotGood);
        report.before = pairs(7);
        report.after = Some(pairs(5));
        let text = render(&report);
        let row = text.lines().find(|line| line.contains("self-intersecting triangles")).unwrap();
        assert!(row.split_whitespace().skip(2).eq(["14", "10"]), "{row}");
        assert!(text.contains("pairs that cross") && !text.contains("pairs that overlap"), "{text}");
        assert!(text.contains("  pairs   triangles 0 and 10, 1 and 11, 2 and 12, and 2 more (numbered from 0)"), "{text}");
        if let Some(found) = &mut report.before.self_intersections {
            *found = SelfIntersections::default();
            found.given_up = true;
        }
        assert!(render(&report).contains("too many"));
        assert!(summary(&report).0.contains("too many self-intersecting triangles"));
    }
}
