//! Subprograms, conditions and loops.

use super::calls::Call;
use super::expression;
use super::fault::{Fault, refused};
use super::interpreter::Interpreter;
use super::labels::{self, Label, Word};
use super::number::Cursor;
use crate::toolpath::lines::Place;
use crate::util::legible::legible_bytes;
use std::collections::BTreeMap;

/// Calls within calls, at most.
const DEEPEST: usize = 100;
/// Arguments of a call, at most.
const ARGUMENTS_MOST: usize = 30;

fn shown(label: &[u8]) -> String {
    format!("O{}", legible_bytes(label))
}

impl Interpreter<'_> {
    /// Executes an O-word; the cursor stands at its arguments.
    pub(super) fn o_word(&mut self, label: Label, word: Word, cursor: &mut Cursor<'_>, here: Place) -> Result<(), Fault> {
        match word {
            Word::Program => Ok(()),
            Word::Sub => self.jump(&label, here, &[Word::EndSub], word).map(drop),
            Word::EndSub | Word::Return => {
                let value = self.argument(cursor)?;
                self.leave(value)
            }
            Word::Call => self.call(&label, cursor),
            Word::If => self.choose(&label, cursor, here),
            Word::ElseIf | Word::Else => self.jump(&label, here, &[Word::EndIf], word).map(drop),
            Word::EndIf | Word::Do => Ok(()),
            Word::While => self.while_word(&label, cursor, here),
            Word::EndWhile => match self.flow.labels.before(&label, here, &[Word::While]) {
                Some(mark) => {
                    self.flow.next = mark.place;
                    Ok(())
                }
                None => refused(format!("{} endwhile without its while", shown(&label))),
            },
            Word::Repeat => self.repeat(label, cursor, here),
            Word::EndRepeat => self.end_repeat(&label, here),
            Word::Break | Word::Continue => self.escape(&label, here, word),
        }
    }

    /// A value in brackets, if there is one.
    fn argument(&self, cursor: &mut Cursor<'_>) -> Result<Option<f64>, Fault> {
        if cursor.peek() == Some(b'[') { expression::value(cursor, &self.parameters).map(Some) } else { Ok(None) }
    }

    fn condition(&self, cursor: &mut Cursor<'_>) -> Result<bool, Fault> {
        match self.argument(cursor)? {
            Some(value) => Ok(value != 0.0),
            None => refused("a condition is missing"),
        }
    }

    /// Goes behind the next of these words of a label; gives which one.
    fn jump(&mut self, label: &[u8], here: Place, to: &[Word], from: Word) -> Result<(Word, Place), Fault> {
        match self.flow.labels.after(label, here, to) {
            Some(mark) => {
                self.flow.next = mark.next;
                Ok((mark.word, mark.place))
            }
            None => refused(format!("{} {from:?} has no end", shown(label))),
        }
    }

    fn choose(&mut self, label: &[u8], cursor: &mut Cursor<'_>, here: Place) -> Result<(), Fault> {
        let mut is_true = self.condition(cursor)?;
        let mut at = here;
        while !is_true {
            let (word, place) = self.jump(label, at, &[Word::ElseIf, Word::Else, Word::EndIf], Word::If)?;
            if word != Word::ElseIf {
                break;
            }
            at = place;
            self.flow_line.set(place.next(self.text).map_or(&b""[..], |(raw, _)| raw), self.signs.has_brackets);
            let line = std::mem::take(&mut self.flow_line);
            let mut cursor = Cursor::new(&line.code);
            labels::skip_number(&mut cursor);
            cursor.at += 1;
            let value = labels::label(&mut cursor, Some(&self.parameters)).and_then(|_| self.condition(&mut cursor));
            self.flow_line = line;
            is_true = value?;
        }
        Ok(())
    }

    fn while_word(&mut self, label: &[u8], cursor: &mut Cursor<'_>, here: Place) -> Result<(), Fault> {
        let is_true = self.condition(cursor)?;
        let before = self.flow.labels.before(label, here, &[Word::Do, Word::While, Word::EndWhile]);
        if let Some(mark) = before.filter(|mark| mark.word == Word::Do) {
            if is_true {
                self.flow.next = mark.next;
            }
            return Ok(());
        }
        if is_true { Ok(()) } else { self.jump(label, here, &[Word::EndWhile], Word::While).map(drop) }
    }

    fn repeat(&mut self, label: Label, cursor: &mut Cursor<'_>, here: Place) -> Result<(), Fault> {
        let Some(times) = self.argument(cursor)? else { return refused("REPEAT without a number") };
        if times.round() < 1.0 {
            return self.jump(&label, here, &[Word::EndRepeat], Word::Repeat).map(drop);
        }
        if self.flow.repeats.len() >= DEEPEST {
            return refused("more than 100 REPEATs within each other");
        }
        self.flow.repeats.push((label, times.round() as u64));
        Ok(())
    }

    fn end_repeat(&mut self, label: &[u8], here: Place) -> Result<(), Fault> {
        let outside = self.flow.calls.last().map_or(0, |call| call.repeats);
        while self.flow.repeats.len() > outside {
            let Some((own, left)) = self.flow.repeats.last_mut() else { break };
            if own == label {
                *left -= 1;
                if *left == 0 {
                    self.flow.repeats.pop();
                } else if let Some(mark) = self.flow.labels.before(label, here, &[Word::Repeat]) {
                    self.flow.next = mark.next;
                }
                return Ok(());
            }
            self.flow.repeats.pop();
        }
        refused(format!("{} endrepeat without its repeat", shown(label)))
    }

    fn escape(&mut self, label: &[u8], here: Place, word: Word) -> Result<(), Fault> {
        let before = self.flow.labels.before(label, here, &[Word::Do, Word::While, Word::Repeat]);
        // The end of DO is a WHILE.
        let is_do = before.is_some_and(|mark| mark.word == Word::Do);
        let ends = if is_do { &[Word::While][..] } else { &[Word::EndWhile, Word::EndRepeat] };
        let (end, place) = self.jump(label, here, ends, word)?;
        if word == Word::Continue {
            self.flow.next = place;
        } else if end == Word::EndRepeat {
            while self.flow.repeats.pop().is_some_and(|(own, _)| own != label) {}
        }
        Ok(())
    }

    fn call(&mut self, label: &[u8], cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let mut arguments = Vec::new();
        while let Some(value) = self.argument(cursor)? {
            if arguments.len() == ARGUMENTS_MOST {
                return refused("more than 30 arguments");
            }
            arguments.push(value);
        }
        let Some(mark) = self.flow.labels.start(label) else {
            return refused(format!("{} is called, which is not in this file", shown(label)));
        };
        self.enter(Call { back: self.flow.next, repeats: self.flow.repeats.len(), again: None })?;
        self.parameters.enter(&arguments);
        self.flow.next = mark.next;
        Ok(())
    }

    fn enter(&mut self, call: Call) -> Result<(), Fault> {
        if self.flow.calls.len() >= DEEPEST {
            return refused("more than 100 calls within each other (a recursion without an end?)");
        }
        self.flow.calls.push(call);
        Ok(())
    }

    fn leave(&mut self, value: Option<f64>) -> Result<(), Fault> {
        self.parameters.returned = value;
        let Some(call) = self.flow.calls.pop() else {
            return refused("a subprogram ends that was not called");
        };
        self.flow.repeats.truncate(call.repeats);
        self.parameters.leave(call.again.is_some());
        self.flow.next = call.back;
        Ok(())
    }

    /// `M98`: calls a program by its number, `times` times.
    pub(super) fn call_program(&mut self, number: f64, times: f64) -> Result<(), Fault> {
        let label = |number: f64| format!("{}", number.round()).into_bytes();
        let mut found = self.flow.labels.start(&label(number));
        let mut times = times;
        // Old controls write the repetitions before the last four digits.
        if found.is_none() && number >= 10_000.0 {
            found = self.flow.labels.start(&label(number % 10_000.0));
            times = (number / 10_000.0).floor();
        }
        let Some(mark) = found else { return refused(format!("M98 calls O{number}, which is not in this file")) };
        self.call_place(mark.next, times)
    }

    /// `M97`: calls the lines from a block number on.
    pub(super) fn call_block(&mut self, number: f64, times: f64) -> Result<(), Fault> {
        let numbers = self.flow.numbers.take().unwrap_or_else(|| block_numbers(self.text));
        let place = numbers.get(&(number.round().max(0.0) as u64)).copied();
        self.flow.numbers = Some(numbers);
        match place {
            Some(place) => self.call_place(place, times),
            None => refused(format!("M97 calls N{number}, which is not in this file")),
        }
    }

    fn call_place(&mut self, place: Place, times: f64) -> Result<(), Fault> {
        if times.round() < 1.0 {
            return Ok(());
        }
        let again = Some((place, times.round() as u64 - 1));
        self.enter(Call { back: self.flow.next, repeats: self.flow.repeats.len(), again })?;
        self.parameters.share();
        self.flow.next = place;
        Ok(())
    }

    /// `M99`: back to the caller, or once more; whether there is a caller.
    pub(super) fn return_program(&mut self) -> Result<bool, Fault> {
        if self.flow.calls.is_empty() {
            return Ok(false);
        }
        if let Some(Call { again: Some((place, left)), .. }) = self.flow.calls.last_mut()
            && *left > 0
        {
            *left -= 1;
            self.flow.next = *place;
            return Ok(true);
        }
        self.leave(None).map(|()| true)
    }
}

/// Where each block number is first. O(length of the text).
fn block_numbers(text: &[u8]) -> BTreeMap<u64, Place> {
    let (mut numbers, mut place) = (BTreeMap::new(), Place::START);
    while let Some((raw, next)) = place.next(text) {
        if let [b'n' | b'N', rest @ ..] = raw.trim_ascii_start() {
            let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
            let number = rest.get(..digits).and_then(|digits| std::str::from_utf8(digits).ok()?.parse().ok());
            number.map(|number| numbers.entry(number).or_insert(place));
        }
        place = next;
    }
    numbers
}
