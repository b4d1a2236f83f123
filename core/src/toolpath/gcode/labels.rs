//! Where the O-words and program numbers of a file are.

use super::clean::Line;
use super::expression;
use super::fault::{Fault, syntax};
use super::number::Cursor;
use super::parameters::Parameters;
use crate::toolpath::lines::Place;
use std::cell::Cell;
use std::collections::BTreeMap;

/// The action of an O-word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Word {
    Sub,
    EndSub,
    Call,
    Return,
    If,
    ElseIf,
    Else,
    EndIf,
    While,
    EndWhile,
    Do,
    Repeat,
    EndRepeat,
    Break,
    Continue,
    /// A number alone: a program's, as Fanuc has it.
    Program,
}

/// Longer spellings before their beginnings.
const WORDS: [(&[u8], Word); 15] = [
    (b"sub", Word::Sub),
    (b"endsub", Word::EndSub),
    (b"call", Word::Call),
    (b"return", Word::Return),
    (b"if", Word::If),
    (b"elseif", Word::ElseIf),
    (b"else", Word::Else),
    (b"endif", Word::EndIf),
    (b"while", Word::While),
    (b"endwhile", Word::EndWhile),
    (b"do", Word::Do),
    (b"repeat", Word::Repeat),
    (b"endrepeat", Word::EndRepeat),
    (b"break", Word::Break),
    (b"continue", Word::Continue),
];

/// An O-word and where it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mark {
    pub(super) word: Word,
    /// Its line.
    pub(super) place: Place,
    /// The line behind it.
    pub(super) next: Place,
}

/// A label: digits without leading zeros, or `<name>`.
pub(super) type Label = Vec<u8>;

/// Reads a label and its word behind the `o`; the cursor stands at the arguments then.
pub(super) fn label(cursor: &mut Cursor<'_>, parameters: Option<&Parameters>) -> Result<(Label, Word), Fault> {
    let label = match (cursor.peek(), parameters) {
        (Some(b'<'), _) => {
            cursor.at += 1;
            [b"<", expression::name(cursor)?, b">"].concat()
        }
        (Some(b'0'..=b'9'), _) => {
            let digits = cursor.rest().iter().take_while(|byte| byte.is_ascii_digit()).count();
            let text = cursor.rest().get(..digits).unwrap_or_default();
            cursor.at += digits;
            let zeros = text.iter().take_while(|byte| **byte == b'0').count().min(digits.saturating_sub(1));
            text.get(zeros..).unwrap_or_default().to_vec()
        }
        (Some(b'#' | b'['), Some(parameters)) => format!("{}", expression::value(cursor, parameters)?.round()).into_bytes(),
        _ => return syntax("an O-word without a label"),
    };
    let found = WORDS.into_iter().find(|(word, _)| cursor.rest().starts_with(word));
    let Some((text, word)) = found else { return Ok((label, Word::Program)) };
    cursor.at += text.len();
    Ok((label, word))
}

/// All labels of a file.
#[derive(Debug, Default)]
pub(super) struct Labels {
    marks: BTreeMap<Label, Vec<Mark>>,
    /// Marks that were looked at since it was taken.
    pub(super) looked_at: Cell<u64>,
}

/// Whether an O-word stands behind a block number, as far as its first byte tells.
fn is_labelled(raw: &[u8]) -> bool {
    let mut rest = raw.trim_ascii_start();
    if let [b'/', behind @ ..] = rest {
        rest = behind.trim_ascii_start();
    }
    if let [b'n' | b'N', behind @ ..] = rest {
        let is_number = |byte: &&u8| byte.is_ascii_digit() || **byte == b' ' || **byte == b'.';
        rest = behind.get(behind.iter().take_while(is_number).count()..).unwrap_or_default();
    }
    matches!(rest, [b'o' | b'O' | b':', ..])
}

/// Goes past a slash, which is cleaned away already, and a block number.
pub(super) fn skip_number(cursor: &mut Cursor<'_>) {
    if let [b'n', b'0'..=b'9', ..] = cursor.rest() {
        cursor.at += 1;
        let _ = cursor.number();
    }
}

impl Labels {
    /// Finds them. O(length of the text).
    pub(super) fn of(text: &[u8]) -> Self {
        let mut labels = Self::default();
        let (mut place, mut line) = (Place::START, Line::default());
        while let Some((raw, next)) = place.next(text) {
            if is_labelled(raw) {
                line.set(raw, false);
                let mut cursor = Cursor::new(&line.code);
                skip_number(&mut cursor);
                if (cursor.eat(b"o") || cursor.eat(b":"))
                    && let Ok((label, word)) = label(&mut cursor, None)
                {
                    labels.marks.entry(label).or_default().push(Mark { word, place, next });
                }
            }
            place = next;
        }
        labels
    }

    /// The first mark of a label behind a place that is one of these words. O(log + those between).
    pub(super) fn after(&self, label: &[u8], at: Place, words: &[Word]) -> Option<Mark> {
        let marks = self.marks.get(label)?;
        let first = marks.partition_point(|mark| mark.place.at <= at.at);
        marks.get(first..)?.iter().find(|mark| self.is_one(mark, words)).copied()
    }

    /// The last mark of a label before a place that is one of these words.
    pub(super) fn before(&self, label: &[u8], at: Place, words: &[Word]) -> Option<Mark> {
        let marks = self.marks.get(label)?;
        let end = marks.partition_point(|mark| mark.place.at < at.at);
        marks.get(..end)?.iter().rev().find(|mark| self.is_one(mark, words)).copied()
    }

    fn is_one(&self, mark: &Mark, words: &[Word]) -> bool {
        self.looked_at.set(self.looked_at.get() + 1);
        words.contains(&mark.word)
    }

    /// Where a subprogram begins.
    pub(super) fn start(&self, label: &[u8]) -> Option<Mark> {
        self.marks.get(label)?.iter().find(|mark| self.is_one(mark, &[Word::Sub, Word::Program])).copied()
    }

    /// Whether words other than program numbers are used.
    pub(super) fn has_words(&self) -> bool {
        self.marks.values().flatten().any(|mark| mark.word != Word::Program)
    }

    /// Whether there are program numbers.
    pub(super) fn has_programs(&self) -> bool {
        self.marks.values().flatten().any(|mark| mark.word == Word::Program)
    }
}
