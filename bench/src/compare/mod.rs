//! Suture and its peers over the same files: whole processes in alternation, outputs synced, all judged alike.
//!
//! Every run starts with its input brought into the page cache, or out of it, and everything else written back. Rounds go through
//! all programs, forwards and backwards by turns, so that no program always follows the same one. The outputs of the first run of
//! each side are judged, by another process, so that the memory that needs is not counted against a child of this one. Every run is
//! in the journal ([`record`]) before the next begins: a comparison that is stopped can be resumed. Pages and plots are made from
//! journals alone ([`publish`]).

mod book;
mod cache;
mod cgroup;
mod child;
pub(crate) mod closing;
mod machine;
mod page;
mod page_closing;
mod page_solids;
mod plot;
mod programs;
mod record;
mod sides;
pub(crate) mod solids;
mod statistics;
mod trial;

use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use suture_bench::generate::{self, Case};

pub(crate) use child::Cost;
pub(crate) use machine::Machine;
pub(crate) use record::{Cache, Judged};

pub(crate) use sides::Side;

use record::{Journal, Line, Session, Way};

/// Why a comparison ended.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Error {
    /// The system failed.
    #[error("{action} failed: {source}")]
    Io { action: String, source: io::Error },
    /// Cargo said why above.
    #[error("suture could not be built; `--suture PATH` names another binary")]
    Build,
    /// A group could not be made.
    #[error("a memory cgroup cannot be made, for which root's rights are usual: {0}")]
    Cgroup(io::Error),
    /// An input could not be made.
    #[error(transparent)]
    Generate(#[from] generate::Error),
    /// A record could not be written as JSON.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
    /// A raw file holds something else.
    #[error("{}, line {line}: {source}", path.display())]
    Line { path: PathBuf, line: usize, source: serde_json::Error },
    /// There is nothing to publish.
    #[error("there are no raw runs (*.jsonl) in {}", .0.display())]
    NoRuns(PathBuf),
    /// A mesh could not be read or written.
    #[error("{0}")]
    Mesh(String),
    /// A plot could not be drawn.
    #[error("drawing {}: {reason}", path.display())]
    Plot { path: PathBuf, reason: String },
}

impl Error {
    fn io(action: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        let action = action.into();
        move |source| Self::Io { action, source }
    }
}

/// What to compare.
#[derive(Clone, Debug, Default)]
pub(crate) struct Options {
    pub(crate) sizes: Vec<u64>,
    pub(crate) cases: Vec<Case>,
    /// Files from elsewhere, instead of generated ones.
    pub(crate) files: Vec<PathBuf>,
    /// Generate a folder of so many files for each size and case.
    pub(crate) many: u64,
    /// Largest size of some cases.
    pub(crate) up_to: Vec<(Case, u64)>,
    /// Largest size of some sides, instead of their own.
    pub(crate) side_up_to: Vec<(Side, u64)>,
    pub(crate) sides: Vec<Side>,
    pub(crate) caches: Vec<Cache>,
    /// `--threads` of suture; empty: not said.
    pub(crate) threads: Vec<u16>,
    /// `--memory` of suture.
    pub(crate) memory: Option<String>,
    /// Run every process in a memory cgroup of so many bytes.
    pub(crate) cgroup: Option<u64>,
    pub(crate) runs: usize,
    /// A way whose runs over an input would take longer than this in all is not run again.
    pub(crate) patience: Duration,
    pub(crate) seed: u64,
    /// The raw file.
    pub(crate) raw: PathBuf,
    /// Go on where the raw file ends.
    pub(crate) resume: bool,
    /// Where inputs and outputs are made; the system's temporary folder otherwise.
    pub(crate) folder: Option<PathBuf>,
    /// Judge outputs of inputs up to this size.
    pub(crate) judge_up_to: u64,
    /// A binary to measure instead of the one built now.
    pub(crate) suture: Option<PathBuf>,
    /// A process that takes longer is killed, and its side sits out the other runs of that input.
    pub(crate) limit: Duration,
    /// The command line, to be published.
    pub(crate) command: String,
}

impl Options {
    /// All ways to run: suture's sides by threads and memory, every side by state of the cache.
    fn ways(&self) -> Vec<Way> {
        let mut ways = Vec::new();
        for &side in &self.sides {
            let threads: Vec<_> = match self.threads.is_empty() || !side.is_suture() {
                true => vec![None],
                false => self.threads.iter().copied().map(Some).collect(),
            };
            for &cache in &self.caches {
                for &threads in &threads {
                    let memory = self.memory.clone().filter(|_| side.is_suture());
                    ways.push(Way { side, cache, threads, memory, cgroup: self.cgroup });
                }
            }
        }
        ways.sort_unstable();
        ways.dedup();
        ways
    }

    /// Is `side` measured on a mesh of `triangles`?
    fn reaches(&self, side: Side, triangles: u64) -> bool {
        let said = self.side_up_to.iter().find(|(other, _)| *other == side).map(|(_, most)| *most);
        triangles <= said.unwrap_or(side.facts().most_triangles)
    }
}

/// Runs the comparison and keeps its raw runs.
///
/// # Errors
/// When suture cannot be built, or the system fails. A program that is missing, or fails over an input, is a result.
pub(crate) fn compare(options: &Options) -> Result<(), Error> {
    let programs = programs::Programs::prepare(&options.sides, options.suture.clone())?;
    let parent = options.folder.clone().unwrap_or_else(std::env::temp_dir);
    let folder = tempfile::Builder::new().prefix("suture-bench-").tempdir_in(&parent).map_err(Error::io("making a folder"))?;
    let mut journal = Journal::open(&options.raw, options.resume)?;
    let machine = Machine::describe(folder.path(), programs.versions());
    let began = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
    journal.write(Line::Session(Session { began, command: options.command.clone(), machine }))?;
    let mut sides = options.sides.clone();
    for &side in &options.sides {
        if let Some(reason) = programs.lack(side) {
            eprintln!("{} is left out: {reason}", side.facts().name);
            journal.write(Line::Skipped { side, reason })?;
            sides.retain(|other| *other != side);
        }
    }
    let options = Options { sides, ..options.clone() };
    let mut trial = trial::Trials::new(&options, programs, journal, folder.path())?;
    for file in &options.files {
        trial.foreign(file)?;
    }
    for &size in &options.sizes {
        let fits = |case: Case| options.up_to.iter().all(|(bounded, most)| *bounded != case || size <= *most);
        for &case in options.cases.iter().filter(|case| fits(**case)) {
            trial.generated(case, size)?;
        }
    }
    Ok(())
}

/// The folder of this crate.
pub(crate) fn home() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Where raw runs are kept, unless told otherwise.
pub(crate) fn results() -> PathBuf {
    home().join("results")
}

/// Makes the page (`RESULTS.md`), the plots and the README's table from the raw runs of `raw`, into the folder `into`.
///
/// # Errors
/// When there are no raw runs, or something cannot be read or written.
pub(crate) fn publish(raw: &Path, into: &Path, readme: Option<&Path>) -> Result<(), Error> {
    let book = book::Book::load(raw)?;
    let plots = into.join("plots");
    std::fs::create_dir_all(&plots).map_err(Error::io("making the folder of plots"))?;
    let drawn = plot::draw(&book, &plots)?;
    let write = |path: &Path, text: String| std::fs::write(path, text).map_err(Error::io(format!("writing {}", path.display())));
    write(&into.join("RESULTS.md"), page::page(&book, &drawn))?;
    if let Some(readme) = readme {
        let text = std::fs::read_to_string(readme).map_err(Error::io(format!("reading {}", readme.display())))?;
        if let Some(text) = page::put_in(&text, &page::short(&book)) {
            write(readme, text)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_suture_runs_once_for_each_number_of_threads() {
        let options = Options {
            sides: vec![Side::PymeshlabPlain, Side::Suture, Side::Suture],
            caches: vec![Cache::Warm, Cache::Cold],
            threads: vec![1, 2],
            memory: Some("1GiB".into()),
            ..Options::default()
        };
        let names: Vec<_> = options.ways().iter().map(Way::name).collect();
        assert_eq!(
            names,
            [
                "suture, 1 thread, --memory 1GiB",
                "suture, 2 threads, --memory 1GiB",
                "suture, cold, 1 thread, --memory 1GiB",
                "suture, cold, 2 threads, --memory 1GiB",
                "pymeshlab-plain",
                "pymeshlab-plain, cold",
            ]
        );
    }

    #[test]
    fn a_peer_has_its_largest_size_unless_told_otherwise() {
        let options = Options { side_up_to: vec![(Side::Pymeshfix, 20)], ..Options::default() };
        let reached = [(Side::Trimesh, 100_000), (Side::Trimesh, 1_000_000), (Side::Pymeshfix, 21), (Side::Suture, 1 << 40)];
        assert_eq!(reached.map(|(side, size)| options.reaches(side, size)), [true, false, false, true]);
    }
}
