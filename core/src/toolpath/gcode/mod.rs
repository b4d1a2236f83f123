//! G-code (RS-274/NGC, ISO 6983) in the dialects of LinuxCNC, Fanuc, Haas, Mach, GRBL and Marlin.
//!
//! **In:** text. **Out:** moves and a header. **Promise:** time bounded by the blocks executed: each line of the file once, and
//! those of loops and subprograms up to [`super::Options::steps_max`]; calls go 100 deep, brackets 64.

mod arc;
mod block;
mod calls;
mod clean;
mod cycle;
mod data;
mod execute;
mod expression;
mod fault;
mod flow;
mod interpreter;
mod labels;
mod machine;
mod memory;
mod motion;
mod number;
mod offset_curve;
mod offset_path;
mod parameters;
mod plan;
mod remark;
mod signs;
mod spline;
#[cfg(test)]
mod tests;
mod toolbook;

use super::emit::Receiver;
use super::options::Options;
use super::program::{Header, ReadError};

/// Whether a text has lines of G-code at its beginning. O(1): of 64 KiB, at most.
pub(super) fn is_gcode(text: &[u8]) -> bool {
    let (mut place, mut line) = (super::lines::Place::START, clean::Line::default());
    let text = text.get(..1 << 16).unwrap_or(text);
    let has_brackets = text.trim_ascii_start().starts_with(b"[");
    while let Some((raw, next)) = place.next(text) {
        line.set(raw, has_brackets);
        let code = line.code.as_slice();
        if matches!(code, [letter, b'0'..=b'9' | b'-' | b'.' | b'#' | b'[' | b'<', ..] if b"gmxyzntosf#o/".contains(letter))
            || matches!(code, [b'#', ..])
        {
            return true;
        }
        place = next;
    }
    false
}

/// Reads a program.
pub(super) fn read(text: &[u8], options: &Options, receiver: Receiver<'_>) -> Result<Header, ReadError> {
    interpreter::Interpreter::new(text, options, receiver).run()
}
