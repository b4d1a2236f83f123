//! How fast Suture and its peers read and write each format.
//!
//! **In:** sizes of a clean generated mesh, how many rounds, and how Suture is bounded.
//! **Out:** a [`Transfer`] for each process, in the raw file before the next process starts.
//! **Promise:** all programs take their turns in each round, forwards and backwards; a program that is killed at the limit sits out the
//! other rounds over that file.

use std::path::{Path, PathBuf};

use suture_bench::generate::{self, Case, Density};

use super::cache;
use super::cgroup::Group;
use super::child::{self, Ended};
use super::closing::{Bench, Options};
use super::error::Error;
use super::record::Line;
use super::sides::{Program, Side};
use super::transfer::{Direction, Format, Transfer};
use super::trial::{listen, remove, worded};
use super::way::{Cache, Way};

/// What is asked for.
pub(crate) struct Asked {
    /// About how many triangles each mesh has.
    pub(crate) sizes: Vec<u64>,
    pub(crate) runs: usize,
    /// `--memory` of suture, in one more run of each round.
    pub(crate) memory: Option<String>,
    /// Bytes that the memory cgroup of that run may hold.
    pub(crate) cgroup: Option<u64>,
}

/// Of the generated mesh.
const SEED: u64 = 1;

/// Has Suture and its peers read and write each format, and keeps what that cost.
///
/// # Errors
/// When suture cannot be built or cannot write a format, or the system fails. A peer that is missing, or fails, is a result.
pub(crate) fn formats(options: &Options, asked: &Asked) -> Result<(), Error> {
    let mut turns = Turns { bench: Bench::open(options, &Side::FORMATS)?, options, asked, order: 0 };
    for &size in &asked.sizes {
        let stl = turns.bench.folder.path().join("in.stl");
        let truth = generate::write_file_at(Case::Clean, Density::Sparse, size, SEED, &stl)?;
        for format in Format::ALL {
            turns.read(format, &stl, truth.counts.triangles)?;
            let out = turns.bench.folder.path().join(format!("out.{}", format.ending()));
            turns.all(&File {
                direction: Direction::Write,
                format,
                input: stl.clone(),
                out,
                triangles: truth.counts.triangles,
            })?;
        }
        remove(&stl)?;
    }
    Ok(())
}

/// A file that is read, or an STL that is written to a file of a format.
struct File {
    direction: Direction,
    format: Format,
    input: PathBuf,
    /// Of reading: a file that is never made.
    out: PathBuf,
    triangles: u64,
}

struct Turns<'a> {
    bench: Bench,
    options: &'a Options,
    asked: &'a Asked,
    /// Processes so far.
    order: usize,
}

impl Turns<'_> {
    /// The rounds over a file of `format` that Suture makes of an STL.
    fn read(&mut self, format: Format, stl: &Path, triangles: u64) -> Result<(), Error> {
        let [input, out] = ["in", "out"].map(|name| self.bench.folder.path().join(format!("{name}.{}", format.ending())));
        let command = self.bench.programs.command(&Way::plain(Side::Convert), 1, stl, &input);
        let made = child::run(command, Some(&input), true, self.options.limit)?.cost;
        if made.code != Some(0) || made.output_bytes.is_none() {
            let reason = format!("`suture convert` made no {}, {}: {}", format.ending(), made.end, made.complaint);
            return Err(Error::Mesh(reason));
        }
        self.all(&File { direction: Direction::Read, format, input: input.clone(), out, triangles })?;
        remove(&input)
    }

    /// All rounds of all programs.
    fn all(&mut self, file: &File) -> Result<(), Error> {
        let verb = if file.direction == Direction::Read { "reading" } else { "writing" };
        eprintln!("{verb} {}, {} triangles", file.format.ending(), file.triangles);
        let mut ways = ways(file, self.asked);
        ways.retain(|way| self.bench.has(way.side));
        for round in 0..self.asked.runs {
            let mut again = Vec::new();
            for way in ways {
                if self.once(file, &way, round)? {
                    again.push(way);
                }
            }
            again.reverse();
            ways = again;
        }
        Ok(())
    }

    /// One process; false if it was killed.
    fn once(&mut self, file: &File, way: &Way, round: usize) -> Result<bool, Error> {
        let cached = cache::bring(way.cache, [file.input.as_path()].into_iter());
        let cached_share = cached.map_err(Error::io("filling or emptying the page cache"))?;
        let writes = file.direction == Direction::Write;
        let mut command = self.bench.programs.command(way, 1, &file.input, &file.out);
        if writes && matches!(way.side.facts().program, Program::Python { .. }) {
            command.arg("--write");
        }
        let words = worded(&command, &file.input, &file.out);
        // A group of its own, so that its peak is that of this process.
        let group = way.cgroup.map(Group::make).transpose().map_err(Error::Cgroup)?;
        let command = match &group {
            Some(group) => group.hold(&command),
            None => command,
        };
        let target = writes.then_some(file.out.as_path());
        let Ended { mut cost, said } = child::measure(command, target, writes, self.options.limit)?;
        let said = listen(&said);
        (cost.stages, cost.facts) = (said.stages, said.facts);
        let counted = said.before.as_ref().and_then(|before| before["triangles"].as_u64());
        let held = group.as_ref().and_then(Group::peak_bytes);
        let facts = [("triangles", counted), ("cgroup peak bytes", held)];
        cost.facts.extend(facts.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?))));
        eprintln!("  {:40} {:>9.3} s wall {:>9.3} s CPU  {}", way.name(), cost.wall_seconds, cost.cpu_seconds, cost.end);
        let exited = cost.exited;
        let input_bytes = std::fs::metadata(&file.input).map_err(Error::io("looking at an input"))?.len();
        self.bench.journal.write(Line::Transfer(Transfer {
            direction: file.direction,
            format: file.format,
            triangles: file.triangles,
            input_bytes,
            way: way.clone(),
            round,
            order: self.order,
            command: words,
            cached_share,
            cost,
        }))?;
        self.order += 1;
        if file.out.exists() {
            remove(&file.out)?;
        }
        Ok(exited)
    }
}

/// Who reads or writes a file, and how: Suture, Suture once more if it is to be bounded, and each peer that knows the format.
fn ways(file: &File, asked: &Asked) -> Vec<Way> {
    let mut ways = Vec::new();
    for side in Side::FORMATS.into_iter().filter(|&side| file.format.is_of(side, file.direction, file.triangles)) {
        ways.push(Way::plain(side));
        if side.is_suture() && (asked.memory.is_some() || asked.cgroup.is_some()) {
            // What is in the page cache already is not charged to a group.
            let cache = if asked.cgroup.is_some() { Cache::Cold } else { Cache::Warm };
            ways.push(Way { cache, memory: asked.memory.clone(), cgroup: asked.cgroup, ..Way::plain(side) });
        }
    }
    ways
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suture_is_bounded_in_a_run_of_its_own_and_a_peer_never() {
        let names = |direction, format, memory: Option<&str>, cgroup| -> Vec<String> {
            let asked = Asked { sizes: Vec::new(), runs: 1, memory: memory.map(Into::into), cgroup };
            let file = File { direction, format, input: PathBuf::new(), out: PathBuf::new(), triangles: 2_000_000 };
            ways(&file, &asked).iter().map(Way::name).collect()
        };
        let bounded = "inspect-no-si, cold, --memory 512MiB, cgroup of 512 MiB";
        assert_eq!(
            names(Direction::Read, Format::ThreeMf, Some("512MiB"), Some(512 << 20)),
            ["inspect-no-si", bounded, "lib3mf", "pymeshlab-formats"]
        );
        assert_eq!(names(Direction::Write, Format::Amf, Some("1GiB"), None), ["convert", "convert, --memory 1GiB"]);
        let all = ["inspect-no-si", "trimesh-formats", "pymeshlab-formats", "meshlib-formats", "tobj"];
        assert_eq!(names(Direction::Read, Format::Obj, None, None), all);
    }
}
