//! The page's section on every kind of damage, sparse and everywhere: one line an input, all programs side by side.

use suture_bench::generate::{Case, Density};

use super::book::{Book, did_its_work};
use super::child::Cost;
use super::markdown::{self, or_dash};
use super::record::{Input, is_good};
use super::sides::Side;
use super::statistics::{number, short, spaced};
use super::way::Way;

const ABOUT: &str = "\
Each case of the generator at one size: about one cell of 512 triangles in ten holds a defect, or, *everywhere*, each one does. Seconds until the \
output is on the disk, warm cache. *× clean*: how many times as long as Suture takes over the clean file of that size in the same session, the search for \
self-intersections and all repairs included; asked: at most 3. CPU and memory (what the system cannot take back) are Suture's. ✗: the output is \
not closed, manifold and oriented with the sound model's volume within 1 %, by the same check for all; –: not measured.";

/// The section; empty if no input was measured that has defects everywhere.
pub(super) fn damage(book: &Book) -> String {
    let inputs: Vec<&Input> = book.inputs().into_iter().filter(|input| input.seed.is_some() && input.files == 1).collect();
    let mut sizes: Vec<u64> = inputs.iter().filter(|input| is_everywhere(input)).map(|input| input.size).collect();
    sizes.sort_unstable();
    sizes.dedup();
    let mut page = String::new();
    for size in sizes {
        let of_size: Vec<&Input> = inputs.iter().copied().filter(|input| input.size == size).collect();
        page += &format!("\n## Every kind of damage, {}\n\n{ABOUT}\n\n{}", short(size), table(book, &of_size));
    }
    page
}

fn is_everywhere(input: &Input) -> bool {
    Case::ALL.into_iter().any(|case| Density::Everywhere.of_case(case) == input.case)
}

/// The programs of which the table has a column of seconds: all that repair, and `cp` to measure them by.
fn shown(book: &Book, inputs: &[&Input]) -> Vec<Side> {
    let ran = |side: &Side| inputs.iter().any(|input| !book.runs(input, &Way::plain(*side)).is_empty());
    let repairs = |side: &Side| side.facts().judged && !side.is_of_arrays() || *side == Side::CpSynced;
    Side::ALL.into_iter().filter(|side| repairs(side) && ran(side)).collect()
}

fn table(book: &Book, inputs: &[&Input]) -> String {
    let sides = shown(book, inputs);
    let names: Vec<&str> = sides.iter().map(|side| side.facts().name).collect();
    let mut text = format!(
        "| case | triangles | × clean | CPU s | MB | {} |\n|---|---:|---:|---:|---:|{}\n",
        names.join(" | "),
        "---:|".repeat(names.len())
    );
    let ours = Way::plain(Side::Suture);
    let clean = inputs.iter().find(|input| input.case == Case::Clean.name()).and_then(|input| book.wall(input, &ours));
    for input in inputs {
        let of = |value: fn(&Cost) -> Option<f64>| or_dash(book.spread(input, &ours, value).map(|spread| number(spread.median)));
        let times = book.wall(input, &ours).zip(clean).map(|(wall, clean)| number(wall.median / clean.median));
        let mut row = vec![
            input.case.clone(),
            spaced(input.triangles),
            or_dash(times),
            of(|cost| Some(cost.cpu_seconds)),
            of(|cost| cost.peak_anonymous_bytes.map(|bytes| bytes as f64 / 1e6)),
        ];
        row.extend(sides.iter().map(|side| seconds(book, input, *side)));
        text += &markdown::row(&row);
    }
    text
}

/// The median, marked where the output is not good; else how the process ended.
fn seconds(book: &Book, input: &Input, side: Side) -> String {
    let way = Way::plain(side);
    let runs = book.runs(input, &way);
    if let Some(failed) = runs.iter().find(|run| !did_its_work(input, run)) {
        return format!("{} ✗", failed.cost.end);
    }
    let judged = book.outcome(input, side).and_then(|outcome| outcome.judged.as_ref());
    let is_bad = judged.is_some_and(|judged| !is_good(&judged.judgement, input.volume));
    or_dash(book.wall(input, &way).map(|wall| format!("{}{}", number(wall.median), if is_bad { " ✗" } else { "" })))
}

#[cfg(test)]
mod tests {
    use super::super::book::tests::{chapter, input};
    use super::*;

    #[test]
    fn a_case_is_held_against_the_clean_file_of_its_size() {
        let inputs = [input("clean", 1_000_000), input("holes everywhere", 1_000_000), input("holes", 100_000)];
        let runs = |clean: bool| {
            let seconds = if clean { 0.5 } else { 1.25 };
            [(Side::Suture, seconds, 0), (Side::Trimesh, 9.0, 2)]
        };
        let chapters = inputs.iter().map(|input| chapter(input, &runs(input.case == "clean"))).collect();
        let page = damage(&Book { chapters });
        assert!(page.contains("## Every kind of damage, 1 M"), "{page}");
        assert!(page.contains("| holes everywhere | 1 000 000 | 2.50 | 0.000 | – | 1.25 | exit 2 ✗ |"), "{page}");
        assert!(!page.contains("| holes | "), "of another size: {page}");
        assert_eq!(damage(&Book { chapters: vec![chapter(&input("holes", 1_000_000), &runs(false))] }), "");
    }
}
