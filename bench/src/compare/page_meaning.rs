//! The page's section on files whose meaning is known: is what comes out what was meant?

use std::collections::BTreeMap;
use std::fmt::Write;

use super::book::Book;
use super::made::{Bad, Tally, Understood};
use super::markdown::{self, folded, or_dash};
use super::sides::Side;
use super::statistics::spaced;

/// By family (in the order in which they first came), what each side made of it: the newest line of each.
type Families<'a> = Vec<(&'a str, BTreeMap<Side, &'a Understood>)>;

const ABOUT: &str = "\
*Valid* is not yet *right*: a hollow print that was filled, a pin that was fused with its hinge, an inlay that is gone are all solids. So
here each file is a known solid that was damaged (`src/meaning`): in each family the seeds differ in shape, size, unit, place, order and
dose. A result is *right* if its symmetric difference from what was meant is within the family's tolerance (0.2 % of the volume where
the shape is determined, up to 5 % where a piece of round surface is gone), if it is closed, and if its number of bodies is one of those
meant. The judge (`src/judge/fidelity.rs`) shares no code with Suture: along each of 3 × 96² lines both solids are intervals, exactly;
the integral over the lines is an estimate whose error, by their scatter, is added to the tolerance.

*Wrong* is what was called good and is not right. Suture calls good what ends as `clean` or `repaired`; other programs have no word of
their own, so that what is closed is taken for called good, and what is open, or was not written, as *withheld*. *Review* is Suture's
`needs_review`: a person is asked. *Failed*: the process broke off. Where the file alone does not decide what was meant, asking is as good
as being right; where no solid was meant at all (a lone sheet), anything but calling one good is. *Not printable* are those of the
right ones that cross themselves, or are not manifold, by the judge of solids below: as a rule files that were handed back as they came.
";

/// The section; empty if there is nothing.
pub(super) fn meaning(book: &Book) -> String {
    let mut families = Families::new();
    for line in book.chapters.iter().flat_map(|chapter| chapter.understood()) {
        match families.iter_mut().find(|(name, _)| *name == line.family) {
            Some((_, sides)) => {
                sides.insert(line.side, line);
            }
            None => families.push((&line.family, BTreeMap::from([(line.side, line)]))),
        }
    }
    if families.is_empty() {
        return String::new();
    }
    let mut sides: Vec<Side> = families.iter().flat_map(|(_, sides)| sides.keys().copied()).collect();
    sides.sort_unstable();
    sides.dedup();
    format!("\n## What was meant\n\n{ABOUT}\n{}{}{}", totals(&families, &sides), table(&families, &sides), named(&families))
}

/// A row for each side: once where the file decides, once where it does not.
fn totals(families: &Families, sides: &[Side]) -> String {
    let mut text = String::from(
        "| | the file decides | files | right | not printable | wrong, called good | review | withheld | failed | as wanted | seconds a file |\n\
         |---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n",
    );
    for &side in sides {
        for decides in [true, false] {
            let of_side =
                families.iter().filter_map(|(_, sides)| sides.get(&side).copied()).filter(|line| line.decides == decides);
            let Some(sum) = Tally::sum(of_side.map(|line| line.tally)) else { continue };
            let share = |count: u64| format!("{} ({:.1} %)", spaced(count), 100.0 * count as f64 / sum.seeds.max(1) as f64);
            let columns = [
                side.facts().name.to_owned(),
                if decides { "yes" } else { "no" }.into(),
                spaced(sum.seeds),
                share(sum.right),
                spaced(sum.right_unprintable),
                share(sum.wrong),
                share(sum.review_right + sum.review_wrong),
                share(sum.withheld),
                share(sum.failed),
                share(sum.wanted),
                // Peers work through a family in one process, which is not timed by file.
                if side.is_suture() { format!("{:.2}", sum.seconds / sum.seeds.max(1) as f64) } else { "–".into() },
            ];
            text += &markdown::row(&columns);
        }
    }
    text
}

/// A row for each family, a column for each side.
fn table(families: &Families, sides: &[Side]) -> String {
    let summary = "Family by family: right / wrong, called good / review / withheld / failed. The file alone decides, but for those marked ?";
    let mut text = String::from("| group | family |");
    sides.iter().for_each(|side| text += &format!(" {} |", side.facts().name));
    text += "\n|---|---|";
    sides.iter().for_each(|_| text += "---:|");
    text.push('\n');
    for (name, of_side) in families {
        let Some(first) = of_side.values().next() else { continue };
        let _ = write!(text, "| {} | {name}{} |", first.group, if first.decides { "" } else { " ?" });
        for side in sides {
            let cell = or_dash(of_side.get(side).map(|line| {
                let Tally { right, wrong, review_right, review_wrong, withheld, failed, .. } = line.tally;
                [right, wrong, review_right + review_wrong, withheld, failed].map(|count| count.to_string()).join(" / ")
            }));
            let _ = write!(text, " {cell} |");
        }
        text.push('\n');
    }
    folded(summary, &text)
}

/// Suture's results that are not as wanted, file by file.
fn named(families: &Families) -> String {
    let mut rows = String::new();
    for (name, sides) in families {
        for Bad { seed, verdict, why } in sides.get(&Side::Suture).into_iter().flat_map(|line| &line.bad) {
            let _ = writeln!(rows, "* {name} {seed}: {}, {why}", verdict.name());
        }
    }
    match rows.as_str() {
        "" => String::new(),
        _ => folded("Suture's that are not as wanted", &rows),
    }
}

#[cfg(test)]
mod tests {
    use super::super::book::Chapter;
    use super::super::made::Verdict;
    use super::super::record::Line;
    use super::*;

    fn line(family: &str, side: Side, decides: bool, verdicts: &[Verdict]) -> Line {
        let mut line = Understood::new(family, "group", side, "1".into(), "2".into());
        line.decides = decides;
        for (seed, &verdict) in verdicts.iter().enumerate() {
            let wanted = verdict.is_wanted(decides, true);
            let bad = (!wanted).then(|| Bad { seed: seed as u64, verdict, why: "because".into() });
            line.tally.add(verdict, false, 0.5, wanted);
            line.bad.extend(bad);
        }
        Line::Understood(line)
    }

    #[test]
    fn asking_is_wanted_only_where_the_file_does_not_decide() {
        use Verdict::{Failed, ReviewRight, ReviewWrong, Right, Withheld, Wrong};
        let all = [Right, Wrong, ReviewRight, ReviewWrong, Withheld, Failed];
        assert_eq!(all.map(|verdict| verdict.is_wanted(true, true)), [true, false, false, false, false, false]);
        assert_eq!(all.map(|verdict| verdict.is_wanted(false, true)), [true, false, true, true, false, false]);
        assert_eq!(all.map(|verdict| verdict.is_wanted(false, false)), [true, false, true, true, true, true]);
    }

    #[test]
    fn the_newest_line_of_a_family_and_side_counts() {
        use Verdict::{ReviewWrong, Right, Withheld, Wrong};
        let lines = vec![
            line("a", Side::Suture, true, &[Wrong, Wrong]),
            line("a", Side::Suture, true, &[Right, Wrong]),
            line("b", Side::Suture, false, &[ReviewWrong, Withheld]),
            line("b", Side::Pymeshfix, false, &[Wrong]),
        ];
        let page = meaning(&Book { chapters: vec![Chapter::of("meaning", lines)] });
        assert!(
            page.contains("| suture | yes | 2 | 1 (50.0 %) | 0 | 1 (50.0 %) | 0 (0.0 %) | 0 (0.0 %) | 0 (0.0 %) | 1 (50.0 %) |"),
            "{page}"
        );
        assert!(page.contains("| suture | no | 2 | 0 (0.0 %) | 0 | 0 (0.0 %) | 1 (50.0 %) | 1 (50.0 %) |"), "{page}");
        assert!(page.contains("| group | b ? | 0 / 0 / 1 / 1 / 0 | 0 / 1 / 0 / 0 / 0 |"), "{page}");
        assert!(page.contains("| group | a | 1 / 1 / 0 / 0 / 0 | – |"), "{page}");
        assert!(page.contains("* a 1: wrong, because\n* b 1: withheld, because\n"), "{page}");
        assert_eq!(meaning(&Book { chapters: Vec::new() }), "");
    }
}
