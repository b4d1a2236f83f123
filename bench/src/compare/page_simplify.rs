//! The page's section on fewer triangles.

use super::book::Book;
use super::markdown::{self, or_dash};
use super::simplified::{Nearness, Simplified, Simplifier};
use super::statistics::{Spread, number, spaced};

const ABOUT: &str = "\
`suture simplify` and its peers over a generated surface, to equal counts: Suture is asked for a share of the triangles, and the peers for as many as it left
(`pipelines/simplify_*.py`). Wall seconds are of whole processes, from file to file, and Suture judges and certifies its result in them; *alone* is the work itself, by each
program's own word, and has Suture's proof of the distance in it. *CPU* is what all threads of the process took, which other work on the machine changes less than wall seconds.
Distances are in millionths of the input's diagonal, from samples on both surfaces: the largest (Hausdorff, two-sided) and the mean (root of squares).
Crossings are pairs of triangles. *Resident* counts a mapped file, which the system can take back; *own* is memory that it cannot. `meshoptimizer` stands beside: it takes and gives arrays, and reading and writing them is not its work.
";

/// The section; empty if there is nothing.
pub(super) fn simplify(book: &Book) -> String {
    let lines: Vec<&Simplified> = book.last(|chapter| chapter.simplified().collect());
    if lines.is_empty() {
        return String::new();
    }
    let mut page = format!("\n## Fewer triangles\n\n{ABOUT}\n");
    page += "| triangles | program | left | wall, s | × suture | alone, s | × suture | CPU, s | Hausdorff | mean \
             | crossings | open edges | resident MB | own MB | runs |\n\
             |---:|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
    let mut sizes: Vec<u64> = lines.iter().map(|line| line.before).collect();
    sizes.sort_unstable();
    sizes.dedup();
    for size in sizes {
        let of = |tool: Simplifier| -> Vec<&Simplified> {
            lines.iter().copied().filter(|line| (line.before, line.tool) == (size, tool)).collect()
        };
        let ours = of(Simplifier::Suture);
        for tool in Simplifier::ALL {
            page += &row(&of(tool), &ours);
        }
    }
    page
}

/// All runs of one program over one mesh, beside those of Suture.
fn row(runs: &[&Simplified], ours: &[&Simplified]) -> String {
    let Some(first) = runs.first() else { return String::new() };
    let spread = |runs: &[&Simplified], value: fn(&Simplified) -> Option<f64>| {
        Spread::of(runs.iter().filter(|run| run.failure.is_empty()).filter_map(|run| value(run)))
    };
    let wall: fn(&Simplified) -> Option<f64> = |run| Some(run.cost.wall_seconds);
    let alone: fn(&Simplified) -> Option<f64> = |run| run.core_seconds();
    let times = |value: fn(&Simplified) -> Option<f64>| {
        let (theirs, own) = (spread(runs, value)?, spread(ours, value)?);
        Some(number(theirs.median / own.median))
    };
    let nearness = runs.iter().find_map(|run| run.nearness);
    let near = |text: fn(Nearness) -> String| or_dash(nearness.map(text));
    let failure = runs.iter().find(|run| !run.failure.is_empty()).map(|run| run.failure.replace(['|', '\n'], " "));
    let is_peer = first.tool != Simplifier::Suture;
    markdown::row(&[
        spaced(first.before),
        first.memory.as_ref().map_or(first.tool.name().to_owned(), |memory| format!("{} --memory {memory}", first.tool.name())),
        failure.unwrap_or_else(|| spaced(first.after)),
        or_dash(spread(runs, wall).map(Spread::text)),
        or_dash(times(wall).filter(|_| is_peer)),
        or_dash(spread(runs, alone).map(Spread::text)),
        or_dash(times(alone).filter(|_| is_peer)),
        or_dash(spread(runs, |run| Some(run.cost.cpu_seconds)).map(|spread| number(spread.median))),
        near(|near| number(1e6 * near.hausdorff)),
        near(|near| number(1e6 * near.mean)),
        or_dash(nearness.and_then(|near| near.pairs).map(spaced)),
        near(|near| spaced(near.boundary_edges)),
        or_dash(spread(runs, |run| Some(run.cost.peak_resident_bytes as f64 / 1e6)).map(|spread| number(spread.most))),
        or_dash(spread(runs, |run| Some(run.cost.peak_anonymous_bytes? as f64 / 1e6)).map(|spread| number(spread.most))),
        runs.len().to_string(),
    ])
}

#[cfg(test)]
mod tests {
    use super::super::book::Chapter;
    use super::super::child::{Cost, Stage};
    use super::super::record::Line;
    use super::*;

    fn line(tool: Simplifier, round: usize, [wall, alone]: [f64; 2]) -> Simplified {
        let stages = vec![Stage { name: "simplify".into(), seconds: alone }];
        let cost = Cost {
            wall_seconds: wall,
            cpu_seconds: 1.5,
            peak_resident_bytes: 5_000_000,
            peak_anonymous_bytes: Some(4_000_000),
            stages,
            ..Cost::default()
        };
        let near = Nearness { hausdorff: 2e-4, mean: 1.5e-5, samples: 9, pairs: Some(7), boundary_edges: 0 };
        let nearness = (round == 0).then_some(near);
        let (case, program, failure) = ("clean".into(), "p".into(), String::new());
        Simplified {
            case,
            before: 10_000,
            asked: 2_000,
            tool,
            memory: None,
            program,
            round,
            cost,
            after: 2_001,
            nearness,
            failure,
        }
    }

    #[test]
    fn medians_stand_beside_suture_and_failures_are_said() {
        let mut lines: Vec<Simplified> = (0..3).map(|round| line(Simplifier::Suture, round, [1.0 + round as f64, 0.5])).collect();
        lines.extend((0..3).map(|round| line(Simplifier::Meshlib, round, [8.0, 2.0])));
        lines.push(Simplified { failure: "no | memory".into(), nearness: None, ..line(Simplifier::Pymeshlab, 0, [9.0, 9.0]) });
        let lines = lines.into_iter().map(|line| Line::Simplified(Box::new(line))).collect();
        let page = simplify(&Book { chapters: vec![Chapter::of("simplify", lines)] });
        for row in [
            "| 10 000 | suture | 2 001 | 2.00 (1.00–3.00) | – | 0.500 (0.500–0.500) | – | 1.50 | 200 | 15.0 | 7 | 0 | 5.00 | 4.00 | 3 |\n",
            "| 10 000 | meshlib | 2 001 | 8.00 (8.00–8.00) | 4.00 | 2.00 (2.00–2.00) | 4.00 | 1.50 | 200 | 15.0 | 7 | 0 | 5.00 | 4.00 | 3 |\n",
            "| 10 000 | pymeshlab | no   memory | – | – | – | – | – | – | – | – | – | – | – | 1 |\n",
        ] {
            assert!(page.contains(row), "{page}");
        }
        assert_eq!(simplify(&Book { chapters: Vec::new() }), "");
    }
}
