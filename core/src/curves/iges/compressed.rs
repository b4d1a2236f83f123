//! The compressed form: directory and parameters of each entity one behind the other (IGES 5.3, section 2.3).
//!
//! An entity is `D` with its number, then `@field_value` for each field of its directory entry that is not that of the entity before, then
//! its parameters, which end with the record's delimiter.

use super::cards::{Card, digits};
use super::directory::{Directory, entry_of_fields};
use super::parameters::{Delimiters, Parameters};
use crate::curves::finding::Findings;
use crate::util::legible::legible_bytes;

/// Reads all entities of the lines behind the global section. O(length).
pub(super) fn read(cards: &[Card<'_>], delimiters: Delimiters, directory: &mut Directory<'_>, findings: &mut Findings) {
    let mut fields: [Vec<u8>; 21] = Default::default();
    let mut at = 0;
    while let Some(card) = cards.get(at) {
        let Some((number, rest)) = start(card.data) else {
            findings.add(card.line, "a line belongs to no entity", legible_bytes(card.data));
            at += 1;
            continue;
        };
        // Everything up to the next line that begins an entity, as one text.
        let mut text = rest.to_vec();
        at += 1;
        while let Some(next) = cards.get(at).filter(|next| start(next.data).is_none()) {
            text.extend_from_slice(next.data);
            at += 1;
        }
        let head = head(&text, &mut fields);
        let entry = entry_of_fields(number, card.line, &fields);
        directory.add(entry, findings);
        let parameters = text.get(head..).unwrap_or_default().trim_ascii_start();
        if !Parameters::of(parameters, delimiters).is_complete {
            findings.add(card.line, "an entity without an end", format!("D{number}"));
        }
        directory.add_text(number, parameters.to_vec());
    }
}

/// The number of an entity that begins on a line, and what follows.
fn start(line: &[u8]) -> Option<(u32, &[u8])> {
    let rest = line.strip_prefix(b"D").or_else(|| line.strip_prefix(b"d"))?.trim_ascii_start();
    let count = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let (number, rest) = rest.split_at_checked(count).filter(|_| count > 0)?;
    let is_start = matches!(rest.trim_ascii_start().first(), Some(b'@' | b';') | None);
    is_start.then(|| (digits(number), rest))
}

/// Takes over the fields that are given; gives the bytes that they take.
fn head(text: &[u8], fields: &mut [Vec<u8>; 21]) -> usize {
    let mut at = 0;
    loop {
        let rest = text.get(at..).unwrap_or_default();
        let blanks = rest.len() - rest.trim_ascii_start().len();
        let rest = rest.get(blanks..).unwrap_or_default();
        let Some(field) = rest.strip_prefix(b"@") else {
            return at + blanks + usize::from(rest.first() == Some(&b';'));
        };
        let count = field.iter().take_while(|byte| byte.is_ascii_digit()).count();
        let value = field.get(count + 1..).unwrap_or_default();
        // A value ends before the next field, or the end of the entry. The last one of an entry without an end is followed by the
        // parameters, which a blank sets apart.
        let length = value.iter().position(|byte| matches!(byte, b'@' | b';' | b' ')).unwrap_or(value.len());
        let number = digits(field.get(..count).unwrap_or_default()) as usize;
        if let (Some(to), Some(value)) = (fields.get_mut(number), value.get(..length)) {
            *to = value.to_vec();
        }
        at += blanks + 1 + (count + 1).min(field.len()) + length;
    }
}
