//! `suture-bench generate` and, later, the comparison.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use suture_bench::generate::{self, Case};

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
}

fn main() -> ExitCode {
    let Task::Generate { case, triangles, out, seed } = Arguments::parse().task;
    match generate::write_file(case, triangles, seed, &out) {
        Ok(truth) => {
            println!("{truth:#?}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("suture-bench: {error}");
            ExitCode::from(2)
        }
    }
}
