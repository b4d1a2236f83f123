//! A line without spaces, comments and capitals.

/// A line, taken apart. Buffers are kept from line to line.
#[derive(Debug, Default)]
pub(super) struct Line {
    /// The code to be executed: lower case, no spaces.
    pub(super) code: Vec<u8>,
    /// Comments in their order, without their brackets.
    pub(super) comments: Vec<Vec<u8>>,
    /// Whether it begins with a slash.
    pub(super) is_optional: bool,
    /// Whether a comment has no end.
    pub(super) is_open: bool,
    /// Exclusive or of all bytes before the first asterisk.
    pub(super) checksum: u8,
}

impl Line {
    /// Takes a line apart. O(length).
    ///
    /// `brackets` says that square brackets are comments, as in WinCNC.
    pub(super) fn set(&mut self, raw: &[u8], brackets: bool) {
        self.code.clear();
        self.comments.clear();
        (self.is_open, self.is_optional) = (false, false);
        let mut at = 0;
        while let Some(&byte) = raw.get(at) {
            at += 1;
            match byte {
                b' ' | b'\t' | b'\r' | 0 | 0x0b | 0x0c => {}
                b'(' => at = self.comment(raw, at, b'(', b')'),
                b'[' if brackets => at = self.comment(raw, at, b'[', b']'),
                b';' => {
                    self.comments.push(raw.get(at..).unwrap_or_default().trim_ascii().to_vec());
                    break;
                }
                b'/' if self.code.is_empty() => self.is_optional = true,
                b'*' if !self.code.contains(&b'*') => {
                    self.checksum = raw.get(..at - 1).unwrap_or_default().iter().fold(0, |sum, byte| sum ^ byte);
                    self.code.push(byte);
                }
                _ => self.code.push(byte.to_ascii_lowercase()),
            }
        }
    }

    /// Takes a comment from behind its opening bracket; gives where it ends. Brackets in it that match belong to it.
    fn comment(&mut self, raw: &[u8], from: usize, open: u8, close: u8) -> usize {
        let rest = raw.get(from..).unwrap_or_default();
        let (mut depth, mut first) = (1, None);
        for (index, byte) in rest.iter().enumerate() {
            if *byte == close {
                first = first.or(Some(index));
                depth -= 1;
            } else if *byte == open {
                depth += 1;
            }
            if depth == 0 {
                first = Some(index);
                break;
            }
        }
        let end = first.unwrap_or(rest.len());
        self.is_open |= first.is_none();
        self.comments.push(rest.get(..end).unwrap_or_default().trim_ascii().to_vec());
        from + end + usize::from(first.is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(raw: &str, brackets: bool) -> (String, Vec<String>) {
        let mut line = Line::default();
        line.set(raw.as_bytes(), brackets);
        let words = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (words(&line.code), line.comments.iter().map(|comment| words(comment)).collect())
    }

    #[test]
    fn comments_and_spaces_go() {
        assert_eq!(line("N1 G 0 1X1.(a) y[#1 + 2] ; b (c", false), ("n1g01x1.y[#1+2]".into(), vec!["a".into(), "b (c".into()]));
        assert_eq!(line("M6 (TOOL (3) X) T3", false), ("m6t3".into(), vec!["TOOL (3) X".into()]));
        assert_eq!(line("(a ( b) G1", false), ("g1".into(), vec!["a ( b".into()]));
        assert_eq!(line("M5 [SPINDLE OFF]", true), ("m5".into(), vec!["SPINDLE OFF".into()]));
        assert_eq!(line("G1 (never closed", false), ("g1".into(), vec!["never closed".into()]));
    }
}
