//! The page's section on meshes in memory: libraries called from Python, from arrays and back.

use std::fmt::Write;

use super::book::Book;
use super::child::Cost;
use super::markdown;
use super::record::Input;
use super::sides::Side;
use super::statistics::{Spread, number, spaced};
use super::way::Way;

const ABOUT: &str = "
## From arrays and back

Libraries called from Python with a mesh in memory: vertices of equal position are one already, in the types that each takes as they are.
*Seconds* are those of the call, from arrays to arrays. × is beside the whole process of `suture repair` over a file of the same triangles,
in pairs of one round; that process also reads the file, writes another, reads it back and syncs it. *Resident* is the largest resident set of
the Python process with both meshes. The output is judged as everywhere here.
";

/// Seconds of the call itself.
fn call(cost: &Cost) -> Option<f64> {
    cost.stage_seconds("arrays")
}

/// All inputs that were given as arrays; nothing if there is none.
pub(super) fn arrays(book: &Book) -> String {
    let tables: Vec<_> = book.inputs().into_iter().filter_map(|input| table(book, input)).collect();
    if tables.is_empty() { String::new() } else { format!("{ABOUT}{}", tables.concat()) }
}

fn table(book: &Book, input: &Input) -> Option<String> {
    let ran = |side: &Side| !book.runs(input, &Way::plain(*side)).is_empty();
    let sides: Vec<_> = Side::ARRAYS.into_iter().filter(ran).collect();
    if sides.is_empty() {
        return None;
    }
    let mut table = format!("\n**{}, {} triangles**\n\n", input.case, spaced(input.triangles));
    table += "| | seconds | × suture repair | resident MB | runs | output |\n|---|---:|---:|---:|---:|---|\n";
    let command_line = Way::plain(Side::Suture);
    if let Some(wall) = book.wall(input, &command_line) {
        let runs = book.runs(input, &command_line).len();
        let output = book.outcome(input, Side::Suture).map(|outcome| outcome.verdict(input)).unwrap_or_default();
        let _ = writeln!(table, "| `suture repair`, the process | {} | | | {runs} | {output} |", wall.text());
    }
    for side in sides {
        let way = Way::plain(side);
        let (seconds, runs) = (book.spread(input, &way, call), book.runs(input, &way));
        let failed = || runs.first().map(|run| run.cost.end.clone()).unwrap_or_default();
        let resident = book.spread(input, &way, |cost| Some(cost.peak_resident_bytes as f64 / 1e6));
        let row = [
            side.facts().name.to_owned(),
            seconds.map_or_else(failed, Spread::text),
            book.ratio(input, &way, &command_line, call).map(Spread::text).unwrap_or_default(),
            resident.map(|spread| number(spread.most)).unwrap_or_default(),
            runs.len().to_string(),
            book.outcome(input, side).map(|outcome| outcome.verdict(input)).unwrap_or_default(),
        ];
        table += &markdown::row(&row);
    }
    if let Some(unlike) = book.fact(input, Side::SutureArrays, "faces unlike the file's") {
        let _ = writeln!(
            table,
            "\nFaces of suture-arrays that differ from those of the file that the same package writes, in order: {unlike}."
        );
    }
    Some(table)
}

#[cfg(test)]
mod tests {
    use super::super::book::tests::{chapter, input};
    use super::super::record::Line;
    use super::*;
    use crate::compare::child::Stage;

    #[test]
    fn the_call_is_set_beside_the_command_line() {
        let input = input("mixed", 1_000_000);
        let mut chapter = chapter(&input, &[(Side::Suture, 2.0, 0), (Side::SutureArrays, 9.0, 0), (Side::TrimeshArrays, 9.0, 2)]);
        for line in chapter.lines_mut() {
            if let Line::Run(run) = line {
                run.cost.stages.push(Stage { name: "arrays".into(), seconds: 1.0 });
                run.cost.facts.insert("faces unlike the file's".into(), 0);
            }
        }
        let page = arrays(&Book { chapters: vec![chapter] });
        assert!(page.contains("| suture-arrays | 1.00 | 0.500 | 1.00 | 1 |"), "{page}");
        assert!(page.contains("| trimesh-arrays | exit 2 |"), "{page}");
        assert!(page.contains("in order: 0."), "{page}");
    }

    #[test]
    fn without_such_runs_there_is_no_section() {
        let input = input("mixed", 1000);
        assert_eq!(arrays(&Book { chapters: vec![chapter(&input, &[(Side::Suture, 2.0, 0)])] }), "");
    }
}
