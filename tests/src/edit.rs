//! Promise 2, as anyone could check it: the output is the input with the report's edit applied, byte for byte.

use serde_json::Value;

use crate::stl::{self, Record, Triangle};

/// An edit as a report lists it (`edit_records`), or as a test makes it up.
#[derive(Debug, Default)]
pub struct Edit {
    /// For each input record.
    pub changes: Vec<Change>,
    /// Corners and attributes of new records.
    pub added: Vec<(Triangle, u16)>,
}

/// What became of an input record.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    Untouched,
    Deleted,
    Flipped,
    Moved(Triangle),
}

impl Edit {
    /// Reads `edit_records` of a report on an input of `count` records.
    ///
    /// # Panics
    /// When a part is missing, a record is named twice or not there.
    pub fn read(report: &Value, count: usize) -> Self {
        let mut changes = vec![Change::Untouched; count];
        let mut note = |record: u64, change: Change| {
            let old = std::mem::replace(&mut changes[record as usize], change);
            assert_eq!(old, Change::Untouched, "record {record} stands twice in the edit");
        };
        let list = |part: &str| report["edit_records"][part].as_array().unwrap_or_else(|| panic!("no list of {part}"));
        for (part, change) in [("deleted", Change::Deleted), ("flipped", Change::Flipped)] {
            for range in list(part) {
                let (first, last) = (range[0].as_u64().expect("a number"), range[1].as_u64().expect("a number"));
                assert!(first <= last, "{part}: {range}");
                (first..=last).for_each(|record| note(record, change.clone()));
            }
        }
        list("moved").iter().for_each(|m| note(m[0].as_u64().expect("a number"), Change::Moved(triangle(&m[1]))));
        let attribute = |a: &Value| a[1].as_u64().and_then(|n| u16::try_from(n).ok()).expect("an attribute word");
        let added = list("added").iter().map(|a| (triangle(&a[0]), attribute(a))).collect();
        Self { changes, added }
    }

    /// The numbers of the edit, as a report's `edit` gives them: untouched, deleted, flipped, moved, added.
    pub fn numbers(&self) -> [u64; 5] {
        let count = |fits: fn(&Change) -> bool| self.changes.iter().filter(|c| fits(c)).count() as u64;
        [
            count(|c| *c == Change::Untouched),
            count(|c| *c == Change::Deleted),
            count(|c| *c == Change::Flipped),
            count(|c| matches!(c, Change::Moved(_))),
            self.added.len() as u64,
        ]
    }

    /// The records that the edit makes of `input`. New, moved and turned triangles have the normals of their corners; the first of them take the places of deleted
    /// ones.
    ///
    /// # Panics
    /// When the edit is of another input.
    pub fn apply(&self, input: &[Record]) -> Vec<Record> {
        assert_eq!(input.len(), self.changes.len());
        let mut added = self.added.iter().map(|(t, attribute)| stl::record(stl::unit_normal(t), t, *attribute));
        let mut output = Vec::new();
        for (record, change) in input.iter().zip(&self.changes) {
            match change {
                Change::Untouched => output.push(*record),
                Change::Deleted => output.extend(added.next()),
                Change::Flipped => output.push(flipped(record)),
                Change::Moved(to) => output.push(stl::record(stl::unit_normal(to), to, stl::attribute(record))),
            }
        }
        output.extend(added);
        output
    }
}

/// Second and third corner swapped, the normal of these corners, the attribute kept.
fn flipped(record: &Record) -> Record {
    let [_, a, b, c] = stl::numbers(record);
    let turned = [a, c, b];
    stl::record(stl::unit_normal(&turned), &turned, stl::attribute(record))
}

fn triangle(value: &Value) -> Triangle {
    std::array::from_fn(|corner| {
        std::array::from_fn(|axis| value[corner][axis].as_f64().unwrap_or_else(|| panic!("not a triangle: {value}")) as f32)
    })
}
