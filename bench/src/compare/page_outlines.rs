//! The page's section on filling curves.

use super::book::Book;
use super::filled::Filled;
use super::markdown;
use super::statistics::{Spread, number, spaced};

const ABOUT: &str = "\
`suture fill-curves` over generated networks (`src/outlines.rs`), whole processes, from JSON to a judged STL on the disk: one outline of many
curves (`fourteen`, `square`, `ring`, `star`), or many loops of four (`quads`, `bent-quads`). A cost that is linear has the same time for each curve in all rows of a
shape; where curves are few, the surface's own triangles are the cost. Quality is twice the inradius over the circumradius, 1 of equal sides.
";

/// The section; empty if there is nothing.
pub(super) fn outlines(book: &Book) -> String {
    let lines: Vec<&Filled> = book.last(|chapter| chapter.filled().collect());
    if lines.is_empty() {
        return String::new();
    }
    let mut page = format!("\n## Filled curves\n\n{ABOUT}\n");
    page += "| network | curves | loops | wall, s | CPU, s | CPU for each curve, µs | triangles | quality, mean | below 0.4 | resident MB |\n\
             |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
    let mut seen: Vec<(&str, u64)> = Vec::new();
    for line in &lines {
        let key = (line.shape.as_str(), line.curves);
        if !seen.contains(&key) {
            seen.push(key);
            let runs: Vec<&Filled> = lines.iter().copied().filter(|other| (other.shape.as_str(), other.curves) == key).collect();
            page += &row(&runs);
        }
    }
    page
}

/// All runs over one network.
fn row(runs: &[&Filled]) -> String {
    let Some(first) = runs.first() else { return String::new() };
    let spread = |value: fn(&Filled) -> f64| Spread::of(runs.iter().map(|run| value(run)));
    let text = |value: fn(&Filled) -> f64| markdown::or_dash(spread(value).map(Spread::text));
    let failure = runs.iter().find(|run| run.triangles == 0).map(|run| run.cost.end.clone());
    markdown::row(&[
        first.shape.clone(),
        spaced(first.curves),
        spaced(first.loops),
        failure.unwrap_or_else(|| text(|run| run.cost.wall_seconds)),
        text(|run| run.cost.cpu_seconds),
        markdown::or_dash(spread(|run| 1e6 * run.cost.cpu_seconds / run.curves as f64).map(|spread| number(spread.median))),
        spaced(first.triangles),
        format!("{:.3}", first.mean),
        spaced(first.below),
        markdown::or_dash(spread(|run| run.cost.peak_resident_bytes as f64 / 1e6).map(|spread| number(spread.most))),
    ])
}

#[cfg(test)]
mod tests {
    use super::super::book::Chapter;
    use super::super::child::Cost;
    use super::super::record::Line;
    use super::*;

    #[test]
    fn runs_over_one_network_are_one_row() {
        let line = |curves: u64, round, cpu_seconds| {
            let cost = Cost { cpu_seconds, wall_seconds: 1.0, peak_resident_bytes: 2_000_000, ..Cost::default() };
            let (shape, program) = ("ring".into(), "1".into());
            Line::Filled(Box::new(Filled { shape, curves, loops: 1, program, round, cost, triangles: 9000, mean: 0.8, below: 3 }))
        };
        let page = outlines(&Book {
            chapters: vec![Chapter::of("curves", vec![line(1000, 0, 0.1), line(100, 0, 0.1), line(1000, 1, 0.3)])],
        });
        let row = "| ring | 1 000 | 1 | 1.00 (1.00–1.00) | 0.200 (0.100–0.300) | 200 | 9 000 | 0.800 | 3 | 2.00 |\n";
        assert!(page.contains(row), "{page}");
        assert_eq!(page.matches("| ring |").count(), 2);
        assert_eq!(outlines(&Book { chapters: Vec::new() }), "");
    }
}
