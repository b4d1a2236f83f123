//! What a comparison is asked for.

use std::path::PathBuf;
use std::time::Duration;

use suture_bench::generate::{Case, Density};

use super::sides::Side;
use super::way::{Cache, Way};

/// The settings of a comparison.
#[derive(Clone, Debug, Default)]
pub(crate) struct Options {
    pub(crate) sizes: Vec<u64>,
    pub(crate) cases: Vec<Case>,
    /// How dense the defects of each case are, where it has any.
    pub(crate) densities: Vec<Density>,
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
    pub(super) fn ways(&self) -> Vec<Way> {
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
    pub(super) fn reaches(&self, side: Side, triangles: u64) -> bool {
        let said = self.side_up_to.iter().find(|(other, _)| *other == side).map(|(_, most)| *most);
        triangles <= said.unwrap_or(side.facts().most_triangles)
    }
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
