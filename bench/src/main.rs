//! Makes broken meshes, judges and draws meshes, and compares Suture with its peers.

mod compare;
mod holes;
mod judging;
mod machined;
mod mesh;
mod picture;
mod publishing;
mod simplify_choices;
mod which;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, Parser, Subcommand};
use compare::{Cache, Options, Side};
use publishing::{Closing, closing, command, publish};
use simplify_choices::SimplifyChoices;
use suture_bench::generate::{self, Case, Density};
use which::Which;

#[derive(Parser)]
#[command(about = "Makes broken meshes, judges meshes, and compares Suture with its peers.")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Write a binary STL with known defects, and say which.
    Generate {
        /// clean, holes, duplicates, flipped, soup, mixed, cracks, gaps, … (an unknown name lists them all)
        case: Case,
        /// About how many triangles.
        triangles: u64,
        out: PathBuf,
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// sparse: one cell of 512 triangles in ten holds a defect; everywhere: each one does.
        #[arg(long, default_value = "sparse")]
        density: Density,
    },
    /// Check a binary STL independently of the engine. Exit code 1: not closed, manifold and oriented.
    Judge {
        file: PathBuf,
        /// The input it was made from: also count the records that survived byte for byte and in order.
        #[arg(long)]
        reference: Option<PathBuf>,
        /// Print one JSON object (needs a reference).
        #[arg(long, requires = "reference")]
        json: bool,
        /// What it was meant to be (an STL whose material is where it winds at least once): how far is it from that?
        #[arg(long, conflicts_with_all = ["reference", "json"])]
        intended: Option<PathBuf>,
        /// The input it was made from: which part of its skin is lost, and what was never drawn?
        #[arg(long, conflicts_with_all = ["reference", "json", "intended"])]
        skin_of: Option<PathBuf>,
        /// Look for self-intersections and for what is inside out, too, and say only what keeps the file from being printed.
        #[arg(long, conflicts_with_all = ["reference", "json"])]
        solid: bool,
    },
    /// Draw binary STL files side by side into a PNG: the outside grey, the inside orange.
    Picture(picture::Options),
    /// Run suture and its peers over files, keep every run in `results/`, and publish what is there.
    Compare(Box<Compare>),
    /// Cut holes into surfaces that are known everywhere, have suture and its peers close them, and publish how far off they are.
    Shape(Closing),
    /// Have suture and its peers repair those STL files of a folder that have holes, and publish what came out.
    Close {
        /// A folder of STL files.
        folder: PathBuf,
        /// Go on where the raw file ends.
        #[arg(long)]
        resume: bool,
        #[command(flatten)]
        options: Closing,
    },
    /// Ask suture and its peers for a solid of every STL file of a folder, and publish what came out.
    Solids {
        /// A folder of STL files.
        folder: PathBuf,
        /// Which programs; what others made of the files already stays on the page.
        #[arg(long, value_delimiter = ',', default_values_t = Side::SOLID)]
        sides: Vec<Side>,
        /// Leave larger files out.
        #[arg(long, value_name = "MB", default_value_t = 60)]
        up_to: u64,
        /// Only so many files, the smallest ones.
        #[arg(long, value_name = "FILES")]
        smallest: Option<usize>,
        /// Run what is in the raw file already, by the very same program.
        #[arg(long)]
        again: bool,
        #[command(flatten)]
        options: Closing,
    },
    /// Have suture and its peers repair damaged files whose intended solid is known, and publish whether it is what comes out.
    Meaning(Meaning),
    /// Write such files: each damaged, as it was meant, and what is to be known of it.
    Meant {
        /// The folder to write to.
        folder: PathBuf,
        #[command(flatten)]
        which: Which,
    },
    /// Have suture repair the STL files of a folder, and publish what of their skin is lost, and what was never drawn.
    Skin {
        /// A folder of STL files.
        folder: PathBuf,
        /// Processes at a time.
        #[arg(long, default_value_t = 1)]
        jobs: usize,
        /// Put what comes out into this folder.
        #[arg(long, value_name = "DIR")]
        keep: Option<PathBuf>,
        #[command(flatten)]
        options: Closing,
    },
    /// Measure how fast suture and its peers read and write each format, and publish it.
    Formats(Formats),
    /// Measure how the cost of filling curves grows with their number, and publish it.
    Curves {
        /// Curves of one outline, or loops of four.
        #[arg(long, value_delimiter = ',', default_value = "100,1000,10000,100000")]
        sizes: Vec<u64>,
        /// Runs over every network.
        #[arg(long, default_value_t = 3)]
        runs: usize,
        #[command(flatten)]
        options: Closing,
    },
    /// Simulate the workpiece of a G-code file as a height field, have suture remove what the tool left, measure and draw it.
    Machined(machined::Options),
    /// Measure how fast suture and its peers make triangles fewer, and how near the rest is, and publish it.
    Simplify(SimplifyChoices),
    /// Measure how fast files go through the daemon with jobs in its own store and in PostgreSQL, and publish it.
    Stores {
        /// Triangles of a file, and how many files.
        #[arg(long, value_name = "TRIANGLES:FILES", value_delimiter = ',', default_value = "5000:400,200000:24", value_parser = name_and_size::<u64>)]
        sizes: Vec<(u64, u64)>,
        /// Runs with each store, in alternation.
        #[arg(long, default_value_t = 5)]
        runs: usize,
        #[command(flatten)]
        options: Closing,
    },
    /// Load one OBJ by tobj, and print the seconds as JSON: a process that `formats` measures.
    #[command(hide = true)]
    LoadObj { file: PathBuf },
    /// Make RESULTS.md, the plots and the README's table from the raw runs that are kept.
    Publish(Publish),
}

#[derive(Args)]
struct Compare {
    /// Which programs; `all`, or names (an unknown name lists them).
    #[arg(long, value_delimiter = ',', default_value = "all")]
    peers: Vec<Peer>,
    /// About how many triangles.
    #[arg(long, value_delimiter = ',', default_value = "100000,1000000,10000000")]
    sizes: Vec<u64>,
    #[arg(long, value_delimiter = ',', default_value = "mixed,clean")]
    cases: Vec<Case>,
    /// How many cells of 512 triangles hold a defect of their case: sparse (one in ten), everywhere.
    #[arg(long, value_delimiter = ',', default_value = "sparse")]
    density: Vec<Density>,
    /// Binary STL files from elsewhere, instead of generated ones.
    #[arg(long, num_args = 1.., conflicts_with_all = ["sizes", "cases"])]
    files: Vec<PathBuf>,
    /// For each size and case a folder of so many small files, that one process works through.
    #[arg(long, value_name = "FILES", default_value_t = 1)]
    many: u64,
    /// Measure a case only up to this size (a soup takes plain pymeshlab quadratic time).
    #[arg(long, value_name = "CASE:TRIANGLES", value_delimiter = ',', value_parser = name_and_size::<Case>)]
    up_to: Vec<(Case, u64)>,
    /// Measure a program up to this size, instead of where it is usually left out for its time or memory.
    #[arg(long, value_name = "PEER:TRIANGLES", value_delimiter = ',', value_parser = name_and_size::<Side>)]
    peer_up_to: Vec<(Side, u64)>,
    /// State of the page cache at the start of a run: warm, cold.
    #[arg(long, value_delimiter = ',', default_value = "warm")]
    cache: Vec<Cache>,
    /// Threads that suture is told to use, one way to run for each.
    #[arg(long, value_delimiter = ',')]
    threads: Vec<u16>,
    /// Memory that suture is told to use, such as 768MiB.
    #[arg(long)]
    memory: Option<String>,
    /// Run every process in a memory cgroup of so many MiB (usually needs root).
    #[arg(long, value_name = "MIB")]
    cgroup: Option<u64>,
    /// Runs of every program over every file, in alternation.
    #[arg(long, default_value_t = 3)]
    runs: usize,
    /// A program that has run over a file is not run over it again if that would take it more than so many seconds in all.
    #[arg(long, value_name = "SECONDS", default_value_t = 300)]
    patience: u64,
    /// Seconds after which a process is killed; it then sits out the other runs over that file.
    #[arg(long, default_value_t = 900)]
    limit: u64,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Judge outputs of inputs up to this size.
    #[arg(long, value_name = "TRIANGLES", default_value_t = 12_000_000)]
    judge_up_to: u64,
    /// Name of the raw file, `NAME.jsonl`. One of this name is replaced, unless it is resumed.
    #[arg(long, default_value = "compare")]
    name: String,
    /// Go on where the raw file ends: what is in it is not run again.
    #[arg(long)]
    resume: bool,
    /// The folder of raw files, instead of this crate's `results`. Page and plots are then put there, too.
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// Where to make inputs and outputs (three times the largest file's 50 bytes a triangle is ample); the system's temporary folder
    /// otherwise.
    #[arg(long)]
    folder: Option<PathBuf>,
    /// Measure this binary instead of building one.
    #[arg(long)]
    suture: Option<PathBuf>,
}

#[derive(Args)]
struct Meaning {
    #[command(flatten)]
    which: Which,
    /// Which programs. Suture takes minutes, each peer half an hour for ten seeds.
    #[arg(long, value_delimiter = ',', default_value = "suture")]
    sides: Vec<Side>,
    /// Processes at a time; as many as there are processors otherwise.
    #[arg(long)]
    jobs: Option<usize>,
    /// Run what is in the raw file already, by the very same program over the very same files.
    #[arg(long)]
    again: bool,
    /// Put files that are not as wanted, and what came out, into this folder.
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
    #[command(flatten)]
    options: Closing,
}

#[derive(Args)]
struct Formats {
    /// About how many triangles the mesh has, or several meshes.
    #[arg(long, value_delimiter = ',', default_value = "5000000")]
    triangles: Vec<u64>,
    /// Runs of every program over every file, in alternation.
    #[arg(long, default_value_t = 3)]
    runs: usize,
    /// Memory that suture is told to use in one more run of each round, such as 512MiB.
    #[arg(long)]
    memory: Option<String>,
    /// Hold that one more run of suture in a memory cgroup of so many MiB, from a cold cache (usually needs root).
    #[arg(long, value_name = "MIB")]
    cgroup: Option<u64>,
    #[command(flatten)]
    options: Closing,
}

#[derive(Args)]
struct Publish {
    /// The folder of raw files, instead of this crate's `results`. Page and plots are then put there, too.
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// Write nothing; exit code 1 if the pages, or the README's table, are not those of the raw runs.
    #[arg(long)]
    check: bool,
}

/// One program, or all.
#[derive(Clone)]
struct Peer(Vec<Side>);

impl std::str::FromStr for Peer {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let all = || Side::ALL.into_iter().filter(|side| side.repairs_files()).collect();
        match name.parse::<Side>() {
            _ if name == "all" => Ok(Self(all())),
            Ok(side) if side.is_of_formats() => Err(format!("{side} is measured by `formats`")),
            side => side.map(|side| Self(vec![side])),
        }
    }
}

fn main() -> ExitCode {
    let done = match Arguments::parse().task {
        Task::Generate { case, triangles, out, seed, density } => generate_file(case, density, triangles, &out, seed),
        Task::Judge { file, solid: true, .. } => judging::judge_solid(&file),
        Task::Judge { file, intended: Some(intended), .. } => judging::judge_intended(&file, &intended),
        Task::Judge { file, skin_of: Some(before), .. } => judging::judge_skin(&file, &before),
        Task::Judge { file, reference, json, .. } => judging::judge_file(&file, reference.as_deref(), json),
        Task::Picture(options) => picture::draw(&options).map(|()| ExitCode::SUCCESS),
        Task::Compare(choices) => compare_all(*choices),
        Task::Shape(choices) => closing(choices, "shape", false, compare::closing::shapes),
        Task::Close { folder, resume, options } => close_files(&folder, resume, options),
        Task::Solids { folder, sides, up_to, smallest, again, options } => {
            make_solids(&folder, &sides, up_to, smallest, again, options)
        }
        Task::Meaning(choices) => judge_meaning(choices),
        Task::Meant { folder, which } => write_meant(&folder, &which),
        Task::Skin { folder, jobs, keep, options } => judge_skins(&folder, jobs, keep, options),
        Task::Formats(choices) => measure_formats(choices),
        Task::Curves { sizes, runs, options } => {
            closing(options, "curves", false, |options| compare::outlines::outlines(options, &sizes, runs))
        }
        Task::Machined(options) => machined::machined(&options).map(|()| ExitCode::SUCCESS),
        Task::Simplify(choices) => choices.measure(),
        Task::Stores { sizes, runs, options } => {
            closing(options, "stores", false, |options| compare::stores::stores(options, &sizes, runs))
        }
        Task::LoadObj { file } => load_obj(&file),
        Task::Publish(Publish { results, check: true }) => check(results.as_deref()),
        Task::Publish(choices) => publish(choices.results.as_deref()).map(|()| ExitCode::SUCCESS),
    };
    done.unwrap_or_else(|error| {
        eprintln!("suture-bench: {error}");
        ExitCode::from(2)
    })
}

fn name_and_size<T: std::str::FromStr<Err: std::fmt::Display>>(text: &str) -> Result<(T, u64), String> {
    let (name, size) = text.split_once(':').ok_or("expected NAME:TRIANGLES")?;
    Ok((name.parse().map_err(|e: T::Err| e.to_string())?, size.parse().map_err(|e| format!("{e}"))?))
}

fn generate_file(case: Case, density: Density, triangles: u64, out: &Path, seed: u64) -> Result<ExitCode, Box<dyn Error>> {
    let truth = generate::write_file_at(case, density, triangles, seed, out)?;
    println!("{:#?}\ninjected: {:#?}\nvolume: {}", truth.counts, truth.injected, truth.volume);
    Ok(ExitCode::SUCCESS)
}

/// Over all STL files of a folder, in the order of their names.
fn close_files(folder: &Path, resume: bool, choices: Closing) -> Result<ExitCode, Box<dyn Error>> {
    let files = stl_files(folder)?;
    closing(choices, "closing", resume, |options| compare::closing::files(options, &files))
}

/// The STL files of a folder, by name.
fn stl_files(folder: &Path) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let entries = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut files: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("stl")));
    files.sort();
    Ok(files)
}

/// Over all STL files of a folder.
fn judge_skins(folder: &Path, jobs: usize, keep: Option<PathBuf>, choices: Closing) -> Result<ExitCode, Box<dyn Error>> {
    let files = stl_files(folder)?;
    closing(choices, "skin", false, |options| compare::skin::skins(options, &files, jobs.max(1), keep))
}

/// Over the STL files of a folder that are not too large, the smallest first: the raw file is always gone on with.
fn make_solids(
    folder: &Path,
    sides: &[Side],
    megabytes: u64,
    smallest: Option<usize>,
    again: bool,
    choices: Closing,
) -> Result<ExitCode, Box<dyn Error>> {
    let size = |path: &PathBuf| path.metadata().map_or(u64::MAX, |facts| facts.len());
    let mut files = stl_files(folder)?;
    files.retain(|path| size(path) <= megabytes * 1_000_000);
    files.sort_by_key(size);
    files.truncate(smallest.unwrap_or(usize::MAX));
    closing(choices, "solids", true, |options| compare::solids::solids(options, &files, sides, again))
}

/// Families over seeds: the raw file is always gone on with.
fn judge_meaning(choices: Meaning) -> Result<ExitCode, Box<dyn Error>> {
    let asked = compare::meaning::Asked {
        families: choices.which.families(),
        first: choices.which.first,
        seeds: choices.which.seeds,
        sides: choices.sides,
        jobs: choices.jobs.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from)).max(1),
        again: choices.again,
        keep: choices.keep,
    };
    closing(choices.options, "meaning", true, |options| compare::meaning::meaning(options, &asked))
}

/// Reading and writing; the raw file is made anew.
fn measure_formats(choices: Formats) -> Result<ExitCode, Box<dyn Error>> {
    let asked = compare::formats::Asked {
        sizes: choices.triangles,
        runs: choices.runs,
        memory: choices.memory,
        cgroup: choices.cgroup.map(|mebibytes| mebibytes << 20),
    };
    closing(choices.options, "formats", false, |options| compare::formats::formats(options, &asked))
}

fn load_obj(file: &Path) -> Result<ExitCode, Box<dyn Error>> {
    println!("{}", compare::load_obj(file)?);
    Ok(ExitCode::SUCCESS)
}

fn write_meant(folder: &Path, which: &Which) -> Result<ExitCode, Box<dyn Error>> {
    for family in which.families() {
        for seed in which.first..which.first + which.seeds {
            compare::meaning::write_case(folder, &family, seed, &family.case(seed))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn compare_all(choices: Compare) -> Result<ExitCode, Box<dyn Error>> {
    let folder = choices.results.clone().unwrap_or_else(compare::results);
    let elsewhere = !choices.files.is_empty();
    let options = Options {
        sizes: if elsewhere { Vec::new() } else { choices.sizes },
        cases: choices.cases,
        densities: choices.density,
        files: choices.files,
        many: choices.many,
        up_to: choices.up_to,
        side_up_to: choices.peer_up_to,
        sides: choices.peers.into_iter().flat_map(|peer| peer.0).collect(),
        caches: choices.cache,
        threads: choices.threads,
        memory: choices.memory,
        cgroup: choices.cgroup.map(|mebibytes| mebibytes << 20),
        runs: choices.runs,
        patience: Duration::from_secs(choices.patience),
        seed: choices.seed,
        raw: folder.join(format!("{}.jsonl", choices.name)),
        resume: choices.resume,
        folder: choices.folder,
        judge_up_to: choices.judge_up_to,
        suture: choices.suture,
        limit: Duration::from_secs(choices.limit),
        command: command(),
    };
    compare::compare(&options)?;
    publish(choices.results.as_deref())?;
    Ok(ExitCode::SUCCESS)
}

fn check(results: Option<&Path>) -> Result<ExitCode, Box<dyn Error>> {
    let (raw, into, readme) = compare::places(results);
    let outdated = compare::outdated(&raw, &into, readme.as_deref())?;
    outdated.iter().for_each(|path| println!("{} is not what the raw runs say: publish", path.display()));
    Ok(ExitCode::from(u8::from(!outdated.is_empty())))
}
