//! What commands on meshes may spend, and what they are to guarantee.

use clap::{Args, ValueEnum};

use crate::units::parse_size;

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
    /// Sort triangles by place into a file first: always, never, or where it helps
    #[arg(long, value_enum, hide = true, default_value = "auto")]
    pub spill: Spill,
}

/// As the engine's own, for the command line.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum Guarantee {
    /// Leave it; only a file that passed every check is good
    Strict,
    /// Replace it by a surface around what it encloses
    Wrap,
    /// Leave it; a check that was not made does not keep a file from being good
    Off,
}

impl From<Guarantee> for suture_core::Guarantee {
    fn from(guarantee: Guarantee) -> Self {
        match guarantee {
            Guarantee::Strict => Self::Strict,
            Guarantee::Wrap => Self::Wrap,
            Guarantee::Off => Self::Off,
        }
    }
}

/// As the engine's own, for the command line.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum Spill {
    Auto,
    Always,
    Never,
}

impl Spend {
    /// As the engine takes it.
    pub(crate) fn limits(&self, list_edit: bool) -> suture_core::Limits {
        let mut limits = suture_core::Limits::default().with_edit_listed(list_edit);
        limits.memory_bytes = self.memory.unwrap_or(limits.memory_bytes);
        limits.threads = self.threads.map_or(limits.threads, usize::from);
        limits.chunk_triangles = self.chunk_triangles.unwrap_or(limits.chunk_triangles);
        limits.spill = match self.spill {
            Spill::Auto => suture_core::Spill::Auto,
            Spill::Always => suture_core::Spill::Always,
            Spill::Never => suture_core::Spill::Never,
        };
        limits
    }
}
