//! A hash of the words of a triangle or an edge.

/// Mixes words in their order. Not for who could choose them: what comes of a collision is a wrong colour.
pub(super) fn mix(words: impl IntoIterator<Item = u32>) -> u64 {
    words.into_iter().fold(0x9E37_79B9_7F4A_7C15, |hash, word| {
        let hash = (hash ^ u64::from(word)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
        hash ^ hash >> 32
    })
}
