//! One triangle as the 50 bytes of a binary STL: normal and three corners as twelve little-endian `f32`, then the attribute
//! word as `u16`. Everything in the engine refers to these bytes where they lie; nothing keeps a decoded copy of a mesh.

use crate::util::prefetch::hint;

/// The bytes of one triangle: normal at 0, corners at 12, 24 and 36, attribute at 48.
pub type Record = [u8; 50];

/// A position: x, y, z.
pub type Point = [f32; 3];

/// The `f32` at byte `at`, which is a constant wherever this is called, so that no bounds check is left.
#[inline(always)]
fn float(record: &Record, at: usize) -> f32 {
    f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]])
}

#[inline(always)]
fn point(record: &Record, at: usize) -> Point {
    [float(record, at), float(record, at + 4), float(record, at + 8)]
}

/// The three corners, in file order.
#[inline(always)]
pub fn corners(record: &Record) -> [Point; 3] {
    [point(record, 12), point(record, 24), point(record, 36)]
}

/// Asks the processor for the records that are read some time after this one in a pass over the file: its own foresight ends with
/// each page.
#[inline(always)]
pub(crate) fn prefetch_after(record: &Record) {
    /// About what is on its way at a time.
    const BYTES: usize = 1600;
    hint(record.as_ptr().wrapping_add(BYTES));
}

/// The normal as it stands in the file, which may be zero, wrong or not a number.
#[inline]
pub fn normal(record: &Record) -> Point {
    point(record, 0)
}

/// No corner has a NaN or infinite coordinate. The normal does not count.
#[inline]
pub fn all_finite(record: &Record) -> bool {
    // Without short cuts, so that it becomes a few vector instructions.
    corners(record).as_flattened().iter().fold(true, |finite, c| finite & c.is_finite())
}

/// The attribute word (colour, where a vendor put one there).
#[inline]
pub fn attribute(record: &Record) -> u16 {
    u16::from_le_bytes([record[48], record[49]])
}

/// A record with these corners and their unit normal by the right-hand rule.
#[inline]
pub fn encode(corners: [Point; 3], attribute: u16) -> Record {
    assemble(unit_normal(corners), corners, attribute)
}

/// A record of these parts as they are.
#[inline]
pub fn assemble(normal: Point, corners: [Point; 3], attribute: u16) -> Record {
    let mut record = [0; 50];
    let (words, tail) = record.as_chunks_mut::<4>();
    let values = normal.iter().chain(corners.as_flattened());
    for (word, value) in words.iter_mut().zip(values) {
        *word = value.to_le_bytes();
    }
    tail.copy_from_slice(&attribute.to_le_bytes());
    record
}

/// Puts one corner elsewhere; all else stays as it is.
pub(crate) fn put_corner(record: &mut Record, corner: usize, to: Point) {
    let words = &mut record.as_chunks_mut::<4>().0[3 + 3 * corner..6 + 3 * corner];
    for (word, value) in words.iter_mut().zip(to) {
        *word = value.to_le_bytes();
    }
}

/// The unit normal by the right-hand rule, computed in `f64` (nothing that `f32` can hold over- or underflows there); zero
/// where the cross product vanishes or a corner is not finite.
pub fn unit_normal(corners: [Point; 3]) -> Point {
    let [a, b, c] = corners.map(|p| p.map(f64::from));
    let [u, v] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
    // Zero, NaN and infinity all fail this.
    if length > 0.0 && length.is_finite() { n.map(|x| (x / length) as f32) } else { [0.0; 3] }
}

/// The same triangle seen from the other side: second and third corner swapped, attribute kept. The normal is that of the corners as they are
/// now, whatever stood there before: a stored normal may have been right while the corners were the wrong way round.
#[inline]
pub fn flip(record: &Record) -> Record {
    let [a, b, c] = corners(record);
    encode([a, c, b], attribute(record))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const CORNER: [Point; 3] = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]];

    #[test]
    fn a_triangle_in_the_plane_points_up() {
        let record = encode(CORNER, 0x1234);
        assert_eq!(normal(&record), [0.0, 0.0, 1.0]);
        assert_eq!(corners(&record), CORNER);
        assert_eq!(attribute(&record), 0x1234);
        assert_eq!(&record[48..], [0x34, 0x12], "little-endian");
        assert_eq!(record[24..28], 2f32.to_le_bytes(), "x of the second corner stands at byte 24");
    }

    #[test]
    fn a_triangle_without_area_has_no_normal() {
        for corners in [[[1.0, 2.0, 3.0]; 3], [[0.0; 3], [1.0; 3], [2.0; 3]], [[f32::NAN; 3], [1.0; 3], [2.0; 3]]] {
            assert_eq!(normal(&encode(corners, 0)), [0.0; 3]);
        }
    }

    #[test]
    fn normals_survive_the_ends_of_the_range() {
        for size in [f32::MAX, f32::MIN_POSITIVE, f32::from_bits(1)] {
            let corners = [[-size, 0.0, 0.0], [size, 0.0, 0.0], [0.0, size, 0.0]];
            assert_eq!(normal(&encode(corners, 0)), [0.0, 0.0, 1.0], "size {size:e}");
        }
    }

    /// A slicer that trusts normals counts a facet as reversed if its normal contradicts its corners.
    #[test]
    fn a_flipped_record_has_the_normal_of_its_corners_whatever_stood_there() {
        for stored in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0; 3], [f32::NAN, 7.0, 0.0]] {
            let flipped = flip(&assemble(stored, CORNER, 7));
            assert_eq!(corners(&flipped), [CORNER[0], CORNER[2], CORNER[1]]);
            assert_eq!(normal(&flipped), [0.0, 0.0, -1.0], "stored: {stored:?}");
            assert_eq!(attribute(&flipped), 7);
        }
        assert_eq!(normal(&flip(&assemble([1.0, 0.0, 0.0], [CORNER[0]; 3], 7))), [0.0; 3], "no area, no normal");
    }

    #[test]
    fn one_bad_coordinate_is_enough() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for at in 0..9 {
                let mut corners = CORNER;
                corners[at / 3][at % 3] = bad;
                assert!(!all_finite(&encode(corners, 0)));
            }
        }
        assert!(all_finite(&assemble([f32::NAN; 3], CORNER, 0)), "the normal does not count");
    }

    proptest! {
        #[test]
        fn flipping_twice_restores_corners_and_attribute(bytes: [u8; 32], rest: [u8; 18]) {
            let record: Record = [bytes.as_slice(), rest.as_slice()].concat().try_into().unwrap();
            let twice = flip(&flip(&record));
            prop_assert_eq!(&twice[12..], &record[12..], "also of what is no number");
            prop_assert_eq!(twice, encode(corners(&record), attribute(&record)));
        }

        #[test]
        fn parts_come_back_bit_for_bit(words: [u32; 12], attribute_word: u16) {
            let f = words.map(f32::from_bits);
            let parts = [[f[3], f[4], f[5]], [f[6], f[7], f[8]], [f[9], f[10], f[11]]];
            let record = assemble([f[0], f[1], f[2]], parts, attribute_word);
            let got: Vec<u32> = normal(&record).iter().chain(corners(&record).as_flattened()).map(|x| x.to_bits()).collect();
            prop_assert_eq!(got, words.to_vec());
            prop_assert_eq!(attribute(&record), attribute_word);
        }

        #[test]
        fn new_normals_are_unit_or_zero(corners: [[f32; 3]; 3]) {
            let n = normal(&encode(corners, 0)).map(f64::from);
            let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
            prop_assert!(n == [0.0; 3] || (length - 1.0).abs() < 1e-6, "length {}", length);
        }
    }
}
