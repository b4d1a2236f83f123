//! The page's section on formats: how fast each is read and written.

use std::fmt::Write;

use super::book::Book;
use super::child::Cost;
use super::markdown::{self, or_dash};
use super::sides::Side;
use super::statistics::{Spread, number, spaced};
use super::transfer::{Direction, Format, Transfer};
use super::way::Way;

const ABOUT: &str = "
## Formats

A clean generated mesh. `suture convert` makes the file of each format that all programs read, in alternation, from a warm cache unless *cold* is
said. × is a program's seconds beside Suture's without bounds, in pairs of one round. Bounds (`--memory`, a cgroup) are Suture's alone; no peer runs in
them. A peer that is faster than Suture, or that holds less resident memory, is **bold**.

* **Reading.** Of Suture, the seconds are those of the stage `read` of `suture inspect --no-self-intersections`; of a peer, those of its load call
  alone, with every import before it.
* **Writing.** The seconds are those of whole processes, from the STL to the synced file. `suture convert` also reads that file back, and compares all
  corners with the STL's. A peer's script imports its library, loads the STL, where vertices of equal position become one, and saves.
* **Left out.** trimesh, pymeshlab and MeshLib know no AMF, lib3mf knows 3MF alone, and tobj reads OBJ alone. trimesh is given no 3MF beyond 1 M
  triangles: one of 5 M takes it about a minute and 8 GB. MeshLib reads a 3MF as a scene alone.
";

/// The section; nothing if nothing was measured.
pub(super) fn formats(book: &Book) -> String {
    let lines = book.last(|chapter| chapter.transfers().collect());
    let mut kinds: Vec<_> = lines.iter().map(|line| (line.triangles, line.direction)).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let tables = kinds.into_iter().map(|(triangles, direction)| {
        let lines = lines.iter().filter(|line| (line.triangles, line.direction) == (triangles, direction)).copied().collect();
        Table { direction, triangles, lines }.text()
    });
    let tables: String = tables.collect();
    if tables.is_empty() { tables } else { format!("{ABOUT}{tables}") }
}

/// All processes that read, or wrote, a mesh.
struct Table<'a> {
    direction: Direction,
    triangles: u64,
    lines: Vec<&'a Transfer>,
}

impl Table<'_> {
    fn text(&self) -> String {
        let own = Way::plain(if self.direction == Direction::Read { Side::InspectNoSi } else { Side::Convert });
        let mut ways: Vec<_> = self.lines.iter().map(|line| line.way.clone()).collect();
        ways.sort_unstable();
        ways.dedup();
        let formats: Vec<_> = Format::ALL.into_iter().filter(|format| self.lines.iter().any(|l| l.format == *format)).collect();
        let others: Vec<_> = ways.iter().filter(|way| **way != own).collect();
        let verb = if self.direction == Direction::Read { "Reading" } else { "Writing" };
        let mut text = format!("\n**{verb} {} triangles**\n\n", spaced(self.triangles));
        let mut titles = vec!["format".into(), "MB".into(), "suture, s".into(), "resident MB".into()];
        titles.extend(others.iter().map(|way| format!("{}, s", title(way))));
        text += &markdown::row(&titles);
        let _ = writeln!(text, "|---|{}", "---:|".repeat(titles.len() - 1));
        for &format in &formats {
            let mut row = vec![
                format.ending().to_uppercase(),
                or_dash(self.bytes(format, &own).map(|bytes| number(bytes as f64 / 1e6))),
                self.seconds(format, &own).unwrap_or_else(|| "–".into()),
                or_dash(self.spread(format, &own, |cost| Some(cost.peak_resident_bytes)).map(|spread| megabytes(spread.most))),
            ];
            row.extend(others.iter().map(|way| self.beside(format, way, &own)));
            text += &markdown::row(&row);
        }
        text + &self.processes(&formats, &ways, &own)
    }

    /// Every program's processes.
    fn processes(&self, formats: &[Format], ways: &[Way], own: &Way) -> String {
        let titles = "| format | | wall s | CPU s | resident MB | anonymous MB | cgroup MB | written MB | runs |\n\
                      |---|---|---:|---:|---:|---:|---:|---:|---:|\n";
        let mut rows = String::from(titles);
        for &format in formats {
            for way in ways.iter().filter(|way| self.runs(format, way).next().is_some()) {
                let seconds = |value: fn(&Cost) -> f64| {
                    or_dash(Spread::of(self.runs(format, way).map(|run| value(&run.cost))).map(|spread| number(spread.median)))
                };
                let most = |value: fn(&Cost) -> Option<u64>| {
                    or_dash(self.spread(format, way, value).map(|spread| megabytes(spread.most)))
                };
                let resident = most(|cost| Some(cost.peak_resident_bytes));
                let held = |way| self.spread(format, way, |cost| Some(cost.peak_resident_bytes)).map(|spread| spread.most);
                let is_less = !way.side.is_suture() && held(way).zip(held(own)).is_some_and(|(theirs, ours)| theirs < ours);
                rows += &markdown::row(&[
                    format.ending().to_uppercase(),
                    way.name(),
                    seconds(|cost| cost.wall_seconds),
                    seconds(|cost| cost.cpu_seconds),
                    if is_less { format!("**{resident}**") } else { resident },
                    most(|cost| cost.peak_anonymous_bytes),
                    most(|cost| cost.facts.get("cgroup peak bytes").copied()),
                    most(|cost| cost.output_bytes),
                    self.runs(format, way).count().to_string(),
                ]);
            }
        }
        markdown::folded("Whole processes: time, memory, and what was written", &rows)
    }

    fn runs(&self, format: Format, way: &Way) -> impl Iterator<Item = &Transfer> {
        self.lines.iter().copied().filter(move |line| line.format == format && line.way == *way)
    }

    /// Of the runs that have such a value.
    fn spread(&self, format: Format, way: &Way, value: impl Fn(&Cost) -> Option<u64>) -> Option<Spread> {
        Spread::of(self.runs(format, way).filter_map(|run| value(&run.cost)).map(|value| value as f64))
    }

    /// Length of the file that was read, or that was written.
    fn bytes(&self, format: Format, way: &Way) -> Option<u64> {
        let run = self.runs(format, way).next()?;
        if self.direction == Direction::Read { Some(run.input_bytes) } else { run.cost.output_bytes }
    }

    /// Seconds of all runs, or why one did not do its work; `None` without runs.
    fn seconds(&self, format: Format, way: &Way) -> Option<String> {
        let failure = self.runs(format, way).find_map(Transfer::failure);
        failure.or_else(|| Spread::of(self.runs(format, way).filter_map(Transfer::seconds)).map(Spread::text))
    }

    /// Seconds of a program, and how many times Suture's these are.
    fn beside(&self, format: Format, way: &Way, own: &Way) -> String {
        let pairs = self.runs(format, way).filter_map(|run| {
            let other = self.runs(format, own).find(|other| other.round == run.round)?;
            Some(run.seconds()? / other.seconds()?)
        });
        let ratio = Spread::of(pairs).map(|ratio| {
            let text = format!("{} ×", number(ratio.median));
            if ratio.median < 1.0 && !way.side.is_suture() { format!("**{text}**") } else { text }
        });
        match (self.seconds(format, way), ratio) {
            (Some(seconds), Some(ratio)) if self.runs(format, way).all(|run| run.failure().is_none()) => {
                format!("{seconds}; {ratio}")
            }
            (seconds, _) => or_dash(seconds),
        }
    }
}

/// The name of a program at the head of a column.
fn title(way: &Way) -> String {
    let name = way.name();
    let own = way.side.facts().name;
    if way.side.is_suture() { name.replacen(own, "suture", 1) } else { name.replace("-formats", "") }
}

fn megabytes(bytes: f64) -> String {
    number(bytes / 1e6)
}

#[cfg(test)]
mod tests {
    use super::super::book::Chapter;
    use super::super::record::Line;
    use super::super::transfer::tests::transfer;
    use super::*;

    fn page(lines: Vec<Transfer>) -> String {
        formats(&Book { chapters: vec![Chapter::of("formats", lines.into_iter().map(Line::Transfer).collect())] })
    }

    #[test]
    fn a_peer_is_set_beside_suture_in_pairs_and_is_bold_where_it_is_faster() {
        let read = |format, side, round, seconds| transfer(Direction::Read, format, side, round, seconds);
        let mut late = read(Format::Obj, Side::Tobj, 0, 9.0);
        (late.cost.code, late.cost.end) = (None, "over the time limit of 9 s".into());
        late.cost.peak_resident_bytes = 1_000_000;
        let page = page(vec![
            read(Format::Ply, Side::InspectNoSi, 0, 1.0),
            read(Format::Ply, Side::InspectNoSi, 1, 2.0),
            read(Format::Ply, Side::MeshlibFormats, 0, 4.0),
            read(Format::Ply, Side::MeshlibFormats, 1, 5.0),
            read(Format::Ply, Side::TrimeshFormats, 0, 0.5),
            read(Format::Obj, Side::InspectNoSi, 0, 1.0),
            late,
        ]);
        assert!(page.contains("**Reading 1 000 triangles**"), "{page}");
        assert!(page.contains("| format | MB | suture, s | resident MB | trimesh, s | meshlib, s | tobj, s |\n"), "{page}");
        // The median of 4 and 2.5, not the ratio of medians, which is 3.
        let ply = "| PLY | 4.00 | 1.50 (1.00–2.00) | 2.00 | 0.500; **0.500 ×** | 4.50 (4.00–5.00); 3.25 × | – |\n";
        assert!(page.contains(ply), "{page}");
        assert!(page.contains("| OBJ | 4.00 | 1.00 | 2.00 | – | – | over the time limit of 9 s |\n"), "{page}");
        assert!(page.contains("| OBJ | tobj | 10.0 | 0.000 | **1.00** |"), "{page}");
        assert!(page.contains("| PLY | meshlib-formats | 5.50 | 0.000 | 2.00 | – | – | – | 2 |\n"), "{page}");
    }

    #[test]
    fn writing_is_the_whole_process_and_bounds_of_suture_are_a_column() {
        let write = |side, seconds| transfer(Direction::Write, Format::ThreeMf, side, 0, seconds);
        let mut bounded = write(Side::Convert, 5.0);
        bounded.way.memory = Some("512MiB".into());
        let page = page(vec![write(Side::Convert, 2.0), bounded, write(Side::Lib3mf, 8.0)]);
        assert!(page.contains("| suture, s | resident MB | suture, --memory 512MiB, s | lib3mf, s |\n"), "{page}");
        assert!(page.contains("| 3MF | 3.00 | 3.00 | 2.00 | 6.00; 2.00 × | 9.00; 3.00 × |\n"), "{page}");
    }

    #[test]
    fn without_such_runs_there_is_no_section() {
        assert_eq!(page(Vec::new()), "");
    }
}
