//! Lines of an IGES file, sorted into its sections.
//!
//! A card is a line of 80 columns: data in 1 to 72, the letter of the section in 73, the number within the section in 74 to 80. Files
//! that lost their trailing blanks, columns or ends of lines are read as far as it is clear what belongs where.

use memchr::memchr_iter;

use crate::curves::finding::Findings;
use crate::util::legible::legible_bytes;

/// A line and what is known of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Card<'a> {
    /// Columns before the letter of the section, 72 at most.
    pub(super) data: &'a [u8],
    /// Line in the file.
    pub(super) line: u64,
    /// Number within the section; 0 if it has none.
    pub(super) number: u32,
    /// Whether the letter stands in column 73.
    pub(super) is_aligned: bool,
}

/// Cards of each section, and the rest of a compressed file.
#[derive(Debug, Default)]
pub(super) struct Sections<'a> {
    pub(super) global: Vec<Card<'a>>,
    pub(super) directory: Vec<Card<'a>>,
    pub(super) parameters: Vec<Card<'a>>,
    /// Whether a card of the section C says that directory and parameters follow in one.
    pub(super) is_compressed: bool,
    /// Lines of a compressed file behind its global section.
    pub(super) data: Vec<Card<'a>>,
    /// Whether the last section is there.
    pub(super) is_complete: bool,
    /// Whether it is of the binary form.
    pub(super) is_binary: bool,
}

/// Columns of data.
pub(super) const WIDTH: usize = 72;

impl<'a> Sections<'a> {
    /// Sorts the lines of a file. O(length).
    pub(super) fn of(text: &'a [u8], findings: &mut Findings) -> Self {
        let mut sections = Self::default();
        let mut current = b'S';
        for (number, line) in lines(text).enumerate() {
            let line_number = number as u64 + 1;
            if line.iter().all(u8::is_ascii_whitespace) {
                continue;
            }
            let (section, card) = card(line, line_number);
            if number == 0 && section == Some(b'B') {
                sections.is_binary = true;
            }
            let in_data =
                sections.is_compressed && matches!(current, b'G' | b'Z') && !matches!(section, Some(b'G' | b'S' | b'T'));
            if in_data {
                current = b'Z';
                let data = line.trim_ascii_end();
                sections.data.push(Card { data, ..card });
                continue;
            }
            match section {
                Some(section) => current = section,
                None if current == b'S' => {}
                None => {
                    findings.add(line_number, "a line without the letter of its section", legible_bytes(line.trim_ascii_end()))
                }
            }
            sections.take(current, card);
        }
        sections
    }

    fn take(&mut self, section: u8, card: Card<'a>) {
        match section {
            b'C' => self.is_compressed = true,
            b'G' => self.global.push(card),
            b'D' => self.directory.push(card),
            b'P' => self.parameters.push(card),
            b'T' => self.is_complete = true,
            _ => {}
        }
    }
}

/// Whether a file looks like IGES: one of its first lines is a card of the first sections.
pub(super) fn is_iges(text: &[u8]) -> bool {
    let first = |line: &&[u8]| !line.iter().all(u8::is_ascii_whitespace);
    let mut seen = lines(text).filter(first).take(64).map(|line| card(line.get(..512).unwrap_or(line), 0));
    seen.any(|(section, card)| matches!(section, Some(b'S' | b'G' | b'C' | b'B' | b'D')) && (card.is_aligned || card.number > 0))
}

/// Lines without their ends, which are of any system; records of 80 bytes, if there are no ends of lines.
fn lines(text: &[u8]) -> Box<dyn Iterator<Item = &[u8]> + '_> {
    let end = if memchr::memchr(b'\n', text).is_some() {
        b'\n'
    } else if memchr::memchr(b'\r', text).is_some() {
        b'\r'
    } else if text.len() > 160 {
        return Box::new(text.chunks(80));
    } else {
        b'\n'
    };
    let mut from = 0;
    let ends = memchr_iter(end, text).chain(std::iter::once(text.len()));
    Box::new(ends.map(move |to| {
        let line = text.get(from..to).unwrap_or_default();
        from = to + 1;
        line.strip_suffix(b"\r").unwrap_or(line)
    }))
}

fn letter(byte: u8) -> Option<u8> {
    let upper = byte.to_ascii_uppercase();
    matches!(upper, b'S' | b'G' | b'D' | b'P' | b'T' | b'C' | b'B').then_some(upper)
}

/// The section of a line, by column 73 or, where columns are missing, by the letter and number at its end.
fn card(line: &[u8], number: u64) -> (Option<u8>, Card<'_>) {
    if let (Some(data), Some(section)) = (line.get(..WIDTH), line.get(WIDTH).and_then(|byte| letter(*byte))) {
        let rest = line.get(WIDTH + 1..).unwrap_or_default().trim_ascii();
        if rest.iter().all(u8::is_ascii_digit) {
            return (Some(section), Card { data, line: number, number: digits(rest), is_aligned: true });
        }
    }
    let trimmed = line.trim_ascii_end();
    let count = trimmed.iter().rev().take_while(|byte| byte.is_ascii_digit()).count();
    let before = trimmed.get(..trimmed.len() - count).unwrap_or_default();
    let data = before.trim_ascii_end();
    if let (1..=7, Some((last, data))) = (count, data.split_last()) {
        // A letter behind a number or a blank: no word of the data ends like this.
        let is_apart = data.last().is_none_or(|byte| *byte == b' ' || byte.is_ascii_digit()) && !data.is_empty();
        if let (Some(section), true) = (letter(*last), is_apart) {
            let number_in_section = digits(trimmed.get(before.len()..).unwrap_or_default());
            let data = data.get(..WIDTH).unwrap_or(data);
            return (Some(section), Card { data, line: number, number: number_in_section, is_aligned: false });
        }
    }
    (None, Card { data: line.get(..WIDTH).unwrap_or(line), line: number, number: 0, is_aligned: true })
}

/// A number of digits; 0 if it is too large, too.
pub(super) fn digits(text: &[u8]) -> u32 {
    std::str::from_utf8(text).ok().and_then(|text| text.parse().ok()).unwrap_or(0)
}
