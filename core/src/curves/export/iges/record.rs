//! Values in free format on lines of a width.

use std::io;

use crate::curves::export::number;

/// Lays out the values of a record: `,` between them, `;` behind the last; no number is divided between two lines, only strings
/// that are longer than one.
pub(super) struct Record<F> {
    width: usize,
    line: String,
    pending: Option<String>,
    lines: usize,
    emit: F,
}

impl<F: FnMut(&str) -> io::Result<()>> Record<F> {
    /// Lines are given to `emit` without blanks at their ends.
    pub(super) fn new(width: usize, emit: F) -> Self {
        Self { width, line: String::with_capacity(width), pending: None, lines: 0, emit }
    }

    /// Appends a value as it is.
    pub(super) fn word(&mut self, word: String) -> io::Result<()> {
        match self.pending.replace(word) {
            Some(before) => self.put(before, ','),
            None => Ok(()),
        }
    }

    /// Appends a whole number.
    pub(super) fn integer(&mut self, value: usize) -> io::Result<()> {
        self.word(value.to_string())
    }

    /// Appends a real number.
    pub(super) fn real(&mut self, value: f64) -> io::Result<()> {
        let mut text = String::with_capacity(26);
        number::real(&mut text, value, 'D');
        self.word(text)
    }

    /// Appends real numbers.
    pub(super) fn reals(&mut self, values: impl IntoIterator<Item = f64>) -> io::Result<()> {
        values.into_iter().try_for_each(|value| self.real(value))
    }

    /// Ends the record; gives the number of its lines.
    pub(super) fn finish(mut self) -> io::Result<usize> {
        let last = self.pending.take().unwrap_or_default();
        self.put(last, ';')?;
        self.flush()?;
        Ok(self.lines)
    }

    fn put(&mut self, mut word: String, delimiter: char) -> io::Result<()> {
        word.push(delimiter);
        if self.line.len() + word.len() > self.width && word.len() <= self.width {
            self.flush()?;
        }
        // All of it is ASCII, so characters are columns.
        for character in word.chars() {
            if self.line.len() == self.width {
                self.flush()?;
            }
            self.line.push(character);
        }
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.lines += 1;
        (self.emit)(&self.line)?;
        self.line.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_never_divided() {
        let mut lines = Vec::new();
        let mut record = Record::new(10, |line| {
            lines.push(line.to_owned());
            Ok(())
        });
        record.integer(128).unwrap();
        record.reals([1.0, 0.125, -3.0]).unwrap();
        record.word("12Hlong as life".into()).unwrap();
        assert_eq!(record.finish().unwrap(), 4);
        assert_eq!(lines, ["128,1.,", "0.125,-3.,", "12Hlong as", " life;"]);
    }
}
