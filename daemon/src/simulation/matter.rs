//! What is dropped: files that say in their first bytes what becomes of them, so that whoever reads them later knows which they are.

use suture_core::report::Outcome;

/// What becomes of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Fate {
    Clean,
    Repaired,
    /// Repaired when it has the whole memory, and not before.
    Hungry,
    /// Repaired, after a longer time.
    Slow,
    /// Its worker is killed from outside, once; then repaired.
    Shot,
    /// The machine fails its worker, once; then repaired.
    Unlucky,
    /// Kills its worker once; then repaired.
    Stumbles,
    Review,
    NotGood,
    Unreadable,
    Refused,
    Kills,
    Hangs,
}

pub(super) const FATES: [(Fate, char); 13] = [
    (Fate::Clean, 'c'),
    (Fate::Repaired, 'r'),
    (Fate::Hungry, 'h'),
    (Fate::Slow, 's'),
    (Fate::Shot, 'x'),
    (Fate::Unlucky, 'u'),
    (Fate::Stumbles, 't'),
    (Fate::Review, 'v'),
    (Fate::NotGood, 'n'),
    (Fate::Unreadable, 'l'),
    (Fate::Refused, 'f'),
    (Fate::Kills, 'k'),
    (Fate::Hangs, 'g'),
];

impl Fate {
    /// The part of the hot folder that its original comes to.
    pub(super) fn area(self) -> &'static str {
        match self {
            Self::Review | Self::NotGood | Self::Unreadable | Self::Refused => "failed",
            Self::Kills | Self::Hangs => "quarantine",
            _ => "done",
        }
    }

    pub(super) fn is_good(self) -> bool {
        self.area() == "done"
    }

    /// That of the engine's report, if there is one.
    pub(super) fn outcome(self) -> Outcome {
        match self {
            Self::Clean => Outcome::Clean,
            Self::Review => Outcome::NeedsReview,
            Self::NotGood => Outcome::NotGood,
            _ => Outcome::Repaired,
        }
    }
}

/// A content.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Matter {
    pub fate: Fate,
    /// Tells it from all others.
    pub serial: u32,
    pub large: bool,
}

/// Bytes of a header and of a record.
const HEAD: usize = 84;
const RECORD: usize = 50;
/// Records of files that are small, and of those that are large for the simulated configuration, at least; and so many more, less one.
const SMALL: usize = 2;
const LARGE: usize = 90;
const MORE: usize = 40;

impl Matter {
    /// As it is dropped: a binary STL by its length.
    pub(super) fn dropped(self) -> Vec<u8> {
        self.bytes("in ")
    }

    /// What a worker makes of it.
    pub(super) fn result(self) -> Vec<u8> {
        self.bytes(if self.fate == Fate::Clean { "in " } else { "out" })
    }

    fn bytes(self, side: &str) -> Vec<u8> {
        let letter = FATES.iter().find(|(fate, _)| *fate == self.fate).map_or('?', |(_, letter)| *letter);
        let size = if self.large { 'L' } else { 's' };
        let records = if self.large { LARGE } else { SMALL } + self.serial as usize % MORE;
        let mut bytes = format!("sim {letter} {:09} {size} {side}", self.serial).into_bytes();
        bytes.resize(HEAD - 4, b' ');
        bytes.extend((records as u32).to_le_bytes());
        bytes.resize(HEAD + records * RECORD, 1 + (self.serial % 250) as u8);
        bytes
    }

    /// Which one these bytes are, and whether they are a worker's; `None` for anything but a whole one.
    pub(super) fn read(bytes: &[u8]) -> Option<(Self, bool)> {
        let head = std::str::from_utf8(bytes.get(..HEAD - 4)?).ok()?;
        let mut words = head.split_ascii_whitespace().skip(1);
        let letter = words.next()?.chars().next()?;
        let serial = words.next()?.parse().ok()?;
        let large = words.next()? == "L";
        let is_result = words.next()? == "out";
        let fate = FATES.iter().find(|(_, known)| *known == letter)?.0;
        let matter = Self { fate, serial, large };
        let whole = if is_result { matter.result() } else { matter.dropped() };
        (whole == bytes).then_some((matter, is_result))
    }
}

#[test]
fn a_content_says_which_it_is() {
    for (serial, (fate, _)) in FATES.into_iter().enumerate() {
        let matter = Matter { fate, serial: serial as u32, large: serial % 2 == 0 };
        assert_eq!(Matter::read(&matter.dropped()), Some((matter, false)));
        assert_eq!(Matter::read(&matter.result()), Some((matter, fate != Fate::Clean)));
        assert_eq!(Matter::read(&matter.dropped()[1..]), None);
        let mut other = matter.dropped();
        *other.last_mut().unwrap() += 1;
        assert_eq!(Matter::read(&other), None);
    }
}
