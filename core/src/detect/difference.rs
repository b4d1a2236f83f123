//! How a written file differs from its input.

use crate::io::record::Record;

/// How a written file differs from its input. A triangle's **place** is the number of the input record that it is or stands in for; added
/// ones have the places after all of these.
#[derive(Debug, Default)]
pub(crate) struct Difference {
    /// Input records that the written file does not hold, ascending.
    pub(crate) gone: Vec<u32>,
    /// Those records that nothing stands in for, ascending.
    pub(crate) deleted: Vec<u32>,
    /// What the written file holds besides untouched records of the input, by ascending place.
    pub(crate) fresh: Vec<(u32, Record)>,
    /// Records in the written file.
    pub(crate) written_records: usize,
}

impl Difference {
    /// The number, in the written file, of the record at a place.
    pub(crate) fn number(&self, place: u32) -> u32 {
        place - self.deleted.partition_point(|d| *d < place) as u32
    }
}
