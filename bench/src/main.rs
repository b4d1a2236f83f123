//! `suture-bench generate` and, later, the comparison.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use suture_bench::generate::{self, Case};
use suture_bench::judge::{self, Judgement};

#[derive(Parser)]
#[command(about = "Generates broken meshes, judges meshes, and compares Suture with pymeshlab.")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Write a binary STL with known defects.
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
    },
}

fn main() -> ExitCode {
    let done = match Arguments::parse().task {
        Task::Generate { case, triangles, out, seed } => generate_file(case, triangles, &out, seed),
        Task::Judge { file, reference } => judge_file(&file, reference.as_deref()),
    };
    done.unwrap_or_else(|error| {
        eprintln!("suture-bench: {error}");
        ExitCode::from(2)
    })
}

fn generate_file(case: Case, triangles: u64, out: &Path, seed: u64) -> Result<ExitCode, Box<dyn Error>> {
    println!("{:#?}", generate::write_file(case, triangles, seed, out)?);
    Ok(ExitCode::SUCCESS)
}

fn judge_file(file: &Path, reference: Option<&Path>) -> Result<ExitCode, Box<dyn Error>> {
    let found = judge::judge(file)?;
    println!("{found:#?}");
    let yes = |good| if good { "yes" } else { "no" };
    let Judgement { counts, .. } = found;
    println!("closed {}, manifold {}, oriented {}", yes(counts.closed()), yes(counts.manifold()), yes(counts.oriented()));
    if let Some(reference) = reference {
        let kept = judge::kept_in_order(reference, file)?;
        println!("kept byte for byte in order: {} of {} records ({:.4} %)", kept.in_order, kept.of, 100.0 * kept.share());
    }
    Ok(ExitCode::from(u8::from(!found.sound())))
}
