//! A file's own words for people: whatever steers a terminal or is not seen is spelled out.

/// Characters of a file's own words that are shown, at most.
const SHOWN: usize = 80;

/// A file's own words for people: control characters escaped, and cut to 80 characters.
pub(crate) fn legible(words: &str) -> String {
    escaped(words, SHOWN)
}

/// Up to so many characters, of which those are escaped that control something, turn the direction of text, or are not seen at all.
pub(crate) fn escaped(words: &str, most: usize) -> String {
    let mut text = String::new();
    for (count, character) in words.chars().enumerate() {
        if count == most {
            text.push('…');
            break;
        }
        match character {
            '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{2069}' | '\u{feff}' => {
                text.extend(character.escape_unicode());
            }
            _ if character.is_control() => text.extend(character.escape_default()),
            _ => text.push(character),
        }
    }
    text
}

/// All of a file's own words in one line, to be written into another file: blanks in place of control characters.
pub(crate) fn in_one_line(words: &str) -> String {
    words.chars().map(|character| if character.is_control() { ' ' } else { character }).collect()
}

/// As [`legible`], of bytes, which may be no UTF-8.
pub(crate) fn legible_bytes(words: &[u8]) -> String {
    let start = words.get(..4 * SHOWN + 4).unwrap_or(words);
    legible(&String::from_utf8_lossy(start))
}
