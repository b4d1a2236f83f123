//! The written file read back and compared with what it should hold, byte by byte, while it is hashed.
//!
//! What is found equal to the input needs no second proof of what was proved of the input: the second look goes on from here
//! ([`crate::second`]).

use blake3::Hasher;

use crate::ahead::Guide;
use crate::edit::{Edit, Step};
use crate::error::{Error, Result};
use crate::read::{MeshFile, PREFIX_BYTES};
use crate::record::Record;
use crate::settings::Limits;
use crate::{Progress, parallel};

/// How a written file differs from its input. A triangle's **place** is the number of the input record that it is or stands in for; added
/// ones have the places after all of these.
#[derive(Debug, Default)]
pub(crate) struct Difference {
    /// Input records that the written file does not hold, ascending.
    pub(crate) gone: Vec<u32>,
    /// Those of them that nothing stands in for, ascending.
    deleted: Vec<u32>,
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

/// Bytes that are hashed and compared at a time: both read them while they are in a cache.
const BLOCK_RECORDS: usize = (2 << 20) / size_of::<Record>();
/// Fewer records are not worth starting threads for.
const READ_BY_ONE: usize = 20_000;

/// A stretch of the written file, and what it should be.
struct Stretch<'a> {
    first: usize,
    expected: Expected<'a>,
}

enum Expected<'a> {
    Input(&'a [Record]),
    /// One of those that are not the input's.
    Fresh(usize),
}

impl Stretch<'_> {
    fn count(&self) -> usize {
        match self.expected {
            Expected::Input(run) => run.len(),
            Expected::Fresh(_) => 1,
        }
    }
}

/// What a written file should hold.
pub(crate) struct Expectation<'a> {
    pub(crate) difference: Difference,
    input: &'a [Record],
    stretches: Vec<Stretch<'a>>,
}

impl<'a> Expectation<'a> {
    /// The input as `edit` leaves it. O(edit), or one step a run of untouched records.
    pub(crate) fn of(input: &'a [Record], edit: &'a Edit) -> Self {
        let mut difference = Difference::default();
        let mut stretches = Vec::new();
        let walked: std::result::Result<(), std::convert::Infallible> = edit.walk(input, |step| {
            let fresh = difference.fresh.len();
            let expected = match step {
                Step::Untouched(run) => Expected::Input(run),
                Step::Changed(place, record) => {
                    difference.gone.push(place);
                    difference.fresh.push((place, record));
                    Expected::Fresh(fresh)
                }
                Step::Deleted(place) => {
                    difference.gone.push(place);
                    difference.deleted.push(place);
                    return Ok(());
                }
                Step::Added(record) => {
                    let place = difference.fresh.last().map_or(0, |(last, _)| last + 1).max(input.len() as u32);
                    difference.fresh.push((place, *record));
                    Expected::Fresh(fresh)
                }
            };
            let stretch = Stretch { first: difference.written_records, expected };
            difference.written_records += stretch.count();
            stretches.push(stretch);
            Ok(())
        });
        let Ok(()) = walked;
        Self { difference, input, stretches }
    }

    /// Reads `written` back: its BLAKE3, if it holds what it should.
    ///
    /// # Errors
    /// [`Error::Io`] where it does not.
    pub(crate) fn confirm(&self, written: &MeshFile, limits: &Limits, progress: &dyn Progress) -> Result<String> {
        let (records, bytes) = (written.records(), written.bytes());
        let is_whole = self.difference.written_records == records.len() && bytes.len() == PREFIX_BYTES + size_of_val(records);
        let read = || hash_and_compare(self, written, limits, progress);
        let (hash, equal) =
            if limits.threads < 2 || records.len() < READ_BY_ONE { read() } else { parallel::in_pool(limits.threads, read) };
        if !(is_whole && equal) {
            let source = std::io::Error::other("the file does not hold what was written to it");
            return Err(Error::io(written.path(), "reading back")(source));
        }
        Ok(hash)
    }
}

fn hash_and_compare(expected: &Expectation<'_>, written: &MeshFile, limits: &Limits, progress: &dyn Progress) -> (String, bool) {
    let (records, bytes) = (written.records(), written.bytes());
    let input_guide = Guide::new(expected.input.as_flattened(), limits);
    let mut hasher = Hasher::new();
    hasher.update(&bytes[..bytes.len().min(PREFIX_BYTES)]);
    let (mut equal, mut stretch, mut first, mut asked) = (true, 0, 0, 0);
    for block in Guide::new(records.as_flattened(), limits).blocks(records).flat_map(|block| block.chunks(BLOCK_RECORDS)) {
        let mut compare = || {
            let end = first + block.len();
            while let Some(next) = expected.stretches.get(stretch).filter(|s| s.first < end) {
                let (from, to) = (next.first.max(first), (next.first + next.count()).min(end));
                let there = &block[from - first..to - first];
                equal &= match next.expected {
                    Expected::Input(run) => {
                        let run = &run[from - next.first..to - next.first];
                        input_guide.keep_ahead(&mut asked, run.as_flattened());
                        run == there
                    }
                    Expected::Fresh(i) => there == [expected.difference.fresh[i].1],
                };
                if next.first + next.count() > end {
                    break;
                }
                stretch += 1;
            }
        };
        if limits.threads < 2 || records.len() < READ_BY_ONE {
            hasher.update(block.as_flattened());
            compare();
        } else {
            rayon::join(|| hasher.update_rayon(block.as_flattened()), compare);
        }
        first += block.len();
        progress.at("hash", first as u64, records.len() as u64);
    }
    (hasher.finalize().to_hex().to_string(), equal)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::Quiet;
    use crate::shop::components::Reversed;
    use crate::testing::{Corners, cube, diagnose, plate, records, shifted, written};

    fn open(path: &Path) -> MeshFile {
        MeshFile::open(path, path.parent().unwrap(), &Limits::default(), &Quiet).unwrap()
    }

    /// Some thousand triangles, of which one goes, one turns, one moves and one comes: what is written is what is read back, and
    /// every bit of it counts.
    #[test]
    fn one_bit_that_is_not_as_it_was_written_is_noticed() {
        let triangles: Vec<Corners> = [plate(100, |_, _| true), shifted(&cube(), [0.0, 0.0, 2.0])].concat();
        let input = records(&triangles);
        let mut d = diagnose(&input);
        let last = d.shop.triangles.len() - 1;
        d.shop.kill(0);
        d.shop.triangles[last].v.swap(1, 2);
        let corner = d.shop.triangles[3].v[0];
        d.shop.positions[corner as usize][2] += 0.25;
        d.shop.add([0, 2, 5], crate::shop::Origin::Patch, crate::chunk::NONE);
        let edit = Edit::of(&d.survey, &d.shop, &Reversed::none(&d.survey));
        let output = written(&edit, &input);

        let expectation = Expectation::of(&input, &edit);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("part.stl");
        let mut bytes = [&[0; 80][..], &(output.len() as u32).to_le_bytes(), output.as_flattened()].concat();
        for threads in [1, 2] {
            let limits = Limits { threads, ..Limits::default() };
            let read = |bytes: &[u8]| {
                std::fs::write(&path, bytes).unwrap();
                expectation.confirm(&open(&path), &limits, &Quiet)
            };
            assert_eq!(read(&bytes).unwrap(), blake3::hash(&bytes).to_hex().to_string());
            let found = &expectation.difference;
            assert_eq!(found.written_records, output.len());
            let gone = found.gone.iter().map(|t| input[*t as usize]);
            assert!(gone.clone().all(|record| !found.fresh.iter().any(|f| f.1 == record)) && gone.len() > 3);
            for (place, record) in &found.fresh {
                assert_eq!(output[found.number(*place) as usize], *record);
            }
            // In an untouched record, in a moved one (the attribute of the first one left that is not as it was), in the added one.
            let moved = found.fresh.iter().map(|f| found.number(f.0) as usize).min().unwrap();
            for record in [output.len() / 2, moved, output.len() - 1] {
                let at = PREFIX_BYTES + record * 50 + 49;
                bytes[at] ^= 1;
                assert!(read(&bytes).is_err_and(|e| e.to_string().contains("reading back")));
                bytes[at] ^= 1;
            }
            let shorter = [&[0; 80][..], &(output.len() as u32 - 1).to_le_bytes(), output[1..].as_flattened()].concat();
            assert!(read(&shorter).is_err(), "a record is missing");
        }
    }
}
