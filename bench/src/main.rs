//! Makes broken meshes, judges and draws meshes, and compares Suture with pymeshlab.

mod compare;
mod picture;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, Parser, Subcommand};
use compare::{Judged, Options, Side};
use suture_bench::generate::{self, Case};
use suture_bench::judge::{self, Judgement, Same};

#[derive(Parser)]
#[command(about = "Makes broken meshes, judges meshes, and compares Suture with pymeshlab.")]
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
    },
    /// Draw binary STL files side by side into a PNG: the outside grey, the inside orange.
    Picture(picture::Options),
    /// Measure suture and two pymeshlab pipelines over generated files, and write RESULTS.md and results.json.
    Compare(Compare),
}

#[derive(Args)]
struct Compare {
    /// About how many triangles.
    #[arg(long, value_delimiter = ',', default_value = "100000,1000000,10000000")]
    sizes: Vec<u64>,
    #[arg(long, value_delimiter = ',', default_value = "clean,holes,duplicates,flipped,soup,mixed")]
    cases: Vec<Case>,
    /// Measure a case only up to this size, as CASE:TRIANGLES (a soup takes plain pymeshlab quadratic time).
    #[arg(long, value_delimiter = ',', value_parser = case_and_size)]
    up_to: Vec<(Case, u64)>,
    /// Runs of every program over every file, in alternation.
    #[arg(long, default_value_t = 3)]
    runs: usize,
    /// Which programs.
    #[arg(long, value_delimiter = ',', default_value = "suture,plain,competent")]
    sides: Vec<Side>,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The page to write instead of this crate's RESULTS.md.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Where to make inputs and outputs (ten times the largest file's 50 bytes a triangle is ample); the system's temporary
    /// folder otherwise.
    #[arg(long)]
    folder: Option<PathBuf>,
    /// Leave the generated inputs where they are.
    #[arg(long)]
    keep_inputs: bool,
    /// Measure this binary instead of building one.
    #[arg(long)]
    suture: Option<PathBuf>,
    /// Seconds after which a process is killed; its side then sits out the other runs over that file.
    #[arg(long, default_value_t = 900)]
    limit: u64,
}

fn main() -> ExitCode {
    let done = match Arguments::parse().task {
        Task::Generate { case, triangles, out, seed } => generate_file(case, triangles, &out, seed),
        Task::Judge { file, reference, json } => judge_file(&file, reference.as_deref(), json),
        Task::Picture(options) => picture::draw(&options).map(|()| ExitCode::SUCCESS),
        Task::Compare(choices) => compare_all(choices),
    };
    done.unwrap_or_else(|error| {
        eprintln!("suture-bench: {error}");
        ExitCode::from(2)
    })
}

fn case_and_size(text: &str) -> Result<(Case, u64), String> {
    let (case, size) = text.split_once(':').ok_or("expected CASE:TRIANGLES")?;
    Ok((case.parse().map_err(|e| format!("{e}"))?, size.parse().map_err(|e| format!("{e}"))?))
}

fn generate_file(case: Case, triangles: u64, out: &Path, seed: u64) -> Result<ExitCode, Box<dyn Error>> {
    let truth = generate::write_file(case, triangles, seed, out)?;
    println!("{:#?}\ninjected: {:#?}\nvolume: {}", truth.counts, truth.injected, truth.volume);
    Ok(ExitCode::SUCCESS)
}

fn judge_file(file: &Path, reference: Option<&Path>, json: bool) -> Result<ExitCode, Box<dyn Error>> {
    let judgement = judge::judge(file)?;
    if !json {
        let yes = |good| if good { "yes" } else { "no" };
        let Judgement { counts, .. } = judgement;
        println!("{judgement:#?}");
        println!("closed {}, manifold {}, oriented {}", yes(counts.closed()), yes(counts.manifold()), yes(counts.oriented()));
    }
    if let Some(reference) = reference {
        let records = judge::kept_in_order(reference, file, Same::Record)?;
        let corners = judge::kept_in_order(reference, file, Same::Corners)?;
        if json {
            println!("{}", serde_json::to_string(&Judged { judgement, records, corners })?);
        } else {
            println!("of {} records kept in order: {} whole, {} by corners", records.of, records.in_order, corners.in_order);
        }
    }
    Ok(ExitCode::from(u8::from(!judgement.sound())))
}

fn compare_all(choices: Compare) -> Result<ExitCode, Box<dyn Error>> {
    let words: Vec<_> = std::env::args().skip(1).collect();
    let options = Options {
        sizes: choices.sizes,
        cases: choices.cases,
        up_to: choices.up_to,
        sides: choices.sides,
        runs: choices.runs,
        seed: choices.seed,
        out: choices.out,
        folder: choices.folder,
        keep_inputs: choices.keep_inputs,
        suture: choices.suture,
        limit: Duration::from_secs(choices.limit),
        command: format!("cargo run --release -p suture-bench -- {}", words.join(" ")),
    };
    println!("results are in {}", compare::compare(&options)?.display());
    Ok(ExitCode::SUCCESS)
}
