//! A brush: the triangles that a person painted, as a list of their numbers.
//!
//! Numbers count from 0 in the order of the file, apart by spaces, commas, line ends or square brackets, so that a list of JSON is a brush,
//! too. `7-12` is a range with both its ends. What follows `#` on a line is a comment.

/// Triangles by ranges of numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Brush {
    /// First and last; ascending, and none touches the next one.
    ranges: Vec<[u32; 2]>,
}

/// Why a text is no brush, or none of a mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BrushError {
    /// A word is no number and no range.
    #[error("line {line}: `{word}` is no number of a triangle (try 12, or 7-12)")]
    Word {
        /// Its line, from 1.
        line: usize,
        /// The word, shortened.
        word: String,
    },
    /// A text without numbers.
    #[error("it names no triangle")]
    Empty,
    /// The mesh has fewer triangles.
    #[error("it names triangle {number}, and the mesh has {triangles}, numbered from 0")]
    Beyond {
        /// The greatest number.
        number: u32,
        /// Triangles of the mesh.
        triangles: usize,
    },
}

impl Brush {
    /// Reads a brush. O(n log n) in the text.
    ///
    /// # Errors
    /// [`BrushError::Word`], [`BrushError::Empty`].
    pub fn parse(text: &[u8]) -> Result<Self, BrushError> {
        let mut ranges = Vec::new();
        for (line, number) in text.split(|byte| *byte == b'\n').zip(1..) {
            let said = line.split(|byte| *byte == b'#').next().unwrap_or_default();
            let is_between = |byte: &u8| byte.is_ascii_whitespace() || b",;[]".contains(byte);
            for word in said.split(is_between).filter(|word| !word.is_empty()) {
                let word = String::from_utf8_lossy(word);
                let bad = || BrushError::Word { line: number, word: word.chars().take(40).collect() };
                ranges.push(range(&word).ok_or_else(bad)?);
            }
        }
        ranges.sort_unstable();
        ranges.dedup_by(|next, one: &mut [u32; 2]| {
            let is_one = next[0] <= one[1].saturating_add(1);
            one[1] = if is_one { one[1].max(next[1]) } else { one[1] };
            is_one
        });
        if ranges.is_empty() { Err(BrushError::Empty) } else { Ok(Self { ranges }) }
    }

    /// For each of so many triangles, whether it is painted. O(triangles + ranges).
    ///
    /// # Errors
    /// [`BrushError::Beyond`].
    pub fn painted(&self, triangles: usize) -> Result<Vec<bool>, BrushError> {
        let number = self.ranges.last().map_or(0, |range| range[1]);
        let mut painted = vec![false; triangles];
        for [first, last] in &self.ranges {
            let places = painted.get_mut(*first as usize..=*last as usize).ok_or(BrushError::Beyond { number, triangles })?;
            places.fill(true);
        }
        Ok(painted)
    }
}

/// A number, or two with a dash between them.
fn range(word: &str) -> Option<[u32; 2]> {
    let (first, last) = word.split_once('-').unwrap_or((word, word));
    let number = |text: &str| text.parse::<u32>().ok().filter(|number| *number < u32::MAX && !text.starts_with('+'));
    let [first, last] = [number(first)?, number(last)?];
    (first <= last).then_some([first, last])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_ranges_comments_and_json_are_read() {
        let painted = |text: &str| Brush::parse(text.as_bytes()).and_then(|brush| brush.painted(8)).expect("a brush");
        let of = |numbers: &[usize]| (0..8).map(|n| numbers.contains(&n)).collect::<Vec<_>>();
        assert_eq!(painted("3 1\r\n5-6 # 7\n"), of(&[1, 3, 5, 6]));
        assert_eq!(painted("[0, 2,\n 2]"), of(&[0, 2]));
        assert_eq!(painted("4-7,0-5,1-2"), of(&[0, 1, 2, 3, 4, 5, 6, 7]));
        assert_eq!(painted("7"), of(&[7]));
    }

    #[test]
    fn what_is_no_brush_is_named() {
        let error = |text: &str| Brush::parse(text.as_bytes()).unwrap_err().to_string();
        assert_eq!(error("1\n2 x3"), "line 2: `x3` is no number of a triangle (try 12, or 7-12)");
        for word in ["-1", "1.5", "9-3", "3-", "+3", "4294967295", "99999999999"] {
            assert!(error(word).contains(word), "{word}");
        }
        assert_eq!(error("# nothing\n"), "it names no triangle");
        let brush = Brush::parse(b"2 8-9").unwrap();
        assert_eq!(brush.painted(9), Err(BrushError::Beyond { number: 9, triangles: 9 }));
        assert!(brush.painted(10).is_ok());
    }
}
