//! Words for people, as they fit a record.

/// Longest reason kept, in bytes.
pub const MAX_REASON: usize = 200;

/// Cuts `text` to one line of at most [`MAX_REASON`] bytes, in characters that a record need not escape.
pub fn one_line(text: &str) -> String {
    let plain = |c: char| match c {
        '"' => '\'',
        '\\' => '/',
        c if c.is_control() => ' ',
        c => c,
    };
    let clean: String = text.chars().map(plain).collect();
    clean.get(..clean.floor_char_boundary(MAX_REASON)).unwrap_or_default().to_owned()
}
