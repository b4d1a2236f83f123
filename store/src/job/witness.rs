//! A result that was made and not published: another attempt is to make the same bytes.

use std::fmt::{Display, Formatter};

use serde::{Deserialize, Serialize};

use super::words::one_line;
use crate::id::{Hash, Recipe, Time};

/// Longest name of a daemon or a version that is kept, in bytes.
pub const MAX_DAEMON: usize = 160;

/// What the first of two attempts made, and where.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Witness {
    /// The daemon that made it, by its name among those that share the store. Cut to [`MAX_DAEMON`] bytes.
    pub daemon: String,
    /// The version of its engine. Cut to [`MAX_DAEMON`] bytes.
    pub engine: String,
    /// A digest of all that decides the result.
    pub recipe: Recipe,
    /// Of the bytes of the result.
    pub output: Hash,
    /// When the store took it down.
    pub at: Time,
}

impl Witness {
    /// A result of `daemon`, by an engine of that version. The store puts the time to it.
    pub fn new(daemon: &str, engine: &str, recipe: Recipe, output: Hash) -> Self {
        Self { daemon: cut(daemon), engine: cut(engine), recipe, output, at: Time(0) }
    }

    /// Did the daemon of that name make it?
    pub fn is_by(&self, daemon: &str) -> bool {
        self.daemon == cut(daemon)
    }

    /// The same, taken down then.
    pub(super) fn at(&self, at: Time) -> Self {
        Self { at, ..self.clone() }
    }
}

impl Display for Witness {
    /// Who made what, as a part of a sentence.
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "an earlier attempt, by {} with version {}, made a result (BLAKE3 {})", self.daemon, self.engine, self.output)
    }
}

/// As much of a name as is kept.
fn cut(name: &str) -> String {
    let name = one_line(name);
    let end = name.floor_char_boundary(MAX_DAEMON);
    name.get(..end).unwrap_or_default().to_owned()
}
