//! Measurements that are published: their common words, their raw file, and the page that is made anew.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;

use crate::compare;

/// Words that most comparisons have in common.
#[derive(Args)]
pub(crate) struct Closing {
    /// The folder of raw files, instead of this crate's `results`. Page and plots are then put there, too.
    #[arg(long, value_name = "DIR")]
    pub(crate) results: Option<PathBuf>,
    /// Measure this binary instead of building one.
    #[arg(long)]
    pub(crate) suture: Option<PathBuf>,
    /// Seconds after which a process is killed.
    #[arg(long, default_value_t = 300)]
    pub(crate) limit: u64,
}

/// Makes the raw file `name`, then the page.
///
/// # Errors
/// When the work fails, or something cannot be read or written.
pub(crate) fn closing(
    choices: Closing,
    name: &str,
    resume: bool,
    run: impl FnOnce(&compare::closing::Options) -> Result<(), compare::Error>,
) -> Result<ExitCode, Box<dyn Error>> {
    let folder = choices.results.clone().unwrap_or_else(compare::results);
    run(&compare::closing::Options {
        raw: folder.join(format!("{name}.jsonl")),
        plots: choices.results.as_deref().unwrap_or(compare::home()).join("plots"),
        suture: choices.suture,
        resume,
        limit: Duration::from_secs(choices.limit),
        command: command(),
    })?;
    publish(choices.results.as_deref())?;
    Ok(ExitCode::SUCCESS)
}

/// The command line as it is published.
pub(crate) fn command() -> String {
    let words: Vec<_> = std::env::args().skip(1).map(without_place).collect();
    format!("cargo run --release -p suture-bench -- {}", words.join(" "))
}

/// A word of the command line as it is published: of an absolute path only the name, since the rest is this machine's own.
fn without_place(word: String) -> String {
    let path = Path::new(&word);
    match path.file_name() {
        Some(name) if path.is_absolute() => name.to_string_lossy().into_owned(),
        _ => word,
    }
}

/// Publishes this crate's raw runs, or others where they are.
///
/// # Errors
/// When there are no raw runs, or something cannot be read or written.
pub(crate) fn publish(results: Option<&Path>) -> Result<(), Box<dyn Error>> {
    let (raw, into, readme) = compare::places(results);
    compare::publish(&raw, &into, readme.as_deref())?;
    println!("results are in {}", into.join("RESULTS.md").display());
    Ok(())
}
