//! IGES: curves, and the faces that they bound.
//!
//! **In:** the text of an IGES file, fixed or compressed. **Out:** its curves in space, trimmed surfaces as faces, instances of subfigures placed.
//! **Promise:** whatever is whole is read, whatever else is around it; what is not read is named with its line.
//!
//! Based on: *Initial Graphics Exchange Specification 5.3*, U.S. Product Data Association 1996; types of entities are called by their numbers
//! there.

mod arrays;
mod build;
mod cards;
mod compressed;
mod directory;
mod faces;
mod global;
mod names;
mod offsets;
mod parameters;
mod places;
mod relations;
mod shapes;
mod surfaces;
#[cfg(test)]
mod tests;
mod told;

use crate::curves::collect::Collector;
use crate::curves::network::{Network, ReadError};

/// Whether a file looks like IGES.
#[must_use]
pub(crate) fn is_iges(text: &[u8]) -> bool {
    cards::is_iges(text)
}

/// Reads an IGES file. O(length · log length).
///
/// # Errors
/// [`ReadError`] of a binary file, and of one without a directory.
pub(crate) fn read(text: &[u8]) -> Result<Network, ReadError> {
    let mut collector = Collector::new(text.len());
    let findings = &mut collector.findings;
    let sections = cards::Sections::of(text, findings);
    if sections.is_binary {
        return Err(ReadError::Binary);
    }
    let global = global::Global::of(&sections.global, findings);
    let mut directory = directory::Directory::of(&sections, global.delimiters, findings);
    if sections.is_compressed {
        compressed::read(&sections.data, global.delimiters, &mut directory, findings);
    }
    if directory.entries.is_empty() {
        return Err(ReadError::NoDirectory("it has no entity"));
    }
    if !sections.is_complete {
        findings.add(0, "the file has no end; it may be cut off", "");
    }
    Ok(build::Builder::new(&directory, collector, text.len()).network(global))
}
