//! APT part programs as far as they are cutter locations (CL data): what NX, Creo, CATIA and NCL write.
//!
//! **In:** text. **Out:** moves and a header. **Promise:** one pass, O(length). Geometry of APT sources (surfaces, macros, loops)
//! is refused by name.

mod cutter;
mod cycle;
mod drill;
mod motion;
mod reader;
mod statement;
#[cfg(test)]
mod tests;

use super::emit::Receiver;
use super::options::Options;
use super::program::{Header, ReadError};

/// Words that begin a file, and that no G-code has.
const WORDS: [&[u8]; 19] = [
    b"GOTO",
    b"FROM",
    b"CUTTER",
    b"PARTNO",
    b"MULTAX",
    b"LOADTL",
    b"FEDRAT",
    b"UNITS",
    b"TLDATA",
    b"TOOL PATH",
    b"SPINDL",
    b"MACHIN",
    b"GODLTA",
    b"RAPID",
    b"PPRINT",
    b"REMARK",
    b"MODE",
    b"TPRINT",
    b"$$->",
];

/// Whether a text is APT, by the first of its lines that tells. O(1): of 200 lines, at most.
pub(super) fn is_apt(text: &[u8]) -> bool {
    for line in text.split(|byte| matches!(byte, b'\n' | b'\r')).take(200) {
        let line = line.trim_ascii();
        let is_word = |word: &&[u8]| {
            line.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word))
                && !line.get(word.len()).is_some_and(|next| next.is_ascii_alphanumeric())
        };
        if let Some(word) = WORDS.iter().find(|word| is_word(word)) {
            let rest = line.get(word.len()..).unwrap_or_default().trim_ascii_start();
            // "GOTO 10" and "MODE 1" are no statements of APT.
            return !matches!(*word, b"GOTO" | b"FROM" | b"MODE" | b"GODLTA" | b"CUTTER") || rest.starts_with(b"/");
        }
        if matches!(line, [b'G' | b'g' | b'M' | b'm' | b'N' | b'n' | b'X' | b'x' | b'%', b'0'..=b'9', ..]) {
            return false;
        }
    }
    false
}

/// Reads a file.
pub(super) fn read(text: &[u8], options: &Options, receiver: Receiver<'_>) -> Result<Header, ReadError> {
    reader::Reader::new(options, receiver).run(text)
}
