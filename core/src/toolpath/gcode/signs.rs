//! Signs of the dialect, the unit and the kind of machine.

use super::clean::Line;
use super::labels::Labels;
use crate::toolpath::lines::Place;
use crate::toolpath::options::Units;
use crate::toolpath::program::Dialect;

/// Signs that a file gives away about itself.
#[derive(Debug, Default)]
pub(super) struct Signs {
    /// Square brackets are comments.
    pub(super) has_brackets: bool,
    pub(super) is_tape_begun: bool,
    pub(super) has_checksum: bool,
    pub(super) has_extruder: bool,
    pub(super) has_fanuc_code: bool,
    /// The unit of which comments speak.
    pub(super) unit: Option<Units>,
    pub(super) has_y: bool,
    /// A cut while an axis is not known.
    pub(super) cuts_unknown: bool,
    pub(super) cuts_outside_zx: bool,
    /// The first line that cuts in Z X.
    pub(super) first_zx: Option<u64>,
    has_words: bool,
    has_programs: bool,
    has_parameters: bool,
    has_commands: bool,
}

/// Lines that are looked at for the dialect.
const LOOKED_AT: usize = 400;

impl Signs {
    pub(super) fn of(text: &[u8], labels: &Labels) -> Self {
        let has_brackets = text.trim_ascii_start().starts_with(b"[");
        let mut signs =
            Self { has_brackets, has_words: labels.has_words(), has_programs: labels.has_programs(), ..Self::default() };
        let (mut place, mut line) = (Place::START, Line::default());
        for _ in 0..LOOKED_AT {
            let Some((raw, next)) = place.next(text) else { break };
            line.set(raw, has_brackets);
            signs.has_parameters |= line.code.contains(&b'#');
            signs.has_commands |= line.code.starts_with(b"$");
            place = next;
        }
        signs
    }

    /// Looks for a unit in a comment.
    pub(super) fn comment(&mut self, comment: &[u8]) {
        if self.unit.is_some() || comment.len() > 200 {
            return;
        }
        let words = comment.to_ascii_lowercase();
        let has = |word: &[u8]| memchr::memmem::find(&words, word).is_some();
        let is_statement = has(b"output in") || has(b"unit") || has(b"in absolute") || has(b"dimensions");
        if is_statement && has(b"inch") && !has(b"mm") {
            self.unit = Some(Units::Inches);
        } else if is_statement && (has(b"mm") || has(b"millim") || has(b"metric")) && !has(b"inch") {
            self.unit = Some(Units::Millimetres);
        }
    }

    /// The line where a lathe begins to cut, if all of the program is one's: X and Z alone, in their plane.
    pub(super) fn lathe(&self, cuts: u64) -> Option<u64> {
        self.first_zx.filter(|_| cuts > 0 && !self.has_y && !self.cuts_outside_zx)
    }

    /// Whether program numbers say that it is Fanuc's or like it.
    pub(super) fn is_fanuc(&self) -> bool {
        self.has_programs && !self.has_words
    }

    pub(super) fn dialect(&self) -> Dialect {
        if self.has_checksum || self.has_extruder {
            Dialect::Marlin
        } else if self.has_brackets {
            Dialect::WinCnc
        } else if self.has_words || (self.has_parameters && !self.has_programs) {
            Dialect::LinuxCnc
        } else if self.has_commands {
            Dialect::Grbl
        } else if self.has_programs || self.has_fanuc_code {
            Dialect::Fanuc
        } else {
            Dialect::GCode
        }
    }
}
