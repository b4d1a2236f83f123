//! Which records of the input stand in the output byte for byte, in the same order.

use std::path::Path;

use super::stl::{RECORD, Records, Result};

/// A key that two records have in common if they are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Same {
    /// All 50 bytes.
    Record,
    /// The 36 bytes of the corners: another program may write its own normals and attributes.
    Corners,
}

impl Same {
    fn part(self, record: &[u8; RECORD]) -> &[u8] {
        match self {
            Self::Record => record,
            Self::Corners => &record[12..48],
        }
    }
}

/// How much of an input survived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "compare", derive(serde::Serialize, serde::Deserialize))]
pub struct Kept {
    /// Records of the input.
    pub of: u64,
    /// The records that stand in the output, in the same order.
    pub in_order: u64,
}

impl Kept {
    /// As a share; 1 of an empty input.
    pub fn share(&self) -> f64 {
        if self.of == 0 { 1.0 } else { self.in_order as f64 / self.of as f64 }
    }
}

/// Pairs the k-th occurrence of a record in `output` with the k-th in `input` and takes the longest subsequence of pairs whose
/// input numbers rise: a record that was moved far away costs one record. Records are compared by 64-bit hashes.
///
/// O(n log n) time, about 40 bytes a record of either file.
///
/// # Errors
/// As [`super::judge`], for either file.
pub fn kept_in_order(input: &Path, output: &Path, same: Same) -> Result<Kept> {
    let (before, after) = (hashes(input, same)?, hashes(output, same)?);
    let mut pairs = Vec::with_capacity(before.len().min(after.len()));
    let mut left = before.iter().peekable();
    for &(hash, position) in &after {
        while left.next_if(|other| other.0 < hash).is_some() {}
        if let Some(&(_, number)) = left.next_if(|other| other.0 == hash) {
            pairs.push((position, number));
        }
    }
    pairs.sort_unstable();
    let in_order = longest_rise(pairs.iter().map(|&(_, number)| number)) as u64;
    Ok(Kept { of: before.len() as u64, in_order })
}

/// Every record's hash and number, sorted.
fn hashes(path: &Path, same: Same) -> Result<Vec<(u64, u32)>> {
    let records = Records::open(path)?;
    let mut list = Vec::with_capacity(records.count as usize);
    records.for_each(|index, record| list.push((hash(same.part(record)), index)))?;
    list.sort_unstable();
    Ok(list)
}

/// Eight bytes at a time through the MurmurHash3 finaliser.
fn hash(record: &[u8]) -> u64 {
    let mut state = 0u64;
    for chunk in record.chunks(8) {
        let mut bytes = [0; 8];
        bytes[..chunk.len()].copy_from_slice(chunk);
        state = state.wrapping_mul(0x9FB2_1C65_1E98_DF25) ^ u64::from_le_bytes(bytes);
        state = (state ^ state >> 33).wrapping_mul(0xFF51_AFD7_ED55_8CCD);
        state = (state ^ state >> 33).wrapping_mul(0xC4CE_B9FE_1A85_EC53);
        state ^= state >> 33;
    }
    state
}

/// Length of the longest strictly rising subsequence (patience sorting; linear where the numbers already rise).
fn longest_rise(numbers: impl Iterator<Item = u32>) -> usize {
    // ends[k]: the smallest number that a rise of length k + 1 can end with.
    let mut ends: Vec<u32> = Vec::new();
    for number in numbers {
        if ends.last().is_none_or(|&last| last < number) {
            ends.push(number);
            continue;
        }
        let at = ends.partition_point(|&end| end < number);
        if let Some(end) = ends.get_mut(at) {
            *end = number;
        }
    }
    ends.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rise_skips_what_stands_out_of_order() {
        assert_eq!(longest_rise([].into_iter()), 0);
        assert_eq!(longest_rise([0, 1, 2, 3].into_iter()), 4);
        assert_eq!(longest_rise([9, 0, 1, 2, 3].into_iter()), 4);
        assert_eq!(longest_rise([3, 2, 1, 0].into_iter()), 1);
        assert_eq!(longest_rise([5, 0, 6, 1, 7, 2].into_iter()), 3);
    }

    fn file(folder: &Path, name: &str, records: &[u8]) -> std::path::PathBuf {
        let mut bytes = vec![0; 80];
        bytes.extend((records.len() as u32).to_le_bytes());
        records.iter().for_each(|&r| bytes.extend([r; RECORD]));
        let path = folder.join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    #[test]
    fn repeated_records_are_paired_one_by_one() {
        let folder = tempfile::tempdir().unwrap();
        let input = file(folder.path(), "in", &[1, 2, 2, 3, 4]);
        for (records, kept) in
            [(&[1, 2, 2, 3, 4][..], 5), (&[1, 2, 3, 4], 4), (&[2, 2, 2, 2], 2), (&[4, 1, 2, 2, 3], 4), (&[9, 8], 0), (&[], 0)]
        {
            let output = file(folder.path(), "out", records);
            assert_eq!(kept_in_order(&input, &output, Same::Record).unwrap(), Kept { of: 5, in_order: kept }, "{records:?}");
        }
    }

    #[test]
    fn corners_survive_a_change_of_attributes() {
        let folder = tempfile::tempdir().unwrap();
        let input = file(folder.path(), "in", &[1, 2, 3]);
        let mut bytes = std::fs::read(&input).unwrap();
        bytes[84 + 49] = 9;
        let output = folder.path().join("out");
        std::fs::write(&output, bytes).unwrap();
        assert_eq!(kept_in_order(&input, &output, Same::Record).unwrap().in_order, 2);
        assert_eq!(kept_in_order(&input, &output, Same::Corners).unwrap().in_order, 3);
    }
}
