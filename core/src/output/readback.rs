//! The written file read back and compared with what it should hold, byte by byte, while it is hashed.
//!
//! What is found equal to the input needs no second proof of what was proved of the input: the second look goes on from here
//! ([`crate::output::incremental`]).

use crate::detect::difference::Difference;
use blake3::hazmat::ChainingValue;
use rayon::prelude::*;

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::io::digest;
use crate::io::digest::Digest;
use crate::io::read::{MeshFile, PREFIX_BYTES};
use crate::io::read_ahead::Guide;
use crate::io::record::Record;
use crate::output::edit::{Edit, Step};
use crate::util::parallel;

/// Fewer bytes are not worth starting threads for.
const READ_BY_ONE: usize = 1 << 20;
/// Bytes that are worked on side by side, between two words about how far it is.
const WINDOW: usize = 128 * digest::BLOCK;

/// A stretch of the written file, and what it should be.
struct Stretch {
    first: usize,
    count: usize,
    expected: Expected,
}

enum Expected {
    /// The input's records from this one on.
    Input(usize),
    /// One of those that are not the input's.
    Fresh(usize),
}

/// The bytes that a written file should hold.
pub(crate) struct Expectation<'a> {
    pub(crate) difference: Difference,
    input: &'a [Record],
    /// One after the other.
    stretches: Vec<Stretch>,
}

/// How the bytes of a block compare.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Compared {
    /// The input's, where they stand in the input.
    InPlace,
    /// As they should be.
    Equal,
    Different,
}

impl<'a> Expectation<'a> {
    /// The input as `edit` leaves it. O(edit), or one step a run of untouched records.
    pub(crate) fn of(input: &'a [Record], edit: &'a Edit) -> Self {
        let mut difference = Difference::default();
        let mut stretches = Vec::new();
        // The next record of the input.
        let mut at = 0;
        let walked: std::result::Result<(), std::convert::Infallible> = edit.walk(input, |step| {
            let fresh = difference.fresh.len();
            let (from, count, expected) = match step {
                Step::Untouched(run) => (at, run.len(), Expected::Input(at)),
                Step::Changed(place, record, _) => {
                    difference.gone.push(place);
                    difference.fresh.push((place, record));
                    (at, 1, Expected::Fresh(fresh))
                }
                Step::Deleted(places) => {
                    at += places.len();
                    difference.gone.extend(places.clone());
                    difference.deleted.extend(places);
                    return Ok(());
                }
                Step::Added(record, _) => {
                    let place = difference.fresh.last().map_or(0, |(last, _)| last + 1).max(input.len() as u32);
                    difference.fresh.push((place, *record));
                    (at, 1, Expected::Fresh(fresh))
                }
            };
            at = from + count;
            stretches.push(Stretch { first: difference.written_records, count, expected });
            difference.written_records += count;
            Ok(())
        });
        let Ok(()) = walked;
        Self { difference, input, stretches }
    }

    /// Reads `written` back: its BLAKE3, if it holds what it should. Blocks that are the input's, where they stand in it, have the value
    /// that they have in `digest`, the input's; that is empty if the input's records do not stand where those of the output do.
    ///
    /// # Errors
    /// [`Error::Io`] where it does not.
    pub(crate) fn confirm(
        &self,
        written: &MeshFile,
        digest: &[ChainingValue],
        limits: &Limits,
        progress: &dyn Progress,
    ) -> Result<String> {
        let (bytes, count) = (written.bytes(), written.records().len());
        let is_whole = self.difference.written_records == count && bytes.len() == PREFIX_BYTES + size_of_val(written.records());
        let read = |by_one| self.read(written, digest, limits, progress, by_one);
        let values = match bytes.len() {
            _ if !is_whole => None,
            0..READ_BY_ONE => read(true),
            _ => parallel::in_pool(limits.threads, || read(false)),
        };
        match values {
            Some(values) => Ok(digest::hash(bytes, &values)),
            None => {
                let source = std::io::Error::other("the file does not hold what was written to it");
                Err(Error::io(written.path(), "reading back")(source))
            }
        }
    }

    /// The digest of a file that holds what it should, `None` if it does not. Unless read `by_one` thread, blocks go to the pool's.
    fn read(
        &self,
        written: &MeshFile,
        digest: &[ChainingValue],
        limits: &Limits,
        progress: &dyn Progress,
        by_one: bool,
    ) -> Option<Digest> {
        let bytes = written.bytes();
        let _compared = Guide::new(self.input.as_flattened(), limits).in_order(self.input);
        let value = |number: usize, block: &[u8]| match (self.compare(number * digest::BLOCK, block), digest.get(number)) {
            (Compared::Different, _) => None,
            // Shorter ones end with the file, and the input may go on.
            (Compared::InPlace, Some(known)) if block.len() == digest::BLOCK => Some(*known),
            _ => Some(digest::value(number, block)),
        };
        let mut values = Vec::with_capacity(bytes.len().div_ceil(digest::BLOCK));
        for window in Guide::new(bytes, limits).blocks(bytes).flat_map(|block| block.chunks(WINDOW)) {
            let first = values.len();
            let value = |(i, block): (usize, &[u8])| value(first + i, block);
            values.extend(if by_one {
                window.chunks(digest::BLOCK).enumerate().map(value).collect::<Option<Vec<_>>>()?
            } else {
                window.par_chunks(digest::BLOCK).enumerate().map(value).collect::<Option<Vec<_>>>()?
            });
            progress.at("hash", (values.len() * digest::BLOCK / size_of::<Record>()) as u64, written.records().len() as u64);
        }
        Some(values)
    }

    /// The first of the stretches that reach into the file beyond `at`.
    fn first_stretch(&self, at: usize) -> usize {
        let record = at.saturating_sub(PREFIX_BYTES) / size_of::<Record>();
        self.stretches.partition_point(|s| s.first + s.count <= record)
    }

    /// Compares the bytes of the written file from `at` on, but not what stands before the first record.
    fn compare(&self, at: usize, bytes: &[u8]) -> Compared {
        const SIZE: usize = size_of::<Record>();
        let mut compared = if at < PREFIX_BYTES { Compared::Equal } else { Compared::InPlace };
        let end = at + bytes.len();
        for stretch in &self.stretches[self.first_stretch(at)..] {
            let start = PREFIX_BYTES + stretch.first * SIZE;
            if start >= end {
                break;
            }
            let (from, to) = (start.max(at), (start + stretch.count * SIZE).min(end));
            let there = &bytes[from - at..to - at];
            let (expected, in_place): (&[u8], bool) = match stretch.expected {
                Expected::Input(first) => (self.input[first..first + stretch.count].as_flattened(), first == stretch.first),
                Expected::Fresh(i) => (&self.difference.fresh[i].1, false),
            };
            if &expected[from - start..to - start] != there {
                return Compared::Different;
            }
            if !in_place {
                compared = Compared::Equal;
            }
        }
        compared
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::contract::progress::Quiet;
    use crate::contract::report::RepairName;
    use crate::geometry::position::Position;
    use crate::submesh::components::Reversed;
    use crate::testing::{Corners, cube, diagnose, plate, records, shifted, written};

    fn open(path: &Path) -> MeshFile {
        MeshFile::open(path, path.parent().unwrap(), &Limits::default(), &Quiet).unwrap()
    }

    /// Some thousand triangles, of which some go, one turns, one moves and one comes: what is written is what is read back, and every bit
    /// of it counts.
    #[test]
    fn one_bit_that_is_not_as_it_was_written_is_noticed() {
        let triangles: Vec<Corners> = [plate(100, |_, _| true), shifted(&cube(), [0.0, 0.0, 2.0])].concat();
        let input = records(&triangles);
        let file = |records: &[Record]| [&[0; 80][..], &(records.len() as u32).to_le_bytes(), records.as_flattened()].concat();
        let blocks = |bytes: &[u8]| -> Vec<ChainingValue> {
            bytes.chunks(digest::BLOCK).enumerate().map(|(number, block)| digest::value(number, block)).collect()
        };
        let known = blocks(&file(&input));
        // The one that comes takes the place of the one that goes, or of the first of three.
        for go in [vec![0], vec![0, 9_000, 17_000]] {
            let mut d = diagnose(&input);
            let last = d.submesh.triangles.len() - 1;
            let of_record = |t: u32| d.submesh.triangles.iter().position(|u| u.record() == t).unwrap() as u32;
            let go: Vec<u32> = go.iter().map(|t| of_record(*t)).collect();
            go.iter().for_each(|t| d.submesh.kill(*t));
            d.submesh.triangles[last].turn();
            let corner = d.submesh.triangles[3].v[0];
            let [x, y, z] = d.submesh.positions[corner as usize];
            let above = d.submesh.add_vertex(Position::of([x, y, z + 0.25]));
            d.submesh.merge(above, corner);
            d.submesh.add([0, 2, 5], crate::submesh::Origin::Added(RepairName::Fill), crate::util::ids::NONE);
            let edit = Edit::of(&d.survey, &d.submesh, &Reversed::none(&d.survey), &[]);
            let output = written(&edit, &input);

            let expectation = Expectation::of(&input, &edit);
            let found = &expectation.difference;
            assert_eq!((found.written_records, output.len()), (output.len(), input.len() + 1 - go.len()));
            let gone = found.gone.iter().map(|t| input[*t as usize]);
            assert!(gone.clone().all(|record| !found.fresh.iter().any(|f| f.1 == record)) && gone.len() > 3);
            for (place, record) in &found.fresh {
                assert_eq!(output[found.number(*place) as usize], *record);
            }

            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("part.stl");
            let mut bytes = file(&output);
            let hash = blake3::hash(&bytes).to_hex().to_string();
            let mut wrong = known.clone();
            wrong[2][0] ^= 1;
            for threads in [1, 2] {
                let limits = Limits { threads, ..Limits::default() };
                let read = |bytes: &[u8], digest: &[ChainingValue]| {
                    std::fs::write(&path, bytes).unwrap();
                    expectation.confirm(&open(&path), digest, &limits, &Quiet)
                };
                assert_eq!(read(&bytes, &known).unwrap(), hash);
                assert_eq!(read(&bytes, &[]).unwrap(), hash, "without the input's digest");
                assert_ne!(read(&bytes, &wrong).unwrap(), hash, "a block where nothing changed is not hashed again");
                // In an untouched record, in a moved one (the attribute of the first one left that is not as it was), in the last.
                let moved = found.fresh.iter().map(|f| found.number(f.0) as usize).min().unwrap();
                for record in [3 * digest::BLOCK / 50, output.len() / 2, moved, output.len() - 1] {
                    let at = PREFIX_BYTES + record * 50 + 49;
                    bytes[at] ^= 1;
                    assert!(read(&bytes, &known).is_err_and(|e| e.to_string().contains("reading back")));
                    bytes[at] ^= 1;
                }
                assert!(read(&file(&output[1..]), &known).is_err(), "a record is missing");
            }
        }
    }
}
