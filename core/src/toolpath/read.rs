//! A tool path, by its content.

use super::emit::Receiver;
use super::model::Move;
use super::moves::Moves;
use super::options::Options;
use super::program::{Header, Program, ReadError};
use super::{apt, gcode, tools};
use crate::util::legible::legible_bytes;
use std::ops::ControlFlow;

/// Reads a file, whatever of the formats it is. O(blocks executed); memory: see [`Moves`].
///
/// # Errors
/// [`ReadError`] if it is no tool path, or asks for something without which the path would be another one; smaller oddities are
/// findings.
pub fn read(bytes: &[u8], options: &Options) -> Result<Program, ReadError> {
    let mut moves = Moves::default();
    let header = stream(bytes, options, &mut |one| {
        moves.push(one);
        ControlFlow::Continue(())
    })?;
    Ok(Program { header, moves })
}

/// Reads a file and gives its moves one by one. O(blocks executed); memory does not grow with the moves.
///
/// # Errors
/// As for [`read`], after which the moves before are worth nothing; and [`ReadError::Stopped`] if the receiver breaks.
pub fn stream(bytes: &[u8], options: &Options, receiver: &mut dyn FnMut(&Move) -> ControlFlow<()>) -> Result<Header, ReadError> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let start = text.trim_ascii_start();
    let receiver: Receiver<'_> = receiver;
    if start.starts_with(b"{") {
        Err(ReadError::Project)
    } else if is_binary(text) {
        Err(unknown(start))
    } else if apt::is_apt(text) {
        apt::read(text, options, receiver)
    } else if tools::is_table(text) {
        Err(ReadError::ToolTable)
    } else if gcode::is_gcode(text) {
        gcode::read(text, options, receiver)
    } else {
        Err(unknown(start))
    }
}

fn unknown(start: &[u8]) -> ReadError {
    ReadError::Unknown(legible_bytes(start.get(..24).unwrap_or(start).trim_ascii_end()))
}

/// Whether a text is none; tapes may have a few zero bytes before their first block.
fn is_binary(text: &[u8]) -> bool {
    let start = text.get(..4096).unwrap_or(text);
    let strange = start.iter().filter(|byte| **byte < 9 || (14..32).contains(*byte)).count();
    strange * 20 > start.len() || start.trim_ascii_start().starts_with(b"solid")
}
