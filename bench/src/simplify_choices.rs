//! Words of `simplify`.

use std::error::Error;
use std::process::ExitCode;

use clap::Args;

use crate::compare;
use crate::publishing::{Closing, closing};

/// Choices of the command `simplify`.
#[derive(Args)]
pub(crate) struct SimplifyChoices {
    /// About how many triangles the meshes have; ten million are to be asked for.
    #[arg(long, value_delimiter = ',', default_value = "10000,100000,1000000")]
    sizes: Vec<u64>,
    /// The share of them that is to be left.
    #[arg(long, default_value_t = 0.2)]
    ratio: f64,
    /// Runs of every program over every mesh, in alternation.
    #[arg(long, default_value_t = 3)]
    runs: usize,
    /// Memory that suture is told to use, such as 1GiB; its peers, which have no such choice, are left out then.
    #[arg(long)]
    memory: Option<String>,
    /// Measure how near a result is up to this size of its input.
    #[arg(long, value_name = "TRIANGLES", default_value_t = 12_000_000)]
    judge_up_to: u64,
    /// Go on where the raw file ends.
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    options: Closing,
}

impl SimplifyChoices {
    /// Measures, and publishes; the raw file is made anew, unless it is gone on with.
    ///
    /// # Errors
    /// When suture cannot be built, or the system fails.
    pub(crate) fn measure(self) -> Result<ExitCode, Box<dyn Error>> {
        let Self { sizes, ratio, runs, memory, judge_up_to, resume, options } = self;
        let asked = compare::simplify::Asked { sizes, ratio, runs, memory, judge_up_to };
        closing(options, "simplify", resume, |options| compare::simplify::simplify(options, &asked))
    }
}
