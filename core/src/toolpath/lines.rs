//! Lines of a text, whatever ends them.

/// Lines of a text with their numbers, forwards from anywhere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// Offset in bytes.
    pub(crate) at: usize,
    /// Number of the line that begins there, from 1.
    pub(crate) line: u64,
}

impl Place {
    pub(crate) const START: Self = Self { at: 0, line: 1 };

    /// The line that begins here, and the place of the next one; `None` at the end. O(length of the line).
    pub(crate) fn next(self, text: &[u8]) -> Option<(&[u8], Self)> {
        let rest = text.get(self.at..).filter(|rest| !rest.is_empty())?;
        let end = memchr::memchr2(b'\n', b'\r', rest).unwrap_or(rest.len());
        let line = rest.get(..end).unwrap_or(rest);
        // Old files end their lines with a carriage return alone.
        let feed = if rest.get(end..end + 2) == Some(b"\r\n") { 2 } else { 1 };
        Some((line, Self { at: self.at + end + feed, line: self.line + 1 }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_in_three_ways() {
        let (mut place, mut lines) = (Place::START, Vec::new());
        while let Some((line, next)) = place.next(b"a\r\nb\rc\n\nd") {
            lines.push((line, place.line));
            place = next;
        }
        assert_eq!(lines, [(&b"a"[..], 1), (b"b", 2), (b"c", 3), (b"", 4), (b"d", 5)]);
    }
}
