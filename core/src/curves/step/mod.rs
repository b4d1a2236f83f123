//! STEP: curves, and the faces that they bound.
//!
//! **In:** the text of a file after ISO 10303-21. **Out:** curves of sets and edges of faces in space, assemblies placed.
//! **Promise:** whatever is whole is read, whatever else is around it; what is not read is named with its line.
//!
//! Based on: ISO 10303-21:2016 (the text), ISO 10303-42 (geometry and topology), ISO 10303-41 and -43 (units, representations).

mod assembly;
mod build;
mod builder;
mod curves;
mod edges;
mod extents;
mod faces;
mod frame;
mod index;
mod items;
mod offsets;
mod pcurves;
mod record;
mod splines;
mod surfaces;
#[cfg(test)]
mod tests;
mod text;
mod trimmed;
mod units;

use crate::curves::network::{Network, ReadError};

/// Whether a file is STEP, by its first words.
#[must_use]
pub(crate) fn is_step(text: &[u8]) -> bool {
    let word = b"ISO-10303-21";
    let start = text.get(..word.len()).unwrap_or(text);
    // Files that lost their beginning still have their instances.
    start.eq_ignore_ascii_case(word)
        || text.strip_prefix(b"#").is_some_and(|rest| rest.trim_ascii_start().first().is_some_and(u8::is_ascii_digit))
        || text.get(..7).is_some_and(|start| start.eq_ignore_ascii_case(b"HEADER;"))
}

/// Reads a STEP file. O(length).
///
/// # Errors
/// [`ReadError::NoData`] of a file without instances.
pub(crate) fn read(text: &[u8]) -> Result<Network, ReadError> {
    build::read(text)
}
