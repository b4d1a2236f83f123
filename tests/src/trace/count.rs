//! Counts calls by role and kind.

use std::collections::BTreeMap;

use super::calls::{KINDS, numbers};
use super::fault::Role;
use super::run::{Eyes, Next};
use super::stop::Stop;

/// Calls of each kind and role, from the start of each program's own part on.
#[derive(Default)]
pub struct Counter {
    /// How many.
    pub counts: BTreeMap<(Role, &'static str), u64>,
}

impl Eyes for Counter {
    fn numbers(&self) -> Vec<i64> {
        KINDS.iter().flat_map(numbers).collect()
    }

    fn before(&mut self, stop: &Stop) -> Next {
        if let Some(kind) = stop.kind() {
            *self.counts.entry((stop.role, kind.name)).or_default() += 1;
        }
        Next::Go
    }
}
