//! The page's section on the skin of real files.

use std::fmt::Write;

use suture_bench::judge::{Place, Skin};

use super::book::Book;
use super::made::Skinned;
use super::markdown;

const ABOUT: &str = "\
What Suture does to files whose meaning nobody wrote down (`src/judge/skin.rs`, which shares no code with it). *Lost* is the share of the
file's surface that could be seen from outside and is farther than 0.5 % of the diagonal from the result; *gained* the share of the
result's surface that can be seen and is farther than that from all that the file had, without patches that are plausible: flat, or less than 0.5 % of
the surface. Distances are shares of the diagonal. Both are looked at in 40 000 points of equal area.
";

/// Called good, it should have lost no more, and gained no more.
const LOST: f64 = 0.001;
const GAINED: f64 = 0.01;

/// The section; empty if there is nothing.
pub(super) fn skin(book: &Book) -> String {
    let mut lines = book.last(|chapter| chapter.skinned().collect());
    if lines.is_empty() {
        return String::new();
    }
    let changed = |line: &Skinned| line.skin.as_ref().map_or(0.0, |skin| skin.lost + skin.implausible);
    let page = format!("\n## The skin of real files\n\n{ABOUT}\n{}\n", summary(&lines));
    lines.sort_by(|a, b| changed(b).total_cmp(&changed(a)).then(a.file.cmp(&b.file)));
    lines.retain(|line| changed(line) > 0.0);
    let mut table = String::from(
        "| file | triangles | outcome | lost | by | gained | by | flat or small patches | wrapped |\n\
         |---|---:|---|---:|---:|---:|---:|---:|---:|\n",
    );
    for line in lines {
        let skin = line.skin.clone().unwrap_or_default();
        let percent = |share: f64| format!("{:.3} %", 100.0 * share);
        let columns = [
            format!("`{}`", line.file),
            line.triangles.to_string(),
            line.outcome().replace('_', " "),
            percent(skin.lost),
            percent(skin.lost_by),
            percent(skin.implausible),
            percent(skin.implausible_by),
            percent(skin.invented - skin.implausible),
            percent(line.wrapped),
        ];
        table += &markdown::row(&columns);
    }
    page + &markdown::folded("Files that lost or gained anything", &table)
}

/// In one paragraph, of all files.
pub(super) fn summary(lines: &[&Skinned]) -> String {
    let count = |is: &dyn Fn(&Skinned) -> bool| lines.iter().filter(|line| is(line)).count();
    let of_skin = |line: &Skinned, value: fn(&Skin) -> f64| line.skin.as_ref().map_or(0.0, value);
    let outcome = |name: &str| count(&|line| line.outcome() == name);
    let review = outcome("needs_review");
    format!(
        "Of {} files {} are called good ({} clean, {} repaired), {} need review ({:.1} %), {} are not good, of {} there is nothing. Of those called good \
         {} lost more than {} % of their skin, and {} gained more than {} %; more than 1 % was wrapped in {} of all.",
        lines.len(),
        count(&Skinned::is_called_good),
        outcome("clean"),
        outcome("repaired"),
        review,
        100.0 * review as f64 / lines.len().max(1) as f64,
        outcome("not_good"),
        outcome("failed"),
        count(&|line| line.is_called_good() && of_skin(line, |skin| skin.lost) > LOST),
        100.0 * LOST,
        count(&|line| line.is_called_good() && of_skin(line, |skin| skin.implausible) > GAINED),
        100.0 * GAINED,
        count(&|line| line.wrapped > 0.01),
    )
}

/// In one line for a terminal, with places.
pub(super) fn row(line: &Skinned) -> String {
    let skin = line.skin.clone().unwrap_or_default();
    let places = |places: &[Place]| {
        let named = places.iter().map(|place| format!("{:?} {:.3} %", place.at.map(|x| x as f32), 100.0 * place.share));
        named.collect::<Vec<_>>().join(", ")
    };
    let mut text = format!(
        "{:12} {:9} lost {:7.3} % by {:7.3} %, gained {:7.3} % by {:7.3} %, plausible {:7.3} %, wrapped {:6.2} % {}",
        line.outcome(),
        line.triangles,
        100.0 * skin.lost,
        100.0 * skin.lost_by,
        100.0 * skin.implausible,
        100.0 * skin.implausible_by,
        100.0 * (skin.invented - skin.implausible),
        100.0 * line.wrapped,
        line.file
    );
    for (word, there) in [("lost at", &skin.lost_at), ("gained at", &skin.implausible_at)] {
        if !there.is_empty() {
            let _ = write!(text, "\n    {word} {}", places(there));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::book::Chapter;
    use super::super::made::Report;
    use super::super::record::Line;
    use super::*;

    fn line(file: &str, outcome: &str, lost: f64, implausible: f64) -> Line {
        let report = Report { outcome: outcome.into(), ..Report::default() };
        let skin = Skin { lost, implausible, invented: 2.0 * implausible, ..Skin::default() };
        let (file, program) = (file.into(), "1".into());
        Line::Skinned(Box::new(Skinned {
            file,
            triangles: 4,
            program,
            report: Some(report),
            wrapped: 0.0,
            skin: Some(skin),
            seconds: 1.0,
        }))
    }

    #[test]
    fn only_what_is_called_good_counts_as_a_loss() {
        let lines = vec![line("a", "repaired", 0.002, 0.0), line("b", "needs_review", 0.5, 0.5), line("c", "clean", 0.0, 0.0)];
        let page = skin(&Book { chapters: vec![Chapter::of("skin", lines)] });
        assert!(page.contains("Of 3 files 2 are called good (1 clean, 1 repaired), 1 need review (33.3 %)"), "{page}");
        assert!(page.contains("called good 1 lost more than 0.1 % of their skin, and 0 gained"), "{page}");
        let (a, b) = (page.find("| `a` |").unwrap(), page.find("| `b` |").unwrap());
        assert!(b < a && !page.contains("| `c` |"), "the largest change first: {page}");
    }
}
