//! The rows of a file of any bytes, for the fuzz targets in `tests/fuzz`; in no other build.
//!
//! **In:** a file that a reader takes.
//! **Out:** nothing: all that a writer asks of rows is asked.

use std::collections::BTreeSet;
use std::path::Path;

use super::Said;
use super::table::{CHANNELS, FaceRow, NONE, Rows, Source, State, Triangle, WHOLE};
use crate::contract::error::Result;
use crate::contract::progress::Quiet;
use crate::contract::settings::Limits;
use crate::io::read::MeshFile;

/// Rows whose numbers are asked for.
const ASKED: usize = 16;

/// Asks the rows of the file at `path` all that a writer would; how many faces there are.
///
/// # Errors
/// As [`MeshFile::open`].
pub fn ask(path: &Path, limits: &Limits) -> Result<usize> {
    let mesh = MeshFile::open(path, &limits.spool_folder(), limits, &Quiet)?;
    Ok(match Said::by(&mesh) {
        Said::Rows(rows) => faces(&*rows),
        Said::Nothing | Said::Elsewhere(_) => 0,
    })
}

fn faces(rows: &dyn Rows) -> usize {
    let (counts, length) = (rows.counts(), rows.bytes().len());
    let (mut named, mut count, mut at) = ([const { BTreeSet::new() }; CHANNELS], 0, 0);
    let (mut row, mut written, mut before) = (FaceRow::default(), Vec::new(), State::default());
    let mut all = rows.faces();
    while all.next_face(&mut row).is_some() {
        assert!(
            at <= row.whole.start && row.whole.start < row.whole.end && row.whole.end <= length,
            "a face stands behind the one before"
        );
        at = row.whole.end;
        rows.says(&row);
        if row.corners.iter().any(|corner| rows.position(corner[0]).is_none()) {
            // Rows that stand otherwise than line by line: such a file fits no plan (`output::rows::walk`).
            return count;
        }
        for corner in &row.corners {
            for ((number, count), named) in corner.iter().zip(counts).zip(&mut named) {
                assert!(*number == NONE || *number < count, "a row that is named is there");
                if *number != NONE && named.len() < ASKED {
                    named.insert(*number);
                }
            }
        }
        if let [a, b, .., c] = *row.corners.as_slice()
            && count < ASKED
        {
            let last = row.corners.len() as u32 - 1;
            let (places, corners) = (Some([0, 1, last]), row.corners.len() as u32);
            let source = Source { row: row.whole.clone(), places, corners, state: row.state };
            rows.put_state(before, row.state, &mut written);
            rows.put_face(&Triangle { corners: [a, c, b], source: Some(&source), weights: WHOLE, is_turned: true }, &mut written);
            before = row.state;
        }
        count += 1;
    }
    for (channel, named) in named.iter().enumerate() {
        let values = rows.values(channel, named).unwrap_or_default();
        values.values().for_each(|values| rows.put_row(channel, values, &mut written));
        rows.mixes(channel);
    }
    let (_, end) = rows.head(u64::from(counts[0]) + 1, count as u64 + 1);
    assert!(end <= rows.end_of_vertices().max(end) && rows.end_of_vertices() <= length && rows.end_of_faces() <= length);
    rows.put_state(before, rows.end_state(), &mut written);
    count
}
