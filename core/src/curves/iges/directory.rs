//! Directory entries, and where the parameters of each stand.

use std::cell::Cell;
use std::collections::HashMap;

use super::cards::{Card, Sections, digits};
use super::parameters::{Delimiters, Parameters};
use crate::curves::finding::Findings;

/// What the directory says of an entity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    /// Number of its first line in the section: how others refer to it.
    pub(super) number: u32,
    pub(super) line: u64,
    /// Type.
    pub(super) kind: u32,
    pub(super) form: u32,
    /// Entry of the matrix that places it; 0 if none.
    pub(super) matrix: u32,
    pub(super) is_blanked: bool,
    /// 0 geometry, 1 annotation, 2 definition, 3 other, 4 logical, 5 in parameter space, 6 construction.
    pub(super) usage: u8,
    /// Up to 8 characters.
    label: [u8; 8],
    subscript: u32,
    /// First card of its parameters, and how many there are.
    first: u32,
    count: u32,
}

impl Entry {
    /// Its label, with the number that goes with it.
    pub(super) fn name(&self) -> Option<String> {
        let label = String::from_utf8_lossy(self.label.trim_ascii()).into_owned();
        match (label.is_empty(), self.subscript) {
            (true, _) => None,
            (false, 0) => Some(label),
            (false, subscript) => Some(format!("{label}({subscript})")),
        }
    }
}

/// All entries, and the cards of their parameters.
#[derive(Debug)]
pub(super) struct Directory<'a> {
    pub(super) entries: Vec<Entry>,
    by_number: HashMap<u32, usize>,
    /// By their numbers; card and entry that it belongs to.
    cards: Vec<(u32, Card<'a>)>,
    /// Places of cards by the entry that they name, for files whose pointers are wrong.
    by_owner: HashMap<u32, usize>,
    /// Parameters of a compressed file by entry.
    texts: HashMap<u32, Vec<u8>>,
    delimiters: Delimiters,
    /// Bytes of records that may still be read: damaged entries may all claim the same cards.
    room: Cell<usize>,
}

/// Columns of data on a card of parameters.
const WIDTH: usize = 64;

impl<'a> Directory<'a> {
    /// Sorts directory and parameters. O(cards · log cards).
    pub(super) fn of(sections: &Sections<'a>, delimiters: Delimiters, findings: &mut Findings) -> Self {
        let mut directory = Self {
            entries: Vec::new(),
            by_number: HashMap::new(),
            cards: sections.parameters.iter().map(|card| split(*card)).collect(),
            by_owner: HashMap::new(),
            texts: HashMap::new(),
            delimiters,
            room: Cell::new(64 * WIDTH * sections.parameters.len() + (1 << 20)),
        };
        directory.pair(&sections.directory, findings);
        for (at, (owner, card)) in directory.cards.iter_mut().enumerate() {
            directory.by_owner.entry(*owner).or_insert(at);
            if card.number == 0 {
                card.number = u32::try_from(at + 1).unwrap_or(0);
            }
        }
        if !directory.cards.is_sorted_by_key(|(_, card)| card.number) {
            findings.add(0, "cards of parameters are not in their order", "");
        }
        directory
    }

    /// Adds an entry; one with the number of an earlier one counts as damaged.
    pub(super) fn add(&mut self, entry: Entry, findings: &mut Findings) {
        let place = self.entries.len();
        if *self.by_number.entry(entry.number).or_insert(place) == place {
            self.entries.push(entry);
        } else {
            findings.add(entry.line, "a second directory entry of the same number; left out", format!("D{}", entry.number));
        }
    }

    /// Adds the parameters of an entry as text.
    pub(super) fn add_text(&mut self, number: u32, text: Vec<u8>) {
        self.texts.insert(number, text);
    }

    fn pair(&mut self, cards: &[Card<'_>], findings: &mut Findings) {
        let mut at = 0;
        let mut expected = 1;
        while let Some(first) = cards.get(at) {
            let number = if first.number == 0 { expected } else { first.number };
            let second = cards.get(at + 1);
            let kind = field(first, 0);
            let is_pair =
                second.is_some_and(|second| (second.number == number + 1 || second.number == 0) && field(second, 0) == kind);
            if number % 2 == 0 || kind.is_none() {
                findings.add(first.line, "a directory line without its other half", format!("D{number}"));
                at += 1;
            } else {
                let second = second.filter(|_| is_pair);
                if second.is_none() {
                    findings.add(
                        first.line,
                        "a directory entry without its second line; its form counts as 0",
                        format!("D{number}"),
                    );
                }
                self.add(entry(number, first, second), findings);
                at += if is_pair { 2 } else { 1 };
            }
            expected = number.saturating_add(if is_pair { 2 } else { 1 });
        }
    }

    /// The entry of a number.
    pub(super) fn get(&self, number: u32) -> Option<&Entry> {
        self.entries.get(*self.by_number.get(&number)?)
    }

    /// The parameters of an entry: where it says, or where cards say that they are its. O(their length).
    ///
    /// # Errors
    /// Why there are none.
    pub(super) fn parameters(&self, entry: &Entry) -> Result<Parameters, String> {
        let is_its = |found: &Parameters| found.integer(0).is_ok_and(|kind| kind == i64::from(entry.kind));
        if let Some(text) = self.texts.get(&entry.number) {
            return Some(Parameters::of(text, self.delimiters)).filter(is_its).ok_or_else(|| "no parameters of its type".into());
        }
        let place = self.cards.binary_search_by_key(&entry.first, |(_, card)| card.number).ok();
        let told = place.map(|place| self.record(place, entry.count as usize));
        let found = match told.filter(|found| is_its(found) && found.is_complete) {
            Some(found) => found,
            None => {
                let owned = self.by_owner.get(&entry.number).map(|place| self.record(*place, usize::MAX));
                let again = || place.map(|place| self.record(place, usize::MAX)).filter(is_its);
                owned.filter(is_its).or_else(again).ok_or("no parameters of its type where it says, nor any that name it")?
            }
        };
        if found.is_complete { Ok(found) } else { Err("its parameters have no end".into()) }
    }

    /// A record from a card on, of so many cards as are told, or as many as belong to the same entry.
    fn record(&self, place: usize, count: usize) -> Parameters {
        let owner = self.cards.get(place).map_or(0, |(owner, _)| *owner);
        let mut text = Vec::new();
        let mut expected = None;
        for (other, card) in self.cards.iter().skip(place).take(count.max(1)) {
            // A lost card would join what does not belong together.
            if *other != owner || expected.is_some_and(|expected| card.number != expected) {
                break;
            }
            let Some(room) = self.room.get().checked_sub(WIDTH) else { break };
            self.room.set(room);
            expected = Some(card.number.saturating_add(1));
            text.extend_from_slice(card.data);
            text.resize(text.len() + WIDTH.saturating_sub(card.data.len()), b' ');
        }
        Parameters::of(&text, self.delimiters)
    }
}

/// A card of parameters without the columns that name its entry, and that entry.
fn split(card: Card<'_>) -> (u32, Card<'_>) {
    if card.is_aligned {
        let owner = card.data.get(WIDTH..).map_or(0, |rest| digits(rest.trim_ascii()));
        return (owner, Card { data: card.data.get(..WIDTH).unwrap_or(card.data), ..card });
    }
    let data = card.data.trim_ascii_end();
    let count = data.iter().rev().take_while(|byte| byte.is_ascii_digit()).count();
    let (before, number) = data.split_at_checked(data.len() - count).unwrap_or((data, &[]));
    let is_apart = before.last().is_some_and(|byte| matches!(byte, b' ' | b';'));
    if is_apart { (digits(number), Card { data: before, ..card }) } else { (0, card) }
}

/// A field of 8 columns as a number; by words where columns are missing.
fn field(card: &Card<'_>, number: usize) -> Option<u32> {
    let text = if card.is_aligned {
        let rest = card.data.get(8 * number..)?;
        rest.get(..8).unwrap_or(rest)
    } else {
        card.data.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).nth(number)?
    };
    let text = std::str::from_utf8(text.trim_ascii()).ok()?;
    // Negative numbers stand for names and mean nothing here.
    text.parse::<i64>().ok().map(|number| u32::try_from(number).unwrap_or(0))
}

fn entry(number: u32, first: &Card<'_>, second: Option<&Card<'_>>) -> Entry {
    let of_second = |at| second.and_then(|second| field(second, at)).unwrap_or(0);
    let (blank, usage) = status(field(first, 8).unwrap_or(0));
    let mut label = [b' '; 8];
    let text = second.and_then(|second| second.data.get(56..64)).unwrap_or_default();
    label.iter_mut().zip(text).for_each(|(to, from)| *to = *from);
    Entry {
        number,
        line: first.line,
        kind: field(first, 0).unwrap_or(0),
        form: of_second(4),
        matrix: field(first, 6).unwrap_or(0),
        is_blanked: blank,
        usage,
        label,
        subscript: second.filter(|second| second.is_aligned).map_or(0, |_| of_second(8)),
        first: field(first, 1).unwrap_or(0),
        count: of_second(3),
    }
}

/// Blanked or not, and usage, of the eight digits of a status.
fn status(number: u32) -> (bool, u8) {
    let usage = number / 100 % 100;
    (number / 1_000_000 == 1, u8::try_from(usage).unwrap_or(0))
}

/// An entry of a compressed file by its fields.
pub(super) fn entry_of_fields(number: u32, line: u64, fields: &[Vec<u8>; 21]) -> Entry {
    let value = |at: usize| {
        let text = fields.get(at).and_then(|text| std::str::from_utf8(text.trim_ascii()).ok());
        text.and_then(|text| text.parse::<i64>().ok()).and_then(|value| u32::try_from(value).ok()).unwrap_or(0)
    };
    let (is_blanked, usage) = status(value(9));
    let mut label = [b' '; 8];
    let text = fields.get(18).map(Vec::as_slice).unwrap_or_default();
    label.iter_mut().zip(text).for_each(|(to, from)| *to = *from);
    let (kind, form, matrix, subscript) = (value(1), value(15), value(7), value(19));
    Entry { number, line, kind, form, matrix, is_blanked, usage, label, subscript, first: 0, count: 0 }
}
