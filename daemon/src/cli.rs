//! The command line: what can be said, with help for each word of it. Meaning is given in the modules named after the commands.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use crate::units::parse_size;

/// Unattended repair of triangle meshes for 3D printing.
///
/// Exit status: 0 good under the profile; 1 done, but a file is not good; 2 unreadable or refused input, or wrong usage.
#[derive(Debug, Parser)]
#[command(name = "suture", version, max_term_width = 100, disable_help_subcommand = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Repair files: write what is printable, say what was wrong and what was done
    Repair(RepairArgs),
    /// Diagnose files and write nothing
    Inspect(InspectArgs),
    /// Work on requests from standard input (started by the supervisor)
    #[command(hide = true)]
    Worker,
}

/// What the machine may spend; never changes a result.
#[derive(Args, Debug, Clone)]
pub(crate) struct Spend {
    /// Memory the work may hold, e.g. 512MiB; larger files stream through it [default: 1GiB]
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    pub memory: Option<u64>,
    /// Threads to use [default: all processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Triangles in a chunk
    #[arg(long, value_name = "N", hide = true, value_parser = clap::value_parser!(u32).range(1..))]
    pub chunk_triangles: Option<u32>,
}

impl Spend {
    /// As the engine takes it.
    pub(crate) fn limits(&self, list_edit: bool) -> suture_core::Limits {
        let mut limits = suture_core::Limits { list_edit, ..Default::default() };
        limits.memory_bytes = self.memory.unwrap_or(limits.memory_bytes);
        limits.threads = self.threads.map_or(limits.threads, usize::from);
        limits.chunk_triangles = self.chunk_triangles.unwrap_or(limits.chunk_triangles);
        limits
    }
}

#[derive(Args, Debug)]
pub(crate) struct RepairArgs {
    /// Mesh files (binary or ASCII STL)
    #[arg(required = true, value_name = "IN")]
    pub inputs: Vec<PathBuf>,
    /// Where to write: a file name, or a folder (needed for several inputs; part.stl, then part~2.stl)
    #[arg(short, long, value_name = "OUT|DIR")]
    pub output: PathBuf,
    /// Write the full report as JSON to this file (for several inputs: into this folder)
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Profile: default, scan, cautious, or a TOML file of settings
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    pub profile: String,
    #[command(flatten)]
    pub spend: Spend,
    /// Print reports as JSON, one a line, instead of tables
    #[arg(long)]
    pub json: bool,
    /// List every deleted, flipped, moved and added triangle in the report
    #[arg(long)]
    pub list_edit: bool,
    /// Replace OUT and the report if they exist (an input is never replaced)
    #[arg(long)]
    pub force: bool,
}

#[derive(Args, Debug)]
pub(crate) struct InspectArgs {
    /// Mesh files (binary or ASCII STL)
    #[arg(required = true, value_name = "IN")]
    pub inputs: Vec<PathBuf>,
    /// Profile: default, scan, cautious, or a TOML file of settings
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    pub profile: String,
    #[command(flatten)]
    pub spend: Spend,
    /// Print reports as JSON, one a line, instead of tables
    #[arg(long)]
    pub json: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_well_formed() {
        Cli::command().debug_assert();
    }
}
