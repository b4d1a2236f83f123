//! The page of one file: what became of it, for a person who decides what to do with it.

use maud::{Markup, html};
use suture_core::report::{Certificate, FileFacts, Outcome, RegionMethod, RuleOutcome, SkinChange, Task};
use suture_core::words::{Counted, triangles};
use suture_core::{FIDELITY_RULES, RULES, Report};

use super::page;
use super::words::prose;
use crate::sample::is_difference;
use crate::say::plain;
use crate::shaped;
use crate::table;
use crate::units::{show_box, show_count, show_number, show_point, show_seconds, show_size};

/// Rows of a long table that are shown.
const MOST_ROWS: usize = 200;

/// The page of a report. `picture`: a PNG of the file, or of the file and its result side by side, as base64.
pub(super) fn whole(report: &Report, picture: Option<&str>) -> Markup {
    let name = name(report);
    page(
        &format!("{name}: {}", headline(report).0),
        &html! {
            h1 { (name) }
            (outcome(report))
            @if let Some(picture) = picture { (figure(&format!("data:image/png;base64,{picture}"), report.output.is_some())) }
            (details(report))
        },
    )
}

/// All there is to say beside the outcome and the picture.
pub(crate) fn details(report: &Report) -> Markup {
    html! {
        (defects(report))
        (repairs(report))
        (places(report))
        (rules(report))
        (facts(report))
    }
}

fn name(report: &Report) -> String {
    let path = &report.input.path;
    plain(&path.file_name().unwrap_or(path.as_os_str()).to_string_lossy())
}

/// The outcome in a word, its class, and what to do.
fn headline(report: &Report) -> (&'static str, &'static str, &'static str) {
    match (report.outcome, report.task) {
        (Outcome::Clean, _) => ("Clean", "good", "It is sound as it came. Print it."),
        (Outcome::Repaired, _) => ("Repaired", "good", "The result passed every check of its profile. Print the result."),
        (Outcome::NeedsReview, _) if report.verdict.reasons.iter().any(|reason| is_difference(reason)) => (
            "Needs review",
            "review",
            "It was computed twice, and the results differ. Use neither before the cause is known: the reason says what to do.",
        ),
        (Outcome::NeedsReview, _) => (
            "Needs review",
            "review",
            "It is printable, but the repair changed more than the profile allows without a person. Look at the picture and the reasons, then use the result or not.",
        ),
        (Outcome::NotGood, Task::Inspect) => ("Not good", "bad", "It needs repair before it can be printed."),
        (Outcome::NotGood, Task::Repair) if !report.profile.repair => {
            ("Not good", "bad", "Its profile repairs nothing. Repair it under another one, or send it back.")
        }
        (Outcome::NotGood, Task::Repair) => (
            "Not good after repair",
            "bad",
            "Do not print it. Ask for another file, or try another profile; the reasons are below.",
        ),
    }
}

fn outcome(report: &Report) -> Markup {
    let (word, class, todo) = headline(report);
    html! {
        div class={ "outcome " (class) } role="status" {
            strong { (word) }
            p { (todo) }
            (verdict(report))
        }
    }
}

/// The verdict on the file that was judged, and all reasons for it.
pub(crate) fn verdict(report: &Report) -> Markup {
    html! {
        (statement(report))
        @if !report.verdict.reasons.is_empty() { (reasons(&report.verdict.reasons)) }
        @for hint in &report.hints { p { "Note: " (prose(&hint.text)) "." } }
    }
}

/// The statement of the verdict.
pub(crate) fn statement(report: &Report) -> Markup {
    let is_there =
        report.task == Task::Inspect || report.outcome != Outcome::NotGood || report.output.is_some() || !report.profile.repair;
    html! { @if is_there { p { "The file that was judged is " (report.verdict.statement) "." } } @else { p { "There is no result to judge." } } }
}

/// Reasons, one below the other.
pub(crate) fn reasons(reasons: &[String]) -> Markup {
    html! { ul { @for reason in reasons { li { (prose(reason)) } } } }
}

/// The picture at that address. `is_pair`: it shows the file and its result side by side.
pub(crate) fn figure(address: &str, is_pair: bool) -> Markup {
    let words = if is_pair { "Left: as it came. Right: the result." } else { "As it came." };
    html! {
        figure {
            img alt=(words) src=(address);
            figcaption {
                (words)
                (key("outside", "outside")) (key("inside", "inside")) (key("edge", "open edge"))
                @if is_pair { (key("goes", "removed, or drawn in other triangles")) (key("new", "added, or drawn in other triangles")) }
            }
        }
    }
}

/// The same from the opposite side.
pub(crate) fn behind(address: &str) -> Markup {
    html! {
        figure {
            img alt="The same, seen from the opposite side" loading="lazy" src=(address);
            figcaption { "From the opposite side" }
        }
    }
}

/// A colour, and what it stands for.
pub(crate) fn key(class: &str, words: &str) -> Markup {
    html! { span class={ "key " (class) } {} (words) }
}

fn defects(report: &Report) -> Markup {
    let rows = table::rows(report);
    html! {
        h2 { "Defects" }
        @if rows.is_empty() { p { "None." } } @else {
            table {
                thead { tr { th scope="col" { "Count" } th scope="col" class="n" { "before" } @if report.after.is_some() { th scope="col" class="n" { "after" } } } }
                tbody { @for row in rows { tr {
                    th scope="row" { (row.name) }
                    td class="n" { (row.before) }
                    @if report.after.is_some() { td class="n" { (row.after.unwrap_or_default()) } }
                } } }
            }
        }
        @for finding in &report.input.findings { p { "The file: " (prose(finding)) } }
    }
}

fn repairs(report: &Report) -> Markup {
    let edit = &report.edit;
    html! {
        @if !report.repairs.is_empty() {
            h2 { "Repairs" }
            table {
                thead { tr { th scope="col" { "Repair" } th scope="col" class="n" { "times" } th scope="col" { "How" } } }
                tbody { @for repair in &report.repairs { tr {
                    th scope="row" { (repair.name.as_str().replace('_', " ")) (meaning(repair.name.doing())) }
                    td class="n" { (show_count(repair.count)) }
                    td { (prose(&repair.note)) }
                } } }
            }
            p { (show_count(edit.untouched)) (if edit.untouched == 1 { " triangle is" } else { " triangles are" }) " untouched, " (show_count(edit.deleted)) " deleted, " (show_count(edit.flipped)) " flipped, "
                (show_count(edit.moved)) " moved, " (show_count(edit.added)) " added." }
        }
        @if let Some(skin) = &report.skin { (skin_of("Surface that was lost", &skin.lost)) (skin_of("Surface that was invented", &skin.invented)) }
    }
}

fn skin_of(title: &str, change: &SkinChange) -> Markup {
    html! {
        @if change.area > 0.0 {
            h2 { (title) }
            p { (show_number(change.area)) " square units, " (show_number(change.share * 100.0)) " % of what can be seen, up to " (show_number(change.farthest)) " off." }
            ul { @for place in &change.places { li { (show_number(place.area)) " square units in the box " (show_box(&place.bounds)) } } }
        }
    }
}

/// Loops that stayed open, regions that were changed or left, and walls that are thin.
fn places(report: &Report) -> Markup {
    let regions = &report.regions;
    html! {
        (thin_walls(report))
        (features(report))
        (shaping(report))
        @if !report.loops_left.is_empty() {
            h2 { "Left open" }
            table {
                thead { tr { th scope="col" { "At" } th scope="col" class="n" { "edges" } th scope="col" { "Why" } } }
                tbody { @for left in report.loops_left.iter().take(MOST_ROWS) { tr {
                    td { (show_point(&left.at)) } td class="n" { (show_count(left.edges)) } td { (plain(&left.reason)) }
                } } }
            }
        }
        @if !regions.listed.is_empty() {
            details {
                summary { (Counted(regions.total, "region was", "regions were")) " changed or left" }
                table {
                    thead { tr { th scope="col" { "Method" } th scope="col" { "Box" } th scope="col" class="n" { "triangles" } th scope="col" class="n" { "moved" } } }
                    tbody { @for region in regions.listed.iter().take(MOST_ROWS) { tr {
                        td { (method(region.method)) @if let Some(why) = &region.reason { ": " (plain(why)) } }
                        td { (show_box(&region.bounds)) } td class="n" { (show_count(region.count)) } td class="n" { (show_number(region.moved)) }
                    } } }
                }
            }
        }
    }
}

fn thin_walls(report: &Report) -> Markup {
    let Some(walls) = report.thin_walls.as_ref().filter(|walls| !walls.places.is_empty()) else { return html! {} };
    html! {
        h2 { "Thin walls" }
        table {
            thead { tr { th scope="col" { "At" } th scope="col" class="n" { "thickness" } th scope="col" class="n" { "wanted" } } }
            tbody { @for place in &walls.places { tr {
                td { (show_point(&place.at)) } td class="n" { (show_number(place.thickness)) } td class="n" { (show_number(walls.minimum)) }
            } } }
        }
    }
}

fn features(report: &Report) -> Markup {
    let Some(features) = report.features.as_ref() else { return html! {} };
    html! {
        h2 { "Features" }
        p { (show_count(features.removed)) " removed, " (show_count(features.left)) " left: " (show_count(features.triangles_gone)) " triangles gone, "
            (show_count(features.triangles_added)) " added." @if let Some(reason) = &features.why_not { " " (plain(reason)) "." } }
        @if !features.listed.is_empty() {
            table {
                thead { tr { th scope="col" { "Feature" } th scope="col" { "At" } th scope="col" class="n" { "size" } th scope="col" class="n" { "confidence" } th scope="col" { "Fate" } } }
                tbody { @for feature in features.listed.iter().take(MOST_ROWS) { tr {
                    td { (feature.kind.replace('-', " ")) } td { (show_point(&feature.centre.map(|x| x as f32))) } td class="n" { (show_number(feature.size)) }
                    td class="n" { (show_number(feature.confidence)) } td { @match &feature.left { Some(reason) => { "left: " (plain(reason)) }, None => "removed" } }
                } } }
            }
        }
    }
}

fn shaping(report: &Report) -> Markup {
    let lines = shaped::lines(report);
    html! {
        @if !lines.is_empty() {
            h2 { "Shape" }
            ul { @for (_, line) in &lines { li { (plain(line)) } } }
        }
    }
}

/// What was done to a region, in a word.
pub(crate) fn method(method: RegionMethod) -> &'static str {
    match method {
        RegionMethod::Cut => "cut",
        RegionMethod::Snapped => "snapped",
        RegionMethod::Perturbed => "perturbed",
        RegionMethod::Refilled => "refilled",
        RegionMethod::Separated => "separated",
        RegionMethod::Dropped => "dropped",
        RegionMethod::Rebuilt => "rebuilt",
        RegionMethod::Wrapped => "wrapped",
        RegionMethod::Left => "left",
        _ => "changed",
    }
}

fn rules(report: &Report) -> Markup {
    let Some(certificate) = &report.certificate else { return html! {} };
    let words = |outcome: RuleOutcome| match outcome {
        RuleOutcome::Passed => "passed",
        RuleOutcome::Failed => "FAILED",
        RuleOutcome::Unchecked => "not checked",
    };
    html! {
        details {
            summary { "Every rule: " (passed(certificate)) }
            table {
                thead { tr { th scope="col" { "Rule" } th scope="col" { "Outcome" } th scope="col" class="n" { "count or figure" } th scope="col" class="n" { "limit" } } }
                tbody {
                    @for rule in &certificate.rules { tr {
                        th scope="row" { (rule.rule.replace('_', " ")) (meaning(counted(&rule.rule))) } td { (words(rule.outcome)) }
                        td class="n" { @if let Some(count) = rule.count { (show_count(count)) } } td class="n" { "0" }
                    } }
                    @for rule in certificate.faithful.iter().flat_map(|faithful| &faithful.rules) { tr {
                        th scope="row" { (rule.rule.replace('_', " ")) (meaning(measured(&rule.rule))) } td { (words(rule.outcome)) }
                        td class="n" { @if let Some(figure) = rule.figure { (show_number(figure)) } } td class="n" { (show_number(rule.limit)) }
                    } }
                }
            }
        }
    }
}

/// The quantity behind a rule's name, below it.
fn meaning(sentence: &str) -> Markup {
    html! { @if !sentence.is_empty() { br; small { (sentence) } } }
}

fn counted(rule: &str) -> &'static str {
    RULES.iter().find(|known| known.id == rule).map_or("", |known| known.counts)
}

fn measured(rule: &str) -> &'static str {
    FIDELITY_RULES.iter().find(|known| known.id == rule).map_or("", |known| known.measures)
}

/// How many of the rules passed, and how many did not.
fn passed(certificate: &Certificate) -> String {
    let faithful = certificate.faithful.iter().flat_map(|faithful| &faithful.rules).map(|rule| rule.outcome);
    let all: Vec<_> = certificate.rules.iter().map(|rule| rule.outcome).chain(faithful).collect();
    let of = |wanted| all.iter().filter(|outcome| **outcome == wanted).count();
    let other = [(of(RuleOutcome::Failed), "failed"), (of(RuleOutcome::Unchecked), "not checked")];
    let mut words = vec![format!("{} of {} passed", of(RuleOutcome::Passed), all.len())];
    words.extend(other.into_iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")));
    words.join(", ")
}

fn facts(report: &Report) -> Markup {
    let file = |title: &str, facts: &FileFacts| {
        html! { tr {
            th scope="row" { (title) }
            td class="file" { (plain(&facts.path.to_string_lossy())) br; (triangles(facts.triangles)) ", " (show_size(facts.bytes)) br; "BLAKE3 " code { (facts.blake3) } }
        } }
    };
    let measure = report.after.as_ref().unwrap_or(&report.before);
    html! {
        h2 { "Files" }
        table { tbody {
            (file("as it came", &report.input))
            @if let Some(output) = &report.output { (file("result", output)) }
            @if let Some(bounds) = &measure.bounds { tr { th scope="row" { "size" } td { (size(bounds)) " units" } } }
            tr { th scope="row" { "area, volume" } td { (show_number(measure.area)) ", " (show_number(measure.volume)) } }
            tr { th scope="row" { "profile" } td { (plain(&report.profile.name)) } }
            tr { th scope="row" { "time, memory" } td { (show_seconds(report.cost.wall_seconds)) ", at most " (show_size(report.cost.peak_anonymous_bytes)) } }
            tr { th scope="row" { "engine" } td { "Suture " (report.engine_version) } }
        } }
    }
}

fn size([lo, hi]: &[[f32; 3]; 2]) -> String {
    let [x, y, z] = std::array::from_fn(|k| show_number(f64::from(hi[k]) - f64::from(lo[k])));
    format!("{x} × {y} × {z}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::tests::sample;

    #[test]
    fn each_outcome_says_what_to_do() {
        for (outcome, words) in [
            (Outcome::Clean, "Print it."),
            (Outcome::Repaired, "Print the result."),
            (Outcome::NeedsReview, "Look at the picture"),
            (Outcome::NotGood, "Do not print it."),
        ] {
            let text = whole(&sample(outcome), None).into_string();
            assert!(text.contains(words) && text.contains("<h1>part.stl</h1>"), "{text}");
            assert!(!text.contains("<img") && !text.contains("<script"), "no picture, no script");
        }
    }

    /// No picture tells which of two results is right.
    #[test]
    fn two_results_are_no_matter_of_looks() {
        let mut report = sample(Outcome::NeedsReview);
        report.verdict.reasons = vec!["computed twice, with two results: a made one".into()];
        let text = whole(&report, None).into_string();
        assert!(text.contains("Use neither before the cause is known") && !text.contains("Look at the picture"), "{text}");
    }

    #[test]
    fn thin_walls_have_their_places() {
        let mut report = sample(Outcome::Clean);
        assert!(!whole(&report, None).into_string().contains("Thin walls"));
        let walls = r#"{"minimum": 0.8, "points": 100, "share": 0.03, "places": [{"at": [1.5, 2.5, 3.5], "thickness": 0.31}]}"#;
        report.thin_walls = serde_json::from_str(walls).unwrap();
        let text = whole(&report, None).into_string();
        assert!(text.contains("Thin walls") && text.contains("0.31") && text.contains("[1.5, 2.5, 3.5]"), "{text}");
    }

    /// Names, headers and notes come from whoever sent the file.
    #[test]
    fn nothing_in_a_report_is_markup() {
        let evil = "<img src=x onerror=alert(1)>\"'&";
        let mut report = sample(Outcome::NeedsReview);
        report.input.path = evil.into();
        report.input.findings.push(evil.into());
        report.verdict.reasons.push(format!("{evil}\u{202E}"));
        report.profile.name = evil.into();
        let text = whole(&report, None).into_string();
        assert!(!text.contains("<img") && !text.contains('\u{202E}'), "{text}");
        assert_eq!(text.matches("&lt;img src=x").count(), 6, "title, heading, finding, reason, file, profile: {text}");
    }
}
