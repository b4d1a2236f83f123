//! The page's section on stores.

use super::book::Book;
use super::markdown;
use super::statistics::{Spread, number, spaced};
use super::stored::{Keeper, Stored};

const ABOUT: &str = "\
`suture watch --once` over a hot folder of generated files with holes, whole processes, from its start until all results are synced: with jobs in the daemon's own store, and in
a PostgreSQL server on the same machine, whose processor time comes on top of the daemon's. *Of sled's* is the median of the ratios of runs that followed each other.
";

/// The section; empty if there is nothing.
pub(super) fn stores(book: &Book) -> String {
    let lines: Vec<&Stored> = book.last(|chapter| chapter.stored().collect());
    if lines.is_empty() {
        return String::new();
    }
    let mut page = format!("\n## Jobs in a shared store\n\n{ABOUT}\n");
    page += "| triangles a file | files | store | files/s | of sled's | CPU s of the daemon | results | runs |\n|---:|---:|---|---:|---:|---:|---:|---:|\n";
    let mut sizes: Vec<u64> = lines.iter().map(|line| line.triangles).collect();
    sizes.sort_unstable();
    sizes.dedup();
    for size in sizes {
        let of = |keeper: Keeper| -> Vec<&Stored> {
            lines.iter().copied().filter(|line| (line.triangles, line.keeper) == (size, keeper)).collect()
        };
        let own = of(Keeper::Embedded);
        for keeper in Keeper::ALL {
            page += &row(&of(keeper), &own);
        }
    }
    page
}

/// All runs with one store over one folder, beside those with the daemon's own.
fn row(runs: &[&Stored], own: &[&Stored]) -> String {
    let Some(first) = runs.first() else { return String::new() };
    let beside =
        |run: &&&Stored| Some(run.files_a_second() / own.iter().find(|other| other.round == run.round)?.files_a_second());
    let share = Spread::of(runs.iter().filter(|run| run.keeper != Keeper::Embedded).filter_map(|run| beside(&run)));
    markdown::row(&[
        spaced(first.triangles),
        spaced(first.files),
        first.keeper.name().to_owned(),
        markdown::or_dash(Spread::of(runs.iter().map(|run| run.files_a_second())).map(Spread::text)),
        markdown::or_dash(share.map(|share| format!("{} %", number(100.0 * share.median)))),
        markdown::or_dash(Spread::of(runs.iter().map(|run| run.cost.cpu_seconds)).map(|spread| number(spread.median))),
        spaced(runs.iter().map(|run| run.done).min().unwrap_or(0)),
        runs.len().to_string(),
    ])
}

#[cfg(test)]
mod tests {
    use super::super::book::Chapter;
    use super::super::child::Cost;
    use super::super::record::Line;
    use super::*;

    #[test]
    fn a_shared_store_stands_beside_the_run_before_it() {
        let line = |keeper, round, wall_seconds| {
            let cost = Cost { wall_seconds, cpu_seconds: 3.0, ..Cost::default() };
            Line::Stored(Box::new(Stored { keeper, triangles: 5000, files: 100, done: 100, program: "p".into(), round, cost }))
        };
        let lines = [(0, 1.0, 2.0), (1, 2.0, 2.5), (2, 4.0, 4.0)];
        let lines =
            lines.iter().flat_map(|(n, own, shared)| [line(Keeper::Embedded, *n, *own), line(Keeper::Postgres, *n, *shared)]);
        let page = stores(&Book { chapters: vec![Chapter::of("stores", lines.collect())] });
        for row in [
            "| 5 000 | 100 | sled, of the daemon's own | 50.0 (25.0–100) | – | 3.00 | 100 | 3 |\n",
            "| 5 000 | 100 | PostgreSQL | 40.0 (25.0–50.0) | 80.0 % | 3.00 | 100 | 3 |\n",
        ] {
            assert!(page.contains(row), "{page}");
        }
        assert_eq!(stores(&Book { chapters: Vec::new() }), "");
    }
}
