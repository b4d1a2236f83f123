//! Suture's engine: it reads a triangle soup, builds its topology in star-complete chunks, repairs what is broken as a sparse
//! edit against the original, writes the result once and judges the written bytes.
//!
//! It knows no daemon and no store. The two entry points are [`inspect`] and [`repair`].

#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod algorithms;
mod contract;
mod detect;
mod diagnosis;
mod engine;
#[cfg(test)]
mod extremes;
mod geometry;
#[cfg(any(test, feature = "internals"))]
#[doc(hidden)]
pub mod internals;
mod io;
mod output;
mod repairs;
mod stream;
mod submesh;
#[cfg(test)]
mod testing;
mod topology;
mod util;

pub use contract::access::Access;
pub use contract::error::{Error, ErrorClass};
pub use contract::progress::{Progress, Quiet};
pub use contract::ranges::ProfileError;
pub use contract::report::Report;
pub use contract::settings::{Bodies, Guarantee, Limits, PatchShape, Profile};
pub use contract::{error, report, settings};
pub use detect::rules::{RULES, Rule};
pub use io::read::ends_in_zeros;
pub use io::{read, record};

use std::path::Path;

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
