//! Which damaged solids a command is asked for: families, and seeds of each.

use clap::Args;
use suture_bench::meaning::{self, Family};

// No doc comment: clap would take it for the help of a command.
#[derive(Args)]
pub(crate) struct Which {
    /// Families, or groups of them (an unknown name lists them); all otherwise.
    #[arg(long, value_delimiter = ',', value_parser = families)]
    families: Vec<Named>,
    /// Files of each family.
    #[arg(long, default_value_t = 50)]
    pub(crate) seeds: u64,
    /// The first seed.
    #[arg(long, default_value_t = 1)]
    pub(crate) first: u64,
}

/// One family, or a group.
#[derive(Clone)]
struct Named(Vec<Family>);

fn families(name: &str) -> Result<Named, String> {
    let found: Vec<_> = meaning::families().filter(|family| family.name == name || family.group == name).collect();
    let names = || meaning::families().map(|family| family.name).collect::<Vec<_>>().join(", ");
    if found.is_empty() { Err(format!("the families are {}", names())) } else { Ok(Named(found)) }
}

impl Which {
    /// Those that are named, or all.
    pub(crate) fn families(&self) -> Vec<Family> {
        let named: Vec<_> = self.families.iter().flat_map(|named| named.0.iter().copied()).collect();
        if named.is_empty() { meaning::families().collect() } else { named }
    }
}
