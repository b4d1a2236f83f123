//! Files that end in zeros, as an interrupted copy does: some copiers give a file its final size first, and where they stop, zeros follow.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;

use super::finding::{Finding, Loss};
use crate::io::record::Record;
use crate::util::words::Count;

/// Fewer records of zeros at the end may be an exporter's. (None of 104 binary files from many makers ended in a single one.)
const FEWEST_RECORDS: usize = 8;
/// Bytes of the end that [`ends_in_zeros`] looks at. Some writers fill their last block of up to this length with zeros.
const BLOCK: usize = 4096;

/// Whether the file ends as if it had been cut off while it was copied: in zeros as long as eight triangles of a binary STL. A text that is complete
/// before at most a block of zeros does not. Reads no more than the last 4 KiB.
///
/// # Errors
/// When the file cannot be read, or is truncated meanwhile.
pub fn ends_in_zeros(file: &File) -> io::Result<bool> {
    let size = file.metadata()?.len();
    let mut block = [0; BLOCK];
    let end = block.get_mut(..usize::try_from(size).map_or(BLOCK, |size| size.min(BLOCK))).unwrap_or_default();
    file.read_exact_at(end, size - end.len() as u64)?;
    let (content, zeros) = split(end);
    Ok(zeros >= FEWEST_RECORDS * size_of::<Record>() && (content.is_empty() || !is_complete_text(content)))
}

/// The bytes before the zeros at the end, and how many zeros there are.
pub(super) fn split(bytes: &[u8]) -> (&[u8], usize) {
    let mut content = bytes;
    // Whole blocks first, without a branch for each byte: there may be gigabytes of zeros.
    while let Some((before, block)) = content.split_last_chunk::<BLOCK>() {
        if block.iter().fold(0, |all, byte| all | byte) != 0 {
            break;
        }
        content = before;
    }
    let end = content.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1);
    (content.get(..end).unwrap_or_default(), bytes.len() - end)
}

/// The finding on the end of a binary file's records.
pub(super) fn of_records(records: &[Record]) -> Option<Finding> {
    let zeros = split(records.as_flattened()).1 / size_of::<Record>();
    (zeros >= FEWEST_RECORDS).then(|| {
        let (zeros, all) = (Count(zeros), Count(records.len()));
        cut_off(format!("its last {zeros} of {all} records are zeros, as in a file that was cut off while it was copied"))
    })
}

/// The finding on `zeros` zero bytes behind a text STL.
pub(super) fn of_text(text: &[u8], zeros: usize) -> Option<Finding> {
    behind(text, zeros, is_complete_text)
}

/// The finding on `zeros` zero bytes behind a text that is complete once its last line is.
pub(super) fn of_lines(text: &[u8], zeros: usize) -> Option<Finding> {
    behind(text, zeros, |end| end.ends_with(b"\n") || end.ends_with(b"\r"))
}

fn behind(text: &[u8], zeros: usize, is_complete: fn(&[u8]) -> bool) -> Option<Finding> {
    let end = text.get(text.len().saturating_sub(BLOCK)..).unwrap_or_default();
    behind_text(is_complete(end), zeros)
}

/// The finding on `zeros` zero bytes at the end of rows that are all read, of which an empty one takes so many bytes.
pub(super) fn of_rows(zeros: usize, row: usize) -> Option<Finding> {
    (zeros >= FEWEST_RECORDS * size_of::<Record>() && zeros / row.max(1) >= FEWEST_RECORDS).then(|| {
        let zeros = Count(zeros);
        cut_off(format!("its faces end in {zeros} bytes of zeros, as in a file that was cut off while it was copied"))
    })
}

/// The finding on `zeros` zero bytes behind a text, which is complete without them or not.
pub(super) fn behind_text(complete: bool, zeros: usize) -> Option<Finding> {
    if zeros == 0 {
        return None;
    }
    Some(if zeros < BLOCK && complete {
        Finding { harmless: true, ..Finding::flaw(format!("padded with {} zero bytes", Count(zeros))) }
    } else {
        cut_off(format!("its last {} bytes are zeros, as in a file that was cut off while it was copied", Count(zeros)))
    })
}

fn cut_off(text: String) -> Finding {
    Finding { loss: Loss::Certain, ..Finding::flaw(text) }
}

/// The last solid is ended: no word of a facet follows an `endsolid`. Or the root of an AMF is.
fn is_complete_text(end: &[u8]) -> bool {
    if end.trim_ascii_end().ends_with(b"</amf>") {
        return true;
    }
    let last = |word: &[u8]| end.windows(word.len()).rposition(|at| at.eq_ignore_ascii_case(word));
    let ended = last(b"endsolid").max(last(b"end solid"));
    ended.is_some() && ended > last(b"facet").max(last(b"vertex"))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;
    use crate::io::read::tests::tetrahedron;

    fn is_cut_off(bytes: &[u8]) -> bool {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(bytes).unwrap();
        ends_in_zeros(&file).unwrap()
    }

    #[test]
    fn zeros_are_counted_across_blocks() {
        for content in [0, 1, BLOCK - 1, BLOCK, 3 * BLOCK + 7] {
            for zeros in [0, 1, BLOCK, 2 * BLOCK + 1] {
                let bytes = [vec![7; content], vec![0; zeros]].concat();
                assert_eq!(split(&bytes), (&bytes[..content], zeros));
            }
        }
    }

    #[test]
    fn eight_records_of_zeros_look_cut_off_and_seven_do_not() {
        let file = |zeros: usize| [&[1; 84][..], tetrahedron().as_flattened(), &vec![0; zeros * 50]].concat();
        assert!(!is_cut_off(&file(0)));
        assert!(!is_cut_off(&file(7)));
        assert!(is_cut_off(&file(8)));
        assert!(is_cut_off(&file(1000)), "more than is looked at");
        assert!(!is_cut_off(b""));
        assert!(is_cut_off(&[0; 400]));
    }

    #[test]
    fn a_text_looks_cut_off_unless_it_is_complete_before_some_padding() {
        let text =
            |end: &str, zeros: usize| [b"facet normal 0 0 1\nvertex 1 2 3\nendfacet\n", end.as_bytes(), &vec![0; zeros]].concat();
        assert!(!is_cut_off(&text("endsolid part\n", 1000)));
        assert!(is_cut_off(&text("endsolid part\n", BLOCK)), "more than a block");
        assert!(is_cut_off(&text("", 1000)));
        assert!(is_cut_off(&text("endsolid\nsolid two\nfacet normal", 1000)));
    }
}
