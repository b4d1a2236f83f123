//! The page's section on what became of real files when a solid was asked for.

use std::collections::BTreeMap;

use super::book::Book;
use super::made::Solved;
use super::markdown::{self, folded, mean_and_worst, or_dash};
use super::sides::Side;
use super::statistics::{Spread, number};

/// By file, what each side made of it: the newest line of each.
type Files<'a> = BTreeMap<&'a str, BTreeMap<Side, &'a Solved>>;

const ABOUT: &str = "\
Every STL file of a folder, given to all as the same binary STL. *Printable* is the word of a judge of this comparison's own, on the
bytes that were written (`src/judge/solid.rs`; it shares no code with Suture, and its signs are exact): vertices of equal coordinates
are one, every edge has two triangles that agree on what is outside, every vertex one fan, no two triangles have a segment in common
that is not an edge of both, nor an area, and no component is inside out. *Encloses* says of how many files some component encloses a
volume, as it is or with its rims closed: of the others no solid can be made, and shares are of these. *Spoilt* are files that were
printable as they came, and are not any more. *Kept* is the share of a file's triangles that are in the output bit by bit, in the same
direction. *Distance* is the largest one from the corners and middles of the triangles of either mesh to the other, as a share of the
diagonal: filling a wide hole also counts. Both are means over the files of which a side made something printable, the worst one in
brackets: who gives up on hard files has better means, so that the sides are beside each other file by file below. *Bodies lost* is the number of files in which a closed component of more than a millionth
of the volume of all is gone: none of up to five points that lie deep inside of it, and in no cavity, has a winding number other than
zero in the output; in brackets files in which some of these points are outside. It is looked at in everything that was written.
";

/// The section; empty if there is nothing.
pub(super) fn solids(book: &Book) -> String {
    let mut files = Files::new();
    for line in book.chapters.iter().flat_map(|chapter| chapter.solved()) {
        files.entry(&line.file).or_default().insert(line.side, line);
    }
    if files.is_empty() {
        return String::new();
    }
    let mut page = format!("\n## Solids of real files\n\n{ABOUT}\n");
    page += "| | files | encloses | written | printable | share | spoilt | wrapped | needs review | over the time | bodies lost | kept | distance | seconds, median (most) |\n\
             |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
    for side in Side::SOLID {
        let lines: Vec<_> = files.values().filter_map(|sides| sides.get(&side).copied()).collect();
        if !lines.is_empty() {
            page += &markdown::row(&row(side, &lines));
        }
    }
    page += &beside(&files);
    for side in [Side::Suture, Side::SutureOff] {
        page += &named(&files, side);
    }
    page
}

fn row(side: Side, lines: &[&Solved]) -> Vec<String> {
    let count = |is: &dyn Fn(&Solved) -> bool| lines.iter().filter(|line| is(line)).count();
    let of_report = |is: fn(&Solved) -> bool| if side.is_suture() { count(&is).to_string() } else { "–".into() };
    let (may, both) = (count(&|line| line.may_be_solid), count(&|line| line.may_be_solid && line.is_printable()));
    let mean = |value: fn(&Solved) -> Option<f64>, worst: fn(Spread) -> f64| {
        mean_and_worst(lines.iter().filter(|line| line.is_printable()).filter_map(|line| value(line)).collect(), worst)
    };
    let bodies = |is: fn(&Solved) -> bool| count(&is);
    vec![
        side.facts().name.into(),
        lines.len().to_string(),
        may.to_string(),
        count(&|line| line.after.is_some()).to_string(),
        count(&|line| line.is_printable()).to_string(),
        format!("{:.1} %", 100.0 * both as f64 / may.max(1) as f64),
        count(&|line| line.before.is_none() && !line.is_printable()).to_string(),
        of_report(is_wrapped),
        of_report(|line| line.report.as_ref().is_some_and(|report| report.outcome == "needs_review")),
        count(&|line| line.end.starts_with("over")).to_string(),
        format!(
            "{} ({})",
            bodies(|line| line.bodies.is_some_and(|bodies| bodies.lost > 0)),
            bodies(|line| line.bodies.is_some_and(|bodies| bodies.part > 0))
        ),
        mean(|line| line.change.map(|change| change.kept), |spread| spread.least),
        mean(Solved::distance, |spread| spread.most),
        or_dash(
            Spread::of(lines.iter().map(|line| line.seconds))
                .map(|spread| format!("{} ({})", number(spread.median), number(spread.most))),
        ),
    ]
}

fn is_wrapped(line: &Solved) -> bool {
    line.report.as_ref().is_some_and(|report| report.wraps > 0)
}

/// The peer whose printable output is nearest to the file; of equally near ones, that which keeps most.
fn best<'a>(sides: &BTreeMap<Side, &'a Solved>) -> Option<&'a Solved> {
    let peers = sides.values().copied().filter(|line| !line.side.is_suture() && line.is_printable());
    let figures = |line: &Solved| (line.distance().unwrap_or(f64::INFINITY), -line.change.map_or(0.0, |change| change.kept));
    peers.min_by(|a, b| {
        let (a, b) = (figures(a), figures(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    })
}

/// Distances closer than this are the same: a hundredth of what f32 tells apart on a model.
const SAME: f64 = 1e-9;

/// Suture beside the best peer, file by file.
fn beside(files: &Files) -> String {
    let (mut rows, mut near, mut keeps, mut both, mut alone, mut none) = (String::new(), 0, 0, 0, 0, 0);
    for (name, sides) in files {
        let Some(suture) = sides.get(&Side::Suture) else { continue };
        let ours = suture.is_printable();
        let best = best(sides);
        let figures = |line: &Solved| {
            let kept = or_dash(line.change.map(|change| format!("{:.2}", 100.0 * change.kept)));
            [kept, or_dash(line.distance().map(|far| format!("{:.4}", 100.0 * far)))]
        };
        match best {
            Some(peer) if ours => {
                let kept = |line: &Solved| line.change.map_or(0.0, |change| change.kept);
                both += 1;
                near += usize::from(suture.distance().unwrap_or(f64::INFINITY) <= peer.distance().unwrap_or(0.0) + SAME);
                // Shares of one file that differ in their last bit are one share.
                keeps += usize::from(kept(suture) >= kept(peer) - 1e-12);
            }
            None if ours => alone += 1,
            _ => none += usize::from(!ours),
        }
        let word = match ours {
            true if is_wrapped(suture) => "wrapped",
            true => "yes",
            false => "no",
        };
        let theirs = best.map_or([or_dash(None), or_dash(None)], figures);
        let columns = [
            format!("`{name}`"),
            suture.triangles.to_string(),
            word.into(),
            figures(suture).join(" | "),
            best.map_or("none".into(), |best| best.side.facts().name.into()),
            theirs.join(" | "),
        ];
        rows += &markdown::row(&columns);
    }
    if rows.is_empty() {
        return rows;
    }
    let head = "| file | triangles | printable | kept | distance | best peer | kept | distance |\n|---|---:|---|---:|---:|---|---:|---:|\n";
    let summary = "Beside the best peer, file by file: of those whose output is printable the one nearest to the file. Kept and distance in %.";
    format!(
        "\nOf {both} files both Suture and a peer make something printable: there Suture's is at least as near as the best peer's in \
         {near}, and keeps at least as many triangles in {keeps}. Of {alone} files only Suture does, and of {none} it does not.\n{}",
        folded(summary, &format!("{head}{rows}"))
    )
}

/// Files that a side of suture's left not printable, wrapped, or robbed of a body, each by name.
fn named(files: &Files, side: Side) -> String {
    let lines: Vec<_> = files.values().filter_map(|sides| sides.get(&side).copied()).collect();
    let list = |title: &str, is: &dyn Fn(&Solved) -> bool, says: &dyn Fn(&Solved) -> String| {
        let rows: Vec<_> =
            lines.iter().filter(|line| is(line)).map(|line| format!("* `{}`: {}\n", line.file, says(line))).collect();
        if rows.is_empty() {
            String::new()
        } else {
            format!("\n{}, {title}: {} files.\n\n{}", side.facts().name, rows.len(), rows.concat())
        }
    };
    let reasons = |line: &Solved| {
        let own = line.report.as_ref().map(|report| report.reasons.join("; ")).filter(|reasons| !reasons.is_empty());
        let may = if line.may_be_solid { "" } else { " (encloses nothing)" };
        format!("{}{may}{}", line.reason(), own.map_or(String::new(), |own| format!(" · by its own word: {own}")))
    };
    let mut text = list("not printable", &|line| !line.is_printable(), &reasons);
    text += &list("wrapped", &is_wrapped, &|line| {
        let (regions, far) = (line.report.as_ref().map_or(0, |report| report.wraps), line.distance().unwrap_or(0.0));
        format!("{regions} regions, distance {:.3} %", 100.0 * far)
    });
    text += &list("bodies lost", &|line| line.bodies.is_some_and(|bodies| bodies.lost > 0), &|line| {
        line.bodies.map_or(String::new(), |bodies| format!("{} of {}", bodies.lost, bodies.of))
    });
    text += &list("points of a body outside", &|line| line.bodies.is_some_and(|bodies| bodies.part > 0), &|line| {
        line.bodies.map_or(String::new(), |bodies| format!("of {} of {} bodies", bodies.part, bodies.of))
    });
    text += &list(
        "certified, but not printable by the judge",
        &|line| line.report.as_ref().is_some_and(|report| report.printable) && !line.is_printable(),
        &Solved::reason,
    );
    text
}

#[cfg(test)]
mod tests {
    use super::super::book::Chapter;
    use super::super::made::Report;
    use super::super::record::Line;
    use super::*;
    use crate::holes::Change;
    use suture_bench::Counts;
    use suture_bench::judge::{BodiesFound, Judgement, Solid};

    fn found(meeting: u64) -> Solid {
        let counts = Counts { triangles: 4, components: 1, ..Counts::default() };
        let judgement = Judgement { counts, nonfinite: 0, vertices: 4, volume: 1.0, positive_bodies: 1, negative_bodies: 0 };
        Solid { judgement, meeting, inside_out: 0, solid_header: false }
    }

    fn line(file: &str, side: Side, meeting: Option<u64>, kept: f64, far: f64) -> Solved {
        Solved {
            file: file.into(),
            triangles: 4,
            may_be_solid: true,
            before: Some("open".into()),
            volume: 1.0,
            side,
            program: "1".into(),
            end: "exit 0".into(),
            code: Some(0),
            seconds: 1.0,
            after: meeting.map(found),
            complaint: String::new(),
            change: meeting.map(|_| Change { kept, taken: far, added: 0.0 }),
            bodies: meeting.map(|_| BodiesFound { of: 2, lost: u64::from(kept < 0.5), part: 0 }),
            report: side.is_suture().then(|| Report {
                outcome: "repaired".into(),
                printable: true,
                wraps: 0,
                reasons: Vec::new(),
            }),
        }
    }

    fn book(lines: Vec<Solved>) -> Book {
        let lines = lines.into_iter().map(|line| Line::Solved(Box::new(line))).collect();
        Book { chapters: vec![Chapter::of("solids", lines)] }
    }

    #[test]
    fn the_newest_line_of_a_file_and_side_counts() {
        let old = line("a", Side::Suture, Some(7), 0.9, 0.1);
        let page = solids(&book(vec![old, line("a", Side::Suture, Some(0), 0.8, 0.02)]));
        assert!(
            page.contains(
                "| suture | 1 | 1 | 1 | 1 | 100.0 % | 0 | 0 | 0 | 0 | 0 (0) | 80.000 % (80.00 %) | 2.000 % (2.00 %) | 1.00 (1.00) |"
            ),
            "{page}"
        );
        assert!(!page.contains("not printable:"), "{page}");
        assert_eq!(solids(&book(Vec::new())), "");
    }

    #[test]
    fn the_best_peer_is_the_nearest_that_is_printable() {
        let lines = vec![
            line("a", Side::Suture, Some(0), 0.9, 0.02),
            line("a", Side::PymeshlabSolid, Some(3), 1.0, 0.0),
            line("a", Side::MeshlibSolid, Some(0), 0.7, 0.02),
            line("a", Side::Pymeshfix, Some(0), 0.8, 0.02),
            line("b", Side::Suture, Some(5), 0.4, 0.5),
            line("b", Side::MeshlibSolid, None, 0.0, 0.0),
        ];
        let page = solids(&book(lines));
        assert!(page.contains("| `a` | 4 | yes | 90.00 | 2.0000 | pymeshfix | 80.00 | 2.0000 |"), "{page}");
        assert!(page.contains("| `b` | 4 | no | 40.00 | 50.0000 | none | – | – |"), "{page}");
        assert!(page.contains("Of 1 files both") && page.contains("near as the best peer's in 1,"), "{page}");
        assert!(page.contains("* `b`: self-intersecting, 5 triangles\n") && page.contains("* `b`: 1 of 2\n"), "{page}");
        // The judge disagrees with the certificate.
        assert!(page.contains("certified, but not printable by the judge: 1 files"), "{page}");
    }
}
