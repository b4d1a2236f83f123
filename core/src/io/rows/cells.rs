//! Single numbers of rows, as text or in binary.

use crate::io::read::elements::layout::Scalar;

/// How numbers stand in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    Text,
    /// In binary, the highest byte last.
    Little,
    /// In binary, the highest byte first.
    Big,
}

/// Takes numbers from a row, one after the other.
pub(super) struct Cells<'a> {
    form: Form,
    rest: &'a [u8],
}

impl<'a> Cells<'a> {
    /// Those of `row`.
    pub(super) fn of(form: Form, row: &'a [u8]) -> Self {
        Self { form, rest: row }
    }

    /// The next number.
    pub(super) fn next(&mut self, kind: Scalar) -> Option<f64> {
        if self.form == Form::Text {
            return number(self.word()?);
        }
        let (bytes, rest) = self.rest.split_at_checked(kind.bytes())?;
        self.rest = rest;
        let mut wide = [0; 8];
        let own = wide.get_mut(..bytes.len())?;
        own.copy_from_slice(bytes);
        if self.form == Form::Big {
            own.reverse();
        }
        let low = u64::from_le_bytes(wide);
        Some(match kind {
            Scalar::I8 => f64::from(low as u8 as i8),
            Scalar::U8 => f64::from(low as u8),
            Scalar::I16 => f64::from(low as u16 as i16),
            Scalar::U16 => f64::from(low as u16),
            Scalar::I32 => f64::from(low as u32 as i32),
            Scalar::U32 => f64::from(low as u32),
            Scalar::F32 => f64::from(f32::from_bits(low as u32)),
            Scalar::F64 => f64::from_bits(low),
        })
    }

    /// The next word of a text.
    pub(super) fn word(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest.trim_ascii_start();
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        let (word, rest) = rest.split_at_checked(length)?;
        self.rest = rest;
        (!word.is_empty()).then_some(word)
    }
}

/// A word as a number.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Writes a number of this type, rounded and bounded to what the type holds; in text with a blank behind it.
pub(super) fn put(form: Form, kind: Scalar, value: f64, out: &mut Vec<u8>) {
    if form == Form::Text {
        put_text(kind, value, out);
        out.push(b' ');
        return;
    }
    let from = out.len();
    // A conversion to whole numbers is bounded by their type.
    let whole = value.round();
    match kind {
        Scalar::I8 => out.extend((whole as i8).to_le_bytes()),
        Scalar::U8 => out.extend((whole as u8).to_le_bytes()),
        Scalar::I16 => out.extend((whole as i16).to_le_bytes()),
        Scalar::U16 => out.extend((whole as u16).to_le_bytes()),
        Scalar::I32 => out.extend((whole as i32).to_le_bytes()),
        Scalar::U32 => out.extend((whole as u32).to_le_bytes()),
        Scalar::F32 => out.extend((value as f32).to_le_bytes()),
        Scalar::F64 => out.extend(value.to_le_bytes()),
    }
    if let Some(own) = out.get_mut(from..).filter(|_| form == Form::Big) {
        own.reverse();
    }
}

/// Writes the shortest decimal that reads back as the same `f32`.
pub(super) fn put_decimal(value: f64, out: &mut Vec<u8>) {
    put_text(Scalar::F32, value, out);
}

fn put_text(kind: Scalar, value: f64, out: &mut Vec<u8>) {
    use std::io::Write;
    // Writing to a vector cannot fail.
    let _ = match kind {
        Scalar::F32 => write!(out, "{}", value as f32),
        Scalar::F64 => write!(out, "{value}"),
        Scalar::I8 => write!(out, "{}", value.round() as i8),
        Scalar::U8 => write!(out, "{}", value.round() as u8),
        Scalar::I16 => write!(out, "{}", value.round() as i16),
        Scalar::U16 => write!(out, "{}", value.round() as u16),
        Scalar::I32 => write!(out, "{}", value.round() as i32),
        Scalar::U32 => write!(out, "{}", value.round() as u32),
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_in_every_form() {
        for (kind, value) in [
            (Scalar::I8, -7.0),
            (Scalar::U8, 255.0),
            (Scalar::I16, -300.0),
            (Scalar::U16, 65_535.0),
            (Scalar::I32, -70_000.0),
            (Scalar::U32, 4_000_000_000.0),
            (Scalar::F32, 0.1_f32.into()),
            (Scalar::F64, 0.1),
        ] {
            for form in [Form::Text, Form::Little, Form::Big] {
                let mut row = Vec::new();
                put(form, kind, value, &mut row);
                put(form, Scalar::U8, 3.6, &mut row);
                let mut cells = Cells::of(form, &row);
                let back = cells.next(kind).unwrap();
                // In text, an `f32` stands as the shortest decimal that is nearest to it.
                let back = if kind == Scalar::F32 { f64::from(back as f32) } else { back };
                assert_eq!((back, cells.next(Scalar::U8), cells.next(Scalar::U8)), (value, Some(4.0), None), "{kind:?} {form:?}");
            }
        }
    }

    #[test]
    fn a_number_stays_within_its_type() {
        let mut row = Vec::new();
        put(Form::Text, Scalar::U8, 300.0, &mut row);
        put(Form::Text, Scalar::U8, -1.0, &mut row);
        assert_eq!(row, b"255 0 ");
    }
}
