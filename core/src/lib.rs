//! Suture's engine: it reads a triangle soup, builds its topology in star-complete chunks, repairs what is broken as a sparse
//! edit against the original, writes the result once and judges the written bytes.
//!
//! It knows no daemon and no store. The two entry points are [`inspect`] and [`repair`].

#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod ahead;
mod arrange;
mod behind;
mod bodies;
mod boxes;
mod budget;
mod certificate;
mod chunk;
mod columns;
mod cost;
mod crossings;
mod defects;
mod digest;
mod edit;
mod emit;
mod engine;
pub mod error;
#[cfg(test)]
mod extremes;
pub mod fill;
mod finite;
mod fresh;
mod grid;
mod holes;
#[cfg(any(test, feature = "internals"))]
#[doc(hidden)]
pub mod internals;
mod intersect;
mod machine;
mod members;
mod parallel;
mod parts;
mod plan;
mod position;
mod radix;
mod ranges;
pub mod read;
mod readback;
pub mod record;
mod repairs;
pub mod report;
mod rules;
mod second;
pub mod settings;
mod shape;
mod shop;
mod source;
mod space;
mod spool;
mod star;
mod steps;
mod sums;
mod survey;
#[cfg(test)]
mod testing;
mod verdict;
mod weld;
mod wrap;

pub use error::{Error, ErrorClass};
pub use ranges::ProfileError;
pub use read::{Access, ends_in_zeros};
pub use report::Report;
pub use rules::{RULES, Rule};
pub use settings::{Bodies, Guarantee, Limits, PatchShape, Profile};

use std::path::Path;

/// Where the work on one file stands; cheap to call, called from worker threads.
pub trait Progress: Sync {
    /// `stage` has `done` of `total` units (triangles unless the stage says otherwise) behind it.
    fn at(&self, stage: &'static str, done: u64, total: u64);
    /// `true` asks the work to end as soon as it can, without output.
    fn cancelled(&self) -> bool {
        false
    }
}

/// No one is watching.
pub struct Quiet;

impl Progress for Quiet {
    fn at(&self, _: &'static str, _: u64, _: u64) {}
}

/// Diagnoses `input` and writes nothing.
///
/// # Errors
/// [`Error`]; nothing was written in any case.
pub fn inspect(input: &Path, profile: &Profile, limits: &Limits, progress: &dyn Progress) -> error::Result<Report> {
    engine::inspect(input, profile, limits, progress)
}

/// Repairs `input` into `output`, which must not exist: the caller owns a temporary name and publishes it. (Or it is an empty file
/// without a name, which the caller holds open and knows by its path below `/proc`; then [`Limits::spool`] says where there is room.)
/// The output is synced to disk before this returns, unless [`Limits::defer_sync`] says otherwise. A file that is good as it comes is
/// copied byte for byte.
///
/// # Errors
/// [`Error`]; what then stands at `output` is incomplete and to be removed.
pub fn repair(input: &Path, output: &Path, profile: &Profile, limits: &Limits, progress: &dyn Progress) -> error::Result<Report> {
    engine::repair(input, output, profile, limits, progress)
}
