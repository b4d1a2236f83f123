//! BLAKE3 of a file by blocks: a block that is another file's at the same place has the same value in the tree of hashes, and need not be
//! hashed again.
//!
//! BLAKE3 hashes 1 KiB at a time and joins the values in a binary tree, whose shape depends on the length alone (O'Connor, Aumasson, Neves,
//! Wilcox-O'Hearn, "BLAKE3", 2020, section 2.4). A block is a whole subtree.

use blake3::Hasher;
use blake3::hazmat::{ChainingValue, HasherExt, Mode, merge_subtrees_non_root, merge_subtrees_root};

/// A power of two, so that a block is a subtree; large enough for all lanes, and so small that few blocks of a repaired file changed.
pub(crate) const BLOCK: usize = 64 << 10;

/// The values of a file's blocks.
pub(crate) type Digest = Vec<ChainingValue>;

/// Bytes that the values of a file's blocks take.
pub(crate) fn heap_bytes(file_bytes: u64) -> u64 {
    file_bytes.div_ceil(BLOCK as u64) * size_of::<ChainingValue>() as u64
}

/// The value of block `number`, whose bytes these are: [`BLOCK`] of them, or what is left at the end of the file, but not none.
pub(crate) fn value(number: usize, block: &[u8]) -> ChainingValue {
    let offset = number as u64 * BLOCK as u64;
    Hasher::new().set_input_offset(offset).update(block).finalize_non_root()
}

/// The hash of a file of these blocks, in hexadecimal.
pub(crate) fn hash(file: &[u8], values: &[ChainingValue]) -> String {
    let hash = match values {
        // A single block is no subtree of anything.
        [] | [_] => blake3::hash(file),
        several => {
            let (left, right) = halves(several);
            merge_subtrees_root(&left, &right, Mode::Hash)
        }
    };
    hash.to_hex().to_string()
}

fn merged(values: &[ChainingValue]) -> ChainingValue {
    match values {
        [one] => *one,
        several => {
            let (left, right) = halves(several);
            merge_subtrees_non_root(&left, &right, Mode::Hash)
        }
    }
}

/// On the left stands the largest complete tree that leaves something to the right.
fn halves(values: &[ChainingValue]) -> (ChainingValue, ChainingValue) {
    let (left, right) = values.split_at(values.len().div_ceil(2).next_power_of_two());
    (merged(left), merged(right))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_hash_of_the_whole() {
        let bytes: Vec<u8> = (0..9 * BLOCK + 1).map(|i| ((i * i) >> 7) as u8).collect();
        for blocks in 0..=9 {
            for length in [blocks * BLOCK, (blocks * BLOCK).saturating_sub(1), blocks * BLOCK + 1] {
                let file = &bytes[..length];
                let values: Vec<ChainingValue> = file.chunks(BLOCK).enumerate().map(|(i, block)| value(i, block)).collect();
                assert_eq!(hash(file, &values), blake3::hash(file).to_hex().to_string(), "{length} bytes");
                assert_eq!(heap_bytes(length as u64), size_of_val(&values[..]) as u64);
            }
        }
    }
}
