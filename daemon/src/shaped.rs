//! Words for the shaping of a repaired mesh: residue of tools, smoothing, fewer triangles. Tables and pages say the same.

use suture_core::report::{Report, Residue, ResidueSuspect, Simplified, Smoothed};
use suture_core::words::Counted;

use crate::units::{show_count, show_number};

/// Regions that are described one by one.
const LISTED: usize = 5;

/// Lines for people, each with the word that a table puts before it; empty before a line that goes on.
pub(crate) fn lines(report: &Report) -> Vec<(&'static str, String)> {
    let residue = report.residue.as_ref().map(residue);
    let smoothed = report.smoothed.as_ref().map(|told| smoothed(told));
    let simplified = report.simplified.as_ref().map(|told| simplified(told));
    [residue, smoothed, simplified].into_iter().flatten().flatten().collect()
}

fn residue(told: &Residue) -> Vec<(&'static str, String)> {
    if let Some(suspects) = &told.suspects {
        return suspected(suspects);
    }
    let mut lines = Vec::new();
    let regions = Counted(told.regions.len() as u64, "region", "regions");
    lines.push(match &told.why_not {
        Some(reason) => ("residue", format!("left: {reason}")),
        None if told.regions.is_empty() => ("residue", "none found".to_owned()),
        None => (
            "residue",
            format!(
                "{regions}, {} of them moved by up to {}; {} there became {}, within {} of them",
                Counted(told.moved, "vertex", "vertices"),
                show_number(told.displacement),
                Counted(told.triangles_before, "triangle", "triangles"),
                show_count(told.triangles_after),
                show_number(told.deviation)
            ),
        ),
    });
    for region in told.regions.iter().take(LISTED) {
        lines.push((
            "",
            format!(
                "{} {} high, {} apart, on {} ({:.0} % sure of the kind)",
                region.kind,
                show_number(region.height),
                show_number(region.pitch),
                Counted(region.triangles, "triangle", "triangles"),
                region.confidence * 100.0
            ),
        ));
    }
    if told.regions.len() > LISTED {
        lines.push(("", format!("{} more, listed in the report", show_count((told.regions.len() - LISTED) as u64))));
    }
    lines.extend(told.findings.iter().map(|finding| ("", format!("tool path, {finding}"))));
    lines
}

/// Places that may be residue.
fn suspected(suspects: &[ResidueSuspect]) -> Vec<(&'static str, String)> {
    let count = Counted(suspects.len() as u64, "place", "places");
    let mut lines = vec![match suspects {
        [] => ("residue", "no periodic waves found".to_owned()),
        _ => ("residue", format!("{count} with periodic waves, left as they are")),
    }];
    for suspect in suspects.iter().take(LISTED) {
        let axes = |numbers: [f64; 3]| numbers.map(show_number).join(", ");
        let [low, high] = suspect.within.map(axes);
        lines.push((
            "",
            format!(
                "waves {} high, {} apart across ({}), on {} within {low} : {high} ({:.0} % sure)",
                show_number(suspect.height),
                show_number(suspect.pitch),
                suspect.across.map(|x| format!("{x:.2}")).join(", "),
                Counted(suspect.triangles, "triangle", "triangles"),
                suspect.confidence * 100.0
            ),
        ));
    }
    if suspects.len() > LISTED {
        lines.push(("", format!("{} more, listed in the report", show_count((suspects.len() - LISTED) as u64))));
    }
    lines
}

fn smoothed(told: &Smoothed) -> Vec<(&'static str, String)> {
    let line = match &told.why_not {
        Some(reason) => format!("nothing: {reason}"),
        None => format!(
            "{} in {}, by up to {}; {} held back",
            Counted(told.moved, "vertex", "vertices"),
            Counted(told.passes, "pass", "passes"),
            show_number(told.displacement),
            show_count(told.held)
        ),
    };
    vec![("smooth", line)]
}

fn simplified(told: &Simplified) -> Vec<(&'static str, String)> {
    let mut lines = Vec::new();
    if told.before > 0 {
        let far = show_number(told.to_result.max(told.from_result));
        let of = Counted(told.before, "triangle", "triangles");
        lines.push(("simple", format!("{of} became {}, proved within {far}, both ways", show_count(told.after))));
    }
    let word = if lines.is_empty() { "simple" } else { "" };
    lines.extend(told.why_not.iter().map(|reason| (word, reason.clone())));
    lines
}
