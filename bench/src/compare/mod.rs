//! Suture and pymeshlab over the same generated files: whole processes in alternation, outputs synced, both judged alike.
//!
//! Every run starts with its input in the page cache and everything else written back. The outputs of the first run of each side
//! are judged, by another process, so that the memory that needs is not counted against a child of this one. Results are written
//! after every input: a long comparison that is stopped leaves what it has.

mod child;
mod machine;
mod sides;
mod table;

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use suture_bench::Counts;
use suture_bench::generate::{self, Case, Truth};
use suture_bench::judge::{Judgement, Kept};

pub(crate) use child::Cost;
pub(crate) use machine::Machine;
pub(crate) use sides::Side;

/// Why a comparison ended.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Error {
    /// The system failed.
    #[error("{action} failed: {source}")]
    Io { action: String, source: io::Error },
    /// Cargo said why above.
    #[error("suture could not be built; `--suture PATH` names another binary")]
    Build,
    /// `python3 -m venv` does not work.
    #[error("pymeshlab needs Python: install python3 with its venv module, or measure suture alone with `--sides suture`")]
    NoPython,
    /// pip said why above.
    #[error("pymeshlab {version} could not be installed; without it, measure suture alone with `--sides suture`")]
    NoPymeshlab { version: String },
    /// An input could not be made.
    #[error(transparent)]
    Generate(#[from] generate::Error),
    /// Results could not be written as JSON.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
}

impl Error {
    fn io(action: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        let action = action.into();
        move |source| Self::Io { action, source }
    }
}

/// What to compare.
#[derive(Clone, Debug)]
pub(crate) struct Options {
    pub(crate) sizes: Vec<u64>,
    pub(crate) cases: Vec<Case>,
    /// Largest size of some cases.
    pub(crate) up_to: Vec<(Case, u64)>,
    pub(crate) sides: Vec<Side>,
    pub(crate) runs: usize,
    pub(crate) seed: u64,
    /// The published page; `results.json` is written beside it.
    pub(crate) out: Option<PathBuf>,
    /// Where inputs and outputs are made; the system's temporary folder otherwise.
    pub(crate) folder: Option<PathBuf>,
    pub(crate) keep_inputs: bool,
    /// A binary to measure instead of the one built now.
    pub(crate) suture: Option<PathBuf>,
    /// A process that takes longer is killed, and its side sits out the other runs of that input.
    pub(crate) limit: Duration,
    /// The command line, to be published.
    pub(crate) command: String,
}

/// Everything that was measured.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Results {
    pub(crate) command: String,
    pub(crate) machine: Machine,
    pub(crate) trials: Vec<Trial>,
}

/// One input and all that ran over it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Trial {
    pub(crate) case: String,
    /// The size asked for.
    pub(crate) size: u64,
    pub(crate) seed: u64,
    pub(crate) bytes: u64,
    /// What is wrong with the input.
    pub(crate) counts: Counts,
    pub(crate) injected: BTreeMap<String, u64>,
    /// Volume of the sound model.
    pub(crate) volume: f64,
    pub(crate) runs: Vec<Run>,
    pub(crate) outcomes: Vec<Outcome>,
}

/// One process.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Run {
    pub(crate) side: Side,
    /// From 0; runs of equal number are a pair.
    pub(crate) run: usize,
    pub(crate) cost: Cost,
}

/// What a side made of an input.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Outcome {
    pub(crate) side: Side,
    /// `None` when there was nothing to judge, for which [`Outcome::reason`] has the reason.
    pub(crate) judged: Option<Judged>,
    pub(crate) reason: String,
}

/// The judge's word on an output.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Judged {
    pub(crate) judgement: Judgement,
    /// Records of the input that stand in the output byte for byte, in order.
    pub(crate) records: Kept,
    /// The same by the 36 bytes of their corners alone.
    pub(crate) corners: Kept,
}

impl Trial {
    /// Closed, manifold, oriented, and of the model's volume within a hundredth.
    pub(crate) fn is_good(&self, judged: &Judged) -> bool {
        judged.judgement.sound() && (judged.judgement.volume / self.volume - 1.0).abs() <= 0.01
    }

    /// The costs of one side, in order of runs.
    pub(crate) fn costs(&self, side: Side) -> impl Iterator<Item = (usize, &Cost)> {
        self.runs.iter().filter(move |run| run.side == side).map(|run| (run.run, &run.cost))
    }
}

/// Runs the comparison and writes its results; returns where the page is.
///
/// # Errors
/// When a program is missing, or the system fails. A program that fails over an input is a result.
pub(crate) fn compare(options: &Options) -> Result<PathBuf, Error> {
    let mut sides = options.sides.clone();
    sides.extend([Side::Copy, Side::CopySynced]);
    if sides.contains(&Side::Suture) {
        sides.push(Side::Inspect);
    }
    sides.sort_unstable();
    sides.dedup();
    let programs = sides::Programs::prepare(&sides, options.suture.clone())?;
    let parent = options.folder.clone().unwrap_or_else(std::env::temp_dir);
    let folder = tempfile::Builder::new().prefix("suture-bench-").tempdir_in(&parent).map_err(Error::io("making a folder"))?;
    let page = options.out.clone().unwrap_or_else(|| sides::home().join("RESULTS.md"));
    let machine = Machine::describe(folder.path(), programs.versions());
    let mut results = Results { command: options.command.clone(), machine, trials: Vec::new() };
    for &size in &options.sizes {
        let fits = |case: Case| options.up_to.iter().all(|(bounded, most)| *bounded != case || size <= *most);
        for &case in options.cases.iter().filter(|case| fits(**case)) {
            let input = folder.path().join(format!("{case}-{size}.stl"));
            eprintln!("{case}, {size} triangles");
            let truth = generate::write_file(case, size, options.seed, &input)?;
            results.trials.push(trial(options, &sides, &programs, &input, size, truth)?);
            write(&results, &page)?;
            if !options.keep_inputs {
                std::fs::remove_file(&input).map_err(Error::io("removing an input"))?;
            }
        }
    }
    if options.keep_inputs {
        println!("the inputs are in {}", folder.keep().display());
    }
    Ok(page)
}

/// All runs over one input, and the verdicts on their outputs.
fn trial(
    options: &Options,
    sides: &[Side],
    programs: &sides::Programs,
    input: &Path,
    size: u64,
    truth: Truth,
) -> Result<Trial, Error> {
    let mut trial = Trial {
        case: truth.case.name().into(),
        size,
        seed: truth.seed,
        bytes: std::fs::metadata(input).map_err(Error::io("looking at an input"))?.len(),
        counts: truth.counts,
        injected: truth.injected.into_iter().map(|(name, count)| (name.into(), count)).collect(),
        volume: truth.volume,
        runs: Vec::new(),
        outcomes: Vec::new(),
    };
    let output = input.with_extension("out.stl");
    for run in 0..options.runs {
        for &side in sides {
            if trial.costs(side).any(|(_, cost)| !cost.exited) {
                continue;
            }
            warm(input)?;
            let command = programs.command(side, input, &output);
            let target = (side != Side::Inspect).then_some(output.as_path());
            let cost = child::measure(command, target, side.synced(), options.limit)?;
            eprintln!("  {:10} {:>9.3} s wall {:>9.3} s CPU  {}", side.name(), cost.wall_seconds, cost.cpu_seconds, cost.end);
            if run == 0 && side.repairs() {
                trial.outcomes.push(outcome(side, input, &output, &cost)?);
            }
            trial.runs.push(Run { side, run, cost });
            if output.exists() {
                std::fs::remove_file(&output).map_err(Error::io("removing an output"))?;
            }
        }
    }
    Ok(trial)
}

/// Brings a file into the page cache.
fn warm(path: &Path) -> Result<(), Error> {
    let mut file = File::open(path).map_err(Error::io("opening an input"))?;
    io::copy(&mut file, &mut io::sink()).map_err(Error::io("reading an input"))?;
    Ok(())
}

/// Has an output judged by another process of this program.
fn outcome(side: Side, input: &Path, output: &Path, cost: &Cost) -> Result<Outcome, Error> {
    let nothing = |reason: String| Ok(Outcome { side, judged: None, reason });
    if !cost.exited || cost.output_bytes.is_none() {
        return nothing(cost.end.clone());
    }
    let program = std::env::current_exe().map_err(Error::io("finding this program"))?;
    let judged = Command::new(program).arg("judge").arg(output).arg("--json").arg("--reference").arg(input).output();
    let judged = judged.map_err(Error::io("starting the judge"))?;
    match serde_json::from_slice(&judged.stdout) {
        Ok(judged) => Ok(Outcome { side, judged: Some(judged), reason: String::new() }),
        Err(_) => nothing(String::from_utf8_lossy(&judged.stderr).trim().into()),
    }
}

/// Writes the page and the numbers beside it.
fn write(results: &Results, page: &Path) -> Result<(), Error> {
    let numbers = page.with_file_name("results.json");
    std::fs::write(page, table::page(results)).map_err(Error::io(format!("writing {}", page.display())))?;
    let text = serde_json::to_string_pretty(results)? + "\n";
    std::fs::write(&numbers, text).map_err(Error::io(format!("writing {}", numbers.display())))
}
