//! A file of curves, by its content.

use super::network::{Network, ReadError};
use super::{iges, json, step};
use crate::util::legible::legible_bytes;

/// Reads a file, whatever of the three formats it is. O(length of the file).
///
/// # Errors
/// [`ReadError`] if nothing of it can be read; what is damaged in part is named among the findings.
pub fn read(bytes: &[u8]) -> Result<Network, ReadError> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let start = text.trim_ascii_start();
    if step::is_step(start) {
        step::read(text)
    } else if start.starts_with(b"{") {
        json::read(start)
    } else if iges::is_iges(text) {
        iges::read(text)
    } else {
        Err(ReadError::Unknown(legible_bytes(start.get(..24).unwrap_or(start).trim_ascii_end())))
    }
}
