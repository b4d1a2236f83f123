//! Words of a line.

use super::expression::{self, number_of};
use super::fault::{Fault, refused, syntax};
use super::number::Cursor;
use super::parameters::Parameters;
use crate::util::legible::legible_bytes;

/// A parameter that a line sets.
#[derive(Clone, Debug, PartialEq)]
enum Target {
    Number(f64),
    Name(Vec<u8>),
}

/// Words of a line. Buffers are kept from line to line.
#[derive(Debug, Default)]
pub(super) struct Block {
    mask: u32,
    values: [f64; 29],
    /// Letters without a number.
    pub(super) bare: u32,
    /// Letters whose value only the machine knows.
    pub(super) unknown: u32,
    /// Letters that stand twice.
    pub(super) twice: u32,
    /// G-codes in tenths, in their order.
    pub(super) g: Vec<u16>,
    /// M-codes.
    pub(super) m: Vec<u16>,
    /// The checksum at its end.
    pub(super) checksum: Option<f64>,
    sets: Vec<(Target, f64)>,
}

/// Codes of a kind on a line, at most.
const CODES_MOST: usize = 32;

/// The number of a letter: `a` to `z`, then `@`, `^` and `$`.
fn number(letter: u8) -> Option<usize> {
    match letter {
        b'a'..=b'z' => Some(usize::from(letter - b'a')),
        b'@' => Some(26),
        b'^' => Some(27),
        b'$' => Some(28),
        _ => None,
    }
}

/// The bit of a letter in [`Block::bare`].
pub(super) fn bit(letter: u8) -> u32 {
    number(letter).map_or(0, |number| 1 << number)
}

impl Block {
    /// The value of a word.
    pub(super) fn get(&self, letter: u8) -> Option<f64> {
        let number = number(letter)?;
        (self.mask >> number & 1 == 1).then(|| self.values[number])
    }

    /// Whether one of the words is there.
    pub(super) fn has_any(&self, letters: &[u8]) -> bool {
        letters.iter().any(|letter| self.mask & bit(*letter) != 0)
    }

    /// Whether nothing is to be done.
    pub(super) fn is_empty(&self) -> bool {
        self.mask == 0 && self.g.is_empty() && self.m.is_empty() && self.bare == 0
    }

    fn clear(&mut self) {
        (self.mask, self.bare, self.twice, self.unknown, self.checksum) = (0, 0, 0, 0, None);
        self.g.clear();
        self.m.clear();
        self.sets.clear();
    }

    /// Reads a line; parameters have their new values after all of it is read, as in the standard. O(length).
    pub(super) fn read(&mut self, cursor: &mut Cursor<'_>, parameters: &mut Parameters) -> Result<(), Fault> {
        self.clear();
        while let Some(letter) = cursor.peek() {
            cursor.at += 1;
            match letter {
                b'#' => self.set(cursor, parameters)?,
                b'*' => self.checksum = cursor.number(),
                // A closing bracket of a comment that has none to open it.
                b')' => {}
                b',' => return refused("a corner that is rounded or chamfered by a comma word (,R ,C) is not done"),
                _ => self.word(letter, cursor, parameters)?,
            }
        }
        for (target, value) in self.sets.drain(..) {
            match target {
                Target::Number(number) => parameters.set_numbered(number, value)?,
                Target::Name(name) => parameters.set_named(&name, value),
            }
        }
        Ok(())
    }

    fn word(&mut self, letter: u8, cursor: &mut Cursor<'_>, parameters: &Parameters) -> Result<(), Fault> {
        let Some(index) = number(letter) else {
            cursor.at -= 1;
            return syntax(format!("“{}” is no word", legible_bytes(cursor.rest())));
        };
        if !matches!(cursor.peek(), Some(b'0'..=b'9' | b'.' | b'-' | b'+' | b'[' | b'#')) && !is_function(cursor.rest()) {
            cursor.at -= 1;
            if [&b"if["[..], b"while[", b"goto"].into_iter().any(|word| cursor.rest().starts_with(word)) {
                return refused("IF, WHILE and GOTO of Fanuc's macros are not done");
            }
            cursor.at += 1;
            self.bare |= 1 << index;
            return Ok(());
        }
        // Feeds and speeds that only the machine knows do not change the path.
        if matches!(letter, b'f' | b's') && (cursor.rest().starts_with(b"#<_hal[") || cursor.rest().starts_with(b"#<_ini[")) {
            cursor.at += 2;
            expression::name(cursor)?;
            self.unknown |= 1 << index;
            return Ok(());
        }
        let value = expression::value(cursor, parameters)?;
        match letter {
            b'g' => return self.code(letter, value * 10.0),
            b'm' => return self.code(letter, value),
            _ => {}
        }
        if self.mask >> index & 1 == 1 {
            self.twice |= 1 << index;
        }
        self.mask |= 1 << index;
        self.values[index] = value;
        Ok(())
    }

    fn code(&mut self, letter: u8, value: f64) -> Result<(), Fault> {
        let whole = value.round();
        let list = if letter == b'g' { &mut self.g } else { &mut self.m };
        // Codes such as G43.14 do not exist; M-codes have no decimals.
        if (value - whole).abs() > 1e-3 || !(0.0..65_535.0).contains(&whole) || list.len() >= CODES_MOST {
            return syntax(format!("{} is no code", char::from(letter.to_ascii_uppercase())));
        }
        list.push(whole as u16);
        Ok(())
    }

    /// Reads a setting of a parameter behind its `#`.
    fn set(&mut self, cursor: &mut Cursor<'_>, parameters: &Parameters) -> Result<(), Fault> {
        let target = if cursor.eat(b"<") {
            Target::Name(expression::name(cursor)?.to_vec())
        } else {
            Target::Number(number_of(cursor, parameters, 0)?)
        };
        if !cursor.eat(b"=") {
            return syntax("a parameter stands alone");
        }
        let value = expression::value(cursor, parameters)?;
        // Fanuc's macros calculate without brackets: `#1 = #2 + 1`.
        if matches!(cursor.peek(), Some(b'+' | b'-' | b'/' | b'*')) {
            return refused("a calculation without brackets (Fanuc's macros) is not done");
        }
        self.sets.push((target, value));
        Ok(())
    }
}

/// Whether a function comes next; letters alone are words without numbers.
fn is_function(rest: &[u8]) -> bool {
    const NAMES: [&[u8]; 14] = [
        b"abs[", b"acos[", b"asin[", b"atan[", b"cos[", b"exists[", b"exp[", b"fix[", b"fup[", b"ln[", b"round[", b"sin[",
        b"sqrt[", b"tan[",
    ];
    NAMES.into_iter().any(|name| rest.starts_with(name))
}
