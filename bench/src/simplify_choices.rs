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
    #[command(flatten)]
    options: Closing,
}

impl SimplifyChoices {
    /// Measures, and publishes; the raw file is made anew.
    ///
    /// # Errors
    /// When suture cannot be built, or the system fails.
    pub(crate) fn measure(self) -> Result<ExitCode, Box<dyn Error>> {
        let asked = compare::simplify::Asked { sizes: self.sizes, ratio: self.ratio, runs: self.runs };
        closing(self.options, "simplify", false, |options| compare::simplify::simplify(options, &asked))
    }
}
