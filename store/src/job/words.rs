//! Words for people, as they fit a record.

/// Longest reason kept, in bytes: lists and pages show no other, so that all that a report commonly says fits (of real files, 170 to 700 bytes).
pub const MAX_REASON: usize = 1000;

const CUT: &str = "…";

/// Cuts `text` to one line of at most [`MAX_REASON`] bytes, in characters that a record need not escape.
pub fn one_line(text: &str) -> String {
    let plain = |c: char| match c {
        '"' => '\'',
        '\\' => '/',
        c if c.is_control() => ' ',
        c => c,
    };
    let clean: String = text.chars().map(plain).collect();
    if clean.len() <= MAX_REASON {
        return clean;
    }
    // Whoever reads it sees that there was more.
    let room = clean.floor_char_boundary(MAX_REASON - CUT.len());
    clean.get(..room).unwrap_or_default().to_owned() + CUT
}
